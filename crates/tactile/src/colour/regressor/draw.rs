//! Drawing of the regression: the surroundings on cells, which are spread bilinearly over the pixels, then row by row
//! the part of displaced pixels. Only fused multiply-adds and sums in a fixed order, so that all vector units agree.

use super::near::Near;
use super::pyramid::{Features, SURROUNDINGS, Surroundings, cell_px, double, surroundings};
use super::terrain::Terrain;
use super::{
    AROUND_FIELD, BLOCK, CHANNELS, Place, Regressor, between_cells, block_of, by_monomial, cell_centre_px,
};
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};

/// Features below this are none: what is left of a contact far from it, too small for normal numbers once it is weighed.
const NONE_BELOW: f32 = 1e-20;

/// Pixels between two centres of cells that are written at once.
const STRETCH: usize = 8;

/// Memory to draw in, to be used again.
#[derive(Debug, Default)]
pub(crate) struct DrawScratch {
    /// Sums on the coarse and on the fine cells, by channel.
    coarse: [Vec<f32>; CHANNELS],
    fine: [Vec<f32>; CHANNELS],
    /// Rows of cells as wide as the image, by row and channel.
    wide: Vec<f32>,
}

impl Regressor {
    /// Writes the change that a surface makes into all of `change`; the same bits on every vector unit.
    pub(crate) fn shade(
        &self,
        terrain: &impl Terrain,
        change: &mut [Plane; 3],
        scratch: &mut DrawScratch,
        level: SimdLevel,
    ) {
        let moved = |y: usize| terrain.heights(y)[terrain.columns()].iter().any(|&z| z != 0.0);
        if terrain.rows().any(moved) {
            level.run(Draw { model: self, terrain, change, scratch });
        } else {
            change.iter_mut().for_each(|plane| plane.values.fill(0.0));
        }
    }
}

/// [`Regressor::shade`] for one vector unit.
struct Draw<'a, T> {
    model: &'a Regressor,
    terrain: &'a T,
    change: &'a mut [Plane; 3],
    scratch: &'a mut DrawScratch,
}

impl<T: Terrain> Kernel for Draw<'_, T> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Draw { model, terrain, change, scratch } = self;
        let (size, cell) = (terrain.size(), cell_px(model.mm_per_px));
        let spread = around::<L>(model, terrain, cell, scratch);
        let mut near = Near::new(model, terrain);
        for y in 0..size.1 {
            let mut rows = change.each_mut().map(|plane| &mut plane.values[y * size.0..][..size.0]);
            spread.row(y, &scratch.wide, &mut rows);
            if terrain.rows().contains(&y) {
                near.row::<L>(terrain, y, &mut rows);
            }
        }
    }
}

/// The part of the surroundings, on rows of cells that are as wide as the image.
#[inline(always)]
fn around<L: Lanes>(
    model: &Regressor,
    terrain: &impl Terrain,
    cell: usize,
    scratch: &mut DrawScratch,
) -> Spread {
    let Surroundings { fine, coarse } = surroundings(terrain, cell, model.mm_per_px, &model.around_used());
    let fields = by_monomial::<AROUND_FIELD>(&model.around, SURROUNDINGS);
    let cells = Cells { model, fields: &fields, size: terrain.size() };
    cells.combine::<L>(&coarse, 2 * cell, &mut scratch.coarse);
    cells.combine::<L>(&fine, cell, &mut scratch.fine);
    let ((w, h), (coarse_w, coarse_h)) = (fine.size, coarse.size);
    let spread = Spread::new(cell, w, h);
    scratch.wide.resize(spread.stride * CHANNELS * h, 0.0);
    for (channel, (fine, coarse)) in scratch.fine.iter_mut().zip(&scratch.coarse).enumerate() {
        let values = coarse[..coarse_w * coarse_h].to_vec();
        let doubled = double(&Plane { width: coarse_w, height: coarse_h, values }, w, h);
        for (fine, coarse) in fine.iter_mut().zip(&doubled.values) {
            *fine += coarse;
        }
        for y in 0..h {
            let to = &mut scratch.wide[(CHANNELS * y + channel) * spread.stride..][..spread.stride];
            spread.widen(&fine[y * w..(y + 1) * w], to);
        }
    }
    spread
}

/// The surroundings on cells.
struct Cells<'a> {
    model: &'a Regressor,
    fields: &'a [f32],
    size: (usize, usize),
}

impl Cells<'_> {
    /// The sums over features on cells of `cell_px` pixels. `out` gets some values more.
    #[inline(always)]
    fn combine<L: Lanes>(&self, features: &Features, cell_px: usize, out: &mut [Vec<f32>; CHANNELS]) {
        let Features { size: (w, h), planes } = features;
        let (w, h) = (*w, *h);
        let place = Place::of(self.size);
        let u: Vec<f32> =
            (0..w.next_multiple_of(BLOCK)).map(|x| place.u(cell_centre_px(x, cell_px))).collect();
        out.iter_mut().for_each(|out| out.resize(w * h + BLOCK, 0.0));
        let (all, n) = (CHANNELS * SURROUNDINGS, CHANNELS * planes.len());
        // By monomial the coefficients of the features that are there.
        let mut f = [[0.0f32; CHANNELS * SURROUNDINGS]; AROUND_FIELD];
        for (m, f) in f.iter_mut().enumerate() {
            for ((feature, _), to) in planes.iter().zip(f.as_chunks_mut::<CHANNELS>().0) {
                to.copy_from_slice(&self.fields[m * all + CHANNELS * feature..][..CHANNELS]);
            }
        }
        let [f0, f1, f2, f3, f4, f5] = f.each_ref().map(|f| &f[..n]);
        let mut c = [[0.0f32; CHANNELS * SURROUNDINGS]; 3];
        c[2][..n].copy_from_slice(f3);
        let mut held = [[0.0f32; BLOCK]; SURROUNDINGS];
        for y in 0..h {
            // 1, u, v, u^2, u v, v^2 for this row as a polynomial in u.
            let v = place.v(cell_centre_px(y, cell_px));
            let [c0, c1, _] = &mut c;
            let (c0, c1) = (&mut c0[..n], &mut c1[..n]);
            for i in 0..n {
                c0[i] = v.mul_add(v.mul_add(f5[i], f2[i]), f0[i]);
                c1[i] = v.mul_add(f4[i], f1[i]);
            }
            for start in (0..w).step_by(BLOCK) {
                // A block may reach into the next row, whose own blocks come later.
                let at = y * w + start;
                let mut sums = [[0.0f32; BLOCK]; 3 * CHANNELS];
                for (i, (number, feature)) in planes.iter().enumerate() {
                    let limit = self.model.around_limit[*number];
                    let mut f = [0.0f32; BLOCK];
                    match feature.values[at..].first_chunk() {
                        Some(values) => f = *values,
                        None => f[..w * h - at].copy_from_slice(&feature.values[at..]),
                    }
                    for f in &mut f {
                        *f = if *f > limit { limit } else { *f };
                        *f = if *f < -limit { -limit } else { *f };
                        *f = if f.abs() < NONE_BELOW { 0.0 } else { *f };
                    }
                    held[i] = f;
                }
                // SAFETY: the caller has the instructions of `L`.
                unsafe { weigh::<L>(&held[..planes.len()], &c, &mut sums) };
                let u: &[f32; BLOCK] = block_of(&u, start);
                for channel in 0..CHANNELS {
                    let out = &mut out[channel][at..at + BLOCK];
                    let (p0, p1, p2) =
                        (&sums[channel], &sums[CHANNELS + channel], &sums[2 * CHANNELS + channel]);
                    for i in 0..BLOCK {
                        out[i] = u[i].mul_add(u[i].mul_add(p2[i], p1[i]), p0[i]);
                    }
                }
            }
        }
    }
}

/// Sums of features times coefficients, by power of u and channel.
///
/// # Safety
/// The processor must have the instructions of `L`.
#[inline(always)]
unsafe fn weigh<L: Lanes>(
    features: &[[f32; BLOCK]],
    c: &[[f32; CHANNELS * SURROUNDINGS]; 3],
    sums: &mut [[f32; BLOCK]; 3 * CHANNELS],
) {
    for half in (0..BLOCK).step_by(L::COUNT) {
        // SAFETY: a block is whole vectors, forwarded otherwise.
        unsafe {
            let mut all = [L::splat(0.0); 3 * CHANNELS];
            for (i, feature) in features.iter().enumerate().take(SURROUNDINGS) {
                let feature = L::load(feature.as_ptr().add(half));
                for power in 0..3 {
                    for channel in 0..CHANNELS {
                        let sum = &mut all[CHANNELS * power + channel];
                        *sum = L::fused(feature, L::splat(c[power][CHANNELS * i + channel]), *sum);
                    }
                }
            }
            for (sum, all) in sums.iter_mut().zip(all) {
                L::store(sum.as_mut_ptr().add(half), all);
            }
        }
    }
}

/// From cells to pixels, bilinearly between the centres. Between two centres lie as many pixels as a cell is wide; a
/// stretch before the first centre and one after the last are part of a row of `stride` values.
struct Spread {
    cell: usize,
    height: usize,
    stride: usize,
    /// Where pixel 0 lies in a row.
    lead: usize,
    /// Weights of the second cell for the pixels between two centres, in whole stretches.
    weights: Vec<f32>,
}

impl Spread {
    #[inline(always)]
    fn new(cell: usize, width: usize, height: usize) -> Self {
        let weight = |i: usize| ((i + cell / 2) as f32 + 0.5) / cell as f32 - 0.5;
        Self {
            cell,
            height,
            stride: (width + 1) * cell + STRETCH,
            lead: cell - cell / 2,
            weights: (0..cell.next_multiple_of(STRETCH)).map(weight).collect(),
        }
    }

    /// Along a row of cells.
    #[inline(always)]
    fn widen(&self, cells: &[f32], to: &mut [f32]) {
        let (weights, _) = self.weights.as_chunks::<STRETCH>();
        match weights {
            [weights] => self.widen_with(std::slice::from_ref(weights), cells, to),
            _ => self.widen_with(weights, cells, to),
        }
    }

    #[inline(always)]
    fn widen_with(&self, weights: &[[f32; STRETCH]], cells: &[f32], to: &mut [f32]) {
        let (first, last) = (cells[0], cells[cells.len() - 1]);
        stretch(weights, first, first, to);
        for (i, (left, right)) in cells.iter().zip(&cells[1..]).enumerate() {
            stretch(weights, *left, *right, &mut to[(i + 1) * self.cell..]);
        }
        stretch(weights, last, last, &mut to[cells.len() * self.cell..]);
    }

    /// A row of pixels.
    #[inline(always)]
    fn row(&self, y: usize, wide: &[f32], rows: &mut [&mut [f32]; CHANNELS]) {
        let (above, below, weight) = between_cells(y, self.cell, self.height);
        for (channel, row) in rows.iter_mut().enumerate() {
            let cells = |y: usize| &wide[(CHANNELS * y + channel) * self.stride + self.lead..][..row.len()];
            let (above, below) = (cells(above), cells(below));
            for (value, (a, b)) in row.iter_mut().zip(above.iter().zip(below)) {
                *value = weight.mul_add(b - a, *a);
            }
        }
    }
}

/// From one centre to the next; what goes beyond it is written again.
#[inline(always)]
fn stretch(weights: &[[f32; STRETCH]], left: f32, right: f32, to: &mut [f32]) {
    let difference = right - left;
    for (weights, to) in weights.iter().zip(to.as_chunks_mut::<STRETCH>().0) {
        for k in 0..STRETCH {
            to[k] = weights[k].mul_add(difference, left);
        }
    }
}
