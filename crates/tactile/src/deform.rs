//! Stage `deform`: the gel around a contact, by a pyramid of blurs.

use crate::grid::Plane;
use crate::indent::Imprint;
#[cfg(target_arch = "x86_64")]
use crate::simd::Avx2;
use crate::simd::{Lanes, Portable, SimdLevel};

/// The last blur, which smooths the border of the contact too.
const FINAL_KERNEL_PX: u32 = 5;

/// Rows computed together, so that a loaded row serves several outputs.
const ROWS: usize = 4;

/// Columns are padded to a multiple of this, the widest vector.
const LANE_PADDING: usize = 16;

/// The height of the gel surface above its rest state, towards the camera, in pixels.
///
/// Taxim's deformation (Si & Yuan 2022, and its source): the contact map is blurred with each kernel in turn, and
/// after each blur the core of the contact (deeper than `restore_depth_fraction` of the press) gets its own height
/// back; a last 5 x 5 blur is not restored. Gaussians are OpenCV's: `sigma = 0.3 ((k - 1) / 2 - 1) + 0.8`,
/// `[1, 4, 6, 4, 1] / 16` for k = 5, borders mirrored without repeating the edge.
pub fn deform(
    imprint: &Imprint,
    kernels_px: &[u32],
    restore_depth_fraction: f64,
    metres_per_px: f64,
    level: SimdLevel,
) -> Plane {
    let contact = &imprint.depth_px;
    let core = (restore_depth_fraction * imprint.press_depth_m / metres_per_px) as f32;
    let restored = Plane {
        values: contact.values.iter().map(|&d| if d > core { d } else { f32::NAN }).collect(),
        ..*contact
    };
    let mut surface = Oriented::new(contact);
    let restore = [Padded::from_plane(&restored), Padded::from_plane(&restored).transposed()];
    for &kernel in kernels_px {
        surface.blur(&gaussian(kernel), Some(&restore), level);
    }
    surface.blur(&gaussian(FINAL_KERNEL_PX), None, level);
    surface.into_plane()
}

/// OpenCV's automatic Gaussian of an odd size.
pub(crate) fn gaussian(size: u32) -> Vec<f32> {
    match size {
        3 => return vec![0.25, 0.5, 0.25],
        5 => return vec![0.0625, 0.25, 0.375, 0.25, 0.0625],
        7 => return vec![0.03125, 0.109375, 0.21875, 0.28125, 0.21875, 0.109375, 0.03125],
        _ => {}
    }
    let half = f64::from(size / 2);
    let sigma = 0.3 * (f64::from(size - 1) * 0.5 - 1.0) + 0.8;
    let weights: Vec<f64> = (0..size)
        .map(|i| {
            let x = f64::from(i) - half;
            libm::exp(-x * x / (2.0 * sigma * sigma))
        })
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

/// A plane whose rows are padded to whole vectors.
#[derive(Debug, Clone)]
struct Padded {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Padded {
    fn zeros(width: usize, height: usize) -> Self {
        let stride = width.next_multiple_of(LANE_PADDING);
        Self { width, height, stride, values: vec![0.0; stride * height] }
    }

    fn from_plane(plane: &Plane) -> Self {
        let mut padded = Self::zeros(plane.width, plane.height);
        for y in 0..plane.height {
            padded.values[y * padded.stride..][..plane.width].copy_from_slice(plane.row(y));
        }
        padded
    }

    fn transposed(&self) -> Self {
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
struct Oriented {
    plane: Padded,
    transposed: bool,
}

impl Oriented {
    fn new(plane: &Plane) -> Self {
        Self { plane: Padded::from_plane(plane), transposed: false }
    }

    /// Blurs along both axes, then puts the restored values back. `restore` is upright and transposed.
    fn blur(&mut self, weights: &[f32], restore: Option<&[Padded; 2]>, level: SimdLevel) {
        let across = convolve_columns(&self.plane, weights, None, level).transposed();
        self.transposed = !self.transposed;
        let restore = restore.map(|both| &both[usize::from(self.transposed)]);
        self.plane = convolve_columns(&across, weights, restore, level);
    }

    fn into_plane(self) -> Plane {
        let upright = if self.transposed { self.plane.transposed() } else { self.plane };
        let values = (0..upright.height)
            .flat_map(|y| upright.values[y * upright.stride..][..upright.width].iter().copied())
            .collect();
        Plane { width: upright.width, height: upright.height, values }
    }
}

/// Convolves every column with `weights`; borders are mirrored. Where `restore` is a number it replaces the result.
fn convolve_columns(input: &Padded, weights: &[f32], restore: Option<&Padded>, level: SimdLevel) -> Padded {
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
fn mirrored(i: isize, n: usize) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::indent::{PressedGel, indent};

    /// The same blur as plain sums in f64, with borders by definition.
    fn blur_reference(plane: &Plane, size: u32) -> Plane {
        let weights: Vec<f64> = gaussian(size).iter().map(|&w| f64::from(w)).collect();
        let half = size as isize / 2;
        let pass = |input: &[f64], width: usize, height: usize, dx: isize, dy: isize| -> Vec<f64> {
            let mut out = vec![0.0; width * height];
            for y in 0..height {
                for x in 0..width {
                    for (k, w) in weights.iter().enumerate() {
                        let o = k as isize - half;
                        let sx = mirrored(x as isize + o * dx, width);
                        let sy = mirrored(y as isize + o * dy, height);
                        out[y * width + x] += w * input[sy * width + sx];
                    }
                }
            }
            out
        };
        let values: Vec<f64> = plane.values.iter().map(|&v| f64::from(v)).collect();
        let vertical = pass(&values, plane.width, plane.height, 0, 1);
        let both = pass(&vertical, plane.width, plane.height, 1, 0);
        Plane { values: both.iter().map(|&v| v as f32).collect(), ..*plane }
    }

    fn bumps(width: usize, height: usize) -> Plane {
        let mut plane = Plane::filled(width, height, 0.0);
        for y in 0..height {
            for x in 0..width {
                let (fx, fy) = (x as f32 * 0.21, y as f32 * 0.37);
                plane.values[y * width + x] = (12.0 * fx.sin() * fy.cos() - 4.0).max(0.0);
            }
        }
        plane
    }

    fn largest_difference(a: &Plane, b: &Plane) -> f32 {
        a.values.iter().zip(&b.values).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
    }

    fn press(width: usize, height: usize) -> (Imprint, f64) {
        let grid = Grid { width_px: width, height_px: height, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };
        (indent(&bumps(width, height), &grid, &gel, 20.0).unwrap(), grid.metres_per_px)
    }

    #[test]
    fn blurs_match_plain_sums_for_all_sizes_and_shapes() {
        for (width, height) in [(40, 30), (64, 48), (33, 7), (5, 61), (1, 9)] {
            for size in [5, 7, 11, 21, 51, 71] {
                let plane = bumps(width, height);
                let mut surface = Oriented::new(&plane);
                surface.blur(&gaussian(size), None, SimdLevel::best());
                let ours = surface.into_plane();
                let difference = largest_difference(&ours, &blur_reference(&plane, size));
                assert!(difference < 2e-5, "{width}x{height}, kernel {size}: {difference}");
            }
        }
    }

    /// OpenCV's reflect-101: `gfedcb|abcdefgh|gfedcba`.
    #[test]
    fn borders_are_mirrored_without_repeating_the_edge() {
        let around: Vec<usize> = (-5..10).map(|i| mirrored(i, 4)).collect();
        assert_eq!(around, [1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1, 2, 3]);
        assert_eq!(mirrored(-3, 1), 0);
    }

    #[test]
    fn every_vector_path_gives_the_same_bits() {
        for (width, height) in [(80, 61), (50, 34)] {
            let (imprint, metres_per_px) = press(width, height);
            let run = |level| deform(&imprint, &[31, 21, 11, 5], 0.4, metres_per_px, level).values;
            let portable: Vec<u32> = run(SimdLevel::Portable).iter().map(|v| v.to_bits()).collect();
            for level in SimdLevel::available() {
                let bits: Vec<u32> = run(level).iter().map(|v| v.to_bits()).collect();
                assert!(bits == portable, "{level:?} differs at {width}x{height}");
            }
        }
    }

    /// The core of the contact keeps its height up to the last small blur, and far away the gel is at rest.
    #[test]
    fn the_contact_is_restored_and_the_far_field_rests() {
        let grid = Grid { width_px: 160, height_px: 120, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };
        let mut stamp = Plane::filled(160, 120, f32::NEG_INFINITY);
        for y in 50..70 {
            for x in 60..100 {
                stamp.values[y * 160 + x] = 0.0;
            }
        }
        let imprint = indent(&stamp, &grid, &gel, 5.0).unwrap();
        let depth = (imprint.press_depth_m / 1e-4) as f32;
        let surface = deform(&imprint, &[21, 11, 5], 0.4, 1e-4, SimdLevel::best());
        assert!((surface.at(80, 60) - depth).abs() < 1e-4 * depth);
        assert_eq!(surface.at(5, 5), 0.0);
        let rim = surface.at(103, 60);
        assert!(
            rim > 0.05 * depth && rim < 0.9 * depth,
            "the gel rises around the contact: {rim} of {depth}"
        );
    }

    #[test]
    fn gaussians_are_opencvs() {
        assert!((gaussian(71)[35] - 0.036_312_7).abs() < 1e-7, "{}", gaussian(71)[35]);
        for size in [5, 11, 21, 51, 71] {
            let sum: f64 = gaussian(size).iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() < 1e-6);
        }
    }
}
