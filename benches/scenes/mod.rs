//! A part for the tactile benchmarks.

use gripgen::twin::TriMesh;
use gripgen::twin::frames::{Pose, pose, rotation_from_fixed_xyz};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Rings of the ball: 4 x 112^2 = 50,176 triangles.
const RINGS: usize = 112;

/// A ball of 9.6 mm radius with bumps of 1 % of it, of some 50,000 triangles.
pub fn bumpy_ball() -> TriMesh {
    let around = 2 * RINGS;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=RINGS {
        for j in 0..around {
            let (p, a) = (PI * i as f64 / RINGS as f64, PI * j as f64 / RINGS as f64);
            let radius = 9.6e-3 * (1.0 + 0.01 * (9.0 * p).sin() * (12.0 * a).cos());
            vertices.push(Point3::new(p.sin() * a.cos(), p.cos(), p.sin() * a.sin()) * radius);
        }
    }
    for i in 0..RINGS {
        for j in 0..around {
            let corner = |i: usize, j: usize| (i * around + j % around) as u32;
            let (a, b, c, d) = (corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j));
            triangles.push([a, d, c]);
            triangles.push([a, c, b]);
        }
    }
    TriMesh::new(vertices, triangles).expect("a ball is a mesh")
}

/// Where it meets the gel with its side, somewhat turned.
pub fn gel_from_ball() -> Pose {
    pose(&rotation_from_fixed_xyz([0.3, 0.2, 0.1]), Vector3::new(0.0, 0.0, 9.6e-3))
}

/// Its press.
pub const FORCE_N: f64 = 20.0;
/// Imprint constant of a metal part.
pub const IMPRINT_M3_PER_N: f64 = 1.5e-9;
