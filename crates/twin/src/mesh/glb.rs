//! Binary glTF 2.0 (GLB), after its specification (Khronos, 3.6 to 3.7, 4.4). Triangles of the default scene with the transforms of their
//! nodes; materials, skins and animations are ignored. The structure is read by `serde_json`; what it names is looked up and bounded
//! here, because the library for it indexes unchecked and panics on damaged files.

use super::{MAX_TRIANGLES, MeshError, Triangle};
use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

/// A tree of nodes that is deeper than this is none.
const DEEPEST: usize = 64;

/// Types of numbers and their bytes: unsigned 8, 16 and 32 bits for corners of faces; for places 32-bit floats and, with the extension
/// `KHR_mesh_quantization`, signed and unsigned 8 and 16 bits.
const WHOLE: [(u32, usize); 3] = [(5121, 1), (5123, 2), (5125, 4)];
const PLACE: [(u32, usize); 5] = [(5126, 4), (5120, 1), (5121, 1), (5122, 2), (5123, 2)];

/// How extensions begin that a file may need and that do not move a vertex: looks, lights, notes, motions; and one that is read.
const HARMLESS: [&str; 9] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_animation_",
    "KHR_xmp",
    "KHR_mesh_quantization",
];

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Document {
    #[serde(default)]
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<Scene>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    meshes: Vec<Mesh>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default)]
    buffer_views: Vec<View>,
    #[serde(default)]
    buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<usize>,
    mesh: Option<usize>,
    matrix: Option<[f32; 16]>,
    translation: Option<[f32; 3]>,
    rotation: Option<[f32; 4]>,
    scale: Option<[f32; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    mode: Option<u32>,
}

#[derive(Deserialize)]
struct Attributes {
    #[serde(rename = "POSITION")]
    position: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    shape: String,
    #[serde(default)]
    normalized: bool,
    sparse: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let (json, blob) = chunks(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(|e| bad(e.to_string()))?;
    let needed = &document.extensions_required;
    if let Some(extension) = needed.iter().find(|name| !HARMLESS.iter().any(|start| name.starts_with(start)))
    {
        let extension = super::text::quoted(extension.as_bytes());
        return Err(bad(format!("it needs the extension {extension}"))
            .with_hint("export it without compression, as plain GLB"));
    }
    let roots: Vec<usize> = if document.scenes.is_empty() && document.scene.is_none() {
        // A file without a scene is a library: all of it is the part.
        let mut roots = vec![true; document.nodes.len()];
        for &child in document.nodes.iter().flat_map(|node| &node.children) {
            if let Some(root) = roots.get_mut(child) {
                *root = false;
            }
        }
        (0..roots.len()).filter(|&node| roots[node]).collect()
    } else {
        look_up(&document.scenes, document.scene.unwrap_or(0), "scene")?.nodes.clone()
    };
    let placed = vec![false; document.nodes.len()];
    let mut reading = Reading { document: &document, blob, placed, triangles: Vec::new() };
    for node in roots {
        reading.node(node, &Matrix4::identity(), 0)?;
    }
    Ok(reading.triangles)
}

fn bad(problem: impl Into<String>) -> MeshError {
    MeshError::file(format!("not a GLB file that can be read: {}", problem.into()))
}

fn look_up<'a, T>(all: &'a [T], at: usize, what: &str) -> Result<&'a T, MeshError> {
    all.get(at).ok_or_else(|| bad(format!("{what} {at} of {} is named, counted from 0", all.len())))
}

/// The JSON and the binary chunk.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), MeshError> {
    let word = |at: usize| {
        let found = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes([found[0], found[1], found[2], found[3]]) as usize)
    };
    let short = |wanted: usize| bad(format!("it is cut off: {} bytes, {wanted} are needed", bytes.len()));
    if !bytes.starts_with(b"glTF") {
        return Err(bad("it does not begin with `glTF`"));
    }
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(bad(format!("version {version}, 2 is read"))),
        None => return Err(short(12)),
    }
    let whole = word(8).ok_or_else(|| short(12))?;
    if bytes.len() < whole {
        return Err(short(whole));
    }
    let chunk = |at: usize, kind: &[u8]| {
        let length = word(at)?;
        let end = at.checked_add(8)?.checked_add(length)?;
        let found = bytes.get(at + 8..end)?;
        (bytes.get(at + 4..at + 8)? == kind).then_some((found, end))
    };
    let (json, next) = chunk(12, b"JSON").ok_or_else(|| bad("it has no JSON chunk"))?;
    Ok((json, chunk(next, b"BIN\0").map_or(&[][..], |(blob, _)| blob)))
}

struct Reading<'a> {
    document: &'a Document,
    blob: &'a [u8],
    /// Nodes that have a place: a node has one parent.
    placed: Vec<bool>,
    triangles: Vec<Triangle>,
}

impl<'a> Reading<'a> {
    fn node(&mut self, at: usize, above: &Matrix4<f32>, depth: usize) -> Result<(), MeshError> {
        if depth > DEEPEST {
            return Err(bad(format!("its nodes are nested more than {DEEPEST} deep")));
        }
        let document = self.document;
        let node = look_up(&document.nodes, at, "node")?;
        if std::mem::replace(&mut self.placed[at], true) {
            return Err(bad(format!("node {at} has two parents")));
        }
        let here = above * node.transform();
        if let Some(mesh) = node.mesh {
            for primitive in &look_up(&document.meshes, mesh, "mesh")?.primitives {
                self.primitive(primitive, &here)?;
            }
        }
        node.children.iter().try_for_each(|&child| self.node(child, &here, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, here: &Matrix4<f32>) -> Result<(), MeshError> {
        // Without places nothing is drawn.
        let Some(accessor) = primitive.attributes.position else { return Ok(()) };
        let places: Vec<[f32; 3]> = self
            .values(accessor, "VEC3", 3, &PLACE)?
            .map(|bytes| {
                let component = |i: usize| self.document.accessors[accessor].component(bytes, i);
                let moved = here * Point3::new(component(0), component(1), component(2)).to_homogeneous();
                [moved.x, moved.y, moved.z]
            })
            .collect();
        let order: Vec<usize> = match primitive.indices {
            None => (0..places.len()).collect(),
            Some(indices) => {
                let number = |bytes: &[u8]| bytes.iter().rev().fold(0_usize, |n, b| n << 8 | usize::from(*b));
                self.values(indices, "SCALAR", 1, &WHOLE)?.map(number).collect()
            }
        };
        let corners: Vec<[usize; 3]> = match primitive.mode.unwrap_or(4) {
            4 => order.as_chunks::<3>().0.to_vec(),
            // Every other triangle of a strip is turned.
            5 => order
                .windows(3)
                .enumerate()
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
                .collect(),
            6 => order.get(1..).unwrap_or_default().windows(2).map(|w| [order[0], w[0], w[1]]).collect(),
            // Points and lines have no surface.
            _ => Vec::new(),
        };
        let found = self.triangles.len() + corners.len();
        if found > MAX_TRIANGLES {
            return Err(MeshError::too_many(found));
        }
        // What a transform mirrors is wound the other way round (3.7.4).
        let mirrored = here.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for [a, b, c] in corners {
            let (b, c) = if mirrored { (c, b) } else { (b, c) };
            let at = |i: usize| look_up(&places, i, "vertex").copied();
            self.triangles.push([at(a)?, at(b)?, at(c)?]);
        }
        Ok(())
    }

    /// The values of an accessor, each as its bytes; `types` are those that are read, with the size of a component.
    fn values(
        &self,
        at: usize,
        shape: &str,
        components: usize,
        types: &[(u32, usize)],
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, MeshError> {
        let accessor = look_up(&self.document.accessors, at, "accessor")?;
        let size = types
            .iter()
            .find(|(kind, _)| *kind == accessor.component_type)
            .map(|(_, size)| size * components);
        let size =
            size.filter(|_| accessor.shape == shape && accessor.sparse.is_none()).ok_or_else(|| {
                let (found, kind) = (&accessor.shape, accessor.component_type);
                bad(format!("accessor {at} ({found} of type {kind}) is not read, {shape} of {types:?} is"))
            })?;
        let view = accessor.buffer_view.ok_or_else(|| bad(format!("accessor {at} has no data")))?;
        let view = look_up(&self.document.buffer_views, view, "view")?;
        if look_up(&self.document.buffers, view.buffer, "buffer")?.uri.is_some() || view.buffer != 0 {
            return Err(bad("its data lie in another file: export it as one binary file"));
        }
        let (count, stride) = (accessor.count, view.byte_stride.unwrap_or(size).max(size));
        let last = count.checked_sub(1).and_then(|n| n.checked_mul(stride));
        let length = if count == 0 { Some(0) } else { last.and_then(|last| last.checked_add(size)) };
        let end = length.and_then(|length| accessor.byte_offset.checked_add(length));
        let viewed = view
            .byte_offset
            .checked_add(view.byte_length)
            .and_then(|end| self.blob.get(view.byte_offset..end));
        let data = viewed.zip(end).and_then(|(viewed, end)| viewed.get(accessor.byte_offset..end));
        let data = data.ok_or_else(|| {
            bad(format!("accessor {at} has {count} values, which {} bytes do not hold", self.blob.len()))
        })?;
        Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
    }
}

impl Accessor {
    /// A component of one of its values (3.6.2.2).
    fn component(&self, bytes: &[u8], i: usize) -> f32 {
        let pair = |i: usize| [bytes[2 * i], bytes[2 * i + 1]];
        let (value, one) = match self.component_type {
            5120 => (f32::from(bytes[i] as i8), 127.0),
            5121 => (f32::from(bytes[i]), 255.0),
            5122 => (f32::from(i16::from_le_bytes(pair(i))), 32767.0),
            5123 => (f32::from(u16::from_le_bytes(pair(i))), 65535.0),
            _ => (f32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[4 * i + k])), 1.0),
        };
        if self.normalized { (value / one).max(-1.0) } else { value }
    }
}

impl Node {
    /// `parent_from_node`: a matrix by columns, or translation, rotation (x, y, z, w) and scale.
    fn transform(&self) -> Matrix4<f32> {
        if let Some(columns) = self.matrix {
            return Matrix4::from_column_slice(&columns);
        }
        let [x, y, z, w] = self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_homogeneous();
        Matrix4::new_translation(&Vector3::from(self.translation.unwrap_or_default()))
            * rotation
            * Matrix4::new_nonuniform_scaling(&Vector3::from(self.scale.unwrap_or([1.0; 3])))
    }
}
