//! Parametric meshes: the four parts of the pull experiment, and the two hundred of the [`benchmark`].
//!
//! Every part is built around the x axis of its mesh frame (the axis of rotation), centred on the origin, in
//! metres. Angles come from `libm`: the same parameters give the same bits everywhere, which is what lets
//! `cargo xtask assets` compare the shipped STL files with these functions.

mod bearing;
pub mod benchmark;
mod gear;
mod grid;
mod numbers;
mod outline;
mod prism;
mod shaft;
mod turned;

pub use bearing::{BallBearing, RollerBearing};
pub use gear::InvoluteGear;
pub use shaft::SteppedShaft;

use crate::TriMesh;
use nalgebra::Point3;

/// Collects triangles of closed surfaces.
#[derive(Debug, Default)]
struct Builder {
    vertices_m: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    fn finish(self) -> TriMesh {
        TriMesh::new(self.vertices_m, self.triangles).expect("parametric parts are finite and not empty")
    }

    fn vertex(&mut self, x: f64, y: f64, z: f64) -> u32 {
        self.vertices_m.push(Point3::new(x, y, z));
        (self.vertices_m.len() - 1) as u32
    }

    fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }

    /// Revolves a closed profile of (x, radius) points about the x axis. The profile runs so that the solid
    /// lies to its left when x points right and the radius up. Points on the axis collapse to one vertex.
    fn revolve(&mut self, profile: &[(f64, f64)], segments: usize) {
        let rings: Vec<Vec<u32>> = profile
            .iter()
            .map(|&(x, radius)| {
                if radius == 0.0 {
                    let pole = self.vertex(x, 0.0, 0.0);
                    return vec![pole; segments];
                }
                (0..segments)
                    .map(|i| {
                        let (s, c) = sin_cos_turn(i, segments);
                        self.vertex(x, radius * c, radius * s)
                    })
                    .collect()
            })
            .collect();
        for p in 0..profile.len() {
            let (ring, next) = (&rings[p], &rings[(p + 1) % profile.len()]);
            for i in 0..segments {
                let j = (i + 1) % segments;
                let corners = [ring[i], ring[j], next[j], next[i]];
                if corners[0] != corners[1] {
                    self.triangles.push([corners[0], corners[2], corners[1]]);
                }
                if corners[2] != corners[3] {
                    self.triangles.push([corners[0], corners[3], corners[2]]);
                }
            }
        }
    }
}

/// Sine and cosine of `i / n` of a full turn, exact at the quarter turns.
fn sin_cos_turn(i: usize, n: usize) -> (f64, f64) {
    match (4 * i) % (4 * n) {
        0 => (0.0, 1.0),
        k if k == n => (1.0, 0.0),
        k if k == 2 * n => (0.0, -1.0),
        k if k == 3 * n => (-1.0, 0.0),
        _ => {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            (libm::sin(angle), libm::cos(angle))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::f64::consts::PI;

    /// Every edge of a closed, consistently oriented surface is used once in each direction.
    fn check_closed(mesh: &TriMesh, name: &str) {
        let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for t in mesh.triangles() {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                assert_ne!(a, b, "{name}: degenerate triangle");
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&n| n == 0), "{name} is not closed");
        assert!(mesh.signed_volume_m3() > 0.0, "{name} is inside out");
    }

    #[test]
    fn all_parts_are_closed_and_face_outwards() {
        check_closed(&SteppedShaft::default().mesh(), "shaft");
        check_closed(&InvoluteGear::default().mesh(), "gear");
        check_closed(&BallBearing::default().mesh(), "ball bearing");
        check_closed(&RollerBearing::default().mesh(), "roller bearing");
    }

    #[test]
    fn a_revolved_rectangle_has_the_volume_of_a_tube() {
        let mut b = Builder::default();
        b.revolve(&[(-0.01, 0.004), (0.01, 0.004), (0.01, 0.009), (-0.01, 0.009)], 720);
        let tube = PI * (0.009_f64.powi(2) - 0.004_f64.powi(2)) * 0.02;
        let mesh = b.finish();
        check_closed(&mesh, "tube");
        assert!((mesh.signed_volume_m3() / tube - 1.0).abs() < 2e-5);
    }

    #[test]
    fn gear_teeth_have_the_involute_thickness() {
        let gear = InvoluteGear::default();
        let mesh = gear.mesh();
        let (low, high) = mesh.bounds_m();
        let tip = gear.module_mm * (f64::from(gear.teeth) + 2.0) / 2.0 * 1e-3;
        assert!((high[2] - tip).abs() < 2e-6 && (low[2] + tip).abs() < 2e-6, "a tooth points up and down");
        // At the pitch circle tooth and gap are equally wide (less the backlash of zero): pi m / 2.
        let pitch = gear.module_mm * f64::from(gear.teeth) / 2.0;
        let half_angle = gear.tooth_half_angle_rad(pitch);
        assert!((2.0 * pitch * half_angle - PI * gear.module_mm / 2.0).abs() < 1e-12);
        // And thinner towards the tip, by the involute function.
        assert!(gear.tooth_half_angle_rad(tip * 1e3) < half_angle);
    }
}
