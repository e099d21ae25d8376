//! Slip force, label, creep and speed of both mechanics on the pulls of `docs/peers.md`, as the JSON that
//! `benches/peers/table.py` reads: `cargo bench --bench slip_table -- FILE.json`.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;

use gripgen::physics::{
    Arm, Command, FrictionCell, Grip, GripSetup, Held, JawFriction, Mount, PartShape, PullSession, Until,
    grip, pull_staircase,
};
use gripgen::twin::config::Mechanics;
use gripgen::twin::frames::{Pose, pose, rotation_about_axis};
use gripgen::twin::parts::SteppedShaft;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{PerJaw, PullSettings, Staircase, Twin, slip_label};
use gripgen::{BASELINE_TWIN, Location, Project};
use guard::baseline::Unit;
use std::process::ExitCode;
use std::time::Instant;

/// The pulls whose speed is stated.
const TIMED: [(&str, f64, f64); 2] = [("box", 0.168, 40.0), ("vertical_shaft", 0.6, 80.0)];
/// Cells of a jaw in the reduced mechanics.
const CELLS: usize = 64;
/// The strongest pulls shear the gels by 6 mm before all of a contact slips.
const STOP_M: f64 = 8e-3;

fn main() -> ExitCode {
    let Some(mut run) = guard::Run::from_args("slip_table").filter(|run| run.wants_some_of("slip_table"))
    else {
        return ExitCode::SUCCESS;
    };
    let sets = [("twin", BASELINE_TWIN), ("wrist.noise_n", "0")].map(|(k, v)| (k.into(), v.into()));
    let twin = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap().twin;
    let mut rows = Vec::new();
    for (mechanics, name) in [(Mechanics::Rapier, "rapier"), (Mechanics::Reduced, "reduced")] {
        let mut worst = 0.0_f64;
        for (shape_name, shape) in shapes() {
            for mu in [0.14, 0.168, 0.3, 0.6, 1.0] {
                for grip_force_n in [5.0, 20.0, 40.0, 80.0] {
                    let row = measure(&twin, mechanics, &shape, mu, grip_force_n);
                    worst = worst.max((row.slip_force_n / (2.0 * mu * grip_force_n) - 1.0).abs());
                    let mut json = serde_json::json!({
                        "mechanics": name, "shape": shape_name, "mu": mu, "grip_force_n": grip_force_n,
                        "slip_force_n": row.slip_force_n, "label_n": row.label_n,
                        "creep_mm_per_s": row.creep_mm_per_s,
                    });
                    if TIMED.contains(&(shape_name, mu, grip_force_n)) {
                        json["us_per_step"] = row.us_per_step.into();
                        json["steps"] = row.steps.into();
                        json["pulls_per_s"] = row.pulls_per_s.into();
                        let name = format!("slip_table/{name}/{shape_name}");
                        run.measured(&name, Unit::Nanoseconds, vec![1e3 * row.us_per_step]);
                    }
                    rows.push(json);
                }
            }
        }
        println!("{name}: worst slip force {:.4} % off 2 mu F_G", 100.0 * worst);
    }
    if let Some(file) = run.file() {
        std::fs::write(file, serde_json::to_string_pretty(&rows).unwrap()).unwrap();
    }
    run.finish()
}

struct Row {
    slip_force_n: f64,
    label_n: f64,
    creep_mm_per_s: f64,
    us_per_step: f64,
    steps: usize,
    pulls_per_s: f64,
}

fn shapes() -> Vec<(&'static str, PartShape)> {
    let shaft = SteppedShaft { segments: 64, ..Default::default() };
    let upright = pose(&rotation_about_axis(1, std::f64::consts::FRAC_PI_2), nalgebra::Vector3::zeros());
    vec![
        ("box", PartShape::cuboid([0.06, 0.02, 0.12])),
        ("vertical_shaft", PartShape::cylinder(0.01, 0.12, 2)),
        ("horizontal_shaft", PartShape::cylinder(0.01, 0.12, 0)),
        ("hull", PartShape::hull(&shaft.mesh(), &upright).unwrap()),
        ("ball", PartShape::ball(0.01)),
    ]
}

fn measure(twin: &Twin, mechanics: Mechanics, shape: &PartShape, mu: f64, grip_force_n: f64) -> Row {
    let limit_n = 2.0 * mu * grip_force_n;
    let settings = PullSettings {
        increment_n: 1.0,
        start_n: None,
        step_s: 0.104,
        step_jitter: 0.0,
        stop_m: STOP_M,
        direction: [0.0, 0.0, 1.0],
        max_force_n: None,
        max_time_s: 60.0,
        label_tolerance_n: 3.0,
    };
    let staircase = Staircase::constant(settings.increment_n, settings.step_s, settings.max_time_s);
    let start = Instant::now();
    let mut session = session(twin, mechanics, shape, mu, grip_force_n);
    let result = pull_staircase(&mut session, &staircase, &settings, Until::Stopped).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let label = slip_label(&result.trace, 3.0, result.slid).unwrap();
    assert!(!label.censored);
    // The largest mean over 10 ms.
    let force = &result.trace.measured_force_n;
    let slip_force_n = force.windows(5).map(|w| w.iter().sum::<f64>() / 5.0).fold(0.0, f64::max);
    let steps = result.trace.len() - 1;
    Row {
        slip_force_n,
        label_n: label.max_pull_force_n,
        creep_mm_per_s: creep_mm_per_s(
            &mut self::session(twin, mechanics, shape, mu, grip_force_n),
            0.9 * limit_n,
        ),
        us_per_step: 1e6 * seconds / steps as f64,
        steps,
        pulls_per_s: 1.0 / seconds,
    }
}

/// Held by the loop for 1 s, then the travel over 2 s.
fn creep_mm_per_s(session: &mut PullSession, force_n: f64) -> f64 {
    session.step(Command::ForceN(force_n), 1.0).unwrap();
    let start = session.step(Command::ForceN(force_n), 1.0).unwrap().displacement_m;
    let end = session.step(Command::ForceN(force_n), 2.0).unwrap().displacement_m;
    1e3 * (end - start).abs() / 2.0
}

fn session(twin: &Twin, mechanics: Mechanics, shape: &PartShape, mu: f64, grip_force_n: f64) -> PullSession {
    let weight = |i: usize| 1.0 - ((i as f64 + 0.5) / CELLS as f64 * 2.0 - 1.0).powi(2);
    let sum: f64 = (0..CELLS).map(weight).sum();
    let cell = |i| FrictionCell { limit_n: mu * grip_force_n * weight(i) / sum, area_m2: 1e-6 };
    let friction = JawFriction {
        cells: (0..CELLS).map(cell).collect(),
        kinetic_ratio: 1.0,
        kinetic_fall_s: 0.0,
        shear_by_area: 1.0,
    };
    let noise = Stream::new(1, 2, Purpose::ForceNoise);
    held(twin, mechanics, shape, grip_force_n)
        .pull(&PerJaw { left: friction.clone(), right: friction }, noise)
}

/// The shipped rig on its carriage, without noise.
fn held(twin: &Twin, mechanics: Mechanics, shape: &PartShape, grip_force_n: f64) -> Held {
    let setup = GripSetup {
        mechanics,
        arm: Arm::Carriage,
        robot: twin.robot,
        gripper: twin.gripper,
        wrist: twin.wrist,
        gel: &twin.gel,
        shape,
        world_from_part: Pose::identity(),
        grip_force_n: PerJaw { left: grip_force_n, right: grip_force_n },
        direction: [0.0, 0.0, 1.0],
        mount: Mount::Fixed,
    };
    match grip(&setup).unwrap() {
        Grip::Held(held) => *held,
        Grip::NoContact => panic!("the part is between the jaws"),
    }
}
