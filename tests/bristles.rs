//! A pull of one grip, integrated here: by the formulas of docs/model.md, with code that the product does not have. Effects come in
//! as the formulas of their specs; how they are put together, the arm, the loop, the bristles and the label are written anew.

use gripgen::twin::config::Feedback;
use gripgen::twin::draw::Drawn;
use gripgen::twin::effects::{GripPoint, OutsideFit, Per, SensorMemory, SensorPoint};
use gripgen::twin::{Jaw, MeasuredPull, PerJaw, PullSettings, Scenario, Twin};
use gripgen::{Library, press_only};

struct Cell {
    limit_n: f64,
    stiffness_n_per_m: f64,
    foot_m: f64,
}

/// Normal force of a jaw that is commanded `force_n`.
fn normal_force_n(twin: &Twin, pull: &MeasuredPull, jaw: Jaw, force_n: f64) -> f64 {
    let mut f = force_n;
    let at = point(pull, jaw, force_n);
    for e in twin.effects.iter().filter(|e| e.acts_on(&pull.part)) {
        if let Some(hook) = e.spec.normal_force {
            f = hook(&e.values, f, &at).max(0.0);
        }
    }
    f
}

fn point(pull: &MeasuredPull, jaw: Jaw, grip_force_n: f64) -> GripPoint<'_> {
    GripPoint {
        jaw,
        grip_force_n,
        contact_area_m2: 0.0,
        pull_rate_n_per_s: pull.increment_n / pull.step_s,
        covariates: &pull.covariates,
        grip: (0, 0),
    }
}

/// The cells of both jaws: mu p A of the patch that the part leaves in the gel.
fn cells(twin: &Twin, library: &Library, pull: &MeasuredPull, scenario: &Scenario) -> PerJaw<Vec<Cell>> {
    let mechanics = gripgen::twin::config::Mechanics::Reduced;
    let press = press_only(twin, library, scenario, mechanics).unwrap().expect("the part is gripped");
    PerJaw::from_fn(|jaw| {
        let patch = &press.imprint[jaw].patch;
        let mu = |pressure_pa: f64| {
            let mut mu = twin.parts[&pull.part].mu;
            for e in twin.effects.iter().filter(|e| e.acts_on(&pull.part)) {
                let Some(hook) = e.spec.friction else { continue };
                if e.spec.of_pressure {
                    // A law of the local pressure: the force on a square metre.
                    let at = GripPoint { contact_area_m2: 1.0, ..point(pull, jaw, pressure_pa) };
                    mu = hook(&e.values, mu, &at).max(0.0);
                    continue;
                }
                let range = e.fitted_grip_force_n.filter(|_| e.outside_fit == OutsideFit::Hold);
                let within = |f: f64| range.map_or(f, |(low, high)| f.max(low).min(high));
                let seen_n = match (e.per, e.reference_area_m2) {
                    (Per::Cell, Some(area_m2)) => within(pressure_pa * area_m2),
                    _ => normal_force_n(twin, pull, jaw, within(pull.grip_force_n)),
                };
                mu = hook(&e.values, mu, &point(pull, jaw, seen_n)).max(0.0);
            }
            mu
        };
        let limits: Vec<f64> = patch.cells.iter().map(|c| mu(c.pressure_pa()) * c.force_n).collect();
        let area: f64 = patch.cells.iter().map(|c| c.area_m2).sum();
        let (limit, by_area): (f64, f64) = (limits.iter().sum(), twin.gel[jaw].shear_by_area);
        let cell = |(c, limit_n): (&gripgen::twin::PressureCell, f64)| Cell {
            limit_n,
            stiffness_n_per_m: twin.gel[jaw].shear_stiffness_n_per_m
                * (by_area * c.area_m2 / area + (1.0 - by_area) * limit_n / limit),
            foot_m: 0.0,
        };
        patch.cells.iter().zip(limits).map(cell).collect()
    })
}

/// Integrates the pull of a row: a carriage on its bristles. Returns the label of the noise-free trace in newtons.
pub fn label_n(twin: &Twin, library: &Library, pull: &MeasuredPull, stop_m: f64, tolerance_n: f64) -> f64 {
    assert!(twin.arm.is_none(), "only the carriage's mass is written here");
    let scenario = Scenario {
        seed: 0,
        index: 0,
        group: 0,
        repetition: 0,
        part: pull.part.clone(),
        grip_pose: pull.grip_pose,
        grip_force_n: pull.grip_force_n,
        covariates: pull.covariates.clone(),
        pull: PullSettings {
            increment_n: pull.increment_n,
            start_n: pull.start_n,
            step_s: pull.step_s,
            step_jitter: 0.0,
            stop_m,
            direction: [0.0, 0.0, 1.0],
            max_force_n: None,
            max_time_s: 120.0,
            label_tolerance_n: tolerance_n,
        },
        drawn: Default::default(),
    };
    let jaws = cells(twin, library, pull, &scenario);
    let mut bristles: Vec<Cell> = jaws.left.into_iter().chain(jaws.right).collect();
    let part = &twin.parts[&pull.part];
    let carried_kg = twin.robot.moving_mass_kg + twin.gripper.mass_kg + 2.0 * twin.gripper.jaw_mass_kg;
    let mass_kg = twin.robot.apparent_mass_kg.unwrap_or(carried_kg);
    let (robot, dt) = (&twin.robot, 1.0 / twin.wrist.rate_hz);
    let dead = (robot.dead_time_s / dt - 1e-6).ceil() as usize;
    let side = if pull.covariates.pull_direction < 0.0 { -1.0 } else { 1.0 };
    let acting: Vec<_> = twin.effects.iter().filter(|e| e.acts_on(&pull.part)).collect();
    let mut memory = vec![SensorMemory::default(); acting.len()];
    let zeroed_s = match pull.covariates.extra.get("since_zero_s") {
        Some(Drawn::Number(seconds)) => *seconds,
        _ => pull.covariates.time_s,
    };
    let mut read = |force_n: f64, t: f64, step_s: f64| {
        let at = SensorPoint { clock_s: pull.covariates.time_s + t, since_zero_s: zeroed_s + t, step_s };
        let mut f = side * force_n;
        for (e, memory) in acting.iter().zip(&mut memory) {
            f = e.spec.sensor.map_or(f, |hook| hook(&e.values, f, memory, &at));
        }
        side * f
    };
    let command = |desired_n: f64, measured_n: f64| {
        let each = acting.iter().filter_map(|e| Some((e.spec.command?, &e.values)));
        each.fold(desired_n, |d, (hook, values)| hook(values, d, measured_n))
    };
    // Creep, which moves the tool and shears nothing: the rate is the effect's, what the rim does to it is written here.
    let pressed = [Jaw::Left, Jaw::Right].map(|jaw| normal_force_n(twin, pull, jaw, pull.grip_force_n));
    let creeps = acting.iter().filter_map(|e| Some((e.spec.creep?, &e.values))).next_back();
    let (rate, rim) = creeps.map_or((0.0, 0.0), |(hook, values)| {
        let creep = hook(values, &point(pull, Jaw::Left, 0.5 * (pressed[0] + pressed[1])));
        (creep.rate_m_per_n_s, creep.rim_exponent)
    });
    let whole_n: f64 = bristles.iter().map(|b| b.limit_n).sum();
    let (mut crept, mut creeping) = (0.0, 0.0);
    let (mut x, mut v, mut contact, mut loop_n, mut effective) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    let (mut slid_s, mut commands) = (None::<f64>, Vec::new());
    let mut label_n = f64::NAN;
    let mut measured = read(0.0, 0.0, 0.0);
    for tick in 0..(120.0 / dt) as usize {
        let t = tick as f64 * dt;
        let first_n = pull.start_n.unwrap_or(pull.increment_n);
        let desired = first_n + pull.increment_n * ((t + 1e-9) / pull.step_s).floor();
        if (measured - desired).abs() < tolerance_n {
            label_n = measured;
        }
        if x + crept > stop_m {
            break;
        }
        // The loop: tau dF/dt = F_des(t - T) - F_closed, exactly over a step; the speed limit bounds it.
        commands.push(command(desired, measured));
        if tick >= dead {
            effective = commands[tick - dead];
        }
        let closed = if robot.feedback == Feedback::Measured { measured } else { loop_n };
        let share = if robot.lag_s > 0.0 { 1.0 - (-dt / robot.lag_s).exp() } else { 1.0 };
        loop_n += share * (effective - closed);
        let most = robot.damping_n_s_per_m * robot.speed_limit_m_per_s;
        loop_n = loop_n.max(contact - most).min(contact + most);
        let applied = loop_n - robot.damping_n_s_per_m * (v + creeping);
        // m (v' - v) / dt = F - F_c(x + v' dt): the difference of both sides rises with v'.
        let keep = slid_s.map_or(1.0, |s| match part.kinetic_fall_s {
            0.0 => part.kinetic_ratio,
            fall_s => part.kinetic_ratio + (1.0 - part.kinetic_ratio) * (-s / fall_s).exp(),
        });
        let force = |at: f64| -> f64 {
            let each = bristles.iter().map(|b| {
                let most = b.limit_n * keep;
                (b.stiffness_n_per_m * (at - b.foot_m)).clamp(-most, most)
            });
            each.sum()
        };
        let off = |speed: f64| mass_kg * (speed - v) / dt - applied + force(x + speed * dt);
        v = root(v - 1.0, v + 1.0, off);
        x += v * dt;
        contact = force(x);
        let mut holds = false;
        for b in &mut bristles {
            let most = b.limit_n * keep;
            let stretch = b.stiffness_n_per_m * (x - b.foot_m);
            if stretch.abs() > most {
                b.foot_m = x - stretch.signum() * most / b.stiffness_n_per_m;
            } else if b.limit_n > 0.0 {
                holds = true;
            }
        }
        slid_s = (!holds).then(|| slid_s.unwrap_or(0.0) + dt);
        // The damping acts on the creep of what sticks, implicitly in the force.
        let left = (1.0 - contact / whole_n).clamp(0.01, 1.0);
        let creeps = if holds { rate * contact } else { 0.0 };
        creeping += (creeps - creeping) / (1.0 + robot.damping_n_s_per_m * rate);
        crept += creeps * left.powf(-rim) * dt;
        measured = read(contact, t + dt, dt);
    }
    label_n
}

/// Where a rising function is 0, between `low` and `high`: regula falsi with halved weights (Dowell and Jarratt 1971).
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut below, mut above) = (f(low), f(high));
    let mut side = 0;
    for _ in 0..200 {
        let middle = (low * above - high * below) / (above - below);
        let value = f(middle);
        if value.abs() < 1e-11 || high - low < 1e-16 {
            return middle;
        }
        if value < 0.0 {
            (low, below) = (middle, value);
            above *= if side < 0 { 0.5 } else { 1.0 };
            side = -1;
        } else {
            (high, above) = (middle, value);
            below *= if side > 0 { 0.5 } else { 1.0 };
            side = 1;
        }
    }
    0.5 * (low + high)
}
