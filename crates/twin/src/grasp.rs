//! What a grip looks like once the jaws have settled.

use crate::PerJaw;
use crate::frames::Pose;

/// The settled grip: all that the tactile pipeline and the pull need to know of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp {
    /// Where the part is, seen from each gel. The gel's origin lies on its unloaded surface.
    pub gel_from_part: PerJaw<Pose>,
    /// Normal force of each jaw.
    pub normal_force_n: PerJaw<f64>,
}
