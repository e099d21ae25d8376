use super::*;
use crate::draws::Draws;

const NOISE_N: f64 = 0.1;
const STIFFNESS: f64 = 20e3;

/// A trace of a first-order arm on a contact with the backbone F(x) of its own: the force of the loop rises by 8 N/s, and
/// the arm yields by d dx/dt = F_a - F. Rows at 100 Hz, steps of 0.1 ms.
/// With `lag_s` the loop closes on its sensor: tau dF_a/dt = 8 t - F, and winds up.
fn trace(
    limit_n: f64,
    ratio: f64,
    sphere: bool,
    damping: f64,
    lag_s: Option<f64>,
    draws: &mut Draws,
) -> SlipTrace {
    let reach = if sphere { 1.5 } else { 1.0 } * limit_n / STIFFNESS;
    let backbone = |x: f64| {
        let share = (x / reach).min(1.0);
        limit_n * if sphere { 1.0 - (1.0 - share).powf(1.5) } else { share }
    };
    let (mut x, mut stuck, mut slid) = (0.0, 0.0, false);
    let (mut applied, mut holding) = (0.0, 0.0);
    let mut t = SlipTrace::default();
    for step in 0..(10_000.0 * (limit_n / 8.0 + 0.6)) as usize {
        let command_n = 8.0e-4 * step as f64;
        let force = if slid { ratio * limit_n } else { backbone(x) };
        match lag_s {
            None => (applied, holding) = (command_n, command_n),
            Some(lag_s) => {
                applied += 1e-4 * (command_n - force) / lag_s;
                holding += 1e-4 * (command_n - STIFFNESS * stuck) / lag_s;
            }
        }
        if step % 100 == 0 {
            t.time_s.push(1e-4 * step as f64);
            t.reading_n.push(force + NOISE_N * draws.normal());
            t.stuck_n.push(STIFFNESS * stuck);
        }
        x += 1e-4 * (applied - force) / damping;
        stuck += 1e-4 * (holding - STIFFNESS * stuck) / damping;
        if x >= reach && !slid {
            slid = true;
            t.slip_s = 1e-4 * step as f64;
        }
    }
    t
}

fn slips(ratio: f64, sphere: bool, damping: f64, seed: u64) -> (Slips, f64) {
    slips_with(ratio, sphere, damping, None, seed)
}

fn slips_with(ratio: f64, sphere: bool, damping: f64, lag_s: Option<f64>, seed: u64) -> (Slips, f64) {
    let mut draws = Draws::new(seed, 0);
    let limits: Vec<f64> = (0..14).map(|i| 8.0 + 1.3 * f64::from(i)).collect();
    let traces: Vec<SlipTrace> =
        limits.iter().map(|l| trace(*l, ratio, sphere, damping, lag_s, &mut draws)).collect();
    let rig = SlipRig {
        noise_n: NOISE_N,
        relaxation_s: damping / STIFFNESS,
        fall_s: 0.0,
        winds_per_s: lag_s.map_or(0.0, |lag_s| 1.0 / lag_s),
    };
    let found = read_slips(&traces, rig).unwrap();
    let error = found.limits.iter().zip(&limits).map(|(f, l)| f.value_n / l - 1.0).sum::<f64>() / 14.0;
    (found, error)
}

/// Contacts that give way at once and spheres, with and without a drop, on a slow arm and on a fast one.
#[test]
fn limits_and_ratio_come_back_from_every_contact() {
    for (ratio, sphere, damping, most) in [
        (1.0, false, 1000.0, 0.004),
        (0.9, false, 1000.0, 0.002),
        (1.0, true, 1000.0, 0.004),
        (0.9, true, 1000.0, 0.006),
        (0.85, false, 100.0, 0.002),
        (0.85, true, 100.0, 0.003),
    ] {
        let (found, error) = slips(ratio, sphere, damping, 3);
        assert!(error.abs() < most, "{ratio} {sphere} {damping}: limits off by {error}");
        assert!((found.ratio - ratio).abs() < most, "{ratio} {sphere} {damping}: ratio {}", found.ratio);
    }
}

/// A loop that closes on its sensor winds up over what the rim lets go, and pulls harder for it.
#[test]
fn limits_and_ratio_come_back_from_a_loop_that_winds_up() {
    for (ratio, damping) in [(1.0, 1000.0), (0.9, 1000.0), (1.0, 400.0)] {
        let (found, error) = slips_with(ratio, true, damping, Some(0.05), 3);
        assert!(error.abs() < 0.006, "{ratio} {damping}: limits off by {error}");
        assert!((found.ratio - ratio).abs() < 0.006, "{ratio} {damping}: ratio {}", found.ratio);
    }
}

/// Without a drop the interval reaches 1 and is short.
#[test]
fn a_ratio_of_one_is_inside_its_interval() {
    let held = (0..20).filter(|seed| slips(1.0, false, 200.0, *seed).0.ratio90().1 > 0.9999).count();
    assert!(held >= 16, "{held} of 20");
    let (low, high) = slips(1.0, false, 200.0, 1).0.ratio90();
    assert!(high - low < 0.02 && low < 0.9995, "{low} {high}");
}
