//! The reduced mechanics against closed forms, and against Rapier.

use super::*;
use crate::FrictionCell;

fn bench(shape: PartShape, grip_force_n: f64) -> Bench {
    Bench { mechanics: Mechanics::Reduced, ..Bench::new(shape, grip_force_n) }
}

/// A session whose patches have cells of unequal pressure, as under a round part.
fn session_with_cells(bench: &Bench, mu: f64, cells: usize, kinetic_ratio: f64) -> PullSession {
    let weight = |i: usize| 1.0 - ((i as f64 + 0.5) / cells as f64 * 2.0 - 1.0).powi(2);
    let sum: f64 = (0..cells).map(weight).sum();
    let friction = JawFriction {
        cells: (0..cells)
            .map(|i| FrictionCell { limit_n: mu * bench.grip_force_n * weight(i) / sum, area_m2: 1e-6 })
            .collect(),
        kinetic_ratio,
        kinetic_fall_s: 0.0,
        shear_by_area: 1.0,
    };
    let noise = Stream::new(1, 2, Purpose::ForceNoise);
    bench.held().pull(&PerJaw { left: friction.clone(), right: friction }, noise)
}

fn pull(session: &mut PullSession, until: Until) -> StaircaseResult {
    let settings = settings();
    let staircase = Staircase::constant(settings.increment_n, settings.step_s, settings.max_time_s);
    pull_staircase(session, &staircase, &settings, until).unwrap()
}

/// Slip force within 0.1 % of 2 mu F_G, for any number of cells, where the gels do not shear by more than the stop: the
/// cells here have up to 1.5 times the mean pressure.
#[test]
fn jaws_slip_at_twice_mu_times_grip_force() {
    let shape = PartShape::cuboid([0.06, 0.02, 0.12]);
    for mu in [0.14, 0.168, 0.3, 0.6, 1.0] {
        for force in [5.0, 20.0, 40.0, 80.0] {
            let bench = bench(shape.clone(), force);
            if 1.5 * 2.0 * mu * force / 4e4 > 0.9 * settings().stop_m {
                continue;
            }
            for cells in [1, 7, 64] {
                let result = pull(&mut session_with_cells(&bench, mu, cells, 1.0), Until::Stopped);
                let label = slip_label(&result.trace, 3.0, result.slid).unwrap();
                let ideal = 2.0 * mu * force;
                let off = label.max_pull_force_n / ideal - 1.0;
                assert!(off.abs() < 1e-3 && !label.censored, "mu {mu}, {force} N, {cells} cells: {off}");
            }
        }
    }
}

/// Cells with little pressure slip first: the load line bends before the force has reached its limit, and follows
/// sum min(k_i x, L_i).
#[test]
fn slip_begins_at_the_rim() {
    let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    let cells = 16;
    let mut session = session_with_cells(&bench, 0.25, cells, 1.0);
    let weight = |i: usize| 1.0 - ((i as f64 + 0.5) / cells as f64 * 2.0 - 1.0).powi(2);
    let sum: f64 = (0..cells).map(weight).sum();
    let mut bent = false;
    for i in 0..1000 {
        let state = session.step(Command::ForceN(f64::from(i) * 0.02), STEP_S).unwrap();
        let x = state.displacement_m;
        let curve: f64 =
            (0..cells).map(|i| (2e4 / cells as f64 * x).min(10.0 * weight(i) / sum)).sum::<f64>() * 2.0;
        assert!(
            (state.contact_force_n - curve).abs() < 1e-9,
            "step {i}: {} and {curve}",
            state.contact_force_n
        );
        bent |= state.contact_force_n < 0.99 * 4e4 * x && state.contact_force_n < 19.0;
    }
    assert!(bent);
}

/// Cattaneo's and Mindlin's contact of two spheres under a growing tangential force, another theory: with y = x / x_slip,
/// F / mu N = 1 - (1 - y)^(3/2), x_slip = 3 mu N / (16 a G*), a stiffness of 8 a G* at the start. Bristles with the gel's
/// stiffness by area on a Hertz pressure have the same start and the same whole slip. In between they hold more: by
/// 3 y / 2 - y^3 / 2 - 1 + (1 - y)^(3/2), at most 4.5 % of the limit, and 6.0 % on the 64 cells of a patch.
#[test]
fn a_hertz_contact_follows_mindlins_curve() {
    let mut bench = bench(PartShape::ball(0.01), 40.0);
    bench.robot.lag_s = 0.01;
    // The pressure p0 sqrt(1 - r^2 / a^2) in 8 x 8 squares, as a patch has it.
    let (n, fine) = (8, 50);
    let mut cells = vec![FrictionCell { limit_n: 0.0, area_m2: 0.0 }; n * n];
    for i in 0..n * fine {
        for j in 0..n * fine {
            let at = |k: usize| (k as f64 + 0.5) / (n * fine) as f64 * 2.0 - 1.0;
            let height = 1.0 - at(i).powi(2) - at(j).powi(2);
            if height > 0.0 {
                let cell = &mut cells[i / fine * n + j / fine];
                cell.limit_n += height.sqrt();
                cell.area_m2 += 1e-9;
            }
        }
    }
    let sum: f64 = cells.iter().map(|c| c.limit_n).sum();
    cells.iter_mut().for_each(|c| c.limit_n *= 10.0 / sum);
    cells.retain(|c| c.area_m2 > 0.0);
    let friction = JawFriction { cells, kinetic_ratio: 1.0, kinetic_fall_s: 0.0, shear_by_area: 1.0 };
    let noise = Stream::new(1, 2, Purpose::ForceNoise);
    let mut session = bench.held().pull(&PerJaw { left: friction.clone(), right: friction }, noise);
    // Both gels: 2 mu N = 20 N, 8 a G* = 4e4 N/m, x_slip = 1.5 x 20 N / 4e4 N/m.
    let whole_m = 0.75e-3;
    let (mut worst, mut mean, mut count) = (0.0_f64, 0.0, 0.0);
    for i in 0..6000 {
        let state = session.step(Command::ForceN(f64::from(i) * 0.0036), STEP_S).unwrap();
        let y = (state.displacement_m / whole_m).clamp(0.0, 1.0);
        let off = (state.contact_force_n - 20.0 * (1.0 - (1.0 - y).powf(1.5))) / 20.0;
        if y < 0.05 {
            assert!(off.abs() < 2e-3, "the start, y {y}: {off}");
        } else if y < 1.0 {
            worst = worst.max(off.abs());
            mean += off * off;
            count += 1.0;
        } else {
            assert!(off.abs() < 1e-3, "whole slip: {off}");
            break;
        }
    }
    println!(
        "Mindlin: worst {:.2} %, rms {:.2} % of the limit",
        100.0 * worst,
        100.0 * f64::sqrt(mean / count)
    );
    assert!(count > 1000.0 && worst < 0.061, "{worst} of {count} steps");
}

/// However light the grip: the forces balance as far as numbers go, and no further.
#[test]
fn the_lightest_grips_stay_finite_and_slip_at_their_limit() {
    for force_n in [1e-4, 1e-3, 0.01, 0.03, 0.05, 0.0633, 0.07, 0.1, 0.2] {
        for mu in [0.14, 0.168, 0.6] {
            let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), force_n);
            for cells in [1, 7, 64] {
                let mut session = session_with_cells(&bench, mu, cells, 1.0);
                let mut peak = 0.0_f64;
                for i in 0..3000 {
                    let command = Command::ForceN(f64::from(i) * 0.001 * mu * force_n);
                    let state = session.step(command, STEP_S).unwrap_or_else(|e| panic!("{force_n} N: {e}"));
                    peak = peak.max(state.contact_force_n);
                }
                let off = peak / (2.0 * mu * force_n) - 1.0;
                assert!(off.abs() < 1e-6, "{force_n} N, mu {mu}, {cells} cells: {off}");
                pull(&mut session_with_cells(&bench, mu, cells, 1.0), Until::Stopped);
            }
        }
    }
}

#[test]
fn a_loaded_grip_does_not_creep() {
    let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    let mut session = session_with_cells(&bench, 0.25, 32, 1.0);
    for i in 0..1000 {
        session.step(Command::ForceN(18.0 * (f64::from(i) / 900.0).min(1.0)), STEP_S).unwrap();
    }
    let start = session.step(Command::ForceN(18.0), 1.0).unwrap().displacement_m;
    let end = session.step(Command::ForceN(18.0), 2.0).unwrap();
    assert!((end.displacement_m - start).abs() / 2.0 < 1e-6, "{} m", end.displacement_m - start);
}

/// What the arm does is stored in the bristles, kept as kinetic energy, or lost in friction: never gained.
#[test]
fn energy_is_never_gained() {
    let mut bench = bench(PartShape::ball(0.01), 40.0);
    bench.robot.damping_n_s_per_m = 1.0;
    let mut session = session_with_cells(&bench, 0.25, 32, 1.0);
    let mass_kg = session.mass_kg();
    let (mut work, mut lost) = (0.0, 0.0);
    for i in 0..3000 {
        let before = session.state();
        // A pull that rises, falls back and rises again.
        let command = 12.0 + 14.0 * libm::sin(f64::from(i) * 0.004);
        let state = session.step(Command::ForceN(command), STEP_S).unwrap();
        let inertia = mass_kg * (state.speed_m_per_s - before.speed_m_per_s) / STEP_S;
        work += (state.contact_force_n + inertia) * (state.displacement_m - before.displacement_m);
        lost = work - 0.5 * mass_kg * state.speed_m_per_s.powi(2);
        assert!(lost > -1e-9, "step {i}: {lost} J gained");
    }
    assert!(lost > 0.0);
}

#[test]
fn kinetic_friction_acts_as_soon_as_the_jaws_slide() {
    let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    for cells in [1, 32] {
        let trace = pull(&mut session_with_cells(&bench, 0.25, cells, 0.7), Until::Stopped).trace;
        let peak = trace.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
        let last = trace.measured_force_n[trace.len() - 1];
        assert!((peak / 20.0 - 1.0).abs() < 1e-3, "{cells} cells: peak {peak} N");
        assert!((last / 14.0 - 1.0).abs() < 1e-3, "{cells} cells: sliding at {last} N");
    }
}

/// The force after the slip is r L + (1 - r) L exp(-t / tau).
#[test]
fn a_force_falls_to_its_kinetic_value_in_its_own_time() {
    let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    let mut jaw = JawFriction::uniform(10.0, 0.7);
    jaw.kinetic_fall_s = 0.03;
    let noise = Stream::new(1, 2, Purpose::ForceNoise);
    let mut session = bench.held().pull(&PerJaw { left: jaw.clone(), right: jaw }, noise);
    let trace = pull(&mut session, Until::Stopped).trace;
    let force = &trace.measured_force_n;
    let slip = force.iter().position(|f| *f > 20.0 - 1e-9).unwrap();
    for (k, f) in force[slip..].iter().enumerate().take(60) {
        let exact = 14.0 + 6.0 * (-(k as f64) * STEP_S / 0.03).exp();
        assert!((f - exact).abs() < 0.03 * 6.0, "{k} steps after the slip: {f} N, {exact} N");
    }
}

/// A pull that ends when its label is decided has that label, and the same trace up to there.
#[test]
fn an_early_end_leaves_the_label() {
    for mechanics in [Mechanics::Reduced, Mechanics::Rapier] {
        for (kinetic_ratio, noise_n) in [(1.0, 0.0), (0.8, 0.0), (1.0, 0.3), (0.8, 0.3)] {
            let mut bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
            (bench.mechanics, bench.noise_n) = (mechanics, noise_n);
            let run = |until| pull(&mut session_with_cells(&bench, 0.2, 32, kinetic_ratio), until);
            let (full, early) = (run(Until::Stopped), run(Until::Decided));
            let label = |r: &StaircaseResult| slip_label(&r.trace, 3.0, r.slid).unwrap();
            assert_eq!(label(&full), label(&early), "{mechanics:?}");
            assert!(early.trace.len() <= full.trace.len());
            assert_eq!(early.trace.measured_force_n[..], full.trace.measured_force_n[..early.trace.len()]);
        }
    }
    // And is worth it where the stop is far.
    let bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 5.0);
    let run = |until| pull(&mut session_with_cells(&bench, 0.14, 8, 1.0), until).trace.len();
    assert!(run(Until::Decided) < run(Until::Stopped));
}

/// Halving the time step moves the slip force by less than 0.2 %.
#[test]
fn the_step_can_be_halved() {
    let bench = bench(PartShape::cylinder(0.01, 0.12, 2), 40.0);
    let slip = |step: f64| {
        let mut session = session_with_cells(&bench, 0.2, 32, 1.0);
        let mut peak = 0.0_f64;
        for i in 0..(3.0 / step) as usize {
            let state = session.step(Command::ForceN(8.0 * i as f64 * step), step).unwrap();
            peak = peak.max(state.contact_force_n);
        }
        peak
    };
    assert!((slip(STEP_S) / slip(STEP_S / 2.0) - 1.0).abs() < 2e-3);
}

/// Any stiffness is stable: the step is implicit.
#[test]
fn stiff_gels_are_stable() {
    let mut bench = bench(PartShape::ball(0.01), 40.0);
    for jaw in gripgen_twin::Jaw::BOTH {
        bench.gel[jaw].shear_stiffness_n_per_m = 1e7;
    }
    let result = pull(&mut session_with_cells(&bench, 0.25, 64, 1.0), Until::Stopped);
    let peak = result.trace.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
    assert!((peak / 20.0 - 1.0).abs() < 1e-6, "{peak}");
}

/// Both mechanics grip at the same place, and label a centred grip alike.
#[test]
fn both_mechanics_grip_and_label_alike() {
    for (name, shape) in shapes() {
        let rapier = Bench::new(shape.clone(), 40.0);
        let reduced = bench(shape, 40.0);
        let (a, b) = (rapier.held().grasp, reduced.held().grasp);
        for jaw in gripgen_twin::Jaw::BOTH {
            let apart =
                (a.gel_from_part[jaw].translation.vector - b.gel_from_part[jaw].translation.vector).norm();
            assert!(apart < 10e-6, "{name}, {jaw} jaw: {} mm apart", apart * 1e3);
        }
        let (x, y) = (rapier.label_n(0.2), reduced.label_n(0.2));
        assert!((x / y - 1.0).abs() < 1e-3, "{name}: {x} and {y}");
    }
    let mut wide = bench(PartShape::cuboid([0.02, 0.02, 0.02]), 40.0);
    wide.world_from_part = pose(&Rotation3::identity(), Vector3::new(0.06, 0.0, 0.0));
    assert!(matches!(wide.grip(), Ok(Grip::NoContact)));
}

/// Sliding jaws under a constant excess E answer with the mass m of the admittance, whatever moves:
/// v = E / d (1 - exp(-t d / m)), in both mechanics; before the slip nothing changes.
#[test]
fn sliding_jaws_answer_with_the_apparent_mass() {
    const EXCESS_N: f64 = 4.0;
    for mechanics in [Mechanics::Reduced, Mechanics::Rapier] {
        for mass_kg in [1.5, 4.0, 30.0] {
            let mut bench = bench(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
            bench.mechanics = mechanics;
            // The loop has no lag, so its force is the command.
            (bench.robot.lag_s, bench.robot.feedback) = (0.0, Feedback::Independent);
            (bench.robot.damping_n_s_per_m, bench.robot.speed_limit_m_per_s) = (100.0, 1.0);
            bench.robot.apparent_mass_kg = Some(mass_kg);
            let mut session = session_with_cells(&bench, 0.2, 1, 0.9);
            for i in 0..800 {
                session.step(Command::ForceN(15.5 * f64::from(i) / 800.0), STEP_S).unwrap();
            }
            assert!(!session.state().sliding, "{mechanics:?} {mass_kg} kg slides below its limit");
            while !session.state().sliding {
                session.step(Command::ForceN(16.5), STEP_S).unwrap();
            }
            let started = session.state().speed_m_per_s;
            for k in 1..150 {
                session.step(Command::ForceN(14.4 + EXCESS_N), STEP_S).unwrap();
                let (t, last) = (f64::from(k) * STEP_S, EXCESS_N / 100.0);
                let exact = last + (started - last) * (-t * 100.0 / mass_kg).exp();
                let speed = session.state().speed_m_per_s;
                assert!(
                    (speed - exact).abs() < 0.07 * last,
                    "{mechanics:?} {mass_kg} kg, {t} s: {speed} and {exact}"
                );
            }
        }
    }
}

#[test]
fn a_clone_continues_like_the_original() {
    let mut bench = bench(PartShape::ball(0.01), 40.0);
    bench.noise_n = 0.1;
    let mut original = session_with_cells(&bench, 0.1, 32, 0.8);
    original.step(Command::ForceN(5.0), 0.3).unwrap();
    let mut copy = original.clone();
    for i in 0..300 {
        let command = Command::ForceN(5.0 + f64::from(i) * 0.05);
        assert_eq!(original.step(command, STEP_S), copy.step(command, STEP_S));
    }
}

/// A policy may turn its force round at once: every step still balances, however stiff the gel.
#[test]
fn sudden_reversals_balance() {
    for stiffness_n_per_m in [2e4, 2e5, 1e7] {
        let mut bench = bench(PartShape::ball(0.01), 40.0);
        bench.robot.damping_n_s_per_m = 1.0;
        bench.robot.lag_s = 0.0;
        for jaw in gripgen_twin::Jaw::BOTH {
            bench.gel[jaw].shear_stiffness_n_per_m = stiffness_n_per_m;
        }
        let mut session = session_with_cells(&bench, 0.25, 64, 1.0);
        for i in 0..400 {
            let before = session.state();
            let force = if i / 7 % 2 == 0 { 30.0 } else { -30.0 };
            let state = session.step(Command::ForceN(force), STEP_S).unwrap();
            assert!(state.contact_force_n.abs() <= 20.0 + 1e-9, "step {i}: {} N", state.contact_force_n);
            // Momentum: what the arm applied went into motion or into the contact. The speed limit allows 0.02 N more.
            let applied = state.contact_force_n + 9.6 * (state.speed_m_per_s - before.speed_m_per_s) / STEP_S;
            let bound = before.contact_force_n.abs() + 30.0 + 1.0;
            assert!(applied.abs() <= bound, "step {i}, {stiffness_n_per_m} N/m: {applied} N applied");
        }
    }
}
