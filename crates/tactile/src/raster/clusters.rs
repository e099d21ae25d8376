//! A mesh cut into small clusters of neighbouring triangles, so that most of it can be passed over at once.

use gripgen_twin::TriMesh;
use nalgebra::Point3;
use std::ops::Range;

/// Most triangles of a cluster.
const TRIANGLES: usize = 96;

/// Most vertices of a cluster.
pub(super) const VERTICES: usize = 3 * TRIANGLES;

/// A mesh prepared for [`ClusteredMesh::raster`] and for pressing. Made once for a mesh; good for every pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusteredMesh {
    pub(super) clusters: Vec<Cluster>,
    /// Coordinates in metres. A vertex is stored once for each cluster that uses it, in the order of its number in
    /// the mesh.
    pub(super) x_m: Vec<f64>,
    pub(super) y_m: Vec<f64>,
    pub(super) z_m: Vec<f64>,
    /// Corners, counted from the first vertex of the cluster.
    pub(super) triangles: Vec<[u16; 3]>,
}

/// Up to [`TRIANGLES`] triangles and the box around them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cluster {
    pub(super) vertices: Range<usize>,
    pub(super) triangles: Range<usize>,
    pub(super) middle_m: Point3<f64>,
    /// Half of the sides of the box.
    pub(super) half_m: [f64; 3],
}

impl ClusteredMesh {
    /// Small pieces of the mesh, each with its vertices together.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut prepared = Self {
            clusters: Vec::new(),
            x_m: Vec::new(),
            y_m: Vec::new(),
            z_m: Vec::new(),
            triangles: Vec::with_capacity(mesh.triangles().len()),
        };
        mesh.pieces(TRIANGLES).iter().for_each(|piece| prepared.push(mesh, piece));
        prepared
    }

    fn push(&mut self, mesh: &TriMesh, triangles: &[u32]) {
        let corners = |t: &u32| mesh.triangles()[*t as usize];
        let mut numbers: Vec<u32> = triangles.iter().flat_map(corners).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let first = (self.x_m.len(), self.triangles.len());
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &number in &numbers {
            let v = mesh.vertices_m()[number as usize];
            for i in 0..3 {
                low[i] = low[i].min(v[i]);
                high[i] = high[i].max(v[i]);
            }
            self.x_m.push(v.x);
            self.y_m.push(v.y);
            self.z_m.push(v.z);
        }
        let place = |number: u32| numbers.binary_search(&number).unwrap_or_default() as u16;
        self.triangles.extend(triangles.iter().map(|t| corners(t).map(place)));
        self.clusters.push(Cluster {
            vertices: first.0..self.x_m.len(),
            triangles: first.1..self.triangles.len(),
            middle_m: Point3::from([0, 1, 2].map(|i| (low[i] + high[i]) / 2.0)),
            half_m: [0, 1, 2].map(|i| (high[i] - low[i]) / 2.0),
        });
    }
}
