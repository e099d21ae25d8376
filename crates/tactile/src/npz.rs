//! Reading and writing numpy's `.npz` archives of plain numeric arrays.
//!
//! Our own reader, because the crates at hand parse the header with a grammar engine that needs a C compiler to
//! build. Python pickles (object arrays) are refused: nothing is ever executed.

use std::io::{Cursor, Read, Write};
use zip::write::SimpleFileOptions;

/// Largest array that is read, in bytes: a guard against archives that claim to be huge.
const MAX_BYTES: u64 = 1 << 30;

/// A numeric array in C order, its values as f64.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of each axis; empty for a scalar.
    pub shape: Vec<usize>,
    /// The values, last axis fastest.
    pub values: Vec<f64>,
}

/// Why an npz file could not be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NpzError {
    /// Not a zip archive, or a broken one.
    #[error("not an npz archive: {0}")]
    Archive(String),
    /// The archive has no such array.
    #[error("the archive has no array `{key}`; it has: {present}")]
    MissingKey {
        /// Name looked for.
        key: String,
        /// Names found.
        present: String,
    },
    /// An array is not what numpy writes.
    #[error("array `{key}`: {problem}")]
    Array {
        /// Name of the array.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
}

/// An opened npz archive.
pub struct Npz<'a> {
    archive: zip::ZipArchive<Cursor<&'a [u8]>>,
}

impl<'a> Npz<'a> {
    /// Opens the bytes of an npz file.
    ///
    /// # Errors
    ///
    /// Bytes that are no zip archive.
    pub fn open(bytes: &'a [u8]) -> Result<Self, NpzError> {
        let archive =
            zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| NpzError::Archive(e.to_string()))?;
        Ok(Self { archive })
    }

    /// Names of the arrays.
    pub fn keys(&self) -> Vec<String> {
        let mut keys: Vec<String> = self
            .archive
            .file_names()
            .filter_map(|name| Some(name.ok()?.strip_suffix(".npy")?.to_string()))
            .collect();
        keys.sort();
        keys
    }

    /// Whether the archive has an array of this name.
    pub fn has(&self, key: &str) -> bool {
        self.archive.index_for_name(&format!("{key}.npy")).is_some()
    }

    /// Reads an array; numbers of any type become f64.
    ///
    /// # Errors
    ///
    /// No array of this key, or one that cannot be read as numbers.
    pub fn array(&mut self, key: &str) -> Result<Array, NpzError> {
        let bytes = self.file(key)?;
        parse_npy(&bytes).map_err(|problem| NpzError::Array { key: key.into(), problem })
    }

    /// Reads an array of bytes (`|u1`) in C order as it stands: shape and values. Eight times smaller than f64.
    ///
    /// # Errors
    ///
    /// No array of this key, or one that is not of bytes.
    pub fn bytes(&mut self, key: &str) -> Result<(Vec<usize>, Vec<u8>), NpzError> {
        let mut file = self.file(key)?;
        let bad = |problem: String| NpzError::Array { key: key.into(), problem };
        let header = parse_header(&file).map_err(bad)?;
        if !matches!(header.descr.as_str(), "|u1" | "<u1" | "=u1") || header.fortran {
            let problem = format!("its elements are `{}`, they must be `|u1` in C order", header.descr);
            return Err(bad(problem));
        }
        let found = file.len() - header.data_start;
        if header.count != found {
            return Err(bad(format!(
                "its shape {:?} needs {} bytes, it has {found}",
                header.shape, header.count
            )));
        }
        file.drain(..header.data_start);
        Ok((header.shape, file))
    }

    /// The unpacked bytes of an array's file.
    fn file(&mut self, key: &str) -> Result<Vec<u8>, NpzError> {
        if !self.has(key) {
            return Err(NpzError::MissingKey { key: key.into(), present: self.keys().join(", ") });
        }
        let bad = |problem: String| NpzError::Array { key: key.into(), problem };
        let mut file = self.archive.by_name(&format!("{key}.npy")).map_err(|e| bad(e.to_string()))?;
        if file.size() > MAX_BYTES {
            return Err(bad(format!("{} bytes, at most {MAX_BYTES} are read", file.size())));
        }
        // The directory's word for the size is not trusted.
        let mut bytes = Vec::new();
        file.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| bad(e.to_string()))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(bad(format!("more than {MAX_BYTES} bytes, which is all that is read")));
        }
        Ok(bytes)
    }

    /// Reads an array that must have the given shape; `None` stands for any length.
    ///
    /// # Errors
    ///
    /// As [`Self::array`], or an array of another shape.
    pub fn array_of_shape(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Array, NpzError> {
        let array = self.array(key)?;
        let fits = array.shape.len() == shape.len()
            && array.shape.iter().zip(shape).all(|(&found, wanted)| wanted.is_none_or(|w| w == found));
        if fits {
            return Ok(array);
        }
        let wanted: Vec<String> =
            shape.iter().map(|n| n.map_or("any".into(), |n: usize| n.to_string())).collect();
        let problem = format!("its shape is {:?}, it must be ({})", array.shape, wanted.join(", "));
        Err(NpzError::Array { key: key.into(), problem })
    }

    /// The same of an array that may be missing.
    ///
    /// # Errors
    ///
    /// An array of another shape, or one that cannot be read as numbers.
    pub fn optional(&mut self, key: &str, shape: &[Option<usize>]) -> Result<Option<Array>, NpzError> {
        if self.has(key) { self.array_of_shape(key, shape).map(Some) } else { Ok(None) }
    }
}

/// What stands before the values of a `.npy` file.
struct Header {
    descr: String,
    fortran: bool,
    shape: Vec<usize>,
    /// Product of the shape.
    count: usize,
    data_start: usize,
}

/// Parses the header of a `.npy` file (format 1.0 to 3.0, numpy/lib/format.py).
fn parse_header(bytes: &[u8]) -> Result<Header, String> {
    if bytes.len() < 10 || &bytes[..6] != b"\x93NUMPY" {
        return Err("not in numpy's npy format".into());
    }
    let (header_start, header_len) = match bytes[6] {
        1 => (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]]))),
        2 | 3 if bytes.len() >= 12 => {
            (12, u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize)
        }
        version => return Err(format!("npy version {version} is not known")),
    };
    let data_start = header_start + header_len;
    let header = bytes.get(header_start..data_start).ok_or("the header is cut off")?;
    let header = String::from_utf8_lossy(header);
    let descr = quoted_value(&header, "descr").ok_or("the header has no plain `descr`")?.to_string();
    let fortran = header.contains("'fortran_order': True");
    let shape = shape_value(&header).ok_or("the header has no `shape`")?;
    let count = shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).ok_or("the shape overflows")?;
    Ok(Header { descr, fortran, shape, count, data_start })
}

/// Parses the bytes of a `.npy` file.
///
/// # Errors
///
/// What is wrong with them, in words: another format, Python objects, a size that is not the shape's.
pub fn parse_npy(bytes: &[u8]) -> Result<Array, String> {
    let Header { descr, fortran, shape, count, data_start } = parse_header(bytes)?;
    let (swap, kind) = match descr.strip_prefix('>') {
        Some(kind) => (true, kind),
        None => match descr.strip_prefix(['<', '=', '|']) {
            Some(kind) => (false, kind),
            None => return Err(format!("element type `{descr}` is not known")),
        },
    };
    let size = kind.get(1..).and_then(|n| n.parse::<usize>().ok()).unwrap_or(0);
    let data = &bytes[data_start..];
    let convert: fn(&[u8]) -> f64 = match kind {
        "b1" | "u1" => |b| f64::from(b[0]),
        "i1" => |b| f64::from(b[0] as i8),
        "u2" => |b| f64::from(u16::from_le_bytes([b[0], b[1]])),
        "i2" => |b| f64::from(i16::from_le_bytes([b[0], b[1]])),
        "u4" => |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        "i4" => |b| f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        "u8" => |b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]) as f64,
        "i8" => |b| i64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]) as f64,
        "f2" => |b| half(u16::from_le_bytes([b[0], b[1]])),
        "f4" => |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        "f8" => |b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]),
        "O" => return Err("it holds Python objects (a pickle), which are never loaded".into()),
        _ => return Err(format!("element type `{descr}` is not a plain number")),
    };
    if count.checked_mul(size) != Some(data.len()) {
        return Err(format!("its shape {shape:?} needs {count} x {size} bytes, it has {}", data.len()));
    }
    let mut element = [0u8; 8];
    let mut values: Vec<f64> = data
        .chunks_exact(size.max(1))
        .map(|chunk| {
            element[..size].copy_from_slice(chunk);
            if swap {
                element[..size].reverse();
            }
            convert(&element[..size])
        })
        .collect();
    if fortran && shape.len() > 1 {
        values = c_order(&values, &shape);
    }
    Ok(Array { shape, values })
}

/// A number of 16 bits (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    sign * match exponent {
        0 => libm::ldexp(fraction, -14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        e => libm::ldexp(1.0 + fraction, e - 15),
    }
}

/// Reorders values stored first axis fastest into last axis fastest.
fn c_order(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut index = vec![0usize; shape.len()];
    (0..values.len())
        .map(|_| {
            let at = index.iter().zip(shape).rev().fold(0, |at, (&i, &n)| at * n + i);
            for axis in (0..shape.len()).rev() {
                index[axis] += 1;
                if index[axis] < shape[axis] {
                    break;
                }
                index[axis] = 0;
            }
            values[at]
        })
        .collect()
}

fn quoted_value<'h>(header: &'h str, key: &str) -> Option<&'h str> {
    let after = header.split_once(&format!("'{key}'"))?.1.split_once(':')?.1.trim_start();
    after.strip_prefix('\'')?.split('\'').next()
}

fn shape_value(header: &str) -> Option<Vec<usize>> {
    let inside = header.split_once("'shape'")?.1.split_once('(')?.1.split_once(')')?.0;
    inside.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect()
}

/// Element type of a written array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementType {
    /// `|u1`; values are rounded.
    U8,
    /// `<f4`; values are rounded.
    F32,
    /// `<f8`
    F64,
}

/// Writes arrays into the bytes of a compressed npz file. The same arrays give the same bytes.
///
/// # Errors
///
/// An array that does not fit its shape or its type.
pub fn write_npz(arrays: &[(&str, Array, ElementType)]) -> Result<Vec<u8>, NpzError> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let failed = |e: String| NpzError::Archive(e);
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    for (key, array, element) in arrays {
        writer.start_file(format!("{key}.npy"), options).map_err(|e| failed(e.to_string()))?;
        writer.write_all(&write_npy(array, *element)).map_err(|e| failed(e.to_string()))?;
    }
    Ok(writer.finish().map_err(|e| failed(e.to_string()))?.into_inner())
}

/// What stands before the values of a `.npy` file, format 1.0.
fn npy_header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let axes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}", axes.trim_end());
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes
}

/// Writes an array into the bytes of an npy file. Its values have to fill its shape.
pub fn write_npy(array: &Array, element: ElementType) -> Vec<u8> {
    let descr = match element {
        ElementType::U8 => "|u1",
        ElementType::F32 => "<f4",
        ElementType::F64 => "<f8",
    };
    let mut bytes = npy_header(descr, &array.shape);
    for &value in &array.values {
        match element {
            ElementType::U8 => bytes.push(value.round().clamp(0.0, 255.0) as u8),
            ElementType::F32 => bytes.extend((value as f32).to_le_bytes()),
            ElementType::F64 => bytes.extend(value.to_le_bytes()),
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of numpy's float16.
    #[test]
    fn sixteen_bits_are_numpys() {
        for (bits, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x3555, 0.333_251_953_125), (0x7bff, 65504.0)] {
            assert_eq!(half(bits), value);
        }
        assert_eq!(half(0x0001), 5.960_464_477_539_063e-8);
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }

    #[test]
    fn what_is_written_is_read_back() {
        let a = Array { shape: vec![2, 3], values: vec![0.0, 1.5, -2.0, 3.0, f64::MAX, 5.0] };
        let b = Array { shape: vec![], values: vec![0.0295] };
        let c = Array { shape: vec![3], values: vec![0.0, 128.0, 255.0] };
        let d = Array { shape: vec![2], values: vec![0.1f32.into(), -7.25] };
        let arrays = [
            ("a", a.clone(), ElementType::F64),
            ("b", b.clone(), ElementType::F64),
            ("c", c.clone(), ElementType::U8),
            ("d", d.clone(), ElementType::F32),
        ];
        let bytes = write_npz(&arrays).unwrap();
        assert_eq!(bytes, write_npz(&arrays).unwrap(), "no clock in the bytes");
        let mut npz = Npz::open(&bytes).unwrap();
        assert_eq!(npz.keys(), ["a", "b", "c", "d"]);
        assert_eq!(npz.array("d").unwrap(), d);
        assert_eq!((npz.array("a").unwrap(), npz.array("b").unwrap(), npz.array("c").unwrap()), (a, b, c));
        let error = npz.array("e").unwrap_err().to_string();
        assert_eq!(error, "the archive has no array `e`; it has: a, b, c, d");
        let shape = npz.array_of_shape("a", &[None, Some(4)]).unwrap_err().to_string();
        assert_eq!(shape, "array `a`: its shape is [2, 3], it must be (any, 4)");
    }

    #[test]
    fn fortran_order_and_byte_order_are_undone() {
        let header = "{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3), }\n";
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        for x in [1i16, 4, 2, 5, 3, 6] {
            bytes.extend(x.to_be_bytes());
        }
        assert_eq!(parse_npy(&bytes).unwrap().values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn broken_archives_are_errors() {
        assert!(Npz::open(b"no zip").is_err());
        for (bytes, part) in [
            (&b"\x93NUMPX\x01\x00\x00\x00"[..], "npy format"),
            (b"\x93NUMPY\x09\x00\x00\x00", "version 9"),
            (
                b"\x93NUMPY\x01\x00\x3a\x00{'descr': '\xc3\xa4f8', 'fortran_order': False, 'shape': (1,), }\n",
                "not known",
            ),
            (b"\x93NUMPY\x01\x00\xff\x00{}", "cut off"),
            (
                b"\x93NUMPY\x01\x00\x39\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,), } \n",
                "pickle",
            ),
            (
                b"\x93NUMPY\x01\x00\x39\x00{'descr': '<f8', 'fortran_order': False, 'shape': (9,), }\n",
                "9 x 8",
            ),
        ] {
            let error = parse_npy(bytes).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
