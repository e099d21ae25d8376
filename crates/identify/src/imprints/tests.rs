//! Sets of imprints that were made here, with formulas of their own.

use super::*;
use crate::diagnosis::{Diagnosis, Verdict};
use crate::draws::Draws;

/// What a set is made with.
#[derive(Clone, Copy)]
struct World {
    grasps: usize,
    exponent: f64,
    /// The force is read so much later than the picture.
    delay_s: f64,
    /// Share of the force that relaxes, with a time constant of 0.8 s.
    relaxes: f64,
    /// Noise of a volume in mm^3, of about 200 at the peak.
    noise_mm3: f64,
    seed: u64,
}

const PLAIN: World = World { grasps: 6, exponent: 1.0, delay_s: 0.0, relaxes: 0.0, noise_mm3: 3.0, seed: 1 };

/// Force at a time: up to a peak, a hold, and down, each grasp at its own speed.
fn force_n(grasp: usize, t: f64) -> f64 {
    let (peak, rise) = (20.0 + 3.0 * (grasp % 3) as f64, 0.5 + 0.15 * grasp as f64);
    let up = (t - 0.2).clamp(0.0, rise) / rise;
    let down = (t - 2.0).clamp(0.0, 0.4) / 0.4;
    peak * (up - down)
}

/// Adds a row to the grasp whose name comes next.
fn add_row(
    data: &mut ImprintData,
    force_n: f64,
    volume_mm3: f64,
    time_s: f64,
    (part, session): (&str, &str),
) {
    data.ids.push(data.ids.len().to_string());
    data.grip_force_n.push(force_n);
    data.volume_mm3.push(volume_mm3);
    data.time_s.push(time_s);
    data.grasp.push(data.grasps.len());
    data.part.push(part.into());
    data.session.push(session.into());
}

fn made(world: World) -> ImprintData {
    let mut data = ImprintData::default();
    let mut draws = Draws::new(world.seed, 5);
    for g in 0..world.grasps {
        let c = 8.0 * (1.0 + 0.15 * draws.normal());
        // A standard linear solid, integrated in small steps: w follows the force that presses.
        let (mut w, step) = (0.0, 1.0 / 3000.0);
        for k in 0..7500 {
            let t = f64::from(k) * step;
            let true_n = force_n(g, t);
            let pressing = true_n + world.relaxes * w;
            w += step / 0.8 * (pressing - w);
            if k % 100 != 0 {
                continue;
            }
            let volume = c * 20.0 * (pressing.max(0.0) / 20.0).powf(world.exponent);
            let part = if g % 2 == 0 { "ball" } else { "cone" };
            let session = if g < world.grasps / 2 { "1" } else { "2" };
            let measured = volume + world.noise_mm3 * draws.normal();
            add_row(&mut data, force_n(g, t - world.delay_s), measured, t, (part, session));
        }
        data.grasps.push(format!("grasp {g}"));
    }
    data
}

fn rmse(d: &Diagnosis) -> [f64; 2] {
    let error = d.error.as_ref().unwrap();
    [error.before.rmse_mm3.unwrap(), error.after.rmse_mm3.unwrap()]
}

#[test]
fn a_line_is_nothing_and_its_error_is_its_noise() {
    let answer = diagnose_imprints(&made(PLAIN));
    let d = &answer.diagnosis;
    assert_eq!((d.verdict, d.effects.len(), d.unknown.len()), (Verdict::None, 0, 0), "{d:?}");
    let [before, after] = rmse(d);
    assert!(before == after && (2.7..3.4).contains(&before), "{before}");
    assert!(d.noise_floor_mm3.is_some_and(|f| (2.7..3.3).contains(&f)));
    assert!(answer.effects.is_empty() && answer.grasps.len() == 6);
    let exponent = &d.would_have_seen["imprint_nonlinearity"];
    assert!((1.0..1.2).contains(&exponent.value), "{exponent:?}");
}

#[test]
fn each_effect_is_named_with_its_value() {
    for (world, name, parameter, value, near) in [
        (World { exponent: 0.75, ..PLAIN }, "imprint_nonlinearity", "exponent", 0.75, 0.03),
        (World { exponent: 1.25, ..PLAIN }, "imprint_nonlinearity", "exponent", 1.25, 0.04),
        (World { delay_s: 0.08, ..PLAIN }, "imprint_delay", "delay_s", 0.08, 0.01),
        (World { delay_s: -0.06, ..PLAIN }, "imprint_delay", "delay_s", -0.06, 0.01),
        (World { relaxes: 0.15, ..PLAIN }, "grip_relaxation", "depth", 0.15, 0.05),
    ] {
        let d = diagnose_imprints(&made(world)).diagnosis;
        assert_eq!(d.verdict, Verdict::Effect, "{name} {value}: {:?} {:?}", d.hints, d.unknown);
        assert_eq!(d.names(), [name], "{value}: {:?}", d.effects);
        let found = &d.effects[0].parameters[parameter];
        assert!((found.value - value).abs() < near, "{name}: {found:?}");
        assert!(found.low90 <= found.value && found.value <= found.high90);
        let [before, after] = rmse(&d);
        assert!(after < 3.6 && before > 1.15 * after, "{name}: {before} {after}");
    }
}

/// Left out, the delay makes an exponent of 1.2 look like one below 1 (as on real grasps): both are found together.
#[test]
fn a_delay_and_a_power_are_found_together() {
    let world = World { exponent: 1.2, delay_s: 0.1, ..PLAIN };
    let d = diagnose_imprints(&made(world)).diagnosis;
    assert_eq!(d.names(), ["imprint_delay", "imprint_nonlinearity"], "{:?} {:?}", d.effects, d.hints);
    let of = |name: &str, parameter: &str| {
        d.effects.iter().find(|e| e.name == name).unwrap().parameters[parameter].value
    };
    assert!((of("imprint_delay", "delay_s") - 0.1).abs() < 0.01);
    assert!((of("imprint_nonlinearity", "exponent") - 1.2).abs() < 0.05);
    let by = d.error.as_ref().unwrap().by;
    let (levels, sessions) = (by.levels.unwrap(), by.sessions.unwrap());
    for pair in [levels, sessions] {
        assert!(pair.after.rmse_mm3.unwrap() < 0.5 * pair.before.rmse_mm3.unwrap(), "{pair:?}");
    }
}

/// Two grasps only: stretches are held out.
#[test]
fn two_grasps_still_show_a_delay() {
    let d = diagnose_imprints(&made(World { grasps: 2, delay_s: 0.1, ..PLAIN })).diagnosis;
    assert_eq!(d.names(), ["imprint_delay"], "{:?}", d.hints);
    assert_eq!(d.error.unwrap().heldout, "stretches");
}

#[test]
fn a_hidden_covariate_is_unknown_and_no_effect() {
    let mut data = made(PLAIN);
    let mut draws = Draws::new(3, 9);
    // The lamp flickers from third to third of a second.
    let mut lamp = 0.0;
    let mut lamps = Vec::new();
    for (i, v) in data.volume_mm3.iter_mut().enumerate() {
        if i % 10 == 0 {
            lamp = draws.normal();
        }
        lamps.push(lamp);
        *v += 6.0 * lamp;
    }
    data.extra.push(("lamp_v".into(), Covariate::Number(lamps)));
    let d = diagnose_imprints(&data).diagnosis;
    assert_eq!(d.verdict, Verdict::Unknown, "{:?}", d.effects);
    assert_eq!(d.unknown[0].covariate, "lamp_v", "{:?}", d.unknown);
}

#[test]
fn too_little_is_insufficient_and_says_what_is_missing() {
    let mut few = made(World { grasps: 1, ..PLAIN });
    let keep = |list: &mut Vec<f64>| list.truncate(8);
    [&mut few.grip_force_n, &mut few.volume_mm3, &mut few.time_s].into_iter().for_each(keep);
    for list in [&mut few.ids, &mut few.part, &mut few.session] {
        list.truncate(8);
    }
    few.grasp.truncate(8);
    for data in [few, ImprintData::default()] {
        let d = diagnose_imprints(&data).diagnosis;
        assert_eq!(d.verdict, Verdict::Insufficient);
        assert!(!d.notes.is_empty() && d.error.is_none());
    }
    let mut one_force = made(World { grasps: 3, ..PLAIN });
    one_force.grip_force_n.iter_mut().for_each(|f| *f = 20.0);
    let d = diagnose_imprints(&one_force).diagnosis;
    assert!(d.verdict == Verdict::Insufficient && d.notes[0].contains("1.5"), "{:?}", d.notes);
}

/// Grasps of one row share the constant of their part: a power of the force shows in them, what needs time does not.
#[test]
fn single_rows_show_a_power_and_no_time() {
    let mut data = ImprintData::default();
    let mut draws = Draws::new(7, 2);
    for i in 0..40 {
        let force = 5.0 + 1.8 * f64::from(i);
        let volume = 3.0 * force.powf(0.8) * (1.0 + 0.02 * draws.normal());
        add_row(&mut data, force, volume, f64::NAN, ("ball", ""));
        data.grasps.push(i.to_string());
    }
    let d = diagnose_imprints(&data).diagnosis;
    assert_eq!(d.names(), ["imprint_nonlinearity"], "{:?}", d.hints);
    assert!((d.effects[0].parameters["exponent"].value - 0.8).abs() < 0.02);
    assert!(d.notes.iter().any(|n| n.contains("share one constant")), "{:?}", d.notes);
}

/// Means by hand: three grasps of 1, 2 and 4 mm^3/N have a geometric mean of 2.
#[test]
fn constants_of_parts_are_means_of_grasps() {
    let mut data = ImprintData::default();
    for (g, c) in [1.0, 2.0, 4.0].into_iter().enumerate() {
        for k in 1..=6 {
            let force = 5.0 * f64::from(k);
            add_row(&mut data, force, c * force, f64::from(k), ("ball", ""));
        }
        data.grasps.push(g.to_string());
    }
    let found = calibrate_imprint_set(&data, SharedConstant::Grasp).unwrap();
    let part = &found.parts[0];
    assert!((part.imprint_mm3_per_n.value - 2.0).abs() < 1e-12 && part.grasps == 3);
    // ln 2 apart: standard deviation ln 2, t(2) = 2.92.
    let half = 2.919_986 * 2f64.ln() / 3f64.sqrt();
    assert!((part.imprint_mm3_per_n.high90.ln() - 2f64.ln() - half).abs() < 1e-9);
    assert!((part.grasp_sd.unwrap() - 2f64.ln()).abs() < 1e-12);
    let all = calibrate_imprint_set(&data, SharedConstant::Part).unwrap();
    assert!((all.parts[0].imprint_mm3_per_n.value - 7.0 / 3.0).abs() < 1e-12);
    let compared = compare_imprints(&data, &[]).unwrap();
    assert!(compared.n == 18 && compared.rmse_mm3 < 1e-12);
    assert!(calibrate_imprint_set(&ImprintData::default(), SharedConstant::Grasp).is_err());
}

/// Sets without any effect, noise that lasts for some rows as that of cameras does: 60 of them, 3 names at most.
#[test]
#[ignore = "slow: 60 diagnoses"]
fn false_names_are_rare() {
    let mut named = 0;
    let mut unknown = 0;
    for seed in 0..60 {
        // Every third set has two grasps only.
        let grasps = if seed % 3 == 0 { 2 } else { 6 };
        let mut data = made(World { seed: 100 + seed, noise_mm3: 1.0, grasps, ..PLAIN });
        let mut draws = Draws::new(seed, 77);
        let mut slow = 0.0;
        for v in &mut data.volume_mm3 {
            slow = 0.8 * slow + 3.0 * draws.normal();
            *v += slow;
        }
        let d = diagnose_imprints(&data).diagnosis;
        named += usize::from(!d.effects.is_empty());
        unknown += usize::from(!d.unknown.is_empty());
    }
    println!("{named} of 60 with a name, {unknown} with an unknown covariate");
    assert!(named <= 3 && unknown <= 6, "{named} {unknown}");
}
