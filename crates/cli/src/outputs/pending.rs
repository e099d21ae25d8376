//! Files and folders under temporary names, until they are finished.

use super::{exists, is_special, unwritable};
use crate::failure::Failure;
use std::collections::hash_map::RandomState;
use std::fs::File;
use std::hash::BuildHasher;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A folder under its temporary name; it is removed unless it is published.
#[derive(Debug)]
pub struct PendingFolder {
    temporary: Option<PathBuf>,
    folder: PathBuf,
}

impl PendingFolder {
    pub(super) fn create(folder: &Path) -> io::Result<Self> {
        let temporary = unused_name(folder);
        std::fs::create_dir(&temporary)?;
        Ok(Self { temporary: Some(temporary), folder: folder.into() })
    }

    /// Where the files go.
    pub fn path(&self) -> &Path {
        self.temporary.as_deref().unwrap_or(&self.folder)
    }

    /// Gives the folder its name, if that is still free or an empty folder: renaming onto any other fails.
    pub fn publish(mut self) -> Result<(), Failure> {
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        std::fs::rename(&temporary, &self.folder).map_err(|e| kept(&self.folder, &temporary, &e))
    }
}

impl Drop for PendingFolder {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            let _ = std::fs::remove_dir_all(temporary);
        }
    }
}

/// A file under its temporary name; it is removed unless it is published.
#[derive(Debug)]
pub struct Pending {
    /// Where the bytes go.
    pub file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
    replaces: bool,
}

impl Pending {
    pub(super) fn create(path: &Path, replaces: bool) -> io::Result<Self> {
        if is_special(path) {
            let file = File::options().write(true).open(path)?;
            return Ok(Self { file, path: path.into(), temporary: None, replaces });
        }
        // Through a link, the file that it leads to.
        let path = path.canonicalize().unwrap_or_else(|_| path.into());
        let temporary = unused_name(&path);
        let file = File::create_new(&temporary)?;
        Ok(Self { file, path, temporary: Some(temporary), replaces })
    }

    /// Gives the file its name, if that is still free or may be replaced. Returns the open file.
    pub fn publish(mut self) -> Result<File, Failure> {
        let failed = |e: io::Error| unwritable(&self.path, &e);
        let file = self.file.try_clone().map_err(failed)?;
        if let Some(temporary) = &self.temporary {
            file.sync_all().map_err(failed)?;
            let renamed = match self.replaces && exists(&self.path) {
                true => std::fs::rename(temporary, &self.path),
                false => publish_new(temporary, &self.path),
            };
            let failure = renamed.map_err(|e| kept(&self.path, temporary, &e));
            self.temporary = None;
            failure?;
        }
        Ok(file)
    }
}

/// What was made stays under its temporary name, and the failure says so.
fn kept(path: &Path, temporary: &Path, e: &io::Error) -> Failure {
    unwritable(path, e).hint(format!("what was made is in {}", temporary.display()))
}

/// Gives a file a name that must not have been taken in between.
fn publish_new(temporary: &Path, path: &Path) -> io::Result<()> {
    match std::fs::hard_link(temporary, path) {
        Ok(()) => std::fs::remove_file(temporary),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Err(e),
        // A file system without hard links.
        Err(_) => std::fs::rename(temporary, path),
    }
}

/// An unused name next to `path`.
fn unused_name(path: &Path) -> PathBuf {
    // Without a slash at its end, which a folder may have.
    let mut name = path.components().as_path().as_os_str().to_os_string();
    name.push(format!(".{:016x}.partial", RandomState::new().hash_one(std::process::id())));
    PathBuf::from(name)
}

impl Drop for Pending {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            let _ = std::fs::remove_file(temporary);
        }
    }
}
