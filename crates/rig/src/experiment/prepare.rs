//! Before anything moves: is the robot allowed to, and does somebody stand beside it who said so.

use super::devices::Devices;
use crate::dashboard::{DashboardCommand, DashboardError, DashboardReply, PolyscopeVersion};
use crate::robot_state::{RobotMode, SafetyStatus};
use std::time::{Duration, Instant};

/// How long power and brakes may take.
const POWER: Duration = Duration::from_secs(60);
/// Time between two questions.
const ASK: Duration = Duration::from_millis(200);

/// What a person who stands beside the robot has allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Permit {
    /// Power on and brakes off.
    pub power_on: bool,
    /// Leave a protective stop.
    pub unlock: bool,
}

/// Why the robot is not ready.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The dashboard.
    #[error("the dashboard: {0}")]
    Dashboard(#[from] DashboardError),
    /// An answer to something else.
    #[error("the dashboard answers {found:?} to {asked}")]
    Answer {
        /// What was asked.
        asked: &'static str,
        /// What came.
        found: DashboardReply,
    },
    /// A controller that this was not written for.
    #[error("{why}")]
    Version {
        /// Which it is, and why not.
        why: String,
    },
    /// Commands from outside are not taken.
    #[error("the robot is in local control: switch the teach pendant to remote control")]
    Local,
    /// Nobody allowed to leave a protective stop.
    #[error("the robot is in a protective stop: look at it, then allow --unlock")]
    Protective,
    /// Another state of the safety system.
    #[error("the safety system says {}: this is left to a person at the robot", .status.name())]
    Safety {
        /// What it says.
        status: SafetyStatus,
    },
    /// Nobody allowed power.
    #[error("the robot is {}: look at it, then allow --power-on", .mode.name())]
    Power {
        /// What it is.
        mode: RobotMode,
    },
    /// It does not get ready.
    #[error("the robot is still {} after {waited_s:.0} s", .mode.name())]
    Slow {
        /// What it is.
        mode: RobotMode,
        /// For how long it was waited.
        waited_s: f64,
    },
}

/// Why an experiment is not made with this PolyScope; `None` for 5.9.4 and later ones of major version 5. UR's own ROS driver asks
/// for 5.9.4 as well; CB-Series robots (3.x) have no force sensor in the wrist; from 10 on (PolyScope X) there is no such dashboard,
/// and nobody has seen the versions between.
pub fn unsupported(v: &PolyscopeVersion) -> Option<String> {
    let why = match (v.major, v.minor, v.bugfix) {
        (5, 9, 4..) | (5, 10.., _) => return None,
        (5, ..) => "it is older than 5.9.4: update it",
        (0..=4, ..) => "a CB-Series robot has no force sensor in its wrist, an e-Series is needed",
        (10.., ..) => "PolyScope X has other interfaces, 5.9.4 or a later 5.x is needed",
        _ => "nobody has tried it, 5.9.4 or a later 5.x is needed",
    };
    Some(format!("PolyScope {}.{}.{}: {why}", v.major, v.minor, v.bugfix))
}

impl Devices {
    /// Makes the robot ready, as far as somebody allowed it.
    ///
    /// # Errors
    ///
    /// A robot in local control, in a stop or without power that `permit` does not end, or one that stays where it is.
    pub fn prepare(&mut self, permit: Permit) -> Result<(), PrepareError> {
        match self.ask(DashboardCommand::PolyscopeVersion)? {
            DashboardReply::Version(version) => {
                if let Some(why) = unsupported(&version) {
                    return Err(PrepareError::Version { why });
                }
            }
            found => return Err(PrepareError::Answer { asked: "PolyscopeVersion", found }),
        }
        match self.ask(DashboardCommand::IsInRemoteControl)? {
            DashboardReply::RemoteControl(false) => return Err(PrepareError::Local),
            DashboardReply::RemoteControl(true) => {}
            found => return Err(PrepareError::Answer { asked: "is in remote control", found }),
        }
        match self.safety()? {
            SafetyStatus::Normal | SafetyStatus::Reduced => {}
            SafetyStatus::ProtectiveStop if permit.unlock => {
                // A program that waits since the stop must not go on.
                self.ask(DashboardCommand::Stop)?;
                self.ask(DashboardCommand::CloseSafetyPopup)?;
                self.ask(DashboardCommand::UnlockProtectiveStop)?;
                let status = self.safety()?;
                if status != SafetyStatus::Normal {
                    return Err(PrepareError::Safety { status });
                }
            }
            SafetyStatus::ProtectiveStop => return Err(PrepareError::Protective),
            status => return Err(PrepareError::Safety { status }),
        }
        let mode = self.mode()?;
        if mode == RobotMode::Running {
            return Ok(());
        }
        if !permit.power_on {
            return Err(PrepareError::Power { mode });
        }
        self.ask(DashboardCommand::PowerOn)?;
        self.until(|mode| matches!(mode, RobotMode::Idle | RobotMode::Running))?;
        self.ask(DashboardCommand::BrakeRelease)?;
        self.until(|mode| mode == RobotMode::Running)
    }

    fn ask(&mut self, command: DashboardCommand) -> Result<DashboardReply, PrepareError> {
        Ok(self.dashboard.command(command, self.reply)?)
    }

    fn safety(&mut self) -> Result<SafetyStatus, PrepareError> {
        match self.ask(DashboardCommand::SafetyStatus)? {
            DashboardReply::SafetyStatus(status) => Ok(status),
            found => Err(PrepareError::Answer { asked: "safetystatus", found }),
        }
    }

    fn mode(&mut self) -> Result<RobotMode, PrepareError> {
        match self.ask(DashboardCommand::RobotMode)? {
            DashboardReply::RobotMode(mode) => Ok(mode),
            found => Err(PrepareError::Answer { asked: "robotmode", found }),
        }
    }

    fn until(&mut self, is: impl Fn(RobotMode) -> bool) -> Result<(), PrepareError> {
        let began = Instant::now();
        loop {
            let mode = self.mode()?;
            if is(mode) {
                return Ok(());
            }
            if began.elapsed() > POWER {
                return Err(PrepareError::Slow { mode, waited_s: began.elapsed().as_secs_f64() });
            }
            std::thread::sleep(ASK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_that_this_was_not_written_for_are_named_with_the_reason() {
        let of = |major, minor, bugfix| unsupported(&PolyscopeVersion { major, minor, bugfix, build: None });
        for (major, minor, bugfix) in [(5, 9, 4), (5, 9, 5), (5, 12, 0), (5, 25, 1)] {
            assert_eq!(of(major, minor, bugfix), None, "{major}.{minor}.{bugfix}");
        }
        for ((major, minor, bugfix), word) in [
            ((3, 15, 4), "CB-Series"),
            ((1, 8, 0), "CB-Series"),
            ((5, 3, 0), "older than 5.9.4"),
            ((5, 9, 3), "older than 5.9.4"),
            ((6, 0, 0), "nobody has tried it"),
            ((10, 5, 0), "PolyScope X"),
        ] {
            let why = of(major, minor, bugfix).unwrap();
            assert!(why.contains(word) && why.contains(&format!("{major}.{minor}.{bugfix}")), "{why}");
        }
    }
}
