//! A TOML text that remembers where its values stand.

use super::keys::{assign, check_part, fill, get, is_twin_key};
use super::{ConfigError, TwinFile, suggestion};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// A stretch of a configuration's text.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name of the file, or the `--set` argument.
    pub file: String,
    /// The whole text.
    pub text: Arc<str>,
    /// Byte range of the value or key, where it is known.
    pub span: Option<Range<usize>>,
}

impl Place {
    /// 1-based line and column of the start.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        let before = self.text.get(..self.span.as_ref()?.start)?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Some((line, column))
    }
}

/// A parsed TOML text with overrides merged in. Keys are dotted, see `keys`.
#[derive(Debug, Clone)]
pub struct Document {
    file: String,
    text: Arc<str>,
    table: toml::Table,
    places: BTreeMap<String, Place>,
}

impl Document {
    /// Parses `text`; `file` is the name shown in errors.
    ///
    /// # Errors
    ///
    /// Text that is no TOML, with the place.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        let shared: Arc<str> = text.into();
        let spanned = DeTable::parse(text).map_err(|e| ConfigError {
            key: String::new(),
            problem: e.message().to_string(),
            hint: None,
            place: Some(Box::new(Place { file: file.into(), text: shared.clone(), span: e.span() })),
        })?;
        let mut places = BTreeMap::new();
        record(text, spanned.get_ref(), "", &mut |key, span| {
            places.insert(key, Place { file: file.into(), text: shared.clone(), span: Some(span) });
        });
        let table: toml::Table =
            toml::from_str(text).map_err(|e| ConfigError::new("", e.message().to_string()))?;
        Ok(Self { file: file.into(), text: shared, table, places })
    }

    /// Name of the file, as shown in errors.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The values, overrides included.
    pub fn table(&self) -> &toml::Table {
        &self.table
    }

    /// Copies the sections named in `sections` from `defaults` where this document lacks keys of them.
    pub fn fill_from(&mut self, defaults: &toml::Table, sections: &[&str]) {
        for &section in sections {
            let Some(default) = defaults.get(section) else { continue };
            match self.table.get_mut(section) {
                Some(mine) => fill(mine, default),
                None => {
                    self.table.insert(section.into(), default.clone());
                }
            }
        }
    }

    /// Applies `key=value` from a command line. A value that is not TOML counts as text.
    ///
    /// # Errors
    ///
    /// A key that no TOML key can be, a value that cannot be read, or a key below one that is no table.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), ConfigError> {
        let parsed = parse_value(value);
        let argument: Arc<str> = format!("--set {key}={value}").into();
        let place = Place { file: "command line".into(), span: Some(6..argument.len()), text: argument };
        let checked = check_part(&self.table, key);
        let resolved = checked.and_then(|()| self.assign(key, parsed)).map_err(|mut e| {
            e.place.get_or_insert_with(|| Box::new(place.clone()));
            e
        })?;
        // What stood below the key in the file is gone, and so are the places of it.
        let below =
            |known: &str| known.strip_prefix(&resolved).is_some_and(|rest| rest.starts_with(['.', '[']));
        self.places.retain(|known, _| !below(known));
        self.places.insert(resolved, place);
        Ok(())
    }

    /// Puts `value` at `key` and returns the key as it stands in the table.
    ///
    /// # Errors
    ///
    /// A key below one that is no table.
    pub fn assign(&mut self, key: &str, value: toml::Value) -> Result<String, ConfigError> {
        assign(&mut self.table, key, value)
    }

    /// The value at `key`.
    pub fn get(&self, key: &str) -> Option<&toml::Value> {
        get(&self.table, key)
    }

    /// Reads the values into a struct that mirrors the file.
    ///
    /// # Errors
    ///
    /// An unknown key, a missing one or a value of another type, with the place.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        read_table(&self.table).map_err(|e| self.located(e))
    }

    /// Reads a twin: a right jaw that names some keys only has the others from the left one.
    ///
    /// # Errors
    ///
    /// As [`Self::read`].
    pub fn read_twin(&self) -> Result<TwinFile, ConfigError> {
        read_twin_table(&self.table).map_err(|e| self.located(e))
    }

    /// Adds the place to an error that names a key of this document.
    pub fn located(&self, mut error: ConfigError) -> ConfigError {
        if error.place.is_none() {
            error.place = Some(Box::new(self.place_of(&error.key)));
        }
        error
    }

    fn place_of(&self, key: &str) -> Place {
        let mut at = key;
        loop {
            if let Some(place) = self.places.get(at) {
                return place.clone();
            }
            let Some(cut) = at.rfind(['.', '[']) else { break };
            at = &at[..cut];
        }
        Place { file: self.file.clone(), text: self.text.clone(), span: None }
    }
}

/// Reads a table into a struct; errors name the key and suggest a known one.
pub(crate) fn read_table<T: DeserializeOwned>(table: &toml::Table) -> Result<T, ConfigError> {
    serde_path_to_error::deserialize(table.clone()).map_err(|e| {
        let path = e.path().to_string();
        explain(if path == "." { "" } else { &path }, e.inner().message())
    })
}

/// Reads the table of a twin, see [`Document::read_twin`].
pub(crate) fn read_twin_table(table: &toml::Table) -> Result<TwinFile, ConfigError> {
    let mut table = table.clone();
    for section in ["gel", "optics"] {
        let Some(toml::Value::Table(jaws)) = table.get_mut(section) else { continue };
        let left = jaws.get("left").cloned();
        if let (Some(left), Some(right)) = (left, jaws.get_mut("right")) {
            fill(right, &left);
        }
    }
    read_table(&table)
}

/// Turns serde's wording into ours.
fn explain(path: &str, message: &str) -> ConfigError {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let candidates = quoted.get(1..).unwrap_or_default();
    let of_a_twin = |typed: &str| candidates.contains(&"vary") && is_twin_key(typed);
    let hint = |typed: &str| match suggestion(typed, candidates.iter().copied()) {
        _ if of_a_twin(typed) => {
            format!("`{typed}` is a key of a twin; the file of a sweep names its twin: twin = \"twin.toml\"")
        }
        Some(name) => format!("did you mean `{name}`?"),
        None => format!("known here: {}", candidates.join(", ")),
    };
    if message.starts_with("unknown field") {
        let typed = quoted.first().copied().unwrap_or_default();
        let key = if path == typed || path.ends_with(&format!(".{typed}")) {
            path.to_string()
        } else if path.is_empty() {
            typed.to_string()
        } else {
            format!("{path}.{typed}")
        };
        return ConfigError::new(key, format!("unknown key `{typed}`")).hint(hint(typed));
    }
    if message.starts_with("unknown variant") {
        let typed = quoted.first().copied().unwrap_or_default();
        return ConfigError::new(path, format!("unknown value `{typed}`")).hint(hint(typed));
    }
    if let Some(name) = message.strip_prefix("missing field ") {
        let name = name.trim_matches('`');
        let at = if path.is_empty() { "the file".to_string() } else { format!("`{path}`") };
        return ConfigError::new(path, format!("the key `{name}` is missing in {at}"));
    }
    let plain = message
        .replace("invalid type: ", "wrong type: ")
        .replace("expected f64", "expected a number")
        .replace("expected u64", "expected a whole number")
        .replace("expected u32", "expected a whole number")
        .replace("expected usize", "expected a whole number")
        .replace("floating point ", "the number ");
    ConfigError::new(path, plain)
}

/// A TOML value from a command line, or plain text where it is none.
fn parse_value(text: &str) -> toml::Value {
    let parsed: Result<toml::Table, _> = toml::from_str(&format!("value = {text}"));
    match parsed {
        Ok(mut table) if table.len() == 1 => {
            table.remove("value").unwrap_or_else(|| toml::Value::String(text.into()))
        }
        _ => toml::Value::String(text.into()),
    }
}

/// Walks a spanned table and reports every key with the span of its value (of the name for sections).
fn record(text: &str, table: &DeTable<'_>, prefix: &str, found: &mut impl FnMut(String, Range<usize>)) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        record_value(text, value, path, key.span(), found);
    }
}

fn record_value(
    text: &str,
    value: &toml::Spanned<DeValue<'_>>,
    path: String,
    key_span: Range<usize>,
    found: &mut impl FnMut(String, Range<usize>),
) {
    match value.get_ref() {
        DeValue::Table(inner) => {
            record(text, inner, &path, found);
            // An inline table is shown itself, a section by its name.
            let inline = text.get(value.span()).is_some_and(|t| t.starts_with('{'));
            found(path, if inline { value.span() } else { key_span });
        }
        DeValue::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                record_value(text, item, format!("{path}[{i}]"), item.span(), found);
            }
            let span = if value.span().is_empty() { key_span } else { value.span() };
            found(path, span);
        }
        _ => found(path, value.span()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "top = 1\n[a]\nb = \"x\"\n[[e]]\nname = \"p\"\nv = 1.5\n[[e]]\nname = \"q\"\npart = \"g\"\nv = 2.5\n[[e]]\nname = \"q\"\npart = \"h\"\n";

    fn place(document: &Document, key: &str) -> (Option<(usize, usize)>, String) {
        let e = document.located(ConfigError::new(key, "x"));
        let place = e.place.unwrap();
        let text = place.span.clone().map(|s| place.text[s].to_string()).unwrap_or_default();
        (place.line_and_column(), text)
    }

    #[test]
    fn keys_are_found_in_the_text() {
        let d = Document::parse("f.toml", TEXT).unwrap();
        assert_eq!(place(&d, "top"), (Some((1, 7)), "1".into()));
        assert_eq!(place(&d, "a.b"), (Some((3, 5)), "\"x\"".into()));
        assert_eq!(place(&d, "e[1].v"), (Some((10, 5)), "2.5".into()));
        assert_eq!(place(&d, "a.missing"), (Some((2, 2)), "a".into()), "the parent stands in");
        assert_eq!(place(&d, "nowhere"), (None, String::new()));
    }

    #[test]
    fn assignments_reach_tables_and_named_elements() {
        let mut d = Document::parse("f.toml", TEXT).unwrap();
        for (key, value, resolved) in [
            ("top", "2", "top"),
            ("a.c.d", "true", "a.c.d"),
            ("e.p.v", "7", "e[0].v"),
            ("e.q.h.v", "8", "e[2].v"),
            ("e.1.v", "9", "e[1].v"),
            ("e[0].v", "10", "e[0].v"),
        ] {
            d.set(key, value).unwrap();
            let (_, shown) = place(&d, resolved);
            assert_eq!(shown, format!("{key}={value}"), "the command line is the new place of {key}");
            assert_eq!(d.get(key).map(ToString::to_string), Some(value.to_string()));
        }
        d.set("a.b", "plain words").unwrap();
        assert_eq!(d.get("a.b").and_then(toml::Value::as_str), Some("plain words"));
        for (key, part) in
            [("e.z.v", "no `z`"), ("e.q.v", "stands 2 times"), ("top.x", "has no keys"), ("a..b", "empty")]
        {
            let e = d.set(key, "1").unwrap_err();
            assert!(e.problem.contains(part), "{key}: {e}");
        }
    }

    #[test]
    fn what_an_override_replaced_has_its_place_on_the_command_line() {
        let mut d = Document::parse("f.toml", TEXT).unwrap();
        d.set("e", "[{ name = \"z\", v = 3 }]").unwrap();
        for key in ["e", "e[0]", "e[0].v", "e[0].name", "e[1].v"] {
            assert_eq!(place(&d, key).1, "e=[{ name = \"z\", v = 3 }]", "{key}");
        }
        assert_eq!(place(&d, "a.b"), (Some((3, 5)), "\"x\"".into()), "the rest keeps its place");
    }

    #[test]
    fn defaults_fill_only_what_is_missing() {
        let mut d = Document::parse("f.toml", "[a]\nb = 1\n").unwrap();
        let defaults: toml::Table = toml::from_str("[a]\nb = 2\nc = 3\n[z]\ny = 4\n[other]\n").unwrap();
        d.fill_from(&defaults, &["a", "z"]);
        assert_eq!(d.table().to_string(), "[a]\nb = 1\nc = 3\n\n[z]\ny = 4\n");
    }
}
