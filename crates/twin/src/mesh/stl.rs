//! STL, binary and ASCII.
//!
//! A file is binary when its size is 84 + 50 n for the count n at byte 80 (many binary files begin with the
//! word `solid`), ASCII when it begins with `solid`, and otherwise neither.

use super::{MAX_TRIANGLES, MeshError, TriMesh, Triangle};

const HEADER: usize = 84;
const RECORD: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let size = bytes.len();
    let count =
        (bytes.len() >= HEADER).then(|| u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]));
    if let Some(count) = count {
        let expected = HEADER as u64 + RECORD as u64 * u64::from(count);
        if expected == bytes.len() as u64 {
            return read_binary(&bytes[HEADER..], count);
        }
    }
    if bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return read_ascii(bytes);
    }
    let Some(count) = count else {
        let problem = format!("not an STL file: {size} bytes, a binary header alone has 84");
        return Err(MeshError::File(problem));
    };
    let expected = HEADER as u64 + RECORD as u64 * u64::from(count);
    if count as usize > MAX_TRIANGLES {
        return Err(MeshError::too_many(count));
    }
    Err(MeshError::File(if expected > size as u64 {
        format!(
            "the file is cut off: its header promises {count} triangles ({expected} bytes), it has {size} bytes"
        )
    } else {
        format!(
            "not an STL file: {size} bytes are not 84 + 50 x the {count} triangles its header promises, \
             and it does not begin with `solid`"
        )
    }))
}

fn read_binary(records: &[u8], count: u32) -> Result<Vec<Triangle>, MeshError> {
    if count as usize > MAX_TRIANGLES {
        return Err(MeshError::too_many(count));
    }
    let float = |record: &[u8], i: usize| {
        f32::from_le_bytes([record[4 * i], record[4 * i + 1], record[4 * i + 2], record[4 * i + 3]])
    };
    // Floats 0..3 are the facet normal, which the corners already tell.
    Ok(records
        .chunks_exact(RECORD)
        .map(|r| [3, 6, 9].map(|first| [float(r, first), float(r, first + 1), float(r, first + 2)]))
        .collect())
}

fn read_ascii(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let mut triangles = Vec::new();
    let mut corners: Vec<[f32; 3]> = Vec::with_capacity(3);
    let mut line = 0;
    let mut ended = false;
    for raw in bytes.split(|&b| b == b'\n') {
        line += 1;
        let text = String::from_utf8_lossy(raw);
        let mut words = text.split_ascii_whitespace();
        let Some(keyword) = words.next() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "vertex" => {
                if corners.len() == 3 {
                    return Err(MeshError::syntax(line, "a fourth vertex in one facet"));
                }
                corners.push(vertex(words, line)?);
            }
            "endfacet" => {
                let [a, b, c] = corners[..] else {
                    let problem = format!("the facet ends after {} of 3 vertices", corners.len());
                    return Err(MeshError::syntax(line, &problem));
                };
                if triangles.len() == MAX_TRIANGLES {
                    return Err(MeshError::too_many(MAX_TRIANGLES + 1));
                }
                triangles.push([a, b, c]);
                corners.clear();
            }
            "endsolid" => ended = true,
            "solid" | "facet" | "outer" | "endloop" => {}
            other => return Err(MeshError::syntax(line, &format!("unknown keyword `{other}`"))),
        }
    }
    if !ended || !corners.is_empty() {
        return Err(MeshError::syntax(line, "the file ends before `endsolid`"));
    }
    Ok(triangles)
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>, line: usize) -> Result<[f32; 3], MeshError> {
    let mut coordinates = [0.0; 3];
    for (i, c) in coordinates.iter_mut().enumerate() {
        let missing = || MeshError::syntax(line, &format!("a vertex has 3 coordinates, found {i}"));
        let word = words.next().ok_or_else(missing)?;
        *c = word.parse().map_err(|_| MeshError::syntax(line, &format!("`{word}` is not a number")))?;
    }
    Ok(coordinates)
}

/// The bytes of a binary STL file of `mesh`, in units of `metres_per_unit`.
///
/// `title` (at most 80 bytes are kept) goes into the header and must not begin with `solid`.
pub fn write_binary_stl(mesh: &TriMesh, title: &str, metres_per_unit: f64) -> Vec<u8> {
    let mut bytes = vec![0u8; 80];
    let title = &title.as_bytes()[..title.len().min(80)];
    bytes[..title.len()].copy_from_slice(title);
    bytes.extend((mesh.triangles().len() as u32).to_le_bytes());
    for t in 0..mesh.triangles().len() {
        let corners = mesh.corners(t);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let length = normal.norm();
        let normal = if length > 0.0 { normal / length } else { normal };
        for value in normal.iter() {
            bytes.extend((*value as f32).to_le_bytes());
        }
        for corner in corners {
            for value in corner.iter() {
                bytes.extend(((value / metres_per_unit) as f32).to_le_bytes());
            }
        }
        bytes.extend([0, 0]);
    }
    bytes
}
