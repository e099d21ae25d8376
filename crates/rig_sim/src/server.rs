//! The virtual rig on loopback: its ports, its clock.
//!
//! The primary and the secondary port take programs and send messages, and the robot's mode ten times per second of the
//! controller's clock. Of the other states that a controller sends there they have none. The real-time port takes programs and
//! sends nothing: its state packets are out of date beside RTDE, and no client of this rig reads them.

mod error;
mod ports;
mod socket;
#[cfg(test)]
mod tests;

pub use error::ServeError;
pub use socket::{RigStatus, ServeOptions, ServedRig};

use gripgen_rig::primary::{
    ErrorCodeMessage, KeyMessage, MessageHeader, PROGRAM_STARTED, PROGRAM_STOPPED, RobotModeData,
    SafetyModeMessage, VersionMessage, encode_error_code_message, encode_key_message, encode_robot_mode_data,
    encode_safety_mode_message, encode_version_message,
};
use gripgen_rig::robot_state::SafetyStatus;
use crate::controller::{Announcement, Controller};
use crate::robot::RuntimeState;
use crate::rtde::CONTROLLER_VERSION;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Where the devices of a rig are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RigAddresses {
    /// RTDE.
    pub rtde: SocketAddr,
    /// The dashboard.
    pub dashboard: SocketAddr,
    /// The primary interface.
    pub primary: SocketAddr,
    /// The secondary interface.
    pub secondary: SocketAddr,
    /// The real-time interface: it takes programs and sends nothing.
    pub real_time: SocketAddr,
    /// The gripper.
    pub gripper: SocketAddr,
    /// The camera behind the left gel.
    pub camera_left: SocketAddr,
    /// The camera behind the right gel.
    pub camera_right: SocketAddr,
}

impl RigAddresses {
    /// Loopback: the robot's ports are those of Universal Robots, gripper and cameras have ports that need no privilege.
    pub fn loopback() -> Self {
        let at = |port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
        Self {
            rtde: at(30004),
            dashboard: at(29999),
            primary: at(30001),
            secondary: at(30002),
            real_time: at(30003),
            gripper: at(31000),
            camera_left: at(38080),
            camera_right: at(38081),
        }
    }

    /// Loopback, on ports that the system chooses.
    pub fn any_ports() -> Self {
        let mut addresses = Self::loopback();
        for address in addresses.all_mut() {
            address.set_port(0);
        }
        addresses
    }

    /// Every address with what is there.
    pub fn all(&self) -> [(&'static str, SocketAddr); 8] {
        [
            ("rtde", self.rtde),
            ("dashboard", self.dashboard),
            ("primary", self.primary),
            ("secondary", self.secondary),
            ("real_time", self.real_time),
            ("gripper", self.gripper),
            ("camera_left", self.camera_left),
            ("camera_right", self.camera_right),
        ]
    }

    fn all_mut(&mut self) -> [&mut SocketAddr; 8] {
        [
            &mut self.rtde,
            &mut self.dashboard,
            &mut self.primary,
            &mut self.secondary,
            &mut self.real_time,
            &mut self.gripper,
            &mut self.camera_left,
            &mut self.camera_right,
        ]
    }
}

/// The first message of a primary or secondary connection.
fn version_message() -> Vec<u8> {
    let [major, minor, bugfix, build] = CONTROLLER_VERSION;
    let version = VersionMessage {
        project: "URControl".into(),
        major: major as u8,
        minor: minor as u8,
        bugfix: bugfix as i32,
        build: build as i32,
        date: "22-03-2022, 00:00:00".into(),
    };
    encode_version_message(MessageHeader { device_ticks: u64::MAX, source: -2 }, &version)
}

/// The controller's clock, as the primary interface has it here.
fn device_ticks(time_s: f64) -> u64 {
    (time_s * 1e6) as u64
}

/// The robot's mode as a packet of the primary interface.
fn robot_mode_packet(controller: &Controller) -> Vec<u8> {
    use SafetyStatus::{ProtectiveStop, RobotEmergencyStop, SystemEmergencyStop};
    let robot = controller.robot();
    encode_robot_mode_data(&RobotModeData {
        device_ticks: device_ticks(robot.timestamp_s),
        // The controller believes that its arm is real, as on a rig.
        real_robot_connected: true,
        real_robot_enabled: true,
        power_on: robot.status_bits() & 1 == 1,
        emergency_stopped: matches!(robot.safety, RobotEmergencyStop | SystemEmergencyStop),
        protective_stopped: robot.safety == ProtectiveStop,
        program_running: robot.runtime == RuntimeState::Playing,
        program_paused: robot.runtime == RuntimeState::Paused,
        mode_number: robot.mode.number() as i8,
        // 2 is force, 0 position.
        control_mode: if controller.arm().applies_force() { 2 } else { 0 },
        target_speed_fraction: 1.0,
        speed_scaling: 1.0,
        target_speed_fraction_limit: 1.0,
    })
}

/// An announcement as a message of the primary interface.
fn announcement_message(announcement: &Announcement, time_s: f64) -> Vec<u8> {
    let header = MessageHeader { device_ticks: device_ticks(time_s), source: -2 };
    let key = |title: &str, text: &str| {
        let key = KeyMessage { code: 0, argument: 0, title: title.into(), text: text.into() };
        encode_key_message(header, &key)
    };
    match announcement {
        Announcement::Started { title } => key(PROGRAM_STARTED, title),
        Announcement::Stopped { title, why } if why.is_empty() => key(PROGRAM_STOPPED, title),
        Announcement::Stopped { title, why } => key(PROGRAM_STOPPED, &format!("{title}: {why}")),
        Announcement::Said { text } => key("", text),
        Announcement::CannotRun { problem } => {
            // C207: a problem with a client, as the controller reports a fieldbus that is gone.
            let error = ErrorCodeMessage {
                code: 207,
                level: 3,
                text: problem.clone(),
                ..ErrorCodeMessage::default()
            };
            encode_error_code_message(header, &error)
        }
        Announcement::Safety(safety) => {
            let message = SafetyModeMessage { mode: safety.number() as u8, ..SafetyModeMessage::default() };
            encode_safety_mode_message(header, &message)
        }
    }
}
