//! The text of a table: its encoding, what separates its cells, what its names mean.

use super::TableError;
use super::cell::Marks;
use std::path::Path;

/// The content of a file. Text in UTF-16 or Windows-1252, as spreadsheets save it, becomes UTF-8.
///
/// # Errors
/// [`TableError::Io`].
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, TableError> {
    let bytes =
        std::fs::read(path).map_err(|e| TableError::Io { path: path.into(), problem: e.to_string() })?;
    Ok(from_utf16(&bytes).or_else(|| from_windows_1252(&bytes)).unwrap_or(bytes))
}

/// What the bytes 0x80 to 0x9f are in Windows-1252 (WHATWG Encoding, index-windows-1252); the others are those of Unicode.
const WINDOWS_1252: &str = "\u{20ac}\u{81}\u{201a}\u{192}\u{201e}\u{2026}\u{2020}\u{2021}\u{2c6}\u{2030}\u{160}\u{2039}\u{152}\u{8d}\u{17d}\u{8f}\
    \u{90}\u{2018}\u{2019}\u{201c}\u{201d}\u{2022}\u{2013}\u{2014}\u{2dc}\u{2122}\u{161}\u{203a}\u{153}\u{9d}\u{17e}\u{178}";

/// Text with letters beyond ASCII that is not UTF-8. A file with control characters is not text.
fn from_windows_1252(bytes: &[u8]) -> Option<Vec<u8>> {
    let control = |b: &u8| *b < b' ' && !matches!(b, b'\t' | b'\n' | b'\r');
    if std::str::from_utf8(bytes).is_ok() || bytes.iter().any(control) {
        return None;
    }
    let special: Vec<char> = WINDOWS_1252.chars().collect();
    let letter = |b: &u8| match b {
        0x80..=0x9f => special[usize::from(b - 0x80)],
        _ => char::from(*b),
    };
    Some(bytes.iter().map(letter).collect::<String>().into_bytes())
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

    #[test]
    fn windows_1252_is_read_and_pictures_are_not() {
        let read = |bytes: &[u8]| from_windows_1252(bytes).map(|text| String::from_utf8(text).unwrap());
        let text = read(b"T [\xb0C],op\r\n1,J\xf6rg\r\n2,\x80\x9f\x93\r\n").unwrap();
        assert_eq!(text, "T [\u{b0}C],op\r\n1,J\u{f6}rg\r\n2,\u{20ac}\u{178}\u{201c}\r\n");
        assert_eq!(WINDOWS_1252.chars().count(), 32);
        assert_eq!(read("J\u{f6}rg".as_bytes()), None, "UTF-8");
        assert_eq!(read(&[0xff, 0xd8, 0xff, 0xe0, 0, 16, b'J']), None, "a picture");
    }
}
