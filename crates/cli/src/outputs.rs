//! The one way in which a verb writes files.
//!
//! Nothing is overwritten: a file that is there is replaced only if the same verb wrote it and nobody edited it since, or
//! if `--force` stands. What a command reads, and what belongs to a run or to measurements, is never written to. A verb says
//! what it reads and asks for each of its outputs before it begins; each is looked at once more when it is written.

mod named;
mod pending;

pub use pending::{Pending, PendingFolder};

use crate::failure::{Failure, no_room};
use crate::mark::{Format, Mark, mark_of, marked, short_hash};
use crate::own_files::{IMAGES_FOLDER, owner};
use gripgen_measured::{CAMPAIGN_FILE, PULLS_FILE, TRACES_FOLDER};
use std::collections::hash_map::RandomState;
use std::fs::File;
use std::hash::BuildHasher;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What a command reads, and what it may write.
#[derive(Debug, Clone)]
pub struct Outputs {
    verb: &'static str,
    force: bool,
    inputs: Vec<PathBuf>,
    runs: Vec<PathBuf>,
    planned: Vec<PathBuf>,
    /// Files without room for a mark, and the one that names them.
    bare: Vec<(PathBuf, PathBuf)>,
}

impl Outputs {
    /// The outputs of a verb, as it is typed after `gripgen`.
    pub fn of(verb: &'static str, force: bool) -> Self {
        Self { verb, force, inputs: vec![], runs: vec![], planned: vec![], bare: vec![] }
    }

    /// The verb.
    pub fn verb(&self) -> &'static str {
        self.verb
    }

    /// A file or folder that is read.
    #[must_use]
    pub fn reads(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Files or folders that are read.
    #[must_use]
    pub fn reads_all(mut self, paths: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        self.inputs.extend(paths.into_iter().map(Into::into));
        self
    }

    /// A configuration (a path, or `asset:...`) with the files that it and its `--set` name.
    #[must_use]
    pub fn reads_config(mut self, path: &str, sets: &[(String, String)]) -> Self {
        self.inputs.extend(named::files(path, sets));
        self
    }

    /// A folder that becomes a run.
    #[must_use]
    pub fn makes_run(mut self, folder: impl Into<PathBuf>) -> Self {
        let folder = folder.into();
        self.runs.push(real(&folder).unwrap_or(folder));
        self
    }

    /// Asks for a file, before the work.
    pub fn allow(&mut self, path: &Path) -> Result<(), Failure> {
        if path.is_dir() {
            let folder = Failure::usage(format!("{}: this is a folder", path.display()));
            return Err(folder.hint("name a file in it"));
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            let none = format!("{}: there is no folder {}", path.display(), folder.display());
            return Err(Failure::usage(none).hint("make it, or name a file in one that is there"));
        }
        let place = real(path).unwrap_or_else(|| path.into());
        if self.planned.contains(&place) && !is_special(path) {
            return Err(Failure::usage(format!("{}: two files would be one", path.display()))
                .hint("give every output a name of its own"));
        }
        self.judge(path)?;
        if !is_special(path) {
            let (probe, file) = temporary(path).map_err(|e| unwritable(path, &e).with_code(2))?;
            drop(file);
            std::fs::remove_file(probe).map_err(|e| unwritable(path, &e))?;
        }
        self.planned.push(place);
        Ok(())
    }

    /// Asks for each of several files, before the work.
    pub fn allow_all<'a>(&mut self, paths: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
        paths.into_iter().try_for_each(|path| self.allow(path))
    }

    /// Asks for a file without room for a mark: `with`, which is written too, tells whether it is ours.
    pub fn allow_beside(&mut self, path: &Path, with: &Path) -> Result<(), Failure> {
        self.bare.push((path.into(), with.into()));
        self.allow(path)
    }

    /// Whether a file may be written: what is wrong, if not.
    pub fn judge(&self, path: &Path) -> Result<(), Failure> {
        if is_special(path) {
            return Ok(());
        }
        let never = |what: &str| {
            let hint = "name another file; --force does not write there either. Nothing was touched";
            Err(Failure::usage(format!("{}: this file {what}", path.display())).hint(hint))
        };
        if self.inputs.iter().any(|input| same_file(input, path)) {
            return never("is what the command reads");
        }
        let runs: Vec<&Path> = self.runs.iter().map(PathBuf::as_path).collect();
        let places = [real(path), std::path::absolute(path).ok()];
        if let Some(owner) = places.iter().flatten().find_map(|place| owner(place, &runs)) {
            return never(&format!("belongs to {owner}"));
        }
        if self.force || std::fs::symlink_metadata(path).is_err() {
            return Ok(());
        }
        let verb = self.verb;
        let found = match mark_of(path) {
            Some(mark) if mark.verb == verb && mark.whole => return Ok(()),
            None if self.is_ours_beside(path) => return Ok(()),
            Some(Mark { verb, whole: false, .. }) => {
                format!("`gripgen {verb}` wrote it, and it was edited since")
            }
            Some(mark) => format!("`gripgen {}` wrote it, and this is `gripgen {verb}`", mark.verb),
            // Files to start from carry no mark: they are there to be edited.
            None if verb == "init" && path.extension().is_none_or(|end| end != "json") => {
                "what `gripgen init` writes carries no mark, so this may have been edited".into()
            }
            None => format!("`gripgen {verb}` did not write it"),
        };
        Err(Failure::usage(format!("{}: there is such a file: {found}", path.display()))
            .hint("name another file, or replace this one with --force. Nothing was touched"))
    }

    /// Whether the file that names this one says that it was written with it.
    fn is_ours_beside(&self, path: &Path) -> bool {
        let place = real(path);
        let Some((_, with)) = self.bare.iter().find(|(bare, _)| real(bare) == place) else { return false };
        let Some(mark) = mark_of(with).filter(|mark| mark.verb == self.verb && mark.whole) else {
            return false;
        };
        std::fs::read(path).is_ok_and(|bytes| mark.beside.contains(&short_hash(&bytes)))
    }

    /// Writes a file with its mark, under a temporary name first.
    pub fn write(&self, path: &Path, format: Format, bytes: &[u8]) -> Result<(), Failure> {
        self.write_with(path, format, bytes, &[])
    }

    /// The same with the hashes of files that were written beside it.
    pub fn write_with(
        &self,
        path: &Path,
        format: Format,
        bytes: &[u8],
        beside: &[String],
    ) -> Result<(), Failure> {
        let mut pending = self.begin(path)?;
        let bytes = marked(format, self.verb, bytes, beside);
        pending.file.write_all(&bytes).map_err(|e| unwritable(path, &e))?;
        pending.publish(self).map(drop)
    }

    /// Removes a file that this verb wrote and nobody edited; any other stays, whatever stands.
    pub fn remove_own(&self, path: &Path) -> Result<(), Failure> {
        let own = mark_of(path).is_some_and(|mark| mark.verb == self.verb && mark.whole);
        if own && self.judge(path).is_ok() {
            std::fs::remove_file(path).map_err(|e| unwritable(path, &e))?;
        }
        Ok(())
    }

    /// Removes a file without room for a mark that was written with another one, as that says.
    pub fn remove_beside(&self, path: &Path, with: &Path) -> Result<(), Failure> {
        let known = Self { bare: vec![(path.into(), with.into())], ..self.clone() };
        if path.is_file()
            && known.is_ours_beside(path)
            && self.inputs.iter().all(|input| !same_file(input, path))
        {
            std::fs::remove_file(path).map_err(|e| unwritable(path, &e))?;
        }
        Ok(())
    }

    /// Changes an input in its place, without a mark: a file of a person stays one.
    pub fn edit(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let mut pending = self.begin(path)?;
        pending.file.write_all(bytes).map_err(|e| unwritable(path, &e))?;
        pending.rename().map(drop)
    }

    /// Asks for a folder of measurements, before the work: a new one, or one without any. `--force` does not replace them.
    pub fn allow_measurements(&mut self, folder: &Path) -> Result<(), Failure> {
        let parts = [PULLS_FILE, CAMPAIGN_FILE, TRACES_FOLDER, IMAGES_FOLDER, "run.json"];
        if let Some(part) = parts.iter().find(|part| folder.join(part).exists()) {
            return Err(Failure::usage(format!(
                "{}: this folder holds measurements: {part}",
                folder.display()
            ))
            .hint("measurements are left alone; name a new folder"));
        }
        let place = real(folder).unwrap_or_else(|| folder.into());
        if self.planned.contains(&place.join(CAMPAIGN_FILE)) {
            return Err(Failure::usage(format!(
                "{}: two files would be one",
                folder.join(CAMPAIGN_FILE).display()
            ))
            .hint("give every output a name of its own"));
        }
        self.planned.extend([place.join(PULLS_FILE), place.join(CAMPAIGN_FILE)]);
        Ok(())
    }

    /// Asks for a folder of files, before the work: a new one, or an empty one. `--force` does not replace what is there.
    pub fn allow_new_folder(&mut self, folder: &Path) -> Result<(), Failure> {
        let parent = folder_of(folder);
        if !parent.is_dir() {
            let none = format!("{}: there is no folder {}", folder.display(), parent.display());
            return Err(Failure::usage(none).hint("make it, or name a folder in one that is there"));
        }
        let taken = match std::fs::read_dir(folder) {
            Ok(mut entries) => entries.next().is_some(),
            Err(_) => std::fs::symlink_metadata(folder).is_ok(),
        };
        if taken {
            let there = format!(
                "{}: there is something of this name, which is not an empty folder",
                folder.display()
            );
            return Err(Failure::usage(there)
                .hint("name a new folder; --force does not replace one. Nothing was touched"));
        }
        let place = real(folder).unwrap_or_else(|| folder.into());
        if let Some(owner) = owner(&place, &[]) {
            let owned = format!("{}: this belongs to {owner}", folder.display());
            return Err(Failure::usage(owned).hint("name another folder"));
        }
        self.planned.push(place);
        Ok(())
    }

    /// A folder that is filled under another name, and has its own when it is published.
    pub fn begin_folder(&self, folder: &Path) -> Result<PendingFolder, Failure> {
        let temporary = unused_name(folder);
        std::fs::create_dir(&temporary).map_err(|e| unwritable(folder, &e))?;
        Ok(PendingFolder { temporary: Some(temporary), folder: folder.into() })
    }

    /// A file that is written piece by piece. It has its name when it is published.
    pub fn begin(&self, path: &Path) -> Result<Pending, Failure> {
        if is_special(path) {
            let file = File::options().write(true).open(path).map_err(|e| unwritable(path, &e))?;
            return Ok(Pending { file, path: path.into(), temporary: None });
        }
        // Through a link, the file that it leads to.
        let place = path.canonicalize().unwrap_or_else(|_| path.into());
        let (temporary, file) = temporary(&place).map_err(|e| unwritable(path, &e))?;
        Ok(Pending { file, path: place, temporary: Some(temporary) })
    }
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

/// A new file beside `path`, of a name that nobody else uses.
fn temporary(path: &Path) -> io::Result<(PathBuf, File)> {
    let temporary = unused_name(path);
    let file = File::create_new(&temporary)?;
    Ok((temporary, file))
}

/// A name beside `path` that nobody else uses.
fn unused_name(path: &Path) -> PathBuf {
    // Without a slash at its end, which a folder may have.
    let mut name = path.components().as_path().as_os_str().to_os_string();
    name.push(format!(".{:016x}.partial", RandomState::new().hash_one(std::process::id())));
    PathBuf::from(name)
}

/// A terminal, a pipe, `/dev/null`, `/dev/stdout`: nothing is replaced there, and nothing may be renamed onto it.
fn is_special(path: &Path) -> bool {
    let device = path.starts_with("/dev");
    std::fs::metadata(path).is_ok_and(|found| !found.is_dir() && (device || !found.is_file()))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where a file is, or would be, without links.
fn real(path: &Path) -> Option<PathBuf> {
    let there = path.canonicalize().ok();
    there.or_else(|| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?)))
}

/// Whether two paths are one file, by links too; a folder is no file.
fn same_file(a: &Path, b: &Path) -> bool {
    let (Ok(one), Ok(other)) = (a.canonicalize(), b.canonicalize()) else { return false };
    one == other || same_inode(&one, &other)
}

#[cfg(unix)]
fn same_inode(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(one), Ok(other)) = (std::fs::metadata(a), std::fs::metadata(b)) else { return false };
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

/// A hard link is not seen; what is renamed onto one leaves the other name's content alone.
#[cfg(not(unix))]
fn same_inode(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests;
