//! Wavefront OBJ, through `tobj`. Materials and texture coordinates are ignored.

use super::{MAX_TRIANGLES, MeshError, Triangle};
use std::io::{BufRead, Cursor};

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    check_faces(bytes)?;
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Ok(Default::default()))
        .map_err(|e| MeshError::syntax(0, &e.to_string()))?;
    let mut triangles = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let found = triangles.len() + mesh.indices.len() / 3;
        if found > MAX_TRIANGLES {
            return Err(MeshError::too_many(found));
        }
        for corners in mesh.indices.chunks_exact(3) {
            let corner = |i: usize| {
                let at = 3 * corners[i] as usize;
                [mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]]
            };
            triangles.push([corner(0), corner(1), corner(2)]);
        }
    }
    Ok(triangles)
}

/// Checks what the parser reports without a line: numbers that are none, and indices out of range.
fn check_faces(bytes: &[u8]) -> Result<(), MeshError> {
    let mut vertices: i64 = 0;
    for (number, text) in Cursor::new(bytes).lines().enumerate() {
        let line = number + 1;
        let syntax = |problem: String| MeshError::syntax(line, &problem);
        let text = text.map_err(|_| syntax("not text (invalid UTF-8)".into()))?;
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                vertices += 1;
                let coordinates: Vec<&str> = words.take(3).collect();
                if coordinates.len() < 3 {
                    return Err(syntax(format!("a vertex has 3 coordinates, found {}", coordinates.len())));
                }
                for word in coordinates {
                    word.parse::<f32>().map_err(|_| syntax(format!("`{word}` is not a number")))?;
                }
            }
            Some("f") => {
                for word in words {
                    let index = word.split('/').next().unwrap_or_default();
                    let i: i64 =
                        index.parse().map_err(|_| syntax(format!("`{index}` is not a vertex number")))?;
                    if i == 0 || i > vertices || i < -vertices {
                        return Err(syntax(format!("vertex {i} of {vertices} read so far does not exist")));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}
