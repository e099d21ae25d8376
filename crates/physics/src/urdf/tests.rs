//! The loader against the closed-form kinematics of the UR5e, and what it refuses.

use crate::arm::tests::URDF;
use crate::{ArmModel, UrdfError};
use gripgen_twin::frames::Pose;
use nalgebra::{Matrix3, Matrix4};
use std::f64::consts::{FRAC_PI_2, PI};

fn load(text: &str) -> Result<ArmModel, UrdfError> {
    ArmModel::from_urdf(text, "tool0", &|_| None)
}

/// Denavit-Hartenberg parameters as Universal Robots publishes them: a, d, alpha.
const DH: [(f64, f64, f64); 6] = [
    (0.0, 0.1625, FRAC_PI_2),
    (-0.425, 0.0, 0.0),
    (-0.3922, 0.0, 0.0),
    (0.0, 0.1333, FRAC_PI_2),
    (0.0, 0.0997, -FRAC_PI_2),
    (0.0, 0.0996, 0.0),
];

fn base_from_flange(q: &[f64; 6]) -> Matrix4<f64> {
    DH.iter().zip(q).fold(Matrix4::identity(), |t, (&(a, d, alpha), &theta)| {
        let ((s, c), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
        #[rustfmt::skip]
        let link = Matrix4::new(
            c, -s * ca, s * sa, a * c,
            s, c * ca, -c * sa, a * s,
            0.0, sa, ca, d,
            0.0, 0.0, 0.0, 1.0,
        );
        t * link
    })
}

#[test]
fn forward_kinematics_is_that_of_the_published_parameters() {
    let arm = load(URDF).unwrap();
    for q in [
        [0.0; 6],
        [0.3, -1.2, 1.5, -0.4, 1.1, -2.0],
        [-2.5, -0.7, -1.9, 2.2, -0.6, 0.9],
        [1.0, 2.0, 3.0, -3.0, -2.0, -1.0],
        [PI, -FRAC_PI_2, FRAC_PI_2, 0.0, FRAC_PI_2, -FRAC_PI_2],
    ] {
        let off = arm.base_from_tip(&q).to_homogeneous() - base_from_flange(&q);
        assert!(off.abs().max() < 1e-12, "{q:?}: {off}");
    }
}

/// Published: reach 850 mm. Stretched out, the flange is as far from the axis of the base.
#[test]
fn reach_and_mass_are_those_of_a_ur5e() {
    let arm = load(URDF).unwrap();
    let stretched = [0.0; 6];
    let radius = |p: &Pose| p.translation.x.hypot(p.translation.y);
    let flange = radius(&arm.base_from_tip(&stretched));
    assert!((flange - 0.85).abs() < 1e-3, "{flange} m");
    let mass: f64 = arm.joints.iter().map(|j| j.inertia.mass_kg).sum();
    assert!((mass - 17.7).abs() < 1e-9, "{mass} kg");
    assert!(arm.joints.iter().all(|j| j.limits_rad == Some([-2.0 * PI, 2.0 * PI])));
}

/// Centres of mass, in the frames of the parameters (at the far end of each link), as Universal Robots publishes.
#[test]
fn centres_of_mass_are_the_published_ones() {
    let arm = load(URDF).unwrap();
    let published = [
        (3.761, [0.0, -0.02561, 0.00193]),
        (8.058, [0.2125, 0.0, 0.11336]),
        (2.846, [0.15, 0.0, 0.0265]),
        (1.37, [0.0, -0.0018, 0.01634]),
        (1.3, [0.0, 0.0018, 0.01634]),
        (0.365, [0.0, 0.0, -0.001159]),
    ];
    for ((joint, (mass, com)), (a, _, alpha)) in arm.joints.iter().zip(published).zip(DH) {
        let (sa, ca) = alpha.sin_cos();
        // From the end of the link back to its joint, in which the link frames of the URDF sit.
        let expected = [com[0] + a, com[1] * ca - com[2] * sa, com[1] * sa + com[2] * ca];
        assert_eq!(joint.inertia.mass_kg, mass);
        for k in 0..3 {
            let off = (joint.inertia.centre_m[k] - expected[k]).abs();
            assert!(off < 1e-12, "{}: {}", joint.link, joint.inertia.centre_m);
        }
    }
}

/// An inertia is given in the axes of its `<origin>`: the shoulder's stand on end.
#[test]
fn inertias_are_turned_into_the_frame_of_the_link() {
    let shoulder = load(URDF).unwrap().joints[0].inertia.about_centre_kg_m2;
    let expected = Matrix3::new(
        0.00700210,
        0.00001053,
        0.00000073, //
        0.00001053,
        0.00657286,
        -0.00049994, //
        0.00000073,
        -0.00049994,
        0.00648091,
    );
    assert!((shoulder - expected).abs().max() < 1e-12, "{shoulder}");
}

/// As the official description has it: a turned base link with an inertia, a sensor frame, meshes.
fn official() -> String {
    let base = r#"<link name="world"/><link name="base_link"/><link name="base_link_inertia">
        <visual><geometry><mesh filename="package://ur_description/meshes/ur5e/visual/base.dae"/></geometry></visual>
        <inertial><mass value="4"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
      <joint name="base_joint" type="fixed"><parent link="world"/><child link="base_link"/></joint>
      <joint name="turn" type="fixed"><parent link="base_link"/><child link="base_link_inertia"/>
        <origin xyz="0 0 0" rpy="0 0 3.141592653589793"/></joint>
      <link name="ft_frame"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.2"/></inertial></link>
      <joint name="wrist_3_link-ft_frame" type="fixed"><parent link="wrist_3_link"/><child link="ft_frame"/>
        <origin xyz="0 0 0" rpy="3.141592653589793 0 0"/></joint>"#;
    URDF.replacen(r#"<link name="base_link"/>"#, base, 1).replacen(
        r#"<parent link="base_link"/>
    <child link="shoulder_link"/>"#,
        r#"<parent link="base_link_inertia"/><child link="shoulder_link"/>"#,
        1,
    )
}

#[test]
fn a_description_with_fixed_joints_and_meshes_loads() {
    let found = |m: &str| m.strip_prefix("package://").map(|path| format!("/opt/{path}"));
    let arm = ArmModel::from_urdf(&official(), "tool0", &found).unwrap();
    assert_eq!(arm.joints.len(), 6);
    assert_eq!(arm.meshes.len(), 1);
    assert_eq!(arm.meshes[0].place, "/opt/ur_description/meshes/ur5e/visual/base.dae");
    let q = [0.3, -1.2, 1.5, -0.4, 1.1, -2.0];
    let ours = load(URDF).unwrap().base_from_tip(&q);
    let off = arm.base_from_tip(&q).translation.vector + ours.translation.vector;
    assert!(off.x.abs() < 1e-12 && off.y.abs() < 1e-12, "turned by half a turn: {off}");
    let (with, without) = (&arm.joints[5].inertia, &load(URDF).unwrap().joints[5].inertia);
    assert_eq!(with.mass_kg, without.mass_kg + 0.5);
    let centre = (0.365 * -0.001159 - 0.5 * 0.1) / 0.865;
    assert!((with.centre_m.z - centre).abs() < 1e-12, "{}", with.centre_m);
    let reduced = 0.365 * 0.5 / 0.865 * (0.1_f64 - 0.001159).powi(2);
    assert!((with.about_centre_kg_m2[(0, 0)] - (0.00018694 + 0.1 + reduced)).abs() < 1e-12);

    let missing = load(&official()).unwrap_err().to_string();
    assert!(missing.contains("package://ur_description/meshes/ur5e/visual/base.dae"), "{missing}");
    assert!(missing.contains("base_link_inertia"), "{missing}");
}

#[test]
fn what_is_no_arm_is_refused_with_names_and_numbers() {
    let extra = |text: &str| URDF.replace("</robot>", &format!("{text}</robot>"));
    let elbow = r#"<joint name="elbow_joint" type="revolute">"#;
    let forearm_mass = r#"<mass value="2.846"/>"#;
    let cases = [
        ("<robot".to_owned(), vec!["cannot be read"]),
        (URDF.replace("tool0", "tool9"), vec!["`tool0`", "`tool9`", "`wrist_3_link`"]),
        (URDF.replace(elbow, &elbow.replace("revolute", "prismatic")), vec!["elbow_joint", "prismatic"]),
        (URDF.replace(elbow, &elbow.replace("revolute", "hinge")), vec!["hinge"]),
        (URDF.replace(forearm_mass, r#"<mass value="0"/>"#), vec!["forearm_link", "elbow_joint", "0 kg"]),
        (URDF.replace(forearm_mass, r#"<mass value="NaN"/>"#), vec!["mass", "forearm_link", "NaN"]),
        (URDF.replace("-0.3922", "inf"), vec!["xyz", "wrist_1_joint", "inf"]),
        (URDF.replace(r#"ixx="0.00399632""#, r#"ixx="-1""#), vec!["forearm_link", "principal moments"]),
        (
            URDF.replacen(r#"<axis xyz="0 0 1"/>"#, r#"<axis xyz="0 0 0"/>"#, 1),
            vec!["shoulder_pan_joint", "length 0"],
        ),
        (
            URDF.replacen(r#"lower="-6.283185307179586""#, r#"lower="7""#, 1),
            vec!["shoulder_pan_joint", "7", "6.283"],
        ),
        (
            extra(
                r#"<joint name="again" type="fixed"><parent link="base_link"/><child link="tool0"/></joint>"#,
            ),
            vec!["`tool0`", "`flange-tool0`", "`again`"],
        ),
        (
            extra(
                r#"<joint name="loop" type="fixed"><parent link="tool0"/><child link="base_link"/></joint>"#,
            ),
            vec!["its own ancestor"],
        ),
        (
            extra(
                r#"<link name="lid"/><joint name="hinge" type="continuous"><parent link="forearm_link"/>
                   <child link="lid"/><axis xyz="0 0 1"/></joint>"#,
            ),
            vec!["`hinge`", "continuous", "forearm_link"],
        ),
    ];
    for (text, words) in cases {
        let error = load(&text).expect_err(words[0]).to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` is not in: {error}");
        }
    }
    let no_inertial = URDF.replace(
        r#"<inertial>
      <origin xyz="-0.2422 0 0.0265" rpy="0 0 0"/>"#,
        r#"<unknown>"#,
    );
    assert!(load(&no_inertial).is_err());
    let base = ArmModel::from_urdf(URDF, "base_link", &|_| None).unwrap_err();
    assert!(base.to_string().contains("no revolute joint"), "{base}");
}

/// A gripper that hangs on the tip has its own model, and does not count twice.
#[test]
fn what_hangs_on_the_tip_is_ignored() {
    let gripper = r#"<link name="hand"><inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <joint name="mount" type="fixed"><parent link="tool0"/><child link="hand"/></joint>
        <link name="finger"/><joint name="slide" type="prismatic"><parent link="hand"/><child link="finger"/>
        <axis xyz="1 0 0"/></joint></robot>"#;
    assert_eq!(load(&URDF.replace("</robot>", gripper)).unwrap(), load(URDF).unwrap());
}
