//! The text of a table: its encoding, what separates its cells, what its names mean.

use super::TableError;
use super::cell::Marks;
use std::path::Path;

/// The content of a file. Text in UTF-16, as spreadsheets save it, becomes UTF-8.
///
/// # Errors
/// [`TableError::Io`].
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, TableError> {
    let bytes =
        std::fs::read(path).map_err(|e| TableError::Io { path: path.into(), problem: e.to_string() })?;
    Ok(from_utf16(&bytes).unwrap_or(bytes))
}

/// UTF-16 with a byte order mark, or with the zero that each Latin letter has in it.
fn from_utf16(bytes: &[u8]) -> Option<Vec<u8>> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        [a, 0, b, 0, ..] if *a > 0 && *b > 0 => u16::from_le_bytes,
        [0, a, 0, b, ..] if *a > 0 && *b > 0 => u16::from_be_bytes,
        _ => return None,
    };
    let (pairs, []) = bytes.as_chunks::<2>() else { return None };
    let text: Result<String, _> = char::decode_utf16(pairs.iter().map(|pair| unit(*pair))).collect();
    text.ok().map(String::into_bytes)
}

/// Where the header begins, and what stands between cells.
pub(super) struct Layout {
    pub(super) begins: usize,
    pub(super) delimiter: u8,
}

/// Semicolons or tabs where the header has them and no comma; or what the line `sep=;` says, which spreadsheets write before it.
pub(super) fn layout(bytes: &[u8]) -> Layout {
    let mark = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    if let [b's' | b'S', b'e' | b'E', b'p' | b'P', b'=', delimiter, b'\r' | b'\n', ..] = &bytes[mark..] {
        let crlf = bytes[mark + 5..].starts_with(b"\r\n");
        return Layout { begins: mark + 6 + usize::from(crlf), delimiter: *delimiter };
    }
    let header =
        bytes.split(|b| matches!(b, b'\r' | b'\n')).find(|line| !line.is_empty()).unwrap_or_default();
    let has = |delimiter: &u8| header.contains(delimiter);
    let other = [b';', b'\t'].into_iter().find(|delimiter| has(delimiter) && !has(&b','));
    Layout { begins: 0, delimiter: other.unwrap_or(b',') }
}

/// What commas and points are in the numbers of a table. Where commas separate cells, only quotes can hide one.
pub(super) fn marks(bytes: &[u8], delimiter: u8) -> Marks {
    if !bytes.contains(&b',') || (delimiter == b',' && !bytes.contains(&b'"')) {
        return Marks::default();
    }
    let mut reader = super::reader_of(bytes, delimiter);
    let records: Vec<csv::StringRecord> = reader.records().map_while(Result::ok).collect();
    Marks::of(records.iter().flatten())
}

/// A name in small letters with one `_` for whatever is neither letter nor digit: `Grip Force [N]` is `grip_force_n`.
pub(super) fn plain_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_").to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_another_spelling_are_the_same() {
        for name in ["grip_force_n", "Grip Force [N]", "GRIP-FORCE (n)", " grip  force  N"] {
            assert_eq!(plain_name(name), "grip_force_n");
        }
        assert_eq!(plain_name("Temperature (\u{b0}C)"), "temperature_c");
    }

    #[test]
    fn utf_16_is_read_with_and_without_its_mark() {
        let text = "force_n,op\n1,J\u{f6}rg\n";
        let le: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect();
        let be: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_be_bytes).collect();
        for bytes in [&le[..], &le[2..], &be, &be[2..]] {
            let found = String::from_utf8(from_utf16(bytes).unwrap()).unwrap();
            assert_eq!(found.trim_start_matches('\u{feff}'), text);
        }
        assert_eq!(from_utf16(text.as_bytes()), None);
        assert_eq!(from_utf16(&[0xff, 0xd8, 0xff, 0xe0]), None, "a picture");
        assert_eq!(from_utf16(&le[..le.len() - 1]), None, "cut in a letter");
    }
}
