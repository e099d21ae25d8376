//! What every effect must keep, and what a twin makes of its effects.

mod catalogue;

use super::testing::{grip, twin};
use super::*;
use crate::{
    ContactPatch, Covariates, FrictionError, Jaw, OpticsState, PressureCell, Twin, cell_friction,
    grip_friction,
};

/// The start of a pull at this time of the campaign.
fn at_clock(clock_s: f64) -> SensorPoint {
    SensorPoint { clock_s, ..SensorPoint::default() }
}

/// Circumstances from one end to the other.
fn circumstances() -> Vec<Covariates> {
    let base = Covariates { pull_index: 0, dwell_s: 0.0, ..Default::default() };
    vec![
        base.clone(),
        Covariates { pull_index: 3, dwell_s: 0.7, grip_angle_rad: 0.6, temperature_c: 19.7, ..base.clone() },
        Covariates {
            pull_index: 4321,
            dwell_s: 90.0,
            grip_offset_m: -7.3e-3,
            grip_angle_rad: -1.2,
            temperature_c: 31.0,
            pull_direction: -1.0,
            ..base
        },
    ]
}

/// Calls `check` for both jaws on a grid of forces, rates and circumstances.
fn each_grip(mut check: impl FnMut(&GripPoint<'_>)) {
    for covariates in &circumstances() {
        for grip_force_n in [0.0, 0.1, 5.0, 20.0, 33.3, 80.0, 400.0] {
            for pull_rate_n_per_s in [0.0, 0.9, 9.6, 200.0] {
                for jaw in Jaw::BOTH {
                    check(&GripPoint { jaw, pull_rate_n_per_s, ..grip(covariates, grip_force_n) });
                }
            }
        }
    }
}

const FRICTION: [f64; 6] = [0.0, 0.14, 0.168, 1.0 / 3.0, 1.7, 5.0];
const FORCES_N: [f64; 9] = [0.0, -0.0, 0.3, 1.0, 7.7, 3.1, -2.0, 80.0, 123.4];

/// Calls every hook of a spec on the grid with (hook, input, output).
fn each_call(spec: &EffectSpec, parameters: &[f64], mut check: impl FnMut(&str, f64, f64)) {
    each_grip(|at| {
        if let Some(hook) = spec.friction {
            FRICTION.iter().for_each(|&mu| check("friction", mu, hook(parameters, mu, at)));
        }
        if let Some(hook) = spec.normal_force {
            check("normal_force", at.grip_force_n, hook(parameters, at.grip_force_n, at));
        }
        if let Some(hook) = spec.imprint_volume {
            let volume_m3 = 1.5e-9 * at.grip_force_n;
            check("imprint_volume", volume_m3, hook(parameters, volume_m3, at.grip_force_n));
        }
        if let Some(hook) = spec.creep {
            FORCES_N.iter().for_each(|&force_n| {
                // A reading below nothing makes a speed of -0, which adds nothing.
                let way = 1.0 + hook(parameters, at).speed_m_per_s(force_n, 0.4 * at.grip_force_n);
                check("creep", 1.0, way);
            });
        }
        if let Some(hook) = spec.tilt_rad {
            check("tilt_rad", 0.0, hook(parameters, at));
        }
        if let Some(hook) = spec.optics {
            // On top of nothing, and on top of another effect.
            let other = OpticsState { light_gain: [0.9; 3], gamma: 1.2, scale: 0.97, ..Default::default() };
            for before in [OpticsState::default(), other] {
                let mut after = before;
                hook(parameters, &mut after, at);
                for (x, y) in numbers(&before).into_iter().zip(numbers(&after)) {
                    check("optics", x, y);
                }
            }
        }
    });
    for start_s in [0.0, 7200.0] {
        if let Some(hook) = spec.sensor {
            let mut memory = SensorMemory::default();
            for (i, &force_n) in FORCES_N.iter().enumerate() {
                let at =
                    SensorPoint { clock_s: start_s + i as f64 * 0.002, since_zero_s: 0.0, step_s: 0.002 };
                check("sensor", force_n, hook(parameters, force_n, &mut memory, &at));
            }
        }
    }
    if let Some(hook) = spec.grasp_force {
        let time_s: Vec<f64> = (0..FORCES_N.len()).map(|i| 0.07 * i as f64).collect();
        let held = [40.0; FORCES_N.len()];
        for force_n in [&FORCES_N, &held] {
            for (before, after) in force_n.iter().zip(hook(parameters, &time_s, force_n)) {
                check("grasp_force", *before, after);
            }
        }
    }
    if let Some(hook) = spec.command {
        for desired_n in FORCES_N {
            FORCES_N.iter().for_each(|&m| check("command", desired_n, hook(parameters, desired_n, m)));
        }
    }
}

/// Every number of the optics of a jaw.
fn numbers(state: &OpticsState) -> Vec<f64> {
    let OpticsState {
        light_gain,
        background,
        finer_background,
        exposure_gain,
        gamma,
        shift_m,
        rotation_rad,
        scale,
        distortion_k1,
        frame_moves,
        defocus_m,
        kernel_scale,
        part_offset_m,
        edge_blunting_m,
        rest_offset,
        shadow_strength,
        light_elevation_rad,
        dome_sag_m,
        press_factor,
        press_offset_m,
        edge_rounding_m,
        relief_m,
        relief_key: _,
    } = *state;
    let mut all = vec![exposure_gain, gamma, rotation_rad, scale, distortion_k1, defocus_m, kernel_scale];
    all.extend([part_offset_m, edge_blunting_m, shadow_strength, light_elevation_rad, dome_sag_m]);
    all.extend([press_factor, press_offset_m, edge_rounding_m, relief_m, frame_moves]);
    all.extend(finer_background.into_iter().flatten());
    all.extend(
        light_gain.into_iter().chain(shift_m).chain(rest_offset).chain(background.into_iter().flatten()),
    );
    all
}

fn neutral(spec: &EffectSpec) -> Vec<f64> {
    spec.parameters.iter().map(|p| p.neutral).collect()
}

#[test]
fn ids_and_parameter_names_are_unique_and_neutral_values_lie_inside_the_bounds() {
    for (i, spec) in LIBRARY.iter().enumerate() {
        assert!(LIBRARY[i + 1..].iter().all(|other| other.id != spec.id), "{} twice", spec.id);
        assert_eq!(find(spec.id), Some(*spec));
        for text in [spec.about, spec.formula, spec.source] {
            assert!(!text.is_empty() && text.is_ascii(), "{}: {text}", spec.id);
        }
        for (j, p) in spec.parameters.iter().enumerate() {
            assert!(spec.parameters[j + 1..].iter().all(|other| other.name != p.name));
            assert!(p.bounds.0 <= p.neutral && p.neutral <= p.bounds.1, "{}.{}", spec.id, p.name);
        }
        assert!(spec.references.iter().all(|name| spec.parameters.iter().any(|p| p.name == *name)));
        assert!(spec.references.len() < spec.parameters.len(), "{} has nothing to fit", spec.id);
    }
}

/// Every corner of the bounds of a spec's parameters; of one with many, those with one or all but one at the other end.
fn corners(spec: &EffectSpec) -> impl Iterator<Item = Vec<f64>> {
    let n = spec.parameters.len();
    let few: Vec<u128> = if n <= 6 {
        (0..1 << n).collect()
    } else {
        (0..n).map(|i| 1 << i).flat_map(|one| [one, !one, 0, !0]).collect()
    };
    few.into_iter().map(|corner| {
        let end =
            |(i, p): (usize, &ParameterSpec)| if corner >> i & 1 == 0 { p.bounds.0 } else { p.bounds.1 };
        spec.parameters.iter().enumerate().map(end).collect()
    })
}

/// At its neutral values an effect returns its input bit for bit. Where its sizes are neutral, the other parameters do not
/// matter.
#[test]
fn neutral_parameters_change_nothing_bitwise() {
    for spec in LIBRARY {
        let mut calls = 0;
        let without_size = |mut parameters: Vec<f64>| {
            parameters.iter_mut().zip(spec.parameters).take(spec.sizes).for_each(|(x, p)| *x = p.neutral);
            parameters
        };
        for parameters in corners(spec).map(without_size) {
            each_call(spec, &parameters, |hook, before, after| {
                calls += 1;
                let same = after.to_bits() == before.to_bits();
                assert!(same, "{}.{hook} at {parameters:?}: {before} -> {after}", spec.id);
            });
        }
        assert!(calls > 0, "{} has no hook", spec.id);
    }
}

/// At every corner of its bounds an effect stays finite, and a normal force or volume is never negative.
#[test]
fn results_stay_finite_at_the_bounds() {
    for spec in LIBRARY {
        for parameters in corners(spec) {
            each_call(spec, &parameters, |hook, before, after| {
                assert!(after.is_finite(), "{}.{hook} at {parameters:?}: {before} -> {after}", spec.id);
                let forbidden = ["normal_force", "imprint_volume"].contains(&hook) && after < 0.0;
                assert!(!forbidden, "{}.{hook} at {parameters:?}: {before} -> {after}", spec.id);
            });
        }
    }
}

/// Every effect at its neutral values in one twin: the twin without effects, bit for bit.
#[test]
fn a_twin_of_neutral_effects_is_the_twin_without_effects() {
    let plain = twin("").unwrap();
    let list: String = LIBRARY.iter().map(|s| format!("[[effects]]\nname = \"{}\"\n", s.id)).collect();
    let neutral_twin = twin(&list).unwrap();
    assert_eq!(neutral_twin.effects.len(), LIBRARY.len());
    for (effect, spec) in neutral_twin.effects.iter().zip(LIBRARY) {
        assert_eq!(effect.values, neutral(spec));
    }
    let both = |f: &dyn Fn(&Twin) -> f64| (f(&plain).to_bits(), f(&neutral_twin).to_bits());
    each_grip(|at| {
        let part = &plain.parts["rod"];
        let equal = |(a, b): (u64, u64)| assert_eq!(a, b, "{at:?}");
        equal(both(&|t| grip_friction(t, "rod", part, at).unwrap().mu));
        equal(both(&|t| normal_force_n(t, "rod", at)));
        equal(both(&|t| imprint_volume_m3(t, "rod", part, at.jaw, at.grip_force_n)));
        equal(both(&|t| jaw_tilt_rad(t, "rod", at)));
        assert_eq!(optics_state(&neutral_twin, "rod", at), OpticsState::default());
        assert!(optics_state(&plain, "rod", at).is_neutral());
    });
    let mut chains = [
        SensorChain::new(&plain, "rod", at_clock(5.0)),
        SensorChain::new(&neutral_twin, "rod", at_clock(5.0)),
    ];
    for direction in [1.0, -1.0] {
        chains = chains.map(|chain| chain.along(direction));
        for (i, force_n) in FORCES_N.into_iter().enumerate() {
            let read = chains.each_mut().map(|c| c.read(force_n, i as f64 * 0.002, 0.002).to_bits());
            assert_eq!(read, [force_n.to_bits(); 2]);
            let command = CommandChain::new(&neutral_twin, "rod").apply(force_n, 3.0);
            assert_eq!(command.to_bits(), force_n.to_bits());
        }
    }
    assert_eq!(SensorChain::default().read(-0.0, 1.0, 0.002).to_bits(), f64::to_bits(-0.0));
    assert_eq!(CommandChain::default().apply(4.0, 3.0), 4.0);
}

#[test]
fn effects_act_in_the_order_of_the_twin_and_on_their_part() {
    let bias = "[[effects]]\nname = \"sensor_bias\"\nbias_n = 2.0\n";
    let gain = "[[effects]]\nname = \"sensor_gain\"\ngain = 0.5\npart = \"rod\"\n";
    let read = |effects: &str, part| {
        SensorChain::new(&twin(effects).unwrap(), part, at_clock(0.0)).read(10.0, 0.0, 0.002)
    };
    assert_eq!(read(&format!("{bias}{gain}"), "rod"), 6.0);
    assert_eq!(read(&format!("{gain}{bias}"), "rod"), 7.0);
    assert_eq!(read(&format!("{gain}{bias}"), "plate"), 12.0);
    let drift = "[[effects]]\nname = \"sensor_drift\"\nrate_n_per_h = 1.0\n";
    let mut later = SensorChain::new(&twin(drift).unwrap(), "rod", at_clock(1800.0));
    assert_eq!(later.read(10.0, 1800.0, 0.002), 11.0, "the clock is that of the campaign");
}

/// What an optics effect does to one part it does not do to another, and forces do not see it.
#[test]
fn optics_effects_act_on_their_part_and_on_no_force() {
    let list: String = LIBRARY
        .iter()
        .filter(|spec| spec.optics.is_some())
        .map(|spec| {
            let largest = |p: &ParameterSpec| format!("{} = {:?}\n", p.name, 0.5 * (p.neutral + p.bounds.1));
            let values: String = spec.parameters.iter().map(largest).collect();
            format!("[[effects]]\nname = \"{}\"\npart = \"rod\"\n{values}", spec.id)
        })
        .collect();
    let (plain, seen) = (twin("").unwrap(), twin(&list).unwrap());
    assert_eq!(seen.effects.len(), 13);
    each_grip(|at| {
        assert!(
            !optics_state(&seen, "rod", at).is_neutral() && optics_state(&seen, "plate", at).is_neutral()
        );
        let part = &plain.parts["rod"];
        let all = |t: &Twin| {
            let mu = grip_friction(t, "rod", part, at).unwrap().mu;
            (
                mu,
                normal_force_n(t, "rod", at),
                imprint_volume_m3(t, "rod", part, at.jaw, 40.0),
                jaw_tilt_rad(t, "rod", at),
            )
        };
        assert_eq!(all(&plain), all(&seen));
    });
    assert!(SensorChain::new(&seen, "rod", at_clock(5.0)).is_identity());
    for spec in LIBRARY.iter().filter(|spec| spec.optics.is_some()) {
        let others = [spec.friction.is_some(), spec.normal_force.is_some(), spec.imprint_volume.is_some()];
        assert!(!others.contains(&true) && spec.sensor.is_none() && spec.command.is_none(), "{}", spec.id);
    }
}

/// A law of the load sees the normal force that is left, and its range is that of the commanded force.
#[test]
fn friction_laws_see_the_real_normal_force() {
    let loss = "[[effects]]\nname = \"grip_force_loss\"\nloss_n = 2.0\n";
    let law = "[[effects]]\nname = \"load_offset\"\nb_n = -1.0\nfitted_grip_force_n = [5.0, 80.0]\n\
               outside_fit = \"error\"\n";
    let twin = twin(&format!("{law}{loss}")).unwrap();
    let c = Covariates::default();
    let friction = |force_n| grip_friction(&twin, "rod", &twin.parts["rod"], &grip(&c, force_n));
    let found = friction(6.0).unwrap();
    assert!((found.mu - 0.3 * (1.0 - 1.0 / 4.0)).abs() < 1e-15 && !found.outside_fit);
    assert!(
        matches!(friction(4.9), Err(FrictionError::OutsideFit { grip_force_n, .. }) if grip_force_n == 4.9)
    );
}

/// A patch of two cells of 50 mm2 with 10 and 30 N, and an empty one.
fn patch() -> ContactPatch {
    let cell = |x_m, force_n, area_m2| PressureCell { x_m, y_m: 0.0, area_m2, force_n };
    ContactPatch {
        cells: vec![cell(-5e-3, 10.0, 5e-5), cell(5e-3, 30.0, 5e-5), cell(0.0, 0.0, 0.0)],
        ..Default::default()
    }
}

#[test]
fn without_a_law_per_cell_every_cell_has_the_coefficient_of_the_jaw() {
    let twin = twin("[[effects]]\nname = \"load_power_law\"\nn = -0.3").unwrap();
    let c = Covariates::default();
    let at = grip(&c, 40.0);
    let jaw = grip_friction(&twin, "rod", &twin.parts["rod"], &at).unwrap();
    let (cells, same) = cell_friction(&twin, "rod", &twin.parts["rod"], &at, &patch()).unwrap();
    assert_eq!((cells, same), (vec![jaw.mu; 3], jaw));
}

#[test]
fn a_law_per_cell_follows_the_pressure_and_never_goes_below_zero() {
    let of = |effects: &str| {
        let twin = twin(effects).unwrap();
        let c = Covariates::default();
        let at = grip(&c, 40.0);
        cell_friction(&twin, "rod", &twin.parts["rod"], &at, &patch()).unwrap()
    };
    // Pressures 0.2 and 0.6 MPa on 100 mm2 are 20 and 60 N.
    let (cells, jaw) = of("[[effects]]\nname = \"load_offset\"\nb_n = -12.0\nper = \"cell\"\n\
                           reference_area_mm2 = 100");
    assert!((cells[0] - 0.3 * 0.4).abs() < 1e-12 && (cells[1] - 0.3 * 0.8).abs() < 1e-12);
    assert!((jaw.mu - 0.3 * 0.7).abs() < 1e-12, "the mean over the normal force");
    // b_n / A_ref is a shear stress: the friction force is that of the law per jaw on the same area.
    let friction_n: f64 = cells.iter().zip(&patch().cells).map(|(mu, cell)| mu * cell.force_n).sum();
    assert!((friction_n - 0.3 * (40.0 - 12.0)).abs() < 1e-12);
    let (cells, _) = of("[[effects]]\nname = \"load_offset\"\nb_n = -30.0\nper = \"cell\"\n\
                         reference_area_mm2 = 100\noutside_fit = \"error\"");
    assert_eq!(cells[0], 0.0);
    assert!((cells[1] - 0.15).abs() < 1e-12);
    // A law of the jaw after it acts on every cell.
    let (cells, _) = of("[[effects]]\nname = \"load_offset\"\nb_n = -12.0\nper = \"cell\"\n\
                         reference_area_mm2 = 100\n[[effects]]\nname = \"contamination\"\ndrop = 0.5");
    assert!((cells[0] - 0.06).abs() < 1e-12 && (cells[1] - 0.12).abs() < 1e-12);
}

/// Without the cells, the law is taken at the mean pressure; held to its range, at the ends of that.
#[test]
fn a_law_per_cell_on_a_jaw_takes_the_mean_pressure() {
    let law = "[[effects]]\nname = \"load_offset\"\nb_n = -12.0\nper = \"cell\"\nreference_area_mm2 = 50\n";
    let of = |effects: &str, contact_area_m2| {
        let twin = twin(effects).unwrap();
        let c = Covariates::default();
        let at = GripPoint { contact_area_m2, ..grip(&c, 40.0) };
        grip_friction(&twin, "rod", &twin.parts["rod"], &at).unwrap().mu
    };
    assert!((of(law, 1e-4) - 0.3 * (1.0 - 12.0 / 20.0)).abs() < 1e-12);
    assert!((of(law, 0.0) - 0.3 * (1.0 - 12.0 / 40.0)).abs() < 1e-12, "no area, the law of the jaw");
    let held = format!("{law}outside_fit = \"hold\"\nfitted_grip_force_n = [30.0, 80.0]");
    assert!((of(&held, 1e-4) - 0.3 * (1.0 - 12.0 / 30.0)).abs() < 1e-12);
}

#[test]
fn only_laws_of_the_load_are_taken_per_cell_and_only_with_an_area() {
    let per_cell = |name: &str| {
        twin(&format!("[[effects]]\nname = \"{name}\"\nper = \"cell\"\nreference_area_mm2 = 100"))
    };
    for spec in LIBRARY {
        let allowed =
            ["load_offset", "load_power_law", "area_saturation", "regime_transition"].contains(&spec.id);
        match per_cell(spec.id) {
            Ok(twin) => {
                assert!(allowed, "{}", spec.id);
                assert!((twin.effects[0].cell_area_m2().unwrap() - 1e-4).abs() < 1e-15);
            }
            Err(error) => {
                assert!(!allowed && error.key == "effects[0].per", "{error}");
                assert!(spec.of_pressure || error.hint.unwrap().contains("load_power_law"));
            }
        }
    }
    let error = |keys: &str| twin(&format!("[[effects]]\nname = \"load_offset\"\n{keys}")).unwrap_err();
    assert_eq!(error("per = \"cell\"").key, "effects[0].reference_area_mm2");
    assert_eq!(error("reference_area_mm2 = 100").key, "effects[0].reference_area_mm2");
    assert_eq!(error("per = \"cell\"\nreference_area_mm2 = 0").key, "effects[0].reference_area_mm2");
    assert_eq!(error("per = \"cells\"").key, "effects[0].per");
    assert_eq!(twin("[[effects]]\nname = \"load_offset\"\nper = \"jaw\"").unwrap().effects[0].per, Per::Jaw);
}

/// What a pull session holds of them has to travel between threads and be copied.
#[test]
fn chains_are_clone_and_send() {
    fn check<T: Clone + Send + std::fmt::Debug + Default>() {}
    check::<SensorChain>();
    check::<CommandChain>();
    let twin = twin("[[effects]]\nname = \"sensor_lowpass\"\ntau_s = 0.02").unwrap();
    let mut chain = SensorChain::new(&twin, "rod", at_clock(0.0));
    chain.read(0.0, 0.0, 0.002);
    let mut copy = chain.clone();
    assert_eq!(chain.read(10.0, 0.002, 0.002), copy.read(10.0, 0.002, 0.002), "a copy has the same memory");
}
