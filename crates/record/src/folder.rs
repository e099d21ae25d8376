//! A run folder: `run.json`, the shards with their sidecars, `index.csv`.
//!
//! A shard is done when its sidecar is there. The sidecar is written after the shard was renamed into place, so a run
//! killed at any moment leaves nothing that could be taken for finished, and running it again continues.

mod documents;
mod shards;
mod temporary;

pub use documents::{RUN_SCHEMA, RunInfo, SHARD_SCHEMA, Sidecar};
pub use shards::{PartialShard, ShardStart};

use crate::VERSION;
use crate::index::{csv_lines, index_header};
use documents::{check_same, json, parse};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use temporary::{Temporary, remove_left_over};

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// The file system.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A JSON file is damaged, or its numbers do not fit together.
    #[error("{path}: {problem}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The folder belongs to another run.
    #[error("{path} holds another run: {what} is {found}, this run has {wanted}")]
    AnotherRun {
        /// The folder.
        path: PathBuf,
        /// What differs.
        what: &'static str,
        /// Value in the folder.
        found: String,
        /// Value of this run.
        wanted: String,
    },
    /// A file in which a version of gripgen wrote what this one does not read.
    #[error("{path}: {problem}; gripgen {maker} made it, this is gripgen {VERSION}")]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// What is not read.
        problem: String,
        /// The version that made it.
        maker: String,
    },
    /// A shard that another version made than the rest of the run.
    #[error("{path}: `gripgen_version` is {found}, the run.json of its folder says {wanted}")]
    Mixed {
        /// The sidecar of the shard.
        path: PathBuf,
        /// Version in the sidecar.
        found: String,
        /// Version of the run.
        wanted: String,
    },
    /// A URL where a folder is wanted.
    #[error("{path} is a URL, and a run is written into a folder")]
    Url {
        /// The URL.
        path: PathBuf,
    },
    /// Neither empty nor a run folder.
    #[error("{path} is not empty and holds no run (no run.json, but {example})")]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One thing found in it.
        example: String,
    },
}

impl FolderError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            FolderError::OtherVersion { .. } => {
                Some("read it with the gripgen that made it, or a later one; nothing was touched")
            }
            FolderError::Mixed { .. } => Some(
                "move the shard and its sidecar out of the folder; the gripgen that made the run makes them again",
            ),
            FolderError::Url { .. } => Some(
                "sweep into a folder and copy it when it is done; `gripgen.ray.sweep` of the Python package writes to a URL",
            ),
            _ => None,
        }
    }
}

/// Whether a path is a URL, such as `s3://bucket/run`: taken for a path it would be a folder named `s3:`.
pub fn is_url(path: &Path) -> bool {
    let text = path.to_string_lossy();
    text.split_once("://").is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+.-".contains(c))
    })
}

/// A run folder on disk.
#[derive(Debug, Clone)]
pub struct RunFolder {
    path: PathBuf,
    info: RunInfo,
}

impl RunFolder {
    /// Opens the folder of a run, or makes it. A folder that holds something else is left untouched.
    ///
    /// `inputs` are name and content of the files that the run depends on and that gripgen does not hold itself;
    /// copies of them go into the folder, so that it can be read and repeated anywhere. A run that is there already
    /// keeps its name.
    ///
    /// # Errors
    ///
    /// A URL, a folder that cannot be written, that holds another run, or that holds something else.
    pub fn create(path: &Path, info: RunInfo, inputs: &[(&str, &[u8])]) -> Result<Self, FolderError> {
        if is_url(path) {
            return Err(FolderError::Url { path: path.into() });
        }
        let at = io_at(path);
        if let Some(found) = Self::open_same(path, &info)? {
            remove_left_over(path);
            return Ok(found);
        }
        match std::fs::read_dir(path) {
            Ok(entries) => {
                for entry in entries {
                    let example = entry.map_err(&at)?.file_name().to_string_lossy().into_owned();
                    // What a run killed before it wrote its run.json leaves behind.
                    if example.ends_with(".partial") || example == "inputs" {
                        continue;
                    }
                    // Another process may have begun the same run since its run.json was looked for.
                    let begun = Self::open_same(path, &info)?;
                    return begun.ok_or_else(|| FolderError::Foreign { path: path.into(), example });
                }
            }
            Err(e) if e.kind() == ErrorKind::NotFound => std::fs::create_dir_all(path).map_err(&at)?,
            Err(e) => return Err(at(e)),
        }
        remove_left_over(path);
        let folder = Self { path: path.into(), info };
        if !inputs.is_empty() {
            std::fs::create_dir_all(path.join("inputs")).map_err(&at)?;
        }
        for (name, bytes) in inputs {
            folder.publish(name, bytes)?;
        }
        // Another process may do the same at this moment: the first run.json stands, and counts for both.
        if folder.publish_new("run.json", &json(&folder.info))? {
            return Ok(folder);
        }
        Self::open_same(path, &folder.info)?.ok_or_else(|| io_at(path)(ErrorKind::NotFound.into()))
    }

    /// The run that is there, if it is this one; `None` if there is none.
    fn open_same(path: &Path, info: &RunInfo) -> Result<Option<Self>, FolderError> {
        match Self::open(path) {
            Ok(folder) => check_same(path, &folder.info, info).map(|()| Some(folder)),
            Err(FolderError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Opens a run folder for reading.
    ///
    /// # Errors
    ///
    /// A folder without a `run.json` that is read.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let file = path.join("run.json");
        let bytes = std::fs::read(&file).map_err(io_at(&file))?;
        Ok(Self { path: path.into(), info: parse(&file, &bytes)? })
    }

    /// What the folder is.
    pub fn info(&self) -> &RunInfo {
        &self.info
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file of a shard.
    pub fn shard_path(&self, shard: u64) -> PathBuf {
        self.path.join(format!("shard-{shard:05}.mcap"))
    }

    /// The sidecar of a shard.
    pub fn sidecar_path(&self, shard: u64) -> PathBuf {
        self.path.join(format!("shard-{shard:05}.json"))
    }

    /// Writes `index.csv` if every shard is done; returns whether it did.
    ///
    /// # Errors
    ///
    /// A shard or sidecar that cannot be read, or a file that cannot be written.
    pub fn write_index(&self) -> Result<bool, FolderError> {
        if (0..self.info.shards).any(|shard| !self.sidecar_path(shard).exists()) {
            return Ok(false);
        }
        let temporary = Temporary::new(&self.path, "index.csv")?;
        let at = io_at(&temporary.path);
        let mut out = std::io::BufWriter::new(&temporary.file);
        out.write_all(&csv_lines([&index_header(&self.info.extra_columns)])).map_err(&at)?;
        for shard in 0..self.info.shards {
            let Some(sidecar) = self.finished(shard)? else {
                drop(out);
                temporary.give_up()?;
                return Ok(false);
            };
            out.write_all(&csv_lines(&sidecar.rows)).map_err(&at)?;
        }
        let file = out.into_inner().map_err(|e| at(e.into_error()))?;
        file.sync_all().map_err(&at)?;
        std::fs::rename(&temporary.path, self.path.join("index.csv")).map_err(&at)?;
        Ok(true)
    }

    /// Writes a file at once: under a temporary name first, then renamed.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn publish(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let temporary = self.written(name, bytes)?;
        std::fs::rename(&temporary.path, self.path.join(name)).map_err(io_at(&temporary.path))
    }

    /// The same for a file that nobody may have written before; returns whether it was ours that was first.
    fn publish_new(&self, name: &str, bytes: &[u8]) -> Result<bool, FolderError> {
        let temporary = self.written(name, bytes)?;
        let linked = std::fs::hard_link(&temporary.path, self.path.join(name));
        match linked {
            Ok(()) => {}
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                temporary.give_up()?;
                return Ok(false);
            }
            // A file system without hard links.
            Err(_) => {
                return std::fs::rename(&temporary.path, self.path.join(name))
                    .map_err(io_at(&temporary.path))
                    .map(|()| true);
            }
        }
        temporary.give_up()?;
        Ok(true)
    }

    /// A temporary file with this content.
    fn written(&self, name: &str, bytes: &[u8]) -> Result<Temporary, FolderError> {
        let temporary = Temporary::new(&self.path, name)?;
        let write = || {
            (&temporary.file).write_all(bytes)?;
            temporary.file.sync_all()
        };
        write().map_err(|e| {
            // A disk that is full gets its room back.
            let _ = temporary.give_up();
            io_at(&temporary.path)(e)
        })?;
        Ok(temporary)
    }
}

/// SHA-256 and size of a file.
///
/// # Errors
///
/// A file that cannot be read.
pub fn hash_file(path: &Path) -> Result<(String, u64), FolderError> {
    let at = io_at(path);
    let mut file = File::open(path).map_err(&at)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 20];
    let mut size = 0;
    loop {
        let n = file.read(&mut buffer).map_err(&at)?;
        if n == 0 {
            return Ok((hex(&hasher.finalize()), size));
        }
        size += n as u64;
        hasher.update(&buffer[..n]);
    }
}

/// SHA-256 of bytes, in hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

fn io_at(path: &Path) -> impl Fn(std::io::Error) -> FolderError + use<> {
    let path = path.to_path_buf();
    move |source| FolderError::Io { path: path.clone(), source }
}
