//! A folder of measured pulls: `pulls.csv`, and where they are there `campaign.toml` and `traces/<pull_id>.csv`.

mod cells;
mod clock;
mod counts;
mod gaps;
mod images;
mod plan;
mod spelling;
mod standing;
mod strays;
#[cfg(test)]
mod tests;
mod trace;
mod traces;
mod write;
mod zero;

pub use gaps::MissingCells;
pub(crate) use gaps::{SAY_NOTHING, fill as fill_missing};
pub use images::{PullImages, pulls_with_images, read_pull_images};
pub use standing::{JudgedPulls, Standing};
pub use write::write_pull_folder;

use crate::campaign::{CAMPAIGN_FILE, CampaignFileError, CampaignHeader, LabelEvidenceKind, parse_header};
use crate::table::{TableError, TableReader, read_bytes};
use cells::{CLOCK, Cells, Column, DEFAULT_STEP_S};
use clock::Clock;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_twin::columns::{COLUMNS, InTable};
use gripgen_twin::config::PullFile;
use gripgen_twin::{Covariates, ExtraColumn, MeasuredPull, MeasuredPulls, Values};
use sha2::{Digest, Sha256};
use standing::judge_labels;
use std::collections::HashMap;
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
/// Columns stand in any order; `pull_id, part, grip_force_n, max_pull_force_n` have to be there. A cell that is empty, `n/a`, `-`,
/// `NaN` or the like is missing: clocks and counts are interpolated in the order of the rows, other columns have a mask
/// ([`Covariates::missing`]), and a pull without a part, a grip force or a label is left out. A column without any value was not
/// recorded and has the default of [`Covariates`]; without a word on the staircase and
/// without traces the command rises steadily. Further columns are covariates of unknown
/// meaning: numbers if nearly every cell is one or missing, else words; columns without a name or without a value are left out.
/// Pulls stay in the order of the table. Pulls that did not slip, and those whose label is suspect, are left out.
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
    let mut judged = read_table(&path, &bytes, &header)?;
    warnings.append(&mut judged.warnings);
    for look in [strays::words_among_numbers, strays::numbers_with_units, strays::nearly_known] {
        warnings.extend(look(&path, &judged.pulls));
    }
    let (after_n, said) = traces::read_traces(folder, &mut judged.pulls, &mut |name, bytes| {
        feed(&mut hash, name, bytes);
    })?;
    warnings.extend(said);
    judged.pulls.sha256 = hex(&hash.finalize());
    if header.label_evidence == LabelEvidenceKind::Trace {
        judge_labels(&judged.pulls, &after_n, &mut judged.standing);
    }
    Ok(JudgedPulls { every_reading: header.every_reading, warnings, ..judged })
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

/// Reads a table of pulls from its content; `path` is for errors.
fn read_table(path: &Path, bytes: &[u8], header: &CampaignHeader) -> Result<JudgedPulls, TableError> {
    let mut table = TableReader::new(path, bytes)?;
    let mut columns = cells::columns(&mut table)?;
    let mut lines: HashMap<String, u64> = HashMap::new();
    let mut pulls = Vec::new();
    let plain = PullFile::default();
    while let Some(row) = table.row()? {
        let mut pull = MeasuredPull {
            id: String::new(),
            part: String::new(),
            grip_pose: 0,
            grip_force_n: f64::NAN,
            increment_n: plain.increment_n,
            start_n: None,
            step_s: DEFAULT_STEP_S,
            covariates: Covariates::default(),
            max_pull_force_n: 0.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        for (place, column) in columns.iter_mut().enumerate() {
            column.take(&row, (place, pulls.len()), &mut pull)?;
        }
        pull.grip_force_n = header.per_jaw_n(pull.grip_force_n);
        if let Some(first) = lines.insert(pull.id.clone(), row.line) {
            let problem = format!("lines {first} and {} are both pull `{}`", row.line, pull.id);
            return Err(TableError::Rows { path: path.into(), problem });
        }
        pulls.push(pull);
    }
    if pulls.is_empty() {
        return Err(TableError::Empty { path: path.into() });
    }
    let mut said = Vec::new();
    said.extend(clock_times(path, &columns, &mut pulls)?);
    let mut missing = MissingCells::default();
    for column in columns.iter().filter(|c| c.filled > 0 && !c.missing.is_empty()) {
        let Cells::Known(known) = column.cells else { continue };
        let becomes = gaps::fill(known, &column.missing, &mut pulls);
        if known.in_table != InTable::Required {
            missing.add(&column.name, column.missing.len(), becomes);
        }
    }
    let standing = standing::stated(&columns, &mut pulls);
    for column in columns.iter().filter(|column| column.is_required()) {
        // A pull that failed needs none of them.
        let lacks = column.missing.iter().filter(|&&row| standing[row].lacks_value).count();
        missing.add(&column.name, lacks, gaps::LEFT_OUT);
    }
    let recorded: Vec<String> = columns.iter().filter_map(Column::recorded).collect();
    let has = |name: &str| recorded.iter().any(|column| column == name);
    if has(CLOCK) {
        said.extend(counts::from_the_first(&mut pulls));
        said.extend(counts::goes_back(&pulls));
    }
    if has("pull_index") && has("gel_id") {
        said.extend(counts::per_gel(&mut pulls));
    }
    let mut extra = Vec::new();
    for column in columns {
        let Cells::Extra(cells) = column.cells else { continue };
        let Some((mut values, words)) = cells.values_but_words() else { continue };
        if let Values::Words(words) = &mut values {
            said.extend(spelled(&column.name, &spelling::one_of_each(words)));
        }
        said.extend(few_words(&column.name, &words, pulls.len()));
        missing.add(&column.name, column.missing.len() + words.len(), SAY_NOTHING);
        extra.push(ExtraColumn { name: column.name, values });
    }
    said.extend(known_spellings(&mut pulls));
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
    measured.count();
    let warnings = said.into_iter().map(|said| format!("{}: {said}", path.display())).collect();
    Ok(JudgedPulls { pulls: measured, standing, every_reading: false, missing, warnings })
}

/// Seconds of a column of clock times.
fn clock_times(
    path: &Path,
    columns: &[Column],
    pulls: &mut [MeasuredPull],
) -> Result<Option<String>, TableError> {
    let Some(column) = columns.iter().find(|column| !column.clocks.is_empty()) else { return Ok(None) };
    let clocks: Vec<Clock> = column.clocks.iter().map(|(.., clock)| *clock).collect();
    let seconds = clock::from_the_first(&clocks).filter(|_| clocks.len() == column.filled);
    let Some(seconds) = seconds else {
        let line = column.clocks[0].1;
        let problem = format!(
            "line {line}, `{}` is a clock time, and other rows have a number, or a date where it has none: write all of them alike",
            column.name
        );
        return Err(TableError::Rows { path: path.into(), problem });
    };
    for ((row, ..), time_s) in column.clocks.iter().zip(seconds) {
        pulls[*row].covariates.time_s = time_s;
    }
    Ok(Some(format!(
        "{} has clock times: they were taken as seconds from the earliest of them on",
        column.name
    )))
}

/// Words of known columns in one spelling each.
fn known_spellings(pulls: &mut [MeasuredPull]) -> Vec<String> {
    let mut said = Vec::new();
    for column in COLUMNS.iter().filter(|c| c.holds_words() && c.in_table != InTable::Absent) {
        let word = |pull: &MeasuredPull| column.word(pull.view()).unwrap_or_default().to_string();
        let mut words: Vec<String> = pulls.iter().map(word).collect();
        let given_up = spelling::one_of_each(&mut words);
        if !given_up.is_empty() {
            let known = pulls.iter_mut().zip(&words).filter(|(_, word)| !word.is_empty());
            known.for_each(|(pull, word)| column.set_word(&mut pull.edit(), word));
        }
        said.extend(spelled(column.name, &given_up));
    }
    said
}

fn spelled(column: &str, given_up: &[(String, String)]) -> Option<String> {
    let pairs: Vec<String> =
        given_up.iter().map(|(other, taken)| format!("`{other}` as `{taken}`")).collect();
    (!pairs.is_empty()).then(|| {
        format!("{column}: names that differ in capitals or blanks alone are one, {}", pairs.join(", "))
    })
}

fn few_words(column: &str, words: &[(usize, String)], rows: usize) -> Option<String> {
    let (_, first) = words.first()?;
    Some(format!(
        "the column {column} is one of numbers: {} of {rows} cells are words (`{first}`) and count as missing",
        words.len()
    ))
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
