//! A twin that was changed by a calibration or a diagnosis: what changes, and the new file.

mod entry;

pub(crate) use entry::{calibration_entry, effect_entry, put_estimate};

use gripgen::VERSION;
use gripgen::{LoadError, load_twin_document};
use gripgen::{Location, path_from};
use gripgen_twin::config::{CalibrationFile, ConfigError, EffectFile, TwinFile};
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
        let place = document.assign(&edited.key, toml::Value::Float(edited.value)).map_err(edit)?;
        if let (Some(calibration), Some((section, leaf))) = (&edited.calibration, place.rsplit_once('.')) {
            let key = format!("{section}.calibration.{leaf}");
            document.assign(&key, to_value(calibration)?).map_err(edit)?;
        }
    }
    let mut file = document.read_twin().map_err(edit)?;
    file.schema = Some(TWIN_SCHEMA.into());
    Twin::new(&file).map_err(edit)?;
    Ok(file)
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
