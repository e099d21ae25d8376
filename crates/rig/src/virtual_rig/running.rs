//! What the programs of [`crate::program`] do, control step by control step.

use super::arm::{Arm, Drive, STEP_S};
use super::robot::Robot;
use crate::program::{
    ACKNOWLEDGE_S, GO_WAIT_S, HEARTBEAT_WAIT_S, MotionProgram, PRELOAD_S, Phase, PullProgram, SETTLE_S,
    StopReason, TcpPose, ZERO_REST_S, registers,
};
use gripgen_twin::plant::PullRequest;

/// What a program asks of the controller beside moving the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It goes on.
    Running,
    /// It sets its watchdog.
    SetWatchdog,
    /// It has ended.
    Ended,
}

/// Which program it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A pull.
    Pull(PullProgram),
    /// A motion.
    Motion(MotionProgram),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Begin,
    Heartbeat { first: i32, waited_s: f64 },
    ZeroRest { left_s: f64 },
    WaitGo { waited_s: f64 },
    Preload { sum: f64, ticks: u32 },
    Settle { left_s: f64 },
    Pulling { start: TcpPose, ticks: u64, step: i32, desired_n: f64 },
    Moving { ticks: u64 },
    Stopping(StopReason),
    Acknowledge { waited_s: f64 },
}

/// A program under way.
#[derive(Debug, Clone, PartialEq)]
pub struct Running {
    kind: Kind,
    stage: Stage,
    /// Waits for the host count in its time, not in that of a faster clock.
    clock_rate: f64,
}

impl Running {
    /// Begins a program. `clock_rate` is how many times faster than real time the rig runs.
    pub fn new(kind: Kind, clock_rate: f64) -> Self {
        Self { kind, stage: Stage::Begin, clock_rate }
    }

    /// What the controller calls it.
    pub fn title(&self) -> &'static str {
        match self.kind {
            Kind::Pull(_) => "gripgen_pull",
            Kind::Motion(_) => "gripgen_move",
        }
    }

    fn run(&self) -> i32 {
        match self.kind {
            Kind::Pull(p) => p.run,
            Kind::Motion(m) => m.run,
        }
    }

    /// One control step.
    pub fn step(&mut self, robot: &mut Robot, arm: &mut Arm) -> Progress {
        let go = robot.inputs.int[usize::from(registers::GO)];
        let heartbeat = robot.inputs.int[usize::from(registers::HEARTBEAT)];
        let mut progress = Progress::Running;
        self.stage = match self.stage {
            Stage::Begin => {
                for register in [registers::REASON, registers::STEP] {
                    robot.outputs.int[usize::from(register)] = 0;
                }
                for register in [
                    registers::DESIRED_FORCE,
                    registers::DISPLACEMENT,
                    registers::LATERAL,
                    registers::PRELOAD,
                ] {
                    robot.outputs.double[usize::from(register)] = 0.0;
                }
                say(robot, Phase::Started);
                robot.outputs.int[usize::from(registers::RUN)] = self.run();
                Stage::Heartbeat { first: heartbeat, waited_s: 0.0 }
            }
            Stage::Heartbeat { first, waited_s } if heartbeat == first => {
                if waited_s > HEARTBEAT_WAIT_S * self.clock_rate {
                    Stage::Stopping(StopReason::NoHeartbeat)
                } else {
                    Stage::Heartbeat { first, waited_s: waited_s + STEP_S }
                }
            }
            Stage::Heartbeat { .. } => {
                progress = Progress::SetWatchdog;
                self.after_heartbeat(robot)
            }
            Stage::ZeroRest { left_s } if left_s > 0.0 => Stage::ZeroRest { left_s: left_s - STEP_S },
            Stage::ZeroRest { .. } => {
                arm.zero(robot.timestamp_s);
                say(robot, Phase::Zeroed);
                Stage::WaitGo { waited_s: 0.0 }
            }
            Stage::WaitGo { waited_s } => self.wait_go(robot, go, waited_s),
            Stage::Preload { sum, ticks } if f64::from(ticks) * STEP_S < PRELOAD_S => {
                Stage::Preload { sum: sum + robot.wrench[2], ticks: ticks + 1 }
            }
            Stage::Preload { sum, ticks } => {
                let direction = if let Kind::Pull(p) = self.kind { p.direction } else { 1.0 };
                robot.outputs.double[usize::from(registers::PRELOAD)] = direction * sum / f64::from(ticks);
                Stage::Settle { left_s: SETTLE_S }
            }
            Stage::Settle { left_s } if left_s > STEP_S => Stage::Settle { left_s: left_s - STEP_S },
            Stage::Settle { .. } => {
                say(robot, Phase::Pulling);
                let start = robot.tcp;
                self.pull(robot, arm, start, 0, 0, 0.0, go)
            }
            Stage::Pulling { start, ticks, step, desired_n } => {
                self.pull(robot, arm, start, ticks, step, desired_n, go)
            }
            Stage::Moving { ticks } => self.move_on(robot, arm, ticks, go),
            Stage::Stopping(reason) => {
                say(robot, Phase::Braking);
                arm.stop();
                if arm.speed_m_s() > 0.0 {
                    Stage::Stopping(reason)
                } else {
                    robot.outputs.int[usize::from(registers::REASON)] = reason as i32;
                    say(robot, Phase::Stopped);
                    Stage::Acknowledge { waited_s: 0.0 }
                }
            }
            Stage::Acknowledge { waited_s } => {
                if go != self.run() || waited_s >= ACKNOWLEDGE_S * self.clock_rate {
                    progress = Progress::Ended;
                }
                Stage::Acknowledge { waited_s: waited_s + STEP_S }
            }
        };
        progress
    }

    fn after_heartbeat(&self, robot: &mut Robot) -> Stage {
        let (payload_kg, centre_mm, tool_mm) = match self.kind {
            Kind::Pull(p) => (p.payload_kg, p.centre_of_gravity_mm, p.tool_mm),
            Kind::Motion(m) => (m.payload_kg, m.centre_of_gravity_mm, m.tool_mm),
        };
        robot.tool_m = tool_mm.map(|mm| mm * 1e-3);
        (robot.payload_kg, robot.centre_of_gravity_m) = (payload_kg, centre_mm.map(|mm| mm * 1e-3));
        match self.kind {
            Kind::Pull(_) => Stage::ZeroRest { left_s: ZERO_REST_S },
            Kind::Motion(_) => Stage::WaitGo { waited_s: 0.0 },
        }
    }

    fn wait_go(&self, robot: &mut Robot, go: i32, waited_s: f64) -> Stage {
        let wait_s = match self.kind {
            Kind::Pull(pull) => pull.wait_s,
            Kind::Motion(_) => GO_WAIT_S,
        };
        if go == self.run() {
            if let Kind::Pull(_) = self.kind {
                return Stage::Preload { sum: 0.0, ticks: 0 };
            }
            say(robot, Phase::Moving);
            Stage::Moving { ticks: 0 }
        } else if go == registers::STOP || waited_s > wait_s * self.clock_rate {
            Stage::Stopping(StopReason::Host)
        } else {
            Stage::WaitGo { waited_s: waited_s + STEP_S }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the locals of the program's loop")]
    fn pull(
        &self,
        robot: &mut Robot,
        arm: &mut Arm,
        start: TcpPose,
        ticks: u64,
        mut step: i32,
        mut desired_n: f64,
        go: i32,
    ) -> Stage {
        let Kind::Pull(p) = self.kind else { return Stage::Stopping(StopReason::Host) };
        let elapsed_s = ticks as f64 * STEP_S;
        // A step that rounding puts a hair after the tick still belongs to it, as in the simulator.
        let now = ((elapsed_s + 1e-9) / p.step_s).floor() as i32 + 1;
        let mut reason = None;
        if now != step {
            step = now;
            desired_n = p.start_n + f64::from(step - 1) * p.increment_n;
            if desired_n > p.max_force_n {
                reason = Some(StopReason::LargestCommand);
            } else {
                let pull = PullRequest {
                    direction: p.direction,
                    increment_n: p.increment_n,
                    step_s: p.step_s,
                    dwell_s: arm.dwell_s(robot.timestamp_s),
                    time_s: robot.timestamp_s,
                };
                let speed_limit_m_s = p.speed_mm_s * 1e-3;
                arm.set_drive(Drive::Force { force_n: p.direction * desired_n, speed_limit_m_s, pull });
            }
        }
        let [x, y, z] = [0, 1, 2].map(|i| robot.tcp.position_m[i] - start.position_m[i]);
        let (moved, aside) = (p.direction * z, x.hypot(y));
        let torque = robot.wrench[3..].iter().map(|t| t * t).sum::<f64>().sqrt();
        robot.outputs.int[usize::from(registers::STEP)] = step;
        robot.outputs.double[usize::from(registers::DESIRED_FORCE)] = desired_n;
        robot.outputs.double[usize::from(registers::DISPLACEMENT)] = moved;
        robot.outputs.double[usize::from(registers::LATERAL)] = aside;
        let exits = [
            (robot.wrench[2].abs() > p.abort_force_n, StopReason::Force),
            (torque > p.abort_torque_nm, StopReason::Torque),
            (aside > p.lateral_mm * 1e-3, StopReason::Lateral),
            (moved.abs() > p.stop_mm * 1e-3, StopReason::Displacement),
            (go != p.run, StopReason::Host),
            (elapsed_s > p.max_time_s, StopReason::Time),
        ];
        if let Some((_, why)) = exits.into_iter().find(|(is, _)| *is) {
            reason = Some(why);
        }
        match reason {
            Some(reason) => {
                arm.stop();
                Stage::Stopping(reason)
            }
            None => Stage::Pulling { start, ticks: ticks + 1, step, desired_n },
        }
    }

    fn move_on(&self, robot: &Robot, arm: &mut Arm, ticks: u64, go: i32) -> Stage {
        let Kind::Motion(m) = self.kind else { return Stage::Stopping(StopReason::Host) };
        // In every step: a program that was paused goes on where it is.
        arm.set_drive(Drive::Line { target: m.target, speed_m_s: m.speed_mm_s * 1e-3 });
        let force = robot.wrench[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
        let exits = [
            (force > m.abort_force_n, StopReason::Force),
            (go != m.run, StopReason::Host),
            (ticks as f64 * STEP_S > m.max_time_s, StopReason::Time),
            (robot.tcp.numbers() == m.target.numbers(), StopReason::Arrived),
        ];
        match exits.into_iter().find(|(is, _)| *is) {
            Some((_, reason)) => {
                arm.stop();
                Stage::Stopping(reason)
            }
            None => Stage::Moving { ticks: ticks + 1 },
        }
    }
}

fn say(robot: &mut Robot, phase: Phase) {
    robot.outputs.int[usize::from(registers::PHASE)] = phase as i32;
}
