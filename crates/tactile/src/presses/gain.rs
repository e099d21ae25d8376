//! The gain of each colour in a press, as a camera with an automatic white balance sets it.
//!
//! The contact covers little of the frame; away from it an image is the frame at rest times the gain of that press. So each
//! press says its own gain, and no fit to the contact has a part in it.

use super::contact::Marked;
use super::{Contact, Press, PressSet};
use crate::grid::Grid;
use gripgen_twin::TactileImage;

/// Distance from the rim of a contact beyond which a pixel counts as away from it.
const AWAY_MM: f64 = 2.6;

/// Share of the frame that is looked at where less lies that far away: that which lies farthest.
const MIN_SHARE: f64 = 0.25;

/// Gains that a camera may have.
const GAINS: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// Gains count from this share of the error on that they take off the half of a frame that they were not taken from.
const WORTH: f64 = 0.1;

/// Pixels of a half at least, for its gain to be compared with that of the other.
const MIN_HALF: usize = 200;

/// Rounds of frame at rest and gains, each from the other.
const ROUNDS: usize = 3;

/// The pixels of an image away from the contact.
pub(super) fn away(contact: &Contact, grid: &Grid) -> Vec<usize> {
    let distances: Vec<f64> = (0..grid.len()).map(|p| contact.beyond_rim_px(p, grid.width_px)).collect();
    let mut sorted = distances.clone();
    sorted.sort_by(f64::total_cmp);
    let farthest = sorted[((1.0 - MIN_SHARE) * (grid.len() - 1) as f64) as usize];
    let from_px = (AWAY_MM * 1e-3 / grid.metres_per_px).min(farthest);
    (0..grid.len()).filter(|&p| distances[p] >= from_px).collect()
}

/// The gain of each channel that makes `expected` grey levels those of an image, by least squares over some pixels; those
/// at the end of the scale say nothing. 1 where there is nothing to go by.
pub(super) fn gain_of(
    image: &TactileImage,
    expected: impl Fn(usize, usize) -> f64,
    pixels: impl Iterator<Item = usize>,
) -> [f64; 3] {
    let (mut products, mut squares) = ([0.0f64; 3], [0.0f64; 3]);
    for pixel in pixels {
        for c in 0..3 {
            let level = image.rgb[3 * pixel + c];
            if level > 0 && level < 255 {
                let expected = expected(pixel, c);
                products[c] += expected * f64::from(level);
                squares[c] += expected * expected;
            }
        }
    }
    [0, 1, 2].map(|c| {
        let gain = products[c] / squares[c];
        if GAINS.contains(&gain) { gain } else { 1.0 }
    })
}

/// An image with other gains.
pub(super) fn with_gain(image: &TactileImage, gain: [f64; 3]) -> TactileImage {
    let level = |(i, &v): (usize, &u8)| (f64::from(v) * gain[i % 3]).round().clamp(0.0, 255.0) as u8;
    TactileImage { rgb: image.rgb.iter().enumerate().map(level).collect(), ..*image }
}

/// The gain that makes a predicted image that of a press away from the contact.
pub(super) fn gain_beside(
    image: &TactileImage,
    predicted: &TactileImage,
    contact: &Contact,
    grid: &Grid,
) -> [f64; 3] {
    let expected = |pixel: usize, c: usize| f64::from(predicted.rgb[3 * pixel + c]);
    gain_of(image, expected, away(contact, grid).into_iter())
}

/// The gain of a press may be so many standard deviations away from the usual one: what is beyond is no scatter.
pub(super) const MAX_DEVIATIONS: f64 = 2.5;

/// A predicted image in the gain of its press, as far as a camera whose gains scatter by `sd` may have it.
pub(super) fn within_gain(
    image: &TactileImage,
    predicted: &TactileImage,
    contact: &Contact,
    grid: &Grid,
    sd: [f64; 3],
) -> TactileImage {
    let gain = gain_beside(image, predicted, contact, grid);
    let may = |c: usize| {
        let most = MAX_DEVIATIONS * sd[c];
        libm::exp(libm::log(gain[c]).clamp(-most, most))
    };
    with_gain(predicted, [0, 1, 2].map(may))
}

/// Gains of presses, and of a frame without contact, relative to those that the presses have in common.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gains {
    /// Of each press.
    pub(super) of_press: Vec<[f64; 3]>,
    /// Of the frame without contact.
    pub(super) of_rest: [f64; 3],
    /// Standard deviation of their logarithms, of each channel.
    pub(super) sd: [f32; 3],
}

/// The presses and the frame without contact as a camera of fixed gains would have taken them.
pub(super) fn without_gains(set: &PressSet, gains: &Gains) -> PressSet {
    let without = |image: &TactileImage, gain: [f64; 3]| with_gain(image, gain.map(|g| 1.0 / g));
    let press =
        |(press, gain): (&Press, &[f64; 3])| Press { image: without(&press.image, *gain), ..press.clone() };
    PressSet {
        rest: set.rest.as_ref().map(|image| without(image, gains.of_rest)),
        presses: set.presses.iter().zip(&gains.of_press).map(press).collect(),
        ..*set
    }
}

/// The gains of presses, where each press has its own: where the gain of one half of the frame is that of the other.
pub(super) fn gains(presses: &[Marked<'_>], rest: Option<&TactileImage>, grid: &Grid) -> Option<Gains> {
    let pixels: Vec<Vec<usize>> = presses.iter().map(|(_, contact)| away(contact, grid)).collect();
    let mut of_press = vec![[1.0; 3]; presses.len()];
    let mut frame = Vec::new();
    for _ in 0..ROUNDS {
        frame = frame_away(presses, &pixels, &of_press, grid);
        for ((gain, (press, _)), pixels) in of_press.iter_mut().zip(presses).zip(&pixels) {
            *gain = gain_of(&press.image, |p, c| frame[p][c], seen(pixels, &frame));
        }
        relative(&mut of_press);
    }
    if !of_whole_frames(presses, &pixels, &frame, grid) {
        return None;
    }
    let n = of_press.len() as f64;
    let sd = [0, 1, 2].map(|c| {
        let squares: f64 = of_press.iter().map(|gain| libm::log(gain[c]).powi(2)).sum();
        (squares / (n - 1.0).max(1.0)).sqrt() as f32
    });
    let all = 0..grid.len();
    let of_rest =
        rest.map_or([1.0; 3], |rest| gain_of(rest, |p, c| frame[p][c], all.filter(|&p| frame[p][0] >= 0.0)));
    Some(Gains { of_press, of_rest, sd })
}

/// Pixels at which the frame without contact is known.
fn seen<'a>(pixels: &'a [usize], frame: &'a [[f64; 3]]) -> impl Iterator<Item = usize> + 'a {
    pixels.iter().copied().filter(|&p| frame[p][0] >= 0.0)
}

/// Divides gains by their geometric mean.
fn relative(gains: &mut [[f64; 3]]) {
    for c in 0..3 {
        let mean = gains.iter().map(|gain| libm::log(gain[c])).sum::<f64>() / gains.len().max(1) as f64;
        gains.iter_mut().for_each(|gain| gain[c] /= libm::exp(mean));
    }
}

/// Mean over the presses of their images without their gains, away from the contacts; negative where fewer than two show a
/// pixel.
fn frame_away(
    presses: &[Marked<'_>],
    pixels: &[Vec<usize>],
    gains: &[[f64; 3]],
    grid: &Grid,
) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0f64; 3]; grid.len()];
    let mut counts = vec![0u32; grid.len()];
    for (((press, _), pixels), gain) in presses.iter().zip(pixels).zip(gains) {
        for &pixel in pixels {
            counts[pixel] += 1;
            for c in 0..3 {
                sums[pixel][c] += f64::from(press.image.rgb[3 * pixel + c]) / gain[c];
            }
        }
    }
    let mean =
        |(sum, count): ([f64; 3], u32)| if count < 2 { [-1.0; 3] } else { sum.map(|s| s / f64::from(count)) };
    sums.into_iter().zip(counts).map(mean).collect()
}

/// Whether gains that are taken from one half of each frame lower the error of its other half.
fn of_whole_frames(presses: &[Marked<'_>], pixels: &[Vec<usize>], frame: &[[f64; 3]], grid: &Grid) -> bool {
    let (w, h) = (grid.width_px, grid.height_px);
    let splits: [&dyn Fn(usize) -> bool; 2] = [&|p| p % w < w / 2, &|p| p / w < h / 2];
    let (mut plain, mut balanced) = (0.0, 0.0);
    for split in splits {
        for ((press, _), pixels) in presses.iter().zip(pixels) {
            let (one, other): (Vec<usize>, Vec<usize>) = seen(pixels, frame).partition(|&p| split(p));
            if one.len().min(other.len()) < MIN_HALF {
                continue;
            }
            for (from, on) in [(&one, &other), (&other, &one)] {
                let gain = gain_of(&press.image, |p, c| frame[p][c], from.iter().copied());
                for &p in on {
                    for c in 0..3 {
                        let level = f64::from(press.image.rgb[3 * p + c]);
                        plain += (level - frame[p][c]).powi(2);
                        balanced += (level - gain[c] * frame[p][c]).powi(2);
                    }
                }
            }
        }
    }
    balanced < (1.0 - WORTH) * plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presses::Circle;

    const GRID: Grid = Grid { width_px: 64, height_px: 48, metres_per_px: 0.2e-3 };

    /// A frame of smooth colours times gains.
    fn frame(gain: [f64; 3]) -> TactileImage {
        let level = |i: usize| {
            let (pixel, c) = (i / 3, i % 3);
            gain[c] * (60.0 + (pixel % 64) as f64 + 1.5 * (pixel / 64) as f64)
        };
        let rgb = (0..3 * GRID.len()).map(|i| level(i).round().min(255.0) as u8).collect();
        TactileImage { width_px: 64, height_px: 48, rgb }
    }

    fn contact(x_px: f64, y_px: f64) -> Contact {
        Contact::of_circle(Circle { x_px, y_px, radius_px: 5.0 })
    }

    #[test]
    fn a_gain_is_that_of_pixels_on_the_scale() {
        let plain = frame([1.0; 3]);
        let all = || 0..GRID.len();
        let of = |image: &TactileImage| gain_of(image, |p, c| f64::from(plain.rgb[3 * p + c]), all());
        // A fifth of the blue pixels is at the end of the scale.
        let [red, green, blue] = of(&frame([0.8, 1.1, 1.7]));
        assert!(
            (red - 0.8).abs() < 2e-3 && (green - 1.1).abs() < 2e-3 && (blue - 1.7).abs() < 5e-3,
            "{blue}"
        );
        // No camera has a fifth of the usual gain, and black shows none.
        assert_eq!(of(&frame([0.2, 1.0, 0.0]))[0], 1.0);
        assert_eq!(of(&frame([0.2, 1.0, 0.0]))[2], 1.0);
    }

    #[test]
    fn a_prediction_follows_its_press_as_far_as_gains_scatter() {
        let (predicted, at) = (frame([1.0; 3]), contact(20.0, 20.0));
        let sd = [0.1, 0.1, 0.02];
        let found = within_gain(&frame([0.9, 1.5, 1.2]), &predicted, &at, &GRID, sd);
        let most = |sd: f64| libm::exp(2.5 * sd);
        let wanted = with_gain(&predicted, [0.9, most(0.1), most(0.02)]);
        let worst = found.rgb.iter().zip(&wanted.rgb).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{worst:?}");
    }

    #[test]
    fn pixels_away_are_those_far_from_the_contact() {
        let at = Contact::of_circle(Circle { x_px: 20.0, y_px: 20.0, radius_px: 5.3 });
        let found = away(&at, &GRID);
        // 2.6 mm are 13 px.
        let far = |p: usize| at.beyond_rim_px(p, 64) >= 13.0;
        assert!(!found.is_empty() && (0..GRID.len()).all(|p| found.contains(&p) == far(p)));
        // Where nothing is that far, the farthest quarter.
        let close = Grid { metres_per_px: 1e-5, ..GRID };
        let share = away(&at, &close).len() as f64 / close.len() as f64;
        assert!((share - 0.25).abs() < 0.01, "{share}");
    }

    #[test]
    fn gains_of_presses_are_relative_to_one_another() {
        let own = [[0.9, 1.0, 1.2], [1.1, 1.0, 0.9], [1.0, 1.05, 1.0], [1.05, 0.95, 0.95]];
        let presses: Vec<Press> =
            own.iter().map(|gain| Press::of_ball("", frame(gain.map(|g| 1.2 * g)), None)).collect();
        let places = [(14.0, 14.0), (50.0, 14.0), (14.0, 34.0), (50.0, 34.0)];
        let marked: Vec<Marked<'_>> =
            presses.iter().zip(places).map(|(press, (x, y))| (press, contact(x, y))).collect();
        let found = gains(&marked, Some(&frame([1.2 * 1.3, 1.2, 1.2])), &GRID).unwrap();
        for c in 0..3 {
            let mean = own.iter().map(|gain| libm::log(gain[c])).sum::<f64>() / 4.0;
            let logs = own.map(|gain| libm::log(gain[c]) - mean);
            for (found, log) in found.of_press.iter().zip(logs) {
                assert!((libm::log(found[c]) - log).abs() < 5e-3, "{found:?} {c}: {log}");
            }
            let sd = (logs.iter().map(|log| log * log).sum::<f64>() / 3.0).sqrt();
            assert!((f64::from(found.sd[c]) - sd).abs() < 5e-3, "{:?} {sd}", found.sd);
            let rest = [1.3, 1.0, 1.0][c] * libm::exp(-mean);
            assert!((found.of_rest[c] - rest).abs() < 0.01, "{:?} {rest}", found.of_rest);
        }
        // One press is no frame to compare with.
        let pixels = vec![away(&marked[0].1, &GRID)];
        let alone = frame_away(&marked[..1], &pixels, &[[1.0; 3]], &GRID);
        assert!(alone.iter().all(|levels| levels[0] < 0.0));
    }
}
