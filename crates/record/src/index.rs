//! The index of a run: one row per sample, so that tables can be filtered without opening a shard.

use crate::proto::gripgen_v1::{Sample, Status};
use crate::stored::{sample_covariates, sample_view};
use gripgen_twin::columns::{
    ANSWERS_OF_SAMPLE, COLUMNS, END_OF_SAMPLE, LABELS_OF_SAMPLE, PLACE_OF_SAMPLE, find,
};
use std::sync::LazyLock;

/// The fixed columns: the place of a sample, the columns of a pull, how it ended.
pub static INDEX_COLUMNS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    let of_pulls = COLUMNS.iter().filter(|c| c.indexed).map(|c| c.name);
    let ends = LABELS_OF_SAMPLE.into_iter().chain(ANSWERS_OF_SAMPLE).chain(END_OF_SAMPLE);
    PLACE_OF_SAMPLE.into_iter().chain(of_pulls).chain(ends).collect()
});

/// Columns that the first layout of the index lacks. They stand together, and `mu_effective` behind them was called `mu`.
const NOT_IN_FIRST: [&str; 7] = [
    "peak_force_n",
    "kinetic_force_n",
    "label_branch",
    "limit_force_n",
    "slip_onset_s",
    "slip_s",
    "mu_drawn",
];

fn first_of_added() -> usize {
    INDEX_COLUMNS.iter().position(|c| *c == NOT_IN_FIRST[0]).unwrap_or(INDEX_COLUMNS.len())
}

/// Brings rows of the first layout, whose header and rows are `columns` long in this one, to this one: what they lack is empty. Other rows
/// stay as they are.
pub(crate) fn from_first_layout(rows: &mut [Vec<String>], columns: usize) {
    if rows.iter().all(|row| row.len() + NOT_IN_FIRST.len() == columns) {
        let at = first_of_added();
        for row in rows {
            row.splice(at..at, NOT_IN_FIRST.map(|_| String::new()));
        }
    }
}

/// A row of this layout, or its header, as the first one has it.
pub(crate) fn as_in_first_layout(row: &[String]) -> Vec<String> {
    let (before, after) = (&row[..first_of_added()], &row[first_of_added() + NOT_IN_FIRST.len()..]);
    let name = |cell: &String| if cell == "mu_effective" { "mu".into() } else { cell.clone() };
    before.iter().chain(after).map(name).collect()
}

/// The name of a status in the index and on screens.
pub fn status_name(status: Status) -> &'static str {
    match status {
        Status::Unspecified => "unspecified",
        Status::Slipped => "slipped",
        Status::Censored => "censored",
        Status::NoContact => "no_contact",
        Status::Failed => "failed",
        Status::Suspect => "suspect",
    }
}

/// The cells of a sample's row; `shard` and `in_shard` are left empty for the writer of the shard.
pub fn index_row(sample: &Sample, extra_columns: &[String]) -> Vec<String> {
    let optional = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let covariates = sample_covariates(sample);
    let of_pull = |name: &str| {
        find(name).map_or(String::new(), |column| column.cell(sample_view(sample, &covariates)).into_owned())
    };
    let mut row: Vec<String> = INDEX_COLUMNS
        .iter()
        .map(|&column| match column {
            "index" => sample.index.to_string(),
            // Those of the writer of the shard.
            "shard" | "in_shard" => String::new(),
            "status" => status_name(sample.status()).into(),
            "max_pull_force_n" => optional(sample.max_pull_force_n),
            "slip_time_s" => optional(sample.slip_time_s),
            "peak_force_n" => optional(sample.peak_force_n),
            "kinetic_force_n" => optional(sample.kinetic_force_n),
            "label_branch" => sample.label_branch.clone(),
            "limit_force_n" => optional(sample.limit_force_n),
            "slip_onset_s" => optional(sample.slip_onset_s),
            "slip_s" => optional(sample.slip_s),
            "mu_drawn" => optional(sample.mu_drawn),
            "mu_effective" => optional(sample.mu_effective),
            "group" => sample.group.to_string(),
            "repetition" => sample.repetition.to_string(),
            // One column for both: why there is no label, or none to be relied on.
            "failure" if sample.status() == Status::Suspect => sample.status_reason.clone(),
            "failure" => sample.failure.clone(),
            // It was not measured.
            "temperature_c" if sample.temperature_c.is_nan() => String::new(),
            name => of_pull(name),
        })
        .collect();
    for key in extra_columns {
        let number = sample.drawn_number.get(key).map(f64::to_string);
        row.push(number.or_else(|| sample.drawn_text.get(key).cloned()).unwrap_or_default());
    }
    row
}

/// Which drawn keys get a column of their own: those that no fixed column shows.
pub fn extra_columns<'a>(varied: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let shown = |key: &str| COLUMNS.iter().any(|column| column.indexed && column.sweep_key() == key);
    let fixed = |key: &str| INDEX_COLUMNS.contains(&key);
    varied.into_iter().filter(|key| !fixed(key) && !shown(key)).map(String::from).collect()
}

/// The header of `index.csv`.
pub fn index_header(extra_columns: &[String]) -> Vec<String> {
    INDEX_COLUMNS.iter().map(|c| c.to_string()).chain(extra_columns.iter().cloned()).collect()
}

/// Rows as lines of CSV.
pub fn csv_lines<'a>(rows: impl IntoIterator<Item = &'a Vec<String>>) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    for row in rows {
        writer.write_record(row).expect("writing to memory cannot fail");
    }
    writer.into_inner().expect("writing to memory cannot fail")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_first_layout_come_to_this_one_and_back() {
        let extra = ["lamp".to_string()];
        let header = index_header(&extra);
        let first = as_in_first_layout(&header);
        assert_eq!(first.len() + 7, header.len());
        let place = first.iter().position(|name| name == "slip_time_s").unwrap();
        assert_eq!(first[place..], ["slip_time_s", "mu", "group", "repetition", "failure", "lamp"]);
        let mut rows: Vec<Vec<String>> = vec![(0..first.len()).map(|k| k.to_string()).collect(); 2];
        let before = rows.clone();
        from_first_layout(&mut rows, header.len());
        let cell = |name: &str| rows[1][header.iter().position(|h| h == name).unwrap()].as_str();
        assert_eq!((cell("peak_force_n"), cell("mu_effective")), ("", (place + 1).to_string().as_str()));
        assert_eq!(rows.iter().map(|row| as_in_first_layout(row)).collect::<Vec<_>>(), before);
        let whole = rows.clone();
        from_first_layout(&mut rows, header.len());
        assert_eq!(rows, whole, "rows of this layout stay as they are");
    }
}
