//! The virtual rig on loopback: its ports, its clock.
//!
//! The primary and the secondary port take programs and send messages, and the robot's mode ten times per second of the
//! controller's clock. Of the other states that a controller sends there they have none. The real-time port takes programs and
//! sends nothing: its state packets are out of date beside RTDE, and no client of this rig reads them.

mod error;
mod messages;
mod ports;
mod socket;
#[cfg(test)]
mod tests;

pub use error::ServeError;
pub use socket::{RigStatus, ServeOptions, ServedRig};

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
