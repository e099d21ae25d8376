//! Where a ball touches, when nobody marked it.

use super::{Circle, PressSet};
use crate::grid::{Plane, levels_of};
use gripgen_twin::TactileImage;

/// Angles at which a circle is looked at.
const ANGLES: usize = 72;

/// Radii just inside and outside of the rim that are compared, relative to it.
const INSIDE: f64 = 1.0;
const OUTSIDE: f64 = 1.3;

/// A marked circle is doubtful if it holds less than this share of the contrast that there is.
const DOUBTFUL: f64 = 0.3;

/// At most so many presses make the frame that a press is compared with, where there is no rest frame.
const MEDIAN_OF: usize = 15;

/// Least change of a contact, in grey levels summed over the channels.
const MIN_CHANGE: f32 = 6.0;

/// Where a press differs most from the frame at rest: the circle whose inside differs most from its surroundings.
///
/// The change of colour (sum of magnitudes over the channels, without each channel's median) starts a search at the
/// centre of its largest values; the circle found has the largest mean difference between just inside and just
/// outside. `None` where nothing differs. `rest` has one plane a channel.
pub fn find_circle(image: &TactileImage, rest: &[Vec<f32>; 3], ball_radius_px: f64) -> Option<Circle> {
    find_in(&smooth_change(image, rest, ball_radius_px), ball_radius_px)
}

/// What is to be seen of a marked contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    /// A contact, about where it is marked.
    Here,
    /// A contact, but the mark holds less than [`DOUBTFUL`] of its contrast.
    Elsewhere,
    /// No contact at all.
    Nothing,
}

/// Looks for the contact of an image and compares it with its mark.
pub(super) fn look(image: &TactileImage, rest: &[Vec<f32>; 3], marked: &Circle, ball_radius_px: f64) -> Seen {
    let change = smooth_change(image, rest, ball_radius_px);
    let directions = directions();
    match find_in(&change, ball_radius_px) {
        None => Seen::Nothing,
        Some(found) => {
            let here =
                contrast(&change, marked, &directions) >= DOUBTFUL * contrast(&change, &found, &directions);
            if here { Seen::Here } else { Seen::Elsewhere }
        }
    }
}

fn smooth_change(image: &TactileImage, rest: &[Vec<f32>; 3], ball_radius_px: f64) -> Plane {
    smoothed(&change(image, rest), ((ball_radius_px / 12.0) as usize).clamp(1, 6))
}

fn find_in(change: &Plane, ball_radius_px: f64) -> Option<Circle> {
    let mut sorted = change.values.clone();
    sorted.sort_by(f32::total_cmp);
    let high = sorted[(sorted.len() - 1) * 995 / 1000];
    if high < MIN_CHANGE {
        return None;
    }
    let start = start(change, 0.5 * high, ball_radius_px);
    let best = climb(change, start, ball_radius_px);
    let inside = |v: f64, n: usize| (-0.5..=n as f64 - 0.5).contains(&v);
    (inside(best.x_px, change.width) && inside(best.y_px, change.height)).then_some(best)
}

impl PressSet {
    /// Looks for the contact of each press that nobody marked; how many were found.
    pub fn mark_missing(&mut self) -> usize {
        if self.presses.iter().all(|press| press.circle.is_some()) {
            return 0;
        }
        let Some(rest) = reference_frame(self) else { return 0 };
        let ball_radius_px = self.ball_m / 2.0 / self.metres_per_px;
        let mut found = 0;
        for press in self.presses.iter_mut().filter(|press| press.circle.is_none()) {
            if press.image.rgb.len() == 3 * rest[0].len() {
                press.circle = find_circle(&press.image, &rest, ball_radius_px);
                found += usize::from(press.circle.is_some());
            }
        }
        found
    }
}

/// A frame to compare presses with: the one without contact, or the median over the presses.
pub fn reference_frame(set: &PressSet) -> Option<[Vec<f32>; 3]> {
    if let Some(rest) = &set.rest {
        return Some(levels_of(rest));
    }
    let step = set.presses.len().div_ceil(MEDIAN_OF).max(1);
    let some: Vec<&[u8]> = set.presses.iter().step_by(step).map(|p| &p.image.rgb[..]).collect();
    let n = some.first()?.len();
    if some.iter().any(|rgb| rgb.len() != n) {
        return None;
    }
    let mut values = Vec::with_capacity(some.len());
    let mut median = |at: usize| {
        values.clear();
        values.extend(some.iter().map(|rgb| rgb[at]));
        values.sort_unstable();
        f32::from(values[values.len() / 2])
    };
    Some([0, 1, 2].map(|c| (c..n).step_by(3).map(&mut median).collect()))
}

fn change(image: &TactileImage, rest: &[Vec<f32>; 3]) -> Plane {
    let mut out = Plane::filled(image.width_px as usize, image.height_px as usize, 0.0);
    for (c, rest) in rest.iter().enumerate() {
        let values: Vec<f32> =
            image.rgb.iter().skip(c).step_by(3).zip(rest).map(|(&v, r)| f32::from(v) - r).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f32::total_cmp);
        let median = sorted[sorted.len() / 2];
        out.values.iter_mut().zip(values).for_each(|(o, v)| *o += (v - median).abs());
    }
    out
}

/// A mean over squares of `2 half + 1` pixels, borders repeated.
fn smoothed(plane: &Plane, half: usize) -> Plane {
    let mut across = plane.clone();
    let mut out = plane.clone();
    let scale = 1.0 / (2 * half + 1) as f32;
    let at = |i: usize, o: usize, n: usize| (i + o).saturating_sub(half).min(n - 1);
    for y in 0..plane.height {
        let row = plane.row(y);
        for x in 0..plane.width {
            let sum: f32 = (0..=2 * half).map(|o| row[at(x, o, plane.width)]).sum();
            across.values[y * plane.width + x] = sum * scale;
        }
    }
    for y in 0..plane.height {
        let to = &mut out.values[y * plane.width..(y + 1) * plane.width];
        to.fill(0.0);
        for o in 0..=2 * half {
            let from = across.row(at(y, o, plane.height));
            to.iter_mut().zip(from).for_each(|(t, f)| *t += f * scale);
        }
    }
    out
}

/// Centre of the pixels above a threshold, then of those of them that lie within a ball's radius.
fn start(change: &Plane, threshold: f32, ball_radius_px: f64) -> Circle {
    let mut centre = (0.0, 0.0);
    let mut count = 0.0;
    for reach in [f64::INFINITY, 1.5 * ball_radius_px, ball_radius_px, ball_radius_px] {
        let (mut sx, mut sy, mut n) = (0.0, 0.0, 0.0);
        for (i, &v) in change.values.iter().enumerate() {
            let (x, y) = ((i % change.width) as f64, (i / change.width) as f64);
            let (dx, dy) = (x - centre.0, y - centre.1);
            if v > threshold && (reach.is_infinite() || dx * dx + dy * dy < reach * reach) {
                sx += x;
                sy += y;
                n += 1.0;
            }
        }
        if n > 0.0 {
            centre = (sx / n, sy / n);
            count = n;
        }
    }
    let radius_px = (count / std::f64::consts::PI).sqrt().clamp(0.3 * ball_radius_px, 0.95 * ball_radius_px);
    Circle { x_px: centre.0, y_px: centre.1, radius_px }
}

fn directions() -> Vec<(f64, f64)> {
    let angle = |k: usize| k as f64 / ANGLES as f64 * 2.0 * std::f64::consts::PI;
    (0..ANGLES).map(|k| (libm::cos(angle(k)), libm::sin(angle(k)))).collect()
}

/// Pattern search with halving steps.
fn climb(change: &Plane, start: Circle, ball_radius_px: f64) -> Circle {
    let directions = directions();
    let score = |c: &Circle| contrast(change, c, &directions);
    let mut best = start;
    let mut best_score = score(&best);
    let mut step = ball_radius_px / 4.0;
    while step > 0.1 {
        let mut moved = false;
        for (dx, dy, dr) in [
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            (0.0, 1.0, 0.0),
            (0.0, -1.0, 0.0),
            (0.0, 0.0, 1.0),
            (0.0, 0.0, -1.0),
        ] {
            let tried = Circle {
                x_px: best.x_px + step * dx,
                y_px: best.y_px + step * dy,
                radius_px: best.radius_px + step * dr,
            };
            let range = 0.15 * ball_radius_px..=ball_radius_px;
            if !range.contains(&tried.radius_px) {
                continue;
            }
            let tried_score = score(&tried);
            if tried_score > best_score {
                (best, best_score, moved) = (tried, tried_score, true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    best
}

/// Mean change just inside a circle less that just outside, over the angles at which both lie in the image.
fn contrast(change: &Plane, circle: &Circle, directions: &[(f64, f64)]) -> f64 {
    let value = |(dx, dy): (f64, f64), share: f64| {
        let x = circle.x_px + share * circle.radius_px * dx;
        let y = circle.y_px + share * circle.radius_px * dy;
        let (w, h) = (change.width, change.height);
        if !(x >= 0.0 && y >= 0.0 && x <= (w - 1) as f64 && y <= (h - 1) as f64) {
            return None;
        }
        let (x0, y0) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let at = |x: usize, y: usize| f64::from(change.at(x.min(w - 1), y.min(h - 1)));
        let row = |y: usize| at(x0, y) + fx * (at(x0 + 1, y) - at(x0, y));
        Some(row(y0) + fy * (row(y0 + 1) - row(y0)))
    };
    let (mut sum, mut n) = (0.0, 0usize);
    for &direction in directions {
        if let (Some(inside), Some(outside)) = (value(direction, INSIDE), value(direction, OUTSIDE)) {
            sum += inside - outside;
            n += 1;
        }
    }
    // A circle that is mostly cut off by the border says little.
    if n * 3 < directions.len() { f64::NEG_INFINITY } else { sum / n as f64 }
}
