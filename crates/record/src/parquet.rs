//! A dataset as one Parquet file: for tools that read tables with images in them.
//!
//! Columns are those of the table, then `left_png` and `right_png` (the images: a struct of `bytes`, the PNG, and an empty `path`; of a rig also `left_rest_png`
//! and `right_rest_png`, those without contact), then `trace_time_s`,
//! `trace_desired_force_n`, `trace_measured_force_n` and `trace_displacement_mm` (lists of float). What is not there is
//! null; columns that count something are integers. Nothing in the file depends on time, host or path.

mod columns;

pub(crate) use columns::{
    Field, Group, Kind, TRACE, write_all_numbers, write_bytes, write_images, write_lists, write_small,
    write_traces, write_values, write_whole, write_word_lists,
};

use crate::dataset::{Dataset, DatasetError};
use crate::export::{ExportDatasetError, ExportOptions};
use columns::{huggingface, schema};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use std::io::Write;
use std::sync::Arc;

/// Rows of a row group: about 50 MB with images.
const GROUP_ROWS: usize = 256;

/// Writes all rows of `dataset` into `out`; `on_rows` is told how many are written so far.
///
/// # Errors
///
/// A row that cannot be read, or an `out` that cannot be written.
pub fn export_parquet<W: Write + Send>(
    dataset: &Dataset,
    options: ExportOptions,
    out: W,
    mut on_rows: impl FnMut(usize),
) -> Result<(), ExportDatasetError> {
    let fields = fields(dataset, options);
    let mut writer = file(out, "pulls", &fields)?;
    let rows = dataset.table().rows();
    for first in (0..rows).step_by(GROUP_ROWS) {
        let group: Vec<usize> = (first..(first + GROUP_ROWS).min(rows)).collect();
        let mut out = writer.next_row_group()?;
        for ((_, column), field) in dataset.table().columns().iter().zip(&fields) {
            write_values(&mut out, field.kind, column, &group)?;
        }
        if options.images {
            write_both(&mut out, &group, |row| dataset.images_png(row))?;
        }
        if options.images && dataset.has_rest() {
            write_both(&mut out, &group, |row| dataset.rest_png(row))?;
        }
        if options.traces {
            let traces: Vec<_> =
                group.iter().map(|&row| dataset.trace(row)).collect::<Result<_, DatasetError>>()?;
            write_traces(&mut out, &traces)?;
        }
        out.close()?;
        on_rows(first + group.len());
    }
    writer.close()?;
    Ok(())
}

/// A writer of a file of these columns.
pub(crate) fn file<W: Write + Send>(
    out: W,
    name: &str,
    fields: &[Field],
) -> Result<SerializedFileWriter<W>, ParquetError> {
    file_with(out, name, fields, vec![KeyValue::new("huggingface".into(), huggingface(fields))])
}

/// The same with further keys of its metadata in place of the features.
pub(crate) fn file_with<W: Write + Send>(
    out: W,
    name: &str,
    fields: &[Field],
    keys: Vec<KeyValue>,
) -> Result<SerializedFileWriter<W>, ParquetError> {
    let properties = WriterProperties::builder()
        .set_created_by("gripgen".into())
        .set_key_value_metadata(Some(keys))
        .build();
    SerializedFileWriter::new(out, schema(name, fields)?, Arc::new(properties))
}

/// Images of both jaws, a column each.
fn write_both<W: Write + Send>(
    out: &mut Group<'_, W>,
    rows: &[usize],
    of: impl Fn(usize) -> Result<Option<[Vec<u8>; 2]>, DatasetError>,
) -> Result<(), ExportDatasetError> {
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for &row in rows {
        let (l, r) = of(row)?.map_or((None, None), |[l, r]| (Some(l), Some(r)));
        left.push(l);
        right.push(r);
    }
    write_images(out, left)?;
    write_images(out, right)?;
    Ok(())
}

fn fields(dataset: &Dataset, options: ExportOptions) -> Vec<Field> {
    let table = dataset.table();
    let mut fields: Vec<Field> = table
        .columns()
        .iter()
        .map(|(name, values)| Field::of(&dataset.exported_name(name), values, table.is_whole(name)))
        .collect();
    if options.images {
        let rest = ["left_rest_png", "right_rest_png"].into_iter().filter(|_| dataset.has_rest());
        fields.extend(
            ["left_png", "right_png"].into_iter().chain(rest).map(|name| Field::new(name, Kind::Image)),
        );
    }
    if options.traces {
        fields.extend(TRACE.map(|name| Field::new(format!("trace_{name}"), Kind::List(None))));
    }
    fields
}
