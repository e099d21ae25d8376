//! Measured pulls from wherever they are: a folder with a table, a run folder, or recordings of ROS 2.

mod bags;
mod left_out;
mod suspects;
mod units;
mod zero;

pub use suspects::Suspects;
pub use units::ImplausibleLabels;

use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_record::{
    FolderError, JudgedPulls, PULLS_FILE, PullFolderError, RIG_SOURCE, ReadError, RigCampaign, RosbagError,
    RunFolder, ShardReader, Standing, is_rosbag, read_judged_pulls, rig_campaign, sample_covariates,
    sha256_hex,
};
use gripgen_twin::columns::{Column, covariate, covariates, recorded_covariates};
use gripgen_twin::config::Feedback;
use gripgen_twin::{ExtraColumn, MeasuredPull, MeasuredPulls, PullTrace, Values};
use left_out::LeftOut;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Measured pulls, and remarks for people: what was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedPulls {
    /// The pulls.
    pub pulls: MeasuredPulls,
    /// Remarks, one per sentence.
    pub notes: Vec<String>,
    /// What people have to be told, asked or not: the numbers or the names of files may not be what was meant.
    pub warnings: Vec<String>,
    /// Labels that no gel gives: no twin is to be fitted to them.
    pub implausible: Option<ImplausibleLabels>,
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
    /// Recordings of ROS 2.
    #[error(transparent)]
    Bags(#[from] RosbagError),
    /// Folders whose labels mean different things.
    #[error(
        "{}: its labels are taken with {other_n} N and {:.1} mm, those of the first folder with {tolerance_n} N and {:.1} mm",
        .path.display(), 1e3 * .other_m, 1e3 * .stop_m
    )]
    Rule {
        /// The folder.
        path: PathBuf,
        /// Tolerance of the first folder.
        tolerance_n: f64,
        /// Tolerance of this one.
        other_n: f64,
        /// Displacement stop of the first folder.
        stop_m: f64,
        /// Displacement stop of this one.
        other_m: f64,
    },
    /// Every pull of a table was left out.
    #[error("{}: no pull of this table can be used: {notes}", .path.display())]
    Unusable {
        /// The folder.
        path: PathBuf,
        /// Why.
        notes: String,
    },
    /// Every pull of a run folder was left out.
    #[error("{}: no pull of this run can be used: {notes}", .path.display())]
    Nothing {
        /// The folder.
        path: PathBuf,
        /// Why.
        notes: String,
    },
}

impl LoadPullsError {
    /// What to do about it, where that is known.
    pub fn hint(&self) -> Option<&str> {
        match self {
            Self::Bags(e) if !e.hint.is_empty() => Some(&e.hint),
            _ => None,
        }
    }
}

/// Whether a path holds pulls that [`load_pulls`] reads.
pub fn is_pulls(path: &Path) -> bool {
    path.join(PULLS_FILE).is_file() || path.join("run.json").is_file() || is_rosbag(path)
}

/// Loads measured pulls: a run folder of a sweep or of a rig if there is a `run.json`, else a folder with `pulls.csv`, else
/// bags of ROS 2.
///
/// Of a run folder, pulls without a slip (failed, without contact, censored) are left out and counted in the notes, and so
/// are those whose label rule is not that of the first. Its covariates are those stored with each sample; what a sweep
/// drew beside them (`parts.gear.mu`) is not known to an experiment and stays out, what a rig measured beside them is a
/// covariate of unknown meaning. Pulls whose label is suspect are left out too.
///
/// # Errors
///
/// A folder that cannot be read, or in which no pull can be used.
pub fn load_pulls(path: &Path) -> Result<LoadedPulls, LoadPullsError> {
    load_one(path, Suspects::LeaveOut)
}

fn load_one(path: &Path, suspects: Suspects) -> Result<LoadedPulls, LoadPullsError> {
    if path.join("run.json").is_file() {
        return load_run(path, suspects);
    }
    let is_bag = !path.join(PULLS_FILE).is_file() && is_rosbag(path);
    let JudgedPulls { pulls, standing, mut warnings } =
        if is_bag { bags::judged_bags(path)? } else { read_judged_pulls(path)? };
    let mut left_out = LeftOut { rig: false, ..LeftOut::default() };
    standing.iter().for_each(|s| left_out.count(s.status));
    let ids: Vec<&str> = pulls.pulls.iter().map(|p| p.id.as_str()).collect();
    let (keep, note) = suspects::kept(&standing, &ids, suspects);
    let mut notes: Vec<String> = left_out.notes().into_iter().chain(note).collect();
    if !keep.contains(&true) {
        let first = standing.iter().zip(&ids).find(|(s, _)| !s.reason.is_empty() && notes.len() == 1);
        notes.extend(first.map(|(s, id)| format!("pull {id}: {}", s.reason)));
        return Err(LoadPullsError::Unusable { path: path.into(), notes: notes.join("; ") });
    }
    let mut pulls = pulls.kept(|i| keep[i]);
    let implausible = units::implausible(path, &pulls.pulls);
    if implausible.is_none() {
        warnings.extend(units::warnings(path, &pulls.pulls));
    }
    if is_bag {
        if pulls.pulls.iter().all(|pull| pull.trace.is_none()) {
            notes.push(
                "nobody recorded how the tool moved (topics.pose, topics.joint_states): traces are not used"
                    .into(),
            );
        }
        // As those of a run: every reading is there.
        pulls.pulls.iter_mut().for_each(|pull| pull.trace = pull.trace.as_ref().map(thinned));
        fewer_traces(&mut pulls.pulls, &mut notes);
    }
    notes.extend(zero::without_shift(&mut pulls));
    Ok(LoadedPulls { pulls, notes, warnings, implausible })
}

/// Loads several folders as one campaign, in their order: what was measured later on the same rig. Pulls whose ids are taken get the
/// name of their folder before them; what only some of the folders recorded counts as not recorded.
///
/// # Errors
///
/// As [`load_pulls`], or folders whose labels are taken by two rules.
pub fn load_pulls_of(folders: &[&Path]) -> Result<LoadedPulls, LoadPullsError> {
    load_pulls_with(folders, Suspects::LeaveOut)
}

/// The same, with what becomes of pulls whose label is suspect.
///
/// # Errors
///
/// As [`load_pulls_of`].
pub fn load_pulls_with(folders: &[&Path], suspects: Suspects) -> Result<LoadedPulls, LoadPullsError> {
    let Some((first, rest)) = folders.split_first() else {
        return Err(LoadPullsError::Nothing { path: PathBuf::new(), notes: "no folder was named".into() });
    };
    let mut all = load_one(first, suspects)?;
    for path in rest {
        join(path, &mut all, load_one(path, suspects)?)?;
    }
    // Samples of a sweep know no rests, so those of several are not counted either.
    if folders.len() > 1 && !folders.iter().any(|path| is_sweep(path)) {
        all.pulls.count_rests();
    }
    Ok(all)
}

/// Puts further pulls behind those that are there.
fn join(path: &Path, all: &mut LoadedPulls, next: LoadedPulls) -> Result<(), LoadPullsError> {
    let (mine, mut theirs) = (&mut all.pulls, next.pulls);
    let rules = [(mine.label_tolerance_n, mine.stop_m), (theirs.label_tolerance_n, theirs.stop_m)];
    if rules[0] != rules[1] {
        let [(tolerance_n, stop_m), (other_n, other_m)] = rules;
        return Err(LoadPullsError::Rule { path: path.into(), tolerance_n, other_n, stop_m, other_m });
    }
    let ids: BTreeSet<String> = mine.pulls.iter().map(|p| p.id.clone()).collect();
    let folder = path.file_name().map_or_else(|| "next".into(), |name| name.to_string_lossy().into_owned());
    for pull in theirs.pulls.iter_mut().filter(|pull| ids.contains(&pull.id)) {
        pull.id = format!("{folder}-{}", pull.id);
    }
    mine.recorded.retain(|name| theirs.recorded.contains(name));
    mine.extra.retain(|column| theirs.extra.iter().any(|c| same_kind(column, c)));
    for column in &mut mine.extra {
        if let Some(more) = theirs.extra.iter().find(|c| c.name == column.name) {
            column.values.append(&more.values);
        }
    }
    mine.feedback = mine.feedback.filter(|f| theirs.feedback.is_none_or(|other| *f == other));
    mine.sha256 = sha256_hex(format!("{}{}", mine.sha256, theirs.sha256).as_bytes());
    mine.pulls.append(&mut theirs.pulls);
    all.notes.extend(next.notes);
    all.warnings.extend(next.warnings);
    all.implausible = all.implausible.take().or(next.implausible);
    Ok(())
}

fn same_kind(a: &ExtraColumn, b: &ExtraColumn) -> bool {
    a.name == b.name && a.values.same_kind(&b.values)
}

/// Whether a folder holds samples of a sweep.
fn is_sweep(path: &Path) -> bool {
    RunFolder::open(path).is_ok_and(|folder| folder.info().source != RIG_SOURCE)
}

fn load_run(path: &Path, suspects: Suspects) -> Result<LoadedPulls, LoadPullsError> {
    let folder = RunFolder::open(path)?;
    let rig = (folder.info().source == RIG_SOURCE).then(|| rig_campaign(&folder)).transpose()?;
    let mut left_out = LeftOut { rig: rig.is_some(), ..LeftOut::default() };
    let (mut pulls, mut standing, mut hashes) = (Vec::new(), Vec::new(), String::new());
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
            left_out.count(sample.status());
            if !matches!(sample.status(), Status::Slipped | Status::Suspect) {
                continue;
            }
            let mine = (sample.label_tolerance_n, sample.stop_mm);
            if *rule.get_or_insert(mine) != mine {
                left_out.other_rule += 1;
                continue;
            }
            let stands = suspects::standing_of(&sample, trace.as_ref());
            if let Some(pull) = measured(sample, trace.as_ref()) {
                pulls.push(pull);
                standing.push(stands);
            }
        }
    }
    let ids: Vec<&str> = pulls.iter().map(|p: &MeasuredPull| p.id.as_str()).collect();
    let (keep, note) = suspects::kept(&standing, &ids, suspects);
    let mut notes: Vec<String> = left_out.notes().into_iter().chain(note).collect();
    let mut keeps = keep.iter();
    pulls.retain(|_| keeps.next().is_some_and(|keep| *keep));
    let rule = rule.filter(|_| !pulls.is_empty());
    let Some((label_tolerance_n, stop_mm)) = rule else {
        return Err(LoadPullsError::Nothing { path: path.into(), notes: notes.join("; ") });
    };
    let there = |column: &&Column| pulls.iter().any(|p: &MeasuredPull| column.value(p.view()).is_some());
    let recorded = covariates().filter(there).map(|c| c.name.into()).collect();
    let mut pulls = MeasuredPulls {
        pulls,
        recorded,
        extra: Vec::new(),
        label_tolerance_n,
        stop_m: stop_mm * 1e-3,
        feedback: feedback_of(&folder.info().config_toml),
        sha256: sha256_hex(hashes.as_bytes()),
    };
    match rig {
        Some(campaign) => as_made(&mut pulls, campaign),
        None => pulls.extra = own_columns(&pulls.pulls),
    }
    notes.extend(zero::without_shift(&mut pulls));
    fewer_traces(&mut pulls.pulls, &mut notes);
    // A sweep and a rig write newtons.
    Ok(LoadedPulls { pulls, notes, warnings: Vec::new(), implausible: None })
}

/// What is known of pulls that a rig made, and samples of a sweep have not: the order in which they were made, rests
/// between them, what was written down.
fn as_made(pulls: &mut MeasuredPulls, campaign: RigCampaign) {
    pulls.feedback = campaign.feedback;
    if let Some(recorded) = campaign.recorded {
        pulls.recorded = recorded_covariates(&recorded).map(|c| c.name.into()).collect();
    }
    if pulls.recorded.iter().any(|c| c == "time_s") {
        // A pull that failed at first was made again after the others.
        pulls.pulls.sort_by(|a, b| a.covariates.time_s.total_cmp(&b.covariates.time_s));
    }
    pulls.extra = own_columns(&pulls.pulls);
    pulls.count_rests();
}

/// The columns of pulls that gripgen does not know.
fn own_columns(pulls: &[MeasuredPull]) -> Vec<ExtraColumn> {
    let names: BTreeSet<&String> = pulls.iter().flat_map(|p| p.covariates.extra.keys()).collect();
    let column = |name: &String| ExtraColumn {
        name: name.clone(),
        values: Values::of_drawn(pulls.iter().map(|p| p.covariates.extra.get(name))),
    };
    names.into_iter().filter(|name| covariate(name).is_none()).map(column).collect()
}

/// Traces that are always used, and the share of them beyond that. The model of arm and loop is good to about a hundredth: with
/// the traces of all pulls a diagnosis is sure of what the model does not have, and calls it an effect.
const FEW_TRACES: usize = 24;
const SHARE_OF_TRACES: usize = 4;

/// Takes away all traces but so many, evenly spread, and says so.
fn fewer_traces(pulls: &mut [MeasuredPull], notes: &mut Vec<String>) {
    let traced = pulls.iter().filter(|p| p.trace.is_some()).count();
    let kept = FEW_TRACES.max(pulls.len() / SHARE_OF_TRACES);
    if traced <= kept {
        return;
    }
    let with_trace = pulls.iter_mut().filter(|p| p.trace.is_some());
    for (i, pull) in with_trace.enumerate() {
        // The first of each stretch of `traced / kept`.
        if i * kept % traced >= kept {
            pull.trace = None;
        }
    }
    notes.push(format!("traces of {kept} of {traced} pulls are used: more of them would say more of the arm than its model knows"));
}

/// Time between the readings of a trace that are used. The force loop feeds noise back with its lag, so readings that are
/// closer say the same again; taken as new ones they make a diagnosis too sure of itself.
const READING_STEP_S: f64 = 0.01;

/// Every so many rows of a trace, its first row of the pull among them.
fn thinned(trace: &PullTrace) -> PullTrace {
    let begun = trace.time_s.partition_point(|&t| t < 0.0);
    let pulled = trace.time_s.get(begun..).unwrap_or_default();
    let step_s = match pulled {
        [first, .., last] => (last - first) / (pulled.len() - 1) as f64,
        _ => return trace.clone(),
    };
    let every = (READING_STEP_S / step_s).round().max(1.0) as usize;
    trace.rows().enumerate().filter(|(i, _)| i % every == begun % every).map(|(_, row)| row).collect()
}

/// A pull that slipped; `None` if it has no label after all.
fn measured(sample: Sample, trace: Option<&PullTrace>) -> Option<MeasuredPull> {
    let covariates = sample_covariates(&sample);
    Some(MeasuredPull {
        id: sample.index.to_string(),
        max_pull_force_n: sample.max_pull_force_n?,
        zero_shift_n: 0.0,
        grip_pose: sample.grip_pose as usize,
        grip_force_n: sample.grip_force_n,
        increment_n: sample.force_increment_n,
        start_n: sample.force_start_n,
        step_s: sample.step_time_s,
        covariates,
        part: sample.part,
        trace: trace.map(thinned),
    })
}

/// What the force loop of a sweep closed on, where its configuration says so.
fn feedback_of(config_toml: &str) -> Option<Feedback> {
    let config: toml::Table = config_toml.parse().ok()?;
    let feedback = config.get("twin")?.get("robot")?.get("feedback")?;
    Feedback::deserialize(feedback.clone()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::{Covariates, TraceRow};

    pub(super) fn pull(i: usize) -> MeasuredPull {
        MeasuredPull {
            id: i.to_string(),
            part: "p".into(),
            grip_pose: 0,
            grip_force_n: 10.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.1,
            covariates: Covariates::default(),
            max_pull_force_n: 3.0,
            zero_shift_n: 0.0,
            trace: Some(PullTrace::default()),
        }
    }

    #[test]
    fn of_many_traces_some_are_used_and_all_of_a_few() {
        for (n, kept) in [(5, 5), (24, 24), (25, 24), (60, 24), (120, 30), (1000, 250)] {
            let (mut pulls, mut notes): (Vec<_>, Vec<_>) = ((0..n).map(pull).collect(), vec![]);
            fewer_traces(&mut pulls, &mut notes);
            assert_eq!(pulls.iter().filter(|p| p.trace.is_some()).count(), kept, "of {n}");
            assert_eq!(notes.len(), usize::from(kept < n));
            let last = pulls.iter().rposition(|p| p.trace.is_some()).unwrap();
            assert!(last + 5 >= n - 1, "evenly spread: the last of {n} is {last}");
        }
    }

    #[test]
    fn traces_keep_a_reading_every_ten_milliseconds_and_the_first_of_the_pull() {
        let at = |time_s: f64| TraceRow {
            time_s,
            desired_force_n: 1.0,
            measured_force_n: time_s,
            displacement_m: 0.0,
        };
        // 500 per second, some before the pull, with a gap.
        let before = (0..21).map(|i| at(-3.0 + 0.002 * f64::from(i)));
        let trace: PullTrace = before.chain((0..501).map(|i| at(0.002 * f64::from(i)))).collect();
        let thin = thinned(&trace);
        let pulled: Vec<f64> = thin.time_s.iter().copied().filter(|t| *t >= 0.0).collect();
        assert_eq!(pulled.len(), 101);
        assert_eq!(pulled[0], 0.0);
        assert!(pulled.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-12));
        assert_eq!(thin.len() - pulled.len(), 4, "four or five of 21 before the pull");
        // What is as slow already stays as it is.
        assert_eq!(thinned(&thin), thin);
        assert_eq!(thinned(&PullTrace::default()), PullTrace::default());
    }
}
