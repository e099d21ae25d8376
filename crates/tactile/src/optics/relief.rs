//! Relief of a part's surface: what a scraped, milled or printed face shows in the image between its edges.
//!
//! On real sensors the texture of a flat contact is not noise: it is correlated by 0.74 to 0.80 between presses of growing depth, and
//! its spectrum falls below 2 per mm (a prism printed for a GelSight, Chen et al. 2022). So it is a height that is fixed to the part, white noise
//! through a Gaussian.

use super::kernels::discrete_gaussian;
use crate::grid::Grid;
use crate::indent::Imprint;
use gripgen_twin::OpticsState;
use gripgen_twin::frames::Pose;
use gripgen_twin::random::{normal_quantile, splitmix64};
use nalgebra::{Point3, Vector3};
use std::sync::OnceLock;

/// Standard deviation of the Gaussian: the spectrum is down to a sixth of its power at 2 per mm.
const SMOOTHING_M: f64 = 0.15e-3;
/// Points of the pattern along each side, a power of two, and their distance. It repeats after 12.8 mm.
const POINTS: usize = 256;
const PITCH_M: f64 = 0.05e-3;

/// Adds the relief of the part to what is pressed in. The relief is a function of the place on the part, seen along the axis of its
/// mesh that is nearest to that of the gel.
pub(crate) fn add(imprint: &mut Imprint, gel_from_mesh: &Pose, grid: &Grid, optics: &OpticsState) {
    let pattern = pattern();
    let mesh_from_gel = gel_from_mesh.inverse();
    let normal = mesh_from_gel * Vector3::z();
    let (u, v) = match normal.iamax() {
        0 => (1, 2),
        1 => (0, 2),
        _ => (0, 1),
    };
    let mut state = optics.relief_key;
    let [du, dv] = [(); 2].map(|()| (splitmix64(&mut state) % POINTS as u64) as f64);
    let relief_px = optics.relief_m / grid.metres_per_px;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| mesh_from_gel * axis);
    let per_px = grid.metres_per_px / PITCH_M;
    let (x0_m, y0_m) = grid.centre_m(0, 0);
    let origin = mesh_from_gel * Point3::new(x0_m, y0_m, 0.0);
    let first = [origin[u] / PITCH_M + du, origin[v] / PITCH_M + dv];
    let step = axes.map(|axis| [axis[u] * per_px, axis[v] * per_px]);
    for (i, depth) in imprint.depth_px.values.iter_mut().enumerate().filter(|(_, depth)| **depth > 0.0) {
        let at = [(i % grid.width_px) as f64, (i / grid.width_px) as f64, f64::from(*depth)];
        let place = |a: usize| first[a] + (0..3).map(|k| at[k] * step[k][a]).sum::<f64>();
        let raised = relief_px * between(pattern, place(0), place(1));
        *depth = (f64::from(*depth) + raised).max(0.0) as f32;
    }
}

/// The pattern between its points.
fn between(pattern: &[f32], u: f64, v: f64) -> f64 {
    let (left, top) = (u.floor(), v.floor());
    let (right, down) = (u - left, v - top);
    let wrapped = |i: f64| (i as i64).rem_euclid(POINTS as i64) as usize;
    let (x, y) = (wrapped(left), wrapped(top));
    let (x1, y1) = ((x + 1) % POINTS, (y + 1) % POINTS);
    let at = |x: usize, y: usize| f64::from(pattern[y * POINTS + x]);
    let upper = at(x, y) + right * (at(x1, y) - at(x, y));
    let lower = at(x, y1) + right * (at(x1, y1) - at(x, y1));
    upper + down * (lower - upper)
}

/// A pattern of mean 0 and standard deviation 1 that goes on at its borders. All parts have the same one, each at another place of it.
fn pattern() -> &'static [f32] {
    static PATTERN: OnceLock<Vec<f32>> = OnceLock::new();
    PATTERN.get_or_init(|| {
        let mut state = 1;
        let mut unit = || ((splitmix64(&mut state) >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        let white: Vec<f64> = (0..POINTS * POINTS).map(|_| normal_quantile(unit())).collect();
        let weights = discrete_gaussian(SMOOTHING_M / PITCH_M);
        let half = weights.len() / 2;
        let along = |values: &[f64], place: fn(usize, usize) -> usize| -> Vec<f64> {
            let at = |line: usize, i: usize| {
                let near = (0..weights.len()).map(|k| place(line, (i + POINTS + k - half) % POINTS));
                near.zip(&weights).map(|(from, weight)| f64::from(*weight) * values[from]).sum::<f64>()
            };
            let mut out = vec![0.0; values.len()];
            for line in 0..POINTS {
                (0..POINTS).for_each(|i| out[place(line, i)] = at(line, i));
            }
            out
        };
        let smooth = along(&along(&white, |line, i| line * POINTS + i), |line, i| i * POINTS + line);
        let n = smooth.len() as f64;
        let mean = smooth.iter().sum::<f64>() / n;
        let sd = (smooth.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
        smooth.iter().map(|v| ((v - mean) / sd) as f32).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deform::Edges;
    use crate::grid::Plane;
    use nalgebra::{Translation3, UnitQuaternion};

    const GRID: Grid = Grid { width_px: 200, height_px: 150, metres_per_px: 0.08e-3 };

    /// What a relief of 5 um adds to a flat contact of 0.5 mm in a pose, in um.
    fn added(pose: &Pose, key: u64) -> Vec<f64> {
        let depth_px = Plane::filled(GRID.width_px, GRID.height_px, 6.25);
        let (patch, places) = Default::default();
        let edges = Edges::default();
        let mut imprint =
            Imprint { depth_px, edges, press_depth_m: 0.5e-3, lift_m: 0.0, patch, places, elastic: None };
        let optics = OpticsState { relief_m: 5e-6, relief_key: key, ..OpticsState::default() };
        add(&mut imprint, pose, &GRID, &optics);
        imprint.depth_px.values.iter().map(|d| (f64::from(*d) - 6.25) * 80.0).collect()
    }

    fn correlation(a: &[f64], b: &[f64]) -> f64 {
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    }

    /// The height that was asked for, and the slope and correlation of white noise through a Gaussian: the correlation at a distance d is
    /// exp(-d^2 / 4 s^2), so that the slope is the height over sqrt(2) s.
    #[test]
    fn a_relief_has_its_height_and_its_spectrum() {
        let flat = added(&Pose::identity(), 3);
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        assert!((rms(&flat) / 5.0 - 1.0).abs() < 0.15, "{}", rms(&flat));
        let (w, shift) = (GRID.width_px, 3);
        let pairs = (0..flat.len()).filter(|i| i % w + shift < w);
        let (here, there): (Vec<f64>, Vec<f64>) = pairs.map(|i| (flat[i], flat[i + shift])).unzip();
        let exact = (-(0.24f64 / 0.15).powi(2) / 4.0).exp();
        assert!((correlation(&here, &there) - exact).abs() < 0.06, "{} {exact}", correlation(&here, &there));
    }

    /// Turned and moved with the part the relief goes along; another part has another one.
    #[test]
    fn a_relief_is_fixed_to_its_part() {
        let plain = added(&Pose::identity(), 3);
        // 12 pixels to the right and 7 down, the part turned by half a turn.
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let moved = Pose::from_parts(Translation3::new(12.0 * 0.08e-3, 7.0 * 0.08e-3, 0.0), half_turn);
        let turned = added(&moved, 3);
        let (w, h) = (GRID.width_px as i64, GRID.height_px as i64);
        let (mut a, mut b) = (vec![], vec![]);
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            let (fx, fy) = (w - 1 - x + 12, h - 1 - y + 7);
            if (0..w).contains(&fx) && (0..h).contains(&fy) {
                a.push(plain[(y * w + x) as usize]);
                b.push(turned[(fy * w + fx) as usize]);
            }
        }
        assert!(correlation(&a, &b) > 0.999, "{}", correlation(&a, &b));
        assert!(correlation(&plain, &turned).abs() < 0.2);
        assert!(correlation(&plain, &added(&Pose::identity(), 4)).abs() < 0.2);
    }
}
