//! Wavefront OBJ. Vertices and faces are read; lines, points, curves and materials have no surface and are passed over.

use super::polygon;
use super::text::{coordinates, lines, quoted, words};
use super::{MAX_TRIANGLES, MeshError, Triangle};

/// A face whose numbers are looked up at the end: a file may name vertices that follow.
struct Face {
    line: usize,
    /// End of its corners in the list of all.
    end: usize,
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let mut vertices: Vec<[f32; 3]> = Vec::new();
    let (mut corners, mut faces): (Vec<usize>, Vec<Face>) = (Vec::new(), Vec::new());
    // Words of a line that goes on behind a `\`.
    let mut open: Vec<&[u8]> = Vec::new();
    let mut last = 0;
    for (line, text) in lines(bytes) {
        last = line;
        let text = text.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii_end();
        let (text, goes_on) = text.strip_suffix(b"\\").map_or((text, false), |text| (text, true));
        open.extend(words(text));
        // Other lines may end with the `\` of a path, and hold nothing that is needed.
        if goes_on && matches!(open.first(), Some(&(b"v" | b"f" | b"fo"))) {
            continue;
        }
        let mut words = open.drain(..);
        match words.next() {
            // A fourth number weighs free-form curves, and three more are a colour: neither moves the vertex.
            Some(b"v") => vertices.push(coordinates(words, line)?),
            Some(b"f" | b"fo") => {
                for word in words {
                    corners.push(vertex_number(word, vertices.len(), line)?);
                }
                faces.push(Face { line, end: corners.len() });
            }
            Some(b"surf") => {
                let problem = "a free-form surface (`surf`) is not read, only faces are";
                return Err(
                    MeshError::syntax(line, problem).with_hint("export the part with faces, as a mesh")
                );
            }
            _ => {}
        }
    }
    if !open.is_empty() {
        return Err(MeshError::syntax(last, "the file ends where a line goes on: it is cut off"));
    }
    if faces.is_empty() {
        let there = vertices.len();
        return Err(MeshError::file(format!("the file has {there} vertices (`v`) and no face (`f`)")));
    }
    let (mut triangles, mut start) = (Vec::new(), 0);
    for Face { line, end } in faces {
        let at = |&v: &usize| {
            let there = vertices.len();
            let missing = || MeshError::syntax(line, format!("vertex {} of {there} does not exist", v + 1));
            vertices.get(v).copied().ok_or_else(missing)
        };
        let outline = corners[start..end].iter().map(at).collect::<Result<Vec<_>, _>>()?;
        start = end;
        let cut = polygon::triangles(&outline)
            .map_err(|problem| MeshError::outline(format!("line {line}: {problem}")))?;
        triangles.extend(cut.into_iter().map(|t| t.map(|i| outline[i])));
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::too_many(triangles.len()));
        }
    }
    Ok(triangles)
}

/// The vertex of a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, from 0. Negative numbers count back from the last of the `known` vertices.
fn vertex_number(word: &[u8], known: usize, line: usize) -> Result<usize, MeshError> {
    let first = word.split(|&b| b == b'/').next().unwrap_or_default();
    let number = std::str::from_utf8(first).ok().and_then(|first| first.parse::<i64>().ok());
    let number =
        number.ok_or_else(|| MeshError::syntax(line, format!("{} is not a vertex number", quoted(first))))?;
    let from_zero = if number < 0 { number.checked_add(known as i64) } else { number.checked_sub(1) };
    from_zero.and_then(|v| usize::try_from(v).ok()).ok_or_else(|| {
        MeshError::syntax(line, format!("vertex {number} of {known} read so far does not exist"))
    })
}
