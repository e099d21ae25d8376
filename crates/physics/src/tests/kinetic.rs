//! Friction while the jaws slide, and when it begins.

use super::*;

/// Trap: `set_friction` on a pair that is in touch does nothing until its contacts are rebuilt. Kinetic friction
/// switches it in the middle of a pull.
#[test]
fn kinetic_friction_acts_as_soon_as_the_jaws_slide() {
    for (name, shape) in shapes() {
        let mut bench = Bench::new(shape, 40.0);
        bench.kinetic_ratio = 0.7;
        let result = bench.pull(0.25);
        let peak = result.trace.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
        assert!((peak / 20.0 - 1.0).abs() < 0.01, "{name}: peak {peak} N instead of 20 N");
        let last = result.trace.measured_force_n[result.trace.len() - 1];
        assert!((last / 14.0 - 1.0).abs() < 0.005, "{name}: sliding at {last} N instead of 14 N");
    }
}

/// A large step moves the jaws fast while the gels shear; that is no sliding, and static friction holds on.
#[test]
fn kinetic_friction_waits_for_the_limit_however_fast_the_force_rises() {
    for (increment_n, lag_s) in [(10.0, 0.05), (19.0, 0.05), (50.0, 0.05), (50.0, 0.0)] {
        let mut bench = Bench::new(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
        bench.kinetic_ratio = 0.5;
        bench.robot.lag_s = lag_s;
        let settings = PullSettings { increment_n, ..settings() };
        let staircase = Staircase::constant(increment_n, settings.step_s, settings.max_time_s);
        let result = pull_staircase(&mut bench.session(0.25), &staircase, &settings, Until::Stopped).unwrap();
        let peak = result.trace.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
        assert!((peak / 20.0 - 1.0).abs() < 0.02, "steps of {increment_n} N, lag {lag_s} s: peak {peak} N");
        assert_eq!(result.end, PullEnd::Displacement);
    }
}
