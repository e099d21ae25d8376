//! The two blurs of a shadowed image, in one pass over the rows and one over the columns.

use crate::simd::SimdLevel;

/// Columns blurred together.
const STRIP: usize = 64;
/// Values summed together.
const CHUNK: usize = 16;

/// How a line goes on beyond its ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// `cba|abcd|dcb`, scipy's `reflect`.
    EdgeTwice,
    /// `dcb|abcd|cba`, OpenCV's reflect-101.
    EdgeOnce,
}

/// A symmetric blur: weights of the centre and of one side.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blur {
    pub(crate) weights: Vec<f32>,
    pub(crate) border: Border,
}

impl Blur {
    fn radius(&self) -> usize {
        self.weights.len() - 1
    }

    /// Index of a line's value `i`, which may lie outside.
    fn index(&self, i: isize, n: usize) -> usize {
        if (0..n as isize).contains(&i) {
            return i as usize;
        }
        let (n, period) = (
            n as isize,
            match self.border {
                Border::EdgeTwice => 2 * n as isize,
                Border::EdgeOnce => (2 * n as isize - 2).max(1),
            },
        );
        let i = i.rem_euclid(period);
        let mirrored = if self.border == Border::EdgeTwice { 2 * n - 1 - i } else { period - i };
        (if i < n { i } else { mirrored }) as usize
    }
}

/// Blurs a plane with each blur in turn; blurs along rows and along columns commute, so each pass does all of them.
/// The same bits on every vector unit: sums are not fused and go from the centre outwards.
pub(super) fn blur(plane: &mut [f32], width: usize, blurs: &[Blur], level: SimdLevel) {
    #[cfg(target_arch = "x86_64")]
    if level >= SimdLevel::Avx2 {
        // SAFETY: `SimdLevel::available` names only what the processor has.
        return unsafe { blur_avx2(plane, width, blurs) };
    }
    let _ = level;
    blur_any(plane, width, blurs);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn blur_avx2(plane: &mut [f32], width: usize, blurs: &[Blur]) {
    blur_any(plane, width, blurs);
}

#[inline(always)]
fn blur_any(plane: &mut [f32], width: usize, blurs: &[Blur]) {
    let height = plane.len() / width;
    let reach = blurs.iter().map(Blur::radius).max().unwrap_or(0);
    let mut padded = vec![0.0f32; (width + 2 * reach).max((height + 2 * reach) * STRIP)];
    for row in plane.chunks_exact_mut(width) {
        for blur in blurs {
            let r = blur.radius();
            padded[r..r + width].copy_from_slice(row);
            for i in 0..r {
                padded[i] = row[blur.index(i as isize - r as isize, width)];
                padded[r + width + i] = row[blur.index((width + i) as isize, width)];
            }
            sums(&padded[..width + 2 * r], 1, &blur.weights, row);
        }
    }
    let mut strip = vec![0.0f32; height * STRIP];
    for first in (0..width).step_by(STRIP) {
        let columns = STRIP.min(width - first);
        for (pass, blur) in blurs.iter().enumerate() {
            let r = blur.radius();
            for (i, out) in padded.chunks_exact_mut(STRIP).take(height + 2 * r).enumerate() {
                let y = blur.index(i as isize - r as isize, height);
                if pass == 0 {
                    out[..columns].copy_from_slice(&plane[y * width + first..][..columns]);
                } else {
                    out.copy_from_slice(&strip[y * STRIP..][..STRIP]);
                }
            }
            sums(&padded[..(height + 2 * r) * STRIP], STRIP, &blur.weights, &mut strip);
        }
        for y in 0..height {
            plane[y * width + first..][..columns].copy_from_slice(&strip[y * STRIP..][..columns]);
        }
    }
}

/// `out[i] = w0 in[i + r t] + sum_k w_k (in[i + (r - k) t] + in[i + (r + k) t])` for a distance `t` of the summands.
#[inline(always)]
fn sums(input: &[f32], t: usize, weights: &[f32], out: &mut [f32]) {
    let centre = (weights.len() - 1) * t;
    let mut chunks = out.chunks_exact_mut(CHUNK);
    let mut at = 0;
    for chunk in &mut chunks {
        let load = |from: usize| -> [f32; CHUNK] {
            let mut values = [0.0; CHUNK];
            values.copy_from_slice(&input[from..from + CHUNK]);
            values
        };
        let middle = load(at + centre);
        let mut sum: [f32; CHUNK] = std::array::from_fn(|i| weights[0] * middle[i]);
        for (k, &weight) in weights.iter().enumerate().skip(1) {
            let (a, b) = (load(at + centre - k * t), load(at + centre + k * t));
            for i in 0..CHUNK {
                sum[i] += weight * (a[i] + b[i]);
            }
        }
        chunk.copy_from_slice(&sum);
        at += CHUNK;
    }
    for (i, out) in chunks.into_remainder().iter_mut().enumerate() {
        let c = at + i + centre;
        *out = weights[0] * input[c];
        for (k, &weight) in weights.iter().enumerate().skip(1) {
            *out += weight * (input[c - k * t] + input[c + k * t]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_same_on_every_unit, bits};

    /// The blurs one after another as plain sums in f64.
    fn reference(plane: &[f32], w: usize, blurs: &[Blur]) -> Vec<f64> {
        let h = plane.len() / w;
        let mut now: Vec<f64> = plane.iter().map(|&v| f64::from(v)).collect();
        for blur in blurs {
            for (dx, dy) in [(1, 0), (0, 1)] {
                now = (0..w * h)
                    .map(|i| {
                        let r = blur.radius() as isize;
                        (-r..=r)
                            .map(|k| {
                                let x = blur.index((i % w) as isize + k * dx, w);
                                let y = blur.index((i / w) as isize + k * dy, h);
                                f64::from(blur.weights[k.unsigned_abs()]) * now[y * w + x]
                            })
                            .sum()
                    })
                    .collect();
            }
        }
        now
    }

    #[test]
    fn both_blurs_are_plain_sums_on_every_vector_unit() {
        let blurs = [
            Blur { weights: vec![0.2, 0.15, 0.1, 0.08, 0.05, 0.01, 0.01], border: Border::EdgeTwice },
            Blur { weights: vec![0.375, 0.25, 0.0625], border: Border::EdgeOnce },
        ];
        for (w, h) in [(80, 61), (130, 20), (17, 33), (5, 4)] {
            let plane: Vec<f32> =
                (0..w * h).map(|i| (i as f32 * 0.37).sin() * 40.0 + (i % 7) as f32).collect();
            let exact = reference(&plane, w, &blurs);
            let run = |level| {
                let mut out = plane.clone();
                blur(&mut out, w, &blurs, level);
                out
            };
            assert_same_on_every_unit(&format!("{w}x{h}"), |level| bits(&run(level)));
            let portable = run(SimdLevel::Portable);
            let worst =
                portable.iter().zip(&exact).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
            assert!(worst < 2e-5, "{w}x{h}: {worst}");
        }
    }

    #[test]
    fn lines_go_on_mirrored() {
        let at = |border| -> Vec<usize> {
            let blur = Blur { weights: vec![1.0], border };
            (-4..8).map(|i| blur.index(i, 4)).collect()
        };
        assert_eq!(at(Border::EdgeTwice), [3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0]);
        assert_eq!(at(Border::EdgeOnce), [2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1]);
    }
}
