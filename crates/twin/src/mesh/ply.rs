//! PLY (Stanford), text and binary, through `ply-rs-bw`. Only places and faces are read; a face of more corners becomes a fan.

use super::{MAX_TRIANGLES, MeshError, Triangle};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Property, PropertyAccess, PropertyAccessResult};

#[derive(Debug, Clone, Copy, Default)]
struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
        let value = match property {
            Property::Char(x) => f64::from(x),
            Property::UChar(x) => f64::from(x),
            Property::Short(x) => f64::from(x),
            Property::UShort(x) => f64::from(x),
            Property::Int(x) => f64::from(x),
            Property::UInt(x) => f64::from(x),
            Property::Float(x) => f64::from(x),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::Ignored,
        };
        let Some(axis) = axis else { return PropertyAccessResult::Ignored };
        self.0[axis] = value as f32;
        PropertyAccessResult::Set
    }
}

/// Corners of a face, as the file numbers them.
#[derive(Debug, Clone, Default)]
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        // Both names are in use.
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListChar(i) => i.into_iter().map(i64::from).collect(),
            Property::ListUChar(i) => i.into_iter().map(i64::from).collect(),
            Property::ListShort(i) => i.into_iter().map(i64::from).collect(),
            Property::ListUShort(i) => i.into_iter().map(i64::from).collect(),
            Property::ListInt(i) => i.into_iter().map(i64::from).collect(),
            Property::ListUInt(i) => i.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let bad = |problem: String| MeshError::File(format!("not a PLY file that can be read: {problem}"));
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
            return Err(MeshError::too_many(triangles.len()));
        }
    }
    Ok(triangles)
}
