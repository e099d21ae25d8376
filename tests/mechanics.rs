//! Two mechanics, one result: where they agree, how far, and what both share.

use crate::common::{project, pulled};

/// Labels of both mechanics on random scenarios without noise: how many were compared, the largest relative difference,
/// and where.
fn compare(twist: &str, samples: u64) -> (u64, f64, String) {
    let load = |mechanics: &str| {
        let sets = [
            "twin=asset:configs/twin-baseline.toml",
            "design=random",
            "seed=11",
            "images=none",
            "trace=none",
            "wrist.noise_n=0",
            "vary.grip_force_n={ uniform = [5, 80] }",
            "vary.grip_angle_deg={ uniform = [-180, 180] }",
            "vary.grip_offset_mm={ normal = [0, 4] }",
            "vary.pull_direction=[1, -1]",
            "vary.pull.increment_n=[0.5, 1, 2]",
            &format!("samples={samples}"),
            &format!("robot.twist={twist}"),
            &format!("mechanics={mechanics}"),
        ];
        project("asset:configs/quickstart.toml", &sets)
    };
    let (rapier, reduced) = (load("rapier"), load("reduced"));
    let mut worst = (0, 0.0_f64, String::new());
    for index in 0..samples {
        let (a, b) = (pulled(&rapier, index), pulled(&reduced, index));
        assert_eq!(a.is_some(), b.is_some(), "sample {index}: only one of the two has contact");
        let (Some(a), Some(b)) = (a, b) else { continue };
        assert_eq!((a.label.censored, b.label.censored), (false, false), "sample {index}");
        let (x, y) = (a.label.max_pull_force_n, b.label.max_pull_force_n);
        let off = (y / x - 1.0).abs();
        worst.0 += 1;
        if off > worst.1 {
            worst.1 = off;
            worst.2 = format!("sample {index}: {x} N and {y} N, {:?}", rapier.sweep.drawn(index));
        }
    }
    println!("twist {twist}: worst of {}: {:.3} % ({})", worst.0, 100.0 * worst.1, worst.2);
    worst
}

/// 200 random scenarios: forces, angles, offsets and grips of all parts.
#[test]
fn both_mechanics_slip_at_the_same_force() {
    let (compared, off, case) = compare("stiff", 200);
    assert!(compared > 180 && off < 0.01, "{:.3} %, {case}", 100.0 * off);
}

/// The same where off-centre grips and those at an edge turn and slip earlier.
#[test]
fn both_mechanics_slip_at_the_same_force_off_centre() {
    let (compared, off, case) = compare("free", 100);
    assert!(compared > 90 && off < 0.05, "{:.3} %, {case}", 100.0 * off);
}

/// Without a trace the pull ends as soon as its label is decided: the label is the same, bit for bit.
#[test]
fn a_sweep_without_traces_has_the_same_labels() {
    for mechanics in ["mechanics=reduced", "mechanics=rapier"] {
        let load = |trace: &str| {
            let sets = ["images=none", mechanics, trace, "parts.gear.kinetic_ratio=0.8"];
            project("asset:configs/quickstart.toml", &sets)
        };
        let (full, label) = (load("trace=full"), load("trace=none"));
        for index in (0..200).step_by(9) {
            let (a, b) = (pulled(&full, index).unwrap(), pulled(&label, index).unwrap());
            assert_eq!(a.label, b.label, "sample {index}, {mechanics}");
        }
    }
}

/// Repetitions share their grip, and are what they would be alone.
#[test]
fn repetitions_differ_in_scatter_and_noise_only() {
    for mechanics in ["mechanics=reduced", "mechanics=rapier"] {
        let sets = ["repetitions=5", "vary.grip_force_n=[30]", "vary.grip_angle_deg=[30]", mechanics];
        let shared = project("asset:configs/quickstart.toml", &sets);
        let ascending: Vec<_> = (0..10).map(|i| pulled(&shared, i).unwrap()).collect();
        // In another order, from a project that has gripped nothing yet.
        let fresh = project("asset:configs/quickstart.toml", &sets);
        for index in (0..10).rev() {
            assert!(
                pulled(&fresh, index).unwrap() == ascending[index as usize],
                "sample {index}, {mechanics}"
            );
        }
        for pair in ascending[..5].windows(2) {
            assert_eq!(pair[0].grasp, pair[1].grasp);
            assert_eq!(pair[0].imprint, pair[1].imprint);
            assert_ne!(pair[0].mu_effective, pair[1].mu_effective);
            assert_ne!(pair[0].images, pair[1].images);
        }
    }
}

/// A contact beside the line of the pull, which goes through the grip centre, slips earlier where the grip can turn: a gear
/// held off its middle loses, alike in both mechanics; a shaft that fills the gels does not, nor does a lever along the pull.
/// Between free and stiff a spring holds ever more the stiffer it is, and the shipped one all.
#[test]
fn a_grip_that_turns_falls_with_the_lever_of_its_contact() {
    let label = |part: &str, mechanics: &str, twist: &str, offset_mm: f64, angle_deg: f64| {
        let (twist, stiffness) = twist.split_once(' ').unwrap_or((twist, "1000"));
        let p = project(
            "asset:configs/quickstart.toml",
            &[
                "twin=asset:configs/twin-baseline.toml",
                "images=none",
                "wrist.noise_n=0",
                &format!("parts.{part}.scatter=0"),
                &format!("parts.{part}.mu=0.168"),
                &format!("vary.part=[\"{part}\"]"),
                "vary.grip_pose=[0]",
                "vary.grip_force_n=[40]",
                &format!("vary.grip_offset_mm=[{offset_mm}]"),
                &format!("vary.grip_angle_deg=[{angle_deg}]"),
                &format!("mechanics={mechanics}"),
                &format!("robot.twist={twist}"),
                &format!("robot.twist_stiffness_n_m_per_rad={stiffness}"),
            ],
        );
        pulled(&p, 0).unwrap().label.max_pull_force_n
    };
    let straight = 2.0 * 0.168 * 40.0;
    let mut before = f64::INFINITY;
    for offset_mm in [0.0, 3.0, 6.0, 9.0] {
        let of = |mechanics: &str, twist: &str| label("ball_bearing", mechanics, twist, offset_mm, 0.0);
        assert!((of("reduced", "stiff") / straight - 1.0).abs() < 1e-3);
        assert!((of("reduced", "compliant 1000") / straight - 1.0).abs() < 1e-3);
        let (a, b) = (of("reduced", "free"), of("rapier", "free"));
        assert!((a / b - 1.0).abs() < 0.01, "{offset_mm} mm: {a} and {b}");
        assert!(a < before - 1e-3, "{offset_mm} mm: {a} N after {before} N");
        before = a;
        let mut softer = a * (1.0 - 1e-3);
        for stiffness in ["0.003", "0.01", "0.03", "0.1", "1"] {
            let held = of("reduced", &format!("compliant {stiffness}"));
            assert!(
                held > softer * (1.0 - 1e-6) && held < straight * 1.001,
                "{offset_mm} mm, {stiffness}: {held} N"
            );
            softer = held;
        }
    }
    assert!(before < 0.6 * straight, "{before} N at 9 mm");
    let along = label("ball_bearing", "reduced", "free", 9.0, 90.0);
    assert!((along / straight - 1.0).abs() < 0.02, "a lever along the pull: {along}");
    let shaft = label("long_shaft", "reduced", "free", 6.0, 0.0);
    assert!((shaft / straight - 1.0).abs() < 0.01, "a shaft that fills the gels: {shaft}");
}

/// Strong pulls at the default stop: both mechanics reach the limit of the friction law.
#[test]
fn strong_grips_slip_before_the_stop() {
    for mechanics in ["rapier", "reduced"] {
        for (part, mu) in [("long_shaft", 0.6), ("gear", 0.6), ("ball_bearing", 0.6), ("roller_bearing", 0.6)]
        {
            let p = project(
                "asset:configs/quickstart.toml",
                &[
                    "twin=asset:configs/twin-baseline.toml",
                    "images=none",
                    "wrist.noise_n=0",
                    &format!("parts.{part}.scatter=0"),
                    &format!("parts.{part}.mu={mu}"),
                    &format!("vary.part=[\"{part}\"]"),
                    "vary.grip_force_n=[80]",
                    "vary.grip_pose=[0, 1]",
                    "vary.grip_angle_deg=[0]",
                    "vary.grip_offset_mm=[0]",
                    &format!("mechanics={mechanics}"),
                ],
            );
            for index in 0..2 {
                let label = pulled(&p, index).unwrap().label;
                let off = label.max_pull_force_n / (2.0 * mu * 80.0) - 1.0;
                assert!(!label.censored && off.abs() < 1e-3, "{mechanics}, {part}, grip {index}: {label:?}");
            }
        }
    }
}
