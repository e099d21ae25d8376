//! Files that a configuration names, and those that they name.

use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item, Value};

/// How far names are followed: a sweep names a twin, which names meshes.
const DEPTH: usize = 3;

/// A configuration file, the files that its strings name, and those that `--set` names. What is not there is left out.
pub fn files(path: &str, sets: &[(String, String)]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let base = if path.starts_with(gripgen::assets::ASSET_PREFIX) { None } else { Some(Path::new(path)) };
    for (_, value) in sets {
        let name = value.trim_matches(['"', '\'']);
        let folders = [Some(Path::new("")), base.and_then(Path::parent)];
        folders.into_iter().flatten().for_each(|folder| follow(&folder.join(name), DEPTH, &mut found));
    }
    if let Some(base) = base {
        follow(base, DEPTH, &mut found);
    }
    found
}

fn follow(path: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    if depth == 0 || !path.is_file() || found.iter().any(|known| known == path) {
        return;
    }
    found.push(path.into());
    if path.extension().is_none_or(|e| e != "toml") {
        return;
    }
    // The draws that a sweep may take from beside its twin.
    follow(&path.with_extension("posterior.csv"), depth, found);
    let Some(document) = std::fs::read_to_string(path).ok().and_then(|text| text.parse::<DocumentMut>().ok())
    else {
        return;
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut names = Vec::new();
    strings_of(document.as_item(), &mut names);
    names.iter().for_each(|name| follow(&folder.join(name), depth - 1, found));
}

fn strings_of(item: &Item, names: &mut Vec<String>) {
    match item {
        Item::None => {}
        Item::Value(value) => of_value(value, names),
        Item::Table(table) => table.iter().for_each(|(_, item)| strings_of(item, names)),
        Item::ArrayOfTables(all) => {
            all.iter().flat_map(|table| table.iter()).for_each(|(_, item)| strings_of(item, names));
        }
    }
}

fn of_value(value: &Value, names: &mut Vec<String>) {
    match value {
        Value::String(name) => names.push(name.value().clone()),
        Value::Array(all) => all.iter().for_each(|value| of_value(value, names)),
        Value::InlineTable(table) => table.iter().for_each(|(_, value)| of_value(value, names)),
        _ => {}
    }
}
