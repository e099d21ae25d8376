//! Measured pulls from recordings of ROS 2.

use crate::assets;
use gripgen_physics::ArmModel;
use gripgen_record::{JudgedPulls, RosbagError, read_judged_bags};
use std::path::Path;

/// The arm whose joints are read.
const ARM: &str = "robots/ur5e/ur5e.urdf";
/// Its last link.
const TIP: &str = "tool0";

/// The pulls of bags. Where a bag has joints and no pose, they are those of a UR5e.
pub(super) fn judged_bags(path: &Path) -> Result<JudgedPulls, RosbagError> {
    let arm = ArmModel::from_urdf(assets::text(ARM), TIP, &|reference| Some(reference.into())).ok();
    let tip = arm.map(|arm| {
        move |joints_rad: &[f64; 6]| {
            let at = arm.base_from_tip(joints_rad).translation.vector;
            [at.x, at.y, at.z]
        }
    });
    read_judged_bags(path, tip.as_ref().map(|tip| tip as &dyn Fn(&[f64; 6]) -> [f64; 3]))
}
