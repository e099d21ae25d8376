//! Parts of one's own: what `init` proposes holds wherever its sweep goes, and the jaws stop at the surface.

use crate::common::{project_in, slow};
use crate::solids::{Solid, SolidPart, ordinary};
use gripgen::physics::Window;
use gripgen::tactile::SimdLevel;
use gripgen::twin::frames::{Pose, world_from_gel};
use gripgen::twin::{Jaw, Outcome, Part, Pulled, TriMesh, write_binary_stl};
use gripgen::{Project, generate};
use gripgen_cli::{InitError, NoGrip, PartOptions, PartStarter, part_starter, plan};
use nalgebra::{Point3, Vector3};
use std::path::Path;

const OPTIONS: PartOptions =
    PartOptions { scale_mm_per_unit: 1.0, accept_open_mesh: false, mu: None, threads: 2 };

/// Writes the part and what `init` makes of it.
fn start(part: &SolidPart, folder: &Path) -> Result<PartStarter, InitError> {
    let made = part_starter(&[(&part.write(folder), OPTIONS)], folder)?;
    for file in &made.files {
        std::fs::write(folder.join(&file.name), &file.bytes).unwrap();
    }
    Ok(made)
}

const BARE: [(&str, &str); 3] = [("mechanics", "reduced"), ("images", "none"), ("trace", "none")];

fn pulled(project: &Project, index: u64) -> Result<Box<Pulled>, String> {
    match generate(project, index, SimdLevel::best()).outcome {
        Outcome::Pulled(pulled) => Ok(pulled),
        Outcome::NoContact { .. } => Err("no contact".into()),
        Outcome::Failed { reason } => Err(reason),
    }
}

/// Distance from the grip centre at which rays from a pad meet the part, by its formulas: the nearest of a grid of rays, so many in half a
/// millimetre, that reaches the pad's edges.
fn rays_meet_mm(part: &SolidPart, jaw: Jaw, world_from_mesh: &Pose, window: Window, fine: u32) -> f64 {
    let far_mm = 60.0;
    let mesh_from_gel = world_from_mesh.inverse() * world_from_gel(jaw, far_mm * 1e-3);
    let along = mesh_from_gel * Vector3::z();
    let mut nearest = f64::INFINITY;
    for i in 0..=56 * fine {
        for j in 0..=42 * fine {
            let x = window.half_width_m * (f64::from(i) / f64::from(28 * fine) - 1.0);
            let y = window.half_height_m * (f64::from(j) / f64::from(21 * fine) - 1.0);
            let from = (mesh_from_gel * Point3::new(x, y, 0.0)) * 1e3;
            nearest = nearest.min(part.meets_mm(from, along, 2.0 * far_mm).unwrap_or(f64::INFINITY));
        }
    }
    far_mm - nearest
}

/// Every sample of the unedited sweep grips, both gels feel the part, and each stands where rays meet the part's formulas.
#[test]
fn proposed_grips_hold_and_the_jaws_stop_at_the_surface() {
    for part in ordinary() {
        let folder = tempfile::tempdir().unwrap();
        let made = start(&part, folder.path()).unwrap_or_else(|e| panic!("{}: {e}", part.name));
        let project = project_in(folder.path(), &BARE);
        let of_part = &project.twin.parts[part.name];
        let (mut failed, mut worst_mm) = (Vec::new(), 0.0_f64);
        for index in 0..project.sweep.samples {
            let scenario = project.sweep.scenario(index, &project.twin).0;
            let pulled = match pulled(&project, index) {
                Ok(pulled) => pulled,
                Err(reason) => {
                    failed.push(reason);
                    continue;
                }
            };
            for (jaw, imprint) in pulled.imprint.iter() {
                let area_m2 = imprint.patch.area_m2();
                assert!(area_m2 > 1e-6, "{}, sample {index}, {jaw} jaw: {area_m2} m2", part.name);
                // The gels stand where their surfaces first touch: the part's origin lies that far in front of them.
                let stands_mm = pulled.grasp.gel_from_part[jaw].translation.z * 1e3;
                if index % (if slow() { 10 } else { 50 }) == 0 {
                    let c = &scenario.covariates;
                    let world_from_mesh = Part::world_from_part(c.grip_angle_rad, c.grip_offset_m)
                        * of_part.grips[scenario.grip_pose];
                    let gel = &project.twin.gel[jaw];
                    let window =
                        Window { half_width_m: gel.width_m / 2.0, half_height_m: gel.height_m / 2.0 };
                    let met = |fine| rays_meet_mm(&part, jaw, &world_from_mesh, window, fine);
                    // A corner that a pad meets may lie between two rays.
                    let met_mm = Some(met(1)).filter(|met| (stands_mm - met).abs() < 0.05);
                    let met_mm = met_mm.unwrap_or_else(|| met(10));
                    worst_mm = worst_mm.max((stands_mm - met_mm).abs());
                    assert!(
                        (stands_mm - met_mm).abs() < 0.2,
                        "{}, sample {index}, {jaw} jaw: stands at {stands_mm:.3} mm, rays meet the part at {met_mm:.3} mm",
                        part.name
                    );
                }
            }
        }
        println!(
            "{}: {} grips, {} failed, within {worst_mm:.3} mm",
            part.name,
            made.parts[0].grips.len(),
            failed.len()
        );
        assert!(failed.len() <= 4, "{}: {} of 200 failed: {}", part.name, failed.len(), failed[0]);
    }
}

/// Both mechanics and the sum of the patch limits, on parts whose hull is not what the pads touch.
#[test]
#[ignore = "slow: the whole robot in Rapier for five parts"]
fn both_mechanics_agree_where_the_part_is_not_convex() {
    let quiet = [("wrist.noise_n", "0"), ("images", "none"), ("trace", "none"), ("samples", "12")];
    for part in ordinary().into_iter().filter(|p| p.name != "ball") {
        let folder = tempfile::tempdir().unwrap();
        start(&part, folder.path()).unwrap();
        let scatter = format!("parts.{}.scatter", part.name);
        let sets = |mechanics| [&quiet[..], &[("mechanics", mechanics), (&scatter, "0")]].concat();
        let (rapier, reduced) =
            (project_in(folder.path(), &sets("rapier")), project_in(folder.path(), &sets("reduced")));
        let mut compared = 0;
        for index in 0..12 {
            let (Ok(a), Ok(b)) = (pulled(&rapier, index), pulled(&reduced, index)) else {
                panic!("{}, sample {index}: {:?}", part.name, pulled(&rapier, index).err());
            };
            // Grips by the edge of a pad are apart: the engine's pad meets the slope beside it.
            let by_the_edge = b.imprint.iter().any(|(jaw, imprint)| {
                let (gel, (x, y)) = (&reduced.twin.gel[jaw], imprint.patch.centre_m());
                x.abs() > 0.3 * gel.width_m || y.abs() > 0.3 * gel.height_m
            });
            if by_the_edge {
                continue;
            }
            compared += 1;
            let force_n = rapier.sweep.scenario(index, &rapier.twin).0.grip_force_n;
            let limit_n = 2.0 * 0.15 * force_n;
            let (x, y) = (a.label.max_pull_force_n, b.label.max_pull_force_n);
            assert!((x / y - 1.0).abs() < 0.01, "{}, sample {index}: {x} N and {y} N", part.name);
            assert!((x / limit_n - 1.0).abs() < 0.005, "{}, sample {index}: {x} N of {limit_n} N", part.name);
        }
        assert!(compared >= 6, "{}: {compared} of 12 compared", part.name);
    }
}

/// Four proposals are four grips: the shank and the head of a screw, not one of them four times.
#[test]
fn proposals_differ_and_local_features_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let all = ordinary();
    let of = |name: &str| {
        start(all.iter().find(|p| p.name == name).unwrap(), folder.path()).unwrap().parts.remove(0).grips
    };
    let screw = of("m8_screw");
    let has = |width: f64| screw.iter().any(|g| (g.width_mm - width).abs() < 0.2);
    assert!(has(8.0) && has(13.0), "{screw:?}");
    assert!(of("flange_shaft").iter().any(|g| (g.width_mm - 8.0).abs() < 0.2));
    assert!(of("l_bracket").iter().any(|g| (g.width_mm - 4.0).abs() < 0.1));
}

/// A nut M8: 13 mm across its flats, 6.8 mm high, with a bore of 8 mm.
fn nut() -> TriMesh {
    const AROUND: u32 = 48;
    let (sixth, high_m) = (std::f64::consts::FRAC_PI_3, 3.4e-3);
    // Radius of the hexagon and of the bore at the k-th angle, at both ends.
    let vertex = |k: u32, inside: bool, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(k % AROUND) / f64::from(AROUND);
        let from_flat = (angle % sixth) - 0.5 * sixth;
        let radius = if inside { 4e-3 } else { 6.5e-3 / from_flat.cos() };
        Point3::new(radius * angle.cos(), radius * angle.sin(), z)
    };
    let rings = [(false, -high_m), (false, high_m), (true, high_m), (true, -high_m)];
    let vertices = rings.iter().flat_map(|&(inside, z)| (0..AROUND).map(move |k| vertex(k, inside, z)));
    let quads = (0..4).flat_map(|ring| {
        let at = move |ring: u32, k: u32| ring % 4 * AROUND + k % AROUND;
        (0..AROUND).map(move |k| [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)])
    });
    let triangles = quads.flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    TriMesh::new(vertices.collect(), triangles.collect()).unwrap()
}

/// Jaws take a nut by its faces and across its flats: another pair of faces is worth more than the same pair a little farther along.
#[test]
fn a_nut_is_proposed_by_its_faces_and_across_its_flats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nut.stl");
    std::fs::write(&path, write_binary_stl(&nut(), "nut", 1e-3)).unwrap();
    let made = part_starter(&[(&path, OPTIONS)], folder.path()).unwrap();
    let widths: Vec<f64> = made.parts[0].grips.iter().map(|g| g.width_mm).collect();
    for wanted_mm in [6.8, 13.0] {
        assert!(widths.iter().any(|w| (w - wanted_mm).abs() < 0.2), "{widths:?}");
    }
}

/// A part without a grip is refused with the reason and both numbers.
#[test]
fn a_part_without_a_grip_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let hinted = |name, solid| {
        let error = start(&SolidPart { name, solids: vec![solid] }, folder.path()).unwrap_err();
        let hint = error.hint(OPTIONS.scale_mm_per_unit);
        match error {
            InitError::NoGrip { source, .. } => (source, hint),
            other => panic!("{name}: {other}"),
        }
    };
    let (wide, hint) = hinted("wide", Solid::Box([0.0; 3], [150.0, 140.0, 130.0]));
    assert!(
        matches!(wide, NoGrip::TooWide { narrowest_mm, opening_mm, .. } if (narrowest_mm - 130.0).abs() < 0.1 && opening_mm == 110.0),
        "{wide}"
    );
    assert!(hint.contains("opening_mm") && !hint.contains("metres"), "the unit is right: {hint}");
    let (small, hint) = hinted("small", Solid::Ball([0.0; 3], 1.0));
    assert!(hint.contains("--scale-mm-per-unit 25.4"), "{hint}");
    assert!(
        matches!(small, NoGrip::TooDeep { wanted_mm3, available_mm3, .. } if available_mm3 < wanted_mm3 && (wanted_mm3 - 15.0).abs() < 0.05),
        "{small}"
    );
    // What is steep all around may still have a place.
    let cone = SolidPart { name: "cone", solids: vec![Solid::Cone(20.0, 40.0)] };
    assert!(!start(&cone, folder.path()).unwrap().parts[0].grips.is_empty());
}

/// A mesh with holes is refused with their number, or taken when that is asked for, and `check` says so.
#[test]
fn an_open_mesh_is_refused_unless_it_is_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("open.stl");
    let mesh = SolidPart { name: "open", solids: vec![Solid::Ball([0.0; 3], 15.0)] }.mesh();
    let kept = mesh.triangles()[1..].to_vec();
    let open = TriMesh::new(mesh.vertices_m().to_vec(), kept).unwrap();
    std::fs::write(&path, write_binary_stl(&open, "open", 1e-3)).unwrap();
    let error = part_starter(&[(&path, OPTIONS)], folder.path()).unwrap_err();
    assert!(matches!(error, InitError::Open { open_edges: 3, .. }), "{error}");
    let accepted = PartOptions { accept_open_mesh: true, ..OPTIONS };
    let made = part_starter(&[(&path, accepted)], folder.path()).unwrap();
    assert!(made.parts[0].mesh_words.iter().any(|w| w.contains("3 edges")), "{:?}", made.parts[0].mesh_words);
    for file in &made.files {
        std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
    }
    let plan = plan(&project_in(folder.path(), &BARE), SimdLevel::best()).unwrap();
    assert_eq!(plan.open_meshes, [("open".to_string(), 3)]);
}

/// `check` tries the outermost samples: those it warns of fail in the sweep, and a sweep that fails is warned of.
#[test]
fn check_warns_of_grips_that_fail() {
    let folder = tempfile::tempdir().unwrap();
    let all = ordinary();
    start(all.iter().find(|p| p.name == "flange_shaft").unwrap(), folder.path()).unwrap();
    let sound = plan(&project_in(folder.path(), &BARE), SimdLevel::best()).unwrap();
    assert!(sound.grips.iter().all(|g| g.failed.is_empty() && g.tried >= 4), "{:?}", sound.grips);
    // Grips that may miss are samples like others; those that always miss the end of the shaft are a mistake.
    let with = |offset_mm| {
        let project = project_in(folder.path(), &[&BARE[..], &[("vary.grip_offset_mm", offset_mm)]].concat());
        let plan = plan(&project, SimdLevel::best()).unwrap();
        let warned: Vec<(u64, String)> = plan.grips.iter().flat_map(|g| g.failed.clone()).collect();
        for (index, _) in &warned {
            assert!(pulled(&project, *index).is_err(), "sample {index} works");
        }
        warned
    };
    let misses = |(_, reason): &(u64, String)| reason.contains("miss the part");
    assert!(!with("{ normal = [0, 25] }").iter().any(misses));
    let beyond = with("{ uniform = [150, 160] }");
    assert!(!beyond.is_empty() && beyond.iter().all(misses), "{beyond:?}");
}

/// The same part gives the same files for any number of threads.
#[test]
fn proposals_do_not_depend_on_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = ordinary()[1].write(folder.path());
    let make = |threads| part_starter(&[(&path, PartOptions { threads, ..OPTIONS })], folder.path()).unwrap();
    assert_eq!(make(1), make(3));
}

/// Which way faces look does not matter: a mesh that is inside out, or of which every third face is, gets the same grips.
#[test]
fn turned_faces_change_no_grip() {
    let folder = tempfile::tempdir().unwrap();
    let all = ordinary();
    let mesh = all.iter().find(|p| p.name == "t_profile").unwrap().mesh();
    let grips = |every: usize| {
        let turn = |(i, &[a, b, c]): (usize, &[u32; 3])| {
            if every > 0 && i % every == 0 { [a, c, b] } else { [a, b, c] }
        };
        let triangles = mesh.triangles().iter().enumerate().map(turn).collect();
        let turned = TriMesh::new(mesh.vertices_m().to_vec(), triangles).unwrap();
        let path = folder.path().join("turned.stl");
        std::fs::write(&path, write_binary_stl(&turned, "turned", 1e-3)).unwrap();
        let made = part_starter(&[(&path, OPTIONS)], folder.path()).unwrap();
        let part = made.parts.into_iter().next().unwrap();
        (part.grips, part.mesh_words)
    };
    let (plain, inside_out, mixed) = (grips(0), grips(1), grips(3));
    assert!((plain.0[0].width_mm - 4.0).abs() < 0.1 && plain.0.len() > 1, "{plain:?}");
    for turned in [&inside_out, &mixed] {
        assert_eq!(turned.0.len(), plain.0.len());
        for (grip, of_plain) in turned.0.iter().zip(&plain.0) {
            let moved = (0..3).map(|i| (grip.origin_mm[i] - of_plain.origin_mm[i]).abs()).fold(0.0, f64::max);
            let apart = (grip.lever_mm - of_plain.lever_mm).abs();
            assert!(moved < 0.02 && apart < 0.02, "{grip:?} instead of {of_plain:?}");
        }
    }
    assert!(inside_out.1.iter().any(|w| w.contains("inside out")), "{:?}", inside_out.1);
    assert!(mixed.1.iter().any(|w| w.contains("opposite ways")), "{:?}", mixed.1);
}

/// A grip that works and is doubtful is warned of with both numbers; one of an ordinary part is not.
#[test]
fn grips_deep_in_the_gel_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let ball = SolidPart { name: "ball4", solids: vec![Solid::Ball([0.0; 3], 2.0)] };
    let made = start(&ball, folder.path()).unwrap();
    assert_eq!(made.parts[0].doubts.len(), made.parts[0].grips.len());
    assert!(
        made.parts[0].doubts[0].iter().any(|w| w.contains("into 4.0 mm of gel, deeper than half")),
        "{:?}",
        made.parts[0].doubts
    );
    assert!(
        made.parts[0].doubts[0].iter().any(|w| w.contains("the gels meet")),
        "{:?}",
        made.parts[0].doubts
    );
    assert!(made.summary.contains("warning: grip 0: "), "{}", made.summary);
    let all = ordinary();
    let bracket = start(all.iter().find(|p| p.name == "l_bracket").unwrap(), folder.path()).unwrap();
    assert!(bracket.parts[0].doubts.iter().all(Vec::is_empty), "{:?}", bracket.parts[0].doubts);
}
