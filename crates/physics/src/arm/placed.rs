//! An arm model in the pose in which it grips.

use crate::arm::model::{ArmModel, LinkInertia};
use crate::convert::compact;
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gripper, RobotArm};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

/// Joints that the task space needs: three translations, three rotations.
const JOINTS: usize = 6;

/// Smallest singular value of the Jacobian (metres or 1 per radian) of a pose from which the arm can pull.
const SMALLEST_SINGULAR_VALUE: f64 = 0.02;

/// Why an arm cannot take a stance.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ArmError(String);

/// An arm in its stance, placed so that the grip centre is the origin of `world`, the tip's z axis (the approach)
/// along +x and its y axis along +y, the jaw axis.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedArm {
    pub(crate) model: ArmModel,
    pub(crate) stance: RobotArm,
    pub(crate) world_from_base: Pose,
    /// Frames of the links in `world`.
    pub(crate) world_from_links: Vec<Pose>,
}

impl PlacedArm {
    /// Checks the stance and places the arm.
    ///
    /// # Errors
    ///
    /// Another number of joints than 6, a joint beyond its limits, a value that is not finite, or a singular stance.
    pub fn new(model: ArmModel, stance: &RobotArm) -> Result<Self, ArmError> {
        let joints = model.joints.len();
        if joints != JOINTS {
            let arm = model.name;
            return Err(ArmError(format!("the arm `{arm}` has {joints} joints, {JOINTS} are needed")));
        }
        for (joint, &angle_rad) in model.joints.iter().zip(&stance.joints_rad) {
            let [lower_rad, upper_rad] = joint.limits_rad.unwrap_or([f64::MIN, f64::MAX]);
            if !(lower_rad..=upper_rad).contains(&angle_rad) {
                return Err(ArmError(format!(
                    "joint `{}` stands at {angle_rad} rad, its limits are {lower_rad} to {upper_rad} rad",
                    joint.name
                )));
            }
        }
        let numbers = std::iter::once(("tip_to_grip_m", stance.tip_to_grip_m))
            .chain(stance.rotor_inertia_kg_m2.iter().map(|&i| ("rotor_inertia_kg_m2", i)));
        for (what, value) in numbers {
            if !value.is_finite() || value < 0.0 {
                return Err(ArmError(format!("{what} is {value}")));
            }
        }
        let tip_from_grip =
            Pose::from_parts(Translation3::new(0.0, 0.0, stance.tip_to_grip_m), tip_from_world_axes());
        let base_from_grip = model.base_from_tip(&stance.joints_rad) * tip_from_grip;
        let world_from_base = base_from_grip.inverse();
        let base_from_links = model.base_from_links(&stance.joints_rad);
        let world_from_links = base_from_links.iter().map(|link| world_from_base * link).collect();
        let placed = Self { model, stance: stance.clone(), world_from_base, world_from_links };
        let smallest = placed.jacobian().singular_values().min();
        if smallest < SMALLEST_SINGULAR_VALUE {
            return Err(ArmError(format!(
                "the arm is singular in this stance: the smallest singular value of its Jacobian is {smallest:.4}, \
                 at least {SMALLEST_SINGULAR_VALUE} is needed"
            )));
        }
        Ok(placed)
    }

    /// The base in `world`.
    pub fn world_from_base(&self) -> Pose {
        self.world_from_base
    }

    /// Mass that a pull along `direction` accelerates while the arm holds the other five directions: `d.L d` with the
    /// task-space inertia `L = J^-T M J^-1` (Khatib 1987) of arm and gripper at the grip centre.
    pub fn held_mass_kg(&self, gripper: &Gripper, direction: [f64; 3]) -> f64 {
        let Some(inverse) = self.jacobian().try_inverse() else { return f64::INFINITY };
        let d = Vector3::from(direction);
        let joints = inverse * Vector6::new(d.x, d.y, d.z, 0.0, 0.0, 0.0);
        (joints.transpose() * self.joint_inertia(gripper) * joints).x
    }

    /// Inertia matrix of the joints: `sum m Jv' Jv + Jw' I Jw` over the links, and the rotors.
    fn joint_inertia(&self, gripper: &Gripper) -> Matrix6<f64> {
        let mut mass =
            Matrix6::from_diagonal(&Vector6::from_iterator(self.stance.rotor_inertia_kg_m2.iter().copied()));
        let mut add = |links: usize, inertia: &LinkInertia| {
            let (mut linear, mut angular) = (Matrix3x6::zeros(), Matrix3x6::zeros());
            let moving = self.model.joints.iter().zip(&self.world_from_links).take(links).enumerate();
            for (i, (joint, link)) in moving {
                let axis = link.rotation * Vector3::from(joint.axis);
                linear.set_column(i, &axis.cross(&(inertia.centre_m - link.translation.vector)));
                angular.set_column(i, &axis);
            }
            mass += linear.transpose() * linear * inertia.mass_kg
                + angular.transpose() * inertia.about_centre_kg_m2 * angular;
        };
        for (i, (joint, link)) in self.model.joints.iter().zip(&self.world_from_links).enumerate() {
            add(i + 1, &joint.inertia.moved(link));
        }
        let links = self.model.joints.len();
        add(links, &gripper_inertia(gripper.mass_kg, self.stance.tip_to_grip_m));
        // The jaws stand on both sides of the grip centre; a pull moves them along.
        add(links, &LinkInertia { mass_kg: 2.0 * gripper.jaw_mass_kg, ..LinkInertia::NOTHING });
        mass
    }

    /// Motion of the grip centre (translation, rotation) per motion of each joint.
    fn jacobian(&self) -> Matrix6<f64> {
        let mut jacobian = Matrix6::zeros();
        for (i, (joint, link)) in self.model.joints.iter().zip(&self.world_from_links).enumerate() {
            let axis = link.rotation * Vector3::from(joint.axis);
            // The grip centre is the origin.
            jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&axis.cross(&-link.translation.vector));
            jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis);
        }
        jacobian
    }
}

/// The gripper as a compact body half-way between tip and grip centre, in `world`.
pub(crate) fn gripper_inertia(mass_kg: f64, tip_to_grip_m: f64) -> LinkInertia {
    LinkInertia {
        mass_kg,
        centre_m: Vector3::new(-tip_to_grip_m / 2.0, 0.0, 0.0),
        about_centre_kg_m2: Matrix3::identity() * compact(mass_kg).principal_inertia().x,
    }
}

/// The axes of `world` in the tip: approach z along x, y along y.
fn tip_from_world_axes() -> UnitQuaternion<f64> {
    let m = Matrix3::new(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    gripgen_twin::frames::pose(&Rotation3::from_matrix_unchecked(m), Vector3::zeros()).rotation
}
