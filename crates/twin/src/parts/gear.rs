//! Involute spur gear.

use super::{Builder, sin_cos_turn};
use crate::TriMesh;
use std::f64::consts::PI;

/// A spur gear with involute flanks, standard proportions (addendum 1 module, dedendum 1.25 modules,
/// ISO 53 profile without root fillet) and a plain bore. Its axis is the x axis; one tooth points along +z.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InvoluteGear {
    /// Module: pitch diameter over the number of teeth.
    pub module_mm: f64,
    /// Number of teeth; a multiple of 4 puts a tooth on every half axis.
    pub teeth: u32,
    /// Pressure angle.
    pub pressure_angle_deg: f64,
    /// Face width along the axis.
    pub width_mm: f64,
    /// Diameter of the bore.
    pub bore_mm: f64,
    /// Points along one flank.
    pub flank_points: usize,
}

impl Default for InvoluteGear {
    fn default() -> Self {
        Self {
            module_mm: 1.5,
            teeth: 20,
            pressure_angle_deg: 20.0,
            width_mm: 12.0,
            bore_mm: 10.0,
            flank_points: 9,
        }
    }
}

impl InvoluteGear {
    /// Half the angle that a tooth spans at `radius_mm`, outside the base circle:
    /// `pi / (2 z) + inv(alpha) - inv(alpha_r)`, `cos(alpha_r) = r_base / r`, `inv(x) = tan x - x`.
    pub fn tooth_half_angle_rad(&self, radius_mm: f64) -> f64 {
        let alpha = self.pressure_angle_deg.to_radians();
        let base = self.base_radius_mm();
        let local = libm::acos((base / radius_mm.max(base)).min(1.0));
        let involute = |x: f64| libm::tan(x) - x;
        PI / (2.0 * f64::from(self.teeth)) + involute(alpha) - involute(local)
    }

    fn base_radius_mm(&self) -> f64 {
        self.module_mm * f64::from(self.teeth) / 2.0 * libm::cos(self.pressure_angle_deg.to_radians())
    }

    /// Half an outline of one tooth as (angle from its centre line, radius), from the gap to the tip.
    fn flank(&self) -> Vec<(f64, f64)> {
        let pitch = self.module_mm * f64::from(self.teeth) / 2.0;
        let (tip, root) = (pitch + self.module_mm, pitch - 1.25 * self.module_mm);
        let start = self.base_radius_mm().max(root);
        let mut flank = vec![(PI / f64::from(self.teeth), root)];
        if root < start {
            // Below the base circle there is no involute: a radial line.
            flank.push((self.tooth_half_angle_rad(start), root));
        }
        for i in 0..self.flank_points {
            let radius = start + (tip - start) * i as f64 / (self.flank_points - 1) as f64;
            flank.push((self.tooth_half_angle_rad(radius), radius));
        }
        flank
    }

    /// The mesh, in metres.
    pub fn mesh(&self) -> TriMesh {
        let flank = self.flank();
        let tip = flank[flank.len() - 1].1;
        // Gap centre -> tip centre -> (excluding) next gap centre, all teeth; counter-clockwise from +x.
        let mut tooth: Vec<(f64, f64)> = flank.iter().map(|&(a, r)| (-a, r)).collect();
        tooth.push((0.0, tip));
        tooth.extend(flank.iter().skip(1).rev().map(|&(a, r)| (a, r)));
        let mut b = Builder::default();
        let half = self.width_mm / 2.0 * 1e-3;
        let bore = self.bore_mm / 2.0 * 1e-3;
        let (mut outline, mut bore_rim) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        for k in 0..self.teeth as usize {
            // (sin, cos) of the tooth's centre line, measured from +z so that tooth 0 points up.
            let (ts, tc) = sin_cos_turn(k, self.teeth as usize);
            for &(angle, radius) in &tooth {
                let (s, c) = (libm::sin(angle), libm::cos(angle));
                let (sin, cos) = (ts * c + tc * s, tc * c - ts * s);
                for (side, x) in [-half, half].into_iter().enumerate() {
                    outline[side].push(b.vertex(x, -radius * 1e-3 * sin, radius * 1e-3 * cos));
                    bore_rim[side].push(b.vertex(x, -bore * sin, bore * cos));
                }
            }
        }
        let n = outline[0].len();
        for i in 0..n {
            let j = (i + 1) % n;
            b.quad(outline[0][i], outline[0][j], outline[1][j], outline[1][i]);
            b.quad(bore_rim[0][j], bore_rim[0][i], bore_rim[1][i], bore_rim[1][j]);
            b.quad(bore_rim[1][i], outline[1][i], outline[1][j], bore_rim[1][j]);
            b.quad(outline[0][i], bore_rim[0][i], bore_rim[0][j], outline[0][j]);
        }
        b.finish()
    }
}
