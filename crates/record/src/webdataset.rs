//! A dataset as tar files for WebDataset: a sample is the files of one name, `000000012.left.png`, `.right.png`, `.json`, `.trace.npy`.
//!
//! All samples have the same keys, and there is nothing else: Hugging Face `datasets` refuses a file with other members. Rows without images
//! are left out where images are wanted; a row without a trace has one without rows. Nothing in a file depends on time, host or path.

use crate::card;
use crate::dataset::Dataset;
use crate::export::{ExportDatasetError, ExportOptions};
use gripgen_twin::{PullTrace, Values};
use serde_json::{Map, Value, json};
use std::io::Write;
use tar::{Builder, EntryType, Header};

/// Rows of a dataset that an export takes: with images all that have some. The others are failed samples.
///
/// # Errors
///
/// A row that cannot be read.
pub fn webdataset_rows(dataset: &Dataset, options: ExportOptions) -> Vec<usize> {
    let statuses = dataset.table().words("status");
    let failed = |row: usize| statuses.is_some_and(|words| words[row] == "failed");
    (0..dataset.table().rows()).filter(|&row| !options.images || !failed(row)).collect()
}

/// Writes these rows as one tar file; `on_row` is called after each. Returns how many were written: a row of measured pulls may have no
/// images.
///
/// # Errors
///
/// A row that cannot be read, or an `out` that cannot be written.
pub fn export_webdataset<W: Write>(
    dataset: &Dataset,
    rows: &[usize],
    options: ExportOptions,
    out: W,
    mut on_row: impl FnMut(),
) -> Result<usize, ExportDatasetError> {
    let mut tar = Builder::new(out);
    let mut written = 0;
    for &row in rows {
        on_row();
        let key = match dataset.sample_index(row) {
            Ok(index) => format!("{index:09}"),
            Err(_) => format!("{row:09}"),
        };
        if options.images {
            let Some([left, right]) = dataset.images_png(row)? else { continue };
            add(&mut tar, &format!("{key}.left.png"), &left)?;
            add(&mut tar, &format!("{key}.right.png"), &right)?;
        }
        let cells = serde_json::to_vec(&cells(dataset, row)).map_err(std::io::Error::from)?;
        add(&mut tar, &format!("{key}.json"), &cells)?;
        if options.traces {
            let trace = dataset.trace(row)?.unwrap_or_default();
            add(&mut tar, &format!("{key}.trace.npy"), &trace_npy(&trace))?;
        }
        written += 1;
    }
    tar.into_inner()?.flush()?;
    Ok(written)
}

fn add<W: Write>(tar: &mut Builder<W>, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    header.set_mode(0o644);
    header.set_size(bytes.len() as u64);
    header.set_mtime(0);
    tar.append_data(&mut header, name, bytes)
}

/// The cells of a row: numbers, counts as integers, words, and null where there is nothing.
fn cells(dataset: &Dataset, row: usize) -> Value {
    let cell = |name: &str, column: &Values| match column {
        Values::Words(words) if words[row].is_empty() => Value::Null,
        Values::Words(words) => json!(words[row]),
        Values::Numbers(x) if x[row].is_finite() && dataset.table().is_whole(name) => json!(x[row] as i64),
        // What is not a number is null in JSON.
        Values::Numbers(x) => json!(x[row]),
    };
    let all = dataset
        .table()
        .columns()
        .iter()
        .map(|(name, column)| (dataset.exported_name(name), cell(name, column)));
    Value::Object(all.collect::<Map<_, _>>())
}

/// A trace as an array of numpy: float32, (rows, 4) with time_s, desired_force_n, measured_force_n, displacement_mm.
fn trace_npy(trace: &PullTrace) -> Vec<u8> {
    let shape = format!("({}, 4)", trace.len());
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version and length take 10 bytes; all together are a multiple of 64 (NEP 1).
    let whole = (10 + header.len() + 1).next_multiple_of(64);
    header.extend(std::iter::repeat_n(' ', whole - 10 - header.len() - 1));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for row in trace.rows() {
        let all = [row.time_s, row.desired_force_n, row.measured_force_n, row.displacement_m * 1e3];
        bytes.extend(all.iter().flat_map(|x| (*x as f32).to_le_bytes()));
    }
    bytes
}

/// What a reader of the files is told, a page of Markdown.
pub fn webdataset_card(dataset: &Dataset) -> String {
    format!(
        "# Grips, pulls and slip\n\n\
         Each sample is a grip by two jaws with a tactile sensor each and a pull until they slip, written by gripgen.\n\n\
         - `KEY.left.png`, `KEY.right.png`: tactile images\n\
         - `KEY.json`: the columns below; `max_pull_force_n` is the label\n\
         - `KEY.trace.npy`: float32 (rows, 4): time_s, desired_force_n, measured_force_n, displacement_mm; no rows where none is stored\n\n{}\n{}{}",
        card::facts(dataset),
        card::columns(dataset, |name| dataset.exported_name(name)),
        card::configuration(dataset)
    )
}
