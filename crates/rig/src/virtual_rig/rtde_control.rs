//! The program that the public client ur_rtde 1.6.5 (`RTDEControlInterface`) uploads, as far as a test of this rig needs it.
//!
//! That program reads a command from an integer register, its arguments from the registers that follow, and answers in an
//! output register: 1 ready, 2 done. The numbers of the commands are those that its text compares with. A command is worked
//! off once, and answered with done until the client takes it back with 0; a command of [`REAL_TIME`] is worked off again
//! in every control step, and the answer stays ready: the client does not wait for it and does not take it back.

use super::arm::{Arm, Drive, STEP_S};
use super::robot::Robot;
use super::running::Progress;
use crate::program::TcpPose;
use gripgen_twin::plant::PullRequest;

const MOVE_L: i32 = 3;
const FORCE_MODE: i32 = 6;
const FORCE_MODE_STOP: i32 = 7;
const ZERO_SENSOR: i32 = 8;
const SET_PAYLOAD: i32 = 17;
const STOP_L: i32 = 33;
const STOP_J: i32 = 34;
const SET_WATCHDOG: i32 = 35;
const STOP_SCRIPT: i32 = 255;
/// Commands that are answered with ready in every control step.
const REAL_TIME: [i32; 16] = [6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71];

const READY: i32 = 1;
const DONE: i32 = 2;

/// The program under way.
#[derive(Debug, Clone, PartialEq)]
pub struct RtdeControl {
    /// Register of the command, and of the first argument.
    offset: usize,
    stage: Stage,
}

#[derive(Debug, Clone, PartialEq)]
enum Stage {
    /// It looks for a command.
    Idle,
    /// It waits for the end of a motion.
    Moving(TcpPose),
    /// The command is done and still stands in its register.
    Answered,
}

impl RtdeControl {
    /// The program of this text, if it is that program.
    pub fn from_script(text: &str) -> Option<Self> {
        if !text.trim_start().starts_with("def rtde_control():") {
            return None;
        }
        // The number is written behind the comment that stood behind it.
        let offset = text.split("reg_offset_int = ").nth(1).and_then(|rest| {
            let rest = if rest.starts_with('#') { rest.split_once('\n')?.1 } else { rest };
            let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
            digits.parse().ok()
        });
        Some(Self { offset: offset.filter(|o| *o == 24).unwrap_or(0), stage: Stage::Idle })
    }

    /// Register that its watchdog watches.
    pub fn command_register(&self) -> usize {
        self.offset
    }

    /// Its watchdog's least rate, where it asks for one.
    pub fn watchdog_hz(&self, robot: &Robot) -> f64 {
        robot.inputs.double[self.offset].max(1.0)
    }

    /// One control step.
    pub fn step(&mut self, robot: &mut Robot, arm: &mut Arm) -> Progress {
        let command = robot.inputs.int[self.offset];
        let mut progress = Progress::Running;
        match &self.stage {
            Stage::Moving(target) => {
                if target.numbers() == robot.tcp.numbers() {
                    robot.outputs.int[self.offset] = DONE;
                    self.stage = Stage::Answered;
                }
            }
            Stage::Idle | Stage::Answered if command == 0 => {
                robot.outputs.int[self.offset] = READY;
                self.stage = Stage::Idle;
            }
            Stage::Idle | Stage::Answered if REAL_TIME.contains(&command) => {
                if command == FORCE_MODE {
                    self.force_mode(robot, arm);
                }
                robot.outputs.int[self.offset] = READY;
            }
            Stage::Answered => {}
            Stage::Idle => {
                (self.stage, progress) = self.begin(command, robot, arm);
                if self.stage == Stage::Answered && progress != Progress::Ended {
                    robot.outputs.int[self.offset] = DONE;
                }
            }
        }
        progress
    }

    /// Works off a command that has just come.
    fn begin(&self, command: i32, robot: &mut Robot, arm: &mut Arm) -> (Stage, Progress) {
        let mut progress = Progress::Running;
        match command {
            MOVE_L => {
                let target = TcpPose::from_numbers(self.doubles(robot, 0));
                let speed_m_s = robot.inputs.double[self.offset + 6].clamp(1e-3, 1.0);
                arm.set_drive(Drive::Line { target, speed_m_s });
                // Its first argument says that the client does not wait.
                if robot.inputs.int[self.offset + 1] != 1 {
                    return (Stage::Moving(target), progress);
                }
            }
            FORCE_MODE_STOP | STOP_L | STOP_J => arm.stop(),
            ZERO_SENSOR => arm.zero(robot.timestamp_s),
            SET_PAYLOAD => {
                let [mass_kg, x, y, z, ..] = self.doubles(robot, 0);
                (robot.payload_kg, robot.centre_of_gravity_m) = (mass_kg, [x, y, z]);
            }
            SET_WATCHDOG => progress = Progress::SetWatchdog,
            STOP_SCRIPT => {
                arm.stop();
                progress = Progress::Ended;
            }
            // Others are taken and do nothing here.
            _ => {}
        }
        (Stage::Answered, progress)
    }

    /// Force along the base's z. The first argument is the type, the six axes follow.
    fn force_mode(&self, robot: &Robot, arm: &mut Arm) {
        let compliant = robot.inputs.int[self.offset + 4] == 1;
        if !compliant {
            return;
        }
        let force_n = self.doubles(robot, 6)[2];
        let speed_limit_m_s = self.doubles(robot, 12)[2].abs().min(0.5);
        let pull = PullRequest {
            direction: 1.0_f64.copysign(force_n),
            increment_n: force_n.abs(),
            step_s: STEP_S,
            dwell_s: arm.dwell_s(robot.timestamp_s),
            time_s: robot.timestamp_s,
        };
        arm.set_drive(Drive::Force { force_n, speed_limit_m_s, pull });
    }

    fn doubles(&self, robot: &Robot, first: usize) -> [f64; 6] {
        let at = |i: usize| robot.inputs.double.get(self.offset + first + i).copied().unwrap_or(0.0);
        [at(0), at(1), at(2), at(3), at(4), at(5)]
    }
}
