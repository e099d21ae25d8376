//! PLY (Stanford), text and binary, through `ply-rs-bw`. Only places and faces are read; a face of more corners becomes a fan.

use super::{MAX_TRIANGLES, MeshError};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, PropertyAccess, PropertyAccessResult};

#[derive(Debug, Clone, Copy, Default)]
struct Vertex([f32; 3]);

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[axis] = value as f32;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

/// Corners of a face, as the file numbers them.
#[derive(Debug, Clone, Default)]
struct Face(Vec<i64>);

impl Face {
    fn set<T: Into<i64>>(&mut self, name: &str, values: Vec<T>) -> PropertyAccessResult {
        // Both names are in use.
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.0 = values.into_iter().map(Into::into).collect();
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }
    fn set_list_char(&mut self, name: &str, value: Vec<i8>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_uchar(&mut self, name: &str, value: Vec<u8>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_short(&mut self, name: &str, value: Vec<i16>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_ushort(&mut self, name: &str, value: Vec<u16>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_int(&mut self, name: &str, value: Vec<i32>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_uint(&mut self, name: &str, value: Vec<u32>) -> PropertyAccessResult {
        self.set(name, value)
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<[[f32; 3]; 3]>, MeshError> {
    if bytes.is_empty() {
        return Err(MeshError::EmptyFile);
    }
    let bad = |problem: String| MeshError::Unreadable { format: "PLY", problem };
    let mut reader = Reader::new(bytes);
    let (vertices_of, faces_of) = (Parser::<Vertex>::new(), Parser::<Face>::new());
    let header = vertices_of.read_header(&mut reader).map_err(|e| bad(e.to_string()))?;
    for (name, element) in &header.elements {
        // A row has a byte at least: a file that promises more than it can have is cut off, or hostile.
        if element.count > bytes.len() {
            let problem = format!("it promises {} of `{name}`, and has {} bytes", element.count, bytes.len());
            return Err(bad(problem));
        }
    }
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                let read = vertices_of.read_payload_for_element(&mut reader, element, &header);
                vertices = read.map_err(|e| bad(e.to_string()))?;
            }
            "face" => {
                let read = faces_of.read_payload_for_element(&mut reader, element, &header);
                faces = read.map_err(|e| bad(e.to_string()))?;
            }
            _ => {
                let other = Parser::<DefaultElement>::new();
                other
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|e| bad(e.to_string()))?;
            }
        }
    }
    let mut triangles = Vec::with_capacity(faces.len());
    for (number, Face(corners)) in faces.iter().enumerate() {
        let at = |i: i64| {
            let found = usize::try_from(i).ok().and_then(|i| vertices.get(i));
            found.map(|vertex| vertex.0).ok_or_else(|| {
                let there = vertices.len();
                bad(format!("face {number} (from 0) has vertex {i} of {there}, counted from 0"))
            })
        };
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            triangles.push([at(corners[0])?, at(pair[0])?, at(pair[1])?]);
        }
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::TooManyTriangles { triangles: triangles.len() as u64 });
        }
    }
    Ok(triangles)
}
