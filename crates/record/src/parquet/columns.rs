//! Columns of a Parquet file: their types, and what is written into them.

use gripgen_twin::{PullTrace, Values};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedRowGroupWriter;
use parquet::schema::types::{Type, TypePtr};
use serde_json::{Value, json};
use std::io::Write;
use std::sync::Arc;

/// The parts of a trace that have columns.
pub(crate) const TRACE: [&str; 4] = ["time_s", "desired_force_n", "measured_force_n", "displacement_mm"];

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A number of 64 bits.
    Number,
    /// A number of 32 bits.
    Small,
    /// An integer of 64 bits.
    Whole,
    /// UTF-8.
    Word,
    /// A PNG: a struct of `bytes` and `path`, as Hugging Face `datasets` stores images.
    Image,
    /// A list of numbers of 32 bits; so many, where that is fixed.
    List(Option<usize>),
    /// A list of words.
    Words,
}

/// A column by its name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: Kind,
}

impl Field {
    pub(crate) fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), kind }
    }

    /// A column of a table.
    pub(crate) fn of(name: &str, values: &Values, whole: bool) -> Self {
        let kind = match values {
            Values::Words(_) => Kind::Word,
            Values::Numbers(_) if whole => Kind::Whole,
            Values::Numbers(_) => Kind::Number,
        };
        Self::new(name, kind)
    }

    fn parquet(&self) -> Result<TypePtr, ParquetError> {
        const OPTIONAL: Repetition = Repetition::OPTIONAL;
        const REPEATED: Repetition = Repetition::REPEATED;
        const REQUIRED: Repetition = Repetition::REQUIRED;
        let leaf = |name: &str, physical: Physical, logical: Option<LogicalType>, repetition: Repetition| {
            let leaf = Type::primitive_type_builder(name, physical).with_repetition(repetition);
            leaf.with_logical_type(logical).build().map(Arc::new)
        };
        let text = || Some(LogicalType::String);
        let list = |element: TypePtr| {
            let list = Type::group_type_builder("list")
                .with_repetition(REPEATED)
                .with_fields(vec![element])
                .build()?;
            let outer = Type::group_type_builder(&self.name)
                .with_repetition(OPTIONAL)
                .with_logical_type(Some(LogicalType::List))
                .with_fields(vec![Arc::new(list)]);
            outer.build().map(Arc::new)
        };
        match self.kind {
            Kind::Number => leaf(&self.name, Physical::DOUBLE, None, OPTIONAL),
            Kind::Small => leaf(&self.name, Physical::FLOAT, None, OPTIONAL),
            Kind::Whole => leaf(&self.name, Physical::INT64, None, OPTIONAL),
            Kind::Word => leaf(&self.name, Physical::BYTE_ARRAY, text(), OPTIONAL),
            Kind::List(_) => list(leaf("element", Physical::FLOAT, None, REQUIRED)?),
            Kind::Words => list(leaf("element", Physical::BYTE_ARRAY, text(), REQUIRED)?),
            Kind::Image => {
                let fields = vec![
                    leaf("bytes", Physical::BYTE_ARRAY, None, OPTIONAL)?,
                    leaf("path", Physical::BYTE_ARRAY, text(), OPTIONAL)?,
                ];
                let group =
                    Type::group_type_builder(&self.name).with_repetition(OPTIONAL).with_fields(fields);
                group.build().map(Arc::new)
            }
        }
    }

    /// The feature of Hugging Face `datasets` that it is.
    fn feature(&self) -> Value {
        let value = |dtype: &str| json!({"dtype": dtype, "_type": "Value"});
        match self.kind {
            Kind::Number => value("float64"),
            Kind::Small => value("float32"),
            Kind::Whole => value("int64"),
            Kind::Word => value("string"),
            Kind::Image => json!({"_type": "Image"}),
            Kind::List(length) => {
                let length = length.map_or(-1, |n| n as i64);
                json!({"feature": value("float32"), "length": length, "_type": "Sequence"})
            }
            Kind::Words => json!({"feature": value("string"), "length": -1, "_type": "Sequence"}),
        }
    }
}

/// The schema of a file of these columns.
pub(crate) fn schema(name: &str, fields: &[Field]) -> Result<TypePtr, ParquetError> {
    let fields = fields.iter().map(Field::parquet).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder(name).with_fields(fields).build().map(Arc::new)
}

/// What stands under the key `huggingface` of a file: `datasets` then shows images without a cast.
pub(crate) fn huggingface(fields: &[Field]) -> String {
    let features: serde_json::Map<String, Value> =
        fields.iter().map(|f| (f.name.clone(), f.feature())).collect();
    json!({"info": {"features": features}}).to_string()
}

/// Where columns of a row group go.
pub(crate) type Group<'a, W> = SerializedRowGroupWriter<'a, W>;

/// Writes the next column: what is there, and the levels that say of which rows it is.
fn write<W: Write + Send, T: DataType>(
    group: &mut Group<'_, W>,
    there: &[T::T],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let lacking = || ParquetError::General("the schema has fewer columns than the table".into());
    let mut column = group.next_column()?.ok_or_else(lacking)?;
    column.typed::<T>().write_batch(there, Some(defined), repeated)?;
    column.close()
}

/// Values of which some are not there.
fn write_some<W: Write + Send, T: DataType>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let (mut levels, mut there) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        there.extend(value);
    }
    write::<W, T>(group, &there, &levels, None)
}

/// Numbers; what is none is null.
pub(crate) fn write_numbers<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f64>,
) -> Result<(), ParquetError> {
    write_some::<W, DoubleType>(group, values.map(|x| Some(x).filter(|x| !x.is_nan())))
}

/// Numbers, all of them there, whatever they are.
pub(crate) fn write_all_numbers<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f64>,
) -> Result<(), ParquetError> {
    write_some::<W, DoubleType>(group, values.map(Some))
}

/// The same of 32 bits.
pub(crate) fn write_small<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f32>,
) -> Result<(), ParquetError> {
    write_some::<W, FloatType>(group, values.map(Some))
}

/// Whole numbers; what is no number is null.
pub(crate) fn write_whole<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f64>,
) -> Result<(), ParquetError> {
    write_some::<W, Int64Type>(group, values.map(|x| Some(x).filter(|x| !x.is_nan()).map(|x| x as i64)))
}

/// Rows of a column of a table.
pub(crate) fn write_values<W: Write + Send>(
    group: &mut Group<'_, W>,
    kind: Kind,
    values: &Values,
    rows: &[usize],
) -> Result<(), ParquetError> {
    match (values, kind) {
        (Values::Numbers(x), Kind::Whole) => write_whole(group, rows.iter().map(|&row| x[row])),
        (Values::Numbers(x), _) => write_numbers(group, rows.iter().map(|&row| x[row])),
        (Values::Words(words), _) => {
            let cell = |row: usize| Some(words[row].as_bytes().to_vec()).filter(|w| !w.is_empty());
            write_bytes(group, rows.iter().map(|&row| cell(row)))
        }
    }
}

/// Images of rows: bytes, and no path.
pub(crate) fn write_images<W: Write + Send>(
    group: &mut Group<'_, W>,
    images: Vec<Option<Vec<u8>>>,
) -> Result<(), ParquetError> {
    // Level 0 is no struct, 1 one without this field, 2 a field.
    let there: Vec<bool> = images.iter().map(Option::is_some).collect();
    let bytes: Vec<ByteArray> = images.into_iter().flatten().map(ByteArray::from).collect();
    let levels = |full: i16| there.iter().map(|there| if *there { full } else { 0 }).collect::<Vec<i16>>();
    write::<W, ByteArrayType>(group, &bytes, &levels(2), None)?;
    write::<W, ByteArrayType>(group, &[], &levels(1), None)
}

/// The four columns of traces.
pub(crate) fn write_traces<W: Write + Send>(
    group: &mut Group<'_, W>,
    traces: &[Option<PullTrace>],
) -> Result<(), ParquetError> {
    for name in TRACE {
        let narrow = |t: &PullTrace| {
            let (x, factor) = match name {
                "time_s" => (&t.time_s, 1.0),
                "desired_force_n" => (&t.desired_force_n, 1.0),
                "measured_force_n" => (&t.measured_force_n, 1.0),
                _ => (&t.displacement_m, 1e3),
            };
            x.iter().map(|v| (v * factor) as f32).collect::<Vec<f32>>()
        };
        write_lists(group, &traces.iter().map(|t| t.as_ref().map(narrow)).collect::<Vec<_>>())?;
    }
    Ok(())
}

/// One word in a list for each row.
pub(crate) fn write_word_lists<W: Write + Send>(
    group: &mut Group<'_, W>,
    words: &[&str],
) -> Result<(), ParquetError> {
    let there: Vec<ByteArray> = words.iter().map(|word| ByteArray::from(word.as_bytes().to_vec())).collect();
    let (defined, repeated) = (vec![2; there.len()], vec![0; there.len()]);
    write::<W, ByteArrayType>(group, &there, &defined, Some(&repeated))
}

/// Bytes or words; `None` is null.
pub(crate) fn write_bytes<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = Option<Vec<u8>>>,
) -> Result<(), ParquetError> {
    write_some::<W, ByteArrayType>(group, values.map(|bytes| bytes.map(ByteArray::from)))
}

/// Lists: level 0 is no list, 1 an empty one, 2 an element; elements after the first repeat at level 1.
pub(crate) fn write_lists<W: Write + Send>(
    group: &mut Group<'_, W>,
    lists: &[Option<Vec<f32>>],
) -> Result<(), ParquetError> {
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
    write::<W, FloatType>(group, &there, &defined, Some(&repeated))
}
