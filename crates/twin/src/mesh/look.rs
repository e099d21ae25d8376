//! What is wrong with a mesh: holes, turned faces, several bodies, slivers.

use super::TriMesh;
use std::collections::HashMap;

/// Corners closer than this share of the mesh's size are one, where exact equality leaves holes.
const WELD_SHARE: f64 = 1e-6;

/// A triangle thinner than this is a sliver.
const SLIVER_M: f64 = 1e-7;

/// What a look at a mesh finds. A sound mesh has no open, crowded or turned edges and a positive volume.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshLook {
    /// Triangles.
    pub triangles: usize,
    /// Pieces that share no corner.
    pub bodies: usize,
    /// Edges of one triangle only: the rims of holes.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub crowded_edges: usize,
    /// Edges whose two triangles face opposite ways.
    pub turned_edges: usize,
    /// Triangles thinner than 0.1 um.
    pub slivers: usize,
    /// Volume enclosed; negative if the mesh is inside out, without meaning if it is open.
    pub volume_m3: f64,
}

impl MeshLook {
    /// Whether the mesh encloses a volume.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0
    }

    /// Whether its faces look outwards, as far as can be told: an open mesh has no outside.
    pub fn faces_outwards(&self) -> bool {
        self.turned_edges == 0 && !(self.is_closed() && self.volume_m3 < 0.0)
    }

    /// What there is to say, a sentence each; none of a sound mesh of one body.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut say = |n: usize, text: String| {
            if n > 0 {
                words.push(text);
            }
        };
        let n = self.open_edges;
        say(n, format!("the mesh is open: {n} edges belong to one triangle only; gels sink into its holes"));
        let n = self.crowded_edges;
        say(n, format!("{n} edges belong to more than two triangles"));
        let n = self.turned_edges;
        let turned = "its faces are turned outwards where grips are looked for; images do not depend on it";
        say(n, format!("{n} edges join faces that look opposite ways; {turned}"));
        let inside_out = self.turned_edges == 0 && !self.faces_outwards();
        say(usize::from(inside_out), format!("the mesh is inside out; {turned}"));
        let n = self.bodies;
        say(n.saturating_sub(1), format!("the mesh has {n} bodies, which are held as one part"));
        let (n, all) = (self.slivers, self.triangles);
        say(n, format!("{n} of {all} triangles are thinner than 0.1 um"));
        words
    }
}

impl TriMesh {
    /// Looks for what is wrong with the mesh.
    pub fn look(&self) -> MeshLook {
        self.look_and_join().0
    }

    /// The same, and for each vertex the one that stands for it: itself where that leaves no holes.
    pub(super) fn look_and_join(&self) -> (MeshLook, Vec<u32>) {
        let exact: Vec<u32> = (0..self.vertices_m().len() as u32).collect();
        let look = self.look_with(&exact);
        if look.is_closed() {
            return (look, exact);
        }
        let near = self.welded();
        let welded = self.look_with(&near);
        if welded.open_edges < look.open_edges { (welded, near) } else { (look, exact) }
    }

    /// For each vertex the first one in its cell of a fine grid.
    fn welded(&self) -> Vec<u32> {
        let (low, _) = self.bounds_m();
        let size = self.extent_m().iter().fold(0.0_f64, |a, &b| a.max(b));
        let cell = WELD_SHARE * size;
        let mut first: HashMap<[i64; 3], u32> = HashMap::new();
        let place = |p: &nalgebra::Point3<f64>| [0, 1, 2].map(|i| ((p[i] - low[i]) / cell).round() as i64);
        self.vertices_m()
            .iter()
            .enumerate()
            .map(|(i, p)| *first.entry(place(p)).or_insert(i as u32))
            .collect()
    }

    fn look_with(&self, same: &[u32]) -> MeshLook {
        // An edge from its lower to its higher vertex: how many triangles run along it, and against it.
        let mut edges: HashMap<(u32, u32), (u32, u32)> = HashMap::with_capacity(self.triangles().len() * 2);
        let mut above: Vec<u32> = (0..same.len() as u32).collect();
        let mut slivers = 0;
        for (t, corners) in self.triangles().iter().enumerate() {
            slivers += usize::from(thickness_m(self, t) < SLIVER_M);
            let [a, b, c] = corners.map(|v| same[v as usize]);
            join(&mut above, a, b);
            join(&mut above, a, c);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (along, against) = edges.entry((from.min(to), from.max(to))).or_default();
                *(if from < to { along } else { against }) += 1;
            }
        }
        let count = |f: fn(&(u32, u32)) -> bool| edges.values().filter(|e| f(e)).count();
        let mut used = vec![false; same.len()];
        for corners in self.triangles() {
            for &v in corners {
                used[same[v as usize] as usize] = true;
            }
        }
        let bodies = (0..same.len() as u32).filter(|&v| used[v as usize] && above[v as usize] == v).count();
        MeshLook {
            triangles: self.triangles().len(),
            bodies,
            open_edges: count(|(a, b)| a + b == 1),
            crowded_edges: count(|(a, b)| a + b > 2),
            turned_edges: count(|&(a, b)| a + b == 2 && a != b),
            slivers,
            volume_m3: self.signed_volume_m3(),
        }
    }
}

/// Height of a triangle over its longest side.
fn thickness_m(mesh: &TriMesh, t: usize) -> f64 {
    let [a, b, c] = mesh.corners(t);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    if longest == 0.0 { 0.0 } else { (b - a).cross(&(c - a)).norm() / longest }
}

fn root(above: &mut [u32], mut v: u32) -> u32 {
    while above[v as usize] != v {
        above[v as usize] = above[above[v as usize] as usize];
        v = above[v as usize];
    }
    v
}

fn join(above: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(above, a), root(above, b));
    above[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{BallBearing, InvoluteGear, RollerBearing, SteppedShaft};
    use nalgebra::Point3;

    /// Boxes of 10 mm side by side, 20 mm apart.
    fn boxes(n: u32) -> TriMesh {
        let corner = |k: u32, i: u32| {
            let bit = |b: u32| f64::from(i >> b & 1) * 0.01;
            Point3::new(bit(0) + 0.02 * f64::from(k), bit(1), bit(2))
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let vertices = (0..n).flat_map(|k| (0..8).map(move |i| corner(k, i))).collect();
        let triangles = (0..n).flat_map(|k| {
            quads.into_iter().flat_map(move |q| {
                let [a, b, c, d] = q.map(|v| v + 8 * k);
                [[a, b, c], [a, c, d]]
            })
        });
        TriMesh::new(vertices, triangles.collect()).unwrap()
    }

    #[test]
    fn a_sound_mesh_has_nothing_to_say() {
        for mesh in [boxes(1), SteppedShaft::default().mesh()] {
            assert_eq!(mesh.look().words(), Vec::<String>::new());
        }
        // The faces of our gear end in slivers at the roots of its teeth, and that is all.
        let gear = InvoluteGear::default().mesh().look();
        assert!(
            gear.is_closed() && gear.bodies == 1 && gear.words().len() == 1 && gear.slivers > 0,
            "{gear:?}"
        );
        assert!((boxes(1).look().volume_m3 * 1e9 - 1000.0).abs() < 1e-9);
        for mesh in [BallBearing::default().mesh(), RollerBearing::default().mesh()] {
            let look = mesh.look();
            assert!(look.is_closed() && look.bodies > 3, "{look:?}");
        }
    }

    #[test]
    fn faults_are_counted() {
        let mesh = boxes(2);
        assert_eq!(mesh.look().bodies, 2);
        let holed = TriMesh::new(mesh.vertices_m().to_vec(), mesh.triangles()[1..].to_vec()).unwrap();
        assert_eq!(holed.look().open_edges, 3);
        let mut triangles = mesh.triangles().to_vec();
        triangles[0].swap(0, 1);
        let turned = TriMesh::new(mesh.vertices_m().to_vec(), triangles).unwrap().look();
        assert_eq!((turned.turned_edges, turned.open_edges), (3, 0));
        let all = mesh.triangles().iter().map(|&[a, b, c]| [b, a, c]).collect();
        let inside_out = TriMesh::new(mesh.vertices_m().to_vec(), all).unwrap().look();
        assert!(inside_out.volume_m3 < 0.0 && inside_out.words().iter().any(|w| w.contains("inside out")));
    }

    /// Corners that an exporter wrote a little differently for each triangle are one corner.
    #[test]
    fn corners_that_are_nearly_equal_leave_no_holes() {
        let mesh = boxes(1);
        let vertices: Vec<Point3<f64>> = (0..mesh.triangles().len())
            .flat_map(|t| mesh.corners(t).map(|p| p + nalgebra::Vector3::repeat(1e-10 * t as f64)))
            .collect();
        let triangles = (0..mesh.triangles().len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let look = TriMesh::new(vertices, triangles).unwrap().look();
        assert!(look.is_closed() && look.bodies == 1, "{look:?}");
    }
}
