//! Where in the frame something was pressed: elsewhere a calibrated sensor continues what it saw at other places.
//!
//! Colours are polynomials over the frame, fitted where presses are. A place is taken to be seen where it lay inside a
//! contact or within [`RIM_M`] of one, the zone that a calibration weighs most.

use super::{Contact, PressSet};

/// How far beyond the rim of a contact the gel is seen at slopes: the first zone of a calibration.
pub const RIM_M: f64 = 0.8e-3;

/// Parts of the frame along its rows and its columns.
pub const PARTS: (usize, usize) = (4, 3);

/// A part of the frame of which less than this share was seen is named.
pub const SEEN_SHARE: f64 = 0.25;

/// Where in the frame something was pressed.
#[derive(Debug, Clone, PartialEq)]
pub struct PressCoverage {
    /// Share of the frame that was seen, 0 to 1.
    pub share: f64,
    /// The same of each of [`PARTS`], row by row from the top left.
    pub part_shares: Vec<f64>,
    /// Longest distance of a pixel beyond the rim of the nearest contact, 0 where all of the frame lay in contacts.
    pub farthest_m: f64,
    /// Column and row of that pixel, counted from 0 at the top left.
    pub farthest_px: (usize, usize),
    /// Whether each pixel was seen, row by row from the top left.
    pub seen: Vec<bool>,
}

impl PressCoverage {
    /// Parts of the frame of which less than [`SEEN_SHARE`] was seen: row and column from 0 at the top left.
    pub fn unseen_parts(&self) -> impl Iterator<Item = (usize, usize)> {
        let few = self.part_shares.iter().enumerate().filter(|(_, share)| **share < SEEN_SHARE);
        few.map(|(i, _)| (i / PARTS.0, i % PARTS.0))
    }
}

/// Where the presses of a set are; `None` without any whose contact is known. Presses that are named in `without` do not count.
pub fn press_coverage(set: &PressSet, without: &[String]) -> Option<PressCoverage> {
    let marked = set.presses.iter().filter(|press| !without.contains(&press.name));
    let contacts: Vec<Contact> =
        marked.clone().filter_map(|press| Some(Contact::of_press(press, press.circle?))).collect();
    let image = &marked.clone().find(|press| press.circle.is_some())?.image;
    let (width, height) = (image.width_px as usize, image.height_px as usize);
    let nearest_px = |pixel: usize| {
        let beyond = contacts.iter().map(|contact| contact.beyond_rim_px(pixel, width));
        beyond.fold(f64::INFINITY, f64::min)
    };
    let rim_px = RIM_M / set.metres_per_px;
    let (mut seen, mut farthest) = (Vec::with_capacity(width * height), (0.0, 0));
    let (mut sums, mut counts) = (vec![0usize; PARTS.0 * PARTS.1], vec![0usize; PARTS.0 * PARTS.1]);
    for pixel in 0..width * height {
        let beyond_px = nearest_px(pixel);
        if beyond_px > farthest.0 {
            farthest = (beyond_px, pixel);
        }
        let is_seen = beyond_px <= rim_px;
        let part = pixel / width * PARTS.1 / height * PARTS.0 + pixel % width * PARTS.0 / width;
        sums[part] += usize::from(is_seen);
        counts[part] += 1;
        seen.push(is_seen);
    }
    let share = |seen: usize, all: usize| seen as f64 / all.max(1) as f64;
    Some(PressCoverage {
        share: share(sums.iter().sum(), counts.iter().sum()),
        part_shares: sums.iter().zip(&counts).map(|(seen, all)| share(*seen, *all)).collect(),
        farthest_m: farthest.0 * set.metres_per_px,
        farthest_px: (farthest.1 % width, farthest.1 / width),
        seen,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Circle, Press};
    use super::*;
    use gripgen_twin::TactileImage;

    /// 120 x 90 pixels of 0.1 mm, so a rim zone of 8 px.
    fn set(circles: &[(f64, f64, f64)]) -> PressSet {
        let image = TactileImage { width_px: 120, height_px: 90, rgb: vec![0; 120 * 90 * 3] };
        let press = |(i, &(x_px, y_px, radius_px)): (usize, &(f64, f64, f64))| {
            Press::of_ball(i.to_string(), image.clone(), Some(Circle { x_px, y_px, radius_px }))
        };
        let presses = circles.iter().enumerate().map(press).collect();
        PressSet { metres_per_px: 1e-4, ball_m: 4e-3, rest: None, presses }
    }

    #[test]
    fn one_press_covers_its_circle_and_a_rim() {
        let found = press_coverage(&set(&[(60.0, 45.0, 12.0)]), &[]).unwrap();
        let disc = std::f64::consts::PI * 20.0 * 20.0;
        assert!((found.share - disc / (120.0 * 90.0)).abs() < 0.002, "{}", found.share);
        // The corners are alike far; the first of them is (119, 89)'s mirror image, a pixel farther away.
        assert_eq!(found.farthest_px, (0, 0));
        assert!((found.farthest_m - (60f64.hypot(45.0) - 12.0) * 1e-4).abs() < 1e-9);
        // Parts are 30 x 30 px: only the two in the middle hold enough of the disc, rows 30..60, columns 30..90.
        let unseen: Vec<_> = found.unseen_parts().collect();
        assert_eq!(unseen.len(), 10);
        assert!(!unseen.contains(&(1, 1)) && !unseen.contains(&(1, 2)), "{unseen:?}");
        let mean: f64 = found.part_shares.iter().sum::<f64>() / 12.0;
        assert!((mean - found.share).abs() < 1e-12, "parts are alike large");
        assert_eq!(found.seen.iter().filter(|seen| **seen).count() as f64, found.share * 120.0 * 90.0);
    }

    #[test]
    fn presses_that_do_not_count_cover_nothing() {
        let set = set(&[(20.0, 20.0, 12.0), (100.0, 70.0, 12.0)]);
        let (both, first) = (press_coverage(&set, &[]), press_coverage(&set, &["1".into()]));
        let (both, first) = (both.unwrap(), first.unwrap());
        assert!(both.share > 1.9 * first.share);
        assert_eq!(first.farthest_px, (119, 89));
        assert_eq!(press_coverage(&set, &["0".into(), "1".into()]), None);
    }
}
