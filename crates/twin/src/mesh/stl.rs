//! STL, binary and ASCII.
//!
//! A file is binary when it holds the triangles that its header promises: many binary files begin with the word `solid`, and the count
//! in an ASCII file, four letters, is larger than any file. It is ASCII when it is text. Bytes behind the last triangle are passed over,
//! as other readers do, unless they are triangles.

use super::text::{coordinates, is_text, lines, quoted, words};
use super::{MAX_TRIANGLES, MeshError, TriMesh, Triangle};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Whether a file is exactly the triangles that its header promises.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    promised(bytes).is_some_and(|(count, size)| count > 0 && size == bytes.len() as u64)
}

/// Triangles that the header promises, and the size of the file with them.
fn promised(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = u32::from_le_bytes(*bytes.get(80..HEADER)?.first_chunk()?);
    Some((count, HEADER as u64 + RECORD as u64 * u64::from(count)))
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let size = bytes.len() as u64;
    let Some((count, expected)) = promised(bytes).filter(|_| !is_text(bytes)) else {
        return if is_text(bytes) {
            read_ascii(bytes)
        } else {
            Err(MeshError::file(format!("not an STL file: {size} bytes, a binary header alone has {HEADER}")))
        };
    };
    if expected > size {
        let swapped = u64::from(count.swap_bytes());
        if HEADER as u64 + RECORD as u64 * swapped == size {
            let problem =
                format!("an STL file with its bytes in reverse order (big-endian): {swapped} triangles");
            return Err(MeshError::file(problem));
        }
        let room = (size - HEADER as u64) / RECORD as u64;
        return Err(MeshError::file(format!(
            "the file is cut off, or no STL file: its header promises {count} triangles ({expected} bytes), it has room for {room} \
             ({size} bytes)"
        ))
        .with_hint("copy or download it again, or export the part again"));
    }
    if count as usize > MAX_TRIANGLES {
        return Err(MeshError::too_many(count));
    }
    let (records, rest) = bytes[HEADER..].split_at(RECORD * count as usize);
    let more = rest.len() / RECORD;
    if more > 0 && rest.len() % RECORD == 0 && rest.iter().any(|&b| b != 0) {
        let room = count as usize + more;
        return Err(MeshError::file(format!("the header promises {count} triangles, the file has {room}")));
    }
    if is_binary(rest) {
        return Err(MeshError::file(format!(
            "a second STL file begins behind the {count} triangles of the first"
        ))
        .with_hint("write the bodies into one STL file, or name one of them"));
    }
    Ok(read_binary(records))
}

fn read_binary(records: &[u8]) -> Vec<Triangle> {
    let float = |record: &[u8; RECORD], i: usize| {
        f32::from_le_bytes([record[4 * i], record[4 * i + 1], record[4 * i + 2], record[4 * i + 3]])
    };
    // Floats 0..3 are the facet normal, which the corners already tell.
    let triangle =
        |r: &[u8; RECORD]| [3, 6, 9].map(|first| [float(r, first), float(r, first + 1), float(r, first + 2)]);
    records.as_chunks::<RECORD>().0.iter().map(triangle).collect()
}

/// Reads the grammar word by word; lines only end names and comments, which begin with `;` or `#`.
fn read_ascii(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let spoken =
        lines(bytes).filter(|(_, line)| !matches!(line.trim_ascii_start().first(), Some(b';' | b'#')));
    let mut text =
        Ascii { words: spoken.flat_map(|(line, text)| words(text).map(move |word| (line, word))), line: 1 };
    let mut triangles = Vec::new();
    text.expect(&["solid"])?;
    loop {
        text.skip_name();
        while text.expect(&["facet", "endsolid"])? == 0 {
            if triangles.len() == MAX_TRIANGLES {
                return Err(MeshError::too_many(format!("more than {MAX_TRIANGLES}")));
            }
            triangles.push(text.facet()?);
        }
        text.skip_name();
        if text.words.clone().next().is_none() {
            return Ok(triangles);
        }
        text.expect(&["solid"])?;
    }
}

/// Words that are left, and the line of the last one.
struct Ascii<I> {
    words: I,
    line: usize,
}

impl<'a, I: Iterator<Item = (usize, &'a [u8])> + Clone> Ascii<I> {
    /// The next word, which must be one of `wanted`: which one.
    fn expect(&mut self, wanted: &[&str]) -> Result<usize, MeshError> {
        let all = wanted.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(" or ");
        let Some((line, word)) = self.words.next() else {
            return Err(MeshError::syntax(
                self.line,
                format!("the file ends where {all} is expected: it is cut off"),
            ));
        };
        self.line = line;
        wanted.iter().position(|w| word.eq_ignore_ascii_case(w.as_bytes())).ok_or_else(|| {
            MeshError::syntax(line, format!("{} stands where {all} is expected", quoted(word)))
        })
    }

    /// Passes over a name: the rest of the line, or what stands before the first facet in it.
    fn skip_name(&mut self) {
        let is = |found: Option<(usize, &[u8])>, wanted: &[&str]| {
            found.is_some_and(|(_, word)| wanted.iter().any(|w| word.eq_ignore_ascii_case(w.as_bytes())))
        };
        loop {
            let mut ahead = self.words.clone();
            let next = ahead.next();
            let facet = is(next, &["facet"]) && is(ahead.next(), &["normal", "outer"]);
            if next.is_none_or(|(line, _)| line != self.line) || facet || is(next, &["endsolid"]) {
                return;
            }
            self.words.next();
        }
    }

    /// The corners of a facet, behind the word `facet`.
    fn facet(&mut self) -> Result<Triangle, MeshError> {
        if self.expect(&["normal", "outer"])? == 0 {
            // The corners tell the normal; some programs write `nan`, and some nothing.
            for _ in 0..3 {
                if self.words.clone().next().is_some_and(|(_, word)| !word.eq_ignore_ascii_case(b"outer")) {
                    self.words.next();
                }
            }
            self.expect(&["outer"])?;
        }
        self.expect(&["loop"])?;
        let mut corners = [[0.0; 3]; 3];
        for corner in &mut corners {
            self.expect(&["vertex"])?;
            let line = self.line;
            *corner = coordinates(self.words.by_ref().take(3).map(|(_, word)| word), line)?;
        }
        self.expect(&["endloop"])?;
        self.expect(&["endfacet"])?;
        Ok(corners)
    }
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
