//! Outlines with holes, drawn out along the x axis, whose edges are cut or rounded.

use super::outline::{Edge, Point, inset, twice_area};
use super::{Builder, sin_cos_turn};

/// A prism: an outline in y and z with holes, from one x to another, in millimetres.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Prism {
    /// Counter-clockwise, as y and z.
    pub(super) outline: Vec<Point>,
    /// Counter-clockwise too, inside the outline and apart from each other.
    pub(super) holes: Vec<Vec<Point>>,
    /// Both ends along x.
    pub(super) ends: [f64; 2],
    /// Finish of the edges of both faces, of the holes too.
    pub(super) edge: Edge,
    /// Share of a full turn by which the far end is turned.
    pub(super) twist: f64,
}

impl Prism {
    /// Adds the prism to a mesh.
    pub(super) fn add(&self, b: &mut Builder) {
        let [low, high] = self.ends;
        let steps = self.edge.steps();
        // Places along x, and how far inside: up the first edge, along the side, down the last edge.
        let mut rings: Vec<(f64, f64)> =
            steps.iter().map(|&(behind, inside)| (low + behind, inside)).collect();
        let (from, to) = (rings[rings.len() - 1].0, high - steps[steps.len() - 1].0);
        let between = if self.twist == 0.0 { 1 } else { 8 };
        rings.extend((1..between).map(|i| (from + (to - from) * f64::from(i) / f64::from(between), 0.0)));
        rings.extend(steps.iter().rev().map(|&(behind, inside)| (high - behind, inside)));
        let mut faces: [Vec<Vec<u32>>; 2] = [Vec::new(), Vec::new()];
        let mut flat: Vec<Vec<Point>> = Vec::new();
        let outlines = std::iter::once((&self.outline, 1.0)).chain(self.holes.iter().map(|h| (h, -1.0)));
        for (outline, side) in outlines {
            let made: Vec<Vec<u32>> = rings
                .iter()
                .map(|&(x, inside)| {
                    let turn = self.twist * (x - low) / (high - low);
                    let (s, c) = sin_cos_turn((turn * 1e6) as usize, 1_000_000);
                    inset(outline, side * inside)
                        .iter()
                        .map(|&[y, z]| b.vertex(x * 1e-3, (y * c - z * s) * 1e-3, (y * s + z * c) * 1e-3))
                        .collect()
                })
                .collect();
            for pair in made.windows(2) {
                let n = outline.len();
                for i in 0..n {
                    let j = (i + 1) % n;
                    // Seen from outside the outline runs to the left, a hole to the right.
                    match side > 0.0 {
                        true => b.quad(pair[0][i], pair[0][j], pair[1][j], pair[1][i]),
                        false => b.quad(pair[0][j], pair[0][i], pair[1][i], pair[1][j]),
                    }
                }
            }
            flat.push(inset(outline, side * rings[0].1));
            faces[0].push(made[0].clone());
            faces[1].push(made[made.len() - 1].clone());
        }
        let all: Vec<Point> = flat.concat();
        let [low_face, high_face] = faces.map(|loops| loops.concat());
        for [i, j, k] in filled(&flat) {
            debug_assert!(i.max(j).max(k) < all.len());
            b.triangles.push([low_face[i], low_face[k], low_face[j]]);
            b.triangles.push([high_face[i], high_face[j], high_face[k]]);
        }
    }
}

/// Triangles that fill the first loop without the others, counter-clockwise; points are numbered through all loops. Ear clipping
/// (Meisters 1975) of one loop, into which holes are cut by a way there and back.
fn filled(loops: &[Vec<Point>]) -> Vec<[usize; 3]> {
    let points: Vec<Point> = loops.concat();
    let mut ring: Vec<usize> = (0..loops[0].len()).collect();
    let mut first = loops[0].len();
    let mut holes: Vec<Vec<usize>> = loops[1..]
        .iter()
        .map(|hole| {
            let numbers = (first..first + hole.len()).rev().collect();
            first += hole.len();
            numbers
        })
        .collect();
    let right = |hole: &Vec<usize>| hole.iter().map(|&i| points[i][0]).fold(f64::NEG_INFINITY, f64::max);
    holes.sort_by(|a, b| right(b).total_cmp(&right(a)));
    while !holes.is_empty() {
        let hole = holes.remove(0);
        let rightmost =
            (0..hole.len()).fold(0, |a, b| if points[hole[b]][0] > points[hole[a]][0] { b } else { a });
        let bridge = bridge(&points, &ring, hole[rightmost], &std::iter::once(&hole).chain(&holes));
        let way: Vec<usize> = (0..=hole.len()).map(|k| hole[(rightmost + k) % hole.len()]).collect();
        let back = ring[bridge];
        ring.splice(bridge + 1..bridge + 1, way.into_iter().chain([back]));
    }
    clipped(&points, ring)
}

/// The place on the ring that sees a point of a hole, nearest first.
fn bridge<'a>(
    points: &[Point],
    ring: &[usize],
    from: usize,
    holes: &(impl Iterator<Item = &'a Vec<usize>> + Clone),
) -> usize {
    let p = points[from];
    let distance = |i: usize| {
        let q = points[ring[i]];
        libm::hypot(q[0] - p[0], q[1] - p[1])
    };
    let mut order: Vec<usize> = (0..ring.len()).collect();
    order.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let n = ring.len();
    let sees = |&at: &usize| {
        let q = points[ring[at]];
        let (before, after) = (points[ring[(at + n - 1) % n]], points[ring[(at + 1) % n]]);
        let inside = if turn(before, q, after) > 0.0 {
            turn(before, q, p) > 0.0 && turn(q, after, p) > 0.0
        } else {
            turn(before, q, p) > 0.0 || turn(q, after, p) > 0.0
        };
        let crossed = |ring: &[usize]| {
            (0..ring.len()).any(|i| {
                let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                let ends = [points[a], points[b]];
                !ends.contains(&p) && !ends.contains(&q) && cross(p, q, points[a], points[b])
            })
        };
        inside && !crossed(ring) && !holes.clone().any(|hole| crossed(hole))
    };
    order.iter().copied().find(sees).unwrap_or(order[0])
}

fn clipped(points: &[Point], mut ring: Vec<usize>) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(ring.len());
    let mut at = 0;
    let mut passed = 0;
    while ring.len() > 3 {
        let n = ring.len();
        let [a, b, c] = [(at + n - 1) % n, at % n, (at + 1) % n].map(|i| ring[i]);
        // After a whole turn without an ear, flat and doubtful ones are taken too: the face stays closed.
        if passed > n || is_ear(points, &ring, [a, b, c]) {
            triangles.push([a, b, c]);
            ring.remove(at % n);
            at = (at % n).saturating_sub(1);
            passed = 0;
        } else {
            at = (at + 1) % n;
            passed += 1;
        }
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

fn is_ear(points: &[Point], ring: &[usize], corners: [usize; 3]) -> bool {
    let [a, b, c] = corners.map(|i| points[i]);
    turn(a, b, c) > 1e-9
        && ring.iter().all(|&i| {
            let p = points[i];
            let at_corner = [a, b, c].contains(&p);
            at_corner || turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
        })
}

/// Positive if the way from `a` over `b` to `c` turns left.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    twice_area(&[a, b, c])
}

/// Whether two segments cross or touch.
fn cross(p: Point, q: Point, a: Point, b: Point) -> bool {
    turn(p, q, a) * turn(p, q, b) <= 0.0 && turn(a, b, p) * turn(a, b, q) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::super::outline::{circle, cornered, rectangle};
    use super::*;

    fn area(loops: &[Vec<Point>]) -> f64 {
        let points = loops.concat();
        filled(loops).iter().map(|t| twice_area(&t.map(|i| points[i])).abs() / 2.0).sum()
    }

    /// Triangles cover the outline without its holes once: their areas, all counted as positive, are that of the face.
    #[test]
    fn a_face_with_holes_is_filled_once() {
        let outline = cornered(&rectangle([0.0; 2], [60.0, 40.0]), Edge::Round(5.0));
        let mut loops = vec![outline.clone()];
        for i in 0..4 {
            for j in 0..3 {
                loops.push(circle([12.0 * f64::from(i) - 18.0, 11.0 * f64::from(j) - 11.0], 4.0, 32));
            }
        }
        let holes: f64 = loops[1..].iter().map(|h| twice_area(h) / 2.0).sum();
        assert!((area(&loops) - (twice_area(&outline) / 2.0 - holes)).abs() < 1e-6);
        // A comb: many corners that go in.
        let mut comb: Vec<Point> = vec![[0.0, -5.0], [40.0, -5.0]];
        for i in (0..10).rev() {
            let x = 4.0 * f64::from(i);
            comb.extend([[x + 3.0, 0.0], [x + 2.5, 10.0], [x + 1.5, 10.0], [x + 1.0, 0.0]]);
        }
        comb.push([0.0, 0.0]);
        assert!((area(std::slice::from_ref(&comb)) - twice_area(&comb) / 2.0).abs() < 1e-6);
    }

    #[test]
    fn a_prism_is_closed_and_has_its_volume() {
        let prism = |edge, twist| {
            let mut b = Builder::default();
            Prism {
                outline: rectangle([0.0; 2], [20.0, 10.0]),
                holes: vec![circle([0.0; 2], 3.0, 200)],
                ends: [-4.0, 4.0],
                edge,
                twist,
            }
            .add(&mut b);
            b.finish()
        };
        for edge in [Edge::Sharp, Edge::Chamfer(0.5), Edge::Round(0.5)] {
            let mesh = prism(edge, 0.0);
            let look = mesh.look();
            assert!(
                look.is_closed() && look.turned_edges + look.crowded_edges == 0 && look.bodies == 1,
                "{look:?}"
            );
            let plain = 8.0 * (200.0 - std::f64::consts::PI * 9.0);
            let volume = look.volume_m3 * 1e9;
            match edge {
                Edge::Sharp => assert!((volume / plain - 1.0).abs() < 1e-3, "{volume} of {plain}"),
                // A ring of triangles of half a square millimetre quarter around both rims of both faces.
                _ => assert!(volume < plain - 8.0 && volume > plain - 22.0, "{volume} of {plain}"),
            }
        }
        assert!(prism(Edge::Chamfer(0.3), 0.05).look().is_closed());
    }
}
