//! Discrete Fourier transforms of even lengths whose factors are 2, 3 and 5, eight at a time.
//!
//! Written here for its eight transforms at a time, one to a lane: libraries do one, and choose their algorithm by the
//! processor where they use vectors, which changes the last bits. Here the order of operations is fixed and no
//! multiplication is fused, so that AVX2 and plain code give the same bits.

mod plane;

pub(crate) use plane::Convolver;

use crate::simd::SimdLevel;
use std::f64::consts::PI;

/// Transforms that are done at once.
pub(crate) const LANES: usize = 8;

/// One number of each of the eight transforms.
pub(crate) type Lane = [f64; LANES];

/// Complex numbers of the eight transforms, real and imaginary parts apart.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffer {
    pub(crate) re: Vec<Lane>,
    pub(crate) im: Vec<Lane>,
}

impl Buffer {
    pub(crate) fn new(n: usize) -> Self {
        Self { re: vec![[0.0; LANES]; n], im: vec![[0.0; LANES]; n] }
    }
}

/// The smallest even number from `n` on whose only factors are 2, 3 and 5.
pub(crate) fn good_length(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for factor in [2, 3, 5] {
            while m.is_multiple_of(factor) {
                m /= factor;
            }
        }
        m == 1
    };
    let mut length = n.max(2).next_multiple_of(2);
    while !smooth(length) {
        length += 2;
    }
    length
}

/// A transform of one length.
#[derive(Debug, Clone)]
pub(crate) struct Fft {
    length: usize,
    radices: Vec<usize>,
    /// `exp(-2 pi i j / length)`
    twiddles: Vec<(f64, f64)>,
}

impl Fft {
    /// `length` must be a [`good_length`].
    pub(crate) fn new(length: usize) -> Self {
        let (mut radices, mut rest) = (Vec::new(), length);
        for radix in [4, 2, 3, 5] {
            while rest.is_multiple_of(radix) {
                radices.push(radix);
                rest /= radix;
            }
        }
        let twiddle = |j| {
            let angle = -2.0 * PI * j as f64 / length as f64;
            (libm::cos(angle), libm::sin(angle))
        };
        Self { length, radices, twiddles: (0..length).map(twiddle).collect() }
    }

    /// Number of values.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// `X_k = sum_j x_j exp(-2 pi i j k / n)`, in place; `scratch` has the same length.
    pub(crate) fn forward(&self, data: &mut Buffer, scratch: &mut Buffer, level: SimdLevel) {
        #[cfg(target_arch = "x86_64")]
        if level == SimdLevel::Avx2 {
            // SAFETY: the level is only there on processors that have it.
            unsafe { self.run_avx2(data, scratch) };
            return;
        }
        let _ = level;
        self.run(data, scratch);
    }

    /// The inverse times `n`: real and imaginary parts change places before and after.
    pub(crate) fn inverse(&self, data: &mut Buffer, scratch: &mut Buffer, level: SimdLevel) {
        std::mem::swap(&mut data.re, &mut data.im);
        self.forward(data, scratch, level);
        std::mem::swap(&mut data.re, &mut data.im);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn run_avx2(&self, data: &mut Buffer, scratch: &mut Buffer) {
        self.run(data, scratch);
    }

    /// Stockham's algorithm: every pass writes in order into the other buffer.
    #[inline(always)]
    fn run(&self, data: &mut Buffer, scratch: &mut Buffer) {
        let (mut n, mut stride) = (self.length, 1);
        for &radix in &self.radices {
            match radix {
                2 => self.pass(n, stride, data, scratch, butterfly2),
                3 => self.pass(n, stride, data, scratch, butterfly3),
                4 => self.pass(n, stride, data, scratch, butterfly4),
                _ => self.pass(n, stride, data, scratch, butterfly5),
            }
            std::mem::swap(data, scratch);
            n /= radix;
            stride *= radix;
        }
    }

    #[inline(always)]
    fn pass<const R: usize>(
        &self,
        n: usize,
        stride: usize,
        from: &Buffer,
        to: &mut Buffer,
        butterfly: impl Fn([Lane; R], [Lane; R]) -> ([Lane; R], [Lane; R]),
    ) {
        let m = n / R;
        for p in 0..m {
            for q in 0..stride {
                let at = |j: usize| q + stride * (p + j * m);
                let (re, im) = butterfly(
                    std::array::from_fn(|j| from.re[at(j)]),
                    std::array::from_fn(|j| from.im[at(j)]),
                );
                for k in 0..R {
                    let (c, s) = self.twiddles[p * k * stride];
                    let out = q + stride * (R * p + k);
                    to.re[out] = lanes(|l| re[k][l] * c - im[k][l] * s);
                    to.im[out] = lanes(|l| re[k][l] * s + im[k][l] * c);
                }
            }
        }
    }
}

#[inline(always)]
fn lanes(f: impl Fn(usize) -> f64) -> Lane {
    std::array::from_fn(f)
}

#[inline(always)]
fn add(a: Lane, b: Lane) -> Lane {
    lanes(|l| a[l] + b[l])
}

#[inline(always)]
fn sub(a: Lane, b: Lane) -> Lane {
    lanes(|l| a[l] - b[l])
}

#[inline(always)]
fn butterfly2(re: [Lane; 2], im: [Lane; 2]) -> ([Lane; 2], [Lane; 2]) {
    ([add(re[0], re[1]), sub(re[0], re[1])], [add(im[0], im[1]), sub(im[0], im[1])])
}

#[inline(always)]
fn butterfly4(re: [Lane; 4], im: [Lane; 4]) -> ([Lane; 4], [Lane; 4]) {
    let (er, ei) = (add(re[0], re[2]), add(im[0], im[2]));
    let (fr, fi) = (sub(re[0], re[2]), sub(im[0], im[2]));
    let (gr, gi) = (add(re[1], re[3]), add(im[1], im[3]));
    let (hr, hi) = (sub(re[1], re[3]), sub(im[1], im[3]));
    // The odd terms are turned by -i.
    (
        [add(er, gr), add(fr, hi), sub(er, gr), sub(fr, hi)],
        [add(ei, gi), sub(fi, hr), sub(ei, gi), add(fi, hr)],
    )
}

#[inline(always)]
fn butterfly3(re: [Lane; 3], im: [Lane; 3]) -> ([Lane; 3], [Lane; 3]) {
    const SIN: f64 = 0.866_025_403_784_438_6; // sin(2 pi / 3)
    let (sr, si) = (add(re[1], re[2]), add(im[1], im[2]));
    let mr = lanes(|l| re[0][l] - 0.5 * sr[l]);
    let mi = lanes(|l| im[0][l] - 0.5 * si[l]);
    let dr = lanes(|l| SIN * (re[1][l] - re[2][l]));
    let di = lanes(|l| SIN * (im[1][l] - im[2][l]));
    ([add(re[0], sr), add(mr, di), sub(mr, di)], [add(im[0], si), sub(mi, dr), add(mi, dr)])
}

#[inline(always)]
fn butterfly5(re: [Lane; 5], im: [Lane; 5]) -> ([Lane; 5], [Lane; 5]) {
    // Cosine and sine of 2 pi / 5 and 4 pi / 5.
    const C1: f64 = 0.309_016_994_374_947_45;
    const C2: f64 = -0.809_016_994_374_947_5;
    const S1: f64 = 0.951_056_516_295_153_5;
    const S2: f64 = 0.587_785_252_292_473_1;
    let (s1r, s1i) = (add(re[1], re[4]), add(im[1], im[4]));
    let (s2r, s2i) = (add(re[2], re[3]), add(im[2], im[3]));
    let (d1r, d1i) = (sub(re[1], re[4]), sub(im[1], im[4]));
    let (d2r, d2i) = (sub(re[2], re[3]), sub(im[2], im[3]));
    let m1r = lanes(|l| re[0][l] + C1 * s1r[l] + C2 * s2r[l]);
    let m1i = lanes(|l| im[0][l] + C1 * s1i[l] + C2 * s2i[l]);
    let m2r = lanes(|l| re[0][l] + C2 * s1r[l] + C1 * s2r[l]);
    let m2i = lanes(|l| im[0][l] + C2 * s1i[l] + C1 * s2i[l]);
    let n1r = lanes(|l| S1 * d1r[l] + S2 * d2r[l]);
    let n1i = lanes(|l| S1 * d1i[l] + S2 * d2i[l]);
    let n2r = lanes(|l| S2 * d1r[l] - S1 * d2r[l]);
    let n2i = lanes(|l| S2 * d1i[l] - S1 * d2i[l]);
    (
        [lanes(|l| re[0][l] + s1r[l] + s2r[l]), add(m1r, n1i), add(m2r, n2i), sub(m2r, n2i), sub(m1r, n1i)],
        [lanes(|l| im[0][l] + s1i[l] + s2i[l]), sub(m1i, n1r), sub(m2i, n2r), add(m2i, n2r), add(m1i, n1r)],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize) -> Buffer {
        let mut b = Buffer::new(n);
        for i in 0..n {
            b.re[i] = lanes(|l| ((i * 37 + l * 11) as f64 * 0.7).sin());
            b.im[i] = lanes(|l| ((i * 23 + l * 5) as f64 * 1.3).cos());
        }
        b
    }

    /// Against the sum that defines the transform, for every radix; and back again.
    #[test]
    fn transforms_equal_the_defining_sum() {
        for n in [2, 4, 6, 8, 10, 12, 30, 60, 90, 128, 150, 480] {
            let (fft, data) = (Fft::new(n), noise(n));
            let (mut ours, mut scratch) = (data.clone(), Buffer::new(n));
            fft.forward(&mut ours, &mut scratch, SimdLevel::Portable);
            for k in 0..n {
                for l in 0..LANES {
                    let (mut re, mut im) = (0.0, 0.0);
                    for j in 0..n {
                        let (s, c) = (-2.0 * PI * (j * k % n) as f64 / n as f64).sin_cos();
                        re += data.re[j][l] * c - data.im[j][l] * s;
                        im += data.re[j][l] * s + data.im[j][l] * c;
                    }
                    assert!((ours.re[k][l] - re).abs() < 1e-11 * n as f64, "{n}: {k}");
                    assert!((ours.im[k][l] - im).abs() < 1e-11 * n as f64, "{n}: {k}");
                }
            }
            fft.inverse(&mut ours, &mut scratch, SimdLevel::Portable);
            for j in 0..n {
                assert!((ours.re[j][3] / n as f64 - data.re[j][3]).abs() < 1e-13);
                assert!((ours.im[j][3] / n as f64 - data.im[j][3]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn every_vector_path_transforms_to_the_same_bits() {
        for n in [60, 128, 450] {
            let run = |level| {
                let (mut data, mut scratch) = (noise(n), Buffer::new(n));
                Fft::new(n).forward(&mut data, &mut scratch, level);
                data.re.iter().chain(&data.im).flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
            };
            crate::testing::assert_same_on_every_unit(&n.to_string(), run);
        }
    }

    #[test]
    fn lengths_have_small_factors() {
        let lengths: Vec<usize> = [1, 7, 14, 127, 257, 421, 641].map(good_length).to_vec();
        assert_eq!(lengths, [2, 8, 16, 128, 270, 432, 648]);
    }
}
