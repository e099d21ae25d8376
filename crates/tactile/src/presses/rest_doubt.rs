//! Whether the frame without contact is one of the sensor that was pressed.

use super::PressSet;
use super::calibrate::MIN_PRESSES;
use super::circle::reference_frame;
use gripgen_twin::TactileImage;

/// A frame without contact may be this many times as far from the median of the presses as a press is: of the four real sets with one
/// (Taxim, FOTS, shapes, ObjectFolder) it is 1.0 to 1.4 times as far.
const TIMES: f64 = 3.0;
/// Grey levels that rounding alone may make of it: one of the frame, one of the median.
const ROUNDING: f64 = 2.0;

/// A frame without contact that contradicts the presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestDoubt {
    /// How far half of its pixels are from the median of the presses at most, grey levels.
    pub differs: f64,
    /// The same of a press; the median over the presses.
    pub presses_differ: f64,
}

/// What is wrong with the frame without contact, if it differs from the presses where nothing touches by much more than they differ
/// among themselves: it is that of another sensor, another light, or another setting of the camera. A contact covers less than half
/// of a frame, so that half of the pixels of a press are like those of a frame without contact.
pub fn rest_doubt(set: &PressSet) -> Option<RestDoubt> {
    // Fewer have no median of their own.
    let rest = set.rest.as_ref().filter(|_| set.presses.len() >= MIN_PRESSES)?;
    let middle = reference_frame(&PressSet { rest: None, ..set.clone() })?;
    if rest.rgb.len() != 3 * middle[0].len() {
        // Another size is an error of its own.
        return None;
    }
    let mut presses: Vec<f64> = set.presses.iter().map(|press| differs(&press.image, &middle)).collect();
    presses.sort_by(f64::total_cmp);
    let (differs, presses_differ) = (differs(rest, &middle), *presses.get(presses.len() / 2)?);
    (differs > TIMES * presses_differ + ROUNDING).then_some(RestDoubt { differs, presses_differ })
}

/// Median over the pixels of how far they are from a frame, in the channel where it is largest.
fn differs(image: &TactileImage, from: &[Vec<f32>; 3]) -> f64 {
    let median = |c: usize| {
        let pixels = image.rgb.iter().skip(c).step_by(3).zip(&from[c]);
        let mut off: Vec<f32> = pixels.map(|(level, middle)| (f32::from(*level) - middle).abs()).collect();
        off.sort_by(f32::total_cmp);
        off.get(off.len() / 2).copied().map_or(0.0, f64::from)
    };
    [0, 1, 2].map(median).into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presses::{Circle, Press};

    /// Twelve presses on a ramp of light, each with a dark disc elsewhere and a noise of two levels.
    fn set(rest: impl Fn(usize, usize) -> u8) -> PressSet {
        let image = |level: &dyn Fn(usize, usize) -> u8| TactileImage {
            width_px: 48,
            height_px: 36,
            rgb: (0..48 * 36).flat_map(|i| [level(i % 48, i / 48); 3]).collect(),
        };
        let noise = |x: usize, y: usize, k: usize| ((7 * x + 13 * y + 3 * k) % 5) as u8;
        let press = |k: usize| {
            let (cx, cy) = (8 + 10 * (k % 4), 8 + 10 * (k / 4));
            let touches = |x: usize, y: usize| x.abs_diff(cx).pow(2) + y.abs_diff(cy).pow(2) < 36;
            let level =
                |x: usize, y: usize| 80 + x as u8 + noise(x, y, k) - if touches(x, y) { 60 } else { 0 };
            let circle = Circle { x_px: cx as f64, y_px: cy as f64, radius_px: 6.0 };
            Press::of_ball(format!("{k}"), image(&level), Some(circle))
        };
        let presses = (0..12).map(press).collect();
        PressSet { metres_per_px: 1e-4, ball_m: 4e-3, rest: Some(image(&rest)), presses }
    }

    #[test]
    fn a_frame_of_another_light_contradicts_the_presses() {
        let own = |x: usize, _: usize| 82 + x as u8;
        assert_eq!(rest_doubt(&set(own)), None);
        // A little darker, as a light that warms up.
        assert_eq!(rest_doubt(&set(|x, y| own(x, y) - 3)), None);
        type Grey = fn(usize, usize) -> u8;
        let foreign: [(&str, Grey); 3] =
            [("mirrored", |x, _| 82 + 47 - x as u8), ("brighter", |x, _| 112 + x as u8), ("black", |_, _| 0)];
        for (name, rest) in foreign {
            let doubt = rest_doubt(&set(rest)).unwrap_or_else(|| panic!("{name}"));
            assert!(doubt.differs > 10.0 && doubt.presses_differ < 3.0, "{name}: {doubt:?}");
        }
        assert_eq!(rest_doubt(&PressSet { rest: None, ..set(own) }), None);
    }
}
