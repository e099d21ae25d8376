//! The pull, and what is not perfect about arm and sensor. All exits of the program: [`crate::program_check`].

use super::*;
use crate::arm::ArmFaults;

/// A pull of a gripped part, up to its first step.
fn pulling(spring: Spring, of: impl FnOnce(&mut PullProgram)) -> HostedRobot {
    let mut program = PullProgram { run: 3, ..PullProgram::default() };
    of(&mut program);
    let mut rig = rig_around(spring);
    rig.controller.run_script(&program.script().unwrap());
    rig.until_phase(Phase::Zeroed);
    rig.close_jaws();
    rig.go(3);
    rig.until_phase(Phase::Pulling);
    rig
}

fn double(rig: &HostedRobot, register: u8) -> f64 {
    rig.controller.robot().outputs.double[usize::from(register)]
}

/// What the load is for a tool that pulls along `direction`.
fn felt_n(rig: &HostedRobot, direction: f64) -> f64 {
    -direction * rig.controller.robot().wrench[2]
}

#[test]
fn the_force_of_a_step_acts_in_the_step_that_names_it() {
    for direction in [1.0, -1.0] {
        let mut rig = pulling(Spring::default(), |p| p.direction = direction);
        let mut steps = Vec::new();
        for _ in 0..500 {
            let desired_n = double(&rig, registers::DESIRED_FORCE);
            let felt_n = felt_n(&rig, direction);
            assert!((felt_n - desired_n).abs() < 1e-9, "{desired_n} N asked, {felt_n} N felt");
            // The spring is the displacement, seen one step later.
            let raised_m = direction * (rig.controller.robot().tcp.position_m[2] - START.position_m[2]);
            assert!((raised_m - desired_n / 50_000.0).abs() < 1e-12, "{raised_m} m at {desired_n} N");
            if steps.last() != Some(&desired_n) {
                steps.push(desired_n);
            }
            rig.step();
        }
        // A second of steps of 0.104 s.
        assert_eq!(steps, (1..=10).map(f64::from).collect::<Vec<_>>());
    }
}

#[test]
fn the_part_slips_at_its_limit_and_the_pull_ends_at_its_displacement() {
    let mut rig = pulling(Spring::default(), |p| p.stop_mm = 2.0);
    let seconds = rig.until(|c| c.arm().speed_m_s() > 0.015 && c.robot().wrench[2] < -10.1);
    // 10 steps hold, the eleventh does not: 11 N are more than 10.25 N.
    assert!((1.04 - 0.01..=1.04 + 0.01).contains(&seconds), "{seconds} s");
    assert_eq!(double(&rig, registers::DESIRED_FORCE), 11.0);
    assert!((felt_n(&rig, 1.0) - 10.25).abs() < 1e-9);
    rig.until_phase(Phase::Stopped);
    assert_eq!(rig.reason(), Some(StopReason::Displacement));
    assert_eq!(double(&rig, registers::DESIRED_FORCE), 11.0, "100 ms of sliding are less than a step");
    assert!(rig.stands_still());
    let moved_mm = 1e3 * (rig.controller.robot().tcp.position_m[2] - START.position_m[2]);
    // At 20 mm/s a control step and the way to brake are 0.15 mm.
    assert!((2.0..2.2).contains(&moved_mm), "{moved_mm} mm");
}

#[test]
fn the_preload_is_what_was_felt_before_the_pull() {
    let mut rig = rig();
    rig.controller.run_script(&PullProgram { direction: -1.0, ..PullProgram::default() }.script().unwrap());
    rig.until_phase(Phase::Zeroed);
    assert_eq!(rig.controller.robot().wrench[2], 0.0, "the offset is zeroed");
    assert_eq!(rig.controller.robot().raw_wrench[2], -rig.spring.offset_n);
    rig.controller.arm_mut().hang(0.1);
    rig.go(1);
    rig.until_phase(Phase::Pulling);
    let preload_n = double(&rig, registers::PRELOAD);
    // It hangs down: along a pull downwards.
    assert!((preload_n - 0.980_665).abs() < 0.01, "{preload_n} N");
}

#[test]
fn every_other_way_out_has_its_reason() {
    let strong = || Spring { limit_n: 1000.0, ..Spring::default() };
    let ends = |spring: Spring, of: fn(&mut PullProgram)| {
        let mut rig = pulling(spring, of);
        rig.until_phase(Phase::Stopped);
        assert!(rig.stands_still());
        (rig.reason(), double(&rig, registers::DESIRED_FORCE))
    };
    let largest = ends(strong(), |p| p.max_force_n = 5.0);
    assert_eq!(
        largest,
        (Some(StopReason::LargestCommand), 6.0),
        "the command that is too large is not given"
    );
    assert_eq!(ends(strong(), |p| p.max_time_s = 0.5), (Some(StopReason::Time), 5.0));
    // A sensor that reads a fifth too much: 42 N become 50.4 N.
    let (reason, desired_n) = ends(Spring { gain: 1.2, ..strong() }, |p| p.step_s = 0.05);
    assert_eq!((reason, desired_n), (Some(StopReason::Force), 42.0));
}

#[test]
fn the_host_ends_a_pull_in_each_of_its_phases() {
    let mut rig = pulling(Spring::default(), |_| ());
    rig.run(0.3);
    rig.go(0);
    rig.until_phase(Phase::Stopped);
    assert_eq!(rig.reason(), Some(StopReason::Host));

    let waiting = |wait_s| {
        let mut rig = super::rig();
        rig.controller.run_script(&PullProgram { wait_s, ..PullProgram::default() }.script().unwrap());
        rig.until_phase(Phase::Zeroed);
        rig
    };
    let mut rig = waiting(120.0);
    rig.go(registers::STOP);
    assert!(rig.until_phase(Phase::Stopped) < 0.01);
    assert_eq!(rig.reason(), Some(StopReason::Host));
    let mut rig = waiting(2.0);
    let waited_s = rig.until_phase(Phase::Stopped);
    assert!((2.0..2.02).contains(&waited_s), "{waited_s} s");
    assert_eq!((rig.reason(), rig.controller.robot().tcp), (Some(StopReason::Host), START));
}

#[test]
fn without_a_heartbeat_nothing_begins() {
    let mut rig = rig();
    rig.beats = false;
    rig.go(1);
    let heavier = PullProgram { payload_kg: 2.1, ..PullProgram::default() };
    rig.controller.run_script(&heavier.script().unwrap());
    let waited_s = rig.until_phase(Phase::Stopped);
    assert!((10.0..10.02).contains(&waited_s), "{waited_s} s");
    assert_eq!((rig.reason(), rig.controller.robot().tcp), (Some(StopReason::NoHeartbeat), START));
    assert_eq!(rig.controller.robot().payload_kg, 1.6, "not even the payload is set");
}

/// The loop: a step is answered after the dead time with the time constant; the tool, which the gels let move, with it.
#[test]
fn force_mode_trails_as_it_is_asked_to() {
    let strong = Spring { limit_n: 1000.0, ..Spring::default() };
    let faults = ArmFaults { force_lag_s: 0.2, force_dead_s: 0.1, ..ArmFaults::default() };
    let mut rig = rig_around(strong);
    rig.controller.arm_mut().set_faults(faults);
    let program = PullProgram { run: 3, start_n: 4.0, step_s: 5.0, ..PullProgram::default() };
    rig.controller.run_script(&program.script().unwrap());
    rig.until_phase(Phase::Zeroed);
    rig.close_jaws();
    rig.go(3);
    rig.until_phase(Phase::Pulling);
    let after = |lags: f64| 4.0 * (1.0 - f64::exp(-lags));
    for (wait_s, wanted_n) in [(0.09, 0.0), (0.21, after(1.0)), (0.2, after(2.0)), (2.0, 4.0)] {
        rig.run(wait_s);
        let felt_n = felt_n(&rig, 1.0);
        assert!((felt_n - wanted_n).abs() < 0.05, "{felt_n} N, {wanted_n} N after {wait_s} s more");
        let raised_n = 50_000.0 * (rig.controller.robot().tcp.position_m[2] - START.position_m[2]);
        assert!((raised_n - felt_n).abs() < 0.01, "the tool shows {raised_n} N");
    }
}

/// The sensor: it trails its load, which the tool does not; its zero wanders; jaws press across the pull, and at the flange the
/// tool is a lever.
#[test]
fn the_sensor_trails_wanders_and_feels_the_clamp() {
    let mut rig = rig_around(Spring { limit_n: 1000.0, ..Spring::default() });
    let faults = ArmFaults { sensor_lag_s: 0.2, drift_n_s: 0.05, clamp_n: 8.0, ..ArmFaults::default() };
    rig.controller.arm_mut().set_faults(faults);
    let program = PullProgram { run: 3, start_n: 4.0, step_s: 5.0, ..PullProgram::default() };
    rig.controller.run_script(&program.script().unwrap());
    rig.until_phase(Phase::Zeroed);
    rig.run(2.0);
    let drifted_n = rig.controller.robot().wrench[2];
    assert!((drifted_n - 0.1).abs() < 0.01, "{drifted_n} N after 2 s");
    rig.close_jaws();
    rig.run(0.002);
    assert_eq!(rig.controller.robot().wrench[0], 8.0);
    rig.go(3);
    rig.until_phase(Phase::Pulling);
    rig.run(0.2);
    let (felt_n, raised_m) =
        (felt_n(&rig, 1.0), rig.controller.robot().tcp.position_m[2] - START.position_m[2]);
    assert!((felt_n + drifted_n - 4.0 * (1.0 - f64::exp(-1.0))).abs() < 0.1, "{felt_n} N");
    assert!((raised_m - 4.0 / 50_000.0).abs() < 1e-9, "the tool is there at once");
    // 8 N at a lever of 0.2 m end nothing; with 34 N more they are 8.4 Nm.
    rig.controller.arm_mut().pull_aside(34.0);
    rig.until_phase(Phase::Stopped);
    assert_eq!(rig.reason(), Some(StopReason::Torque));
    assert_eq!(rig.controller.robot().wrench[4], 0.0, "RTDE has the torque at the grip, where no lever is");
}
