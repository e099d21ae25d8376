//! Parts for tests, twice: as meshes, and as the formulas of what they are.

use gripgen::twin::{TriMesh, write_binary_stl};
use nalgebra::{Point3, Vector3};
use std::path::{Path, PathBuf};

/// A body of lengths in millimetres.
#[derive(Debug, Clone, Copy)]
pub enum Solid {
    /// Middle and sides.
    Box([f64; 3], [f64; 3]),
    /// About the z axis: inner and outer radius, lower and upper end. An inner radius of 0 has no bore.
    Ring(f64, f64, f64, f64),
    /// Middle and radius.
    Ball([f64; 3], f64),
    /// About the z axis, from this radius at 0 to a tip at this height.
    Cone(f64, f64),
}

impl Solid {
    pub fn holds(&self, p: Point3<f64>) -> bool {
        let radius = p.x.hypot(p.y);
        match *self {
            Solid::Box(middle, sides) => (0..3).all(|i| (p[i] - middle[i]).abs() <= sides[i] / 2.0),
            Solid::Ring(inner, outer, low, high) => {
                (low..=high).contains(&p.z) && radius <= outer && radius >= inner
            }
            Solid::Ball(middle, r) => (p - Point3::from(middle)).norm() <= r,
            Solid::Cone(base, height) => p.z >= 0.0 && radius <= base * (1.0 - p.z / height),
        }
    }

    /// Corners and triangles, counter-clockwise seen from outside.
    fn mesh(&self) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        match *self {
            Solid::Box(m, s) => {
                let vertices = (0..8).map(|i| {
                    let side = |b: usize| if i >> b & 1 == 1 { 0.5 } else { -0.5 };
                    Point3::new(m[0] + side(0) * s[0], m[1] + side(1) * s[1], m[2] + side(2) * s[2])
                });
                let quads =
                    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
                let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                (vertices.collect(), triangles.collect())
            }
            Solid::Ring(inner, outer, low, high) if inner > 0.0 => {
                turned(&[(outer, low), (outer, high), (inner, high), (inner, low)])
            }
            Solid::Ring(_, outer, low, high) => {
                turned(&[(0.0, low), (outer, low), (outer, high), (0.0, high)])
            }
            Solid::Ball(m, r) => {
                let at = |i: usize| {
                    let angle = std::f64::consts::PI * (i as f64 / 32.0 - 0.5);
                    let radius = if i == 0 || i == 32 { 0.0 } else { r * angle.cos() };
                    (radius, r * angle.sin())
                };
                let (vertices, triangles) = turned(&(0..=32).map(at).collect::<Vec<_>>());
                (vertices.into_iter().map(|v| v + Vector3::from(m)).collect(), triangles)
            }
            Solid::Cone(base, height) => turned(&[(0.0, 0.0), (base, 0.0), (0.0, height)]),
        }
    }
}

/// A closed outline (radius, z) turned about the z axis.
fn turned(outline: &[(f64, f64)]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    const AROUND: u32 = 96;
    let vertices = outline.iter().flat_map(|&(r, z)| {
        (0..AROUND).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        })
    });
    let n = outline.len();
    let mut triangles = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        let at =
            |ring: usize, k: u32| ring as u32 * AROUND + if outline[ring].0 == 0.0 { 0 } else { k % AROUND };
        for k in 0..AROUND {
            let (a, b, c, d) = (at(i, k), at(i, k + 1), at(j, k + 1), at(j, k));
            triangles.extend(
                [[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]),
            );
        }
    }
    (vertices.collect(), triangles)
}

/// A part of one or more bodies.
pub struct SolidPart {
    pub name: &'static str,
    pub solids: Vec<Solid>,
}

impl SolidPart {
    pub fn mesh(&self) -> TriMesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for solid in &self.solids {
            let (v, t) = solid.mesh();
            let first = vertices.len() as u32;
            vertices.extend(v.into_iter().map(|p| p * 1e-3));
            triangles.extend(t.into_iter().map(|t| t.map(|v| v + first)));
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    /// Writes the mesh as an STL file in millimetres.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join(format!("{}.stl", self.name));
        std::fs::write(&path, write_binary_stl(&self.mesh(), self.name, 1e-3)).unwrap();
        path
    }

    /// Where a ray from far away along a unit vector first meets the part, in millimetres from `from`: stepped through, then
    /// halved. Slivers thinner than a step may be missed.
    pub fn meets_mm(&self, from: Point3<f64>, along: Vector3<f64>, most_mm: f64) -> Option<f64> {
        let inside = |at: f64| self.solids.iter().any(|s| s.holds(from + along * at));
        let step = 0.2;
        let n = (most_mm / step) as usize;
        let hit = (0..=n).map(|i| step * i as f64).find(|&at| inside(at))?;
        let (mut out, mut within) = (hit - step, hit);
        for _ in 0..12 {
            let middle = (out + within) / 2.0;
            if inside(middle) { within = middle } else { out = middle }
        }
        Some(within)
    }
}

/// Ordinary parts, most of them not convex.
pub fn ordinary() -> Vec<SolidPart> {
    use Solid::{Ball, Box, Ring};
    let part = |name, solids: &[Solid]| SolidPart { name, solids: solids.to_vec() };
    vec![
        part(
            "l_bracket",
            &[Box([30.0, 0.0, 2.0], [60.0, 40.0, 4.0]), Box([2.0, 0.0, 27.0], [4.0, 40.0, 46.0])],
        ),
        part("flange_shaft", &[Ring(0.0, 4.0, -40.0, 40.0), Ring(0.0, 12.0, 2.0, 8.0)]),
        part("bolt", &[Ring(0.0, 5.0, 0.0, 40.0), Ring(0.0, 8.5, -6.4, 0.0)]),
        part(
            "mug",
            &[
                Ring(36.5, 40.0, 4.0, 95.0),
                Ring(0.0, 40.0, 0.0, 4.0),
                Box([52.0, 0.0, 75.0], [28.0, 10.0, 10.0]),
                Box([52.0, 0.0, 25.0], [28.0, 10.0, 10.0]),
                Box([66.0, 0.0, 50.0], [8.0, 10.0, 60.0]),
            ],
        ),
        part("m8_screw", &[Ring(0.0, 4.0, 0.0, 40.0), Ring(0.0, 6.5, -8.0, 0.0)]),
        part("ball", &[Ball([0.0; 3], 15.0)]),
        part(
            "u_channel",
            &[
                Box([0.0, 0.0, 1.5], [80.0, 30.0, 3.0]),
                Box([0.0, 13.5, 14.0], [80.0, 3.0, 22.0]),
                Box([0.0, -13.5, 14.0], [80.0, 3.0, 22.0]),
            ],
        ),
        part(
            "t_profile",
            &[Box([0.0, 0.0, 2.0], [80.0, 40.0, 4.0]), Box([0.0, 0.0, 19.0], [80.0, 4.0, 30.0])],
        ),
        part("tube", &[Ring(12.0, 15.0, -30.0, 30.0)]),
        part("hub", &[Ring(4.0, 25.0, 0.0, 8.0), Ring(4.0, 10.0, 8.0, 18.0)]),
        part("two_boxes", &[Box([0.0; 3], [20.0, 20.0, 20.0]), Box([30.0, 0.0, 0.0], [20.0, 20.0, 20.0])]),
    ]
}
