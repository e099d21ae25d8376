//! Joints of a UR5e and where they carry its flange.
//!
//! Lengths are those of "DH parameters for calculations of kinematics and dynamics" (Universal Robots, support article); the frame of the base is the
//! one in which the robot shows poses. A robot's own calibration, some tenths of a millimetre, is not in them.

use gripgen_twin::frames::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Angles of the joints, from the base to the flange.
pub type Joints = [f64; 6];

/// How far a joint turns in either direction (data sheet, UR5e: 360 degrees).
pub const MAX_ANGLE_RAD: f64 = TAU;
/// How fast a joint turns at most (data sheet, UR5e: 180 degrees per second).
pub const MAX_SPEED_RAD_S: f64 = PI;

/// Along the base, the upper arm, the forearm and the three wrists.
const SHOULDER_M: f64 = 0.1625;
const UPPER_ARM_M: f64 = -0.425;
const FOREARM_M: f64 = -0.3922;
const WRIST_1_M: f64 = 0.1333;
const WRIST_2_M: f64 = 0.0997;
const WRIST_3_M: f64 = 0.0996;

/// Sine of the second wrist below which the first and the third turn about one axis, and nothing says how they share it.
const ALIGNED: f64 = 1e-9;
/// How far a cosine may lie beyond 1 for its rounding.
const ROUNDING: f64 = 1e-9;

/// No joints carry the flange there.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("no joints of a UR5e carry its flange to ({:.3}, {:.3}, {:.3}) m in this turn", at_m[0], at_m[1], at_m[2])]
pub struct OutOfReachError {
    /// Where the flange was to go, in the base.
    pub at_m: [f64; 3],
}

/// `base_from_flange` of these joints.
pub fn base_from_flange(joints_rad: &Joints) -> Pose {
    // Per joint: along its axis, along the next link, and how the next axis is turned about that link.
    const LINKS: [(f64, f64, f64); 6] = [
        (SHOULDER_M, 0.0, FRAC_PI_2),
        (0.0, UPPER_ARM_M, 0.0),
        (0.0, FOREARM_M, 0.0),
        (WRIST_1_M, 0.0, FRAC_PI_2),
        (WRIST_2_M, 0.0, -FRAC_PI_2),
        (WRIST_3_M, 0.0, 0.0),
    ];
    let mut pose = Pose::identity();
    for (angle_rad, (along_m, link_m, twist_rad)) in joints_rad.iter().zip(LINKS) {
        pose *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *angle_rad);
        pose *= Translation3::new(link_m, 0.0, along_m);
        pose *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), twist_rad);
    }
    pose
}

/// All joints that carry the flange there, up to eight, each angle within half a turn of `near_rad` where its limit allows.
///
/// The axes of the shoulder's lift, the elbow and the first wrist are parallel (`normal`), so that the centre of the second wrist lies
/// [`WRIST_1_M`] from the plane through the base's axis: this leaves two angles of the base, two of the second wrist with each, and a
/// triangle of two links with two elbows. The third wrist keeps its angle where it has the axis of the first.
pub fn solutions(base_from_flange: &Pose, near_rad: &Joints) -> Vec<Joints> {
    let turn = *base_from_flange.rotation.to_rotation_matrix().matrix();
    let (x6, y6, z6) = (turn.column(0), turn.column(1), turn.column(2));
    let wrist_m = base_from_flange.translation.vector - WRIST_3_M * z6;
    let Some(aside_rad) = cosine(WRIST_1_M / wrist_m.x.hypot(wrist_m.y)).map(|c| FRAC_PI_2 - c.acos()) else {
        return Vec::new();
    };
    let towards_rad = wrist_m.y.atan2(wrist_m.x);
    let mut found = Vec::with_capacity(8);
    for q1 in [towards_rad + aside_rad, towards_rad + PI - aside_rad] {
        let (normal, forward) =
            (Vector3::new(q1.sin(), -q1.cos(), 0.0), Vector3::new(q1.cos(), q1.sin(), 0.0));
        let (along_x, along_y, c5) = (normal.dot(&x6), normal.dot(&y6), normal.dot(&z6));
        let aside = along_x.hypot(along_y);
        for s5 in [aside, -aside] {
            let q5 = s5.atan2(c5);
            let q6 = if aside < ALIGNED { near_rad[5] } else { (-along_y / s5).atan2(along_x / s5) };
            let (s6, c6) = q6.sin_cos();
            let (x5, y5, z5) = (c6 * x6 - s6 * y6, s6 * x6 + c6 * y6, z6);
            let (x4, z4) = (c5 * x5 - s5 * z5, -y5);
            let elbow_to_wrist =
                wrist_m - WRIST_2_M * z4 - WRIST_1_M * normal - Vector3::new(0.0, 0.0, SHOULDER_M);
            let (along_m, up_m) = (elbow_to_wrist.dot(&forward), elbow_to_wrist.z);
            let squares = UPPER_ARM_M * UPPER_ARM_M + FOREARM_M * FOREARM_M;
            let bent = (along_m * along_m + up_m * up_m - squares) / (2.0 * UPPER_ARM_M * FOREARM_M);
            let Some(c3) = cosine(bent) else { continue };
            for q3 in [c3.acos(), -c3.acos()] {
                let q2 =
                    up_m.atan2(along_m) - (FOREARM_M * q3.sin()).atan2(UPPER_ARM_M + FOREARM_M * q3.cos());
                let q4 = x4.z.atan2(x4.dot(&forward)) - q2 - q3;
                let mut joints = [q1, q2, q3, q4, q5, q6];
                for (angle_rad, near_rad) in joints.iter_mut().zip(near_rad) {
                    *angle_rad = within_limits(near_rad + (*angle_rad - near_rad + PI).rem_euclid(TAU) - PI);
                }
                found.push(joints);
            }
        }
    }
    found
}

/// The joints that carry the flange there and lie nearest to `near_rad`, by the sum of their squared differences.
///
/// # Errors
///
/// There are none.
pub fn nearest(base_from_flange: &Pose, near_rad: &Joints) -> Result<Joints, OutOfReachError> {
    let away = |joints: &Joints| joints.iter().zip(near_rad).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let all = solutions(base_from_flange, near_rad);
    let out_of_reach = OutOfReachError { at_m: base_from_flange.translation.vector.into() };
    all.into_iter().min_by(|a, b| away(a).total_cmp(&away(b))).ok_or(out_of_reach)
}

/// A cosine, if it is one but for rounding.
fn cosine(x: f64) -> Option<f64> {
    (x.abs() <= 1.0 + ROUNDING).then_some(x.clamp(-1.0, 1.0))
}

fn within_limits(angle_rad: f64) -> f64 {
    if angle_rad.abs() > MAX_ANGLE_RAD { angle_rad - TAU.copysign(angle_rad) } else { angle_rad }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::random::{Purpose, Stream};

    fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
        ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation))
    }

    /// Poses by hand: stretched out along -x, and with the elbow square.
    #[test]
    fn the_flange_is_where_the_lengths_of_the_links_say() {
        let stretched = base_from_flange(&[0.0; 6]);
        let at = Vector3::new(-0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997);
        assert!((stretched.translation.vector - at).norm() < 1e-12, "{stretched}");
        let up = base_from_flange(&[0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, 0.0, 0.0]);
        let at = Vector3::new(0.0, -0.1333 - 0.0996, 0.1625 + 0.425 + 0.3922 + 0.0997);
        assert!((up.translation.vector - at).norm() < 1e-12, "{up}");
    }

    /// What joints reach is reached again by as many as eight ways, one of them the same joints.
    #[test]
    fn the_way_back_finds_the_joints_again() {
        let mut stream = Stream::new(16, 0, Purpose::Draw);
        for i in 0..5000 {
            let joints: Joints = std::array::from_fn(|_| TAU * stream.uniform() - PI);
            let flange = base_from_flange(&joints);
            let all = solutions(&flange, &joints);
            assert!((2..=8).contains(&all.len()), "{i}: {} ways", all.len());
            for one in &all {
                let (m, rad) = apart(&base_from_flange(one), &flange);
                assert!(m < 1e-9 && rad < 1e-7, "{i}: {m} m, {rad} rad off by {one:?}");
            }
            let back = nearest(&flange, &joints).unwrap();
            let off = back.iter().zip(&joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-5, "{i}: {off} rad");
        }
    }

    /// Where the first and the third wrist share an axis, the third stays where it is.
    #[test]
    fn a_wrist_that_is_stretched_keeps_its_angle() {
        for q6 in [-2.0, 0.0, 0.7] {
            let joints = [0.3, -1.2, 1.4, -0.9, 0.0, q6];
            let back = nearest(&base_from_flange(&joints), &joints).unwrap();
            assert!(back.iter().zip(&joints).all(|(a, b)| (a - b).abs() < 1e-6), "{back:?}");
        }
    }

    #[test]
    fn nothing_reaches_beyond_the_arm_or_into_its_axis() {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        let at = |x, y, z| Pose::from_parts(Translation3::new(x, y, z), turn);
        for (x, y, z) in [(1.2, 0.0, 0.3), (0.0, 0.0, 0.4), (0.05, 0.05, 0.4), (0.0, 0.3, 1.3)] {
            let found = nearest(&at(x, y, z), &[0.0; 6]);
            assert_eq!(found, Err(OutOfReachError { at_m: [x, y, z] }));
        }
        assert!(nearest(&at(0.45, -0.18, 0.25), &[0.0; 6]).is_ok());
    }

    /// Angles come within half a turn of those that are near, and never beyond a whole one.
    #[test]
    fn angles_are_those_near_the_old_ones() {
        let joints = [3.0, -1.2, 1.4, -0.9, 1.1, 6.2];
        let back = nearest(&base_from_flange(&joints), &joints).unwrap();
        assert!(back.iter().zip(&joints).all(|(a, b)| (a - b).abs() < 1e-6), "{back:?}");
        let mut turned = joints;
        turned[5] = 6.2 + 0.2;
        for one in solutions(&base_from_flange(&turned), &joints) {
            assert!(one.iter().all(|rad| rad.abs() <= MAX_ANGLE_RAD), "{one:?}");
        }
    }
}
