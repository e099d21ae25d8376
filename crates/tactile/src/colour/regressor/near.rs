//! The part of displaced pixels, block by block along a row.

use super::terrain::Terrain;
use super::{
    BLOCK, CHANNELS, NEAR, NEAR_FIELD, Place, Regressor, block_of, by_monomial, limited_normal, near_terms,
};
use crate::simd::Lanes;

/// Slopes, and heights in pixels, below this are none: no colour changes by a hundredth of a level. The blurs of a gel end in wide
/// tails of 1e-10 and less, whose powers are too small for normal numbers; many processors take a hundred times as long for such.
const NONE_BELOW: f32 = 1e-5;

#[inline(always)]
fn without_tail(x: f32) -> f32 {
    if x.abs() < NONE_BELOW { 0.0 } else { x }
}

/// The part of displaced pixels.
pub(super) struct Near<'a> {
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
    pub(super) fn new(model: &'a Regressor, terrain: &impl Terrain) -> Self {
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
    pub(super) fn row<L: Lanes>(
        &mut self,
        terrain: &impl Terrain,
        y: usize,
        out: &mut [&mut [f32]; CHANNELS],
    ) {
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
            let (gx, gy) = (without_tail(gx[x]), without_tail(gy[x]));
            [nx[x], ny[x]] = limited_normal(gx, gy, self.model.slope_limit);
            h[x] = (without_tail(height[x]) * scale).min(self.model.height_limit_mm);
        }
        near_terms(&nx, &ny, &h)
    }
}

/// Whether anything in a block is displaced.
#[inline(always)]
fn moves(block: &[&[f32; BLOCK]; 3]) -> bool {
    let mut largest = [0.0f32; BLOCK];
    for row in block {
        for (largest, value) in largest.iter_mut().zip(*row) {
            *largest = if value.abs() > *largest { value.abs() } else { *largest };
        }
    }
    largest.iter().fold(0.0f32, |all, &v| if v > all { v } else { all }) >= NONE_BELOW
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
