//! Closed outlines in a plane, counter-clockwise, in millimetres: corners that are cut or rounded, circles, and outlines moved inwards.

use super::sin_cos_turn;

/// A point of an outline.
pub(super) type Point = [f64; 2];

/// How an edge or a corner is finished.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Edge {
    /// As it is.
    Sharp,
    /// Cut at 45 degrees, so far from the edge.
    Chamfer(f64),
    /// A quarter circle of this radius.
    Round(f64),
}

/// Steps along a quarter circle.
const QUARTER: usize = 5;

impl Edge {
    /// From the face to the side: how far behind the face, and how far inside the side.
    pub(super) fn steps(self) -> Vec<(f64, f64)> {
        match self {
            Edge::Sharp => vec![(0.0, 0.0)],
            Edge::Chamfer(c) => vec![(0.0, c), (c, 0.0)],
            Edge::Round(r) => (0..=QUARTER)
                .map(|i| {
                    let (s, c) = sin_cos_turn(i, 4 * QUARTER);
                    (r * (1.0 - c), r * (1.0 - s))
                })
                .collect(),
        }
    }

    /// The same finish, no larger than `most`.
    pub(super) fn at_most(self, most: f64) -> Self {
        match self {
            Edge::Sharp => self,
            Edge::Chamfer(c) => Edge::Chamfer(c.min(most)),
            Edge::Round(r) => Edge::Round(r.min(most)),
        }
    }
}

/// A circle about a point.
pub(super) fn circle(middle: Point, radius: f64, segments: usize) -> Vec<Point> {
    (0..segments)
        .map(|i| {
            let (s, c) = sin_cos_turn(i, segments);
            [middle[0] + radius * c, middle[1] + radius * s]
        })
        .collect()
}

/// A regular polygon of the given distance between opposite flats (twice the inner radius), with a flat to the right.
pub(super) fn polygon(middle: Point, across: f64, corners: usize) -> Vec<Point> {
    let radius = across / 2.0 / sin_cos_turn(1, 2 * corners).1;
    (0..corners)
        .map(|i| {
            let (s, c) = sin_cos_turn(2 * i + 1, 2 * corners);
            [middle[0] + radius * c, middle[1] + radius * s]
        })
        .collect()
}

/// A rectangle about a point.
pub(super) fn rectangle(middle: Point, sides: [f64; 2]) -> Vec<Point> {
    let (x, y) = (sides[0] / 2.0, sides[1] / 2.0);
    [[-x, -y], [x, -y], [x, y], [-x, y]].map(|p| [middle[0] + p[0], middle[1] + p[1]]).to_vec()
}

/// A slot: a rectangle with half circles at its ends, along the first axis.
pub(super) fn slot(middle: Point, length: f64, width: f64) -> Vec<Point> {
    cornered(&rectangle(middle, [length, width]), Edge::Round(width / 2.0 * 0.98))
}

/// An outline whose corners are cut or rounded by a circle, as far as its sides allow.
pub(super) fn cornered(outline: &[Point], edge: Edge) -> Vec<Point> {
    let n = outline.len();
    let mut found = Vec::new();
    for i in 0..n {
        let (before, at, after) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
        let (back, back_len) = towards(at, before);
        let (on, on_len) = towards(at, after);
        let half = libm::acos(dot(back, on).clamp(-1.0, 1.0)) / 2.0;
        let most = 0.49 * back_len.min(on_len);
        match edge {
            Edge::Chamfer(c) if half < 1.5 => {
                let c = c.min(most);
                found.extend([along(at, back, c), along(at, on, c)]);
            }
            Edge::Round(r) if half < 1.5 => {
                let cut = (r / libm::tan(half)).min(most);
                let radius = cut * libm::tan(half);
                let middle = along(at, unit([back[0] + on[0], back[1] + on[1]]), libm::hypot(cut, radius));
                let turn = std::f64::consts::PI - 2.0 * half;
                let steps = (turn / std::f64::consts::FRAC_PI_2 * QUARTER as f64).ceil().max(2.0) as usize;
                let (first, last) = (along(at, back, cut), along(at, on, cut));
                let from = [first[0] - middle[0], first[1] - middle[1]];
                let to = [last[0] - middle[0], last[1] - middle[1]];
                for k in 0..=steps {
                    // Between both ends of the arc, on the circle.
                    let share = k as f64 / steps as f64;
                    let (a, b) = (libm::sin((1.0 - share) * turn), libm::sin(share * turn));
                    let p = [a * from[0] + b * to[0], a * from[1] + b * to[1]];
                    found.push([0, 1].map(|j| middle[j] + p[j] / libm::sin(turn)));
                }
            }
            _ => found.push(at),
        }
    }
    found
}

/// Moves every side inwards by `by` (outwards if negative): the corners stay as many.
pub(super) fn inset(outline: &[Point], by: f64) -> Vec<Point> {
    if by == 0.0 {
        return outline.to_vec();
    }
    let n = outline.len();
    (0..n)
        .map(|i| {
            let (before, at, after) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
            // The inside lies to the left.
            let left = |d: Point| [-d[1], d[0]];
            let (a, b) = (left(towards(before, at).0), left(towards(at, after).0));
            // No spike: a corner moves by at most four times as far as its sides.
            let scale = by / (1.0 + dot(a, b)).max(0.125);
            [at[0] + (a[0] + b[0]) * scale, at[1] + (a[1] + b[1]) * scale]
        })
        .collect()
}

/// Twice the area, positive if counter-clockwise.
pub(super) fn twice_area(outline: &[Point]) -> f64 {
    let n = outline.len();
    (0..n)
        .map(|i| {
            let (p, q) = (outline[i], outline[(i + 1) % n]);
            p[0] * q[1] - p[1] * q[0]
        })
        .sum()
}

/// Unit vector from a point to another, and their distance.
fn towards(from: Point, to: Point) -> (Point, f64) {
    let d = [to[0] - from[0], to[1] - from[1]];
    (unit(d), libm::hypot(d[0], d[1]))
}

fn unit(d: Point) -> Point {
    let length = libm::hypot(d[0], d[1]).max(f64::MIN_POSITIVE);
    [d[0] / length, d[1] / length]
}

fn along(p: Point, direction: Point, by: f64) -> Point {
    [p[0] + direction[0] * by, p[1] + direction[1] * by]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn rounded_and_cut_corners_have_their_areas() {
        let square = rectangle([3.0, 1.0], [20.0, 10.0]);
        let area = |outline: &[Point]| twice_area(outline) / 2.0;
        assert!((area(&square) - 200.0).abs() < 1e-9);
        // Four corners of 2 x 2 less four quarter circles, whose chords take a little more.
        let round = area(&cornered(&square, Edge::Round(2.0)));
        assert!((round - (200.0 - (4.0 - PI) * 4.0)).abs() < 0.25, "{round}");
        assert!((area(&cornered(&square, Edge::Chamfer(2.0))) - 192.0).abs() < 1e-9);
        assert!((area(&inset(&square, 1.0)) - 18.0 * 8.0).abs() < 1e-9);
        assert!((area(&inset(&square, -1.0)) - 22.0 * 12.0).abs() < 1e-9);
        let hexagon = polygon([0.0; 2], 10.0, 6);
        assert!((area(&hexagon) - 86.6025).abs() < 1e-3, "2 sqrt(3) r^2");
        // A corner that goes in is rounded on its own side.
        let l = [[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [4.0, 4.0], [4.0, 10.0], [0.0, 10.0]];
        let bent = area(&cornered(&l, Edge::Round(1.0)));
        assert!((bent - (64.0 - 4.0 * (1.0 - PI / 4.0))).abs() < 0.1, "{bent}: five corners less, one more");
    }
}
