//! A grip before it is tried, and what it looks like once the jaws have settled.

use crate::PerJaw;
use crate::frames::{Pose, pose, rotation_from_fixed_xyz};
use nalgebra::Vector3;

/// A grip proposed for a part, which worked wherever the sweep goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// As in `[[parts.NAME.grips]]`.
    pub origin_mm: [f64; 3],
    /// As in `[[parts.NAME.grips]]`.
    pub orientation_deg: [f64; 3],
    /// Distance between the gels where they first touch.
    pub width_mm: f64,
    /// Contact area of the jaw that has less of it, at 40 N or the largest force that fits.
    pub contact_mm2: f64,
    /// Distance of the middle of mass from the jaw axis.
    pub lever_mm: f64,
    /// How much lower than the contact the part lies beside the pads; negative where it rises towards a finger.
    pub clearance_mm: f64,
}

impl Proposal {
    /// Where the mesh is in the part frame, whose y axis is that of the jaws.
    pub fn part_from_mesh(&self) -> Pose {
        let rotation = rotation_from_fixed_xyz(self.orientation_deg.map(f64::to_radians));
        let origin = Vector3::from(self.origin_mm.map(|x| x * 1e-3));
        pose(&rotation, -(rotation * origin))
    }
}

/// The settled grip: all that the tactile pipeline and the pull need to know of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp {
    /// Where the part is, seen from each gel. The gel's origin lies on its unloaded surface.
    pub gel_from_part: PerJaw<Pose>,
    /// Normal force of each jaw.
    pub normal_force_n: PerJaw<f64>,
}
