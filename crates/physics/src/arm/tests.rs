//! The whole arm: slip against the closed form, the wrist sensor against the engine, and what the arm adds.

use crate::setup::Mount;
use crate::tests::{Bench, STEP_S, assert_clones_agree, check_take_over, hull_of_64, shapes};
use crate::*;
use gripgen_twin::config::{Document, Feedback, Mechanics};
use gripgen_twin::frames::{pose, rotation_about_axis};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{PullEnd, RobotArm, Twin};
use nalgebra::Vector3;

pub(crate) const URDF: &str = include_str!("../../../../assets/robots/ur5e/ur5e.urdf");

/// The stance of the shipped twins.
fn stance() -> RobotArm {
    let text = include_str!("../../../../assets/configs/twin-baseline.toml");
    let twin = Document::parse("twin-baseline.toml", text).and_then(|d| Twin::new(&d.read_twin()?)).unwrap();
    twin.arm.unwrap()
}

fn ur5e_standing(stance: &RobotArm) -> PlacedArm {
    PlacedArm::new(ArmModel::from_urdf(URDF, "tool0", &|_| None).unwrap(), stance).unwrap()
}

fn bench(shape: PartShape, grip_force_n: f64) -> Bench {
    let mut bench = Bench::new(shape, grip_force_n);
    bench.arm = Some(ur5e_standing(&stance()));
    bench
}

fn brick() -> PartShape {
    PartShape::cuboid([0.06, 0.02, 0.12])
}

/// The engine's friction on both pads, against the pull.
fn friction_n(session: &PullSession) -> f64 {
    -session.contact_forces().iter().map(|(_, f)| f.friction_n.z).sum::<f64>()
}

/// Pulls with a force that reaches `ideal_n` after 1 s, until the tool has moved 1 mm. Returns the largest contact
/// force, the largest motion across the pull and the largest motion along it below 0.9 of the ideal force.
fn ramp(bench: &Bench, mu: f64, step_s: f64) -> (f64, f64, f64) {
    let ideal_n = 2.0 * mu * bench.grip_force_n;
    let mut session = bench.session_in_engine(mu);
    let (mut peak, mut across, mut early) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut time_s = 0.0;
    while session.tool_travel_m().z < 1e-3 {
        assert!(time_s < 10.0, "no slip");
        let state = session.step(Command::ForceN(ideal_n * time_s), step_s).unwrap();
        time_s += step_s;
        peak = peak.max(state.contact_force_n);
        let travel = session.tool_travel_m();
        across = across.max(travel.x.hypot(travel.y));
        if state.contact_force_n < 0.9 * ideal_n {
            early = early.max(travel.z.abs());
        }
    }
    (peak, across, early)
}

fn check_slip(cases: &[(f64, f64)]) {
    let mut worst = 0.0_f64;
    for (name, shape) in shapes() {
        for &(mu, force) in cases {
            let ideal = 2.0 * mu * force;
            let (peak, across, early) = ramp(&bench(shape.clone(), force), mu, STEP_S);
            let off = peak / ideal - 1.0;
            println!(
                "{name:16} mu {mu:<5} {force:2} N: {:+.3} %, across {:.1} um, before slip {:.1} um",
                off * 100.0,
                across * 1e6,
                early * 1e6
            );
            worst = worst.max(off.abs());
            assert!(off.abs() < 5e-3, "{name}, mu {mu}, {force} N: {peak:.4} N instead of {ideal} N");
            assert!(across < 0.05e-3, "{name}, mu {mu}, {force} N: {} mm across the pull", across * 1e3);
            assert!(early < 0.05e-3, "{name}, mu {mu}, {force} N: {} mm before slip", early * 1e3);
        }
    }
    println!("worst {:.3} %", worst * 100.0);
}

#[test]
fn the_arm_slips_at_twice_mu_times_grip_force() {
    check_slip(&[(0.14, 5.0), (0.168, 40.0), (0.6, 80.0)]);
}

/// `cargo test --release -p gripgen-physics -- --ignored --nocapture the_whole_grid`
#[test]
fn the_whole_grid_of_friction_and_grip_force() {
    let grid = [0.14, 0.168, 0.3, 0.6, 1.0].map(|mu| [5.0, 20.0, 40.0, 80.0].map(|force| (mu, force)));
    check_slip(grid.as_flattened());
}

/// The staircase and the label rule give the same number with either arm.
#[test]
fn arm_and_carriage_agree_on_the_label() {
    for (name, shape) in [("box", brick()), ("hull", hull_of_64())] {
        let carriage = Bench::new(shape.clone(), 40.0).label_n(0.168);
        let arm = bench(shape, 40.0).label_n(0.168);
        assert!((arm / carriage - 1.0).abs() < 2e-3, "{name}: {arm} N, carriage {carriage} N");
    }
}

/// Trap: the velocity on a multibody's bodies lacks one solver iteration's share of the forces (0.75 of a step at
/// four iterations), which would make the balance of momentum wrong by as much whenever the arm accelerates.
#[test]
fn the_wrist_sensor_balances_what_the_engine_reads_back() {
    for (name, shape) in shapes() {
        let mut session = bench(shape, 40.0).session_in_engine(0.3);
        let (mut balance, mut engine, mut n, mut worst) = (0.0, 0.0, 0, 0.0_f64);
        for i in 0..1200 {
            let state = session.step(Command::ForceN(f64::from(i) * 0.03), STEP_S).unwrap();
            // Ten steps at a time: the engine reports the friction of a step's last iteration only.
            balance += state.contact_force_n / 10.0;
            engine += friction_n(&session) / 10.0;
            n += 1;
            if n == 10 {
                if i > 100 {
                    worst = worst.max((balance / engine - 1.0).abs());
                    assert!(
                        (balance - engine).abs() < 0.01 * engine,
                        "{name}, step {i}: balance {balance} N, engine {engine} N"
                    );
                }
                (balance, engine, n) = (0.0, 0.0, 0);
            }
        }
        println!("{name}: balance and engine within {:.3} %", worst * 100.0);
        assert!(session.has_slid());
    }
}

/// A jerk at the tool is inertia, no contact force: while sliding the contact stays the friction limit. After 18 mm
/// the arm's inertia is another one.
#[test]
fn acceleration_is_not_read_as_contact() {
    let mut bench = bench(brick(), 40.0);
    bench.robot.feedback = Feedback::Independent;
    for travel_s in [0.1, 0.9] {
        let mut session = bench.session(0.2);
        session.step(Command::SpeedMPerS(0.02), travel_s).unwrap();
        session.step(Command::ForceN(20.0), 0.3).unwrap();
        assert!(session.state().sliding);
        let mut fastest = 0.0_f64;
        for force in [40.0, 18.0, 40.0] {
            for _ in 0..50 {
                let before = session.state().speed_m_per_s;
                let state = session.step(Command::ForceN(force), STEP_S).unwrap();
                fastest = fastest.max((state.speed_m_per_s - before).abs() / STEP_S);
                assert!((state.contact_force_n - 16.0).abs() < 0.01, "{force} N: {state:?}");
            }
        }
        assert!(fastest > 0.1, "the arm should have been accelerated: {fastest} m/s2");
    }
}

/// Nothing but friction takes force at constant speed: the joints have no damping that the sensor does not see.
#[test]
fn steady_sliding_reads_the_friction() {
    let mut session = bench(brick(), 40.0).session(0.2);
    let state = session.step(Command::SpeedMPerS(0.02), 0.5).unwrap();
    assert!((state.contact_force_n - 16.0).abs() < 5e-3, "{state:?}");
}

#[test]
fn normal_forces_read_back_as_the_grip_force_on_links() {
    for (name, shape) in shapes() {
        let mut session = bench(shape, 20.0).session_in_engine(0.3);
        for i in 0..300 {
            session.step(Command::ForceN(f64::from(i) * 0.04), STEP_S).unwrap();
            for (jaw, force) in session.contact_forces().iter() {
                let normal = force.normal_n;
                assert!((normal / 20.0 - 1.0).abs() < 5e-3, "{name}, {jaw} jaw, step {i}: {normal} N");
            }
        }
    }
}

#[test]
fn a_grip_below_its_limit_does_not_creep() {
    for (name, shape) in shapes() {
        let mut session = bench(shape, 40.0).session_in_engine(0.25);
        for i in 0..1000 {
            session.step(Command::ForceN(18.0 * (f64::from(i) / 900.0).min(1.0)), STEP_S).unwrap();
        }
        let start = session.state().displacement_m;
        let end = session.step(Command::ForceN(18.0), 2.0).unwrap();
        assert!((end.contact_force_n - 18.0).abs() < 1e-3, "{name}: {end:?}");
        let creep = (end.displacement_m - start).abs() / 2.0;
        println!("{name}: creep {:.2e} mm/s", creep * 1e3);
        assert!(creep < 1e-6, "{name}: {} mm/s", creep * 1e3);
    }
}

#[test]
fn a_pad_that_slides_off_the_edge_loses_contact_there() {
    let height = 0.03;
    let mut session = bench(PartShape::cuboid([0.06, 0.02, height]), 20.0).session(0.2);
    let edge = height / 2.0 + 21e-3 / 2.0;
    let mut lost = None;
    for _ in 0..2500 {
        let state = session.step(Command::SpeedMPerS(0.02), STEP_S).unwrap();
        if !session.contact_forces().iter().any(|(_, f)| f.normal_n > 0.0) {
            lost = Some(state.displacement_m);
            break;
        }
    }
    let lost = lost.expect("the pads should leave the part");
    assert!((lost - edge).abs() < 1e-3, "contact lost at {:.2} mm, edge at {:.2} mm", lost * 1e3, edge * 1e3);
}

#[test]
fn halving_the_step_leaves_the_slip_force() {
    for shape in [brick(), PartShape::cylinder(0.01, 0.12, 2)] {
        let bench = bench(shape, 40.0);
        let (coarse, _, _) = ramp(&bench, 0.2, STEP_S);
        let (fine, _, _) = ramp(&bench, 0.2, STEP_S / 2.0);
        assert!((coarse / fine - 1.0).abs() < 2e-3, "{coarse} and {fine}");
    }
}

#[test]
fn kinetic_friction_acts_as_soon_as_the_jaws_slide() {
    for (name, shape) in shapes() {
        let mut bench = bench(shape, 40.0);
        bench.kinetic_ratio = 0.7;
        let result = bench.pull(0.25);
        let peak = result.trace.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
        assert!((peak / 20.0 - 1.0).abs() < 0.01, "{name}: peak {peak} N instead of 20 N");
        let last = result.trace.measured_force_n[result.trace.len() - 1];
        assert!((last / 14.0 - 1.0).abs() < 0.01, "{name}: sliding at {last} N instead of 14 N");
        assert_eq!(result.end, PullEnd::Displacement);
    }
}

#[test]
fn a_free_part_reads_its_weight() {
    for mass_kg in [0.1, 0.5, 1.5] {
        let mut bench = bench(PartShape::cuboid([0.06, 0.02, 0.03]), 40.0);
        bench.mount = Mount::Free { mass_kg, gravity_m_per_s2: 9.80665 };
        let mut session = bench.session(0.5);
        let state = session.step(Command::SpeedMPerS(0.0), 2.0).unwrap();
        let weight = mass_kg * 9.80665;
        assert!(
            (state.measured_force_n / weight - 1.0).abs() < 2e-3,
            "{mass_kg} kg: {} N instead of {weight} N",
            state.measured_force_n
        );
        assert!(!state.sliding, "{state:?}");
    }
}

#[test]
fn the_engine_takes_over_before_the_slip() {
    for (name, shape) in shapes() {
        check_take_over(name, &bench(shape, 40.0));
    }
}

/// 100 N and a part that does not let go.
#[test]
fn a_hundred_newtons_do_not_push_the_arm_sideways() {
    let bench = bench(brick(), 80.0);
    let mut session = bench.session_in_engine(1.0);
    for i in 0..2000 {
        let state = session.step(Command::ForceN((f64::from(i) * 0.1).min(100.0)), STEP_S).unwrap();
        let travel = session.tool_travel_m();
        assert!(travel.x.hypot(travel.y) < 0.05e-3, "{travel:?} at {} N", state.contact_force_n);
    }
    assert!((session.state().contact_force_n - 100.0).abs() < 0.01, "{:?}", session.state());
}

/// Neither the gripper's length, nor the rotors, nor another elbow angle enters the slip force.
#[test]
fn the_slip_force_does_not_depend_on_the_stance() {
    let longer = RobotArm { tip_to_grip_m: 0.22, ..stance() };
    let lighter = RobotArm { rotor_inertia_kg_m2: [0.75, 0.75, 0.75, 0.15, 0.15, 0.15], ..stance() };
    let mut lower = stance();
    for (joint, degrees) in [(1, -20.0_f64), (2, 10.0), (3, 10.0)] {
        lower.joints_rad[joint] += degrees.to_radians();
    }
    for stance in [longer, lighter, lower] {
        let mut bench = bench(brick(), 40.0);
        bench.arm = Some(ur5e_standing(&stance));
        let (peak, across, _) = ramp(&bench, 0.168, STEP_S);
        assert!((peak / 13.44 - 1.0).abs() < 2e-3 && across < 0.05e-3, "{stance:?}: {peak} N, {across} m");
    }
}

/// Off-centre and turned grips: the arm holds what a rail would.
#[test]
fn off_centre_and_turned_grips_slip_at_the_same_force() {
    let mut random = Stream::new(3, 0, Purpose::ForceNoise);
    for case in 0..18 {
        let (name, shape) = shapes()[case % 6].clone();
        let (force, mu) = (5.0 + 75.0 * random.uniform(), 0.14 + 0.5 * random.uniform());
        let offset = Vector3::new(random.uniform() - 0.5, 0.0, random.uniform() - 0.5) * 6e-3;
        let angle_rad = 3.0 * random.uniform();
        let mut bench = bench(shape, force);
        bench.world_from_part = pose(&rotation_about_axis(1, angle_rad), offset);
        let ideal = 2.0 * mu * force;
        let (peak, across, _) = ramp(&bench, mu, STEP_S);
        let grip = format!("{name}, mu {mu:.2}, {force:.1} N, {angle_rad:.2} rad, {offset:?}");
        assert!((peak / ideal - 1.0).abs() < 1e-3, "{grip}: {peak} N instead of {ideal} N");
        assert!(across < 0.05e-3, "{grip}: {} mm across the pull", across * 1e3);
    }
}

/// The arm pulls in every direction at right angles to the jaws.
#[test]
fn other_directions_slip_at_the_same_force() {
    for direction in [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8]] {
        let mut bench = bench(PartShape::cuboid([0.12, 0.02, 0.12]), 40.0);
        bench.direction = direction;
        let mut session = bench.session(0.168);
        let mut peak = 0.0_f64;
        for i in 0..1000 {
            peak =
                peak.max(session.step(Command::ForceN(f64::from(i) * 0.02), STEP_S).unwrap().contact_force_n);
        }
        assert!((peak / 13.44 - 1.0).abs() < 2e-3, "{direction:?}: {peak} N");
    }
}

#[test]
fn a_clone_continues_like_the_original() {
    let mut bench = bench(hull_of_64(), 40.0);
    bench.noise_n = 0.1;
    bench.kinetic_ratio = 0.8;
    assert_clones_agree(&bench);
}

/// The reduced mechanics pulls the mass that the arm has in the engine, computed apart from it.
#[test]
fn the_reduced_arm_weighs_what_the_whole_one_does() {
    for direction in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8]] {
        let mut bench = bench(brick(), 40.0);
        bench.direction = direction;
        let whole = bench.session(0.2).mass_kg();
        bench.mechanics = Mechanics::Reduced;
        let reduced = bench.session(0.2).mass_kg();
        assert!((reduced / whole - 1.0).abs() < 1e-3, "{direction:?}: {reduced} kg and {whole} kg");
    }
}

#[test]
fn a_stance_that_the_arm_cannot_take_is_refused() {
    let model = || ArmModel::from_urdf(URDF, "tool0", &|_| None).unwrap();
    let refused = |change: &dyn Fn(&mut RobotArm)| {
        let mut stance = stance();
        change(&mut stance);
        PlacedArm::new(model(), &stance).unwrap_err().to_string()
    };
    let mut five = model();
    five.joints.pop();
    let short = PlacedArm::new(five, &stance()).unwrap_err().to_string();
    assert!(short.contains("5 joints") && short.contains("6 are needed"), "{short}");
    let far = refused(&|s| s.joints_rad[2] = 7.0);
    assert!(far.contains("elbow_joint") && far.contains('7') && far.contains("6.283"), "{far}");
    let singular = refused(&|s| s.joints_rad[2] = 0.0);
    assert!(singular.contains("singular"), "{singular}");
    let number = refused(&|s| s.tip_to_grip_m = f64::NAN);
    assert!(number.contains("tip_to_grip_m is NaN"), "{number}");
}
