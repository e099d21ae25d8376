//! The one way in which a verb writes files.
//!
//! No output replaces an existing file unless `--force` is given, and none is ever written onto an input or into a run's
//! own files. A verb names its inputs and its outputs before it begins, so a refusal (exit code 2) comes before any work.

mod inputs;
mod pending;

pub use pending::{Pending, PendingFolder};

use crate::failure::{Failure, no_room};
use gripgen::record::is_url;
use gripgen::twin::Posterior;
use gripgen_report::CONTACT_SHEET;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The inputs and outputs of a command.
#[derive(Debug, Clone)]
pub struct Outputs {
    force: bool,
    inputs: Vec<PathBuf>,
    runs: Vec<PathBuf>,
    planned: Vec<PathBuf>,
}

impl Outputs {
    /// No inputs and no outputs yet; `force` is the flag `--force`.
    pub fn new(force: bool) -> Self {
        Self { force, inputs: vec![], runs: vec![], planned: vec![] }
    }

    /// Adds an input: a file or folder.
    #[must_use]
    pub fn reads(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Adds several inputs.
    #[must_use]
    pub fn reads_all(mut self, paths: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        self.inputs.extend(paths.into_iter().map(Into::into));
        self
    }

    /// Adds a configuration (a path, or `asset:...`) with the files that it and its `--set` name.
    #[must_use]
    pub fn reads_config(mut self, path: &str, sets: &[(String, String)]) -> Self {
        self.inputs.extend(inputs::of_config(path, sets));
        self
    }

    /// Adds a folder that becomes a run.
    #[must_use]
    pub fn makes_run(mut self, folder: impl Into<PathBuf>) -> Self {
        let folder = folder.into();
        self.runs.push(real(&folder).unwrap_or(folder));
        self
    }

    /// Plans an output, or refuses it.
    pub fn allow(&mut self, path: &Path) -> Result<(), Failure> {
        not_a_url(path)?;
        if path.is_dir() {
            let folder = Failure::usage(format!("{}: this is a folder", path.display()));
            return Err(folder.hint("name a file in it"));
        }
        if is_special(path) {
            return Ok(());
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            let none = format!("{}: there is no folder {}", path.display(), folder.display());
            return Err(Failure::usage(none).hint("make it, or name a file in one that is there"));
        }
        let never = |what: &str| {
            let failure = Failure::usage(format!("{}: this file {what}", path.display()));
            Err(failure.hint("name another file; --force does not write there either"))
        };
        if self.inputs.iter().any(|input| inputs::holds(input, path)) {
            return never("is what the command reads");
        }
        if let Some(run) = self.run_of(path) {
            return never(&format!("belongs to the run in {}", run.display()));
        }
        self.plan(path)?;
        if !self.force && exists(path) {
            return Err(
                Failure::usage(format!("{}: this file exists", path.display())).hint("--force replaces it")
            );
        }
        // Whether a file can be written there at all.
        Pending::create(path, false).map(drop).map_err(|e| unwritable(path, &e).with_code(2))
    }

    /// Plans several outputs, or refuses them.
    pub fn allow_all<'a>(&mut self, paths: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
        paths.into_iter().try_for_each(|path| self.allow(path))
    }

    /// Plans a twin and the draws of its posterior.
    pub fn allow_twin(&mut self, twin: &Path) -> Result<(), Failure> {
        self.allow(twin)?;
        draws_of(twin).map_or(Ok(()), |draws| self.allow(&draws))
    }

    /// Plans a folder of files: a new or an empty one. `--force` does not replace what is in it.
    pub fn allow_new_folder(&mut self, folder: &Path) -> Result<(), Failure> {
        not_a_url(folder)?;
        let parent = folder_of(folder);
        if !parent.is_dir() {
            let none = format!("{}: there is no folder {}", folder.display(), parent.display());
            return Err(Failure::usage(none).hint("make it, or name a folder in one that is there"));
        }
        let taken = match std::fs::read_dir(folder) {
            Ok(mut entries) => entries.next().is_some(),
            Err(_) => exists(folder),
        };
        if taken {
            return Err(Failure::usage(format!("{}: this exists and is no empty folder", folder.display()))
                .hint("name a new folder; --force does not replace one"));
        }
        if let Some(run) = self.run_of(folder) {
            let owned = format!("{}: this belongs to the run in {}", folder.display(), run.display());
            return Err(Failure::usage(owned).hint("name another folder"));
        }
        self.plan(folder)
    }

    /// Adds a path to the outputs; two of them must not be one, and none lies in another.
    fn plan(&mut self, path: &Path) -> Result<(), Failure> {
        let place = real(path).unwrap_or_else(|| path.into());
        if self.planned.iter().any(|other| place.starts_with(other) || other.starts_with(&place)) {
            return Err(Failure::usage(format!("{}: two files would be one", path.display()))
                .hint("give every output a name of its own"));
        }
        self.planned.push(place);
        Ok(())
    }

    /// The run whose own file this is, or would be, whether links are followed or not.
    fn run_of(&self, path: &Path) -> Option<PathBuf> {
        let places = [real(path), std::path::absolute(path).ok()];
        places.iter().flatten().find_map(|place| {
            let (folder, name) = (place.parent()?, place.file_name()?.to_string_lossy());
            let is_run = |at: &Path| at.join("run.json").is_file() || self.runs.iter().any(|run| run == at);
            if is_run(folder) && is_own_name(&name) {
                return Some(folder.to_path_buf());
            }
            let above = folder.parent().filter(|above| folder.ends_with("inputs") && is_run(above));
            above.map(Path::to_path_buf)
        })
    }

    /// Writes an output under a temporary name and renames it.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let mut pending = self.begin(path)?;
        pending.file.write_all(bytes).map_err(|e| unwritable(path, &e))?;
        pending.publish().map(drop)
    }

    /// Writes a twin after the draws of its posterior. Without draws those of an earlier command go: they hold no longer.
    pub fn write_twin(&self, twin: &Path, text: &str, draws: Option<&Posterior>) -> Result<(), Failure> {
        if let Some(path) = draws_of(twin) {
            match draws {
                Some(draws) => self.write(&path, draws.to_csv().as_bytes())?,
                None => self.remove(&path).map(drop)?,
            }
        }
        self.write(twin, text.as_bytes())
    }

    /// Changes an input in its place.
    pub fn edit(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        Self { force: true, ..self.clone() }.write(path, bytes)
    }

    /// With `--force`, removes what stands under the name of an output that there is nothing to write into. Returns whether
    /// there was something.
    pub fn remove(&self, path: &Path) -> Result<bool, Failure> {
        let there = self.force && path.is_file();
        if there {
            std::fs::remove_file(path).map_err(|e| unwritable(path, &e))?;
        }
        Ok(there)
    }

    /// An output that is written piece by piece. It has its name when it is published.
    pub fn begin(&self, path: &Path) -> Result<Pending, Failure> {
        Pending::create(path, self.force).map_err(|e| unwritable(path, &e))
    }

    /// A folder that is filled under another name, and has its own when it is published.
    pub fn begin_folder(&self, folder: &Path) -> Result<PendingFolder, Failure> {
        PendingFolder::create(folder).map_err(|e| unwritable(folder, &e))
    }
}

/// Outputs are files.
fn not_a_url(path: &Path) -> Result<(), Failure> {
    match is_url(path) {
        true => Err(Failure::usage(format!("{}: this is a URL, and outputs are files", path.display()))
            .hint("write a file and copy it there")),
        false => Ok(()),
    }
}

/// Where the draws of a twin lie: beside it, if it is a file with the ending of one.
pub fn draws_of(twin: &Path) -> Option<PathBuf> {
    let name = twin.file_name()?.to_str().filter(|name| name.ends_with(".toml"))?;
    Some(twin.with_file_name(Posterior::name_beside(name)))
}

/// A terminal, a pipe, `/dev/null`, `/dev/stdout`: nothing is replaced there, and nothing may be renamed onto it.
pub fn is_special(path: &Path) -> bool {
    let device = path.starts_with("/dev");
    std::fs::metadata(path).is_ok_and(|found| !found.is_dir() && (device || !found.is_file()))
}

/// Names that a run's own files have in its folder.
fn is_own_name(name: &str) -> bool {
    let is = |start: &str, ends: &[&str]| {
        name.strip_prefix(start).is_some_and(|rest| ends.iter().any(|end| rest.ends_with(end)))
    };
    is("shard-", &[".mcap", ".json"])
        || is("rehearsal-", &[".json"])
        || ["run.json", "index.csv", CONTACT_SHEET].contains(&name)
        || name.ends_with(".partial")
}

/// A file that could not be written: path, cause, hint.
fn unwritable(path: &Path, e: &io::Error) -> Failure {
    let failure = Failure::new(format!("{}: {e}", path.display()));
    match e.kind() {
        _ if no_room(e) => failure.hint("make room, or name a file on another disk"),
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            failure.hint("name a file where you may write")
        }
        _ => failure,
    }
}

/// Whether there is something of this name; a link that leads nowhere too.
fn exists(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok()
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where a file is, or would be, without links.
fn real(path: &Path) -> Option<PathBuf> {
    let there = path.canonicalize().ok();
    there.or_else(|| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?)))
}

#[cfg(test)]
mod tests;
