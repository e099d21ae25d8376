//! A run folder: `run.json`, the shards with their sidecars, `index.csv`.
//!
//! A shard is done when its sidecar is there. The sidecar is written after the shard was renamed into place, so a run
//! killed at any moment leaves nothing that could be taken for finished, and running it again continues.

use crate::index::{INDEX_COLUMNS, csv_lines, index_header, status_name};
use crate::proto::gripgen_v1::Status;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{File, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// Format of `run.json`.
pub const RUN_SCHEMA: &str = "gripgen.run/1";
/// Format of a sidecar.
pub const SHARD_SCHEMA: &str = "gripgen.shard/1";

/// `run.json`: what a folder is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunInfo {
    /// [`RUN_SCHEMA`].
    pub schema: String,
    /// Version of gripgen that made it.
    pub gripgen_version: String,
    /// Name of the run.
    pub name: String,
    /// `sim` or `rig`.
    pub source: String,
    /// Hash of everything the samples depend on.
    pub config_sha256: String,
    /// Number of samples.
    pub samples: u64,
    /// Samples in a shard.
    pub shard_samples: u64,
    /// Number of shards.
    pub shards: u64,
    /// Columns of the index beside the fixed ones.
    pub extra_columns: Vec<String>,
    /// SHA-256 of meshes and sensor files by their path in the resolved configuration.
    pub files_sha256: std::collections::BTreeMap<String, String>,
    /// The resolved configuration.
    pub config_toml: String,
}

/// The file beside a finished shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// [`SHARD_SCHEMA`].
    pub schema: String,
    /// Version of gripgen that made it.
    pub gripgen_version: String,
    /// Hash of the run's configuration.
    pub config_sha256: String,
    /// Number of the shard.
    pub shard: u64,
    /// Global index of its first sample.
    pub first_sample: u64,
    /// Number of samples.
    pub samples: u64,
    /// Samples that failed.
    pub failed: u64,
    /// Size of the shard.
    pub bytes: u64,
    /// SHA-256 of the shard.
    pub sha256: String,
    /// The rows of the index.
    pub rows: Vec<Vec<String>>,
}

impl Sidecar {
    /// How many of its samples ended like this.
    pub fn rows_with_status(&self, status: Status) -> u64 {
        let column = INDEX_COLUMNS.iter().position(|c| *c == "status").expect("a fixed column");
        self.rows.iter().filter(|row| row[column] == status_name(status)).count() as u64
    }
}

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
    /// A JSON file is damaged.
    #[error("{path}: {source}")]
    Json {
        /// The file.
        path: PathBuf,
        /// What the parser says.
        source: serde_json::Error,
    },
    /// The numbers of a `run.json` do not fit together.
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
    /// Neither empty nor a run folder.
    #[error("{path} is not empty and holds no run (no run.json, but {example})")]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One thing found in it.
        example: String,
    },
}

/// A run folder on disk.
#[derive(Debug, Clone)]
pub struct RunFolder {
    path: PathBuf,
    info: RunInfo,
}

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
    pub fn duplicate(&self) -> Result<File, FolderError> {
        self.file.try_clone().map_err(io_at(&self.path))
    }

    /// An error about this file.
    pub fn error(&self, source: std::io::Error) -> FolderError {
        FolderError::Io { path: self.path.clone(), source }
    }
}

impl RunFolder {
    /// Opens the folder of a run, or makes it. A folder that holds something else is left untouched.
    ///
    /// `inputs` are name and content of the files that the run depends on and that gripgen does not hold itself;
    /// copies of them go into the folder, so that it can be read and repeated anywhere. A run that is there already
    /// keeps its name.
    pub fn create(path: &Path, info: RunInfo, inputs: &[(&str, &[u8])]) -> Result<Self, FolderError> {
        let at = io_at(path);
        if let Some(found) = Self::open_same(path, &info)? {
            return Ok(found);
        }
        match std::fs::read_dir(path) {
            Ok(entries) => {
                for entry in entries {
                    let example = entry.map_err(&at)?.file_name().to_string_lossy().into_owned();
                    // What a run killed before it wrote its run.json leaves behind.
                    if !example.ends_with(".partial") && example != "inputs" {
                        return Err(FolderError::Foreign { path: path.into(), example });
                    }
                }
            }
            Err(e) if e.kind() == ErrorKind::NotFound => std::fs::create_dir_all(path).map_err(&at)?,
            Err(e) => return Err(at(e)),
        }
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

    /// The sidecar of a shard; `None` if the shard is not done: no sidecar, a damaged one, or a shard of another
    /// size than it says.
    pub fn finished(&self, shard: u64) -> Result<Option<Sidecar>, FolderError> {
        let path = self.sidecar_path(shard);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(io_at(&path)(e)),
        };
        let Ok(sidecar) = serde_json::from_slice::<Sidecar>(&bytes) else { return Ok(None) };
        let size = std::fs::metadata(self.shard_path(shard)).map_or(0, |m| m.len());
        let columns = INDEX_COLUMNS.len() + self.info.extra_columns.len();
        let same = sidecar.config_sha256 == self.info.config_sha256
            && sidecar.shard == shard
            && sidecar.bytes == size
            && sidecar.samples == sidecar.rows.len() as u64
            && sidecar.rows.iter().all(|row| row.len() == columns);
        Ok(same.then_some(sidecar))
    }

    /// Starts a shard, unless another process is writing it or has finished it since it was looked for.
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
            if let Some(sidecar) = self.finished(shard)? {
                std::fs::remove_file(&path).map_err(&at)?;
                return Ok(ShardStart::Done(sidecar));
            }
            file.set_len(0).map_err(&at)?;
            return Ok(ShardStart::Begun(PartialShard { file, path }));
        }
    }

    /// Publishes a written shard: sync, rename, then the sidecar.
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

    /// Writes `index.csv` if every shard is done; returns whether it did.
    pub fn write_index(&self) -> Result<bool, FolderError> {
        if (0..self.info.shards).any(|shard| !self.sidecar_path(shard).exists()) {
            return Ok(false);
        }
        let temporary = self.temporary("index.csv");
        let at = io_at(&temporary);
        let mut out = std::io::BufWriter::new(File::create(&temporary).map_err(&at)?);
        out.write_all(&csv_lines([&index_header(&self.info.extra_columns)])).map_err(&at)?;
        for shard in 0..self.info.shards {
            let Some(sidecar) = self.finished(shard)? else {
                drop(out);
                std::fs::remove_file(&temporary).map_err(&at)?;
                return Ok(false);
            };
            out.write_all(&csv_lines(&sidecar.rows)).map_err(&at)?;
        }
        let file = out.into_inner().map_err(|e| at(e.into_error()))?;
        file.sync_all().map_err(&at)?;
        std::fs::rename(&temporary, self.path.join("index.csv")).map_err(&at)?;
        Ok(true)
    }

    /// Writes a file at once: under a temporary name first, then renamed.
    pub fn publish(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let temporary = self.written(name, bytes)?;
        std::fs::rename(&temporary, self.path.join(name)).map_err(io_at(&temporary))
    }

    /// The same for a file that nobody may have written before; returns whether it was ours that was first.
    fn publish_new(&self, name: &str, bytes: &[u8]) -> Result<bool, FolderError> {
        let temporary = self.written(name, bytes)?;
        let linked = std::fs::hard_link(&temporary, self.path.join(name));
        match linked {
            Ok(()) => {}
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                std::fs::remove_file(&temporary).map_err(io_at(&temporary))?;
                return Ok(false);
            }
            // A file system without hard links.
            Err(_) => {
                return std::fs::rename(&temporary, self.path.join(name))
                    .map_err(io_at(&temporary))
                    .map(|()| true);
            }
        }
        std::fs::remove_file(&temporary).map_err(io_at(&temporary))?;
        Ok(true)
    }

    /// A temporary file with this content.
    fn written(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, FolderError> {
        let temporary = self.temporary(name);
        let at = io_at(&temporary);
        let mut file = File::create(&temporary).map_err(&at)?;
        file.write_all(bytes).map_err(&at)?;
        file.sync_all().map_err(&at)?;
        Ok(temporary)
    }

    /// A name that no other process uses: process numbers repeat across machines and containers.
    fn temporary(&self, name: &str) -> PathBuf {
        let random = RandomState::new().hash_one(std::process::id());
        self.path.join(format!("{name}.{random:016x}.partial"))
    }
}

/// Whether an open file is still the one at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> std::io::Result<bool> {
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
fn is_at(_file: &File, path: &Path) -> std::io::Result<bool> {
    path.try_exists()
}

/// SHA-256 and size of a file.
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

fn json<T: Serialize>(value: &T) -> Vec<u8> {
    let mut text = serde_json::to_vec_pretty(value).expect("these structs have no maps with odd keys");
    text.push(b'\n');
    text
}

fn parse(path: &Path, bytes: &[u8]) -> Result<RunInfo, FolderError> {
    let info: RunInfo =
        serde_json::from_slice(bytes).map_err(|source| FolderError::Json { path: path.into(), source })?;
    let invalid = |problem: String| Err(FolderError::Invalid { path: path.into(), problem });
    if info.schema != RUN_SCHEMA {
        return invalid(format!("its schema is `{}`, this gripgen reads `{RUN_SCHEMA}`", info.schema));
    }
    if info.shard_samples == 0 || info.shards != info.samples.div_ceil(info.shard_samples) {
        let (samples, size, shards) = (info.samples, info.shard_samples, info.shards);
        return invalid(format!("{samples} samples in shards of {size} do not make {shards} shards"));
    }
    Ok(info)
}

fn check_same(path: &Path, found: &RunInfo, wanted: &RunInfo) -> Result<(), FolderError> {
    for (what, a, b) in [
        ("gripgen_version", &found.gripgen_version, &wanted.gripgen_version),
        ("config_sha256", &found.config_sha256, &wanted.config_sha256),
    ] {
        if a != b {
            return Err(FolderError::AnotherRun {
                path: path.into(),
                what,
                found: a.clone(),
                wanted: b.clone(),
            });
        }
    }
    Ok(())
}
