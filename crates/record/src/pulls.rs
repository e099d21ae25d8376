//! A folder of measured pulls: `pulls.csv`, and where they are there `campaign.toml` and `traces/<pull_id>.csv`.

mod cells;
mod images;
mod standing;
#[cfg(test)]
mod tests;
mod trace;
mod write;

pub use images::{PullImages, PullImagesError, pulls_with_images, read_pull_images};
pub use standing::{JudgedPulls, Standing};
pub use write::write_pull_folder;

use crate::campaign::{CAMPAIGN_FILE, CampaignFileError, CampaignHeader, LabelEvidenceKind, parse_header};
use crate::proto::gripgen_v1::Status;
use cells::{Cells, Column};
use gripgen_twin::config::PullFile;
use gripgen_twin::{Covariates, ExtraColumn, MeasuredPull, MeasuredPulls, Values};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The table of a folder of measured pulls.
pub const PULLS_FILE: &str = "pulls.csv";

/// The folder of the traces beside it.
pub const TRACES_FOLDER: &str = "traces";

/// Why a folder of measured pulls could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PullFolderError {
    /// A file cannot be read.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// A table lacks a column.
    #[error("{}: there is no column `{column}`; found: {found}", .path.display())]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Columns found.
        found: String,
    },
    /// Two columns have the same name.
    #[error("{}: there are two columns `{column}`", .path.display())]
    TwoColumns {
        /// The table.
        path: PathBuf,
        /// Their name.
        column: String,
    },
    /// A cell is not what its column holds.
    #[error("{}: line {line}, `{column}` is `{value}`, it must be {wanted}", .path.display())]
    Cell {
        /// The table.
        path: PathBuf,
        /// Line of the file, the header is line 1.
        line: u64,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
        /// What should.
        wanted: Cow<'static, str>,
    },
    /// Two pulls have the same name.
    #[error("{}: lines {first} and {second} are both pull `{id}`", .path.display())]
    Duplicate {
        /// The table.
        path: PathBuf,
        /// Line of the first.
        first: u64,
        /// Line of the second.
        second: u64,
        /// Their name.
        id: String,
    },
    /// A table without rows.
    #[error("{}: the table holds no rows", .path.display())]
    Empty {
        /// The table.
        path: PathBuf,
    },
    /// Rows that the table's format forbids.
    #[error("{}: {problem}", .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What the parser says.
        problem: String,
    },
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
    let bytes = read(&path)?;
    let mut hash = Sha256::new();
    feed(&mut hash, PULLS_FILE, &bytes);
    let header = campaign_header(folder, &mut hash)?;
    let (mut found, mut standing) = read_table(&path, &bytes, &header)?;
    let mut after_n = vec![Vec::new(); found.pulls.len()];
    let traces = folder.join(TRACES_FOLDER);
    let stored = trace_files(&traces)?;
    for (pull, after_n) in found.pulls.iter_mut().zip(&mut after_n).filter(|_| !stored.is_empty()) {
        let name = format!("{}.csv", pull.id);
        if !stored.contains(name.as_str()) {
            continue;
        }
        let path = traces.join(&name);
        let bytes = read(&path)?;
        feed(&mut hash, &name, &bytes);
        let (trace, after) = trace::read_trace(&path, &bytes)?;
        (pull.trace, *after_n) = (Some(trace), after);
    }
    found.sha256 = hex(&hash.finalize());
    if header.label_evidence == LabelEvidenceKind::Trace {
        standing::judge_labels(&found, &after_n, &mut standing);
    }
    Ok(JudgedPulls { pulls: found, standing })
}

fn campaign_header(folder: &Path, hash: &mut Sha256) -> Result<CampaignHeader, PullFolderError> {
    let path = folder.join(CAMPAIGN_FILE);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(CampaignHeader::default()),
        Err(e) => return Err(PullFolderError::Io { path, problem: e.to_string() }),
    };
    feed(hash, CAMPAIGN_FILE, &bytes);
    let text = String::from_utf8(bytes)
        .map_err(|e| PullFolderError::Io { path: path.clone(), problem: format!("not text: {e}") })?;
    Ok(parse_header(&path, &text)?)
}

/// Names of the files in the folder of the traces; none where there is no such folder.
fn trace_files(folder: &Path) -> Result<HashSet<String>, PullFolderError> {
    let at = |e: std::io::Error| PullFolderError::Io { path: folder.into(), problem: e.to_string() };
    match std::fs::read_dir(folder) {
        Ok(entries) => entries
            .map(|entry| entry.map(|e| e.file_name().to_string_lossy().into_owned()).map_err(at))
            .collect(),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(HashSet::new()),
        Err(e) => Err(at(e)),
    }
}

fn read_table(
    path: &Path,
    bytes: &[u8],
    header: &CampaignHeader,
) -> Result<(MeasuredPulls, Vec<Standing>), PullFolderError> {
    let table = |e: csv::Error| PullFolderError::Table { path: path.into(), problem: e.to_string() };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let mut columns = cells::columns(path, reader.headers().map_err(table)?)?;
    let mut lines: HashMap<String, u64> = HashMap::new();
    let (mut pulls, mut lines_of) = (Vec::new(), Vec::new());
    let mut row = csv::StringRecord::new();
    let plain = PullFile::default();
    while reader.read_record(&mut row).map_err(table)? {
        let line = row.position().map_or(0, csv::Position::line);
        let mut pull = MeasuredPull {
            id: String::new(),
            part: String::new(),
            grip_pose: 0,
            grip_force_n: 0.0,
            increment_n: plain.increment_n,
            start_n: None,
            step_s: cells::DEFAULT_STEP_S,
            covariates: Covariates::default(),
            max_pull_force_n: 0.0,
            trace: None,
        };
        for (column, cell) in columns.iter_mut().zip(row.iter()) {
            column.take(cell, &mut pull).map_err(|wanted| PullFolderError::Cell {
                path: path.into(),
                line,
                column: column.name.clone(),
                value: cell.into(),
                wanted,
            })?;
        }
        pull.grip_force_n = header.per_jaw_n(pull.grip_force_n);
        if let Some(first) = lines.insert(pull.id.clone(), line) {
            return Err(PullFolderError::Duplicate { path: path.into(), first, second: line, id: pull.id });
        }
        pulls.push(pull);
        lines_of.push(line);
    }
    if pulls.is_empty() {
        return Err(PullFolderError::Empty { path: path.into() });
    }
    let standing = standing::stated(&columns, &mut pulls).map_err(|row| PullFolderError::Cell {
        path: path.into(),
        line: lines_of[row],
        column: "max_pull_force_n".into(),
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
    let values = Values::of_cells(cells.iter().map(|cell| &**cell))?;
    Some(ExtraColumn { name: column.name, values })
}

fn read(path: &Path) -> Result<Vec<u8>, PullFolderError> {
    std::fs::read(path).map_err(|e| PullFolderError::Io { path: path.into(), problem: e.to_string() })
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
