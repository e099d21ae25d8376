//! `rig.toml`: where the devices are, what they may do, where the parts are.

use crate::camera::CameraView;
use crate::gcl::GclLimits;
use crate::program::{PullProgram, TcpPose};
use gripgen_twin::PerJaw;
use gripgen_twin::config::{ConfigError, Document};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Duration;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigConfig {
    /// The robot.
    pub robot: RobotSection,
    /// The gripper.
    pub gripper: GripperSection,
    /// The cameras.
    pub cameras: PerJawSection,
    /// What may be done.
    #[serde(default)]
    pub limits: LimitsSection,
    /// Between grips.
    #[serde(default)]
    pub motion: MotionSection,
    /// When images are taken.
    #[serde(default)]
    pub images: ImagesSection,
    /// Where each part is gripped.
    #[serde(default)]
    pub poses: BTreeMap<String, TaughtPose>,
}

/// `[robot]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotSection {
    /// Name or number of the controller.
    pub address: String,
    /// RTDE.
    #[serde(default = "rtde_port")]
    pub rtde_port: u16,
    /// The dashboard.
    #[serde(default = "dashboard_port")]
    pub dashboard_port: u16,
    /// The primary interface.
    #[serde(default = "primary_port")]
    pub primary_port: u16,
    /// Weight at the flange.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange.
    pub centre_of_gravity_mm: [f64; 3],
    /// Grip centre at the flange.
    pub tool_mm: [f64; 3],
    /// What `actual_TCP_force` along +z says to an arm that pulls up: -1 where it is the load on the tool. `rig check` finds it.
    #[serde(default = "load_on_tool")]
    pub force_sign: f64,
    /// True force over the reading.
    #[serde(default = "one")]
    pub force_gain: f64,
}

/// `[gripper]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GripperSection {
    /// Name or number of the gripper.
    pub address: String,
    /// Its text interface.
    #[serde(default = "gripper_port")]
    pub port: u16,
    /// How far the jaws open after a pull.
    #[serde(default = "open_mm")]
    pub open_mm: f64,
    /// Width that the jaws are opened to before the first pull; wider than the widest part.
    #[serde(default = "start_mm")]
    pub start_mm: f64,
    /// Jaws that are closer than this have closed on each other.
    #[serde(default = "one")]
    pub empty_below_mm: f64,
    /// Smallest and largest grip force of one jaw. The device may allow less than its data sheet.
    #[serde(default = "force_range")]
    pub force_per_jaw_n: [f64; 2],
}

/// `[cameras]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerJawSection {
    /// Behind the left gel.
    pub left: CameraSection,
    /// Behind the right gel.
    pub right: CameraSection,
}

/// `[cameras.left]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSection {
    /// Name or number of the camera.
    pub address: String,
    /// Its stream.
    #[serde(default = "camera_port")]
    pub port: u16,
    /// Turned clockwise: the R1.5 sends portrait frames.
    #[serde(default = "quarter")]
    pub rotate_deg: u32,
    /// Left and right changed.
    #[serde(default)]
    pub mirror: bool,
    /// First column, first row, columns and rows of the turned frame; all of it where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop_px: Option<[u32; 4]>,
    /// Columns and rows of the image.
    #[serde(default = "landscape")]
    pub size_px: [u32; 2],
}

/// `[limits]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsSection {
    /// Lowest corner of the box in the base that the grip centre stays in.
    pub workspace_low_mm: [f64; 3],
    /// Highest corner.
    pub workspace_high_mm: [f64; 3],
    /// Largest command of a pull.
    pub pull_force_n: f64,
    /// Measured force at which a pull is broken off.
    pub abort_force_n: f64,
    /// Measured torque at which it is broken off.
    pub abort_torque_nm: f64,
    /// Largest force along the pull before its first step.
    pub preload_n: f64,
    /// Measured force at which a motion is broken off.
    pub motion_force_n: f64,
    /// Largest speed along the pull.
    pub pull_speed_mm_s: f64,
    /// How far the tool may move aside in a pull.
    pub lateral_mm: f64,
    /// Longest pull.
    pub pull_time_s: f64,
    /// Silence of the robot on this machine that ends a pull.
    pub robot_silence_s: f64,
    /// Gap in the robot's own clock that spoils a pull.
    pub robot_gap_s: f64,
    /// How many times longer everything may take that this machine times. More than 1 only with a virtual rig on this machine.
    pub patience: f64,
}

/// `[motion]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotionSection {
    /// Height above a grip from which it is approached.
    pub approach_mm: f64,
    /// Speed far from parts.
    pub speed_mm_s: f64,
    /// Speed of the last way down and the first way up.
    pub approach_speed_mm_s: f64,
}

/// `[images]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImagesSection {
    /// Rest after gripping, before the image is taken.
    pub settle_s: f64,
    /// How long a new frame may take.
    pub frame_s: f64,
    /// Frames a second at most of the film of a pull, from the grip to the stop; 0 films nothing.
    pub film_hz: f64,
    /// JPEG at most that a film takes; a longer one loses every other frame and goes on at half the rate.
    pub film_mib: f64,
}

/// `[poses.NAME]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaughtPose {
    /// Position in metres and rotation vector in radians, as the robot shows them: the grip centre in the middle of the part,
    /// tool x along its long axis, tool y along the jaws.
    pub base_from_tool: [f64; 6],
    /// When it was taught.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub taught: String,
}

impl Default for LimitsSection {
    /// A box in front of a UR5e, and what its sensor can measure.
    fn default() -> Self {
        let pull = PullProgram::default();
        Self {
            workspace_low_mm: [200.0, -500.0, 20.0],
            workspace_high_mm: [700.0, 500.0, 600.0],
            pull_force_n: pull.max_force_n,
            abort_force_n: pull.abort_force_n,
            abort_torque_nm: pull.abort_torque_nm,
            preload_n: 10.0,
            motion_force_n: 20.0,
            pull_speed_mm_s: pull.speed_mm_s,
            lateral_mm: pull.lateral_mm,
            pull_time_s: 60.0,
            robot_silence_s: 0.25,
            robot_gap_s: 0.02,
            patience: 1.0,
        }
    }
}

impl Default for MotionSection {
    fn default() -> Self {
        Self { approach_mm: 80.0, speed_mm_s: 250.0, approach_speed_mm_s: 100.0 }
    }
}

impl Default for ImagesSection {
    fn default() -> Self {
        Self { settle_s: 0.3, frame_s: 0.5, film_hz: 10.0, film_mib: 64.0 }
    }
}

fn rtde_port() -> u16 {
    30004
}
fn dashboard_port() -> u16 {
    29999
}
fn primary_port() -> u16 {
    30001
}
fn gripper_port() -> u16 {
    1000
}
fn camera_port() -> u16 {
    8080
}
fn load_on_tool() -> f64 {
    -1.0
}
fn one() -> f64 {
    1.0
}
fn open_mm() -> f64 {
    10.0
}
fn start_mm() -> f64 {
    100.0
}
fn force_range() -> [f64; 2] {
    let (least, most) = crate::gcl::SHIPPED_LIMITS.force_sum_n;
    [0.5 * least, 0.5 * most]
}
fn quarter() -> u32 {
    90
}
fn landscape() -> [u32; 2] {
    [320, 240]
}

/// JSON Schema of `rig.toml`.
pub fn rig_schema() -> serde_json::Value {
    schemars::schema_for!(RigConfig).to_value()
}

impl RigConfig {
    /// Reads and checks a file.
    ///
    /// # Errors
    ///
    /// An unknown or missing key, or a value out of its range.
    pub fn read(document: &Document) -> Result<Self, ConfigError> {
        let config: Self = document.read()?;
        config.check().map_err(|e| document.located(e))?;
        Ok(config)
    }

    fn check(&self) -> Result<(), ConfigError> {
        let (limits, motion, images) = (&self.limits, &self.motion, &self.images);
        let numbers = [
            ("robot.payload_kg", self.robot.payload_kg, 0.0, 5.0, "kg"),
            ("robot.force_gain", self.robot.force_gain, 0.1, 10.0, ""),
            ("gripper.open_mm", self.gripper.open_mm, 1.0, 100.0, "mm"),
            ("gripper.start_mm", self.gripper.start_mm, 1.0, 110.0, "mm"),
            ("gripper.empty_below_mm", self.gripper.empty_below_mm, 0.0, 50.0, "mm"),
            ("gripper.force_per_jaw_n[0]", self.gripper.force_per_jaw_n[0], 0.5, 40.0, "N"),
            ("gripper.force_per_jaw_n[1]", self.gripper.force_per_jaw_n[1], 0.5, 40.0, "N"),
            ("limits.pull_force_n", limits.pull_force_n, 1.0, 45.0, "N"),
            ("limits.abort_force_n", limits.abort_force_n, limits.pull_force_n, 50.0, "N"),
            ("limits.abort_torque_nm", limits.abort_torque_nm, 0.5, 10.0, "Nm"),
            ("limits.preload_n", limits.preload_n, 0.5, 50.0, "N"),
            ("limits.motion_force_n", limits.motion_force_n, 1.0, 50.0, "N"),
            ("limits.pull_speed_mm_s", limits.pull_speed_mm_s, 1.0, 50.0, "mm/s"),
            ("limits.lateral_mm", limits.lateral_mm, 0.5, 10.0, "mm"),
            ("limits.pull_time_s", limits.pull_time_s, 1.0, 300.0, "s"),
            ("limits.robot_silence_s", limits.robot_silence_s, 0.02, 1.0, "s"),
            ("limits.robot_gap_s", limits.robot_gap_s, 0.002, 1.0, "s"),
            ("limits.patience", limits.patience, 1.0, 100.0, "times"),
            ("motion.approach_mm", motion.approach_mm, 10.0, 300.0, "mm"),
            ("motion.speed_mm_s", motion.speed_mm_s, 1.0, 500.0, "mm/s"),
            ("motion.approach_speed_mm_s", motion.approach_speed_mm_s, 1.0, 250.0, "mm/s"),
            ("images.settle_s", images.settle_s, 0.0, 60.0, "s"),
            ("images.frame_s", images.frame_s, 0.02, 10.0, "s"),
            ("images.film_hz", images.film_hz, 0.0, 60.0, "Hz"),
            ("images.film_mib", images.film_mib, 1.0, 1024.0, "MiB"),
        ];
        for (key, value, least, most, unit) in numbers {
            if !(value >= least && value <= most) {
                let problem =
                    format!("{value} {unit} is out of range, it must be from {least} to {most} {unit}");
                return Err(ConfigError::new(key, problem));
            }
        }
        if limits.patience > 1.0 && !self.is_on_this_machine() {
            let problem = format!(
                "{} is for a virtual rig, `{}` is not this machine",
                limits.patience, self.robot.address
            );
            return Err(
                ConfigError::new("limits.patience", problem).hint("a real robot is never waited for longer")
            );
        }
        if self.robot.force_sign.abs() != 1.0 {
            let problem = format!("{} is neither 1 nor -1", self.robot.force_sign);
            return Err(ConfigError::new("robot.force_sign", problem)
                .hint("`gripgen rig check --mass-kg 1.0` finds it with a known mass"));
        }
        for axis in 0..3 {
            let (low, high) = (limits.workspace_low_mm[axis], limits.workspace_high_mm[axis]);
            if !(low < high && low > -1500.0 && high < 1500.0) {
                let problem = format!("axis {axis} goes from {low} to {high} mm, inside -1500 to 1500 mm");
                return Err(ConfigError::new("limits.workspace_low_mm", problem));
            }
        }
        Ok(())
    }

    /// Whether the robot is a virtual one: nothing else speaks on this machine.
    pub(super) fn is_on_this_machine(&self) -> bool {
        let host = self.robot.address.as_str();
        host == "localhost" || host.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
    }

    /// What the gripper is allowed, in its own convention: sums over both jaws.
    pub fn gripper_limits(&self) -> GclLimits {
        let [least, most] = self.gripper.force_per_jaw_n;
        GclLimits { force_sum_n: (2.0 * least, 2.0 * most), ..crate::gcl::SHIPPED_LIMITS }
    }

    /// A limit that this machine times, as patience stretches it.
    pub(super) fn patient(&self, limit: Duration) -> Duration {
        limit.mul_f64(self.limits.patience)
    }

    /// How the frames of both cameras are looked at.
    pub fn views(&self) -> PerJaw<CameraView> {
        let view = |c: &CameraSection| CameraView {
            rotate_deg: c.rotate_deg,
            mirror: c.mirror,
            crop_px: c.crop_px,
            size_px: c.size_px,
        };
        PerJaw { left: view(&self.cameras.left), right: view(&self.cameras.right) }
    }
}

impl TaughtPose {
    /// Where the tool is.
    pub fn tcp(&self) -> TcpPose {
        TcpPose::from_numbers(self.base_from_tool)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_virtual_rig_is_waited_for_longer() {
        let shipped = include_str!("../../../../assets/configs/rig.toml");
        let read = |sets: &[(&str, &str)]| {
            let mut document = Document::parse("rig.toml", shipped)?;
            sets.iter().try_for_each(|(key, value)| document.set(key, value))?;
            RigConfig::read(&document)
        };
        let patient = read(&[("limits.patience", "20.0")]).unwrap();
        assert_eq!(patient.patient(Duration::from_secs(3)), Duration::from_secs(60));
        assert!(read(&[("robot.address", "192.168.1.2")]).is_ok());
        let e = read(&[("limits.patience", "20.0"), ("robot.address", "192.168.1.2")]).unwrap_err();
        assert!(e.problem.contains("`192.168.1.2` is not this machine"), "{}", e.problem);
        assert!(read(&[("limits.patience", "0.5")]).is_err());
    }
}
