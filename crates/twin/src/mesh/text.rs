//! Lines, words and numbers of the mesh formats that are text: any encoding, any end of line.

use super::MeshError;

/// The mark that some editors put before text in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Most characters of a file that a message shows.
const SHOWN: usize = 40;

/// The bytes behind a byte order mark.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
}

/// Lines, counted from 1. They end as on Unix, Windows or an old Macintosh.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> + Clone {
    let unix = bytes.split(|&b| b == b'\n');
    let all = unix.flat_map(|line| line.strip_suffix(b"\r").unwrap_or(line).split(|&b| b == b'\r'));
    all.enumerate().map(|(i, line)| (i + 1, line))
}

/// Words of a line. Some programs fill a file up with zero bytes: they stand for nothing.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|b| b.is_ascii_whitespace() || *b == 0).filter(|word| !word.is_empty())
}

/// A finite number.
pub(super) fn number(word: &[u8], line: usize) -> Result<f32, MeshError> {
    let read = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f32>().ok());
    read.filter(|x| x.is_finite())
        .ok_or_else(|| MeshError::syntax(line, format!("{} is not a finite number", quoted(word))))
}

/// Three coordinates, the first of `words`.
pub(super) fn coordinates<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
    line: usize,
) -> Result<[f32; 3], MeshError> {
    let mut read = [0.0; 3];
    for (i, x) in read.iter_mut().enumerate() {
        let missing = || MeshError::syntax(line, format!("a vertex has 3 coordinates, found {i}"));
        *x = number(words.next().ok_or_else(missing)?, line)?;
    }
    Ok(read)
}

/// A word of a file for a message: short, and without control characters.
pub(super) fn quoted(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(&word[..word.len().min(4 * SHOWN)]);
    let shown: String =
        text.chars().take(SHOWN).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    let cut = if text.chars().nth(SHOWN).is_some() { "…" } else { "" };
    format!("`{shown}{cut}`")
}

/// Whether bytes look like text: no control characters in the first kilobyte, but white space and the zeros that end a file.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let ended = bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
    bytes[..ended.min(1024)].iter().all(|&b| b >= b' ' && b != 0x7f || b.is_ascii_whitespace())
}
