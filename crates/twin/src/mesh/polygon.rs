//! Cutting a polygon into triangles. Every corner stays the corner of a triangle, those on a straight side too: faces beside it share
//! them, and a mesh that lost them would have holes.

/// Most looks at whether a corner lies in an ear, of one polygon: two seconds of one core. Outlines of some thousand corners need a
/// thousandth of it.
const MOST_LOOKS: usize = 1_000_000_000;

/// The triangles of a polygon, as positions in `corners`: a fan from its first corner where that covers it, and ears (Meisters 1975)
/// where it does not.
///
/// # Errors
///
/// Fewer than three corners, or an outline that crosses itself.
pub(super) fn triangles(corners: &[[f32; 3]]) -> Result<Vec<[usize; 3]>, String> {
    let n = corners.len();
    if n < 3 {
        return Err(format!("a face has 3 corners or more, found {n}"));
    }
    let fan = || (1..n - 1).map(|i| [0, i, i + 1]).collect::<Vec<_>>();
    if n == 3 {
        return Ok(fan());
    }
    let Some(flat) = Flat::of(corners) else { return Ok(fan()) };
    if flat.area <= flat.nothing {
        return Err(crossing(n));
    }
    if fan().iter().all(|&[a, b, c]| flat.twice_area(a, b, c) >= 0.0) {
        return Ok(fan());
    }
    flat.ears()
}

fn crossing(n: usize) -> String {
    format!("the outline of a face of {n} corners crosses itself")
}

/// A polygon seen along its normal, counter-clockwise.
struct Flat {
    at: Vec<[f64; 2]>,
    /// Twice the area of the polygon.
    area: f64,
    /// Areas that rounding of the coordinates alone makes.
    nothing: f64,
}

impl Flat {
    /// `None` for a polygon whose corners lie on a line, as far as their rounding tells.
    fn of(corners: &[[f32; 3]]) -> Option<Self> {
        let corners: Vec<[f64; 3]> = corners.iter().map(|c| c.map(f64::from)).collect();
        let o = corners[0];
        let relative = |c: &[f64; 3]| [c[0] - o[0], c[1] - o[1], c[2] - o[2]];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [1, 2, 0].map(|j| {
                let k = (j + 1) % 3;
                a[j] * b[k] - a[k] * b[j]
            })
        };
        // Twice the area as a vector, the sum over a fan, and the largest area in it.
        let (mut normal, mut largest) = ([0.0; 3], 0.0_f64);
        for pair in corners[1..].windows(2) {
            let area = cross(relative(&pair[0]), relative(&pair[1]));
            for i in 0..3 {
                normal[i] += area[i];
                largest = largest.max(area[i].abs());
            }
        }
        let reach = corners.iter().flat_map(relative).fold(0.0_f64, |a, x| a.max(x.abs()));
        let farthest = corners.iter().flatten().fold(0.0_f64, |a, x| a.max(x.abs()));
        let nothing = 4.0 * f64::from(f32::EPSILON) * farthest * reach;
        if largest <= 8.0 * nothing {
            return None;
        }
        let up = (0..3).fold(0, |a, b| if normal[b].abs() > normal[a].abs() { b } else { a });
        let (x, y) = ((up + 1) % 3, (up + 2) % 3);
        let (x, y) = if normal[up] < 0.0 { (y, x) } else { (x, y) };
        Some(Self { at: corners.iter().map(|c| [c[x], c[y]]).collect(), area: normal[up].abs(), nothing })
    }

    /// Twice the area of a triangle, positive if it turns left.
    fn twice_area(&self, a: usize, b: usize, c: usize) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| self.at[i]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Cuts off ears: corners that turn left, whose triangle holds no other corner.
    fn ears(&self) -> Result<Vec<[usize; 3]>, String> {
        let n = self.at.len();
        let mut before: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
        let mut after: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
        // What lies in an ear and is nearest to its tip does not turn left: only such corners are looked at.
        let mut inward: Vec<usize> =
            (0..n).filter(|&i| self.twice_area(before[i], i, after[i]) <= 0.0).collect();
        let mut found = Vec::with_capacity(n - 2);
        let (mut tip, mut passed, mut left, mut looks) = (0, 0, n, 0_usize);
        // Rounding may close every ear by a hair: then a second round lets a hair pass.
        let mut slack = 0.0;
        while left > 3 {
            let (a, c) = (before[tip], after[tip]);
            let area = self.twice_area(a, tip, c);
            looks += inward.len();
            if looks > MOST_LOOKS {
                return Err(format!("the outline of {n} corners is too winding to be cut into triangles"));
            }
            let opens = if slack == 0.0 { area > 0.0 } else { area >= -slack };
            if opens && !inward.iter().any(|&p| self.holds([a, tip, c], p, slack)) {
                found.push([a, tip, c]);
                (after[a], before[c]) = (c, a);
                inward.retain(|&p| {
                    p != tip && (p != a && p != c || self.twice_area(before[p], p, after[p]) <= 0.0)
                });
                (tip, passed, left, slack) = (c, 0, left - 1, 0.0);
                continue;
            }
            (tip, passed) = (c, passed + 1);
            if passed == left {
                if slack > 0.0 {
                    return Err(crossing(n));
                }
                (passed, slack) = (0, self.nothing);
            }
        }
        let last = [before[tip], tip, after[tip]];
        if self.twice_area(last[0], last[1], last[2]) < -self.nothing {
            return Err(crossing(n));
        }
        found.push(last);
        Ok(found)
    }

    /// Whether a triangle that turns left holds a corner `p`, its sides included; with `slack` only what lies well inside.
    fn holds(&self, [a, b, c]: [usize; 3], p: usize, slack: f64) -> bool {
        // The two sides of a bridge to a hole share their corners.
        if [a, b, c].iter().any(|&i| self.at[i] == self.at[p]) {
            return false;
        }
        let inside = |x: f64| if slack == 0.0 { x >= 0.0 } else { x > slack };
        inside(self.twice_area(a, b, p))
            && inside(self.twice_area(b, c, p))
            && inside(self.twice_area(c, a, p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area covered by the triangles, counted on a grid of points: how many triangles hold each, and whether the polygon does.
    fn covers(outline: &[[f32; 2]]) {
        let raised: Vec<[f32; 3]> = outline.iter().map(|[x, y]| [*x, *y, 0.3 * x - 0.2 * y]).collect();
        for turned in [false, true] {
            let mut corners = raised.clone();
            if turned {
                corners.reverse();
            }
            for start in 0..corners.len() {
                corners.rotate_left(usize::from(start > 0));
                let found = triangles(&corners).unwrap();
                assert_eq!(found.len(), corners.len() - 2);
                let mut used: Vec<usize> = found.concat();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), corners.len(), "every corner is used");
                for k in 0..900 {
                    let p = [f64::from(k % 30) * 0.4037 + 0.013, f64::from(k / 30) * 0.4037 + 0.017];
                    let side = |a: [f32; 3], b: [f32; 3]| {
                        let [ax, ay, bx, by] = [a[0], a[1], b[0], b[1]].map(f64::from);
                        (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax)
                    };
                    let holding = found
                        .iter()
                        .filter(|t| {
                            let [a, b, c] = t.map(|i| corners[i]);
                            let s = [side(a, b), side(b, c), side(c, a)];
                            s.iter().all(|x| *x > 0.0) || s.iter().all(|x| *x < 0.0)
                        })
                        .count();
                    let crossings = (0..corners.len())
                        .filter(|&i| {
                            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                            let (ay, by) = (f64::from(a[1]), f64::from(b[1]));
                            let x = f64::from(a[0]) + (p[1] - ay) / (by - ay) * f64::from(b[0] - a[0]);
                            (ay > p[1]) != (by > p[1]) && x > p[0]
                        })
                        .count();
                    assert_eq!(
                        holding,
                        crossings % 2,
                        "{p:?} from corner {start}, turned {turned}: {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn concave_outlines_are_covered_once_from_every_corner() {
        // An L, a U, a comb, a star, an arrow.
        covers(&[[0., 0.], [12., 0.], [12., 4.], [4., 4.], [4., 10.], [0., 10.]]);
        covers(&[[0., 0.], [10., 0.], [10., 8.], [8., 8.], [8., 2.], [2., 2.], [2., 8.], [0., 8.]]);
        covers(&[[0., 0.], [11., 0.], [11., 9.], [9., 2.], [7., 9.], [5., 2.], [3., 9.], [2., 2.], [0., 9.]]);
        let star: Vec<[f32; 2]> = (0..14)
            .map(|i| {
                let (r, a) = (if i % 2 == 0 { 5.5 } else { 2.0 }, i as f32 * std::f32::consts::PI / 7.0);
                [6.0 + r * libm::cosf(a), 6.0 + r * libm::sinf(a)]
            })
            .collect();
        covers(&star);
        covers(&[[0., 0.], [10., 5.], [0., 10.], [3., 5.]]);
    }

    /// A square with a square hole, whose outline runs to the hole and back over the same bridge; and corners in the middle of sides.
    #[test]
    fn bridges_to_holes_and_corners_on_straight_sides_are_kept() {
        covers(&[
            [0., 0.],
            [10., 0.],
            [10., 10.],
            [0., 10.],
            [0., 0.],
            [3., 3.],
            [3., 7.],
            [7., 7.],
            [7., 3.],
            [3., 3.],
        ]);
        covers(&[
            [0., 0.],
            [4., 0.],
            [8., 0.],
            [12., 0.],
            [12., 4.],
            [8., 4.],
            [4., 4.],
            [4., 7.],
            [4., 10.],
            [0., 10.],
        ]);
    }

    #[test]
    fn what_is_no_outline_is_refused() {
        let bow_tie = [[0., 0., 0.], [10., 10., 0.], [10., 0., 0.], [0., 9., 0.]];
        assert!(triangles(&bow_tie).unwrap_err().contains("crosses itself"));
        assert!(triangles(&bow_tie[..2]).unwrap_err().contains("found 2"));
        let even = [[0., 0., 0.], [10., 10., 0.], [10., 0., 0.], [0., 10., 0.]];
        assert!(triangles(&even).unwrap_err().contains("crosses itself"));
        // On a line: no surface, and nothing to refuse.
        assert_eq!(triangles(&[[0., 0., 0.], [1., 1., 0.], [2., 2., 0.], [1., 1., 0.]]).unwrap().len(), 2);
    }

    /// A convex polygon is cut as it always was: images of runs stay what they were.
    #[test]
    fn a_convex_polygon_is_a_fan() {
        let quad = [[0., 0., 1.], [2., 0., 1.], [2., 2., 1.], [0., 2., 1.]];
        assert_eq!(triangles(&quad).unwrap(), [[0, 1, 2], [0, 2, 3]]);
    }
}
