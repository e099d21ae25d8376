//! PLY (Stanford), text and binary of both byte orders. Places and faces are read, everything else is passed over.

use super::polygon;
use super::text::{lines, quoted, words};
use super::{MAX_TRIANGLES, MeshError, Triangle};

/// Names of the list of a face's corners; both are in use.
const CORNERS: [&[u8]; 2] = [b"vertex_indices", b"vertex_index"];

#[derive(Debug, Clone, Copy)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

struct Property<'a> {
    name: &'a [u8],
    /// Type of the length, of a list.
    length: Option<Type>,
    value: Type,
}

struct Element<'a> {
    name: &'a [u8],
    count: usize,
    properties: Vec<Property<'a>>,
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Text,
    Little,
    Big,
}

struct Header<'a> {
    format: Format,
    elements: Vec<Element<'a>>,
    /// Lines of the header, and where the data begin.
    lines: usize,
    end: usize,
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let header = Header::of(bytes)?;
    let data = &bytes[header.end..];
    let mut vertices: Vec<[f32; 3]> = Vec::new();
    let (mut corners, mut ends): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
    let text = lines(data).map(|(line, text)| (header.lines + line, text));
    let mut rows = Rows { format: header.format, data, lines: text, words: Vec::new(), line: header.lines };
    for element in &header.elements {
        let axes = element.axes()?;
        for row in 0..element.count {
            let mut place = [0.0; 3];
            rows.begin(element, row)?;
            for (number, property) in element.properties.iter().enumerate() {
                let mut values = 1;
                if let Some(length) = property.length {
                    let read = rows.value(length, element, row)?;
                    values = whole(read)
                        .ok_or_else(|| bad(format!("{} has a list of {read} values", element.row(row))))?;
                }
                for _ in 0..values {
                    let value = rows.value(property.value, element, row)?;
                    if property.is_corners(element) {
                        corners.push(value);
                    } else if let Some(axis) = axes.iter().position(|axis| *axis == Some(number)) {
                        place[axis] = value as f32;
                    }
                }
            }
            rows.end(element, row)?;
            match element.name {
                b"vertex" => vertices.push(place),
                b"face" => ends.push(corners.len()),
                _ => {}
            }
        }
    }
    if ends.is_empty() {
        return Err(bad(format!("it has {} vertices and no face: points have no surface", vertices.len())));
    }
    faces(&vertices, &corners, &ends)
}

/// Cuts the faces into triangles; `ends` are those of their corners.
fn faces(vertices: &[[f32; 3]], corners: &[f64], ends: &[usize]) -> Result<Vec<Triangle>, MeshError> {
    let (mut triangles, mut start) = (Vec::with_capacity(ends.len()), 0);
    for (face, &end) in ends.iter().enumerate() {
        let at = |&i: &f64| {
            whole(i).and_then(|i| vertices.get(i)).copied().ok_or_else(|| {
                bad(format!("face {face} (from 0) has vertex {i} of {}, counted from 0", vertices.len()))
            })
        };
        let outline = corners[start..end].iter().map(at).collect::<Result<Vec<_>, _>>()?;
        start = end;
        let cut = polygon::triangles(&outline)
            .map_err(|problem| MeshError::outline(format!("face {face} (from 0): {problem}")))?;
        triangles.extend(cut.into_iter().map(|t| t.map(|i| outline[i])));
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::too_many(triangles.len()));
        }
    }
    Ok(triangles)
}

fn bad(problem: impl std::fmt::Display) -> MeshError {
    MeshError::file(format!("not a PLY file that can be read: {problem}"))
}

/// A number of things, or one of them.
fn whole(value: f64) -> Option<usize> {
    (value >= 0.0 && value.fract() == 0.0 && value < 2f64.powi(53)).then_some(value as usize)
}

impl<'a> Header<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, MeshError> {
        // Lines of an old Macintosh end with a carriage return alone. What follows the last one may be binary.
        let old = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
        let ends = if old { b'\r' } else { b'\n' };
        let (mut format, mut elements, mut at) = (None, Vec::<Element<'_>>::new(), 0);
        for (number, text) in bytes.split(|&b| b == ends).enumerate() {
            let line = number + 1;
            at += text.len() + 1;
            let read: Vec<&[u8]> = words(text).take(6).collect();
            match read[..] {
                [] | [b"ply"] | [b"comment" | b"obj_info", ..] => {}
                [b"format", b"ascii", _] => format = Some(Format::Text),
                [b"format", b"binary_little_endian", _] => format = Some(Format::Little),
                [b"format", b"binary_big_endian", _] => format = Some(Format::Big),
                [b"element", name, count] => {
                    let read = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok());
                    let count = read.ok_or_else(|| {
                        MeshError::syntax(line, format!("{} is not a number of elements", quoted(count)))
                    })?;
                    // A row has a byte at least: a file that promises more than it can have is cut off, or hostile.
                    if count > bytes.len() {
                        let (name, size) = (quoted(name), bytes.len());
                        return Err(bad(format!("it promises {count} of {name}, and has {size} bytes")));
                    }
                    if name == b"tristrips" && count > 0 {
                        return Err(bad("it holds strips of triangles (`tristrips`), which are not read")
                            .with_hint("export it with faces"));
                    }
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                [b"property", ref property @ ..] => {
                    let (length, value, name) = match *property {
                        [b"list", length, value, name] => (Some(Type::of(length, line)?), value, name),
                        [value, name] => (None, value, name),
                        _ => return Err(MeshError::syntax(line, "a property has a type and a name")),
                    };
                    let element = elements.last_mut().ok_or_else(|| {
                        MeshError::syntax(line, "a property stands before the first element")
                    })?;
                    element.properties.push(Property { name, length, value: Type::of(value, line)? });
                }
                [b"end_header", ..] => {
                    let format = format.ok_or_else(|| bad("its header has no line `format`"))?;
                    return Ok(Self { format, elements, lines: line, end: at.min(bytes.len()) });
                }
                [word, ..] => {
                    return Err(MeshError::syntax(line, format!("{} stands in the header", quoted(word))));
                }
            }
        }
        Err(bad("its header has no line `end_header`"))
    }
}

impl Type {
    fn of(name: &[u8], line: usize) -> Result<Self, MeshError> {
        Ok(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return Err(MeshError::syntax(line, format!("{} is not a type of PLY", quoted(name)))),
        })
    }
}

impl Property<'_> {
    /// Whether it lists the corners of a face.
    fn is_corners(&self, element: &Element<'_>) -> bool {
        element.name == b"face" && self.length.is_some() && CORNERS.contains(&self.name)
    }
}

impl Element<'_> {
    /// Which properties of a vertex are its place; none of another element.
    fn axes(&self) -> Result<[Option<usize>; 3], MeshError> {
        if self.name == b"face" && !self.properties.iter().any(|p| p.is_corners(self)) {
            return Err(bad("`face` has no list `vertex_indices`"));
        }
        let mut axes = [None; 3];
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]).filter(|_| self.name == b"vertex") {
            let found = self.properties.iter().position(|p| p.length.is_none() && p.name == name.as_bytes());
            *axis = Some(found.ok_or_else(|| bad(format!("`vertex` has no property `{name}`")))?);
        }
        Ok(axes)
    }

    /// A row for a message.
    fn row(&self, row: usize) -> String {
        format!("row {row} (from 0) of {} of {}", self.count, quoted(self.name))
    }
}

/// The data behind the header. A row of a text is a line.
struct Rows<'a, I> {
    format: Format,
    data: &'a [u8],
    lines: I,
    /// Words of the row that are left, last first.
    words: Vec<&'a [u8]>,
    line: usize,
}

impl<'a, I: Iterator<Item = (usize, &'a [u8])>> Rows<'a, I> {
    fn begin(&mut self, element: &Element<'_>, row: usize) -> Result<(), MeshError> {
        if matches!(self.format, Format::Text) {
            let mut filled = self.lines.by_ref().filter(|(_, text)| words(text).next().is_some());
            let (line, text) = filled.next().ok_or_else(|| Self::cut_off(element, row))?;
            self.line = line;
            self.words.extend(words(text));
            self.words.reverse();
        }
        Ok(())
    }

    fn value(&mut self, kind: Type, element: &Element<'_>, row: usize) -> Result<f64, MeshError> {
        match self.format {
            Format::Text => {
                let short = || MeshError::syntax(self.line, format!("{} ends too soon", element.row(row)));
                let word = self.words.pop().ok_or_else(short)?;
                let text = std::str::from_utf8(word).unwrap_or_default();
                let read = match kind {
                    Type::F32 => text.parse::<f32>().map(f64::from).ok(),
                    _ => text.parse().ok(),
                };
                read.ok_or_else(|| MeshError::syntax(self.line, format!("{} is not a number", quoted(word))))
            }
            Format::Little => self.binary(kind, false).ok_or_else(|| Self::cut_off(element, row)),
            Format::Big => self.binary(kind, true).ok_or_else(|| Self::cut_off(element, row)),
        }
    }

    fn end(&mut self, element: &Element<'_>, row: usize) -> Result<(), MeshError> {
        match self.words.pop() {
            None => Ok(()),
            Some(word) => {
                let problem = format!("{} is left over at the end of {}", quoted(word), element.row(row));
                Err(MeshError::syntax(self.line, problem))
            }
        }
    }

    fn binary(&mut self, kind: Type, reversed: bool) -> Option<f64> {
        Some(match kind {
            Type::I8 => i8::from_le_bytes(self.take(reversed)?).into(),
            Type::U8 => u8::from_le_bytes(self.take(reversed)?).into(),
            Type::I16 => i16::from_le_bytes(self.take(reversed)?).into(),
            Type::U16 => u16::from_le_bytes(self.take(reversed)?).into(),
            Type::I32 => i32::from_le_bytes(self.take(reversed)?).into(),
            Type::U32 => u32::from_le_bytes(self.take(reversed)?).into(),
            Type::F32 => f32::from_le_bytes(self.take(reversed)?).into(),
            Type::F64 => f64::from_le_bytes(self.take(reversed)?),
        })
    }

    fn take<const N: usize>(&mut self, reversed: bool) -> Option<[u8; N]> {
        let (&(mut found), rest) = self.data.split_first_chunk()?;
        self.data = rest;
        if reversed {
            found.reverse();
        }
        Some(found)
    }

    fn cut_off(element: &Element<'_>, row: usize) -> MeshError {
        bad(format!("it is cut off in {}", element.row(row)))
    }
}
