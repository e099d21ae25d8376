//! A serial arm: joints, inertias, forward kinematics.

use gripgen_twin::frames::Pose;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Why a URDF is no arm.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UrdfError(pub(crate) String);

/// A serial arm: all that its motion depends on, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmModel {
    /// Name of the robot.
    pub name: String,
    /// The joints from base to tip, each with the link that it moves.
    pub joints: Vec<ArmJoint>,
    /// Tip in the frame of the last link.
    pub last_from_tip: Pose,
    /// The meshes that the text names, in its order.
    pub meshes: Vec<ArmMesh>,
}

/// A revolute joint and the link that it moves. The link's frame is the joint's, turned by its angle.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmJoint {
    /// Name of the joint.
    pub name: String,
    /// Name of the link.
    pub link: String,
    /// The joint's frame in the frame of the link before it, at angle 0.
    pub parent_from_joint: Pose,
    /// Unit vector of the axis in the joint's frame.
    pub axis: [f64; 3],
    /// Lowest and highest angle; `None` for a joint that turns without end.
    pub limits_rad: Option<[f64; 2]>,
    /// Inertia of the link and of all that is fixed to it.
    pub inertia: LinkInertia,
}

/// Mass, its centre, and the inertia about that centre, in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// Mass.
    pub mass_kg: f64,
    /// Centre of mass.
    pub centre_m: Vector3<f64>,
    /// Inertia tensor about the centre of mass.
    pub about_centre_kg_m2: Matrix3<f64>,
}

/// A mesh of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArmMesh {
    /// Link that it belongs to.
    pub link: String,
    /// What the URDF calls it.
    pub reference: String,
    /// Where the resolver found it.
    pub place: String,
}

impl ArmModel {
    /// Frames of all links in the base, for given joint angles.
    pub fn base_from_links(&self, joints_rad: &[f64]) -> Vec<Pose> {
        let mut base_from_link = Pose::identity();
        let turned = self.joints.iter().zip(joints_rad).map(|(joint, &angle_rad)| {
            base_from_link = base_from_link * joint.parent_from_joint * joint.turned(angle_rad);
            base_from_link
        });
        turned.collect()
    }

    /// Frame of the tip in the base, for given joint angles.
    pub fn base_from_tip(&self, joints_rad: &[f64]) -> Pose {
        let last = self.base_from_links(joints_rad).pop();
        last.unwrap_or_else(Pose::identity) * self.last_from_tip
    }
}

impl ArmJoint {
    /// The motion of the joint by an angle.
    pub fn turned(&self, angle_rad: f64) -> Pose {
        let (s, c) = (libm::sin(angle_rad / 2.0), libm::cos(angle_rad / 2.0));
        let [x, y, z] = self.axis;
        let q = Quaternion::new(c, x * s, y * s, z * s);
        Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_quaternion(q))
    }
}

impl LinkInertia {
    pub(crate) const NOTHING: Self =
        Self { mass_kg: 0.0, centre_m: Vector3::new(0.0, 0.0, 0.0), about_centre_kg_m2: ZERO };

    /// Inertia of several bodies as one, by the parallel-axis theorem.
    pub fn sum(parts: &[Self]) -> Self {
        let mass_kg: f64 = parts.iter().map(|p| p.mass_kg).sum();
        if mass_kg == 0.0 {
            return Self::NOTHING;
        }
        let centre_m = parts.iter().map(|p| p.centre_m * p.mass_kg).sum::<Vector3<f64>>() / mass_kg;
        let about_centre_kg_m2 = parts
            .iter()
            .map(|p| {
                let d = p.centre_m - centre_m;
                p.about_centre_kg_m2
                    + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * p.mass_kg
            })
            .sum();
        Self { mass_kg, centre_m, about_centre_kg_m2 }
    }

    /// The same body in another frame.
    pub(crate) fn moved(&self, target_from_source: &Pose) -> Self {
        let r = target_from_source.rotation.to_rotation_matrix();
        Self {
            mass_kg: self.mass_kg,
            centre_m: (target_from_source * nalgebra::Point3::from(self.centre_m)).coords,
            about_centre_kg_m2: r.matrix() * self.about_centre_kg_m2 * r.matrix().transpose(),
        }
    }

    pub(crate) fn check(&self, joint: &ArmJoint) -> Result<(), UrdfError> {
        let (link, joint, mass_kg) = (&joint.link, &joint.name, self.mass_kg);
        if mass_kg <= 0.0 {
            return Err(UrdfError(format!(
                "link `{link}`, moved by joint `{joint}`, has no <inertial> with a positive mass: {mass_kg} kg"
            )));
        }
        let moments: [f64; 3] = self.about_centre_kg_m2.symmetric_eigenvalues().into();
        if moments.iter().any(|&m| m <= 0.0) {
            return Err(UrdfError(format!(
                "the inertia of link `{link}` has principal moments {moments:?} kg m2; all have to be positive"
            )));
        }
        Ok(())
    }
}

const ZERO: Matrix3<f64> = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
