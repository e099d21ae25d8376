//! Taxim's treatment of the frame without contact.

use crate::deform::half_gaussian;
use gripgen_twin::TactileImage;

/// Standard deviation of the blur in pixels of an image as wide as those of the calibration.
const SIGMA_PX: f64 = 50.0;
/// Where the blurred frame is brighter than the frame by this or more, it is a marker or dirt.
const MARKER_GREY_LEVELS: f64 = 5.0;
/// Share of the blurred frame elsewhere.
const BLURRED_SHARE: f64 = 0.15;

/// The background that Taxim draws on: `0.15 blurred + 0.85 frame`, and the blurred frame alone where it is brighter
/// than the frame by 5 grey levels in the mean of the channels; blurred and mixed values are cut to whole levels.
/// Planes of red, green and blue.
///
/// `processInitialFrame` of Taxim's source, a Gaussian of 50 px with scipy's borders (mirrored, the edge repeated) and
/// order of summation. The blur scales with the image width from the 640 px of the calibration.
pub(super) fn background(frame: &TactileImage, calibration_width_px: f64) -> [Vec<f32>; 3] {
    let (w, h) = (frame.width_px as usize, frame.height_px as usize);
    let weights = half_gaussian(SIGMA_PX * w as f64 / calibration_width_px);
    let frame_of: [Vec<f64>; 3] =
        [0, 1, 2].map(|c| frame.rgb.iter().skip(c).step_by(3).map(|&v| f64::from(v)).collect());
    // Grey levels of u8 are never negative, so that cutting is rounding down.
    let blurred = frame_of.each_ref().map(|plane| {
        let down = blur_columns(plane, w, h, &weights);
        let across = blur_columns(&transposed(&down, w, h), h, w, &weights);
        transposed(&across, h, w).iter().map(|v| v.floor()).collect::<Vec<f64>>()
    });
    let mut out = [0, 1, 2].map(|_| vec![0.0; w * h]);
    for i in 0..w * h {
        // The mean in OpenCV's order of channels, as numpy adds them.
        let brighter = [2, 1, 0].iter().fold(0.0, |sum, &c| sum + (blurred[c][i] - frame_of[c][i])) / 3.0;
        for c in 0..3 {
            let value = if brighter < MARKER_GREY_LEVELS {
                (BLURRED_SHARE * blurred[c][i] + (1.0 - BLURRED_SHARE) * frame_of[c][i]).floor()
            } else {
                blurred[c][i]
            };
            out[c][i] = value as f32;
        }
    }
    out
}

fn blur_columns(plane: &[f64], w: usize, h: usize, weights: &[f64]) -> Vec<f64> {
    let row = |y: isize| {
        let y = y.rem_euclid(2 * h as isize) as usize;
        let y = if y < h { y } else { 2 * h - 1 - y };
        &plane[y * w..(y + 1) * w]
    };
    let mut out = vec![0.0; w * h];
    for (y, sums) in out.chunks_exact_mut(w).enumerate() {
        for (sum, value) in sums.iter_mut().zip(row(y as isize)) {
            *sum = value * weights[0];
        }
        for (k, &weight) in weights.iter().enumerate().skip(1).rev() {
            let (above, below) = (row(y as isize - k as isize), row(y as isize + k as isize));
            for ((sum, a), b) in sums.iter_mut().zip(above).zip(below) {
                *sum += (a + b) * weight;
            }
        }
    }
    out
}

fn transposed(plane: &[f64], w: usize, h: usize) -> Vec<f64> {
    (0..w * h).map(|i| plane[i % h * w + i / h]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dark_marker_is_replaced_and_the_rest_is_kept() {
        let (w, h) = (64_usize, 48_usize);
        let level =
            |x: usize, y: usize| if (30..33).contains(&x) && (20..23).contains(&y) { 20 } else { 120 };
        let rgb = (0..w * h).flat_map(|i| [level(i % w, i / w), 100, 90]).collect();
        let frame = TactileImage { width_px: w as u32, height_px: h as u32, rgb };
        let out = background(&frame, 640.0);
        let marker = out[0][21 * w + 31];
        assert!(marker > 95.0, "the marker is {marker} of 120");
        let around = out[0][21 * w + 40];
        assert!((118.0..=120.0).contains(&around), "{around}");
    }

    /// Weights sum to 1 only to rounding, and whole levels are cut, not rounded: one below is what Taxim has too.
    #[test]
    fn an_even_frame_stays_within_one_level() {
        let frame = TactileImage { width_px: 40, height_px: 30, rgb: vec![77; 40 * 30 * 3] };
        let out = background(&frame, 640.0);
        assert!(out.iter().flatten().all(|v| (76.0..=77.0).contains(v)));
    }
}
