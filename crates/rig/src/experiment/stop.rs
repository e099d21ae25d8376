//! The one way to stop.
//!
//! First the robot, then proof that it stands, and the gripper keeps what it holds: a part that falls is worse than one that
//! is held. Nothing here waits longer than [`LONGEST`].

use super::config::RigConfig;
use super::devices::connect_listener;
use super::event::{RigEvent, Stopped};
use super::fault::Fault;
use super::rest::Rest;
use super::robot::RobotRow;
use super::run::Experiment;
use crate::dashboard::DashboardCommand;
use crate::program::registers;
use crate::rtde::Event;
use std::time::{Duration, Instant};

/// Longest time of a stop, all of its parts together.
pub const LONGEST: Duration = Duration::from_secs(3);
/// Time between two attempts to reach a robot that refuses.
const AGAIN: Duration = Duration::from_millis(100);
/// How long the dashboard may take.
const DASHBOARD: Duration = Duration::from_millis(1000);

impl Experiment<'_> {
    /// Stops everything because of a fault.
    pub fn safe_stop(&mut self, fault: &Fault) -> Stopped {
        let began = Instant::now();
        let mut steps = Vec::new();
        // Both ways at once: the program is told, and its watchdog hears nothing any more.
        self.devices.heart.set_go(registers::STOP);
        self.devices.heart.alive();
        std::thread::sleep(Duration::from_millis(25));
        self.devices.heart.stop();
        steps.push("the program was told to stop, the heartbeat ended".to_string());
        match self.devices.dashboard.command(DashboardCommand::Stop, self.config.patient(DASHBOARD)) {
            Ok(_) => steps.push("the dashboard stopped the program".into()),
            Err(e) => steps.push(format!("the dashboard could not be told: {e}")),
        }
        let still = self.wait_for_rest(began);
        steps.push(
            if still { "the robot stands still" } else { "nobody knows whether the robot stands still" }
                .into(),
        );
        steps.push("the gripper keeps what it holds".into());
        let reason = fault.to_string();
        self.note("stop", format!("{reason}; {}", steps.join("; ")));
        let stopped = Stopped { reason, still, steps, hint: fault.hint() };
        self.tell(RigEvent::Stopped(stopped.clone()));
        stopped
    }

    /// Whether the robot says that it stands, within the time that a stop has.
    fn wait_for_rest(&mut self, began: Instant) -> bool {
        let (mut rest, mut seen) = (Rest::default(), self.rows.len());
        while began.elapsed() < self.config.patient(LONGEST) {
            // What the robot says counts, however bad it is. A link that is gone is made anew, to listen only.
            if self.take_robot(Duration::from_millis(20)).is_err() {
                return listen_for_rest(self.config, began);
            }
            let mut stands = false;
            for row in self.rows.iter().skip(seen).filter(|row| row.at >= began) {
                stands = rest.take(row);
            }
            seen = self.rows.len();
            if stands {
                return true;
            }
        }
        false
    }
}

/// Whether the robot says on a new connection that it stands, within the time that the stop which began then has. Nothing is
/// written there.
fn listen_for_rest(config: &RigConfig, began: Instant) -> bool {
    let longest = config.patient(LONGEST);
    while let Some(left) = longest.checked_sub(began.elapsed()) {
        let Ok(robot) = connect_listener(config, left) else {
            std::thread::sleep(AGAIN.min(left));
            continue;
        };
        let mut rest = Rest::default();
        while let Some(left) = longest.checked_sub(began.elapsed()) {
            let Ok(event) = robot.events().recv_timeout(left) else { break };
            let Event::Data(values) = event.event else { continue };
            let Some(row) = RobotRow::from_values(event.at, &values) else { return false };
            if rest.take(&row) {
                return true;
            }
        }
    }
    false
}
