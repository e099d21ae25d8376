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
//! for light that the dent throws onto its surroundings. u and v run over the image, -1 to 1 along its width, with
//! total degrees of at most 3 and 2. Beyond what the presses showed, the normal, the height and each S are held at
//! their largest values, so that other parts than a ball stay within the colours that the sensor has shown.
//!
//! Every term is 0 for a gel at rest: no contact, no change.

mod pyramid;
#[cfg(test)]
mod tests;

pub(crate) use pyramid::{AROUND_HEIGHTS, SURROUNDINGS, cell_px};

use crate::grid::{Grid, Plane};
use crate::simd::{Kernel, Lanes, SimdLevel};
use pyramid::{DERIVATIVES, Surroundings, double, surroundings};

/// Highest degree of the normal alone.
const NORMAL_DEGREE: usize = 4;

/// Highest degree of the normal beside the height.
const HEIGHT_DEGREE: usize = 2;

/// Monomials of the normal of degrees 1 to [`NORMAL_DEGREE`].
const NORMAL_TERMS: usize = (NORMAL_DEGREE + 1) * (NORMAL_DEGREE + 2) / 2 - 1;

/// Terms of a displaced pixel.
pub(crate) const NEAR: usize = NORMAL_TERMS + (HEIGHT_DEGREE + 1) * (HEIGHT_DEGREE + 2) / 2;

/// The term that is the height alone.
pub(crate) const HEIGHT_INPUT: usize = NORMAL_TERMS;

/// Monomials `u^i v^j` of degree at most 3, and of degree at most 2. Order: `1, u, v, u^2, u v, v^2, u^3, ...`.
pub(crate) const NEAR_FIELD: usize = 10;
pub(crate) const AROUND_FIELD: usize = 6;

/// Pixels that are computed together.
const BLOCK: usize = 16;

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
    /// Largest height that was seen, in millimetres.
    pub(crate) height_limit_mm: f32,
    /// Largest magnitude of each feature of the surroundings that was seen.
    pub(crate) around_limit: Vec<f32>,
}

impl Regressor {
    /// Whether all coefficients are finite, all limits positive or 0, and the side of a pixel sensible.
    pub(crate) fn is_usable(&self) -> bool {
        let limits = || self.around_limit.iter().chain([&self.slope_limit, &self.height_limit_mm]);
        (1e-4..=1.0).contains(&self.mm_per_px)
            && self.near.iter().chain(&self.around).chain(limits()).all(|x| x.is_finite())
            && limits().all(|&x| x >= 0.0)
    }

    /// Writes the change that a surface (heights and slopes in pixels) makes, into planes of 0; the same bits on every unit.
    pub(crate) fn shade(
        &self,
        surface: &Plane,
        along_x: &Plane,
        along_y: &Plane,
        change: &mut [Plane; 3],
        level: SimdLevel,
    ) {
        if surface.values.iter().all(|&z| z == 0.0) {
            return;
        }
        level.run(Shade { model: self, surface, along_x, along_y, change });
    }

    /// The part of the surroundings, on cells, then bilinearly between their centres.
    #[inline(always)]
    fn shade_around(&self, surface: &Plane, change: &mut [Plane; 3]) {
        let cell = cell_px(self.mm_per_px);
        let Surroundings { fine, coarse } = surroundings(surface, cell, self.mm_per_px);
        let size = (surface.width, surface.height);
        for (channel, plane) in change.iter_mut().enumerate() {
            let on_coarse = self.combine(channel, &coarse, DERIVATIVES, 2 * cell, size);
            let mut on_fine = self.combine(channel, &fine, 0, cell, size);
            let doubled = double(&on_coarse, on_fine.width, on_fine.height);
            for (fine, coarse) in on_fine.values.iter_mut().zip(&doubled.values) {
                *fine += coarse;
            }
            spread(&on_fine, cell, plane);
        }
    }

    /// The sum over features from `first` on, on their cells of `cell_px` pixels.
    #[inline(always)]
    fn combine(
        &self,
        channel: usize,
        features: &[Plane],
        first: usize,
        cell_px: usize,
        size: (usize, usize),
    ) -> Plane {
        let (w, h) = (features[0].width, features[0].height);
        let place = Place::of(size);
        let u: Vec<f32> = (0..w).map(|x| place.u(cell_centre_px(x, cell_px))).collect();
        let mut out = Plane::filled(w, h, 0.0);
        for y in 0..h {
            let v = place.v(cell_centre_px(y, cell_px));
            let row = &mut out.values[y * w..(y + 1) * w];
            for (i, feature) in features.iter().enumerate() {
                let at = (channel * SURROUNDINGS + first + i) * AROUND_FIELD;
                let c = &self.around[at..at + AROUND_FIELD];
                // 1, u, v, u^2, u v, v^2 for this row as a polynomial in u.
                let (c0, c1, c2) = (c[0] + v * (c[2] + v * c[5]), c[1] + v * c[4], c[3]);
                let limit = self.around_limit[first + i];
                for ((sum, &f), &u) in row.iter_mut().zip(feature.row(y)).zip(&u) {
                    let field = u.mul_add(u.mul_add(c2, c1), c0);
                    *sum = f.max(-limit).min(limit).mul_add(field, *sum);
                }
            }
        }
        out
    }

    /// The part of displaced pixels.
    #[inline(always)]
    fn shade_near(&self, surface: &Plane, along_x: &Plane, along_y: &Plane, change: &mut [Plane; 3]) {
        let (w, h) = (surface.width, surface.height);
        let place = Place::of((w, h));
        let u: Vec<f32> = (0..w.next_multiple_of(BLOCK)).map(|x| place.u(x as f32)).collect();
        for y in 0..h {
            let rows = [surface.row(y), along_x.row(y), along_y.row(y)];
            let moved = |x: &usize| rows.iter().any(|r| r[*x] != 0.0);
            let Some(first) = (0..w).find(moved) else { continue };
            let last = (0..w).rev().find(moved).unwrap_or(first);
            let fields = self.row_fields(place.v(y as f32));
            for start in (first / BLOCK * BLOCK..=last).step_by(BLOCK) {
                let n = BLOCK.min(w - start);
                let mut block = [[0.0f32; BLOCK]; 3];
                for (b, r) in block.iter_mut().zip(rows) {
                    b[..n].copy_from_slice(&r[start..start + n]);
                }
                let terms = self.terms(&block);
                let u: &[f32; BLOCK] = u[start..start + BLOCK].try_into().expect("u is padded");
                for (channel, plane) in change.iter_mut().enumerate() {
                    let sum = combine_block(&terms, &fields[channel], u);
                    let out = &mut plane.values[y * w + start..][..n];
                    for (o, s) in out.iter_mut().zip(sum) {
                        *o += s;
                    }
                }
            }
        }
    }

    /// For one row the fields of each channel and term as polynomials of third degree in u, by powers.
    #[inline(always)]
    fn row_fields(&self, v: f32) -> [[[f32; NEAR]; 4]; 3] {
        let mut fields = [[[0.0; NEAR]; 4]; 3];
        for (channel, powers) in fields.iter_mut().enumerate() {
            for term in 0..NEAR {
                let at = (channel * NEAR + term) * NEAR_FIELD;
                let c = &self.near[at..at + NEAR_FIELD];
                powers[0][term] = c[0] + v * (c[2] + v * (c[5] + v * c[9]));
                powers[1][term] = c[1] + v * (c[4] + v * c[8]);
                powers[2][term] = c[3] + v * c[7];
                powers[3][term] = c[6];
            }
        }
        fields
    }

    /// The terms of a block of pixels: heights and both slopes in, one row a term out.
    #[inline(always)]
    fn terms(&self, [height, gx, gy]: &[[f32; BLOCK]; 3]) -> [[f32; BLOCK]; NEAR] {
        let scale = self.mm_per_px as f32;
        let (mut nx, mut ny, mut h) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for x in 0..BLOCK {
            [nx[x], ny[x]] = limited_normal(gx[x], gy[x], self.slope_limit);
            h[x] = (height[x] * scale).min(self.height_limit_mm);
        }
        near_terms(&nx, &ny, &h)
    }
}

/// [`Regressor::shade`] for one vector unit.
struct Shade<'a> {
    model: &'a Regressor,
    surface: &'a Plane,
    along_x: &'a Plane,
    along_y: &'a Plane,
    change: &'a mut [Plane; 3],
}

impl Kernel for Shade<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        self.model.shade_around(self.surface, self.change);
        self.model.shade_near(self.surface, self.along_x, self.along_y, self.change);
    }
}

/// Sums over terms for a block of pixels: the fields, cubic in u, are taken as straight lines through their value and
/// slope in the middle of the block. A block is so short that this changes them by less than one part in a thousand.
#[inline(always)]
fn combine_block(terms: &[[f32; BLOCK]; NEAR], powers: &[[f32; NEAR]; 4], u: &[f32; BLOCK]) -> [f32; BLOCK] {
    let middle = 0.5 * (u[BLOCK / 2 - 1] + u[BLOCK / 2]);
    let (mut value, mut slope) = ([0.0; NEAR], [0.0; NEAR]);
    for t in 0..NEAR {
        let [p0, p1, p2, p3] = [powers[0][t], powers[1][t], powers[2][t], powers[3][t]];
        value[t] = p0 + middle * (p1 + middle * (p2 + middle * p3));
        slope[t] = p1 + middle * (2.0 * p2 + middle * (3.0 * p3));
    }
    let (mut values, mut slopes) = ([0.0f32; BLOCK], [0.0f32; BLOCK]);
    for (term, (value, slope)) in terms.iter().zip(value.iter().zip(&slope)) {
        for x in 0..BLOCK {
            values[x] = term[x].mul_add(*value, values[x]);
            slopes[x] = term[x].mul_add(*slope, slopes[x]);
        }
    }
    let mut sum = [0.0; BLOCK];
    for x in 0..BLOCK {
        sum[x] = (u[x] - middle).mul_add(slopes[x], values[x]);
    }
    sum
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

/// The features of the surroundings of a surface on its finest cells, one plane a feature.
pub(crate) fn around_planes(surface: &Plane, mm_per_px: f64) -> Vec<Plane> {
    let Surroundings { mut fine, coarse } = surroundings(surface, cell_px(mm_per_px), mm_per_px);
    let (w, h) = (fine[0].width, fine[0].height);
    fine.extend(coarse.iter().map(|plane| double(plane, w, h)));
    fine
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

/// Writes the values of cells into pixels, bilinearly between the centres.
#[inline(always)]
fn spread(cells: &Plane, cell_px: usize, out: &mut Plane) {
    let columns: Vec<_> = (0..out.width).map(|x| between_cells(x, cell_px, cells.width)).collect();
    // Each row of cells as wide as the image, once.
    let mut wide = vec![0.0f32; cells.height * out.width];
    for (row, to) in wide.chunks_exact_mut(out.width).enumerate() {
        let row = cells.row(row);
        for (value, &(left, right, weight)) in to.iter_mut().zip(&columns) {
            *value = row[left] + weight * (row[right] - row[left]);
        }
    }
    for y in 0..out.height {
        let (above, below, weight) = between_cells(y, cell_px, cells.height);
        let (above, below) =
            (&wide[above * out.width..][..out.width], &wide[below * out.width..][..out.width]);
        let to = &mut out.values[y * out.width..][..out.width];
        for (value, (a, b)) in to.iter_mut().zip(above.iter().zip(below)) {
            *value = a + weight * (b - a);
        }
    }
}
