//! Dotted keys: finding and changing a value of a TOML table.
//!
//! An element of an array of tables is named by its index (`effects[0].a` or `effects.0.a`) or by its `name`
//! (`effects.load_offset.a`), followed by its `part` where the name alone is not unique
//! (`effects.load_offset.gear.a`). Names with dots or brackets in them cannot be reached.

use super::ConfigError;
use std::borrow::Cow;

/// The sections that fall back to the shipped baseline twin, key by key.
pub const DEFAULTED_SECTIONS: &[&str] = &["robot", "gripper", "wrist", "gel", "optics"];

/// Keys of `[vary]` that begin like this are those of the part that is drawn.
const DRAWN_PART: &str = "parts.*.";

/// A key of `[vary]` with the name of the drawn part: `parts.gear.mu` for `parts.*.mu`.
pub(crate) fn of_part<'a>(key: &'a str, part: &str) -> Cow<'a, str> {
    match key.strip_prefix(DRAWN_PART) {
        Some(leaf) => format!("parts.{part}.{leaf}").into(),
        None => key.into(),
    }
}

/// Whether a key of `[vary]` or `--set` belongs to the twin.
pub fn is_twin_key(key: &str) -> bool {
    let section = key.split(['.', '[']).next().unwrap_or_default();
    ["parts", "effects"].contains(&section) || DEFAULTED_SECTIONS.contains(&section)
}

/// Copies into `mine` what it lacks of `default`, key by key.
pub(super) fn fill(mine: &mut toml::Value, default: &toml::Value) {
    if let (toml::Value::Table(mine), toml::Value::Table(default)) = (mine, default) {
        for (key, value) in default {
            match mine.get_mut(key) {
                Some(existing) => fill(existing, value),
                None => {
                    mine.insert(key.clone(), value.clone());
                }
            }
        }
    }
}

/// The segments of a dotted key; an index is a segment too.
pub(crate) fn segments(key: &str) -> Vec<&str> {
    key.split(['.', '[']).map(|s| s.strip_suffix(']').unwrap_or(s)).collect()
}

/// The value at a dotted key.
pub(crate) fn get<'a>(table: &'a toml::Table, key: &str) -> Option<&'a toml::Value> {
    let segments = segments(key);
    let (mut value, mut at) = (table.get(segments[0])?, 1);
    while at < segments.len() {
        value = match value {
            toml::Value::Table(inner) => inner.get(segments[at])?,
            toml::Value::Array(items) => {
                let (i, used) = element(items, &segments[at..], key).ok()?;
                at += used - 1;
                &items[i]
            }
            _ => return None,
        };
        at += 1;
    }
    Some(value)
}

/// A change of a part does not make one: `parts.gaer.mu` is a misspelt part, not a new one.
pub(crate) fn check_part(table: &toml::Table, key: &str) -> Result<(), ConfigError> {
    let parts = table.get("parts").and_then(toml::Value::as_table);
    let (Some(parts), ["parts", part, _, ..]) = (parts, &segments(key)[..]) else { return Ok(()) };
    if parts.contains_key(*part) {
        return Ok(());
    }
    Err(ConfigError::unknown_part(key, part, parts.keys()))
}

/// Puts `value` at a dotted key, making tables on the way; returns the key as the document records places.
pub(crate) fn assign(table: &mut toml::Table, key: &str, value: toml::Value) -> Result<String, ConfigError> {
    let segments = segments(key);
    if segments.iter().any(|s| s.is_empty()) {
        return Err(ConfigError::new(key, "a key has an empty part").hint("write it as section.key=value"));
    }
    let mut resolved = segments[0].to_string();
    if segments.len() == 1 {
        table.insert(key.into(), value);
        return Ok(resolved);
    }
    if segments[0] == "effects" && !table.contains_key("effects") {
        return Err(ConfigError::new(key, "the twin has no effects").hint(
            "add one with [[effects]] and its name, here: --set 'effects=[{name=\"wear\", depth=0.1}]'",
        ));
    }
    let mut current: &mut toml::Value =
        table.entry(segments[0]).or_insert_with(|| toml::Value::Table(Default::default()));
    let mut at = 1;
    loop {
        let last = at + 1 == segments.len();
        match current {
            toml::Value::Table(inner) => {
                resolved = format!("{resolved}.{}", segments[at]);
                if last {
                    inner.insert(segments[at].into(), value);
                    return Ok(resolved);
                }
                current = inner.entry(segments[at]).or_insert_with(|| toml::Value::Table(Default::default()));
                at += 1;
            }
            toml::Value::Array(items) => {
                let (i, used) = element(items, &segments[at..], key)?;
                at += used;
                resolved = format!("{resolved}[{i}]");
                if at == segments.len() {
                    items[i] = value;
                    return Ok(resolved);
                }
                current = &mut items[i];
            }
            other => {
                let problem = format!("`{resolved}` is {}, it has no keys", other.type_str());
                return Err(ConfigError::new(key, problem));
            }
        }
    }
}

/// The element of an array of tables that the next one or two segments name, and how many they are.
fn element(items: &[toml::Value], segments: &[&str], key: &str) -> Result<(usize, usize), ConfigError> {
    if let Ok(i) = segments[0].parse::<usize>() {
        if i < items.len() {
            return Ok((i, 1));
        }
        let problem = format!("there is no element {i}, the list has {}", items.len());
        return Err(ConfigError::new(key, problem));
    }
    let text = |item: &toml::Value, field: &str| {
        item.get(field).and_then(toml::Value::as_str).unwrap_or_default().to_string()
    };
    let named: Vec<usize> = (0..items.len()).filter(|&i| text(&items[i], "name") == segments[0]).collect();
    match named[..] {
        [] => {
            let known: Vec<String> = items.iter().map(|item| text(item, "name")).collect();
            let error = ConfigError::new(key, format!("there is no `{}` in the list", segments[0]));
            Err(error.suggest(segments[0], known.iter().map(String::as_str), || match known.is_empty() {
                true => "the list is empty".into(),
                false => format!("the list has: {}", known.join(", ")),
            }))
        }
        [only] if segments.get(1).is_none_or(|part| text(&items[only], "part") != *part) => Ok((only, 1)),
        _ => {
            let parts: Vec<String> = named.iter().map(|&i| text(&items[i], "part")).collect();
            let wanted = segments.get(1).copied().unwrap_or_default();
            match named.iter().zip(&parts).find(|(_, part)| *part == wanted) {
                Some((&i, _)) => Ok((i, 2)),
                None => Err(ConfigError::new(key, format!("`{}` stands {} times", segments[0], named.len()))
                    .hint(format!("name one: {}.<part> with part one of {}", segments[0], parts.join(", ")))),
            }
        }
    }
}
