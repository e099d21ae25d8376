//! A twin that was changed by a calibration or a diagnosis: what changes, and the new file.

mod entry;

pub(crate) use entry::{calibration_entry, effect_entry, put_estimate};

use gripgen::VERSION;
use gripgen::{LoadError, load_twin_document};
use gripgen::{Location, path_from};
use gripgen_twin::config::{CalibrationFile, ConfigError, Document, EffectFile, TwinFile};
use gripgen_twin::{NO_MESH, TWIN_SCHEMA, Twin};
use std::path::{Path, PathBuf};

/// A value of a twin that was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct EditedValue {
    /// Key, as in `parts.gear.mu`.
    pub key: String,
    /// New value.
    pub value: f64,
    /// How well it is known.
    pub calibration: Option<CalibrationFile>,
}

/// Everything that is changed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TwinEdits {
    /// Fitted values.
    pub values: Vec<EditedValue>,
    /// The effects of the new twin, all of them; `None` leaves those of the old one.
    pub effects: Option<Vec<EffectFile>>,
}

/// Why a changed twin could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteTwinError {
    /// The old twin, or an override of it.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The new values do not make a twin.
    #[error("the new twin: {0}")]
    Edit(ConfigError),
    /// The file cannot be written.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
}

/// The twin at `base` with overrides and edits applied, its paths as they stand there.
///
/// # Errors
///
/// A twin that cannot be loaded, or edits that make none.
pub fn edited_twin(
    base: &Location,
    sets: &[(String, String)],
    edits: &TwinEdits,
) -> Result<TwinFile, WriteTwinError> {
    let mut document = load_twin_document(base, sets)?;
    let edit = |e: ConfigError| WriteTwinError::Edit(e);
    if let Some(effects) = &edits.effects {
        document.assign("effects", to_value(effects)?).map_err(edit)?;
    }
    for edited in &edits.values {
        let before = before(&document, edited);
        let place = document.assign(&edited.key, toml::Value::Float(edited.value)).map_err(edit)?;
        if let (Some(calibration), Some((section, leaf))) = (&edited.calibration, place.rsplit_once('.')) {
            let key = format!("{section}.calibration.{leaf}");
            let calibration = CalibrationFile { before, ..calibration.clone() };
            document.assign(&key, to_value(&calibration)?).map_err(edit)?;
        }
    }
    let mut file = document.read_twin().map_err(edit)?;
    file.schema = Some(TWIN_SCHEMA.into());
    Twin::new(&file).map_err(edit)?;
    Ok(file)
}

/// What stood in a twin before a value was fitted; of one that was fitted to the same data before, what stood there first.
fn before(document: &Document, edited: &EditedValue) -> Option<f64> {
    let calibration = |key: &str| -> Option<CalibrationFile> {
        let (section, leaf) = key.rsplit_once('.')?;
        document.get(&format!("{section}.calibration.{leaf}"))?.clone().try_into().ok()
    };
    let same = |old: &CalibrationFile| {
        old.data_sha256.is_some()
            && old.data_sha256 == edited.calibration.as_ref().and_then(|c| c.data_sha256.clone())
    };
    let first = calibration(&edited.key).filter(same).and_then(|old| old.before);
    first.or_else(|| number(document.get(&edited.key)?))
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|x| x as f64))
}

/// The values that stood in a twin before it was calibrated to the data of this hash, as overrides.
pub(crate) fn before_data(document: &Document, sha256: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    walk(document.table(), "", &mut |key, calibration| {
        if let Some(before) =
            calibration.before.filter(|_| calibration.data_sha256.as_deref() == Some(sha256))
        {
            found.push((key.to_string(), toml::Value::Float(before).to_string()));
        }
    });
    found
}

/// Calls `each` with every key that was fitted.
fn walk(table: &toml::Table, path: &str, each: &mut dyn FnMut(&str, CalibrationFile)) {
    let below = |leaf: &str| if path.is_empty() { leaf.to_string() } else { format!("{path}.{leaf}") };
    for (name, value) in table {
        let toml::Value::Table(inner) = value else { continue };
        if name != "calibration" {
            walk(inner, &below(name), each);
            continue;
        }
        for (leaf, entry) in inner {
            if let Ok(calibration) = entry.clone().try_into() {
                each(&below(leaf), calibration);
            }
        }
    }
}

/// The text of the twin at `base` with overrides and edits applied, with every key spelt out, for a file `out`.
///
/// The paths in it are written anew so that they name the same files from where `out` lies; those inside gripgen and
/// absolute ones stay. Comments of the old file are not kept.
///
/// # Errors
///
/// As [`edited_twin`], or no folder for `out`.
pub fn edited_twin_toml(
    base: &Location,
    sets: &[(String, String)],
    edits: &TwinEdits,
    out: &Path,
) -> Result<String, WriteTwinError> {
    let mut file = edited_twin(base, sets, edits)?;
    let io = |problem: String| WriteTwinError::Io { path: out.into(), problem };
    let folder = match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize().map_err(|e| io(e.to_string()))?;
    for path in paths_of(&mut file) {
        *path = path_from(&folder, &base.beside(path));
    }
    let body = toml::to_string_pretty(&file).map_err(|e| io(e.to_string()))?;
    Ok(header(base, sets, edits) + &body)
}

/// Writes the text of [`edited_twin_toml`] over whatever `out` is.
///
/// # Errors
///
/// As [`edited_twin_toml`], or a file that cannot be written.
pub fn write_twin(
    base: &Location,
    sets: &[(String, String)],
    edits: &TwinEdits,
    out: &Path,
) -> Result<(), WriteTwinError> {
    let text = edited_twin_toml(base, sets, edits, out)?;
    std::fs::write(out, text).map_err(|e| WriteTwinError::Io { path: out.into(), problem: e.to_string() })
}

fn header(base: &Location, sets: &[(String, String)], edits: &TwinEdits) -> String {
    let effects = match &edits.effects {
        Some(effects) => format!("{} effects found", effects.len()),
        None => "its own effects".into(),
    };
    let overrides = if sets.is_empty() { String::new() } else { format!(", {} overridden", sets.len()) };
    // A file name may hold a line break.
    let base = base.to_string().replace(char::is_control, " ");
    format!(
        "# Made by gripgen {VERSION} from {base}: {} values fitted{overrides}, {effects}.\n\
         # A value that was fitted has its 90 % interval and its evidence under `calibration`.\n\
         # Taking an entry of [[effects]] out restores the twin without it.\n\n",
        edits.values.len()
    )
}

fn to_value<T: serde::Serialize>(value: &T) -> Result<toml::Value, WriteTwinError> {
    toml::Value::try_from(value).map_err(|e| WriteTwinError::Edit(ConfigError::new("", e.to_string())))
}

/// The paths of files in a twin.
fn paths_of(file: &mut TwinFile) -> Vec<&mut String> {
    let mut paths: Vec<&mut String> =
        file.parts.values_mut().map(|part| &mut part.mesh).filter(|mesh| *mesh != NO_MESH).collect();
    paths.extend(file.robot.arm.as_mut().map(|arm| &mut arm.urdf));
    for optics in [Some(&mut file.optics.left), file.optics.right.as_mut()].into_iter().flatten() {
        paths.push(&mut optics.sensor);
        let beside = [&mut optics.background, &mut optics.gel_map, &mut optics.shadow_table];
        paths.extend(beside.into_iter().filter_map(Option::as_mut));
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A twin that was fitted twice to the same data gives back what stood there first, to other data what is there now.
    #[test]
    fn what_stood_before_a_fit_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let fitted = |base: &Location, mu: f64, data: &str, name: &str| {
            let calibration = CalibrationFile {
                low90: 0.1,
                high90: 0.4,
                evidence: None,
                data_sha256: Some(data.into()),
                before: None,
            };
            let value =
                EditedValue { key: "parts.gear.mu".into(), value: mu, calibration: Some(calibration) };
            let out = folder.path().join(name);
            write_twin(base, &[], &TwinEdits { values: vec![value], effects: None }, &out).unwrap();
            Location::Disk(out)
        };
        let first = Location::parse("asset:configs/twin-baseline.toml");
        let mu = load_twin_document(&first, &[]).unwrap().read_twin().unwrap().parts["gear"].mu;
        let once = fitted(&first, 0.3, "ab", "once.toml");
        let twice = fitted(&once, 0.31, "ab", "twice.toml");
        let other = fitted(&twice, 0.32, "cd", "other.toml");
        let before = |at: &Location, data: &str| before_data(&load_twin_document(at, &[]).unwrap(), data);
        let gear = |mu: f64| vec![("parts.gear.mu".to_string(), toml::Value::Float(mu).to_string())];
        assert_eq!(before(&once, "ab"), gear(mu));
        assert_eq!(before(&twice, "ab"), gear(mu));
        assert_eq!(before(&other, "cd"), gear(0.31));
        assert_eq!(before(&other, "ab"), vec![]);
    }
}
