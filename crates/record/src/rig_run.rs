//! A run of a rig: a campaign of measured pulls as a run folder, one shard a pull.
//!
//! A pull is done when its shard has a sidecar, as the shards of a sweep are. A campaign that was interrupted goes on with
//! [`missing_pulls`]; pulls that failed can be made again after [`discard_failed`].

mod film;
mod pull;
#[cfg(test)]
mod tests;

pub use film::{FrameView, RigFilm, RigFrame};
pub(crate) use film::{camera_image, stamp_of};
pub use pull::{RigPull, RigResult};

use crate::folder::{FolderError, RUN_SCHEMA, RunFolder, RunInfo, ShardStart, Sidecar, sha256_hex};
use crate::index::extra_columns;
use crate::proto::gripgen_v1::Status;
use crate::shard::{RIG_SOURCE, ShardError, ShardInfo, ShardWriter};
use gripgen_twin::config::{Feedback, ImageStorage};
use serde::Deserialize;
use std::io::{BufWriter, ErrorKind};
use std::path::{Path, PathBuf};

/// What a run of a rig is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RigRunInfo {
    /// Name of the run; no data depends on it.
    pub name: String,
    /// Version of gripgen.
    pub gripgen_version: String,
    /// Sections `[rig]` (addresses, limits, taught poses) and `[campaign]` (what holds for all pulls, and the pulls).
    pub config_toml: String,
    /// Pulls of the campaign.
    pub pulls: u64,
}

/// What the section `[campaign]` says of all measured pulls; other keys of it are left alone.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(default)]
pub struct RigCampaign {
    /// What the force loop closed on, where it is known.
    pub feedback: Option<Feedback>,
    /// Columns that vary or were really measured; all of them where the key is missing. Names that are no fixed column of
    /// the index get a column of their own there.
    pub recorded: Option<Vec<String>>,
}

/// Why a measured pull could not be stored, or taken away.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigRunError {
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The shard.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// A pull, or a run, that is not what it has to be; nothing was changed.
    #[error("{0}")]
    Refused(String),
}

/// Opens the folder of a rig's run, or makes it. The run of another campaign, rig or version is refused.
pub fn create_rig_run(path: &Path, info: &RigRunInfo) -> Result<RunFolder, FolderError> {
    let campaign = campaign_of(path, &info.config_toml)?;
    let recorded = campaign.recorded.unwrap_or_default();
    let run = RunInfo {
        schema: RUN_SCHEMA.into(),
        gripgen_version: info.gripgen_version.clone(),
        name: info.name.clone(),
        source: RIG_SOURCE.into(),
        config_sha256: sha256_hex(info.config_toml.as_bytes()),
        samples: info.pulls,
        shard_samples: 1,
        shards: info.pulls,
        extra_columns: extra_columns(recorded.iter().map(String::as_str)),
        files_sha256: std::collections::BTreeMap::new(),
        config_toml: info.config_toml.clone(),
        gpu_adapter: None,
    };
    let folder = RunFolder::create(path, run, &[])?;
    let found = folder.info().samples;
    if found != info.pulls {
        let (found, wanted) = (found.to_string(), info.pulls.to_string());
        return Err(FolderError::AnotherRun { path: path.into(), what: "number of pulls", found, wanted });
    }
    Ok(folder)
}

/// What holds for all pulls of a rig's run.
pub fn rig_campaign(folder: &RunFolder) -> Result<RigCampaign, FolderError> {
    campaign_of(folder.path(), &folder.info().config_toml)
}

fn campaign_of(path: &Path, config_toml: &str) -> Result<RigCampaign, FolderError> {
    #[derive(Deserialize)]
    struct Config {
        #[serde(default)]
        campaign: RigCampaign,
    }
    let config: Result<Config, _> = toml::from_str(config_toml);
    config.map(|c| c.campaign).map_err(|e| {
        let problem = format!("the configuration of the run: {}", e.to_string().trim_end());
        FolderError::Invalid { path: path.join("run.json"), problem }
    })
}

/// Stores a measured pull as its shard: written aside, renamed, the sidecar last. One that is done is not replaced.
pub fn write_rig_pull(folder: &RunFolder, pull: &RigPull) -> Result<Sidecar, RigRunError> {
    let index = pull.scenario.index;
    check_place(folder, index)?;
    let encoded = pull
        .encode(&folder.info().extra_columns)
        .map_err(|problem| RigRunError::Refused(format!("pull {index}: {problem}")))?;
    let partial = match folder.start_shard(index)? {
        ShardStart::Begun(partial) => partial,
        ShardStart::Busy => {
            let problem = format!("pull {index} is being written by another process");
            return Err(RigRunError::Refused(problem));
        }
        // What was measured is not replaced.
        ShardStart::Done(_) => {
            let shard = folder.shard_path(index);
            return Err(RigRunError::Refused(format!("pull {index} is done: {}", shard.display())));
        }
    };
    let file = BufWriter::new(partial.duplicate()?);
    let blame = |e| partial.blame::<RigRunError>(e);
    let mut writer = ShardWriter::new(file, &shard_info(folder, pull), ImageStorage::Png).map_err(blame)?;
    if pull.film.is_some() {
        writer = writer.with_films(ImageStorage::Png).map_err(blame)?;
    }
    writer.push(&encoded).map_err(blame)?;
    writer.finish().map_err(blame)?.into_inner().map_err(|e| partial.error(e.into_error()))?;
    let mut row = encoded.row;
    (row[1], row[2]) = (index.to_string(), "0".into());
    let failed = u64::from(encoded.status == Status::Failed);
    Ok(folder.finish_shard(index, index, partial, failed, vec![row])?)
}

fn shard_info(folder: &RunFolder, pull: &RigPull) -> ShardInfo {
    let run = folder.info();
    ShardInfo {
        gripgen_version: run.gripgen_version.clone(),
        config_sha256: run.config_sha256.clone(),
        source: run.source.clone(),
        shard: pull.scenario.index,
        shards: run.shards,
        first_sample: pull.scenario.index,
        samples: 1,
        slot_ns: pull.slot_ns(),
        config_toml: run.config_toml.clone(),
    }
}

fn check_place(folder: &RunFolder, pull: u64) -> Result<(), RigRunError> {
    let run = folder.info();
    if run.source != RIG_SOURCE {
        return Err(RigRunError::Refused(format!(
            "{}: its source is `{}`, pulls of a rig go into runs of a `{RIG_SOURCE}`",
            folder.path().display(),
            run.source
        )));
    }
    if pull >= run.samples {
        let problem = format!("there is no pull {pull}, the campaign has {} (counted from 0)", run.samples);
        return Err(RigRunError::Refused(problem));
    }
    Ok(())
}

/// Pulls of a rig's run that are still to be made, in order.
pub fn missing_pulls(folder: &RunFolder) -> Result<Vec<u64>, FolderError> {
    pulls_where(folder, |sidecar| sidecar.is_none())
}

/// Pulls of a rig's run that were tried and failed, in order.
pub fn failed_pulls(folder: &RunFolder) -> Result<Vec<u64>, FolderError> {
    pulls_where(folder, |sidecar| sidecar.is_some_and(|s| s.failed > 0))
}

fn pulls_where(folder: &RunFolder, is: impl Fn(Option<&Sidecar>) -> bool) -> Result<Vec<u64>, FolderError> {
    let mut found = Vec::new();
    for shard in 0..folder.info().shards {
        if is(folder.finished(shard)?.as_ref()) {
            found.push(shard);
        }
    }
    Ok(found)
}

/// Folder of a run that keeps the pulls that failed and were made again.
pub const FAILED_FOLDER: &str = "failed";

/// Puts a failed pull aside, so that it can be made again; returns whether there was one. Its shard and its sidecar, which has the
/// reason, are kept as `failed/shard-00003-1.mcap` and `.json`, counted up. One with a label stays, which is an error. The index
/// goes: it is written again when all pulls are done.
///
/// # Errors
///
/// A pull that the run does not have or that has a label, or a file that cannot be moved.
pub fn discard_failed(folder: &RunFolder, pull: u64) -> Result<bool, RigRunError> {
    check_place(folder, pull)?;
    match folder.finished(pull)? {
        None => return Ok(false),
        Some(sidecar) if sidecar.failed == 0 => {
            let shard = folder.shard_path(pull);
            let problem = format!("pull {pull} did not fail, it stays: {}", shard.display());
            return Err(RigRunError::Refused(problem));
        }
        Some(_) => {}
    }
    // A process that dies between two of these leaves a shard without a sidecar: a pull that was not made.
    remove(&folder.path().join("index.csv"))?;
    let aside = aside(folder, pull)?;
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| FolderError::Io { path, source }
    };
    let (sidecar, shard) = (folder.sidecar_path(pull), folder.shard_path(pull));
    std::fs::rename(&sidecar, aside.with_extension("json")).map_err(io(&sidecar))?;
    // Whoever is making it again by now replaces the shard.
    if let ShardStart::Begun(partial) = folder.start_shard(pull)? {
        std::fs::rename(&shard, aside.with_extension("mcap")).map_err(io(&shard))?;
        partial.give_up()?;
    }
    Ok(true)
}

/// A name without its ending for a failed pull, in the folder of those, that none has yet.
fn aside(folder: &RunFolder, pull: u64) -> Result<PathBuf, FolderError> {
    let at = folder.path().join(FAILED_FOLDER);
    std::fs::create_dir_all(&at).map_err(|source| FolderError::Io { path: at.clone(), source })?;
    let mut times = 1_u64;
    loop {
        let name = at.join(format!("shard-{pull:05}-{times}"));
        if !["json", "mcap"].iter().any(|ending| name.with_extension(ending).exists()) {
            return Ok(name);
        }
        times += 1;
    }
}

/// Pulls of a rig's run whose label is suspect, in order.
///
/// # Errors
///
/// A sidecar that cannot be read.
pub fn suspect_pulls(folder: &RunFolder) -> Result<Vec<u64>, FolderError> {
    pulls_where(folder, |sidecar| sidecar.is_some_and(|s| s.rows_with_status(Status::Suspect) > 0))
}

fn remove(path: &Path) -> Result<(), FolderError> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(FolderError::Io { path: path.into(), source: e }),
        _ => Ok(()),
    }
}
