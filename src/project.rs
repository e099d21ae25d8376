//! A sweep with everything it needs: twin, meshes, sensors, and the hash over all of it.

use crate::assets;
use crate::library::{Library, LibraryError};
use crate::location::{Location, ReadFileError};
use gripgen_record::{RunFolder, sha256_hex};
use gripgen_twin::config::{Backend, ConfigError, Document, Mechanics, SweepFile, TwinFile};
use gripgen_twin::draw::{Distribution, Drawn};
use gripgen_twin::{DEFAULTED_SECTIONS, Sweep, Twin, is_twin_key};
use std::collections::BTreeMap;

/// The twin whose sections stand in for what a twin leaves out, and the default of `--twin`.
pub const BASELINE_TWIN: &str = "asset:configs/twin-baseline.toml";

/// A loaded sweep.
pub struct Project {
    /// Name of the run: the configuration's file name.
    pub name: String,
    /// The checked sweep.
    pub sweep: Sweep,
    /// The twin before anything is drawn.
    pub twin: Twin,
    /// Its values, for drawing.
    pub twin_table: toml::Table,
    /// Meshes, contact shapes and sensors.
    pub library: Library,
    /// The configuration as it was resolved: sweep and twin with all defaults and overrides.
    pub config_toml: String,
    /// SHA-256 of everything a sample is a function of, beside gripgen's version.
    pub config_sha256: String,
}

/// Why a sweep cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A key of a configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// A mesh or sensor file is broken.
    #[error(transparent)]
    Library(#[from] LibraryError),
}

/// Loads a twin: its text, the overrides meant for it, and defaults for what it leaves out.
pub fn load_twin_document(location: &Location, sets: &[(String, String)]) -> Result<Document, LoadError> {
    let mut document = Document::parse(&location.to_string(), &location.read_text()?)?;
    let baseline: toml::Table =
        assets::text("configs/twin-baseline.toml").parse().expect("a test reads the baseline twin");
    document.fill_from(&baseline, DEFAULTED_SECTIONS);
    for (key, value) in sets.iter().filter(|(key, _)| is_twin_key(key)) {
        document.set(key, value)?;
    }
    Ok(document)
}

impl Project {
    /// Loads a sweep and all files it names. `sets` are overrides `key=value`, for the sweep or for the twin.
    pub fn load(location: &Location, sets: &[(String, String)]) -> Result<Self, LoadError> {
        let mut document = Document::parse(&location.to_string(), &location.read_text()?)?;
        for (key, value) in sets.iter().filter(|(key, _)| !is_twin_key(key)) {
            document.set(key, value)?;
        }
        let file: SweepFile = document.read()?;
        let twin_location = location.beside(&file.twin);
        let twin_document = load_twin_document(&twin_location, sets).map_err(|e| match e {
            LoadError::Read(e) => LoadError::from(
                document
                    .located(ConfigError::new("twin", e.to_string()).hint("paths are relative to this file")),
            ),
            other => other,
        })?;
        Self::build(location.run_name(), &document, &twin_document, |path| twin_location.beside(path))
    }

    /// Loads the sweep that made a run folder, from what the folder holds.
    pub fn from_run(folder: &RunFolder) -> Result<Self, LoadError> {
        let info = folder.info();
        let name = folder.path().join("run.json").display().to_string();
        let both: toml::Table = info
            .config_toml
            .parse()
            .map_err(|e: toml::de::Error| ConfigError::new("config_toml", e.message().to_string()))?;
        let part = |key: &str| -> Result<Document, ConfigError> {
            let table = both.get(key).and_then(toml::Value::as_table).cloned().unwrap_or_default();
            Document::parse(&format!("{name} ({key})"), &table.to_string())
        };
        let (document, twin_document) = (part("sweep")?, part("twin")?);
        Self::build(info.name.clone(), &document, &twin_document, |path| {
            match (path.starts_with(assets::ASSET_PREFIX), info.files_sha256.get(path)) {
                (false, Some(sha256)) => {
                    Location::Copy { path: folder.input_path(sha256), name: path.to_string() }
                }
                _ => Location::parse(path),
            }
        })
    }

    fn build(
        name: String,
        document: &Document,
        twin_document: &Document,
        locate: impl Fn(&str) -> Location,
    ) -> Result<Self, LoadError> {
        let file: SweepFile = document.read()?;
        let sweep = Sweep::new(&file, twin_document).map_err(|e| document.located(e))?;
        check_available(&sweep).map_err(|e| document.located(e))?;
        let twin_file: TwinFile = twin_document.read()?;
        let twin = Twin::new(&twin_file).map_err(|e| twin_document.located(e))?;
        let library = Library::new(load_files(&sweep, &twin, locate, twin_document)?);
        library.check(&sweep, &twin)?;
        Ok(Self {
            name,
            sweep,
            twin,
            twin_table: twin_document.table().clone(),
            config_toml: resolved_toml(document.table(), twin_document.table()),
            config_sha256: config_hash(document.table(), twin_document.table(), &library),
            library,
        })
    }
}

/// What the format allows and this version cannot do yet.
fn check_available(sweep: &Sweep) -> Result<(), ConfigError> {
    if sweep.mechanics == Mechanics::Reduced {
        return Err(ConfigError::new("mechanics", "`reduced` is not part of this version")
            .hint("use mechanics = \"rapier\""));
    }
    if sweep.backend == Backend::Gpu {
        return Err(
            ConfigError::new("backend", "`gpu` is not part of this version").hint("use backend = \"cpu\"")
        );
    }
    Ok(())
}

/// A file that a twin names: its key in the twin, the path as written.
struct Named {
    key: String,
    path: String,
}

/// Reads every file that any sample can need.
fn load_files(
    sweep: &Sweep,
    twin: &Twin,
    locate: impl Fn(&str) -> Location,
    document: &Document,
) -> Result<BTreeMap<String, (Location, Vec<u8>)>, LoadError> {
    let mut named = Vec::new();
    for part in drawn_parts(sweep, twin) {
        named.push(Named { key: format!("parts.{part}.mesh"), path: twin.parts[&part].mesh.clone() });
    }
    for (jaw, optics) in twin.optics.iter() {
        named.push(Named { key: format!("optics.{jaw}.sensor"), path: optics.sensor.clone() });
        if let Some(path) = &optics.background {
            named.push(Named { key: format!("optics.{jaw}.background"), path: path.clone() });
        }
    }
    for varied in &sweep.vary {
        let is_file = [".mesh", ".sensor", ".background"].iter().any(|end| varied.key.ends_with(end));
        if let (true, Distribution::Choice(values)) = (is_file, &varied.distribution) {
            let key = &varied.key;
            named.extend(values.iter().map(|v| Named { key: key.clone(), path: v.to_string() }));
        }
    }
    let mut files = BTreeMap::new();
    for Named { key, path } in named {
        if files.contains_key(&path) {
            continue;
        }
        let at = locate(&path);
        let bytes = at.read().map_err(|e| {
            let error = ConfigError::new(key, e.to_string());
            document.located(error.hint("paths are relative to the twin; `asset:...` is inside gripgen"))
        })?;
        files.insert(path, (at, bytes.into_owned()));
    }
    Ok(files)
}

/// The parts that the sweep can draw.
pub(crate) fn drawn_parts(sweep: &Sweep, twin: &Twin) -> Vec<String> {
    let choices = sweep.vary.iter().find(|v| v.key == "part").map(|v| &v.distribution);
    match choices {
        Some(Distribution::Choice(values)) => values
            .iter()
            .filter_map(|v| match v {
                Drawn::Text(name) if twin.parts.contains_key(name) => Some(name.clone()),
                _ => None,
            })
            .collect(),
        _ => twin.parts.keys().cloned().collect(),
    }
}

/// Sweep and twin as one TOML text. Paths stand as they were written.
fn resolved_toml(sweep: &toml::Table, twin: &toml::Table) -> String {
    let mut both = toml::Table::new();
    both.insert("sweep".into(), toml::Value::Table(sweep.clone()));
    both.insert("twin".into(), toml::Value::Table(twin.clone()));
    both.to_string()
}

/// Hash of the resolved configuration in which every path is replaced by the hash of the file's content: moving a
/// folder changes nothing, changing a mesh does.
fn config_hash(sweep: &toml::Table, twin: &toml::Table, library: &Library) -> String {
    let mut sweep = sweep.clone();
    // The path of the twin; its content follows.
    sweep.remove("twin");
    let hashes = library.files_sha256();
    let mut both = toml::Table::new();
    both.insert("sweep".into(), toml::Value::Table(sweep));
    both.insert("twin".into(), toml::Value::Table(twin.clone()));
    let mut value = toml::Value::Table(both);
    replace_paths(&mut value, &hashes);
    let canonical = serde_json::to_vec(&value).expect("TOML values are JSON values");
    sha256_hex(&canonical)
}

fn replace_paths(value: &mut toml::Value, hashes: &BTreeMap<String, String>) {
    match value {
        toml::Value::String(text) => {
            if let Some(hash) = hashes.get(text) {
                *text = format!("sha256:{hash}");
            }
        }
        toml::Value::Array(items) => items.iter_mut().for_each(|item| replace_paths(item, hashes)),
        toml::Value::Table(table) => table.iter_mut().for_each(|(_, item)| replace_paths(item, hashes)),
        _ => {}
    }
}
