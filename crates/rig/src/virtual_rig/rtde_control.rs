//! The program that the public client ur_rtde 1.6.5 (`RTDEControlInterface`) uploads, as far as a test of this rig needs it.
//!
//! That program reads a command from an integer register, its arguments from the registers that follow, and answers in an
//! output register: 1 ready, 2 done. The numbers of the commands are those that its text compares with.

use super::arm::{Arm, Drive, STEP_S};
use super::plant::PullRequest;
use super::robot::Robot;
use super::running::Progress;
use crate::program::TcpPose;

const MOVE_L: i32 = 3;
const FORCE_MODE: i32 = 6;
const FORCE_MODE_STOP: i32 = 7;
const ZERO_SENSOR: i32 = 8;
const SET_WATCHDOG: i32 = 35;
const STOP_SCRIPT: i32 = 255;

const READY: i32 = 1;
const DONE: i32 = 2;

/// The program under way.
#[derive(Debug, Clone, PartialEq)]
pub struct RtdeControl {
    /// Register of the command, and of the first argument.
    offset: usize,
    moving_to: Option<TcpPose>,
}

impl RtdeControl {
    /// The program of this text, if it is that program.
    pub fn from_script(text: &str) -> Option<Self> {
        if !text.trim_start().starts_with("def rtde_control():") {
            return None;
        }
        let offset = text.split("reg_offset_int = ").nth(1).and_then(|rest| {
            let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
            digits.parse().ok()
        });
        Some(Self { offset: offset.filter(|o| *o == 24).unwrap_or(0), moving_to: None })
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
        let answer = robot.outputs.int[self.offset];
        let mut progress = Progress::Running;
        robot.outputs.int[self.offset] = match (command, answer) {
            (0, _) => READY,
            (MOVE_L, READY) => {
                let target = TcpPose::from_numbers(self.doubles(robot, 0));
                let speed_m_s = robot.inputs.double[self.offset + 6].clamp(1e-3, 1.0);
                arm.set_drive(Drive::Line { target, speed_m_s });
                self.moving_to = Some(target);
                0
            }
            (MOVE_L, 0) => {
                let arrived = self.moving_to.is_some_and(|t| t.numbers() == robot.tcp.numbers());
                if arrived { DONE } else { 0 }
            }
            (FORCE_MODE, READY) => {
                let force_n = self.doubles(robot, 6)[2];
                let limit_m_s = self.doubles(robot, 12)[2].abs().min(0.5);
                // Type, then the six axes.
                let compliant = robot.inputs.int[self.offset + 4] == 1;
                let pull = PullRequest {
                    direction: 1.0_f64.copysign(force_n),
                    increment_n: force_n.abs(),
                    step_s: STEP_S,
                    dwell_s: arm.dwell_s(robot.timestamp_s),
                    time_s: robot.timestamp_s,
                };
                if compliant {
                    arm.set_drive(Drive::Force { force_n, speed_limit_m_s: limit_m_s, pull });
                }
                DONE
            }
            (FORCE_MODE_STOP, READY) => {
                arm.stop();
                DONE
            }
            (ZERO_SENSOR, READY) => {
                arm.zero(robot.timestamp_s);
                DONE
            }
            (SET_WATCHDOG, READY) => {
                progress = Progress::SetWatchdog;
                DONE
            }
            (STOP_SCRIPT, _) => {
                arm.stop();
                progress = Progress::Ended;
                DONE
            }
            // Others are taken and do nothing here.
            (_, READY) => DONE,
            (_, same) => same,
        };
        progress
    }

    fn doubles(&self, robot: &Robot, first: usize) -> [f64; 6] {
        let at = |i: usize| robot.inputs.double.get(self.offset + first + i).copied().unwrap_or(0.0);
        [at(0), at(1), at(2), at(3), at(4), at(5)]
    }
}
