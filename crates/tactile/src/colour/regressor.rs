//! Smooth regression from the shape of the gel to the change of colour.
//!
//! The change of a pixel is a sum of two linear models, fitted to presses of a ball:
//!
//! ```text
//! near   sum_{t, p} a[t, p] T_t(n_x, n_y, h) u^i v^j    where the gel is displaced
//! around sum_{f, q} b[f, q] S_f(p) u^i v^j              everywhere
//! ```
//!
//! `T`: monomials of the normal (degrees 1 to 4) and of height times normal (degrees 0 to 2); `S`: the height around
//! the pixel at four scales with its derivatives up to third order (see `pyramid`), which stands for cast shadows and
//! for light that the dent throws onto its surroundings. Calibrations fit eleven of the forty: those that make presses of
//! shapes better that the fit has not seen, see `AROUND_FITTED`. u and v run over the image, -1 to 1 along its width, with
//! total degrees of at most 3 and 2. Beyond what the presses showed, the normal and the derivatives in S are held at
//! their largest values, so that other parts than a ball stay within the colours that the sensor has shown. Heights are
//! not held: over a wide flat contact they cancel.
//!
//! Every term is 0 for a gel at rest: no contact, no change.

mod draw;
mod near;
mod pyramid;
mod terrain;
#[cfg(test)]
mod tests;

pub(crate) use draw::DrawScratch;
pub(crate) use pyramid::{AROUND_FITTED, AROUND_HEIGHTS, SURROUNDINGS, cell_px};
pub(crate) use terrain::{Planes, Terrain};

use crate::grid::{Grid, Plane};
use pyramid::{Surroundings, double, surroundings};

/// Highest degree of the normal alone.
const NORMAL_DEGREE: usize = 4;

/// Highest degree of the normal beside the height.
const HEIGHT_DEGREE: usize = 2;

/// Monomials of the normal of degrees 1 to [`NORMAL_DEGREE`].
const NORMAL_TERMS: usize = (NORMAL_DEGREE + 1) * (NORMAL_DEGREE + 2) / 2 - 1;

/// Terms of a displaced pixel.
pub(crate) const NEAR: usize = NORMAL_TERMS + (HEIGHT_DEGREE + 1) * (HEIGHT_DEGREE + 2) / 2;

/// Monomials `u^i v^j` of degree at most 3, and of degree at most 2. Order: `1, u, v, u^2, u v, v^2, u^3, ...`.
pub(crate) const NEAR_FIELD: usize = 10;
pub(crate) const AROUND_FIELD: usize = 6;

/// Pixels or cells that are computed together: the widest vector.
const BLOCK: usize = 16;

const CHANNELS: usize = 3;

/// Coefficients by monomial, then feature and channel, out of channel, feature, monomial.
#[inline(always)]
fn by_monomial<const FIELD: usize>(coefficients: &[f32], features: usize) -> Vec<f32> {
    let mut out = vec![0.0; coefficients.len()];
    for (i, of_feature) in coefficients.as_chunks::<FIELD>().0.iter().enumerate() {
        let to = CHANNELS * (i % features) + i / features;
        for (monomial, c) in of_feature.iter().enumerate() {
            out[monomial * CHANNELS * features + to] = *c;
        }
    }
    out
}

#[inline(always)]
fn block_of(row: &[f32], start: usize) -> &[f32; BLOCK] {
    row[start..].first_chunk().expect("rows are padded to whole blocks")
}

/// Coefficients of the model; see the module.
#[derive(Debug, Clone, PartialEq)]
pub struct Regressor {
    /// Side of a pixel on the gel, as in the presses.
    pub(crate) mm_per_px: f64,
    /// Coefficients by channel, term and monomial of the position: 3 x 20 x 10.
    pub(crate) near: Vec<f32>,
    /// Coefficients by channel, feature and monomial of the position: 3 x 40 x 6.
    pub(crate) around: Vec<f32>,
    /// Largest sine of the slope that was seen.
    pub(crate) slope_limit: f32,
    /// Largest height that enters, in millimetres; a calibration sets no limit.
    pub(crate) height_limit_mm: f32,
    /// Largest magnitude of each feature of the surroundings that was seen.
    pub(crate) around_limit: Vec<f32>,
}

impl Regressor {
    /// The features of the surroundings that have a say: with coefficients other than 0.
    pub(crate) fn around_used(&self) -> [bool; SURROUNDINGS] {
        let mut used = [false; SURROUNDINGS];
        for (i, of_feature) in self.around.as_chunks::<AROUND_FIELD>().0.iter().enumerate() {
            used[i % SURROUNDINGS] |= of_feature.iter().any(|&c| c != 0.0);
        }
        used
    }

    /// Whether all coefficients are finite, all limits positive or 0, and the side of a pixel sensible.
    pub(crate) fn is_usable(&self) -> bool {
        let limits = || self.around_limit.iter().chain([&self.slope_limit, &self.height_limit_mm]);
        (1e-4..=1.0).contains(&self.mm_per_px)
            && self.near.iter().chain(&self.around).chain(limits()).all(|x| x.is_finite())
            && limits().all(|&x| x >= 0.0)
    }
}

/// Components along x and y of the unit normal of a surface with these slopes, shortened to `limit`.
#[inline(always)]
pub(crate) fn limited_normal(gx: f32, gy: f32, limit: f32) -> [f32; 2] {
    let squared = gx * gx + gy * gy;
    let inverse = 1.0 / (1.0 + squared).sqrt();
    let sine = squared.sqrt() * inverse;
    let shorten = if sine > limit { limit / sine } else { 1.0 };
    let scale = -inverse * shorten;
    [gx * scale, gy * scale]
}

/// The terms of N displaced pixels: `n_x^a n_y^b` by degree, then height times those of degrees 0 to 2.
#[inline(always)]
pub(crate) fn near_terms<const N: usize>(
    nx: &[f32; N],
    ny: &[f32; N],
    height_mm: &[f32; N],
) -> [[f32; N]; NEAR] {
    let mut terms = [[0.0; N]; NEAR];
    terms[NORMAL_TERMS] = *height_mm;
    let mut degree = [[1.0f32; N]; NORMAL_DEGREE + 1];
    let (mut at, mut at_height) = (0, NORMAL_TERMS + 1);
    for d in 1..=NORMAL_DEGREE {
        // nx^d, nx^(d-1) ny, ..., ny^d from the degree before.
        degree[d] = product(&degree[d - 1], ny);
        for monomial in &mut degree[..d] {
            *monomial = product(monomial, nx);
        }
        for monomial in &degree[..=d] {
            terms[at] = *monomial;
            at += 1;
            if d <= HEIGHT_DEGREE {
                terms[at_height] = product(height_mm, monomial);
                at_height += 1;
            }
        }
    }
    terms
}

#[inline(always)]
fn product<const N: usize>(a: &[f32; N], b: &[f32; N]) -> [f32; N] {
    let mut out = [0.0; N];
    for x in 0..N {
        out[x] = a[x] * b[x];
    }
    out
}

/// The features of the surroundings that calibrations fit, [`AROUND_FITTED`]: one plane for each, on the finest cells.
pub(crate) fn fitted_surroundings(surface: &Plane, mm_per_px: f64) -> Vec<Plane> {
    let mut wanted = [false; SURROUNDINGS];
    AROUND_FITTED.iter().for_each(|&feature| wanted[feature] = true);
    let Surroundings { fine, coarse } =
        surroundings(&Planes::of_heights(surface), cell_px(mm_per_px), mm_per_px, &wanted);
    let (w, h) = fine.size;
    let doubled = coarse.planes.iter().map(|(feature, plane)| (*feature, double(plane, w, h)));
    let mut planes: Vec<(usize, Plane)> = fine.planes.into_iter().chain(doubled).collect();
    planes.sort_by_key(|(feature, _)| AROUND_FITTED.iter().position(|fitted| fitted == feature));
    planes.into_iter().map(|(_, plane)| plane).collect()
}

/// Where pixels lie in the image.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    centre: (f32, f32),
    unit: f32,
}

impl Place {
    #[inline(always)]
    pub(crate) fn of((w, h): (usize, usize)) -> Self {
        Self { centre: ((w as f32 - 1.0) / 2.0, (h as f32 - 1.0) / 2.0), unit: 2.0 / w as f32 }
    }

    pub(crate) fn in_grid(grid: &Grid) -> Self {
        Self::of((grid.width_px, grid.height_px))
    }

    #[inline(always)]
    pub(crate) fn u(self, x_px: f32) -> f32 {
        (x_px - self.centre.0) * self.unit
    }

    #[inline(always)]
    pub(crate) fn v(self, y_px: f32) -> f32 {
        (y_px - self.centre.1) * self.unit
    }
}

#[inline(always)]
fn cell_centre_px(index: usize, cell_px: usize) -> f32 {
    (index as f32 + 0.5) * cell_px as f32 - 0.5
}

/// The two cells beside a pixel and the weight of the second.
#[inline(always)]
pub(crate) fn between_cells(pixel: usize, cell_px: usize, cells: usize) -> (usize, usize, f32) {
    let at = ((pixel as f32 + 0.5) / cell_px as f32 - 0.5).clamp(0.0, (cells - 1) as f32);
    let first = (at as usize).min(cells - 1);
    (first, (first + 1).min(cells - 1), at - first as f32)
}
