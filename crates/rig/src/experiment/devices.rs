//! All devices of a rig, connected.

use super::config::RigConfig;
use super::robot::{Heart, session_plan, unfit};
use crate::camera::{CameraClient, CameraLinkError};
use crate::dashboard::{DashboardClient, DashboardLinkError};
use crate::gcl::{GclClient, GclLinkError};
use crate::primary::{PrimaryClient, PrimaryLinkError};
use crate::rtde::{LinkError, RtdeClient, SessionPlan};
use gripgen_twin::PerJaw;
use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::mpsc;
use std::time::Duration;

/// How long a device may take to answer at first.
const TIMEOUT: Duration = Duration::from_secs(3);
/// How long the dashboard may take for an answer.
const REPLY: Duration = Duration::from_secs(2);

/// Why a rig is not there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectError {
    /// A name that nobody knows.
    #[error("{what}: `{host}` is not found: {problem}")]
    Name {
        /// Which device.
        what: &'static str,
        /// Its name.
        host: String,
        /// What the system says.
        problem: String,
    },
    /// The robot's data.
    #[error("RTDE: {0}")]
    Rtde(#[from] LinkError),
    /// Its data are of other types than those of the guide.
    #[error("RTDE: {0}")]
    Types(String),
    /// Its dashboard.
    #[error("dashboard: {0}")]
    Dashboard(#[from] DashboardLinkError),
    /// Its primary interface.
    #[error("primary interface: {0}")]
    Primary(#[from] PrimaryLinkError),
    /// The gripper.
    #[error("gripper: {0}")]
    Gripper(#[from] GclLinkError),
    /// A camera.
    #[error("camera: {0}")]
    Camera(#[from] CameraLinkError),
    /// Both jaws would show one picture.
    #[error("cameras.left and cameras.right are one camera: both are {at}")]
    OneCamera {
        /// Where it is.
        at: SocketAddr,
    },
}

/// The devices of a rig. Dropping them ends the heartbeat, and with it whatever the robot does.
pub struct Devices {
    pub(super) heart: Heart,
    pub(super) robot: RtdeClient,
    pub(super) dashboard: DashboardClient,
    pub(super) primary: PrimaryClient,
    /// `None` once it was said goodbye.
    pub(super) gripper: Option<GclClient>,
    pub(super) cameras: PerJaw<CameraClient>,
    /// How long the dashboard may take for an answer.
    pub(super) reply: Duration,
}

/// Where a device is. The system's look-up of a name has no time limit, so it runs in a thread that is left behind when time is over.
fn resolve(what: &'static str, host: &str, port: u16) -> Result<SocketAddr, ConnectError> {
    resolve_within(what, host, TIMEOUT, {
        let host = host.to_string();
        move || Ok((host.as_str(), port).to_socket_addrs()?.collect())
    })
}

fn resolve_within(
    what: &'static str,
    host: &str,
    within: Duration,
    look_up: impl FnOnce() -> std::io::Result<Vec<SocketAddr>> + Send + 'static,
) -> Result<SocketAddr, ConnectError> {
    let name = |problem: String| ConnectError::Name { what, host: host.into(), problem };
    let (found, answer) = mpsc::channel();
    std::thread::spawn(move || found.send(look_up()));
    let late = |_| name(format!("the name server did not answer within {:.1} s", within.as_secs_f64()));
    let mut all = answer.recv_timeout(within).map_err(late)?.map_err(|e| name(e.to_string()))?;
    // Controllers and grippers speak IPv4.
    all.sort_by_key(SocketAddr::is_ipv6);
    all.first().copied().ok_or_else(|| name("no address".into()))
}

/// Connects a camera.
pub(super) fn connect_camera(config: &RigConfig, left: bool) -> Result<CameraClient, ConnectError> {
    let cameras = [&config.cameras.left, &config.cameras.right];
    let [camera, other] = if left { cameras } else { [cameras[1], cameras[0]] };
    let at = resolve("camera", &camera.address, camera.port)?;
    if resolve("camera", &other.address, other.port).is_ok_and(|other| other == at) {
        return Err(ConnectError::OneCamera { at });
    }
    Ok(CameraClient::connect(at, &camera.address, config.patient(TIMEOUT))?)
}

/// Connects the gripper.
pub(super) fn connect_gripper(config: &RigConfig) -> Result<GclClient, ConnectError> {
    let at = resolve("gripper", &config.gripper.address, config.gripper.port)?;
    Ok(GclClient::connect(at, config.gripper_limits(), config.patient(TIMEOUT))?)
}

/// Connects the dashboard.
pub(super) fn connect_dashboard(config: &RigConfig) -> Result<DashboardClient, ConnectError> {
    let at = resolve("dashboard", &config.robot.address, config.robot.dashboard_port)?;
    Ok(DashboardClient::connect(at, config.patient(TIMEOUT))?)
}

/// Connects RTDE.
pub(super) fn connect_robot(config: &RigConfig) -> Result<RtdeClient, ConnectError> {
    connect_rtde(config, &session_plan(), config.patient(TIMEOUT))
}

/// Connects RTDE to listen: no input is asked for, nothing can be written.
pub(super) fn connect_listener(config: &RigConfig, timeout: Duration) -> Result<RtdeClient, ConnectError> {
    let plan = SessionPlan { inputs: vec![], ..session_plan() };
    connect_rtde(config, &plan, timeout)
}

fn connect_rtde(
    config: &RigConfig,
    plan: &SessionPlan,
    timeout: Duration,
) -> Result<RtdeClient, ConnectError> {
    let at = resolve("RTDE", &config.robot.address, config.robot.rtde_port)?;
    let robot = RtdeClient::connect(at, plan, timeout)?;
    match unfit(robot.recipe()) {
        Some(types) => Err(ConnectError::Types(types)),
        None => Ok(robot),
    }
}

/// Connects RTDE to listen to these fields.
pub(super) fn connect_for(
    config: &RigConfig,
    fields: &[&str],
    timeout: Duration,
) -> Result<RtdeClient, ConnectError> {
    let at = resolve("RTDE", &config.robot.address, config.robot.rtde_port)?;
    let outputs = fields.iter().map(ToString::to_string).collect();
    let plan = SessionPlan { outputs, inputs: vec![], ..session_plan() };
    Ok(RtdeClient::connect(at, &plan, timeout)?)
}

/// Connects the primary interface.
pub(super) fn connect_primary(config: &RigConfig) -> Result<PrimaryClient, ConnectError> {
    let at = resolve("primary interface", &config.robot.address, config.robot.primary_port)?;
    Ok(PrimaryClient::connect(at, config.patient(TIMEOUT))?)
}

impl Devices {
    /// Connects everything. Nothing moves.
    ///
    /// # Errors
    ///
    /// The first device that does not answer as it should.
    pub fn connect(config: &RigConfig) -> Result<Self, ConnectError> {
        let robot = connect_robot(config)?;
        let heart = Heart::start(&robot, config.limits.patience > 1.0);
        Ok(Self {
            heart,
            robot,
            dashboard: connect_dashboard(config)?,
            primary: connect_primary(config)?,
            cameras: PerJaw { left: connect_camera(config, true)?, right: connect_camera(config, false)? },
            // The last one: it takes a connection that is cut for an emergency.
            gripper: Some(connect_gripper(config)?),
            reply: config.patient(REPLY),
        })
    }

    /// Says goodbye to the gripper, which takes a cut connection for an emergency, and lets the rest go.
    pub fn close(mut self) {
        if let Some(gripper) = self.gripper.take() {
            // A gripper that does not answer any more is left as it is.
            let _ = gripper.close();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_server_that_is_silent_is_given_up() {
        let (keep, never) = mpsc::channel::<()>();
        let silent = move || {
            let _ = never.recv();
            Ok(vec![])
        };
        let error = resolve_within("gripper", "wsg.lab", Duration::from_millis(20), silent).unwrap_err();
        let said = "gripper: `wsg.lab` is not found: the name server did not answer within 0.0 s";
        assert_eq!(error.to_string(), said);
        drop(keep);
    }

    #[test]
    fn of_two_addresses_the_one_of_ipv4_is_taken() {
        let both = || Ok(vec!["[::1]:1".parse().unwrap(), "127.0.0.1:1".parse().unwrap()]);
        let found = resolve_within("camera", "cam", TIMEOUT, both).unwrap();
        assert_eq!(found, "127.0.0.1:1".parse().unwrap());
        let none = resolve_within("camera", "cam", TIMEOUT, || Ok(vec![])).unwrap_err();
        assert!(none.to_string().ends_with("no address"), "{none}");
    }
}
