//! Commands, and what their answers say.

use crate::robot_state::{RobotMode, SafetyStatus};

/// A command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DashboardCommand {
    /// Which [`RobotMode`] the robot is in.
    RobotMode,
    /// What the safety system does: [`SafetyStatus`].
    SafetyStatus,
    /// Power for the arm; it ends in [`RobotMode::Idle`], which is asked for.
    PowerOn,
    /// Brakes off; it ends in [`RobotMode::Running`], which is asked for.
    BrakeRelease,
    /// Leave a protective stop; refused in its first 5 s.
    UnlockProtectiveStop,
    /// Close the message of the safety system.
    CloseSafetyPopup,
    /// Stop the program.
    Stop,
    /// Whether the controller takes commands from outside.
    IsInRemoteControl,
    /// Version of the software.
    PolyscopeVersion,
    /// Serial number of the robot.
    SerialNumber,
}

/// Version of the robot's software, as in `URSoftware 5.12.0.1101319 (Mar 22 2022)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolyscopeVersion {
    /// 5 for e-Series, 3 for CB3.
    pub major: u32,
    /// The second number.
    pub minor: u32,
    /// The third.
    pub bugfix: u32,
    /// The fourth, where there is one.
    pub build: Option<u32>,
}

/// What an answer says.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum DashboardReply {
    /// The command was taken.
    Done,
    /// The mode of the robot.
    RobotMode(RobotMode),
    /// What the safety system does.
    SafetyStatus(SafetyStatus),
    /// Whether the controller takes commands from outside.
    RemoteControl(bool),
    /// Version of the software.
    Version(PolyscopeVersion),
    /// Serial number of the robot.
    SerialNumber(String),
}

/// An answer that is not the one that the command has: most often the controller's refusal, in its own words.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the controller answers `{line}` to `{command}`, which is answered by `{wanted}`")]
pub struct DashboardReplyError {
    /// What was asked.
    pub command: &'static str,
    /// What an answer looks like.
    pub wanted: &'static str,
    /// What came.
    pub line: String,
}

impl DashboardCommand {
    /// All commands.
    pub const ALL: [Self; 10] = [
        Self::RobotMode,
        Self::SafetyStatus,
        Self::PowerOn,
        Self::BrakeRelease,
        Self::UnlockProtectiveStop,
        Self::CloseSafetyPopup,
        Self::Stop,
        Self::IsInRemoteControl,
        Self::PolyscopeVersion,
        Self::SerialNumber,
    ];

    /// The line on the wire, without its end.
    pub fn line(self) -> &'static str {
        self.words().0
    }

    /// The line, and what its answer is or begins with.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::RobotMode => ("robotmode", "Robotmode: "),
            Self::SafetyStatus => ("safetystatus", "Safetystatus: "),
            Self::PowerOn => ("power on", "Powering on"),
            Self::BrakeRelease => ("brake release", "Brake releasing"),
            Self::UnlockProtectiveStop => ("unlock protective stop", "Protective stop releasing"),
            Self::CloseSafetyPopup => ("close safety popup", "closing safety popup"),
            Self::Stop => ("stop", "Stopped"),
            Self::IsInRemoteControl => ("is in remote control", "true or false"),
            Self::PolyscopeVersion => ("PolyscopeVersion", "URSoftware "),
            Self::SerialNumber => ("get serial number", "digits"),
        }
    }

    /// Reads the answer to this command.
    ///
    /// # Errors
    ///
    /// A line that is no answer to this command.
    pub fn reply(self, line: &str) -> Result<DashboardReply, DashboardReplyError> {
        let (command, wanted) = self.words();
        let line = line.trim();
        let read = match self {
            Self::IsInRemoteControl => line.parse().ok().map(DashboardReply::RemoteControl),
            Self::SerialNumber => {
                let digits = !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit());
                digits.then(|| DashboardReply::SerialNumber(line.into()))
            }
            _ => line.strip_prefix(wanted).and_then(|rest| match self {
                Self::RobotMode => RobotMode::from_word(rest).map(DashboardReply::RobotMode),
                Self::SafetyStatus => SafetyStatus::from_word(rest).map(DashboardReply::SafetyStatus),
                Self::PolyscopeVersion => version_of(rest).map(DashboardReply::Version),
                _ => Some(DashboardReply::Done),
            }),
        };
        read.ok_or_else(|| DashboardReplyError { command, wanted, line: line.into() })
    }
}

fn version_of(rest: &str) -> Option<PolyscopeVersion> {
    let mut numbers = rest.split_whitespace().next()?.split('.').map(str::parse);
    let mut next = || numbers.next().and_then(Result::ok);
    Some(PolyscopeVersion { major: next()?, minor: next()?, bugfix: next()?, build: next() })
}
