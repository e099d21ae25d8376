//! Pixels beside steps, as a press draws them.

use super::{ClusteredMesh, HeightMap};
use crate::convolve::Area;
use crate::grid::Grid;
use crate::grid::Plane;
use crate::indent::{Indentation, PressedGel};
use crate::simd::SimdLevel;
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;
use nalgebra::Point3;

const GRID: Grid = Grid { width_px: 150, height_px: 90, metres_per_px: 1e-4 };

/// A block with vertical walls whose outline, in pixels from the middle of the image, is given.
fn block(outline: [(f64, f64); 4]) -> TriMesh {
    let at = |(x, y): (f64, f64), z_m: f64| Point3::new(x * 1e-4, y * 1e-4, z_m);
    let corners = [0.0, 4e-3].map(|z_m| outline.map(|p| at(p, z_m))).concat();
    let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
    for i in 0..4 {
        let j = (i + 1) % 4;
        triangles.extend([[i, i + 4, j + 4], [i, j + 4, j]]);
    }
    TriMesh::new(corners, triangles).unwrap()
}

fn press(mesh: &TriMesh, force_n: f64) -> (Plane, f64) {
    let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
    let mesh = ClusteredMesh::new(mesh);
    let mut map = HeightMap::default();
    map.start(&mesh, &Pose::identity(), &GRID);
    let press = Indentation { grid: &GRID, gel: &gel, force_n, rest: None, level: SimdLevel::best() };
    let imprint = press.sink(&mut map, &mesh).unwrap();
    (imprint.depth_px, imprint.press_depth_m / GRID.metres_per_px)
}

/// Each row of a contact is as wide as the body there, to a ninth of a pixel and not to half of one.
#[test]
fn a_slanted_wall_stands_where_it_is_between_the_pixels() {
    let wall = |y: f64| 30.2 + 0.11 * y;
    let mesh = block([(-40.3, -35.0), (wall(-35.0), -35.0), (wall(35.0), 35.0), (-40.3, 35.0)]);
    let (depth, press_px) = press(&mesh, 15.0);
    let mut sum = 0.0;
    for row in 15..75 {
        let width = depth.row(row).iter().map(|&d| f64::from(d) / press_px).sum::<f64>();
        let off = width - (wall(row as f64 - 44.5) + 40.3);
        assert!(off.abs() < 0.25, "row {row}: {off} px");
        sum += off / 60.0;
    }
    // The left wall is at one place for all rows, a third of a pixel at most from where it is.
    assert!(sum.abs() < 0.2, "{sum} px on average");
}

/// V = c F holds with the points, wherever the walls lie.
#[test]
fn the_imprint_has_the_volume_of_its_force() {
    for shift in [0.0, 0.2, 0.45, 0.7] {
        let (x, y) = (10.0 + shift, 8.0 + 0.5 * shift);
        let mesh = block([(-10.0, -8.0), (x, -8.0), (x, y), (-10.0, y)]);
        let (depth, press_px) = press(&mesh, 4.0);
        let volume: f64 = depth.values.iter().map(|&d| f64::from(d)).sum();
        assert!((volume / 4000.0 - 1.0).abs() < 1e-5, "{shift}: {volume} px3");
        let exact = 4000.0 / ((x + 10.0) * (y + 8.0));
        assert!((press_px / exact - 1.0).abs() < 0.025, "{shift}: {press_px} px, not {exact}");
    }
}

/// What is deeper on both sides alike has no step, and keeps the bits of its centres.
#[test]
fn a_slope_has_no_points() {
    let mut map = HeightMap::default();
    map.start(
        &ClusteredMesh::new(&block([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])),
        &Pose::identity(),
        &GRID,
    );
    let area = Area::whole(GRID.width_px, GRID.height_px);
    let plane = |per_px: f32| Plane::from_fn(GRID.width_px, GRID.height_px, |x, _| per_px * x as f32);
    assert!(!map.find_steps(&plane(0.45), area, SimdLevel::best()));
    assert!(map.find_steps(&plane(0.6), area, SimdLevel::best()));
    let weights = map.steps.weights();
    assert_eq!(weights.len(), GRID.len());
    assert!(weights.iter().all(|w| (w - 0.2).abs() < 1e-4));
}
