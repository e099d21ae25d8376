//! Convolution of a plane with an even kernel, by Fourier transforms.

use super::{Buffer, Fft, LANES, Lane, good_length};
use crate::simd::SimdLevel;

/// Convolves planes of one size with one kernel.
///
/// Real columns are transformed two at a time, as real and imaginary parts; rows of zeros are not transformed along x.
#[derive(Debug, Clone)]
pub(crate) struct Convolver {
    width: usize,
    height: usize,
    along_x: Fft,
    along_y: Fft,
    level: SimdLevel,
    /// Spectrum of the kernel over `width * height` of the transform: real, since the kernel is even. Eight rows
    /// of it a block, half of each row.
    kernel: Vec<Lane>,
    work: Work,
}

/// The half spectrum between the passes, and what the transforms need.
#[derive(Debug, Clone)]
struct Work {
    /// Distance between the two columns that are transformed together; a row has twice as many.
    pair: usize,
    /// Eight rows a block; of a block all columns, each with its eight values.
    re: Vec<Lane>,
    im: Vec<Lane>,
    column: [Buffer; 2],
    row: [Buffer; 2],
}

impl Work {
    fn new(width: usize, along_x: &Fft, along_y: &Fft) -> Self {
        let pair = width.div_ceil(2).next_multiple_of(LANES);
        let blocks = (along_y.length() / 2 + 1).div_ceil(LANES);
        Self {
            pair,
            re: vec![[0.0; LANES]; blocks * 2 * pair],
            im: vec![[0.0; LANES]; blocks * 2 * pair],
            column: [Buffer::new(along_y.length()), Buffer::new(along_y.length())],
            row: [Buffer::new(along_x.length()), Buffer::new(along_x.length())],
        }
    }
}

impl Convolver {
    /// For planes of `width` x `height`. `kernel(dx, dy)` is even in both and counts up to `reach` in either.
    pub(crate) fn new(
        width: usize,
        height: usize,
        reach: usize,
        level: SimdLevel,
        kernel: impl Fn(usize, usize) -> f64,
    ) -> Self {
        // Wrapped around, the kernel must not meet the plane again.
        let padded = |n: usize| good_length(n + reach.min(n - 1));
        let (w, h) = (padded(width), padded(height));
        let (along_x, along_y) = (Fft::new(w), Fft::new(h));
        let mut quarter = vec![0.0; (w / 2 + 1) * (h / 2 + 1)];
        for y in 0..=(h / 2).min(reach) {
            for x in 0..=(w / 2).min(reach) {
                quarter[y * (w / 2 + 1) + x] = kernel(x, y);
            }
        }
        let wrapped: Vec<f64> = (0..w * h)
            .map(|i| quarter[(i / w).min(h - i / w) * (w / 2 + 1) + (i % w).min(w - i % w)])
            .collect();
        let mut work = Work::new(w, &along_x, &along_y);
        columns_forward(&wrapped, w, h, &along_y, &mut work, level);
        let scale = 1.0 / (w * h) as f64;
        let mut spectrum = Vec::with_capacity((h / 2 + 1).div_ceil(LANES) * (w / 2 + 1));
        for block in 0..(h / 2 + 1).div_ceil(LANES) {
            load_rows(&mut work, block, w);
            let [row, scratch] = &mut work.row;
            along_x.forward(row, scratch, level);
            spectrum.extend(row.re[..=w / 2].iter().map(|lane| lane.map(|v| v * scale)));
        }
        let work = Work::new(width, &along_x, &along_y);
        Self { width, height, along_x, along_y, level, kernel: spectrum, work }
    }

    /// `out` becomes `plane` convolved with the kernel; both have the size of the convolver.
    pub(crate) fn apply(&mut self, plane: &[f64], out: &mut [f64]) {
        let (w, h) = (self.along_x.length(), self.along_y.length());
        columns_forward(plane, self.width, self.height, &self.along_y, &mut self.work, self.level);
        for block in 0..(h / 2 + 1).div_ceil(LANES) {
            load_rows(&mut self.work, block, self.width);
            let [row, scratch] = &mut self.work.row;
            self.along_x.forward(row, scratch, self.level);
            let kernel = &self.kernel[block * (w / 2 + 1)..][..w / 2 + 1];
            for x in 0..w {
                let k = &kernel[x.min(w - x)];
                for l in 0..LANES {
                    row.re[x][l] *= k[l];
                    row.im[x][l] *= k[l];
                }
            }
            self.along_x.inverse(row, scratch, self.level);
            store_rows(&mut self.work, block, self.width);
        }
        self.columns_inverse(out);
    }

    fn columns_inverse(&mut self, out: &mut [f64]) {
        let (width, n) = (self.width, self.along_y.length());
        let Work { pair, re, im, column: [column, scratch], .. } = &mut self.work;
        let pair = *pair;
        for x in (0..pair).step_by(LANES) {
            for k in 0..=n / 2 {
                let (at, lane, mirror) = (k / LANES * 2 * pair + x, k % LANES, (n - k) % n);
                for l in 0..LANES {
                    let (fr, fi) = (re[at + l][lane], im[at + l][lane]);
                    let (gr, gi) = (re[at + pair + l][lane], im[at + pair + l][lane]);
                    column.re[mirror][l] = fr + gi;
                    column.im[mirror][l] = gr - fi;
                    column.re[k][l] = fr - gi;
                    column.im[k][l] = fi + gr;
                }
            }
            self.along_y.inverse(column, scratch, self.level);
            for y in 0..self.height {
                let row = &mut out[y * width..(y + 1) * width];
                for (v, &c) in row.iter_mut().skip(x).zip(&column.re[y]) {
                    *v = c;
                }
                for (v, &c) in row.iter_mut().skip(x + pair).zip(&column.im[y]) {
                    *v = c;
                }
            }
        }
    }
}

/// Transforms the columns, and takes the two of a pair apart by the symmetry of real signals.
fn columns_forward(plane: &[f64], width: usize, height: usize, fft: &Fft, work: &mut Work, level: SimdLevel) {
    let Work { pair, re, im, column: [column, scratch], .. } = work;
    let (pair, n) = (*pair, fft.length());
    for x in (0..pair).step_by(LANES) {
        let zero = |from: usize| {
            let columns = from.min(width)..(from + LANES).min(width);
            plane.chunks_exact(width).all(|row| row[columns.clone()].iter().all(|&v| v == 0.0))
        };
        if zero(x) && zero(x + pair) {
            for at in (0..=n / 2).step_by(LANES).map(|k| k / LANES * 2 * pair + x) {
                for i in [at, at + pair] {
                    re[i..i + LANES].fill([0.0; LANES]);
                    im[i..i + LANES].fill([0.0; LANES]);
                }
            }
            continue;
        }
        for y in 0..n {
            let (a, b) = (&mut column.re[y], &mut column.im[y]);
            (*a, *b) = ([0.0; LANES], [0.0; LANES]);
            if y < height {
                let row = &plane[y * width..(y + 1) * width];
                for (c, &v) in a.iter_mut().zip(row.iter().skip(x)) {
                    *c = v;
                }
                for (c, &v) in b.iter_mut().zip(row.iter().skip(x + pair)) {
                    *c = v;
                }
            }
        }
        fft.forward(column, scratch, level);
        for k in 0..=n / 2 {
            let (at, lane, mirror) = (k / LANES * 2 * pair + x, k % LANES, (n - k) % n);
            for l in 0..LANES {
                let (ar, ai) = (column.re[k][l], column.im[k][l]);
                let (br, bi) = (column.re[mirror][l], column.im[mirror][l]);
                re[at + l][lane] = 0.5 * (ar + br);
                im[at + l][lane] = 0.5 * (ai - bi);
                re[at + pair + l][lane] = 0.5 * (ai + bi);
                im[at + pair + l][lane] = 0.5 * (br - ar);
            }
        }
    }
}

/// A block of the half spectrum into the row buffer, zeros behind the plane's width.
fn load_rows(work: &mut Work, block: usize, width: usize) {
    let from = block * 2 * work.pair..block * 2 * work.pair + width;
    let row = &mut work.row[0];
    row.re[..width].copy_from_slice(&work.re[from.clone()]);
    row.im[..width].copy_from_slice(&work.im[from]);
    row.re[width..].fill([0.0; LANES]);
    row.im[width..].fill([0.0; LANES]);
}

fn store_rows(work: &mut Work, block: usize, width: usize) {
    let to = block * 2 * work.pair..block * 2 * work.pair + width;
    work.re[to.clone()].copy_from_slice(&work.row[0].re[..width]);
    work.im[to].copy_from_slice(&work.row[0].im[..width]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against plain sums, for kernels that reach over the plane and for such that end inside it.
    #[test]
    fn convolutions_equal_plain_sums() {
        let kernel = |x: usize, y: usize| 1.0 / (1.0 + (x * x) as f64 + 2.0 * (y * y) as f64);
        for (w, h, reach) in [(37, 20, 100), (20, 41, 100), (40, 33, 9), (1, 1, 5), (64, 3, 64), (5, 50, 2)] {
            let plane: Vec<f64> = (0..w * h).map(|i| ((i * i) as f64 * 0.37).sin()).collect();
            let mut out = vec![0.0; w * h];
            let mut convolver = Convolver::new(w, h, reach, SimdLevel::best(), kernel);
            convolver.apply(&plane, &mut out);
            for y in 0..h {
                for x in 0..w {
                    let mut sum = 0.0;
                    for v in 0..h {
                        for u in 0..w {
                            let (dx, dy) = (x.abs_diff(u), y.abs_diff(v));
                            if dx <= reach && dy <= reach {
                                sum += plane[v * w + u] * kernel(dx, dy);
                            }
                        }
                    }
                    assert!((out[y * w + x] - sum).abs() < 1e-11, "{w}x{h}, {reach}: ({x}, {y})");
                }
            }
        }
    }
}
