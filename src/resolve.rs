//! Making a configuration complete: every default written out, every file read, no path left in it.
//!
//! The text that comes out, together with what gripgen embeds, is all that a sample depends on. It goes into the run
//! folder and every shard, and its hash decides whether two runs are the same one.

use crate::assets::ASSET_PREFIX;
use crate::location::Location;
use gripgen_record::sha256_hex;
use gripgen_twin::config::{ConfigError, Document, SweepFile, TwinFile};
use gripgen_twin::draw::{Distribution, Drawn};
use gripgen_twin::{NO_MESH, Sweep, TWIN_SCHEMA, is_twin_key};
use std::collections::BTreeMap;
use std::path::Path;

/// Files by the path that names them: where they are, and their content.
pub type Files = BTreeMap<String, (Location, Vec<u8>)>;

/// Stands for the path of a file that no sample needs.
const NOT_USED: &str = "not used";

/// A file that a configuration names.
pub(crate) struct Named {
    /// Key that names it: `parts.gear.mesh` of the twin, or `vary.parts.gear.mesh[1]` of the sweep.
    pub key: String,
    /// The key in the twin.
    pub twin_key: String,
    /// Its path in the resolved configuration.
    pub path: String,
}

/// A configuration that needs nothing but gripgen and its files.
pub(crate) struct Resolved {
    /// Sections `[sweep]` and `[twin]`.
    pub config_toml: String,
    /// Its files.
    pub files: Files,
    /// Which key names which file.
    pub named: Vec<Named>,
}

/// Completes a checked sweep and twin. Files on disk are called `inputs/<stem>-<hash>.<extension>` from here on.
pub(crate) fn resolve(
    sweep: &Sweep,
    twin_document: &Document,
    document: &Document,
    locate: impl Fn(&str) -> Location,
) -> Result<Resolved, ConfigError> {
    let mut resolver = Resolver { locate, new_paths: BTreeMap::new(), files: Files::new(), named: vec![] };
    let mut twin = twin_document.read_twin()?;
    resolver.twin(sweep, &mut twin).map_err(|e| twin_document.located(e))?;
    let mut file = sweep.to_file();
    resolver.vary(sweep, &mut file).map_err(|e| document.located(e))?;
    // The twin stands beside the sweep in the resolved text; split in two files it runs again.
    file.twin = "twin.toml".into();
    let mut both = toml::Table::new();
    both.insert("sweep".into(), written(toml::Table::try_from(&file))?);
    let mut twin = written(toml::Table::try_from(&twin))?;
    keep_partial(&mut twin, twin_document.table());
    both.insert("twin".into(), twin);
    Ok(Resolved { config_toml: both.to_string(), files: resolver.files, named: resolver.named })
}

/// SHA-256 of a resolved configuration and of the embedded files that it names. Other files are named by content.
pub(crate) fn config_hash(config_toml: &str, files: &Files) -> String {
    let mut text = config_toml.to_string();
    for (path, (_, bytes)) in files.iter().filter(|(path, _)| path.starts_with(ASSET_PREFIX)) {
        text += &format!("{path} {}\n", sha256_hex(bytes));
    }
    sha256_hex(text.as_bytes())
}

fn written(table: Result<toml::Table, toml::ser::Error>) -> Result<toml::Value, ConfigError> {
    let unwritable = |e| ConfigError::new("", format!("it cannot be written as TOML: {e}"));
    table.map(toml::Value::Table).map_err(unwritable)
}

/// A right jaw that names some keys only goes on doing so: what varies on the left then varies on both.
fn keep_partial(twin: &mut toml::Value, typed: &toml::Table) {
    for section in ["gel", "optics"] {
        let typed = typed.get(section).and_then(|s| s.get("right")).and_then(toml::Value::as_table);
        let right = twin.get_mut(section).and_then(|s| s.get_mut("right"));
        if let (Some(typed), Some(toml::Value::Table(right))) = (typed, right) {
            right.retain(|key, _| typed.contains_key(key));
        }
    }
}

/// Whether a key of a twin holds a path.
pub(crate) fn is_file_key(key: &str) -> bool {
    let ends = [".mesh", ".sensor", ".background", ".gel_map", ".shadow_table", ".urdf"];
    is_twin_key(key) && ends.iter().any(|end| key.ends_with(end))
}

struct Resolver<L> {
    locate: L,
    /// Path as written to path in the resolved configuration.
    new_paths: BTreeMap<String, String>,
    files: Files,
    named: Vec<Named>,
}

impl<L: Fn(&str) -> Location> Resolver<L> {
    fn twin(&mut self, sweep: &Sweep, twin: &mut TwinFile) -> Result<(), ConfigError> {
        twin.schema = Some(TWIN_SCHEMA.into());
        let drawn = sweep.drawn_parts();
        for (name, part) in &mut twin.parts {
            let key = format!("parts.{name}.mesh");
            // A mesh that no sample draws need not be there, and its path is nobody's business.
            if drawn.contains(&name.as_str()) && part.mesh == NO_MESH {
                let problem =
                    format!("the part `{name}` has no geometry, its twin was made from labels alone");
                let hint = format!("name its mesh: --set parts.{name}.mesh=FILE.stl, or draw another part");
                return Err(ConfigError::new(&key, problem).hint(hint));
            }
            if drawn.contains(&name.as_str()) {
                self.name(key.clone(), key, &mut part.mesh)?;
            } else {
                part.mesh = NOT_USED.into();
            }
        }
        let linked = twin.robot.model.has_links() || sweep.vary.iter().any(|v| v.key == "robot.model");
        if let Some(arm) = &mut twin.robot.arm {
            let key = "robot.arm.urdf".to_string();
            if linked {
                self.name(key.clone(), key, &mut arm.urdf)?;
            } else {
                arm.urdf = NOT_USED.into();
            }
        }
        let optics = [("left", Some(&mut twin.optics.left)), ("right", twin.optics.right.as_mut())];
        for (jaw, optics) in optics {
            let Some(optics) = optics else { continue };
            let key = format!("optics.{jaw}.sensor");
            self.name(key.clone(), key, &mut optics.sensor)?;
            let beside = [
                ("background", &mut optics.background),
                ("gel_map", &mut optics.gel_map),
                ("shadow_table", &mut optics.shadow_table),
            ];
            for (leaf, path) in beside {
                let Some(path) = path else { continue };
                let key = format!("optics.{jaw}.{leaf}");
                self.name(key.clone(), key, path)?;
            }
        }
        for effect in &mut twin.effects {
            for value in effect.parameters.values_mut() {
                if let toml::Value::Integer(i) = *value {
                    *value = toml::Value::Float(i as f64);
                }
            }
        }
        Ok(())
    }

    fn vary(&mut self, sweep: &Sweep, file: &mut SweepFile) -> Result<(), ConfigError> {
        if let Some(mut path) = sweep.posterior_file() {
            self.name("vary.twin".into(), "vary.twin".into(), &mut path).map_err(|e| {
                e.hint("`gripgen diagnose ... -o twin.toml` and `gripgen calibrate pulls ... -o twin.toml` write twin.posterior.csv beside the twin")
            })?;
            file.vary.insert("twin".into(), Distribution::Posterior { file: Some(path) }.to_toml());
        }
        for varied in sweep.vary.iter().filter(|v| is_file_key(&v.key)) {
            let mut paths = Vec::new();
            let mut varied = varied.clone();
            for (i, value) in sweep.representatives(&varied.key).into_iter().enumerate() {
                let Drawn::Text(path) = value else { continue };
                let mut path = path.clone();
                self.name(format!("vary.{}[{i}]", varied.key), varied.key.clone(), &mut path)?;
                paths.push(Drawn::Text(path));
            }
            varied.distribution = Distribution::Choice(paths);
            file.vary.insert(varied.key.clone(), varied.to_toml());
        }
        Ok(())
    }

    /// Reads the file at `path` and gives it its new path.
    fn name(&mut self, key: String, twin_key: String, path: &mut String) -> Result<(), ConfigError> {
        let new_path = match self.new_paths.get(path) {
            Some(known) => known.clone(),
            None => {
                let at = (self.locate)(path);
                let bytes = at.read().map_err(|e| {
                    let hint =
                        "paths are relative to the file that names them, those of --set to where you are; `asset:...` is inside gripgen";
                    ConfigError::new(&key, e.to_string()).hint(hint)
                })?;
                let new_path = match &at {
                    Location::Asset(name) => format!("{ASSET_PREFIX}{name}"),
                    Location::Disk(file) => input_path(file, &bytes),
                };
                self.files.insert(new_path.clone(), (at, bytes.into_owned()));
                self.new_paths.insert(path.clone(), new_path.clone());
                new_path
            }
        };
        path.clone_from(&new_path);
        self.named.push(Named { key, twin_key, path: new_path });
        Ok(())
    }
}

/// Where the copy of a file lies in a run folder.
fn input_path(file: &Path, bytes: &[u8]) -> String {
    let plain = |text: Option<&std::ffi::OsStr>| -> String {
        let text = text.map(|t| t.to_string_lossy().into_owned()).unwrap_or_default();
        text.chars()
            .map(|c| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' })
            .collect()
    };
    let hash = &sha256_hex(bytes)[..16];
    let stem = plain(file.file_stem());
    // A copy of a copy keeps its name.
    let stem = stem.strip_suffix(&format!("-{hash}")).unwrap_or(&stem);
    format!("inputs/{stem}-{hash}.{}", plain(file.extension()).to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_named_by_what_they_were_and_what_they_hold() {
        let name = input_path(Path::new("/a b/Übel teil.v2.STL"), b"x");
        assert_eq!(name, "inputs/_bel_teil_v2-2d711642b726b044.stl");
        assert_eq!(input_path(Path::new(&name), b"x"), name);
    }
}
