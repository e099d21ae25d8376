//! Labels of a sample: what they are read from, what they do not depend on, and which columns answer them.

use crate::common::{project, pulled};
use gripgen::tactile::{Pad, SimdLevel};
use gripgen::twin::label::forces::PullForces;
use gripgen::twin::{ContactPatch, PerJaw, Pulled};
use gripgen::{Project, drawn_scenario, press_only};

const REDUCED: &str = "mechanics=reduced";

fn forces(p: &Pulled) -> (f64, f64, f64, PerJaw<ContactPatch>) {
    let patches = p.imprint.map(|_, i| i.patch.clone());
    (p.label.max_pull_force_n, p.limit_force_n, p.mu_effective, patches)
}

fn all(project: &Project) -> Vec<(f64, f64, f64, PerJaw<ContactPatch>)> {
    (0..project.sweep.samples).step_by(23).filter_map(|i| Some(forces(&*pulled(project, i)?))).collect()
}

/// The camera of another scale sees other images of the same grips: every force and every cell is the same to the bit. Another pad is
/// another contact.
#[test]
fn labels_do_not_depend_on_the_camera_but_on_the_pad() {
    // Friction that depends on the contact's pressure.
    let with = |sets: &[&str]| {
        let twin = "twin=asset:configs/twin-contact.toml";
        project("asset:configs/quickstart.toml", &[&[twin, REDUCED][..], sets].concat())
    };
    let plain = with(&[]);
    let finer = with(&["optics.left.mm_per_px=0.05", "optics.right.mm_per_px=0.11"]);
    let (ours, theirs) = (all(&plain), all(&finer));
    assert!(ours.len() > 5);
    assert_eq!(ours, theirs);
    let images = |p: &Project| pulled(p, 23).unwrap().images.unwrap();
    assert_ne!(images(&plain).left.rgb, images(&finer).left.rgb, "the picture is that of the camera");
    let of_pad = |size: &str| {
        let sets = [format!("gel.left.width_mm={size}"), format!("gel.right.width_mm={size}")];
        all(&with(&[&sets[0], &sets[1]])).into_iter().map(|(_, limit_n, ..)| limit_n).collect::<Vec<_>>()
    };
    let limits = ["6", "10", "28"].map(of_pad);
    assert!(limits[0] != limits[1] && limits[1] != limits[2], "{limits:?}");
}

/// A picture at another scale shows the part at the same depth in the same place.
#[test]
fn the_picture_is_drawn_from_the_pose_and_depth_of_the_contact() {
    let plain = project("asset:configs/quickstart.toml", &[REDUCED]);
    let other = project(
        "asset:configs/quickstart.toml",
        &[REDUCED, "optics.left.mm_per_px=0.06", "optics.right.mm_per_px=0.06"],
    );
    for index in [0, 57, 113] {
        let press = |p: &Project| {
            let scenario = drawn_scenario(p, index);
            press_only(&p.twin, &p.library, &scenario, p.sweep.mechanics).unwrap().unwrap()
        };
        let (ours, theirs) = (press(&plain), press(&other));
        let (a, b) = (&ours.imprint.left, &theirs.imprint.left);
        assert_eq!((a.press_depth_m, &a.patch), (b.press_depth_m, &b.patch));
        let (coarse, fine) = (ours.sensors.left.grid, theirs.sensors.left.grid);
        let deepest = |i: &gripgen::tactile::Imprint, a: f64| {
            f64::from(i.depth_px.values.iter().fold(0.0f32, |m, &d| m.max(d))) * a
        };
        let depths_m = [deepest(a, coarse.metres_per_px), deepest(b, fine.metres_per_px)];
        assert!((depths_m[0] / depths_m[1] - 1.0).abs() < 0.02, "{depths_m:?}");
        // The contact that both see covers the same area of the gel, to the pixels at its rim.
        let (half_w, half_h) = (0.5 * 320.0 * 6e-5, 0.5 * 240.0 * 6e-5);
        let area_m2 = |i: &gripgen::tactile::Imprint, grid: gripgen::tactile::Grid| {
            let touched = |&k: &usize| {
                let (x, y) = grid.centre_m(k % grid.width_px, k / grid.width_px);
                i.depth_px.values[k] > 0.0 && x.abs() < half_w && y.abs() < half_h
            };
            (0..grid.len()).filter(touched).count() as f64 * grid.metres_per_px * grid.metres_per_px
        };
        let areas = [area_m2(a, coarse), area_m2(b, fine)];
        assert!((areas[0] / areas[1] - 1.0).abs() < 0.05, "{areas:?}");
    }
}

/// Whatever a camera of the pad's own pixels sees is the contact itself.
#[test]
fn a_camera_of_the_pads_pixels_sees_the_contact() {
    let p = project("asset:configs/quickstart.toml", &[REDUCED]);
    let grid = Pad { gel: &p.twin.gel.left, level: SimdLevel::best() }.grid();
    assert_eq!((grid.width_px, grid.height_px), (320, 240));
    let found = pulled(&p, 0).unwrap();
    let press = press_only(&p.twin, &p.library, &drawn_scenario(&p, 0), p.sweep.mechanics).unwrap().unwrap();
    assert_eq!(press.imprint.left.patch, found.imprint.left.patch);
}

/// Without noise the peak is the limit to a part of a step, the friction of sliding jaws is the kinetic share of it, and slip begins
/// before it is whole.
#[test]
fn peak_and_sliding_friction_are_those_that_the_contact_has() {
    for mechanics in [REDUCED, "mechanics=rapier"] {
        let sets = [
            mechanics,
            "images=none",
            "wrist.noise_n=0",
            "parts.gear.kinetic_ratio=0.8",
            "parts.long_shaft.kinetic_ratio=0.8",
            "parts.ball_bearing.kinetic_ratio=0.8",
            "parts.roller_bearing.kinetic_ratio=0.8",
        ];
        let whole = project("asset:configs/quickstart.toml", &sets);
        let short = project("asset:configs/quickstart.toml", &[&sets[..], &["trace=none"]].concat());
        for index in [3, 61, 140] {
            let (long, short) = (pulled(&whole, index).unwrap(), pulled(&short, index).unwrap());
            let PullForces { peak_force_n: Some(peak_n), kinetic_force_n: Some(kinetic_n), .. } = long.forces
            else {
                panic!("{:?}", long.forces)
            };
            let limit_n = long.limit_force_n;
            assert!((peak_n / limit_n - 1.0).abs() < 0.02, "{mechanics}, {index}: {peak_n} of {limit_n} N");
            assert!(
                (kinetic_n / (0.8 * limit_n) - 1.0).abs() < 0.05,
                "{mechanics}, {index}: {kinetic_n} of {limit_n}"
            );
            let (onset_s, slip_s) = (long.slip_onset_s.unwrap(), long.slip_s.unwrap());
            assert!(0.0 < onset_s && onset_s <= slip_s && slip_s <= long.forces.left_s.unwrap());
            // A pull that ends as soon as its numbers are known has the same.
            assert_eq!((long.forces, long.slip_s, &long.label), (short.forces, short.slip_s, &short.label));
            assert!(short.trace.len() < long.trace.len());
        }
    }
}
