//! A folder of measured pulls: `pulls.csv`, and where they are there `campaign.toml` and `traces/<pull_id>.csv`.

mod cells;
mod images;
mod standing;
mod strays;
#[cfg(test)]
mod tests;
mod trace;
mod write;

pub use images::{PullImages, pulls_with_images, read_pull_images};
pub use standing::{JudgedPulls, Standing};
pub use write::write_pull_folder;

use crate::campaign::{CAMPAIGN_FILE, CampaignFileError, CampaignHeader, LabelEvidenceKind, parse_header};
use crate::table::{TableError, TableReader, read_bytes};
use cells::{Cells, Column, DEFAULT_STEP_S};
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_twin::config::PullFile;
use gripgen_twin::{Covariates, ExtraColumn, MeasuredPull, MeasuredPulls};
use sha2::{Digest, Sha256};
use standing::judge_labels;
use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::Path;

/// The table of a folder of measured pulls.
pub const PULLS_FILE: &str = "pulls.csv";

/// The folder of the traces beside it.
pub const TRACES_FOLDER: &str = "traces";

/// Why a folder of measured pulls could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PullFolderError {
    /// The table, a trace or their folder.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The campaign file.
    #[error(transparent)]
    Campaign(#[from] CampaignFileError),
}

/// Reads a folder of measured pulls.
///
/// Columns stand in any order; `pull_id, part, grip_force_n, max_pull_force_n` have to be there. An empty cell of
/// another known column is a value that nobody wrote down and has the default of [`Covariates`] (1 N and 0.104 s of the
/// staircase); a column without any value was not recorded. Further columns are covariates of unknown meaning: numbers
/// if every cell is one or empty, else words; columns without a name or without a value are left out. Pulls stay in
/// the order of the table. Pulls that did not slip, and those whose label is suspect, are left out.
pub fn read_pull_folder(folder: &Path) -> Result<MeasuredPulls, PullFolderError> {
    let judged = read_judged_pulls(folder)?;
    Ok(judged.pulls.kept(|i| judged.standing[i].status == Status::Slipped))
}

/// The same with all pulls of the table, and how each of them stands: by its `status` and `status_reason`, where there are
/// such columns, and by what its trace says of its label.
pub fn read_judged_pulls(folder: &Path) -> Result<JudgedPulls, PullFolderError> {
    let path = folder.join(PULLS_FILE);
    let bytes = read_bytes(&path)?;
    let mut hash = Sha256::new();
    feed(&mut hash, PULLS_FILE, &bytes);
    let (header, mut warnings) = campaign_header(folder, &mut hash)?;
    let (mut found, mut standing) = read_table(&path, &bytes, &header)?;
    for look in [strays::words_among_numbers, strays::numbers_with_units, strays::nearly_known] {
        warnings.extend(look(&path, &found));
    }
    let mut after_n = vec![Vec::new(); found.pulls.len()];
    let traces = folder.join(TRACES_FOLDER);
    let stored = trace_files(&traces)?;
    warnings.extend(strays::traces_of_nobody(folder, &stored, &found.pulls));
    for (pull, after_n) in found.pulls.iter_mut().zip(&mut after_n).filter(|_| !stored.is_empty()) {
        let name = format!("{}.csv", pull.id);
        if !stored.contains(name.as_str()) {
            continue;
        }
        let path = traces.join(&name);
        let bytes = read_bytes(&path)?;
        feed(&mut hash, &name, &bytes);
        let (trace, after) = trace::read_trace(&path, &bytes)?;
        (pull.trace, *after_n) = (Some(trace), after);
    }
    found.sha256 = hex(&hash.finalize());
    if header.label_evidence == LabelEvidenceKind::Trace {
        judge_labels(&found, &after_n, &mut standing);
    }
    Ok(JudgedPulls { pulls: found, standing, every_reading: header.every_reading, warnings })
}

/// What holds for all pulls, and what in its file means nothing.
fn campaign_header(
    folder: &Path,
    hash: &mut Sha256,
) -> Result<(CampaignHeader, Vec<String>), PullFolderError> {
    let path = folder.join(CAMPAIGN_FILE);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok((CampaignHeader::default(), Vec::new())),
        Err(e) => return Err(TableError::Io { path, problem: e.to_string() }.into()),
    };
    feed(hash, CAMPAIGN_FILE, &bytes);
    let text = String::from_utf8(bytes).map_err(|e| TableError::Io {
        path: path.clone(),
        problem: format!("not text, save it as UTF-8: {e}"),
    })?;
    Ok((parse_header(&path, &text)?, strays::unknown_keys(&path, &text)))
}

/// Names of the files in the folder of the traces; none where there is no such folder.
fn trace_files(folder: &Path) -> Result<HashSet<String>, TableError> {
    let at = |e: std::io::Error| TableError::Io { path: folder.into(), problem: e.to_string() };
    match std::fs::read_dir(folder) {
        Ok(entries) => entries
            .map(|entry| entry.map(|e| e.file_name().to_string_lossy().into_owned()).map_err(at))
            .collect(),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(HashSet::new()),
        Err(e) => Err(at(e)),
    }
}

/// Reads a table of pulls from its content; `path` is for errors.
fn read_table(
    path: &Path,
    bytes: &[u8],
    header: &CampaignHeader,
) -> Result<(MeasuredPulls, Vec<Standing>), TableError> {
    let mut table = TableReader::new(path, bytes)?;
    let mut columns = cells::columns(&table)?;
    let mut lines: HashMap<String, u64> = HashMap::new();
    let (mut pulls, mut lines_of) = (Vec::new(), Vec::new());
    let plain = PullFile::default();
    while let Some(row) = table.row()? {
        let mut pull = MeasuredPull {
            id: String::new(),
            part: String::new(),
            grip_pose: 0,
            grip_force_n: 0.0,
            increment_n: plain.increment_n,
            start_n: None,
            step_s: DEFAULT_STEP_S,
            covariates: Covariates::default(),
            max_pull_force_n: 0.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        for (place, column) in columns.iter_mut().enumerate() {
            column.take(row.cell(place), &mut pull).map_err(|wanted| row.bad(place, wanted))?;
        }
        pull.grip_force_n = header.per_jaw_n(pull.grip_force_n);
        if let Some(first) = lines.insert(pull.id.clone(), row.line) {
            let problem = format!("lines {first} and {} are both pull `{}`", row.line, pull.id);
            return Err(TableError::Rows { path: path.into(), problem });
        }
        lines_of.push(row.line);
        pulls.push(pull);
    }
    if pulls.is_empty() {
        return Err(TableError::Empty { path: path.into() });
    }
    let standing = standing::stated(&columns, &mut pulls).map_err(|row| TableError::Cell {
        path: path.into(),
        line: lines_of[row],
        column: cells::LABEL.into(),
        value: String::new(),
        wanted: "a number".into(),
    })?;
    let recorded = columns.iter().filter_map(Column::recorded).collect();
    let extra: Vec<ExtraColumn> = columns.into_iter().filter_map(extra_column).collect();
    for column in &extra {
        for (i, pull) in pulls.iter_mut().enumerate() {
            if let Some(value) = column.values.at(i) {
                pull.covariates.extra.insert(column.name.clone(), value);
            }
        }
    }
    let mut measured = MeasuredPulls {
        pulls,
        recorded,
        extra,
        label_tolerance_n: header.label_tolerance_n,
        stop_m: header.stop_mm * 1e-3,
        feedback: header.feedback,
        sha256: String::new(),
    };
    measured.count_rests();
    Ok((measured, standing))
}

/// A column of unknown meaning that holds something.
fn extra_column(column: Column) -> Option<ExtraColumn> {
    let Cells::Extra(cells) = column.cells else { return None };
    Some(ExtraColumn { name: column.name, values: cells.values()? })
}

/// Adds a file to the hash: its name, its length, its content.
fn feed(hash: &mut Sha256, name: &str, bytes: &[u8]) {
    hash.update(name.as_bytes());
    hash.update([0]);
    hash.update((bytes.len() as u64).to_le_bytes());
    hash.update(bytes);
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
