//! Jaws on parts whose convex hull is not what the pads meet.

use crate::grip::Grip;
use crate::setup::GripError;
use crate::shape::PartShape;
use crate::surface::Surface;
use crate::tests::Bench;
use gripgen_twin::config::Mechanics;
use gripgen_twin::frames::{Pose, pose, rotation_about_axis};
use gripgen_twin::parts::benchmark::{FAMILIES, variant};
use gripgen_twin::parts::{BallBearing, InvoluteGear, RollerBearing, SteppedShaft};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Jaw, TriMesh};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

/// Boxes in millimetres, each by its middle and its sides.
fn boxes(boxes: &[([f64; 3], [f64; 3])]) -> PartShape {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (middle, sides) in boxes {
        let first = vertices.len() as u32;
        vertices.extend((0..8).map(|i| {
            let at = |b: usize| (middle[b] + (f64::from(i >> b & 1) - 0.5) * sides[b]) * 1e-3;
            Point3::new(at(0), at(1), at(2))
        }));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        triangles.extend(
            quads
                .iter()
                .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
                .map(|t: [u32; 3]| t.map(|v| v + first)),
        );
    }
    let surface = Surface::new(Arc::new(TriMesh::new(vertices, triangles).unwrap()));
    PartShape::of_surface(Arc::new(surface), &Pose::identity()).unwrap()
}

/// A leg 4 mm thick across the jaws, with a foot that reaches 50 mm to the left, 30 mm below the pads.
fn bracket() -> PartShape {
    boxes(&[([0.0, 0.0, 0.0], [40.0, 4.0, 80.0]), ([0.0, 27.0, -38.0], [40.0, 50.0, 4.0])])
}

fn distances_mm(bench: &Bench) -> [f64; 2] {
    let held = bench.held();
    Jaw::BOTH.map(|jaw| held.grasp.gel_from_part[jaw].translation.z * 1e3)
}

/// The hull of the bracket bridges leg and foot; the jaws stop at the leg, in both mechanics.
#[test]
fn jaws_stop_at_the_surface_and_not_at_the_hull() {
    for mechanics in [Mechanics::Reduced, Mechanics::Rapier] {
        let mut bench = Bench::new(bracket(), 40.0);
        bench.mechanics = mechanics;
        let [left, right] = distances_mm(&bench);
        assert!(
            (left - 2.0).abs() < 0.01 && (right - 2.0).abs() < 0.01,
            "{mechanics:?}: {left} and {right} mm"
        );
    }
}

/// Plates carry the grip force along the jaw axis: the jaws slip at `2 mu F_G` on a leg, on a slope, on an edge and on two bodies.
#[test]
fn plates_slip_at_twice_mu_times_grip_force() {
    let wedge = {
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z) * 1e-3;
        let corners = [[-40.0, 2.0], [40.0, 12.0], [40.0, -12.0], [-40.0, -2.0]];
        let ends = [-30.0, 30.0].map(|z| corners.map(|[x, y]| p(x, y, z)));
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
        for i in 0..4_u32 {
            let j = (i + 1) % 4;
            triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
        }
        let mesh = TriMesh::new(ends.concat(), triangles).unwrap();
        PartShape::of_surface(Arc::new(Surface::new(Arc::new(mesh))), &Pose::identity()).unwrap()
    };
    let two = boxes(&[([-20.0, 0.0, 0.0], [30.0, 8.0, 40.0]), ([20.0, 10.0, 0.0], [6.0, 40.0, 40.0])]);
    let thin = boxes(&[([0.0, 0.0, 0.0], [40.0, 0.2, 60.0]), ([0.0, 20.0, 34.0], [40.0, 40.0, 8.0])]);
    for (name, shape) in [("bracket", bracket()), ("wedge", wedge), ("two bodies", two), ("sheet", thin)] {
        for (mu, force_n) in [(0.15, 5.0), (0.15, 40.0), (0.6, 80.0)] {
            let ideal = 2.0 * mu * force_n;
            let bench = Bench::new(shape.clone(), force_n);
            let label = bench.label_n(mu);
            assert!(
                (label / ideal - 1.0).abs() < 5e-3,
                "{name}, mu {mu}, {force_n} N: {label:.4} N instead of {ideal} N"
            );
            for (jaw, normal_n) in bench.held().grasp.normal_force_n.iter() {
                assert!((normal_n / force_n - 1.0).abs() < 1e-2, "{name}, {jaw} jaw: {normal_n} N");
            }
        }
    }
}

/// What lies behind an open jaw, in front of its pad, is in its way; what lies beside it is not.
#[test]
fn a_part_beyond_the_open_jaw_is_in_the_way_only_in_front_of_the_pad() {
    let at = |x: f64| boxes(&[([0.0, 0.0, 0.0], [20.0, 10.0, 40.0]), ([x, 60.0, 0.0], [5.0, 4.0, 5.0])]);
    let in_front = Bench::new(at(10.0), 20.0).grip().err();
    assert!(matches!(in_front, Some(GripError::TooWide { jaw: Jaw::Left, .. })), "{in_front:?}");
    assert!(
        matches!(Bench::new(at(30.0), 20.0).grip(), Ok(Grip::Held(_))),
        "18 mm beside the middle of the pad"
    );
    let beside = boxes(&[([40.0, 0.0, 0.0], [20.0, 10.0, 40.0]), ([-40.0, 0.0, 0.0], [20.0, 10.0, 40.0])]);
    assert!(
        matches!(Bench::new(beside, 20.0).grip(), Ok(Grip::NoContact)),
        "the pads fit between the bodies"
    );
}

/// The shipped parts keep their hulls: at any angle and offset both pads meet them within the tolerance of the surface.
#[test]
fn hulls_stand_for_the_shipped_parts() {
    let quarter = std::f64::consts::FRAC_PI_2;
    for (name, mesh) in [
        ("shaft", SteppedShaft::default().mesh()),
        ("gear", InvoluteGear::default().mesh()),
        ("ball bearing", BallBearing::default().mesh()),
        ("roller bearing", RollerBearing::default().mesh()),
    ] {
        let surface = Arc::new(Surface::new(Arc::new(mesh.clone())));
        for turn in [0.0, quarter] {
            if name == "shaft" && turn > 0.0 {
                continue;
            }
            let part_from_mesh = pose(&rotation_about_axis(2, turn), Vector3::zeros());
            let mut with = Bench::new(PartShape::of_surface(surface.clone(), &part_from_mesh).unwrap(), 40.0);
            let mut without = Bench::new(PartShape::hull(&mesh, &part_from_mesh).unwrap(), 40.0);
            for angle in [0.0, 0.3, 1.0, 2.0] {
                for offset in [-2e-3, 0.0, 3e-3] {
                    let placed = gripgen_twin::Part::world_from_part(angle, offset);
                    for bench in [&mut with, &mut without] {
                        bench.mechanics = Mechanics::Reduced;
                        bench.world_from_part = placed;
                    }
                    assert_eq!(
                        distances_mm(&with),
                        distances_mm(&without),
                        "{name}, turned by {turn}, angle {angle}, offset {offset}"
                    );
                }
            }
        }
    }
}

/// Parts of the benchmark, turned at random: an edge of a pad on a slope of the hull does not push the arm aside. The engine holds what the
/// reduced mechanics hold, `2 mu F_G`.
#[test]
fn turned_parts_hold_what_the_reduced_mechanics_hold() {
    let (mu, force_n, mut held) = (0.15, 20.0, 0);
    let mut apart = Vec::new();
    for family in 0..FAMILIES.len() {
        let mesh = variant(1003, family, 3);
        let (low, high) = mesh.bounds_m();
        let surface = Arc::new(Surface::new(Arc::new(mesh)));
        for number in 0..4 {
            let mut stream = Stream::new(5, 10 * family as u64 + number, Purpose::Draw);
            let turns = [0, 1, 2].map(|i| rotation_about_axis(i, std::f64::consts::TAU * stream.uniform()));
            let turn = turns[0] * turns[1] * turns[2];
            let middle =
                Vector3::from_fn(|i, _| low[i] + (high[i] - low[i]) * (0.2 + 0.6 * stream.uniform()));
            let part_from_mesh = pose(&turn, -(turn * middle));
            let shape = PartShape::of_surface(surface.clone(), &part_from_mesh).unwrap();
            let mut bench = Bench::new(shape, force_n);
            bench.mechanics = Mechanics::Reduced;
            if !matches!(bench.grip(), Ok(Grip::Held(_))) {
                continue;
            }
            held += 1;
            bench.mechanics = Mechanics::Rapier;
            let label = bench.grip().map(|_| bench.label_n(mu));
            if !label.as_ref().is_ok_and(|label| (label / (2.0 * mu * force_n) - 1.0).abs() < 5e-3) {
                apart.push(format!("{} {number}: {label:?}", FAMILIES[family].name));
            }
        }
    }
    assert!(held >= 40, "{held}");
    assert!(apart.is_empty(), "{} of {held}: {apart:#?}", apart.len());
}
