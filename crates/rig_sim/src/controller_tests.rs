//! The controller, step by step: power, safety, watchdog, and what its programs do to a plant in closed form.

use super::arm::STEP_S;
use super::controller::{Announcement, Controller};
use super::dashboard;
use super::robot::RuntimeState;
use super::spring::Spring;
use gripgen_rig::program::{MotionProgram, Phase, PullProgram, StopReason, TcpPose, registers};
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};
use gripgen_rig::rtde::Value;
use gripgen_twin::plant::Plant;
use std::sync::Arc;

mod joints;
mod pulls;

const START: TcpPose = TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] };

/// A robot whose host writes its heartbeat.
struct HostedRobot {
    controller: Controller,
    spring: Spring,
    beat: i32,
    beats: bool,
    told: Vec<Announcement>,
}

fn rig_around(spring: Spring) -> HostedRobot {
    let controller = Controller::new(Arc::new(spring), START, 1.0);
    HostedRobot { controller, spring, beat: 0, beats: true, told: Vec::new() }
}

fn rig() -> HostedRobot {
    rig_around(Spring::default())
}

impl HostedRobot {
    fn go(&mut self, go: i32) {
        self.controller.write_input("input_int_register_25", Value::Int32(go));
    }

    /// One control step; the host beats at 50 Hz.
    fn step(&mut self) {
        self.beat += 1;
        if self.beats && self.beat % 10 == 0 {
            self.controller.write_input("input_int_register_24", Value::Int32(self.beat));
        }
        self.controller.begin_step();
        self.controller.end_step();
        self.told.extend(self.controller.take_announcements());
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / STEP_S).round() as u64).for_each(|_| self.step());
    }

    /// Runs until `is`, for a minute at most; how long it took.
    fn until(&mut self, is: impl Fn(&Controller) -> bool) -> f64 {
        let steps = (0..30_000).take_while(|_| {
            let goes_on = !is(&self.controller);
            if goes_on {
                self.step();
            }
            goes_on
        });
        let count = steps.count();
        assert!(count < 30_000, "it never came: {:?}", self.controller.robot());
        count as f64 * STEP_S
    }

    fn until_phase(&mut self, phase: Phase) -> f64 {
        self.until(|c| c.robot().outputs.int[usize::from(registers::PHASE)] == phase as i32)
    }

    fn reason(&self) -> Option<StopReason> {
        StopReason::from_number(self.controller.robot().outputs.int[usize::from(registers::REASON)])
    }

    fn say(&mut self, line: &str) -> String {
        dashboard::reply(line, &mut self.controller).text
    }

    fn close_jaws(&mut self) {
        let time_s = self.controller.robot().timestamp_s;
        let request = self.controller.arm().grip_request(20.0, time_s);
        self.controller.arm_mut().close(self.spring.grip(&request).unwrap(), time_s);
    }

    /// Whether it is where the motion leads, to the digits of the program.
    fn arrived(&self) -> bool {
        self.controller.robot().tcp.distance_m(&motion(|_| ()).target) < 1e-6
    }

    /// Whether it stands once it has braked, which takes 50 ms from 100 mm/s.
    fn stands_still(&mut self) -> bool {
        self.run(0.06);
        let before = self.controller.robot().tcp;
        self.run(0.2);
        before == self.controller.robot().tcp && self.controller.arm().speed_m_s() == 0.0
    }
}

fn motion(of: impl FnOnce(&mut MotionProgram)) -> MotionProgram {
    let mut motion = MotionProgram {
        run: 4,
        target: START.raised(0.1),
        speed_mm_s: 100.0,
        abort_force_n: 20.0,
        max_time_s: 20.0,
        payload_kg: 1.6,
        centre_of_gravity_mm: [0.0, 0.0, 80.0],
        tool_mm: [0.0, 0.0, 200.0],
    };
    of(&mut motion);
    motion
}

/// A rig on its way.
fn moving(of: impl FnOnce(&mut MotionProgram)) -> HostedRobot {
    let mut rig = rig();
    rig.go(4);
    rig.controller.run_script(&motion(of).script().unwrap());
    rig.until_phase(Phase::Moving);
    rig.run(0.3);
    assert!(rig.controller.arm().speed_m_s() > 0.0);
    rig
}

#[test]
fn power_and_brakes_come_one_after_the_other() {
    let mut rig = moving(|_| ());
    assert_eq!(rig.say("power off"), "Powering off");
    assert_eq!(rig.say("robotmode"), "Robotmode: POWER_OFF");
    assert_eq!(rig.controller.program_title(), None);
    assert!(rig.stands_still());
    rig.say("power on");
    assert_eq!(rig.say("robotmode"), "Robotmode: IDLE");
    assert_eq!(rig.controller.robot().status_bits(), 1, "power, no program");
    rig.say("brake release");
    assert_eq!(rig.say("robotmode"), "Robotmode: RUNNING");
    assert_eq!(rig.say("power on"), "Powering on");
    assert_eq!(rig.say("robotmode"), "Robotmode: RUNNING", "power does not put brakes on");
}

#[test]
fn a_protective_stop_pauses_and_is_unlocked_after_five_seconds() {
    let mut rig = moving(|_| ());
    rig.controller.protective_stop();
    assert_eq!(rig.controller.robot().runtime, RuntimeState::Paused);
    assert_eq!(rig.controller.robot().safety, SafetyStatus::ProtectiveStop);
    assert!(rig.stands_still());
    rig.run(4.45);
    assert!(rig.say("unlock protective stop").contains("4.7 s have passed since the stop, 5 s are needed"));
    assert!(!rig.say("play").contains("Starting"), "nothing plays before it is unlocked");
    assert_eq!(rig.say("programState"), "PAUSED gripgen_move");
    rig.run(0.5);
    assert_eq!(rig.say("unlock protective stop"), "Protective stop releasing");
    assert!(rig.stands_still(), "to unlock is not to move");
    assert_eq!(rig.say("play"), "Starting program");
    assert_eq!(rig.say("programState"), "PLAYING gripgen_move");
    rig.until_phase(Phase::Stopped);
    assert_eq!(rig.reason(), Some(StopReason::Arrived));
    assert!(rig.arrived());
}

#[test]
fn a_program_that_waits_is_ended_by_the_dashboard() {
    let mut rig = moving(|_| ());
    rig.controller.protective_stop();
    rig.run(0.1);
    assert_eq!(rig.say("stop"), "Stopped");
    assert_eq!(rig.say("programState"), "STOPPED");
    rig.run(6.0);
    rig.say("unlock protective stop");
    assert_eq!(rig.say("play"), "Failed to execute: play");
    assert!(rig.stands_still());
}

/// The watchdog is the program's: what goes on after a stop is watched as before.
#[test]
fn what_plays_again_without_its_host_is_stopped() {
    let mut rig = moving(|_| ());
    rig.controller.protective_stop();
    rig.beats = false;
    rig.run(6.0);
    rig.say("unlock protective stop");
    rig.say("play");
    rig.run(0.01);
    assert_eq!(rig.controller.program_title(), None);
    assert!(rig.stands_still());
}

#[test]
fn an_emergency_stop_takes_the_power_until_it_is_released() {
    let mut rig = moving(|_| ());
    rig.controller.emergency_stop();
    assert!(rig.stands_still());
    let robot = rig.controller.robot();
    assert_eq!((robot.mode, robot.safety), (RobotMode::PowerOff, SafetyStatus::RobotEmergencyStop));
    assert_eq!(rig.controller.program_title(), None);
    assert_eq!(rig.say("power on"), "Failed: the robot is in ROBOT_EMERGENCY_STOP");
    assert_eq!(rig.say("brake release"), "Failed: the robot is in ROBOT_EMERGENCY_STOP");
    rig.controller.restart_safety();
    rig.say("brake release");
    assert_eq!(rig.controller.robot().mode, RobotMode::Running);
    let stops = [SafetyStatus::RobotEmergencyStop, SafetyStatus::Normal].map(Announcement::Safety);
    rig.told.extend(rig.controller.take_announcements());
    assert!(stops.iter().all(|stop| rig.told.contains(stop)), "{:?}", rig.told);
}

#[test]
fn the_watchdog_ends_the_program_a_tenth_of_a_second_after_the_last_heartbeat() {
    let mut rig = moving(|_| ());
    // The host dies right after a heartbeat.
    while rig.beat % 10 != 0 {
        rig.step();
    }
    rig.beats = false;
    let seconds = rig.until(|c| c.program_title().is_none());
    assert!((0.1 - 1e-9..=0.1 + STEP_S + 1e-9).contains(&seconds), "{seconds} s");
    rig.run(0.1);
    assert!(rig.stands_still());
    assert!(!rig.arrived());
    let told =
        rig.told.iter().any(|a| matches!(a, Announcement::Stopped { why, .. } if why.contains("heartbeat")));
    assert!(told, "{:?}", rig.told);
}

/// Words that are none are announced with their line, and what runs goes on; words that this robot cannot follow end their program.
#[test]
fn a_text_that_is_no_program_is_announced_and_replaces_nothing() {
    let mut rig = moving(|_| ());
    rig.told.clear();
    rig.controller.run_script("def my_program():\n  x = 1\n  frobnicate(x)\nend\n");
    rig.step();
    assert_eq!(rig.controller.program_title(), Some("gripgen_move"));
    let [Announcement::CannotRun { problem }] = &rig.told[..] else { panic!("{:?}", rig.told) };
    assert_eq!(problem, "line 3: `frobnicate` is no function that is known");
    rig.controller.run_script("def my_program():\n  movej([0,0,7,0,0,0])\nend\n");
    rig.run(0.1);
    assert_eq!(rig.controller.program_title(), None);
    let Some(Announcement::Stopped { title, why }) = rig.told.last() else { panic!("{:?}", rig.told) };
    assert_eq!(
        (title.as_str(), why.as_str()),
        ("my_program", "line 2: movej: joint 3 at 7.00 rad, 6.28 rad are the most")
    );
    assert!(rig.stands_still());
}

#[test]
fn another_program_replaces_the_one_that_runs() {
    let mut rig = moving(|_| ());
    rig.told.clear();
    rig.controller.run_script(&PullProgram::default().script().unwrap());
    assert_eq!(rig.controller.program_title(), Some("gripgen_pull"));
    assert!(rig.stands_still(), "the motion is gone");
    let (title, why) = ("gripgen_move".to_string(), "another program replaces it".to_string());
    let started = Announcement::Started { title: "gripgen_pull".into() };
    assert_eq!(rig.told, [Announcement::Stopped { title, why }, started]);
    // The last resort of every client.
    rig.controller.run_script("stopl(2.0)\n");
    assert_eq!(rig.controller.program_title(), Some(""));
    rig.run(0.1);
    assert_eq!(rig.controller.program_title(), None);
}

#[test]
fn no_program_runs_on_a_robot_that_does_not() {
    let script = motion(|_| ()).script().unwrap();
    let refused = |of: fn(&mut Controller)| {
        let mut rig = rig();
        of(&mut rig.controller);
        rig.controller.run_script(&script);
        rig.go(4);
        rig.run(1.0);
        assert_eq!((rig.controller.program_title(), rig.controller.robot().tcp), (None, START));
        format!("{:?}", rig.told)
    };
    assert!(refused(|c| c.set_mode(RobotMode::Idle)).contains("the robot is IDLE and NORMAL"));
    assert!(refused(Controller::emergency_stop).contains("POWER_OFF and ROBOT_EMERGENCY_STOP"));
    assert!(refused(Controller::protective_stop).contains("RUNNING and PROTECTIVE_STOP"));
}

#[test]
fn a_motion_arrives_and_every_other_way_out_stops_it() {
    let mut rig = moving(|_| ());
    rig.until_phase(Phase::Stopped);
    assert_eq!(rig.reason(), Some(StopReason::Arrived));
    assert!(rig.arrived());
    rig.go(0);
    rig.run(0.1);
    assert_eq!(rig.controller.program_title(), None, "acknowledged");

    let broken_off = |of: fn(&mut MotionProgram), with: fn(&mut HostedRobot), reason| {
        let mut rig = moving(of);
        with(&mut rig);
        rig.until_phase(Phase::Stopped);
        assert_eq!(rig.reason(), Some(reason));
        assert!(rig.stands_still() && !rig.arrived());
    };
    broken_off(|_| (), |rig| rig.go(registers::STOP), StopReason::Host);
    // 3 kg are 29.4 N.
    broken_off(|_| (), |rig| rig.controller.arm_mut().hang(3.0), StopReason::Force);
    broken_off(|m| m.max_time_s = 0.5, |_| (), StopReason::Time);
}

/// The program asks the controller before it moves.
#[test]
fn a_pose_beyond_the_reach_is_refused_before_anything_moves() {
    let mut rig = rig();
    rig.go(4);
    rig.controller.run_script(&motion(|m| m.target.position_m[0] = 1.2).script().unwrap());
    rig.until_phase(Phase::Stopped);
    assert_eq!((rig.reason(), rig.controller.robot().tcp), (Some(StopReason::Unreachable), START));
    assert_eq!(rig.controller.robot().safety, SafetyStatus::Normal);
}

#[test]
fn a_robot_that_moves_a_held_part_stops_by_itself() {
    let mut rig = rig();
    rig.close_jaws();
    rig.go(4);
    rig.controller.run_script(&motion(|_| ()).script().unwrap());
    rig.until(|c| c.robot().safety == SafetyStatus::ProtectiveStop);
    rig.run(0.1);
    assert!(rig.stands_still());
    let moved_m = rig.controller.robot().tcp.distance_m(&START);
    // Two millimetres, and the way to brake from 100 mm/s with 2 m/s^2.
    assert!((0.002..0.002 + 0.0027).contains(&moved_m), "{moved_m} m");
    assert_eq!(rig.controller.robot().runtime, RuntimeState::Paused);
}
