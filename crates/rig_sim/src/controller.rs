//! The virtual robot's controller: power, safety, programs, watchdog, one control step after the other.

use super::arm::{Arm, ArmError, Drive, STEP_S};
use super::body::Body;
use super::robot::{Registers, Robot, RuntimeState};
use super::urscript::{Machine, Program, Progress, Watchdog, WatchdogAction};
use gripgen_rig::program::TcpPose;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};
use gripgen_rig::rtde::Value;
use gripgen_twin::plant::Plant;
use std::sync::Arc;

/// Time on the controller's clock when the rig starts: clients do not trust a controller in its first seconds.
const BOOTED_S: f64 = 60.0;
/// Grip centre at the flange that the teach pendant was told, as in the shipped rig.toml.
pub const TOOL_M: [f64; 3] = [0.0, 0.0, 0.2];
/// How long a protective stop stays before it can be unlocked.
const UNLOCK_AFTER_S: f64 = 5.0;

/// What the controller tells everybody.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Announcement {
    /// A program runs.
    Started {
        /// Its name.
        title: String,
    },
    /// It does not run any more.
    Stopped {
        /// Its name.
        title: String,
        /// Why, if not by itself.
        why: String,
    },
    /// A program says something.
    Said {
        /// What.
        text: String,
    },
    /// A program that this controller cannot run, or not any further.
    CannotRun {
        /// What is wrong.
        problem: String,
    },
    /// The safety system changed.
    Safety(SafetyStatus),
}

/// The controller.
pub struct Controller {
    robot: Robot,
    arm: Arm,
    program: Option<Machine>,
    watchdog: Option<Watchdog>,
    /// A motion that a pause has broken off.
    broken_off: Option<Drive>,
    /// When each integer register was last written.
    written_s: [f64; 48],
    /// When any input was last written.
    input_s: f64,
    clock_rate: f64,
    stopped_s: f64,
    announcements: Vec<Announcement>,
}

/// Payload of the installation, as the shipped rig's file has it.
pub const PAYLOAD_KG: f64 = 1.6;

impl Controller {
    /// The speed slider, moved by somebody.
    pub fn set_speed_slider(&mut self, share: f64) {
        self.robot.speed_slider = share;
    }

    /// A controller that is powered on with its brakes released. `clock_rate` is how many times faster than real time it runs.
    pub fn new(plant: Arc<dyn Plant>, tcp: TcpPose, clock_rate: f64) -> Self {
        let arm = Arm::new(plant, tcp, TOOL_M);
        let robot = Robot {
            timestamp_s: BOOTED_S,
            mode: RobotMode::Running,
            safety: SafetyStatus::Normal,
            runtime: RuntimeState::Stopped,
            tcp,
            velocity_m_s: [0.0; 3],
            joints_rad: arm.joints_rad(),
            joint_speeds_rad_s: [0.0; 6],
            wrench: [0.0; 6],
            raw_wrench: [0.0; 6],
            speed_slider: 1.0,
            payload_kg: PAYLOAD_KG,
            centre_of_gravity_m: [0.0; 3],
            tool_m: TOOL_M,
            inputs: Registers::default(),
            outputs: Registers::default(),
        };
        Self {
            robot,
            arm,
            program: None,
            watchdog: None,
            broken_off: None,
            written_s: [BOOTED_S; 48],
            input_s: BOOTED_S,
            clock_rate,
            stopped_s: f64::NEG_INFINITY,
            announcements: Vec::new(),
        }
    }

    /// The robot as it is now.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The arm, to close and open its jaws and hang masses on it.
    pub fn arm_mut(&mut self) -> &mut Arm {
        &mut self.arm
    }

    /// What was announced since the last call.
    pub fn take_announcements(&mut self) -> Vec<Announcement> {
        std::mem::take(&mut self.announcements)
    }

    /// Name of the program that runs or is paused.
    pub fn program_title(&self) -> Option<&str> {
        self.program.as_ref().map(|machine| machine.program().title())
    }

    /// Somebody else has something to tell.
    pub fn announce_problem(&mut self, problem: &str) {
        self.announcements.push(Announcement::CannotRun { problem: problem.into() });
    }

    /// Time since a client wrote an input.
    pub fn unheard_s(&self) -> f64 {
        self.robot.timestamp_s - self.input_s
    }

    /// A client wrote an input.
    pub fn write_input(&mut self, name: &str, value: Value) {
        self.robot.write_input(name, value);
        self.input_s = self.robot.timestamp_s;
        let register =
            name.strip_prefix("input_int_register_").and_then(|digits| digits.parse::<usize>().ok());
        if let Some(at) = register.and_then(|i| self.written_s.get_mut(i)) {
            *at = self.robot.timestamp_s;
        }
    }

    /// A client sent a program. It replaces the one that runs; a text that is none replaces nothing.
    pub fn run_script(&mut self, text: &str) {
        let program = match Program::parse(text) {
            Ok(program) => program,
            Err(e) => return self.announce_problem(&e.to_string()),
        };
        self.stop_program("another program replaces it");
        if self.robot.mode != RobotMode::Running || self.robot.safety != SafetyStatus::Normal {
            let (mode, safety) = (self.robot.mode.name(), self.robot.safety.name());
            let problem = format!("the robot is {mode} and {safety}: no program can run");
            return self.announcements.push(Announcement::CannotRun { problem });
        }
        self.announcements.push(Announcement::Started { title: program.title().into() });
        // A controller zeroes its sensor at the start of every program.
        self.arm.zero();
        self.program = Some(Machine::new(Arc::new(program)));
        self.robot.runtime = RuntimeState::Playing;
    }

    /// Ends the program and brakes.
    pub fn stop_program(&mut self, why: &str) {
        if let Some(program) = self.program.take() {
            let (title, why) = (program.program().title().into(), why.into());
            self.announcements.push(Announcement::Stopped { title, why });
        }
        self.watchdog = None;
        self.broken_off = None;
        self.robot.runtime = RuntimeState::Stopped;
        self.arm.stop();
    }

    /// The emergency stop: no power.
    pub fn emergency_stop(&mut self) {
        self.stop_program("emergency stop");
        self.robot.mode = RobotMode::PowerOff;
        self.set_safety(SafetyStatus::RobotEmergencyStop);
    }

    /// The controller stops by itself; the program waits, and its watchdog with it.
    pub fn protective_stop(&mut self) {
        self.break_off();
        self.stopped_s = self.robot.timestamp_s;
        self.set_safety(SafetyStatus::ProtectiveStop);
    }

    /// Leaves a protective stop, or says why not yet. The program stays where it is.
    ///
    /// # Errors
    ///
    /// Less than five seconds after the stop.
    pub fn unlock(&mut self) -> Result<(), String> {
        let passed_s = self.robot.timestamp_s - self.stopped_s;
        if self.robot.safety != SafetyStatus::ProtectiveStop {
            return Ok(());
        }
        if passed_s < UNLOCK_AFTER_S {
            return Err(format!("{passed_s:.1} s have passed since the stop, {UNLOCK_AFTER_S} s are needed"));
        }
        self.set_safety(SafetyStatus::Normal);
        Ok(())
    }

    /// The emergency stop is released and the safety system starts anew.
    pub fn restart_safety(&mut self) {
        self.set_safety(SafetyStatus::Normal);
    }

    /// Power and brakes.
    pub fn set_mode(&mut self, mode: RobotMode) {
        if mode != RobotMode::Running {
            self.stop_program("the arm loses its power or its brakes are on");
        }
        self.robot.mode = mode;
    }

    /// The program waits, the arm brakes.
    pub fn pause(&mut self) {
        if self.program.is_some() {
            self.break_off();
        }
    }

    /// The arm brakes. A program that runs waits, and its motion with it; force mode is over.
    fn break_off(&mut self) {
        if self.robot.runtime == RuntimeState::Playing {
            self.broken_off = Some(self.arm.drive())
                .filter(|drive| matches!(drive, Drive::Line { .. } | Drive::Joints { .. }));
        }
        self.arm.stop();
        if self.program.is_some() {
            self.robot.runtime = RuntimeState::Paused;
        }
    }

    /// A paused program goes on.
    pub fn play(&mut self) {
        if self.program.is_some() && self.robot.safety == SafetyStatus::Normal {
            self.robot.runtime = RuntimeState::Playing;
            // It is not in force mode: the pause has ended that.
            let _ = match self.broken_off.take() {
                Some(Drive::Line { target, speed_m_s, acceleration_m_s2 }) => {
                    self.arm.move_line(target, acceleration_m_s2, speed_m_s)
                }
                Some(Drive::Joints { target_rad, speed_rad_s, acceleration_rad_s2 }) => {
                    self.arm.move_joints(target_rad, acceleration_rad_s2, speed_rad_s)
                }
                _ => Ok(()),
            };
        }
    }

    fn set_safety(&mut self, safety: SafetyStatus) {
        self.robot.safety = safety;
        self.announcements.push(Announcement::Safety(safety));
    }

    /// First half of a control step: the program reads the sensors and writes its registers. What clients get is the robot
    /// after it.
    pub fn begin_step(&mut self) {
        if self.robot.runtime != RuntimeState::Playing {
            return;
        }
        if let Some(dog) = &self.watchdog {
            let silent_s = self.robot.timestamp_s - self.written_s[dog.register];
            // It watches the host, whose time is not that of a faster clock.
            if silent_s > self.clock_rate / dog.rate_hz {
                match dog.action {
                    WatchdogAction::Stop => {
                        return self.stop_program("the host does not write its heartbeat any more");
                    }
                    WatchdogAction::Pause => return self.pause(),
                    WatchdogAction::Ignore => {}
                }
            }
        }
        let Some(machine) = &mut self.program else { return };
        let mut body = Body::new(&mut self.robot, &mut self.arm);
        let progress = machine.step(&mut body);
        let (watchdog, said) = body.into_parts();
        if let Some(dog) = watchdog {
            self.written_s[dog.register] = self.robot.timestamp_s;
            self.watchdog = Some(dog).filter(|dog| dog.rate_hz > 0.0);
        }
        self.announcements.extend(said.into_iter().map(|text| Announcement::Said { text }));
        match progress {
            Ok(Progress::Running) => {}
            Ok(Progress::Ended) => self.stop_program(""),
            Err(e) => {
                self.announce_problem(&e.to_string());
                self.stop_program(&e.to_string());
            }
        }
    }

    /// Second half: time and physics go on.
    pub fn end_step(&mut self) {
        self.robot.timestamp_s += STEP_S;
        match self.arm.advance(self.robot.timestamp_s) {
            Ok(()) => {}
            Err(ArmError::Collision { .. }) => self.protective_stop(),
            Err(e @ (ArmError::OutOfReach(_) | ArmError::TooFast { .. })) => {
                self.announce_problem(&e.to_string());
                self.protective_stop();
            }
            Err(e @ ArmError::Plant(_)) => {
                self.announcements.push(Announcement::CannotRun { problem: e.to_string() });
                self.stop_program("the plant cannot go on");
            }
        }
        self.robot.tcp = self.arm.tcp();
        self.robot.velocity_m_s = self.arm.velocity_m_s();
        self.robot.joints_rad = self.arm.joints_rad();
        self.robot.joint_speeds_rad_s = self.arm.joint_speeds_rad_s();
        let (force_n, raw_n) = self.arm.force_z_n();
        (self.robot.wrench[2], self.robot.raw_wrench[2]) = (force_n, raw_n);
        // At the grip a force has no lever; at the flange it has (see `Body::tcp_force`).
        (self.robot.wrench[0], self.robot.raw_wrench[0]) = self.arm.aside_n();
    }
}
