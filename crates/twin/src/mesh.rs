//! Triangle meshes in metres, and reading them from the bytes of STL, OBJ, PLY and GLB files.

mod glb;
mod kind;
mod look;
mod obj;
mod orient;
mod pieces;
mod ply;
mod polygon;
mod stl;
#[cfg(test)]
mod tests;
mod text;

pub use look::MeshLook;
pub use stl::write_binary_stl;

use nalgebra::Point3;
use std::collections::HashMap;

/// Most triangles a mesh may have: 2 million fill a 320 x 240 image 26 times over.
pub const MAX_TRIANGLES: usize = 2_000_000;

/// Smallest and largest extent of a part, in metres. Beyond them the unit of the file is wrong.
pub const EXTENT_RANGE_M: (f64, f64) = (0.5e-3, 2.0);

/// A triangle of a file: its corners, in the unit of the file.
type Triangle = [[f32; 3]; 3];

/// An indexed triangle mesh. Coordinates are finite and in metres, indices are in range.
#[derive(Debug, Clone, PartialEq)]
pub struct TriMesh {
    vertices_m: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// Why the bytes of a mesh file could not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A file that is no such mesh.
    #[error("{problem}")]
    File {
        /// What is wrong, and where.
        problem: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// The part would be microscopic or huge: a unit mistake.
    #[error(
        "the part measures {x_mm:.4} x {y_mm:.4} x {z_mm:.4} mm; its largest side must lie between {min} and {max} mm",
        min = EXTENT_RANGE_M.0 * 1e3, max = EXTENT_RANGE_M.1 * 1e3
    )]
    Extent {
        /// Size along x.
        x_mm: f64,
        /// Size along y.
        y_mm: f64,
        /// Size along z.
        z_mm: f64,
    },
}

impl MeshError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            MeshError::File { hint, .. } => hint,
            MeshError::Extent { .. } => {
                "scale_mm_per_unit of the part is millimetres per unit of the mesh file: 1000 for metres, 25.4 for inches"
            }
        }
    }

    fn file(problem: impl Into<String>) -> Self {
        Self::File { problem: problem.into(), hint: "export the part again, as STL, OBJ, PLY or GLB" }
    }

    /// The same with what to do about it.
    fn with_hint(self, hint: &'static str) -> Self {
        match self {
            Self::File { problem, .. } => Self::File { problem, hint },
            extent => extent,
        }
    }

    /// A text file that breaks the grammar in a line, counted from 1.
    fn syntax(line: usize, problem: impl std::fmt::Display) -> Self {
        Self::file(format!("line {line}: {problem}"))
    }

    /// A polygon that cannot be cut into triangles.
    fn outline(problem: String) -> Self {
        Self::file(problem).with_hint("export the part with its faces cut into triangles")
    }

    /// More triangles than [`MAX_TRIANGLES`], found or promised.
    fn too_many(triangles: impl std::fmt::Display) -> Self {
        Self::file(format!("the mesh has {triangles} triangles, at most {MAX_TRIANGLES} are allowed"))
            .with_hint("export the part with a coarser tolerance (0.01 mm), or reduce it (MeshLab, Blender)")
    }
}

/// Endings of the mesh files that are read.
pub const MESH_FORMATS: [&str; 4] = ["stl", "obj", "ply", "glb"];

/// Millimetres per unit of a mesh file that does not say: glTF is in metres (specification 2.0, section 3.4), for the others millimetres
/// are usual.
pub fn usual_scale_mm_per_unit(extension: &str) -> f64 {
    if extension.eq_ignore_ascii_case("glb") { 1000.0 } else { 1.0 }
}

impl TriMesh {
    /// Builds a mesh and checks that indices are in range and coordinates finite.
    ///
    /// # Errors
    ///
    /// No triangles or more than [`MAX_TRIANGLES`], or a coordinate that is not finite.
    ///
    /// # Panics
    ///
    /// If a triangle names a vertex that does not exist: meshes are built by this crate only.
    pub fn new(vertices_m: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::file("the mesh has no triangles"));
        }
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::too_many(triangles.len()));
        }
        for (t, triangle) in triangles.iter().enumerate() {
            for (corner, &v) in triangle.iter().enumerate() {
                let p = &vertices_m[v as usize];
                for (axis, value) in ['x', 'y', 'z'].into_iter().zip(p.iter()) {
                    if !value.is_finite() {
                        return Err(MeshError::file(format!(
                            "triangle {t}, corner {corner}: coordinate {axis} is {value}, not a finite number"
                        )));
                    }
                }
            }
        }
        Ok(Self { vertices_m, triangles })
    }

    /// Reads the bytes of an STL, OBJ, PLY or GLB file; `extension` (any case, without the dot) is the format that its name says. What the
    /// file holds is looked up in its content first.
    ///
    /// `metres_per_unit` is the length of one unit of the file. Equal vertices are merged, triangles without a surface are left out.
    ///
    /// # Errors
    ///
    /// An extension of no known format, a file that holds something else than its name says, that is empty, cut off or malformed, a part
    /// of an implausible size, and whatever [`Self::new`] refuses.
    pub fn from_file_bytes(bytes: &[u8], extension: &str, metres_per_unit: f64) -> Result<Self, MeshError> {
        let known = MESH_FORMATS.into_iter().find(|format| format.eq_ignore_ascii_case(extension));
        let Some(format) = known else {
            let problem =
                format!("`{extension}` is not a known mesh format; known are stl, obj, ply and glb");
            return Err(MeshError::file(problem));
        };
        if bytes.is_empty() {
            return Err(MeshError::file("the file is empty (0 bytes)").with_hint("copy or download it again"));
        }
        let bytes = text::without_mark(bytes);
        kind::check(bytes, format)?;
        let soup = match format {
            "stl" => stl::read(bytes),
            "obj" => obj::read(bytes),
            "ply" => ply::read(bytes),
            _ => glb::read(bytes),
        }?;
        let mesh = Self::from_soup(&soup, metres_per_unit)?;
        let size = mesh.extent_m();
        let largest = size.iter().fold(0.0_f64, |a, &b| a.max(b));
        if !(EXTENT_RANGE_M.0..=EXTENT_RANGE_M.1).contains(&largest) {
            let [x_mm, y_mm, z_mm] = size.map(|s| s * 1e3);
            return Err(MeshError::Extent { x_mm, y_mm, z_mm });
        }
        Ok(mesh)
    }

    /// Merges bitwise equal corners of a list of triangles, keeping the order of first appearance. Triangles without area are left out
    /// where they add nothing: two of their corners are one, or a corner belongs to no triangle with area.
    fn from_soup(soup: &[Triangle], metres_per_unit: f64) -> Result<Self, MeshError> {
        let mut seen: HashMap<[u32; 3], u32> = HashMap::with_capacity(soup.len());
        let mut vertices_m = Vec::new();
        // +0 and -0 are the same place.
        let key = |corner: &[f32; 3]| corner.map(|x| (x + 0.0).to_bits());
        let with_area = |corners: &&Triangle| !is_flat(corners);
        let mut triangles = Vec::with_capacity(soup.len());
        for corner in soup.iter().filter(with_area).flatten() {
            seen.entry(key(corner)).or_insert_with(|| {
                vertices_m.push(Point3::from(corner.map(|x| f64::from(x) * metres_per_unit)));
                (vertices_m.len() - 1) as u32
            });
        }
        for corners in soup {
            let [Some(&a), Some(&b), Some(&c)] = [0, 1, 2].map(|i| seen.get(&key(&corners[i]))) else {
                continue;
            };
            if a != b && b != c && c != a {
                triangles.push([a, b, c]);
            }
        }
        if triangles.is_empty() && !soup.is_empty() {
            return Err(MeshError::file(format!("none of the {} triangles has an area", soup.len())));
        }
        Self::new(vertices_m, triangles)
    }

    /// Vertices, in metres.
    pub fn vertices_m(&self) -> &[Point3<f64>] {
        &self.vertices_m
    }

    /// Triangles as indices into [`TriMesh::vertices_m`], counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of triangle `t`.
    #[inline]
    pub fn corners(&self, t: usize) -> [Point3<f64>; 3] {
        self.triangles[t].map(|v| self.vertices_m[v as usize])
    }

    /// Smallest and largest coordinates.
    pub fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for p in &self.vertices_m {
            for axis in 0..3 {
                low[axis] = low[axis].min(p[axis]);
                high[axis] = high[axis].max(p[axis]);
            }
        }
        (low, high)
    }

    /// Size of the bounding box.
    pub fn extent_m(&self) -> [f64; 3] {
        let (low, high) = self.bounds_m();
        [0, 1, 2].map(|axis| high[axis] - low[axis])
    }

    /// Volume enclosed by a closed mesh, by the divergence theorem; the sign tells the orientation.
    pub fn signed_volume_m3(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                a.coords.dot(&b.coords.cross(&c.coords)) / 6.0
            })
            .sum()
    }
}

/// Whether the corners of a triangle lie on a line. A corner that is not finite lies on none: it is refused later, with its place.
fn is_flat(corners: &Triangle) -> bool {
    let [a, b, c] = corners.map(|corner| nalgebra::Vector3::from(corner.map(f64::from)));
    (b - a).cross(&(c - a)) == nalgebra::Vector3::zeros()
}
