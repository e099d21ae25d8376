//! Turning the faces of a mesh outwards.

use super::TriMesh;
use nalgebra::Point3;
use std::collections::HashMap;

/// Most shells of which each is compared with all others.
const MOST_SHELLS: usize = 2000;

/// The triangles of an edge: how many, and the first two with whether each runs from the lower to the higher vertex.
type Edge = (usize, [(u32, bool); 2]);

/// Triangles that hang together by edges of two triangles.
struct Shell {
    triangles: Vec<u32>,
    /// Whether each of its edges has two triangles.
    closed: bool,
    low: [f64; 3],
    high: [f64; 3],
}

impl TriMesh {
    /// The same mesh with its faces turned outwards. The faces of a shell look as most of its area does; all are turned if they enclose
    /// a negative volume, and so is a closed shell that lies in no other. A turned triangle has its last two corners swapped.
    pub fn faced_outwards(&self) -> Self {
        let mut turned = vec![false; self.triangles().len()];
        let shells = self.shells(&mut turned);
        if (0..turned.len()).map(|t| self.volume_below_m3(t, &turned)).sum::<f64>() < 0.0 {
            turned.iter_mut().for_each(|t| *t = !*t);
        }
        let closed: Vec<&Shell> = shells.iter().filter(|shell| shell.closed).collect();
        for shell in closed.iter().filter(|_| closed.len() <= MOST_SHELLS) {
            let volume_m3: f64 =
                shell.triangles.iter().map(|&t| self.volume_below_m3(t as usize, &turned)).sum();
            // A shell inside another may be a hollow, which looks inwards.
            if volume_m3 < 0.0 && !closed.iter().any(|other| shell.lies_in(other)) {
                shell.turn(&mut turned);
            }
        }
        let triangles = self.triangles().iter().zip(turned);
        let triangles = triangles.map(|(&[a, b, c], turned)| if turned { [a, c, b] } else { [a, b, c] });
        Self { vertices_m: self.vertices_m().to_vec(), triangles: triangles.collect() }
    }

    /// The shells, each with its faces turned alike.
    fn shells(&self, turned: &mut [bool]) -> Vec<Shell> {
        let (_, same) = self.look_and_join();
        let edges = self.edges(&same);
        let mut seen = vec![false; turned.len()];
        let mut shells = Vec::new();
        for first in 0..turned.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let (mut triangles, mut closed, mut next) = (vec![first as u32], true, 0);
            while let Some(&t) = triangles.get(next) {
                next += 1;
                let sides = sides(self.triangles()[t as usize], &same);
                closed &= sides.is_some();
                for (edge, along) in sides.into_iter().flatten() {
                    let (2, pair) = edges[&edge] else {
                        closed = false;
                        continue;
                    };
                    let (other, other_along) = if pair[0].0 == t { pair[1] } else { pair[0] };
                    if !std::mem::replace(&mut seen[other as usize], true) {
                        // Two triangles look the same way where they run against each other.
                        turned[other as usize] = turned[t as usize] ^ (along == other_along);
                        triangles.push(other);
                    }
                }
            }
            let shell = self.shell(triangles, closed);
            let area = |of_turned: bool| -> f64 {
                let those = shell.triangles.iter().filter(|&&t| turned[t as usize] == of_turned);
                those.map(|&t| self.twice_area_m2(t as usize)).sum()
            };
            if area(true) > area(false) {
                shell.turn(turned);
            }
            shells.push(shell);
        }
        shells
    }

    fn shell(&self, triangles: Vec<u32>, closed: bool) -> Shell {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in triangles.iter().flat_map(|&t| self.corners(t as usize)) {
            for axis in 0..3 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        Shell { triangles, closed, low, high }
    }

    fn edges(&self, same: &[u32]) -> HashMap<(u32, u32), Edge> {
        let mut edges: HashMap<(u32, u32), Edge> = HashMap::with_capacity(self.triangles().len() * 2);
        for (t, &corners) in self.triangles().iter().enumerate() {
            for (edge, along) in sides(corners, same).into_iter().flatten() {
                let (count, pair) = edges.entry(edge).or_default();
                if let Some(side) = pair.get_mut(*count) {
                    *side = (t as u32, along);
                }
                *count += 1;
            }
        }
        edges
    }

    /// Signed volume between a triangle and the origin, of a turned one with the other sign.
    fn volume_below_m3(&self, t: usize, turned: &[bool]) -> f64 {
        let [a, b, c] = self.corners(t).map(|p: Point3<f64>| p.coords);
        let volume_m3 = a.dot(&b.cross(&c)) / 6.0;
        if turned[t] { -volume_m3 } else { volume_m3 }
    }

    fn twice_area_m2(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(&(c - a)).norm()
    }
}

impl Shell {
    fn turn(&self, turned: &mut [bool]) {
        for &t in &self.triangles {
            turned[t as usize] = !turned[t as usize];
        }
    }

    /// Whether its box lies in that of another, larger one.
    fn lies_in(&self, other: &Self) -> bool {
        let inside = (0..3).all(|i| other.low[i] <= self.low[i] && self.high[i] <= other.high[i]);
        inside && (other.low != self.low || other.high != self.high)
    }
}

/// The edges of a triangle, from the lower to the higher vertex, and whether it runs along them; `None` if two corners are one.
fn sides(corners: [u32; 3], same: &[u32]) -> Option<[((u32, u32), bool); 3]> {
    let [a, b, c] = corners.map(|v| same[v as usize]);
    let side = |from: u32, to: u32| ((from.min(to), from.max(to)), from < to);
    (a != b && b != c && c != a).then(|| [side(a, b), side(b, c), side(c, a)])
}

#[cfg(test)]
mod tests {
    use crate::TriMesh;
    use crate::parts::{BallBearing, SteppedShaft};
    use nalgebra::Point3;

    fn turned(mesh: &TriMesh, turn: impl Fn(usize) -> bool) -> TriMesh {
        let each = |(t, &[a, b, c]): (usize, &[u32; 3])| if turn(t) { [a, c, b] } else { [a, b, c] };
        let triangles = mesh.triangles().iter().enumerate().map(each).collect();
        TriMesh::new(mesh.vertices_m().to_vec(), triangles).unwrap()
    }

    #[test]
    fn faces_that_were_turned_are_turned_back() {
        for mesh in [SteppedShaft::default().mesh(), BallBearing::default().mesh()] {
            assert_eq!(mesh.faced_outwards(), mesh, "a sound mesh stays as it is");
            assert_eq!(turned(&mesh, |t| t % 3 == 0).faced_outwards(), mesh);
            assert_eq!(turned(&mesh, |_| true).faced_outwards(), mesh);
        }
        // More than half of the only shell: its volume tells.
        let mesh = SteppedShaft::default().mesh();
        assert_eq!(turned(&mesh, |t| t % 3 != 0).faced_outwards(), mesh);
    }

    /// A box of 10 mm with a hollow of 4 mm: the hollow's faces look into it, and stay so.
    #[test]
    fn a_hollow_stays_a_hollow() {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let corners = |half_m: f64| {
            (0..8_u32).map(move |i| {
                let at = |bit: u32| if i >> bit & 1 == 1 { half_m } else { -half_m };
                Point3::new(at(0), at(1), at(2))
            })
        };
        let faces = |first: u32, inwards: bool| {
            quads.into_iter().flat_map(move |q| {
                let [a, b, c, d] = q.map(|v: u32| v + first);
                if inwards { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
            })
        };
        let vertices = corners(5e-3).chain(corners(2e-3)).collect();
        let mesh = TriMesh::new(vertices, faces(0, false).chain(faces(8, true)).collect()).unwrap();
        assert!((mesh.signed_volume_m3() * 1e9 - 936.0).abs() < 1e-6);
        assert_eq!(mesh.faced_outwards(), mesh);
        assert_eq!(turned(&mesh, |t| t % 4 == 1).faced_outwards(), mesh);
        assert_eq!(turned(&mesh, |_| true).faced_outwards(), mesh);
    }
}
