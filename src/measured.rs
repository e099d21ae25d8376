//! Measured pulls from wherever they are: a folder with a table, or a run folder.

use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_record::{
    FolderError, PullFolderError, ReadError, RunFolder, ShardReader, read_pull_folder, sha256_hex,
};
use gripgen_twin::config::Feedback;
use gripgen_twin::{Covariates, KNOWN_COLUMNS, MeasuredPull, MeasuredPulls, PullTrace};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Measured pulls, and remarks for people: what was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedPulls {
    /// The pulls.
    pub pulls: MeasuredPulls,
    /// Remarks, one a sentence.
    pub notes: Vec<String>,
}

/// Why there are no measured pulls.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadPullsError {
    /// A folder with a table.
    #[error(transparent)]
    Table(#[from] PullFolderError),
    /// A run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A shard of it.
    #[error(transparent)]
    Shard(#[from] ReadError),
    /// Every pull of a run folder was left out.
    #[error("{}: no pull of this run can be used: {notes}", .path.display())]
    Nothing {
        /// The folder.
        path: PathBuf,
        /// Why.
        notes: String,
    },
}

/// Loads measured pulls: a run folder of a sweep or of a rig if there is a `run.json`, else a folder with `pulls.csv`.
///
/// Of a run folder, pulls without a slip (failed, without contact, censored) are left out and counted in the notes, and so
/// are those whose label rule is not that of the first. Its covariates are those stored with each sample; what a sweep
/// drew beside them (`parts.gear.mu`) is not known to an experiment and stays out.
pub fn load_pulls(path: &Path) -> Result<LoadedPulls, LoadPullsError> {
    if path.join("run.json").is_file() {
        return load_run(path);
    }
    Ok(LoadedPulls { pulls: read_pull_folder(path)?, notes: Vec::new() })
}

/// Pulls of a run that are left out, by reason.
#[derive(Default)]
struct LeftOut {
    failed: usize,
    no_contact: usize,
    censored: usize,
    other_rule: usize,
    unfinished_shards: u64,
}

impl LeftOut {
    fn notes(&self) -> Vec<String> {
        let counted = [
            (self.failed, "failed"),
            (self.no_contact, "had no contact"),
            (self.censored, "ended before the jaws slipped"),
            (self.other_rule, "have another tolerance or stop than the first"),
        ];
        let mut notes: Vec<String> = counted
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{n} pulls were left out: they {what}"))
            .collect();
        if self.unfinished_shards > 0 {
            notes.push(format!("{} shards are not finished and were left out", self.unfinished_shards));
        }
        notes
    }
}

fn load_run(path: &Path) -> Result<LoadedPulls, LoadPullsError> {
    let folder = RunFolder::open(path)?;
    let (mut pulls, mut left_out, mut hashes) = (Vec::new(), LeftOut::default(), String::new());
    let mut rule: Option<(f64, f64)> = None;
    for shard in 0..folder.info().shards {
        let Some(sidecar) = folder.finished(shard)? else {
            left_out.unfinished_shards += 1;
            continue;
        };
        hashes += &sidecar.sha256;
        let reader = ShardReader::open(&folder.shard_path(shard))?;
        for index in reader.indices() {
            let (sample, trace) = reader.pull(index)?;
            let counter = match sample.status() {
                Status::Slipped => {
                    let mine = (sample.label_tolerance_n, sample.stop_mm);
                    if *rule.get_or_insert(mine) == mine {
                        pulls.extend(measured(sample, trace));
                        continue;
                    }
                    &mut left_out.other_rule
                }
                Status::Censored => &mut left_out.censored,
                Status::NoContact => &mut left_out.no_contact,
                _ => &mut left_out.failed,
            };
            *counter += 1;
        }
    }
    let notes = left_out.notes();
    let Some((label_tolerance_n, stop_mm)) = rule else {
        return Err(LoadPullsError::Nothing { path: path.into(), notes: notes.join("; ") });
    };
    let mut pulls = MeasuredPulls {
        pulls,
        recorded: KNOWN_COLUMNS.iter().map(ToString::to_string).collect(),
        extra: Vec::new(),
        label_tolerance_n,
        stop_m: stop_mm * 1e-3,
        feedback: feedback_of(&folder.info().config_toml),
        sha256: sha256_hex(hashes.as_bytes()),
    };
    // The samples of a sweep have no order in which they were made.
    if folder.info().source == "rig" {
        pulls.count_rests();
    }
    Ok(LoadedPulls { pulls, notes })
}

/// A pull that slipped; `None` if it has no label after all.
fn measured(sample: Sample, trace: Option<PullTrace>) -> Option<MeasuredPull> {
    Some(MeasuredPull {
        id: sample.index.to_string(),
        max_pull_force_n: sample.max_pull_force_n?,
        grip_force_n: sample.grip_force_n,
        increment_n: sample.force_increment_n,
        step_s: sample.step_time_s,
        covariates: Covariates {
            gel_id: sample.gel_id,
            session: sample.session,
            pull_index: sample.pull_index,
            time_s: sample.time_s,
            temperature_c: sample.temperature_c,
            dwell_s: sample.dwell_s,
            grip_offset_m: sample.grip_offset_mm * 1e-3,
            grip_angle_rad: sample.grip_angle_deg.to_radians(),
            pull_direction: f64::from(sample.pull_direction),
            ..Covariates::default()
        },
        part: sample.part,
        trace,
    })
}

/// What the force loop of a run closed on, where its configuration says so.
fn feedback_of(config_toml: &str) -> Option<Feedback> {
    let config: toml::Table = config_toml.parse().ok()?;
    let feedback = config.get("twin")?.get("robot")?.get("feedback")?;
    Feedback::deserialize(feedback.clone()).ok()
}
