//! A mapping and the bags that it names.

use super::error::RosbagError;
use super::mapping::{MarkedPull, RosbagFile, mapping_path, read_mapping};
use super::signals::{Signals, WRENCH, read_signals, topics_of};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Bags and what they hold.
pub(super) struct Bags {
    pub(super) path: PathBuf,
    pub(super) text: String,
    pub(super) file: RosbagFile,
    pub(super) pulls: Vec<MarkedPull>,
}

impl Bags {
    pub(super) fn open(path: &Path) -> Result<Self, RosbagError> {
        let mapping =
            mapping_path(path).ok_or_else(|| RosbagError::new(path, "neither a bag nor a mapping"))?;
        // Of a folder of bags or of a mapping the bag beside it is the folder.
        let bag = if path == mapping { mapping.parent().unwrap_or(Path::new("")) } else { path };
        let bytes = std::fs::read(&mapping).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => no_mapping(&mapping, bag),
            _ => RosbagError::new(&mapping, e),
        })?;
        let text =
            String::from_utf8(bytes).map_err(|e| RosbagError::new(&mapping, format!("not text: {e}")))?;
        let (file, pulls) = read_mapping(&mapping, &text, bag)?;
        Ok(Self { path: mapping, text, file, pulls })
    }

    /// The signals of every bag that the mapping names.
    pub(super) fn signals(&self) -> Result<BTreeMap<PathBuf, Signals>, RosbagError> {
        let bags: BTreeSet<&PathBuf> = self.pulls.iter().map(|pull| &pull.bag).collect();
        bags.into_iter().map(|bag| Ok((bag.clone(), read_signals(bag, &self.file)?))).collect()
    }
}

/// A bag that nobody described: what is in it, and how a description begins.
fn no_mapping(mapping: &Path, bag: &Path) -> RosbagError {
    let topics = topics_of(bag).unwrap_or_default();
    let listed: Vec<String> = topics.iter().map(|t| format!("{} ({})", t.name, t.kind)).collect();
    let wrench = topics.iter().find(|t| t.kind == WRENCH).map_or("/wrench", |t| &t.name);
    let there = if listed.is_empty() { String::new() } else { format!("; topics: {}", listed.join(", ")) };
    RosbagError::new(mapping, format!("a bag needs this file, which says what its topics are{there}")).hint(format!(
        "begin with `[topics]`, `wrench = \"{wrench}\"`, `[defaults]`, `part = \"gear\"`, `grip_force_n = 40`; docs/interop.md"
    ))
}
