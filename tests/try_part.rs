//! `try`: what the page shows is what a sweep makes, and what is said to fail fails.

use crate::common::project_in;
use crate::solids::{Solid, SolidPart, ordinary};
use gripgen::generate;
use gripgen::tactile::SimdLevel;
use gripgen::twin::{Jaw, Outcome};
use gripgen_cli::{PartOptions, TryOptions, TryPartError, part_starter, rasterise, try_part};
use gripgen_report::{TriedPart, tried_page, tried_picture};
use std::path::Path;

const PART: PartOptions =
    PartOptions { scale_mm_per_unit: 1.0, accept_open_mesh: false, mu: None, threads: 2 };

fn options() -> TryOptions {
    TryOptions { part: PART, grip: None, force_n: None, sensor: None }
}

fn solid(name: &str) -> SolidPart {
    ordinary().into_iter().find(|part| part.name == name).unwrap()
}

/// A sweep as `init` writes it, without noise, with one grip at one force.
fn sample(folder: &Path, name: &str, grip: usize, sets: &[(&str, &str)]) -> Outcome {
    let own = [
        ("mechanics", "reduced"),
        ("wrist.noise_n", "0"),
        ("optics.left.image_noise", "off"),
        ("optics.right.image_noise", "off"),
    ];
    let (grip, scatter) = (format!("[{grip}]"), format!("parts.{name}.scatter"));
    let fixed = [("vary.grip_pose", grip.as_str()), (scatter.as_str(), "0")];
    generate(&project_in(folder, &[&own[..], &fixed, sets].concat()), 0, SimdLevel::best()).outcome
}

/// The gel of the shipped baseline, on which grips are tried, in place of the softer ones that a sweep of `init` draws.
const TRIED_GEL: [(&str, &str); 6] = [
    ("robot.model", "ur5e"),
    ("priors", "[]"),
    ("gel.left.thickness_mm", "4.0"),
    ("gel.left.stiffens", "false"),
    ("gel.right.thickness_mm", "4.0"),
    ("pull.step_s", "0.104"),
];

/// Images and pull of each grip are those of a sweep over the files that `init` writes, and the pull is that of Coulomb's law for two jaws.
#[test]
fn what_is_shown_is_what_a_sweep_makes() {
    let folder = tempfile::tempdir().unwrap();
    let part = solid("l_bracket");
    let mesh = part.write(folder.path());
    for file in part_starter(&[(&mesh, PART)], folder.path()).unwrap().files {
        std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
    }
    let tried = try_part(&mesh, &options()).unwrap();
    assert!(!tried.grips.is_empty());
    for grip in &tried.grips {
        let middle =
            [("vary.grip_force_n", "[20]"), ("vary.grip_offset_mm", "[0]"), ("vary.grip_angle_deg", "[0]")];
        let sets = [&TRIED_GEL[..], &middle].concat();
        let Outcome::Pulled(pulled) = sample(folder.path(), part.name, grip.grip_pose, &sets) else {
            panic!("grip {}", grip.grip_pose)
        };
        let images = pulled.images.unwrap();
        assert_eq!(grip.force_n, 20.0);
        assert!(Jaw::BOTH.iter().all(|&jaw| images[jaw] == grip.images[jaw]), "grip {}", grip.grip_pose);
        for holding in &grip.holding {
            let [low, value, high] = *holding.max_pull_force_n.as_ref().unwrap();
            for (pull_n, mu) in [(low, tried.mu.low), (value, tried.mu.value), (high, tried.mu.high)] {
                let limit_n = 2.0 * mu * holding.grip_force_n;
                assert!((pull_n / limit_n - 1.0).abs() < 5e-3, "{pull_n} N of {limit_n} N");
            }
        }
        let at_20 = grip.holding.iter().find(|h| h.grip_force_n == 20.0).unwrap();
        let expected_n = at_20.max_pull_force_n.as_ref().unwrap()[1];
        assert!((pulled.label.max_pull_force_n - expected_n).abs() < 1e-9);
    }
}

/// Where a grip is said to fail a sweep fails, where it is said to work it works, and the sentences name every such place.
#[test]
fn what_is_said_to_fail_fails() {
    let (mut failing, mut working) = (0, 0);
    let small = [("pin", Solid::Ring(0.0, 0.6, -5.0, 5.0)), ("bead", Solid::Ball([0.0; 3], 1.5))];
    for part in small.map(|(name, solid)| SolidPart { name, solids: vec![solid] }) {
        let (folder, name) = (tempfile::tempdir().unwrap(), part.name);
        let mesh = part.write(folder.path());
        for file in part_starter(&[(&mesh, PART)], folder.path()).unwrap().files {
            std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
        }
        for grip in try_part(&mesh, &options()).unwrap().grips {
            let narrow = grip.works.iter().filter(|w| w.largest_n < 40.0).count();
            assert_eq!(narrow == 0, grip.fails.is_empty(), "{name}: {:?}", grip.fails);
            for place in grip.works.iter().step_by(5) {
                let fixed = |force_n: f64| {
                    let (force, offset, angle) = (
                        format!("[{force_n}]"),
                        format!("[{}]", place.grip_offset_mm),
                        format!("[{}]", place.grip_angle_deg),
                    );
                    let sets = [
                        ("vary.grip_force_n", force.as_str()),
                        ("vary.grip_offset_mm", offset.as_str()),
                        ("vary.grip_angle_deg", angle.as_str()),
                        ("images", "none"),
                    ];
                    let sets = [&TRIED_GEL[..], &sets].concat();
                    matches!(sample(folder.path(), part.name, grip.grip_pose, &sets), Outcome::Pulled(_))
                };
                if place.largest_n > 0.0 {
                    working += 1;
                    assert!(fixed(place.largest_n), "{name}, grip {}: {place:?}", grip.grip_pose);
                }
                if place.largest_n < 40.0 {
                    failing += 1;
                    let next_n = [10.0, 20.0, 40.0].into_iter().find(|&n| n > place.largest_n).unwrap();
                    assert!(!fixed(next_n), "{name}, grip {}: {place:?}", grip.grip_pose);
                }
            }
        }
    }
    assert!(failing >= 5 && working >= 30, "{failing} places fail, {working} work");
}

/// A measured friction narrows what is expected; grips and forces that are not there are refused with both numbers.
#[test]
fn options_do_what_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = solid("l_bracket").write(folder.path());
    let part = PartOptions { mu: Some(0.4), ..PART };
    let asked = TryOptions { part, grip: Some(0), force_n: Some(12.0), ..options() };
    let tried = try_part(&mesh, &asked).unwrap();
    assert_eq!((tried.grips.len(), tried.grips[0].force_n), (1, 12.0));
    let at = tried.grips[0].holding.iter().find(|h| h.grip_force_n == 12.0).unwrap();
    let [low, value, high] = *at.max_pull_force_n.as_ref().unwrap();
    assert!((value - 9.6).abs() < 0.05 && low > 0.9 * value && high < 1.1 * value, "{low} {value} {high}");
    let page = |part: &TriedPart| tried_page(part, &rasterise);
    let picture = |part: &TriedPart| tried_picture(part, &rasterise);
    assert_eq!(page(&try_part(&mesh, &asked).unwrap()), page(&tried));
    let one_thread = TryOptions { part: PartOptions { threads: 1, ..part }, ..asked.clone() };
    assert_eq!(picture(&try_part(&mesh, &one_thread).unwrap()), picture(&tried));
    let none = try_part(&mesh, &TryOptions { grip: Some(9), ..options() });
    assert!(matches!(none, Err(TryPartError::NoSuchGrip { asked: 9, .. })));
    let strong = try_part(&mesh, &TryOptions { force_n: Some(500.0), ..options() });
    assert!(matches!(strong, Err(TryPartError::Force { asked_n: 500.0, most_n: 80.0 })));
    // The shipped sensor by its name is the one that nobody named.
    let named = TryOptions { sensor: Some("asset:sensors/gelsight_r15/sensor.npz".into()), ..asked };
    assert_eq!(try_part(&mesh, &named).unwrap().grips[0].images, tried.grips[0].images);
}
