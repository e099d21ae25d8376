//! Stages `indent` and `deform` of an elastic gel: frictionless contact of a rigid part with an elastic layer.
//!
//! Pressure and surface follow from modulus, Poisson's ratio and thickness; there is no imprint constant. Theory of
//! small strains: a press much deeper than a tenth of the contact's radius or of the gel is an extrapolation.

mod solve;

use crate::fft::Convolver;
use crate::grid::{Grid, Plane};
use crate::indent::{ElasticField, Imprint, IndentError, nothing_in_front};
use crate::layer::{BaseEffect, REACH, love};
use crate::patch::aggregate;
use crate::simd::SimdLevel;
use solve::{Contact, Problem, solve};
use std::f64::consts::PI;

/// Root mean square of the gap over the contact, relative to the press: on the grid of the sensor, and on coarse ones.
const TOLERANCE: f64 = 2e-4;
const COARSE_TOLERANCE: f64 = 5e-4;

/// Mean contact pressure over Young's modulus up to which an elastic gel is more than an extrapolation.
///
/// A column of rubber, neo-Hookean with `sigma / E = (1 / l^2 - l) / 3` at the stretch l (Treloar, The Physics of Rubber
/// Elasticity), is pressed together by 9 % at a pressure of 0.1 E where linear elasticity has 10 %, by 23 % at 0.3 E (30 %), and
/// by 41 % at 0.75 E (75 %).
pub const LINEAR_PRESSURE_SHARE: f64 = 0.3;

/// What lies behind the gel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// A rigid plate that the gel is bonded to, one thickness behind the surface.
    Bonded,
    /// More gel: an elastic half-space.
    HalfSpace,
}

/// An elastic gel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticGel {
    /// Thickness, the deepest press there can be.
    pub thickness_m: f64,
    /// Young's modulus.
    pub young_modulus_pa: f64,
    /// Poisson's ratio, 0 to 0.5.
    pub poisson_ratio: f64,
    /// What lies behind it.
    pub base: Base,
}

impl ElasticGel {
    /// `E / (1 - nu^2)`, the modulus that a rigid part feels.
    fn contact_modulus_pa(&self) -> f64 {
        self.young_modulus_pa / (1.0 - self.poisson_ratio * self.poisson_ratio)
    }
}

/// Displacement, in pixels, of a pixel by pressure `E*` on another one `(dx, dy)` pixels away.
struct Kernel<'a> {
    /// What the base changes, and the thickness in pixels of this level.
    base: Option<(&'a BaseEffect, f64)>,
}

impl Kernel<'_> {
    /// Farthest pixel that moves.
    fn reach_px(&self) -> usize {
        self.base.map_or(usize::MAX / 4, |(_, thickness_px)| (REACH * thickness_px) as usize)
    }

    fn at(&self, dx: usize, dy: usize) -> f64 {
        let (x, y) = (dx as f64, dy as f64);
        let Some((effect, thickness_px)) = self.base else { return love(x, y) / PI };
        let rho = (x * x + y * y).sqrt() / thickness_px;
        if rho > REACH { 0.0 } else { (love(x, y) + effect.at(rho) / thickness_px) / PI }
    }

    fn convolver(&self, width: usize, height: usize, level: SimdLevel) -> Convolver {
        Convolver::new(width, height, self.reach_px(), level, |dx, dy| self.at(dx, dy))
    }
}

/// Presses the surface `heights` (in pixels, towards the gel, `-inf` where there is none) into an elastic gel.
///
/// Solves for the pressure p and the press d, with u = K p the displacement of the gel's surface:
///
/// ```text
/// p >= 0,   gap = u - (h + d) >= 0,   p gap = 0,   a^2 sum p = F
/// ```
///
/// K is the displacement under a square of uniform pressure on a half-space (Love 1929), plus what a bonded base
/// changes (`layer.rs`), convolved without wrapping around. The method is Polonsky & Keer 1999; coarse grids,
/// four and two pixels wide, find where to begin. The gel goes on beyond the window, the part does not.
///
/// Of the result `depth_px` is the depth of the part where there is pressure (below 0 where the gel has risen to meet
/// it); the patch is that of the pressure. 15 ms for a ball on 320 x 240 pixels, 50 to 100 for parts that fill the window.
///
/// # Errors
///
/// No surface in front of the gel, or a press deeper than the gel.
pub fn press_elastic(
    heights: &Plane,
    grid: &Grid,
    gel: &ElasticGel,
    force_n: f64,
    level: SimdLevel,
) -> Result<Imprint, IndentError> {
    let a = grid.metres_per_px;
    let top = heights.highest();
    if top == f32::NEG_INFINITY {
        return Err(nothing_in_front(grid));
    }
    let effect = (gel.base == Base::Bonded).then(|| BaseEffect::new(gel.poisson_ratio));
    let below: Vec<f64> = heights.values.iter().map(|&h| f64::from(h) - f64::from(top)).collect();
    let thickness_px = gel.thickness_m / a;
    let load = force_n / (gel.contact_modulus_pa() * a * a);
    let whole = Problem { width: heights.width, height: heights.height, below, load };
    let kernel = |scale: usize| Kernel { base: effect.as_ref().map(|e| (e, thickness_px / scale as f64)) };
    let (contact, surface) = coarse_to_fine(&whole, thickness_px, kernel, level);
    let press_px = contact.press;
    if press_px > thickness_px {
        return Err(IndentError::DeeperThanTheGel {
            force_n,
            press_mm: press_px * a * 1e3,
            thickness_mm: gel.thickness_m * 1e3,
        });
    }
    let plane = |values: Vec<f32>| Plane { width: heights.width, height: heights.height, values };
    let part = |i: usize| whole.below[i] + press_px;
    let touching = |i: usize| contact.pressure[i] > 0.0;
    let pixels = 0..whole.below.len();
    let depth = pixels.clone().map(|i| if touching(i) { part(i) as f32 } else { 0.0 }).collect();
    // In contact the gel has the shape of the part, to the solver's tolerance and from here on exactly.
    let surface =
        pixels.clone().map(|i| if touching(i) { part(i) as f32 } else { surface[i] as f32 }).collect();
    let modulus = gel.contact_modulus_pa();
    let pressure_pa = plane(pixels.map(|i| (modulus * contact.pressure[i]) as f32).collect());
    let (patch, places) = aggregate(&pressure_pa, grid, force_n, level);
    Ok(Imprint {
        depth_px: plane(depth),
        edges: Default::default(),
        press_depth_m: press_px * a,
        lift_m: (press_px - f64::from(top)) * a,
        patch,
        places,
        elastic: Some(ElasticField { surface_px: plane(surface), pressure_pa }),
    })
}

/// The contact, and the surface around it.
fn coarse_to_fine<'a>(
    whole: &Problem,
    thickness_px: f64,
    kernel: impl Fn(usize) -> Kernel<'a>,
    level: SimdLevel,
) -> (Contact, Vec<f64>) {
    let quarter = whole.binned(4);
    let found =
        solve_in(&quarter, quarter.whole(), &quarter.first_guess(), &kernel(4), COARSE_TOLERANCE, level);
    let half = whole.binned(2);
    let (region, start) = (half.around(&quarter, &found), half.refined(&quarter, &found));
    let found = solve_in(&half, region, &start, &kernel(2), COARSE_TOLERANCE, level);
    let (mut region, mut start) = (whole.around(&half, &found), whole.refined(&half, &found));
    let mut everywhere = kernel(1).convolver(whole.width, whole.height, level);
    let mut surface = vec![0.0; whole.below.len()];
    loop {
        let contact = solve_in(whole, region, &start, &kernel(1), TOLERANCE, level);
        everywhere.apply(&contact.pressure, &mut surface);
        let tolerance = 1e-3 * contact.press.abs().min(thickness_px);
        let crosses =
            |i: usize| contact.pressure[i] == 0.0 && surface[i] < whole.below[i] + contact.press - tolerance;
        if region == whole.whole() || !(0..surface.len()).any(crosses) {
            return (contact, surface);
        }
        // A part that coarse pixels did not see, or not where they saw it.
        (region, start) = (whole.whole(), contact.pressure);
    }
}

/// Solves with contact inside `region` only: columns and rows from and to.
fn solve_in(
    problem: &Problem,
    region: [usize; 4],
    start: &[f64],
    kernel: &Kernel<'_>,
    tolerance: f64,
    level: SimdLevel,
) -> Contact {
    let inner = problem.cut(region);
    let mut convolver = kernel.convolver(inner.width, inner.height, level);
    let start = problem.cut_values(region, start);
    let mut contact = solve(&inner, &start, &mut convolver, tolerance);
    contact.pressure = problem.pasted(region, &contact.pressure);
    contact
}

#[cfg(test)]
mod tests;
