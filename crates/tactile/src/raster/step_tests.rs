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
    let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };
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

fn found(depth: impl Fn(usize, usize) -> f32) -> Vec<f32> {
    let mut map = HeightMap::default();
    map.area = Area::whole(GRID.width_px, GRID.height_px);
    let values = (0..GRID.len()).map(|i| depth(i % GRID.width_px, i / GRID.width_px)).collect();
    let plane = Plane { values, ..Plane::filled(GRID.width_px, GRID.height_px, 0.0) };
    let some = map.find_steps(&plane, SimdLevel::best());
    assert_eq!(some, !map.steps.weights().is_empty());
    map.steps.weights().to_vec()
}

/// The mean of a slope is at its centre, also where it begins: neither has points, and both keep the bits of their centres.
#[test]
fn a_slope_has_no_points() {
    for per_px in [0.45, 0.6, 3.0] {
        assert!(found(|x, _| per_px * x as f32).is_empty(), "{per_px}");
        assert!(found(|x, y| per_px * (x + 2 * y).saturating_sub(120) as f32).is_empty(), "{per_px}");
    }
}

/// The two pixels beside a wall have points, and count the more the higher it is; a ridge of one pixel is two walls.
#[test]
fn walls_and_ridges_have_points() {
    for (height, weight) in [(0.45, None), (0.75, Some(0.5)), (8.0, Some(1.0))] {
        let wall = found(|x, _| if x < 70 { height } else { 0.0 });
        let down = found(|_, y| if y < 40 { 0.0 } else { height });
        assert_eq!(wall.len(), weight.map_or(0, |_| 2 * GRID.height_px), "{height}");
        assert_eq!(down.len(), weight.map_or(0, |_| 2 * GRID.width_px), "{height}");
        assert!(wall.iter().chain(&down).all(|w| Some(*w) == weight), "{height}");
    }
    assert_eq!(found(|x, y| if x == y { 4.0 } else { 0.0 }).len(), 3 * GRID.height_px - 1);
    // On a slope, too.
    assert_eq!(found(|x, _| 0.8 * x as f32 + if x < 70 { 3.0 } else { 0.0 }).len(), 2 * GRID.height_px);
}
