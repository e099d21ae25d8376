//! Measured pulls of a campaign: from a folder with a table, or from a run folder.

mod left_out;
mod runs;
mod suspects;
mod traces;
mod units;
mod zero;

pub use suspects::Suspects;
pub use units::ImplausibleLabels;

use crate::pulls::{JudgedPulls, MissingCells, PULLS_FILE, PullFolderError, Standing, read_judged_pulls};
use gripgen_record::{FolderError, RIG_SOURCE, ReadError, RunFolder, sha256_hex};
use gripgen_twin::{ExtraColumn, MeasuredPulls};
use left_out::LeftOut;
use runs::load_run;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use traces::{fewer_traces, thinned};

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
    /// Cells that are missing in columns that other pulls fill; the notes say so too.
    pub missing: MissingCells,
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
    /// Recordings of ROS, which the Python package reads.
    #[error("{}: bags of ROS are read by the Python package", .path.display())]
    Bag {
        /// The bag, or its mapping.
        path: PathBuf,
    },
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
            Self::Bag { .. } => Some(BAG_HINT),
            Self::Table(PullFolderError::Table(e)) => Some(e.hint()),
            Self::Table(PullFolderError::Campaign(e)) => Some(e.hint()),
            _ => None,
        }
    }
}

/// How bags of ROS become measured pulls.
pub const BAG_HINT: &str =
    "`pip install 'gripgen[bags]'`, then `gripgen import BAG -o FOLDER` makes a folder of measured pulls";

/// Whether a path is a recording of ROS, a folder of them, or their mapping.
fn is_bag(path: &Path) -> bool {
    if path.is_dir() {
        return path.join("rosbag.toml").is_file() || path.join("metadata.yaml").is_file();
    }
    let of_run = path.with_file_name("run.json").is_file();
    let recording = path.extension().is_some_and(|end| ["mcap", "db3", "bag"].iter().any(|e| end == *e));
    path.is_file() && (path.ends_with("rosbag.toml") || recording && !of_run)
}

/// Whether a path holds pulls that [`load_pulls`] reads, or bags, of which it says how they are read.
pub fn is_pulls(path: &Path) -> bool {
    path.join(PULLS_FILE).is_file() || path.join("run.json").is_file() || is_bag(path)
}

/// Loads measured pulls: a run folder of a sweep or of a rig if there is a `run.json`, else a folder with `pulls.csv`.
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
    if !path.join(PULLS_FILE).is_file() && is_bag(path) {
        return Err(LoadPullsError::Bag { path: path.into() });
    }
    let JudgedPulls { pulls, standing, every_reading, missing, mut warnings } = read_judged_pulls(path)?;
    let mut left_out = LeftOut { rig: false, ..LeftOut::default() };
    standing.iter().filter(|s| !s.lacks_value).for_each(|s| left_out.count(s.status));
    let ids: Vec<&str> = pulls.pulls.iter().map(|p| p.id.as_str()).collect();
    let (keep, note) = suspects::kept(&standing, &ids, suspects);
    let mut notes: Vec<String> = left_out.notes().into_iter().chain(note).chain(missing.notes()).collect();
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
    if every_reading {
        // As those of a run.
        pulls.pulls.iter_mut().for_each(|pull| pull.trace = pull.trace.as_ref().map(thinned));
        fewer_traces(&mut pulls.pulls, &mut notes);
    }
    notes.extend(zero::without_shift(&mut pulls));
    Ok(LoadedPulls { pulls, notes, warnings, implausible, missing })
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
        all.pulls.count();
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
    sessions_apart(&folder, mine, &mut theirs);
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
    all.missing.append(&next.missing);
    Ok(())
}

/// Names the sessions of the second folder after it where the first one has them too: two folders are two sessions at least.
fn sessions_apart(folder: &str, mine: &mut MeasuredPulls, theirs: &mut MeasuredPulls) {
    let sessions: BTreeSet<String> = mine.pulls.iter().map(|p| p.covariates.session.clone()).collect();
    for pull in theirs.pulls.iter_mut().filter(|p| sessions.contains(&p.covariates.session)) {
        pull.covariates.session = format!("{folder}-{}", pull.covariates.session);
    }
    for all in [mine, theirs] {
        if !all.recorded.iter().any(|name| name == "session") {
            all.recorded.push("session".into());
        }
    }
}

fn same_kind(a: &ExtraColumn, b: &ExtraColumn) -> bool {
    a.name == b.name && a.values.same_kind(&b.values)
}

/// Whether a folder holds samples of a sweep.
fn is_sweep(path: &Path) -> bool {
    RunFolder::open(path).is_ok_and(|folder| folder.info().source != RIG_SOURCE)
}
