//! Shards under way: who writes which, and when one is done.

use super::documents::{SHARD_SCHEMA, Sidecar, json, parse_sidecar};
use super::{FolderError, RunFolder, hash_file, io_at};
use crate::shard::ShardError;
use mcap::McapError;
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A shard under way: `shard-00000.mcap.partial`, locked against other processes.
pub struct PartialShard {
    /// The locked file, empty at first.
    file: File,
    path: PathBuf,
}

/// What became of starting a shard.
pub enum ShardStart {
    /// It is ours to write.
    Begun(PartialShard),
    /// Another process is writing it right now.
    Busy,
    /// Another process has finished it.
    Done(Sidecar),
}

impl PartialShard {
    /// A second handle of the file, for a writer that wants to own one; the lock stays with this one.
    ///
    /// # Errors
    ///
    /// What the system says of the file.
    pub fn duplicate(&self) -> Result<File, FolderError> {
        self.file.try_clone().map_err(io_at(&self.path))
    }

    /// What went wrong while this file was written. Where the system said it, the file is named.
    pub fn blame<E: From<FolderError> + From<ShardError>>(&self, e: ShardError) -> E {
        match e {
            ShardError::Mcap(McapError::Io(source)) => self.error(source).into(),
            other => other.into(),
        }
    }

    /// Removes the file; nothing in it is of use.
    ///
    /// # Errors
    ///
    /// What the system says of the file.
    pub fn give_up(self) -> Result<(), FolderError> {
        std::fs::remove_file(&self.path).map_err(io_at(&self.path))
    }

    /// An error about this file.
    pub fn error(&self, source: std::io::Error) -> FolderError {
        FolderError::Io { path: self.path.clone(), source }
    }
}

impl RunFolder {
    /// The sidecar of a shard; `None` if the shard is not done: no sidecar, a damaged one, or a shard of another
    /// size than it says.
    ///
    /// # Errors
    ///
    /// A sidecar that is there and cannot be read, or that another version of gripgen made: what this one does not know is not undone.
    pub fn finished(&self, shard: u64) -> Result<Option<Sidecar>, FolderError> {
        let path = self.sidecar_path(shard);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(io_at(&path)(e)),
        };
        let Some(sidecar) = parse_sidecar(&path, &bytes, &self.info)? else { return Ok(None) };
        let size = std::fs::metadata(self.shard_path(shard)).map_or(0, |m| m.len());
        let same =
            sidecar.shard == shard && sidecar.bytes == size && sidecar.samples == sidecar.rows.len() as u64;
        Ok(same.then_some(sidecar))
    }

    /// Starts a shard, unless another process is writing it or has finished it since it was looked for.
    ///
    /// # Errors
    ///
    /// A file that cannot be made or locked, and a sidecar as in [`Self::finished`].
    pub fn start_shard(&self, shard: u64) -> Result<ShardStart, FolderError> {
        let path = self.path.join(format!("shard-{shard:05}.mcap.partial"));
        let at = io_at(&path);
        loop {
            let file = File::options()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .map_err(&at)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(ShardStart::Busy),
                Err(TryLockError::Error(e)) => return Err(at(e)),
            }
            // Between opening and locking, its writer may have renamed the file into place.
            if !is_at(&file, &path).map_err(&at)? {
                continue;
            }
            // Its writer keeps the lock over the rename until the sidecar is out: a shard that is there without one
            // is either just being published, or was left by a process that died in between.
            let publishing = self.is_being_published(shard)?;
            if let Some(sidecar) = self.finished(shard)? {
                std::fs::remove_file(&path).map_err(&at)?;
                return Ok(ShardStart::Done(sidecar));
            }
            if publishing {
                std::fs::remove_file(&path).map_err(&at)?;
                return Ok(ShardStart::Busy);
            }
            file.set_len(0).map_err(&at)?;
            return Ok(ShardStart::Begun(PartialShard { file, path }));
        }
    }

    /// Whether a process holds the lock of a shard that has its final name already.
    fn is_being_published(&self, shard: u64) -> Result<bool, FolderError> {
        let path = self.shard_path(shard);
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
            Err(e) => return Err(io_at(&path)(e)),
        };
        match file.try_lock_shared() {
            Ok(()) => Ok(false),
            Err(TryLockError::WouldBlock) => Ok(true),
            Err(TryLockError::Error(e)) => Err(io_at(&path)(e)),
        }
    }

    /// Publishes a written shard: sync, rename, then the sidecar.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, renamed or written.
    #[expect(clippy::needless_pass_by_value, reason = "the lock ends with the partial shard")]
    pub fn finish_shard(
        &self,
        shard: u64,
        first_sample: u64,
        partial: PartialShard,
        failed: u64,
        rows: Vec<Vec<String>>,
    ) -> Result<Sidecar, FolderError> {
        let at = io_at(&partial.path);
        partial.file.sync_all().map_err(&at)?;
        let (sha256, bytes) = hash_file(&partial.path)?;
        let path = self.shard_path(shard);
        std::fs::rename(&partial.path, &path).map_err(&at)?;
        let sidecar = Sidecar {
            schema: SHARD_SCHEMA.into(),
            gripgen_version: self.info.gripgen_version.clone(),
            config_sha256: self.info.config_sha256.clone(),
            shard,
            first_sample,
            samples: rows.len() as u64,
            failed,
            bytes,
            sha256,
            rows,
        };
        self.publish(&format!("shard-{shard:05}.json"), &json(&sidecar))?;
        Ok(sidecar)
    }
}

/// Whether an open file is still the one at `path`.
#[cfg(unix)]
pub(super) fn is_at(file: &File, path: &Path) -> std::io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match std::fs::metadata(path) {
        Ok(there) => Ok((open.dev(), open.ino()) == (there.dev(), there.ino())),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e),
    }
}

/// Elsewhere an open file cannot be renamed, so it is where it was.
#[cfg(not(unix))]
pub(super) fn is_at(_file: &File, path: &Path) -> std::io::Result<bool> {
    path.try_exists()
}

#[cfg(test)]
mod tests {
    use super::super::{RUN_SCHEMA, RunInfo};
    use super::*;

    fn folder(path: &Path) -> RunFolder {
        let info = RunInfo {
            schema: RUN_SCHEMA.into(),
            gripgen_version: "0".into(),
            name: "run".into(),
            source: "sim".into(),
            config_sha256: "0".repeat(64),
            samples: 1,
            shard_samples: 1,
            shards: 1,
            extra_columns: Vec::new(),
            files_sha256: std::collections::BTreeMap::new(),
            config_toml: String::new(),
            gpu_adapter: None,
        };
        RunFolder::create(path, info, &[]).unwrap()
    }

    fn begun(folder: &RunFolder) -> PartialShard {
        match folder.start_shard(0).unwrap() {
            ShardStart::Begun(partial) => partial,
            ShardStart::Busy => panic!("busy"),
            ShardStart::Done(_) => panic!("done"),
        }
    }

    /// Two commands that begin the same run at once both get it: what one of them made since the other looked is not foreign.
    #[test]
    fn a_run_that_many_begin_at_once_is_that_of_all() {
        let temporary = tempfile::tempdir().unwrap();
        for round in 0..200 {
            let path = temporary.path().join(round.to_string());
            let gate = std::sync::Barrier::new(4);
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| {
                        gate.wait();
                        folder(&path);
                    });
                }
            });
        }
    }

    /// Between the rename and the sidecar the shard has no partial name and is not done: it is still its writer's.
    #[test]
    fn a_shard_being_published_is_busy() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = folder(temporary.path());
        let partial = begun(&folder);
        assert!(matches!(folder.start_shard(0).unwrap(), ShardStart::Busy), "being written");
        std::fs::rename(&partial.path, folder.shard_path(0)).unwrap();
        assert!(matches!(folder.start_shard(0).unwrap(), ShardStart::Busy), "being published");
        assert!(!partial.path.exists(), "nothing is left of the attempt");
        drop(partial);
        // Its writer died there: the next one makes it again.
        let partial = begun(&folder);
        folder.finish_shard(0, 0, partial, 0, Vec::new()).unwrap();
        assert!(matches!(folder.start_shard(0).unwrap(), ShardStart::Done(_)), "done");
    }
}
