//! How the force rises and what the arm makes of it.

use super::*;

/// Dead time shifts the answer of the whole rig: the measured force follows the staircase by the lag plus the dead
/// time, and the slip force stays.
#[test]
fn dead_time_delays_the_force_and_leaves_the_slip_force() {
    let trace_of = |dead_time_s: f64| {
        let mut bench = Bench::new(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
        bench.robot.dead_time_s = dead_time_s;
        bench.pull(0.168).trace
    };
    let (prompt, late) = (trace_of(0.0), trace_of(0.05));
    let shift = (0.05 / STEP_S) as usize;
    for i in 200..400 {
        let (a, b) = (prompt.measured_force_n[i], late.measured_force_n[i + shift]);
        assert!((a - b).abs() < 1e-3, "row {i}: {a} N and {b} N");
    }
    let peak = |t: &gripgen_twin::PullTrace| t.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
    assert!((peak(&prompt) - peak(&late)).abs() < 0.01, "{} and {}", peak(&prompt), peak(&late));
}

/// Uneven steps move when the force rises, not the force at which the jaws slip.
#[test]
fn jittered_steps_leave_the_slip_force() {
    let settings = PullSettings { step_jitter: 0.3, ..settings() };
    let bench = Bench::new(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    let even = bench.pull(0.168).trace;
    let peak = |t: &gripgen_twin::PullTrace| t.measured_force_n.iter().fold(0.0_f64, |a, &b| a.max(b));
    for seed in 0..3 {
        let staircase = staircase_of(&settings, &mut Stream::new(seed, 0, Purpose::StepJitter));
        let result =
            pull_staircase(&mut bench.session(0.168), &staircase, &settings, Until::Stopped).unwrap();
        assert_ne!(result.trace.desired_force_n, even.desired_force_n, "the steps should differ");
        assert!((peak(&result.trace) - peak(&even)).abs() < 0.01);
        let steps: Vec<f64> = (1..result.trace.len())
            .filter(|&i| result.trace.desired_force_n[i] > result.trace.desired_force_n[i - 1])
            .map(|i| result.trace.time_s[i])
            .collect();
        for pair in steps.windows(2) {
            let length = pair[1] - pair[0];
            assert!((0.104 * 0.7 - STEP_S..=0.104 * 1.3 + STEP_S).contains(&length), "a step of {length} s");
        }
    }
}

/// A policy may change from speed to force: the force goes on from what acts, and old commands are void.
#[test]
fn a_force_command_after_a_velocity_command_starts_from_the_force_that_acts() {
    let mut bench = Bench::new(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    bench.robot.dead_time_s = 0.02;
    let mut session = bench.session(0.3);
    session.step(Command::ForceN(2.0), 0.01).unwrap();
    let pulled = session.step(Command::SpeedMPerS(5e-4), 0.5).unwrap();
    assert!(pulled.contact_force_n > 5.0, "{pulled:?}");
    for i in 0..60 {
        let state = session.step(Command::ForceN(pulled.contact_force_n), STEP_S).unwrap();
        let jump = (state.contact_force_n - pulled.contact_force_n).abs();
        assert!(
            jump < 0.1 * pulled.contact_force_n,
            "step {i}: {} N after {} N",
            state.contact_force_n,
            pulled.contact_force_n
        );
    }
}

/// The label rule on staircase and lag: with feedback from either source the label is the same limit.
#[test]
fn both_kinds_of_feedback_give_the_same_slip_force() {
    let mut bench = Bench::new(PartShape::cuboid([0.06, 0.02, 0.12]), 40.0);
    let measured = bench.label_n(0.168);
    bench.robot.feedback = Feedback::Independent;
    let independent = bench.label_n(0.168);
    assert!((measured - independent).abs() < 1e-3 * measured, "{measured} and {independent}");
}
