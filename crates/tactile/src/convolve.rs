//! Separable convolution with mirrored borders, a few rows at a time in vector registers.

use crate::grid::Plane;
#[cfg(target_arch = "x86_64")]
use crate::simd::Avx2;
use crate::simd::{Lanes, Portable, SimdLevel};

/// Rows computed together, so that a loaded row serves several outputs.
const ROWS: usize = 4;

/// Columns are padded to a multiple of this, the widest vector.
const LANE_PADDING: usize = 16;

/// A plane whose rows are padded to whole vectors.
#[derive(Debug, Clone)]
pub(crate) struct Padded {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Padded {
    pub(crate) fn zeros(width: usize, height: usize) -> Self {
        let stride = width.next_multiple_of(LANE_PADDING);
        Self { width, height, stride, values: vec![0.0; stride * height] }
    }

    pub(crate) fn from_plane(plane: &Plane) -> Self {
        let mut padded = Self::zeros(plane.width, plane.height);
        for y in 0..plane.height {
            padded.values[y * padded.stride..][..plane.width].copy_from_slice(plane.row(y));
        }
        padded
    }

    pub(crate) fn transposed(&self) -> Self {
        const BLOCK: usize = 16;
        let mut out = Self::zeros(self.height, self.width);
        for by in (0..self.height).step_by(BLOCK) {
            for bx in (0..self.width).step_by(BLOCK) {
                for x in bx..(bx + BLOCK).min(self.width) {
                    for y in by..(by + BLOCK).min(self.height) {
                        out.values[x * out.stride + y] = self.values[y * self.stride + x];
                    }
                }
            }
        }
        out
    }
}

/// A surface that lies upright or transposed: only columns are ever convolved.
pub(crate) struct Oriented {
    plane: Padded,
    transposed: bool,
}

impl Oriented {
    pub(crate) fn new(plane: &Plane) -> Self {
        Self { plane: Padded::from_plane(plane), transposed: false }
    }

    /// Blurs along both axes, then puts the restored values back. `restore` is upright and transposed.
    pub(crate) fn blur(&mut self, weights: &[f32], restore: Option<&[Padded; 2]>, level: SimdLevel) {
        let across = convolve_columns(&self.plane, weights, None, level).transposed();
        self.transposed = !self.transposed;
        let restore = restore.map(|both| &both[usize::from(self.transposed)]);
        self.plane = convolve_columns(&across, weights, restore, level);
    }

    pub(crate) fn into_plane(self) -> Plane {
        let upright = if self.transposed { self.plane.transposed() } else { self.plane };
        let values = (0..upright.height)
            .flat_map(|y| upright.values[y * upright.stride..][..upright.width].iter().copied())
            .collect();
        Plane { width: upright.width, height: upright.height, values }
    }
}

/// Convolves every column with `weights`; borders are mirrored. Where `restore` is a number it replaces the result.
pub(crate) fn convolve_columns(
    input: &Padded,
    weights: &[f32],
    restore: Option<&Padded>,
    level: SimdLevel,
) -> Padded {
    let mut output = Padded::zeros(input.width, input.height);
    let half = weights.len() / 2;
    // Zeros around the weights let ROWS neighbouring outputs share one pass over the inputs; adding 0 * x changes
    // no bit of a finite sum.
    let mut padded_weights = vec![0.0; ROWS - 1];
    padded_weights.extend_from_slice(weights);
    padded_weights.resize(weights.len() + 2 * (ROWS - 1), 0.0);
    let mut first_row = 0;
    while first_row < input.height {
        let rows = ROWS.min(input.height - first_row);
        let sources: Vec<usize> = (0..weights.len() + rows - 1)
            .map(|i| mirrored((first_row + i) as isize - half as isize, input.height) * input.stride)
            .collect();
        let block = Block {
            input: &input.values,
            sources: &sources,
            weights: &padded_weights,
            restore: restore.map(|r| &r.values[..]),
            first: first_row * input.stride,
            stride: input.stride,
        };
        let out = &mut output.values;
        // SAFETY: `SimdLevel::available` names only what the processor has; see `Block::run` for the pointers.
        let done = unsafe {
            match (rows, level) {
                #[cfg(target_arch = "x86_64")]
                (ROWS, SimdLevel::Avx2) => block.run_avx2(out),
                (ROWS, _) => block.run::<Portable, ROWS, 1>(out, 0),
                (3, _) => block.run::<Portable, 3, 1>(out, 0),
                (2, _) => block.run::<Portable, 2, 1>(out, 0),
                _ => block.run::<Portable, 1, 1>(out, 0),
            }
        };
        debug_assert_eq!(done, input.stride, "rows are whole vectors");
        first_row += rows;
    }
    output
}

/// Row `i` of an image continued by mirroring at its first and last row, which are not repeated.
pub(crate) fn mirrored(i: isize, n: usize) -> usize {
    let n = n as isize;
    if n == 1 {
        return 0;
    }
    let i = i.rem_euclid(2 * (n - 1));
    (if i < n { i } else { 2 * (n - 1) - i }) as usize
}

/// A few output rows and what they are made of.
struct Block<'a> {
    input: &'a [f32],
    /// Offset of each input row, in the order in which they are added.
    sources: &'a [usize],
    /// Weights with `ROWS - 1` zeros on both sides.
    weights: &'a [f32],
    restore: Option<&'a [f32]>,
    /// Offset of the first output row.
    first: usize,
    stride: usize,
}

impl Block<'_> {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn run_avx2(&self, out: &mut [f32]) -> usize {
        // SAFETY: forwarded.
        unsafe {
            let done = self.run::<Avx2, ROWS, 2>(out, 0);
            self.run::<Avx2, ROWS, 1>(out, done)
        }
    }

    /// Computes `R` rows from column `from` on, `C` vectors at a time; returns the first column not done.
    ///
    /// # Safety
    /// The processor must have the instructions of `L`. Every row has `stride` values, a multiple of the vector
    /// length, so no access leaves `input`, `restore` or `out`.
    #[inline(always)]
    unsafe fn run<L: Lanes, const R: usize, const C: usize>(&self, out: &mut [f32], from: usize) -> usize {
        let step = L::COUNT * C;
        let mut column = from;
        while column + step <= self.stride {
            // SAFETY: see above; `column + step <= stride`.
            unsafe {
                let mut sums = [[L::splat(0.0); C]; R];
                for (i, &source) in self.sources.iter().enumerate() {
                    let at = self.input.as_ptr().add(source + column);
                    let values: [L::Vector; C] = std::array::from_fn(|c| L::load(at.add(c * L::COUNT)));
                    for (r, row) in sums.iter_mut().enumerate() {
                        // Input row i has weight i - r of output row r.
                        let weight = L::splat(*self.weights.get_unchecked(ROWS - 1 + i - r));
                        for (sum, &value) in row.iter_mut().zip(&values) {
                            *sum = L::fused(weight, value, *sum);
                        }
                    }
                }
                for (r, row) in sums.iter().enumerate() {
                    let offset = self.first + r * self.stride + column;
                    for (c, &sum) in row.iter().enumerate() {
                        let at = offset + c * L::COUNT;
                        let value = match self.restore {
                            Some(restore) => L::first_unless_nan(L::load(restore.as_ptr().add(at)), sum),
                            None => sum,
                        };
                        L::store(out.as_mut_ptr().add(at), value);
                    }
                }
            }
            column += step;
        }
        column
    }
}
