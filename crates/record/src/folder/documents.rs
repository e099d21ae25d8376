//! The JSON files of a run folder: `run.json` and the sidecars. Fields that this version does not know are passed over.

use super::FolderError;
use crate::VERSION;
use crate::index::{INDEX_COLUMNS, from_first_layout, status_name};
use crate::proto::gripgen_v1::Status;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of `run.json`.
pub const RUN_SCHEMA: &str = "gripgen.run/1";
/// Format of a sidecar.
pub const SHARD_SCHEMA: &str = "gripgen.shard/1";

/// `run.json`: what a folder is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// The adapter that made the images, where it was not the processor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gpu_adapter: Option<String>,
}

/// The file beside a finished shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

pub(super) fn json<T: Serialize>(value: &T) -> Vec<u8> {
    let mut text = serde_json::to_vec_pretty(value).expect("these structs have no maps with odd keys");
    text.push(b'\n');
    text
}

/// What every version writes into these files.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Heading {
    schema: String,
    gripgen_version: String,
    config_sha256: String,
}

impl Heading {
    fn of(bytes: &[u8]) -> Self {
        serde_json::from_slice(bytes).unwrap_or_default()
    }

    /// Refuses another schema of the same name.
    fn check(&self, path: &Path, wanted: &str) -> Result<(), FolderError> {
        let name = |schema: &str| schema.split('/').next().map(String::from);
        if self.schema != wanted && name(&self.schema) == name(wanted) {
            return Err(self.not_read(path, format!("its schema is `{}`, `{wanted}` is read", self.schema)));
        }
        Ok(())
    }

    fn not_read(&self, path: &Path, problem: String) -> FolderError {
        FolderError::OtherVersion { path: path.into(), problem, maker: self.gripgen_version.clone() }
    }
}

/// The sidecar of a shard of a run, from its bytes; `None` if it is damaged or that of another run. One that another version made is
/// never taken for damaged.
pub(super) fn parse_sidecar(
    path: &Path,
    bytes: &[u8],
    run: &RunInfo,
) -> Result<Option<Sidecar>, FolderError> {
    let heading = Heading::of(bytes);
    heading.check(path, SHARD_SCHEMA)?;
    if heading.schema != SHARD_SCHEMA || heading.config_sha256 != run.config_sha256 {
        return Ok(None);
    }
    let (found, wanted) = (heading.gripgen_version.clone(), run.gripgen_version.clone());
    if found != wanted {
        return Err(FolderError::Mixed { path: path.into(), found, wanted });
    }
    let columns = INDEX_COLUMNS.len() + run.extra_columns.len();
    match serde_json::from_slice::<Sidecar>(bytes) {
        // What this version wrote and cannot be read is damaged, and made again.
        Err(_) if heading.gripgen_version == VERSION => Ok(None),
        Err(e) => Err(heading.not_read(path, e.to_string())),
        Ok(mut sidecar) => {
            from_first_layout(&mut sidecar.rows, columns);
            // A whole sidecar with other columns is finished work of another build.
            match sidecar.rows.iter().find(|row| row.len() != columns) {
                None => Ok(Some(sidecar)),
                Some(row) => {
                    let problem = format!("its rows have {} cells, {columns} are known", row.len());
                    Err(heading.not_read(path, problem))
                }
            }
        }
    }
}

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<RunInfo, FolderError> {
    let invalid = |problem: String| Err(FolderError::Invalid { path: path.into(), problem });
    let heading = Heading::of(bytes);
    heading.check(path, RUN_SCHEMA)?;
    let info: RunInfo = match serde_json::from_slice(bytes) {
        Ok(info) => info,
        Err(e) => return invalid(e.to_string()),
    };
    if info.schema != RUN_SCHEMA {
        return invalid(format!("its schema is `{}`, `{RUN_SCHEMA}` is read", info.schema));
    }
    if info.shard_samples == 0 || info.shards != info.samples.div_ceil(info.shard_samples) {
        let (samples, size, shards) = (info.samples, info.shard_samples, info.shards);
        return invalid(format!("{samples} samples in shards of {size} do not make {shards} shards"));
    }
    Ok(info)
}

pub(super) fn check_same(path: &Path, found: &RunInfo, wanted: &RunInfo) -> Result<(), FolderError> {
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
