//! The joints of the virtual arm: they follow the tool, or the tool follows them.

use super::super::kinematics::{self, Joints, MAX_SPEED_RAD_S};
use super::{Arm, ArmError, Drive, STEP_S};
use gripgen_rig::program::TcpPose;
use gripgen_twin::frames::Pose;
use nalgebra::Translation3;

/// Joints of a UR5e with the tool down in front of it: at the start, the way to reach a pose that is nearest to these.
const READY_RAD: Joints = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0];
/// How joints brake by themselves.
pub(super) const BRAKE_RAD_S2: f64 = 15.0;

/// Where the flange is with the tool at a pose.
fn base_from_flange(tcp: &TcpPose, tool_m: [f64; 3]) -> Pose {
    tcp.base_from_tool() * Translation3::from(tool_m).inverse()
}

/// Joints that reach a pose; where there are none, some.
pub(super) fn at_start(tcp: &TcpPose, tool_m: [f64; 3]) -> Joints {
    kinematics::nearest(&base_from_flange(tcp, tool_m), &READY_RAD).unwrap_or(READY_RAD)
}

impl Arm {
    /// Its joints.
    pub fn joints_rad(&self) -> Joints {
        self.joints_rad
    }

    /// How fast they turn.
    pub fn joint_speeds_rad_s(&self) -> Joints {
        self.joint_speeds_rad_s
    }

    /// Lets it reach any pose, however fast its joints would have to be.
    pub fn reach_anything(&mut self) {
        self.has_limits = false;
    }

    /// Where its flange is.
    pub fn base_from_flange(&self) -> Pose {
        base_from_flange(&self.tcp, self.tool_m)
    }

    /// Another grip centre at the flange: the joints stay, and what is called the tool's pose is another.
    pub fn set_tool(&mut self, tool_m: [f64; 3]) {
        if tool_m != self.tool_m {
            let base_from_flange = self.base_from_flange();
            self.tool_m = tool_m;
            self.set_tcp(&base_from_flange);
        }
    }

    /// Begins to turn its joints to others. Numbers that are none are a stop.
    ///
    /// # Errors
    ///
    /// In force mode, and for joints beyond their limits.
    pub fn move_joints(
        &mut self,
        target_rad: Joints,
        acceleration_rad_s2: f64,
        speed_rad_s: f64,
    ) -> Result<(), String> {
        if self.force.is_some() {
            return Err("a motion in force mode is not simulated".into());
        }
        let beyond = target_rad.iter().position(|rad| rad.abs() > kinematics::MAX_ANGLE_RAD);
        if let Some(i) = beyond {
            let (rad, most) = (target_rad[i], kinematics::MAX_ANGLE_RAD);
            return Err(format!("joint {} at {rad:.2} rad, {most:.2} rad are the most", i + 1));
        }
        let finite = target_rad.iter().chain(&[acceleration_rad_s2, speed_rad_s]).all(|x| x.is_finite());
        self.drive = match finite {
            true => Drive::Joints {
                target_rad,
                speed_rad_s: speed_rad_s.min(MAX_SPEED_RAD_S),
                acceleration_rad_s2,
            },
            false => Drive::StopJoints { deceleration_rad_s2: BRAKE_RAD_S2 },
        };
        Ok(())
    }

    /// Brakes its joints, whatever moves it. Force mode goes on.
    pub fn brake_joints(&mut self, deceleration_rad_s2: f64) {
        self.drive = Drive::StopJoints { deceleration_rad_s2 };
    }

    /// A step towards other joints, all of which arrive together.
    pub(super) fn turn(&mut self, target_rad: &Joints, speed_rad_s: f64, acceleration_rad_s2: f64) {
        let left_rad = largest(&difference(target_rad, &self.joints_rad));
        // As fast as it has become, and as it can still brake from.
        let faster = largest(&self.joint_speeds_rad_s) + acceleration_rad_s2 * STEP_S;
        let brakes = (2.0 * acceleration_rad_s2 * left_rad).sqrt().max(0.5 * acceleration_rad_s2 * STEP_S);
        let step_rad = speed_rad_s.min(faster).min(brakes) * STEP_S;
        if left_rad <= step_rad {
            (self.joint_speeds_rad_s, self.drive) = ([0.0; 6], Drive::Hold);
            self.carry_to(*target_rad);
        } else {
            let share = step_rad / left_rad;
            self.joint_speeds_rad_s =
                difference(target_rad, &self.joints_rad).map(|rad| share * rad / STEP_S);
            self.carry_to(added(&self.joints_rad, &self.joint_speeds_rad_s));
        }
    }

    pub(super) fn slow_joints(&mut self, deceleration_rad_s2: f64) {
        let fastest = largest(&self.joint_speeds_rad_s);
        let slower = (fastest - deceleration_rad_s2 * STEP_S).max(0.0);
        let factor = if fastest > 0.0 { slower / fastest } else { 0.0 };
        self.joint_speeds_rad_s = self.joint_speeds_rad_s.map(|rad_s| factor * rad_s);
        if slower == 0.0 {
            self.drive = Drive::Hold;
        } else {
            self.carry_to(added(&self.joints_rad, &self.joint_speeds_rad_s));
        }
    }

    /// The joints follow where the tool went by itself. It stays where it was if they cannot.
    pub(super) fn take_joints_along(&mut self) -> Result<(), ArmError> {
        if self.tcp == self.carried {
            if !matches!(self.drive, Drive::Joints { .. } | Drive::StopJoints { .. }) {
                self.joint_speeds_rad_s = [0.0; 6];
            }
            return Ok(());
        }
        let joints_rad = match kinematics::nearest(&self.base_from_flange(), &self.joints_rad) {
            Ok(joints_rad) => joints_rad,
            Err(_) if !self.has_limits => {
                self.carried = self.tcp;
                return Ok(());
            }
            Err(e) => {
                (self.tcp, self.drive, self.force) = (self.carried, Drive::Hold, None);
                (self.joint_speeds_rad_s, self.velocity_m_s) = ([0.0; 6], [0.0; 3]);
                return Err(e.into());
            }
        };
        self.joint_speeds_rad_s = difference(&joints_rad, &self.joints_rad).map(|rad| rad / STEP_S);
        (self.joints_rad, self.carried) = (joints_rad, self.tcp);
        let speeds = self.joint_speeds_rad_s.map(f64::abs);
        // What a hand or a part that lets go does to the arm, and how it brakes, is no motion that was asked for.
        match (self.drive, speeds.iter().position(|rad_s| *rad_s > MAX_SPEED_RAD_S)) {
            (Drive::Line { .. }, Some(i)) if self.has_limits => {
                Err(ArmError::TooFast { joint: i + 1, speed_rad_s: speeds[i] })
            }
            _ => Ok(()),
        }
    }

    fn carry_to(&mut self, joints_rad: Joints) {
        self.joints_rad = joints_rad;
        let base_from_flange = kinematics::base_from_flange(&joints_rad);
        self.set_tcp(&base_from_flange);
    }

    fn set_tcp(&mut self, base_from_flange: &Pose) {
        self.tcp = TcpPose::from_base_from_tool(&(base_from_flange * Translation3::from(self.tool_m)));
        self.carried = self.tcp;
    }
}

fn difference(a: &Joints, b: &Joints) -> Joints {
    std::array::from_fn(|i| a[i] - b[i])
}

fn added(angles_rad: &Joints, speeds_rad_s: &Joints) -> Joints {
    std::array::from_fn(|i| angles_rad[i] + speeds_rad_s[i] * STEP_S)
}

fn largest(values: &Joints) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}
