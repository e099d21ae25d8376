//! Triangle meshes in metres, and reading them from the bytes of STL, OBJ, PLY and GLB files.

mod glb;
mod look;
mod obj;
mod orient;
mod pieces;
mod ply;
mod stl;

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
    /// What is wrong with the file, and where.
    #[error("{0}")]
    File(String),
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
    /// A text file that breaks the grammar in a line, counted from 1.
    fn syntax(line: usize, problem: &str) -> Self {
        Self::File(format!("line {line}: {problem}"))
    }

    /// More triangles than [`MAX_TRIANGLES`], found or promised.
    fn too_many(triangles: impl std::fmt::Display) -> Self {
        Self::File(format!("the mesh has {triangles} triangles, at most {MAX_TRIANGLES} are allowed"))
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
            return Err(MeshError::File("the mesh has no triangles".into()));
        }
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::too_many(triangles.len()));
        }
        for (t, triangle) in triangles.iter().enumerate() {
            for (corner, &v) in triangle.iter().enumerate() {
                let p = &vertices_m[v as usize];
                for (axis, value) in ['x', 'y', 'z'].into_iter().zip(p.iter()) {
                    if !value.is_finite() {
                        return Err(MeshError::File(format!(
                            "triangle {t}, corner {corner}: coordinate {axis} is {value}, not a finite number"
                        )));
                    }
                }
            }
        }
        Ok(Self { vertices_m, triangles })
    }

    /// Reads the bytes of an STL, OBJ, PLY or GLB file; `extension` (any case, without the dot) names the format.
    ///
    /// `metres_per_unit` is the length of one unit of the file. Equal vertices are merged.
    ///
    /// # Errors
    ///
    /// An extension that is neither `stl` nor `obj`, a file that is empty, cut off or malformed, and whatever
    /// [`Self::new`] refuses.
    pub fn from_file_bytes(bytes: &[u8], extension: &str, metres_per_unit: f64) -> Result<Self, MeshError> {
        let extension = extension.to_ascii_lowercase();
        let read = match extension.as_str() {
            "stl" => stl::read,
            "obj" => obj::read,
            "ply" => ply::read,
            "glb" => glb::read,
            _ => {
                let known = "known are stl, obj, ply and glb";
                return Err(MeshError::File(format!("`{extension}` is not a known mesh format; {known}")));
            }
        };
        if bytes.is_empty() {
            return Err(MeshError::File("the file is empty (0 bytes)".into()));
        }
        let mesh = Self::from_soup(&read(bytes)?, metres_per_unit)?;
        let size = mesh.extent_m();
        let largest = size.iter().fold(0.0_f64, |a, &b| a.max(b));
        if !(EXTENT_RANGE_M.0..=EXTENT_RANGE_M.1).contains(&largest) {
            let [x_mm, y_mm, z_mm] = size.map(|s| s * 1e3);
            return Err(MeshError::Extent { x_mm, y_mm, z_mm });
        }
        Ok(mesh)
    }

    /// Merges bitwise equal corners of a list of triangles, keeping the order of first appearance.
    fn from_soup(soup: &[Triangle], metres_per_unit: f64) -> Result<Self, MeshError> {
        let mut seen: HashMap<[u32; 3], u32> = HashMap::with_capacity(soup.len());
        let mut vertices_m = Vec::new();
        let mut triangles = Vec::with_capacity(soup.len());
        for corners in soup {
            triangles.push(corners.map(|c| {
                // +0 and -0 are the same place.
                let key = c.map(|x| (x + 0.0).to_bits());
                *seen.entry(key).or_insert_with(|| {
                    vertices_m.push(Point3::from(c.map(|x| f64::from(x) * metres_per_unit)));
                    (vertices_m.len() - 1) as u32
                })
            }));
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

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "solid t\n\
        facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 10 0\nvertex 10 0 0\nendloop\nendfacet\n\
        facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 0 10\nendloop\nendfacet\n\
        facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 10\nvertex 0 10 0\nendloop\nendfacet\n\
        facet normal 1 1 1\nouter loop\nvertex 10 0 0\nvertex 0 10 0\nvertex 0 0 10\nendloop\nendfacet\n\
        endsolid t\n";

    fn tetrahedron() -> TriMesh {
        TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "STL", 1e-3).unwrap()
    }

    fn error(bytes: &[u8], extension: &str) -> String {
        TriMesh::from_file_bytes(bytes, extension, 1e-3).unwrap_err().to_string()
    }

    #[test]
    fn ascii_and_binary_stl_and_obj_give_the_same_mesh() {
        let ascii = tetrahedron();
        assert_eq!(ascii.vertices_m().len(), 4, "shared corners are merged");
        assert!((ascii.signed_volume_m3() - 1e-6 / 6.0).abs() < 1e-20);
        let binary = write_binary_stl(&ascii, "t", 1e-3);
        assert_eq!(TriMesh::from_file_bytes(&binary, "stl", 1e-3).unwrap(), ascii);
        let obj = b"v 0 0 0\nv 0 10 0\nv 10 0 0\nv 0 0 10\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 3 2 4\n";
        let obj = TriMesh::from_file_bytes(obj, "obj", 1e-3).unwrap();
        assert_eq!(obj.signed_volume_m3(), ascii.signed_volume_m3());
    }

    /// The tetrahedron as text and binary PLY, and as GLB in metres behind a node that turns and moves it.
    fn other_formats() -> Vec<(&'static str, Vec<u8>, f64)> {
        let points = [[0.0_f32, 0.0, 0.0], [0.0, 10.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]];
        let faces = [[0_u16, 1, 2], [0, 2, 3], [0, 3, 1], [2, 1, 3]];
        let header = |format: &str| {
            format!(
                "ply\nformat {format} 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                 property uchar red\nelement face 4\nproperty list uchar int vertex_index\nend_header\n"
            )
        };
        let mut text = header("ascii");
        let mut binary = header("binary_little_endian").into_bytes();
        for p in points {
            text += &format!("{} {} {} 7\n", p[0], p[1], p[2]);
            binary.extend(p.iter().flat_map(|x| x.to_le_bytes()));
            binary.push(7);
        }
        for f in faces {
            text += &format!("3 {} {} {}\n", f[0], f[1], f[2]);
            binary.push(3);
            binary.extend(f.iter().flat_map(|i| i32::from(*i).to_le_bytes()));
        }
        // Turned by a quarter about z and moved back: x = -y' , so the points are stored the other way round.
        let mut data: Vec<u8> = Vec::new();
        for [x, y, z] in points {
            data.extend([y, -x, z].iter().flat_map(|v| (v * 1e-3 + 1.0).to_le_bytes()));
        }
        data.extend(faces.iter().flatten().flat_map(|i| i.to_le_bytes()));
        let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
            "nodes":[{"children":[1],"rotation":[0,0,0.70710678,0.70710678]},{"mesh":0,"translation":[-1,-1,-1]}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
            "buffers":[{"byteLength":72}],
            "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,2,2]},
                         {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]}"#;
        let mut json = json.as_bytes().to_vec();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(((12 + 8 + json.len() + 8 + data.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        vec![("ply", text.into_bytes(), 1.0), ("ply", binary, 1.0), ("glb", glb, 1000.0)]
    }

    #[test]
    fn ply_and_glb_give_the_same_mesh() {
        let stl = tetrahedron();
        for (extension, bytes, mm_per_unit) in other_formats() {
            assert_eq!(usual_scale_mm_per_unit(extension), mm_per_unit);
            let mesh = TriMesh::from_file_bytes(&bytes, extension, mm_per_unit * 1e-3).unwrap();
            assert_eq!((mesh.vertices_m().len(), mesh.triangles().len()), (4, 4), "{extension}");
            assert!((mesh.signed_volume_m3() - stl.signed_volume_m3()).abs() < 1e-12, "{extension}");
            let (size, wanted) = (mesh.extent_m(), stl.extent_m());
            assert!((0..3).all(|i| (size[i] - wanted[i]).abs() < 1e-6), "{extension}: {size:?}");
        }
    }

    /// Damaged in every byte, cut off anywhere: an error or a mesh, never a panic, and never more than the file can hold.
    #[test]
    fn damaged_ply_and_glb_never_panic() {
        for (extension, bytes, mm_per_unit) in other_formats() {
            let read = |bytes: &[u8]| TriMesh::from_file_bytes(bytes, extension, mm_per_unit * 1e-3);
            // The line break after the last word of a text may be missing.
            for at in 0..bytes.len() - 1 {
                assert!(read(&bytes[..at]).is_err(), "{extension} of {at} bytes");
                for value in [0, 1, b'0', b'9', b'-', b'"', 127, 255] {
                    let mut damaged = bytes.clone();
                    damaged[at] = value;
                    let _ = read(&damaged);
                }
            }
        }
        let many = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n0\n";
        assert!(error(many.as_bytes(), "ply").contains("promises 4000000000 of `vertex`, and has"));
        let out = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 1 2\n";
        assert!(error(out.as_bytes(), "ply").contains("face 0 (from 0) has vertex 1 of 1"));
        assert!(error(b"glTF", "glb").contains("not a GLB file"));
    }

    #[test]
    fn an_ascii_header_does_not_fool_a_binary_file() {
        let mut binary = write_binary_stl(&tetrahedron(), "t", 1e-3);
        binary[..6].copy_from_slice(b"solid ");
        assert_eq!(TriMesh::from_file_bytes(&binary, "stl", 1e-3).unwrap(), tetrahedron());
    }

    #[test]
    fn broken_files_say_what_and_where() {
        assert!(error(b"", "stl").contains("empty"));
        assert!(error(b"hello", "stl").contains("5 bytes"));
        assert!(error(TETRAHEDRON.as_bytes(), "step").contains("`step`"));
        let cut = &TETRAHEDRON[..TETRAHEDRON.len() - 60];
        assert!(error(cut.as_bytes(), "stl").contains("line"), "{}", error(cut.as_bytes(), "stl"));
        let nan = TETRAHEDRON.replacen("10 0 0", "10 nan 0", 1);
        assert_eq!(
            error(nan.as_bytes(), "stl"),
            "triangle 0, corner 2: coordinate y is NaN, not a finite number"
        );
        let word = TETRAHEDRON.replacen("10 0 0", "10 zero 0", 1);
        assert_eq!(error(word.as_bytes(), "stl"), "line 6: `zero` is not a number");
        let mut binary = write_binary_stl(&tetrahedron(), "t", 1e-3);
        binary.truncate(150);
        assert!(error(&binary, "stl").contains("promises 4 triangles (284 bytes), it has 150 bytes"));
        binary[80..84].copy_from_slice(&3_000_000u32.to_le_bytes());
        assert!(error(&binary, "stl").contains("3000000 triangles"));
        assert!(error(b"solid nothing\nendsolid nothing\n", "stl").contains("no triangles"));
        assert!(error(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "obj").contains("9"));
    }

    #[test]
    fn a_wrong_unit_is_noticed() {
        let small = TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "stl", 1e-6).unwrap_err();
        assert!(small.to_string().contains("0.0100 x 0.0100 x 0.0100 mm"), "{small}");
        assert!(TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "stl", 1.0).is_err());
    }
}
