//! The virtual rig on loopback, against the crate's own clients and against sockets that misbehave.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

#[path = "server/check_tests.rs"]
mod check_tests;
#[path = "server/clock_tests.rs"]
mod clock_tests;
#[path = "server/device_tests.rs"]
mod device_tests;
#[path = "server/end_tests.rs"]
mod end_tests;
#[path = "server/fault_tests.rs"]
mod fault_tests;

use gripgen_rig::camera::CameraView;
use gripgen_rig::program::TcpPose;
use gripgen_rig_sim::server::{RigAddresses, ServeOptions, ServedRig};
use gripgen_rig_sim::spring::Spring;
use std::sync::Arc;
use std::time::Duration;

/// More than enough for anything on loopback.
const TIMEOUT: Duration = Duration::from_secs(60);

fn options(clock_rate: f64) -> ServeOptions {
    ServeOptions {
        addresses: RigAddresses::any_ports(),
        clock_rate,
        in_step: false,
        tcp: TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] },
        view: CameraView { rotate_deg: 90, mirror: false, crop_px: None, size_px: [16, 8] },
    }
}

/// A rig around a spring, on ports of its own.
fn serve(clock_rate: f64) -> ServedRig {
    ServedRig::start(Arc::new(Spring::default()), &options(clock_rate)).unwrap()
}
