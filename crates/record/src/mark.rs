//! Which verb of gripgen wrote a file: a text chunk of a PNG, a metadata record of an MCAP file, a key of a Parquet file.

use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::Path;

/// Name of the mark: metadata record of an MCAP file, key of a Parquet file, keyword of a PNG's text chunk.
pub const MARK_NAME: &str = "gripgen.made_by";

/// What `gripgen export` is called in the marks of its files.
pub(crate) const EXPORT: &str = "export";

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Length of a chunk's frame: size, type, checksum.
const FRAME: usize = 12;

/// The PNG with a text chunk after its header (PNG specification, 11.3.3.2 `tEXt`); `None` where it is no PNG.
///
/// `text` is plain ASCII.
pub fn png_with_mark(png: &[u8], text: &str) -> Option<Vec<u8>> {
    let (kind, header) = chunk(png, PNG_SIGNATURE.len()).filter(|_| png.starts_with(PNG_SIGNATURE))?;
    let after = PNG_SIGNATURE.len() + FRAME + header.len();
    if kind != b"IHDR" {
        return None;
    }
    let mut body = b"tEXt".to_vec();
    body.extend(MARK_NAME.bytes().chain([0]).chain(text.bytes()));
    let mut marked = png[..after].to_vec();
    marked.extend((body.len() as u32 - 4).to_be_bytes());
    marked.extend(&body);
    marked.extend(crc32fast::hash(&body).to_be_bytes());
    marked.extend(&png[after..]);
    Some(marked)
}

/// The mark of a PNG, and the PNG without it; `None` where there is none.
pub fn png_mark(png: &[u8]) -> Option<(String, Vec<u8>)> {
    let mut at = PNG_SIGNATURE.len();
    if !png.starts_with(PNG_SIGNATURE) {
        return None;
    }
    while let Some((kind, data)) = chunk(png, at) {
        let next = at + FRAME + data.len();
        let text = data.strip_prefix(MARK_NAME.as_bytes()).and_then(|rest| rest.strip_prefix(&[0]));
        if let (b"tEXt", Some(text)) = (kind, text) {
            let text = String::from_utf8(text.to_vec()).ok()?;
            return Some((text, [&png[..at], &png[next..]].concat()));
        }
        at = next;
    }
    None
}

/// Type and content of the chunk that begins at a byte.
fn chunk(png: &[u8], at: usize) -> Option<(&[u8], &[u8])> {
    let size = png.get(at..at.checked_add(4)?)?;
    let size = u32::from_be_bytes([size[0], size[1], size[2], size[3]]) as usize;
    let kind = png.get(at + 4..at + 8)?;
    let data = png.get(at + 8..at.checked_add(8)?.checked_add(size)?)?;
    png.get(at + 8 + size..at + FRAME + size).map(|_| (kind, data))
}

/// The verb that wrote a Parquet file; `None` where there is no mark or no such file.
pub fn parquet_mark(path: &Path) -> Option<String> {
    let reader = SerializedFileReader::new(File::open(path).ok()?).ok()?;
    let pairs = reader.metadata().file_metadata().key_value_metadata()?;
    pairs.iter().find(|pair| pair.key == MARK_NAME)?.value.clone()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decode_picture, encode_png};
    use gripgen_twin::TactileImage;

    #[test]
    fn a_marked_picture_is_the_same_picture() {
        let image = TactileImage { width_px: 5, height_px: 3, rgb: (0..45).collect() };
        let png = encode_png(&image).unwrap();
        assert_eq!(png_mark(&png), None);
        let marked = png_with_mark(&png, "show 0123").unwrap();
        // Another reader checks the chunk's checksum and finds the text.
        let mut options = png::DecodeOptions::default();
        options.set_skip_ancillary_crc_failures(false);
        let reader =
            png::Decoder::new_with_options(std::io::Cursor::new(&marked), options).read_info().unwrap();
        let texts = &reader.info().uncompressed_latin1_text;
        assert_eq!((texts[0].keyword.as_str(), texts[0].text.as_str()), (MARK_NAME, "show 0123"));
        assert_eq!(decode_picture(&marked).unwrap(), image);
        assert_eq!(png_mark(&marked), Some(("show 0123".into(), png)));
        assert!(png_with_mark(b"no picture", "x").is_none() && png_mark(b"no picture").is_none());
        for cut in 0..marked.len() {
            let _ = png_mark(&marked[..cut]);
            let _ = png_with_mark(&marked[..cut], "x");
        }
    }
}
