//! A dataset as one Parquet file: for tools that read tables with images in them.
//!
//! Columns are those of the table, then `left_png` and `right_png` (the images as PNG bytes; of a rig also `left_rest_png`
//! and `right_rest_png`, those without contact), then `trace_time_s`,
//! `trace_desired_force_n`, `trace_measured_force_n` and `trace_displacement_mm` (lists of float). What is not there is
//! null. Nothing in the file depends on time, host or path.

use crate::dataset::{Dataset, DatasetError};
use crate::mark::{EXPORT, MARK_NAME};
use gripgen_twin::Values;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use std::io::Write;
use std::sync::Arc;

/// Rows of a row group: about 50 MB with images.
const GROUP_ROWS: usize = 256;

/// What goes into the file beside the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParquetOptions {
    /// Both images of each row.
    pub images: bool,
    /// Its force over time.
    pub traces: bool,
}

/// Why a dataset could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportParquetError {
    /// The dataset.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The file.
    #[error("Parquet: {0}")]
    Parquet(#[from] ParquetError),
}

/// Writes all rows of `dataset` into `out`; `on_rows` is told how many are written so far.
///
/// # Errors
///
/// A row that cannot be read, or an `out` that cannot be written.
pub fn export_parquet<W: Write + Send>(
    dataset: &Dataset,
    options: ParquetOptions,
    out: W,
    mut on_rows: impl FnMut(usize),
) -> Result<(), ExportParquetError> {
    let mark = KeyValue::new(MARK_NAME.into(), EXPORT.to_string());
    let properties = WriterProperties::builder()
        .set_created_by("gripgen".into())
        .set_key_value_metadata(Some(vec![mark]))
        .build();
    let mut writer = SerializedFileWriter::new(out, schema(dataset, options)?, Arc::new(properties))?;
    let rows = dataset.table().rows();
    for first in (0..rows).step_by(GROUP_ROWS) {
        let group: Vec<usize> = (first..(first + GROUP_ROWS).min(rows)).collect();
        let mut out = writer.next_row_group()?;
        for (_, column) in dataset.table().columns() {
            match column {
                Values::Numbers(x) => write_numbers(&mut out, group.iter().map(|&row| x[row]))?,
                Values::Words(words) => {
                    let cell = |row: usize| Some(words[row].as_bytes().to_vec()).filter(|w| !w.is_empty());
                    write_bytes(&mut out, group.iter().map(|&row| cell(row)))?;
                }
            }
        }
        if options.images {
            let images: Vec<_> =
                group.iter().map(|&row| dataset.images_png(row)).collect::<Result<_, DatasetError>>()?;
            for jaw in 0..2 {
                write_bytes(&mut out, images.iter().map(|both| both.as_ref().map(|b| b[jaw].clone())))?;
            }
        }
        if options.images && dataset.has_rest() {
            let rest: Vec<_> =
                group.iter().map(|&row| dataset.rest_png(row)).collect::<Result<_, DatasetError>>()?;
            for jaw in 0..2 {
                write_bytes(&mut out, rest.iter().map(|both| both.as_ref().map(|b| b[jaw].clone())))?;
            }
        }
        if options.traces {
            let traces: Vec<_> =
                group.iter().map(|&row| dataset.trace(row)).collect::<Result<_, DatasetError>>()?;
            let lists = |of: &dyn Fn(&gripgen_twin::PullTrace) -> Vec<f32>| {
                traces.iter().map(|t| t.as_ref().map(of)).collect::<Vec<_>>()
            };
            let narrow = |x: &[f64], factor: f64| x.iter().map(|v| (v * factor) as f32).collect();
            write_lists(&mut out, &lists(&|t| narrow(&t.time_s, 1.0)))?;
            write_lists(&mut out, &lists(&|t| narrow(&t.desired_force_n, 1.0)))?;
            write_lists(&mut out, &lists(&|t| narrow(&t.measured_force_n, 1.0)))?;
            write_lists(&mut out, &lists(&|t| narrow(&t.displacement_m, 1e3)))?;
        }
        out.close()?;
        on_rows(first + group.len());
    }
    writer.close()?;
    Ok(())
}

fn schema(dataset: &Dataset, options: ParquetOptions) -> Result<TypePtr, ParquetError> {
    let leaf = |name: &str, physical: Physical, logical: Option<LogicalType>, repetition: Repetition| {
        let leaf = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        leaf.with_logical_type(logical).build().map(Arc::new)
    };
    let mut fields = Vec::new();
    for (name, column) in dataset.table().columns() {
        fields.push(match column {
            Values::Numbers(_) => leaf(name, Physical::DOUBLE, None, Repetition::OPTIONAL)?,
            Values::Words(_) => {
                leaf(name, Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL)?
            }
        });
    }
    if options.images {
        let rest = ["left_rest_png", "right_rest_png"].into_iter().filter(|_| dataset.has_rest());
        for name in ["left_png", "right_png"].into_iter().chain(rest) {
            fields.push(leaf(name, Physical::BYTE_ARRAY, None, Repetition::OPTIONAL)?);
        }
    }
    if options.traces {
        let names = ["time_s", "desired_force_n", "measured_force_n", "displacement_mm"];
        for name in names.map(|name| format!("trace_{name}")) {
            let element = leaf("element", Physical::FLOAT, None, Repetition::REQUIRED)?;
            let list = Type::group_type_builder("list")
                .with_repetition(Repetition::REPEATED)
                .with_fields(vec![element])
                .build()?;
            let outer = Type::group_type_builder(&name)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(Some(LogicalType::List))
                .with_fields(vec![Arc::new(list)])
                .build()?;
            fields.push(Arc::new(outer));
        }
    }
    Ok(Arc::new(Type::group_type_builder("pulls").with_fields(fields).build()?))
}

type Group<'a, W> = SerializedRowGroupWriter<'a, W>;

fn lacks_a_column() -> ParquetError {
    ParquetError::General("the schema has fewer columns than the table".into())
}

fn write_numbers<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f64>,
) -> Result<(), ParquetError> {
    let mut column = group.next_column()?.ok_or_else(lacks_a_column)?;
    let values: Vec<f64> = values.collect();
    let levels: Vec<i16> = values.iter().map(|x| i16::from(!x.is_nan())).collect();
    let there: Vec<f64> = values.into_iter().filter(|x| !x.is_nan()).collect();
    column.typed::<DoubleType>().write_batch(&there, Some(&levels), None)?;
    column.close()
}

fn write_bytes<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = Option<Vec<u8>>>,
) -> Result<(), ParquetError> {
    let mut column = group.next_column()?.ok_or_else(lacks_a_column)?;
    let (mut levels, mut there) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        there.extend(value.map(ByteArray::from));
    }
    column.typed::<ByteArrayType>().write_batch(&there, Some(&levels), None)?;
    column.close()
}

/// Lists: level 0 is no list, 1 an empty one, 2 an element; elements after the first repeat at level 1.
fn write_lists<W: Write + Send>(
    group: &mut Group<'_, W>,
    lists: &[Option<Vec<f32>>],
) -> Result<(), ParquetError> {
    let mut column = group.next_column()?.ok_or_else(lacks_a_column)?;
    let (mut defined, mut repeated, mut there) = (Vec::new(), Vec::new(), Vec::new());
    for list in lists {
        match list {
            None => defined.push(0),
            Some(list) if list.is_empty() => defined.push(1),
            Some(list) => {
                defined.extend(std::iter::repeat_n(2, list.len()));
                repeated.push(0);
                repeated.extend(std::iter::repeat_n(1, list.len() - 1));
                there.extend_from_slice(list);
                continue;
            }
        }
        repeated.push(0);
    }
    column.typed::<FloatType>().write_batch(&there, Some(&defined), Some(&repeated))?;
    column.close()
}
