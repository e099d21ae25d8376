//! The mark that gripgen leaves in what it writes: which verb made a file, and whether somebody edited it since.
//!
//! `docs/outputs.md` lists it for each format.

use gripgen::record::{MARK_NAME, mcap_mark, parquet_mark, png_mark, png_with_mark, sha256_hex, tar_mark};
use gripgen::tactile::npz::{Npz, npz_with_text};
use serde_json::Value;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Files of text that are longer are nobody's reports or configurations.
const MAX_TEXT: u64 = 1 << 28;
/// Digits of a hash in a mark.
const DIGITS: usize = 16;
/// Key of the mark in JSON, name of the array in an npz file.
const KEY: &str = "made_by";

/// How a file carries the mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A comment in the first line.
    Toml,
    /// A comment in the last line.
    Html,
    /// The same.
    Svg,
    /// A text chunk.
    Png,
    /// The field `made_by`.
    Json,
    /// The array `made_by`.
    Npz,
    /// Who made the bytes has marked them already: MCAP, Parquet, tar.
    Marked,
    /// No room for a mark: `.npy`, `.csv`; files that people are to edit.
    Bare,
}

/// What a file says about its maker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The verb, as it is typed.
    pub verb: String,
    /// Whether the file is as it was written, as far as the format tells.
    pub whole: bool,
    /// Hashes of files without room for a mark that were written with this one.
    pub beside: Vec<String>,
}

/// The first digits of the SHA-256 of bytes.
pub fn short_hash(bytes: &[u8]) -> String {
    sha256_hex(bytes)[..DIGITS].to_string()
}

/// The bytes of a file with the mark of a verb. `beside`: hashes of files without room that belong to it.
pub fn marked(format: Format, verb: &str, bytes: &[u8], beside: &[String]) -> Vec<u8> {
    let done = match format {
        Format::Toml => {
            let line = format!("# {}\n", sentence(verb, &short_hash(bytes), beside));
            Some([line.as_bytes(), bytes].concat())
        }
        Format::Html | Format::Svg => {
            let end = if bytes.ends_with(b"\n") { "" } else { "\n" };
            let ended = [bytes, end.as_bytes()].concat();
            let line = format!("<!-- {} -->\n", sentence(verb, &short_hash(&ended), beside));
            Some([&ended[..], line.as_bytes()].concat())
        }
        Format::Png => {
            let words = [vec![verb.replace(' ', "-"), short_hash(bytes)], beside.to_vec()].concat();
            png_with_mark(bytes, &words.join(" "))
        }
        Format::Npz => npz_with_text(bytes, KEY, &name(verb)).ok(),
        Format::Json | Format::Marked | Format::Bare => None,
    };
    done.unwrap_or_else(|| bytes.to_vec())
}

/// The same for a JSON document: an object, or each object of a list.
pub fn marked_json(verb: &str, value: &Value) -> Value {
    let mut value = value.clone();
    let mark = |value: &mut Value| {
        if let Value::Object(fields) = value {
            fields.insert(KEY.into(), name(verb).into());
        }
    };
    match &mut value {
        Value::Array(all) => all.iter_mut().for_each(mark),
        one => mark(one),
    }
    value
}

fn name(verb: &str) -> String {
    format!("gripgen {verb}")
}

fn sentence(verb: &str, hash: &str, beside: &[String]) -> String {
    let with = if beside.is_empty() { String::new() } else { format!(" with {};", beside.join(" ")) };
    format!("{MARK_NAME}: {verb} {hash};{with} replaced by the same verb until somebody edits it")
}

/// The mark of a file; `None` where it has none, or cannot be read.
pub fn mark_of(path: &Path) -> Option<Mark> {
    let unchecked = |verb: String| Mark { verb, whole: true, beside: vec![] };
    let mut file = File::open(path).ok()?;
    let mut magic = Vec::new();
    file.by_ref().take(8).read_to_end(&mut magic).ok()?;
    if magic.starts_with(b"\x89MCAP") {
        return mcap_mark(path).map(unchecked);
    }
    if magic.starts_with(b"PAR1") {
        return parquet_mark(path).map(unchecked);
    }
    if let Some(verb) = tar_mark(path) {
        return Some(unchecked(verb));
    }
    if file.metadata().ok()?.len() > MAX_TEXT {
        return None;
    }
    let bytes = std::fs::read(path).ok()?;
    if magic.starts_with(b"\x89PNG") {
        let (text, rest) = png_mark(&bytes)?;
        let mut words = text.split(' ').map(String::from);
        let (verb, hash) = (words.next()?.replace('-', " "), words.next()?);
        return Some(Mark { verb, whole: short_hash(&rest) == hash, beside: words.collect() });
    }
    if magic.starts_with(b"PK") {
        let text = Npz::open(&bytes).ok()?.text(KEY)?;
        return text.strip_prefix("gripgen ").map(|verb| unchecked(verb.into()));
    }
    of_text(&bytes).or_else(|| of_json(&bytes).map(unchecked))
}

/// A comment in the first line or the last one.
fn of_text(bytes: &[u8]) -> Option<Mark> {
    let text = std::str::from_utf8(bytes).ok()?;
    let of = |line: &str, rest: &str, opening: &str| {
        let said = line.strip_prefix(opening)?.strip_prefix(MARK_NAME)?.strip_prefix(": ")?;
        let mut said = said.split(';');
        let (verb, hash) = said.next()?.rsplit_once(' ')?;
        let with = said.find_map(|words| words.strip_prefix(" with ")).unwrap_or_default();
        let beside = with.split_whitespace().map(String::from).collect();
        Some(Mark { verb: verb.into(), whole: short_hash(rest.as_bytes()) == hash, beside })
    };
    let first = text.find('\n').map(|end| text.split_at(end + 1));
    let last = text.strip_suffix('\n').and_then(|text| text.rfind('\n')).map(|end| text.split_at(end + 1));
    first
        .and_then(|(line, rest)| of(line, rest, "# "))
        .or_else(|| last.and_then(|(rest, line)| of(line, rest, "<!-- ")))
}

/// The field of a document, of the first entry of a list, or of the first of many lines.
fn of_json(bytes: &[u8]) -> Option<String> {
    let mut values = serde_json::Deserializer::from_slice(bytes).into_iter::<Value>();
    let value = values.next()?.ok()?;
    let first = if let Value::Array(all) = &value { all.first()? } else { &value };
    first[KEY].as_str()?.strip_prefix("gripgen ").map(String::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn written(bytes: &[u8]) -> Option<Mark> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        mark_of(file.path())
    }

    #[test]
    fn a_mark_is_found_and_an_edit_is_seen() {
        let page = "<!doctype html>\n<p>x</p>";
        for (format, text) in
            [(Format::Toml, "a = 1\n[b]\n"), (Format::Html, page), (Format::Svg, "<svg/>\n")]
        {
            assert_eq!(written(text.as_bytes()), None);
            let bytes = marked(format, "calibrate pulls", text.as_bytes(), &[]);
            assert!(String::from_utf8_lossy(&bytes).contains(text));
            let wanted = Mark { verb: "calibrate pulls".into(), whole: true, beside: vec![] };
            assert_eq!(written(&bytes), Some(wanted.clone()), "{format:?}");
            let edited = String::from_utf8(bytes).unwrap().replacen(['a', 'x', 'v'], "q", 1);
            assert_ne!(written(edited.as_bytes()).map(|m| m.whole), Some(true), "{format:?}: {edited}");
        }
        let with = marked(Format::Toml, "diagnose", b"a = 1\n", &["0123".into(), "4567".into()]);
        let found = written(&with).unwrap();
        assert_eq!((found.verb.as_str(), found.whole), ("diagnose", true));
        assert_eq!(found.beside, ["0123", "4567"]);
        // What only speaks of the mark has none.
        assert_eq!(written(b"one\n# gripgen.made_by: show 0123; x\nthree\n"), None);
    }

    #[test]
    fn pictures_archives_and_json_carry_it() {
        use gripgen::tactile::npz::{Array, ElementType, write_npz};
        let image = gripgen::twin::TactileImage { width_px: 2, height_px: 1, rgb: vec![1; 6] };
        let png = gripgen::record::encode_png(&image).unwrap();
        let found = written(&marked(Format::Png, "render", &png, &["0123".into()])).unwrap();
        assert_eq!((found.verb.as_str(), found.whole), ("render", true));
        assert_eq!(found.beside, ["0123"]);
        let array = Array { shape: vec![1], values: vec![1.0] };
        let npz = write_npz(&[("a", array, ElementType::F64)]).unwrap();
        assert_eq!(written(&npz), None);
        let found = written(&marked(Format::Npz, "calibrate presses", &npz, &[])).unwrap();
        assert_eq!(found.verb, "calibrate presses");
        for value in [json!({"a": 1}), json!([{"a": 1}, {"b": 2}])] {
            let verb = |text: String| written(text.as_bytes()).map(|m| m.verb);
            let marked = marked_json("rig check", &value);
            assert_eq!(verb(value.to_string()), None);
            assert_eq!(verb(format!("{marked:#}\n")).as_deref(), Some("rig check"));
            // Lines, the last one cut off.
            assert_eq!(verb(format!("{marked}\n{{\"a\"")).as_deref(), Some("rig check"));
        }
    }
}
