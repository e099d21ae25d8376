//! Files and folders under temporary names, until they are finished.

use super::{Outputs, unwritable};
use crate::failure::Failure;
use crate::mark::{Format, marked};
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A folder under its temporary name; it is removed unless it is published.
#[derive(Debug)]
pub struct PendingFolder {
    pub(super) temporary: Option<PathBuf>,
    pub(super) folder: PathBuf,
}

impl PendingFolder {
    /// Where the files go.
    pub fn path(&self) -> &Path {
        self.temporary.as_deref().unwrap_or(&self.folder)
    }

    /// Gives one of its files the mark of a verb.
    pub fn mark(&self, name: &str, format: Format, verb: &str) -> Result<(), Failure> {
        let path = self.path().join(name);
        let failed = |e: io::Error| unwritable(&path, &e);
        let bytes = std::fs::read(&path).map_err(failed)?;
        std::fs::write(&path, marked(format, verb, &bytes, &[])).map_err(failed)
    }

    /// Gives the folder its name, if that is still free or an empty folder: renaming onto any other fails.
    pub fn publish(mut self) -> Result<(), Failure> {
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        std::fs::rename(&temporary, &self.folder).map_err(|e| {
            unwritable(&self.folder, &e).hint(format!("what was made is in {}", temporary.display()))
        })
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
    pub(super) path: PathBuf,
    pub(super) temporary: Option<PathBuf>,
}

impl Pending {
    /// Gives the file its name, if that is still free or may be replaced. Returns the open file.
    pub fn publish(mut self, outputs: &Outputs) -> Result<File, Failure> {
        if self.temporary.is_some() {
            outputs.judge(&self.path).map_err(|refused| self.kept(refused))?;
        }
        self.rename()
    }

    /// What was made stays under its temporary name, and the failure says so.
    fn kept(&mut self, failure: Failure) -> Failure {
        match self.temporary.take() {
            Some(temporary) => failure.hint(format!("what was made is in {}", temporary.display())),
            None => failure,
        }
    }

    pub(super) fn rename(mut self) -> Result<File, Failure> {
        let file = self.file.try_clone().map_err(|e| unwritable(&self.path, &e))?;
        let Some(temporary) = &self.temporary else { return Ok(file) };
        file.sync_all().map_err(|e| unwritable(&self.path, &e))?;
        let renamed = match std::fs::symlink_metadata(&self.path) {
            Err(_) => publish_new(temporary, &self.path),
            Ok(_) => std::fs::rename(temporary, &self.path),
        };
        if let Err(e) = renamed {
            let failure = unwritable(&self.path, &e);
            return Err(self.kept(failure));
        }
        self.temporary = None;
        Ok(file)
    }
}

/// Gives a file a name that nobody may have taken in between.
fn publish_new(temporary: &Path, path: &Path) -> io::Result<()> {
    match std::fs::hard_link(temporary, path) {
        Ok(()) => std::fs::remove_file(temporary),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Err(e),
        // A file system without hard links.
        Err(_) => std::fs::rename(temporary, path),
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            let _ = std::fs::remove_file(temporary);
        }
    }
}
