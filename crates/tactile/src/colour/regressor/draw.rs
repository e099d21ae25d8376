//! Drawing of the regression: the surroundings on cells, which are spread bilinearly over the pixels, then row by row
//! the part of displaced pixels. Only fused multiply-adds and sums in a fixed order, so that all vector units agree.

use super::pyramid::{DERIVATIVES, SURROUNDINGS, Surroundings, cell_px, double, surroundings};
use super::{
    AROUND_FIELD, NEAR, NEAR_FIELD, Place, Regressor, between_cells, cell_centre_px, limited_normal,
    near_terms,
};
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use std::ops::Range;

/// Pixels or cells that are computed together: the widest vector.
const BLOCK: usize = 16;

/// Pixels between two centres of cells that are written at once.
const STRETCH: usize = 8;

const CHANNELS: usize = 3;

/// A surface by rows, in pixels, 0 outside of some rows and columns.
pub(crate) trait Terrain {
    /// Width and height.
    fn size(&self) -> (usize, usize);
    /// Rows with heights or slopes other than 0.
    fn rows(&self) -> Range<usize>;
    /// Columns with heights or slopes other than 0.
    fn columns(&self) -> Range<usize>;
    /// Heights of a row; other columns than those may hold anything.
    fn heights(&self, y: usize) -> &[f32];
    /// Writes the slopes of a row into those columns.
    fn slopes(&self, y: usize, along_x: &mut [f32], along_y: &mut [f32]);
}

/// A surface as planes of heights and slopes.
pub(crate) struct Planes<'a> {
    heights: &'a Plane,
    slopes: Option<[&'a Plane; 2]>,
}

impl<'a> Planes<'a> {
    pub(crate) fn new(heights: &'a Plane, along_x: &'a Plane, along_y: &'a Plane) -> Self {
        Self { heights, slopes: Some([along_x, along_y]) }
    }

    /// Without slopes.
    pub(crate) fn of_heights(heights: &'a Plane) -> Self {
        Self { heights, slopes: None }
    }
}

impl Terrain for Planes<'_> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.heights.width, self.heights.height)
    }
    #[inline(always)]
    fn rows(&self) -> Range<usize> {
        0..self.heights.height
    }
    #[inline(always)]
    fn columns(&self) -> Range<usize> {
        0..self.heights.width
    }
    #[inline(always)]
    fn heights(&self, y: usize) -> &[f32] {
        self.heights.row(y)
    }
    #[inline(always)]
    fn slopes(&self, y: usize, along_x: &mut [f32], along_y: &mut [f32]) {
        if let Some([x, y_plane]) = self.slopes {
            along_x[..x.width].copy_from_slice(x.row(y));
            along_y[..x.width].copy_from_slice(y_plane.row(y));
        }
    }
}

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
    let Surroundings { fine, coarse } = surroundings(terrain, cell, model.mm_per_px);
    let fields = by_monomial::<AROUND_FIELD>(&model.around, SURROUNDINGS);
    let cells = Cells { model, fields: &fields, size: terrain.size() };
    cells.combine::<L>(&coarse, DERIVATIVES, 2 * cell, &mut scratch.coarse);
    cells.combine::<L>(&fine, 0, cell, &mut scratch.fine);
    let (w, h) = (fine[0].width, fine[0].height);
    let (coarse_w, coarse_h) = (coarse[0].width, coarse[0].height);
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

/// The surroundings on cells.
struct Cells<'a> {
    model: &'a Regressor,
    fields: &'a [f32],
    size: (usize, usize),
}

impl Cells<'_> {
    /// The sums over features from `first` on, on their cells of `cell_px` pixels. `out` gets some values more.
    #[inline(always)]
    fn combine<L: Lanes>(
        &self,
        features: &[Plane],
        first: usize,
        cell_px: usize,
        out: &mut [Vec<f32>; CHANNELS],
    ) {
        let (w, h) = (features[0].width, features[0].height);
        let place = Place::of(self.size);
        let u: Vec<f32> =
            (0..w.next_multiple_of(BLOCK)).map(|x| place.u(cell_centre_px(x, cell_px))).collect();
        out.iter_mut().for_each(|out| out.resize(w * h + BLOCK, 0.0));
        let limits = &self.model.around_limit[first..first + features.len()];
        let all = CHANNELS * SURROUNDINGS;
        let n = CHANNELS * features.len();
        let field = |m: usize| &self.fields[m * all + CHANNELS * first..][..n];
        let (f0, f1, f2, f3, f4, f5) = (field(0), field(1), field(2), field(3), field(4), field(5));
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
                for (i, (feature, &limit)) in features.iter().zip(limits).enumerate() {
                    let mut f = [0.0f32; BLOCK];
                    match feature.values.get(at..at + BLOCK) {
                        Some(values) => f.copy_from_slice(values),
                        None => f[..w * h - at].copy_from_slice(&feature.values[at..]),
                    }
                    for f in &mut f {
                        *f = if *f > limit { limit } else { *f };
                        *f = if *f < -limit { -limit } else { *f };
                    }
                    held[i] = f;
                }
                // SAFETY: the caller has the instructions of `L`.
                unsafe { weigh::<L>(&held[..features.len()], &c, &mut sums) };
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
        let mut left = cells[0];
        for (i, &right) in cells.iter().chain(cells.last()).enumerate() {
            let difference = right - left;
            // What goes beyond the next centre is written again.
            for (j, weights) in weights.iter().enumerate() {
                let Some(to) = to[i * self.cell + j * STRETCH..].first_chunk_mut::<STRETCH>() else {
                    continue;
                };
                let mut values = [0.0; STRETCH];
                for k in 0..STRETCH {
                    values[k] = weights[k].mul_add(difference, left);
                }
                *to = values;
            }
            left = right;
        }
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

/// The part of displaced pixels.
struct Near<'a> {
    model: &'a Regressor,
    place: Place,
    /// Coefficients by monomial, term and channel.
    fields: Vec<f32>,
    u: Vec<f32>,
    /// Heights and slopes of a row, 0 beyond it.
    rows: [Vec<f32>; 3],
}

impl<'a> Near<'a> {
    #[inline(always)]
    fn new(model: &'a Regressor, terrain: &impl Terrain) -> Self {
        let (place, padded) = (Place::of(terrain.size()), terrain.size().0.next_multiple_of(BLOCK));
        Self {
            model,
            place,
            fields: by_monomial::<NEAR_FIELD>(&model.near, NEAR),
            u: (0..padded).map(|x| place.u(x as f32)).collect(),
            rows: [0, 1, 2].map(|_| vec![0.0; padded]),
        }
    }

    /// Adds what the displaced pixels of row `y` change.
    #[inline(always)]
    fn row<L: Lanes>(&mut self, terrain: &impl Terrain, y: usize, out: &mut [&mut [f32]; CHANNELS]) {
        let columns = terrain.columns();
        let [heights, gx, gy] = &mut self.rows;
        heights[columns.clone()].copy_from_slice(&terrain.heights(y)[columns.clone()]);
        terrain.slopes(y, gx, gy);
        let mut powers = [[0.0; CHANNELS * NEAR]; 4];
        let mut ready = false;
        for start in (columns.start / BLOCK * BLOCK..columns.end).step_by(BLOCK) {
            let [heights, gx, gy] = &self.rows;
            let block = [block_of(heights, start), block_of(gx, start), block_of(gy, start)];
            if !moves(&block) {
                continue;
            }
            if !ready {
                powers = self.powers(y);
                ready = true;
            }
            // SAFETY: the caller has the instructions of `L`.
            let sums = unsafe { combine::<L>(&self.terms(&block), &powers, block_of(&self.u, start)) };
            for (out, sum) in out.iter_mut().zip(&sums) {
                let n = BLOCK.min(out.len() - start);
                match out[start..start + n].as_chunks_mut::<BLOCK>() {
                    ([out], _) => {
                        for (out, sum) in out.iter_mut().zip(sum) {
                            *out += sum;
                        }
                    }
                    (_, out) => {
                        for (out, sum) in out.iter_mut().zip(sum) {
                            *out += sum;
                        }
                    }
                }
            }
        }
    }

    /// For a row the fields of each term and channel as polynomials of third degree in u, by powers.
    #[inline(always)]
    fn powers(&self, y: usize) -> [[f32; CHANNELS * NEAR]; 4] {
        let v = self.place.v(y as f32);
        let mut powers = [[0.0; CHANNELS * NEAR]; 4];
        let ([c0, c1, c2, c3, c4, c5, c6, c7, c8, c9], _) = self.fields.as_chunks::<{ CHANNELS * NEAR }>()
        else {
            return powers;
        };
        for i in 0..CHANNELS * NEAR {
            powers[0][i] = v.mul_add(v.mul_add(v.mul_add(c9[i], c5[i]), c2[i]), c0[i]);
            powers[1][i] = v.mul_add(v.mul_add(c8[i], c4[i]), c1[i]);
            powers[2][i] = v.mul_add(c7[i], c3[i]);
            powers[3][i] = c6[i];
        }
        powers
    }

    /// The terms of a block of pixels: heights and both slopes in, one row a term out.
    #[inline(always)]
    fn terms(&self, [height, gx, gy]: &[&[f32; BLOCK]; 3]) -> [[f32; BLOCK]; NEAR] {
        let scale = self.model.mm_per_px as f32;
        let (mut nx, mut ny, mut h) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for x in 0..BLOCK {
            [nx[x], ny[x]] = limited_normal(gx[x], gy[x], self.model.slope_limit);
            h[x] = (height[x] * scale).min(self.model.height_limit_mm);
        }
        near_terms(&nx, &ny, &h)
    }
}

#[inline(always)]
fn block_of(row: &[f32], start: usize) -> &[f32; BLOCK] {
    row[start..].first_chunk().expect("rows are padded to whole blocks")
}

/// Whether anything in a block is not 0.
#[inline(always)]
fn moves(block: &[&[f32; BLOCK]; 3]) -> bool {
    let mut bits = [0u32; BLOCK];
    for row in block {
        for (bits, value) in bits.iter_mut().zip(*row) {
            *bits |= value.to_bits() << 1;
        }
    }
    bits.iter().fold(0, |all, b| all | b) != 0
}

/// Sums over terms for a block of pixels, by channel: the fields, cubic in u, are taken as straight lines through their
/// value and slope in the middle of the block. A block is so short that this changes them by less than one part in a
/// thousand.
///
/// # Safety
/// The processor must have the instructions of `L`.
#[inline(always)]
unsafe fn combine<L: Lanes>(
    terms: &[[f32; BLOCK]; NEAR],
    powers: &[[f32; CHANNELS * NEAR]; 4],
    u: &[f32; BLOCK],
) -> [[f32; BLOCK]; CHANNELS] {
    let middle = 0.5 * (u[BLOCK / 2 - 1] + u[BLOCK / 2]);
    let (mut value, mut slope) = ([0.0; CHANNELS * NEAR], [0.0; CHANNELS * NEAR]);
    for i in 0..CHANNELS * NEAR {
        let (p0, p1, p2, p3) = (powers[0][i], powers[1][i], powers[2][i], powers[3][i]);
        value[i] = middle.mul_add(middle.mul_add(middle.mul_add(p3, p2), p1), p0);
        slope[i] = middle.mul_add(middle.mul_add(3.0 * p3, 2.0 * p2), p1);
    }
    let mut from_middle = *u;
    for u in &mut from_middle {
        *u -= middle;
    }
    let mut sums = [[0.0; BLOCK]; CHANNELS];
    for half in (0..BLOCK).step_by(L::COUNT) {
        // SAFETY: a block is whole vectors, forwarded otherwise.
        unsafe {
            let (mut values, mut slopes) = ([L::splat(0.0); CHANNELS], [L::splat(0.0); CHANNELS]);
            for (t, term) in terms.iter().enumerate() {
                let term = L::load(term.as_ptr().add(half));
                for c in 0..CHANNELS {
                    values[c] = L::fused(term, L::splat(value[CHANNELS * t + c]), values[c]);
                    slopes[c] = L::fused(term, L::splat(slope[CHANNELS * t + c]), slopes[c]);
                }
            }
            let from_middle = L::load(from_middle.as_ptr().add(half));
            for c in 0..CHANNELS {
                L::store(sums[c].as_mut_ptr().add(half), L::fused(from_middle, slopes[c], values[c]));
            }
        }
    }
    sums
}
