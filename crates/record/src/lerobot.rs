//! A dataset as a LeRobot dataset, version 3.0: a folder of Parquet files with images as PNG, never as video.
//!
//! An episode is a pull, and has one frame: the grip, with both images as they were taken, what was set, the label, and the pull as four
//! lists of one length (rows evenly spread over the pull). Nothing in the files depends on time, host or path.
//!
//! Layout and keys: `lerobot` 0.4 (`lerobot/datasets/utils.py`, `lerobot_dataset.py`), Apache-2.0.

mod statistics;

use crate::card;
use crate::dataset::Dataset;
use crate::export::{ExportDatasetError, ExportOptions};
use crate::parquet::{
    Field, Group, Kind, TRACE, file, file_with, write_all_numbers, write_bytes, write_images, write_lists,
    write_small, write_traces, write_values, write_whole, write_word_lists,
};
use gripgen_twin::columns::find;
use gripgen_twin::{PullTrace, Values};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use serde_json::{Map, Value, json};
use statistics::Statistics;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// The card of the folder.
const LEROBOT_CARD: &str = "README.md";

/// Bytes of images of a data file, and rows of a row group.
const FILE_BYTES: usize = 100 << 20;
const GROUP_ROWS: usize = 64;
/// Files of a chunk.
const CHUNK: usize = 1000;
/// Points of a trace.
const POINTS: usize = 128;
/// Frames per second of an episode of one frame: any number will do.
const FPS: usize = 1;
/// Columns that a LeRobot dataset has already.
const TAKEN: [&str; 7] =
    ["timestamp", "frame_index", "episode_index", "index", "task_index", "task", "subtask_index"];
const STATE: &str = "observation.state";
const IMAGES: [&str; 2] = ["observation.images.left", "observation.images.right"];

/// Writes `dataset` into a folder that is there and empty; `on_row` is called after each row. Returns the number of episodes: rows without
/// what is wanted are left out.
///
/// # Errors
///
/// A row that cannot be read, a file that cannot be written, or nothing to write.
pub fn export_lerobot(
    dataset: &Dataset,
    options: ExportOptions,
    out: &Path,
    mut on_row: impl FnMut(),
) -> Result<usize, ExportDatasetError> {
    let table = dataset.table();
    let layout = Layout::of(dataset, options);
    let tasks = tasks(dataset);
    let mut statistics = Statistics::default();
    let mut rows_of_files: Vec<Vec<usize>> = Vec::new();
    let mut episodes = 0;
    let mut pending = Vec::new();
    let mut rows = 0..table.rows();
    loop {
        // Rows of one data file at a time are in memory.
        let mut bytes = 0;
        while bytes < FILE_BYTES {
            let Some(row) = rows.next() else { break };
            on_row();
            let Some(frame) = frame(dataset, options, row)? else { continue };
            bytes += frame.images.iter().map(Vec::len).sum::<usize>() + 16 * POINTS;
            statistics.take(&layout.state_of(table, row), &frame);
            pending.push(frame);
        }
        if pending.is_empty() {
            break;
        }
        let path = out.join(data_path(rows_of_files.len()));
        write_data(&path, dataset, &layout, &tasks, &pending, episodes)?;
        episodes += pending.len();
        rows_of_files.push(pending.drain(..).map(|frame| frame.row).collect());
    }
    if episodes == 0 {
        return Err(ExportDatasetError::Empty(options));
    }
    write_tasks(&out.join("meta/tasks.parquet"), &tasks)?;
    write_episodes(&out.join("meta/episodes/chunk-000/file-000.parquet"), dataset, &rows_of_files, &tasks)?;
    let info = info(dataset, &layout, episodes, tasks.len());
    write_text(&out.join("meta/info.json"), &format!("{info:#}\n"))?;
    let stats = statistics.json(&layout.state, options.images);
    write_text(&out.join("meta/stats.json"), &format!("{stats:#}\n"))?;
    write_text(&out.join(LEROBOT_CARD), &readme(dataset, &layout, episodes))?;
    Ok(episodes)
}

/// A row with what is stored of it.
struct Frame {
    row: usize,
    images: Vec<Vec<u8>>,
    trace: Option<PullTrace>,
}

fn frame(dataset: &Dataset, options: ExportOptions, row: usize) -> Result<Option<Frame>, ExportDatasetError> {
    let images = if options.images { dataset.images_png(row)? } else { Some([vec![], vec![]]) };
    let Some(images) = images else { return Ok(None) };
    let trace = if options.traces { dataset.trace(row)? } else { None };
    let trace = trace.as_ref().and_then(even);
    if options.traces && trace.is_none() {
        return Ok(None);
    }
    let images = if options.images { images.to_vec() } else { vec![] };
    Ok(Some(Frame { row, images, trace }))
}

/// So many rows, evenly spread from the first to the last one; nothing of a trace without rows.
fn even(trace: &PullTrace) -> Option<PullTrace> {
    let rows: Vec<_> = trace.rows().collect();
    let last = rows.len().checked_sub(1)?;
    Some((0..POINTS).map(|i| rows[i * last / (POINTS - 1)]).collect())
}

/// Which columns there are, and what they are called.
struct Layout {
    options: ExportOptions,
    /// Numbers of the table that a robot knows before the pull: the state.
    state: Vec<String>,
    /// Columns of the table by their names there and in the files, with what they hold.
    cells: Vec<(String, Field)>,
}

impl Layout {
    fn of(dataset: &Dataset, options: ExportOptions) -> Self {
        let table = dataset.table();
        let numbers = |name: &str| table.numbers(name).is_some_and(|x| x.iter().all(|x| x.is_finite()));
        let known = |name: &str| find(name).is_some_and(|c| c.known_to_rig) && numbers(name);
        let names = table.columns().iter().map(|(name, _)| name.clone());
        let state = names.filter(|name| known(name)).collect();
        let cells = table.columns().iter().map(|(name, values)| {
            // A whole number that is not there has no integer.
            let whole = table.is_whole(name) && numbers(name);
            (name.clone(), Field::of(&renamed(dataset, name), values, whole))
        });
        Self { options, state, cells: cells.collect() }
    }

    fn state_of(&self, table: &crate::Table, row: usize) -> Vec<f32> {
        self.state.iter().filter_map(|name| Some(table.numbers(name)?[row] as f32)).collect()
    }

    fn fields(&self) -> Vec<Field> {
        let mut fields = Vec::new();
        if self.options.images {
            fields.extend(IMAGES.map(|name| Field::new(name, Kind::Image)));
        }
        if !self.state.is_empty() {
            // One number has no list.
            let kind = if self.state.len() == 1 { Kind::Small } else { Kind::List(Some(self.state.len())) };
            fields.push(Field::new(STATE, kind));
        }
        if self.options.traces {
            fields.extend(TRACE.map(|name| Field::new(format!("trace.{name}"), Kind::List(Some(POINTS)))));
        }
        fields.extend(self.cells.iter().map(|(_, field)| field.clone()));
        fields.push(Field::new("timestamp", Kind::Small));
        fields.extend(TAKEN[1..5].iter().map(|name| Field::new(*name, Kind::Whole)));
        fields
    }
}

/// What a column of the table is called: LeRobot has an `index` of its own, and no slashes.
fn renamed(dataset: &Dataset, name: &str) -> String {
    match name {
        "index" => "sample_index".into(),
        name if TAKEN.contains(&name) => format!("pull.{name}"),
        name => dataset.exported_name(name).replace('/', "_"),
    }
}

fn data_path(file: usize) -> String {
    format!("data/chunk-{:03}/file-{:03}.parquet", file / CHUNK, file % CHUNK)
}

fn created(path: &Path) -> Result<BufWriter<File>, ExportDatasetError> {
    let at = |source| ExportDatasetError::Write { path: path.into(), source };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(at)?;
    }
    File::create_new(path).map(BufWriter::new).map_err(at)
}

fn write_text(path: &Path, text: &str) -> Result<(), ExportDatasetError> {
    use std::io::Write;
    let mut file = created(path)?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.flush());
    written.map_err(|source| ExportDatasetError::Write { path: path.into(), source })
}

fn write_data(
    path: &Path,
    dataset: &Dataset,
    layout: &Layout,
    tasks: &BTreeMap<String, usize>,
    frames: &[Frame],
    first: usize,
) -> Result<(), ExportDatasetError> {
    let table = dataset.table();
    let mut writer = file(created(path)?, "frames", &layout.fields())?;
    for (group, frames) in frames.chunks(GROUP_ROWS).enumerate() {
        let first = first + group * GROUP_ROWS;
        let rows: Vec<usize> = frames.iter().map(|frame| frame.row).collect();
        let mut out = writer.next_row_group()?;
        for jaw in (0..2).filter(|_| layout.options.images) {
            write_images(&mut out, frames.iter().map(|frame| Some(frame.images[jaw].clone())).collect())?;
        }
        match layout.state.len() {
            0 => {}
            1 => write_small(&mut out, rows.iter().map(|&row| layout.state_of(table, row)[0]))?,
            _ => {
                let states: Vec<_> = rows.iter().map(|&row| Some(layout.state_of(table, row))).collect();
                write_lists(&mut out, &states)?;
            }
        }
        if layout.options.traces {
            write_traces(&mut out, &frames.iter().map(|frame| frame.trace.clone()).collect::<Vec<_>>())?;
        }
        for (name, field) in &layout.cells {
            let column = table.columns().iter().find(|(n, _)| n == name);
            if let Some((_, values)) = column {
                write_filled(&mut out, field.kind, values, &rows)?;
            }
        }
        let zeros = || rows.iter().map(|_| 0.0);
        let numbered = || (0..rows.len()).map(|i| (first + i) as f64);
        write_small(&mut out, rows.iter().map(|_| 0.0))?;
        write_whole(&mut out, zeros())?;
        write_whole(&mut out, numbered())?;
        write_whole(&mut out, numbered())?;
        write_whole(&mut out, rows.iter().map(|&row| tasks[&task(dataset, row)] as f64))?;
        out.close()?;
    }
    writer.close()?;
    Ok(())
}

/// Cells without nulls, which its readers do not take: not a number, or an empty word.
fn write_filled<W: std::io::Write + Send>(
    out: &mut Group<'_, W>,
    kind: Kind,
    values: &Values,
    rows: &[usize],
) -> Result<(), ParquetError> {
    match (values, kind) {
        (Values::Numbers(x), Kind::Number) => write_all_numbers(out, rows.iter().map(|&row| x[row])),
        (Values::Words(words), _) => {
            write_bytes(out, rows.iter().map(|&row| Some(words[row].as_bytes().to_vec())))
        }
        _ => write_values(out, kind, values, rows),
    }
}

/// What a row is about, in words.
fn task(dataset: &Dataset, row: usize) -> String {
    let part = dataset.table().words("part").map_or("part", |parts| &parts[row]);
    format!("Grip the {part} and pull until it slips.")
}

/// The tasks in their order, numbered.
fn tasks(dataset: &Dataset) -> BTreeMap<String, usize> {
    let mut all: BTreeMap<String, usize> =
        (0..dataset.table().rows()).map(|row| (task(dataset, row), 0)).collect();
    all.values_mut().enumerate().for_each(|(i, number)| *number = i);
    all
}

/// A table of pandas with the task as its index.
fn write_tasks(path: &Path, tasks: &BTreeMap<String, usize>) -> Result<(), ExportDatasetError> {
    let fields = [Field::new("task_index", Kind::Whole), Field::new("task", Kind::Word)];
    let column = |name: &str, pandas: &str, numpy: &str| json!({"name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy, "metadata": null});
    let pandas = json!({
        "index_columns": ["task"],
        "column_indexes": [{
            "name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object",
            "metadata": {"encoding": "UTF-8"},
        }],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "creator": {"library": "gripgen", "version": "0"}, "pandas_version": "2.0.0",
    });
    let keys = vec![KeyValue::new("pandas".into(), pandas.to_string())];
    let mut writer = file_with(created(path)?, "tasks", &fields, keys)?;
    let mut out = writer.next_row_group()?;
    write_whole(&mut out, tasks.values().map(|i| *i as f64))?;
    write_bytes(&mut out, tasks.keys().map(|task| Some(task.as_bytes().to_vec())))?;
    out.close()?;
    writer.close()?;
    Ok(())
}

fn write_episodes(
    path: &Path,
    dataset: &Dataset,
    rows_of_files: &[Vec<usize>],
    tasks: &BTreeMap<String, usize>,
) -> Result<(), ExportDatasetError> {
    let names = [
        "episode_index",
        "length",
        "data/chunk_index",
        "data/file_index",
        "dataset_from_index",
        "dataset_to_index",
        "meta/episodes/chunk_index",
        "meta/episodes/file_index",
    ];
    let mut fields: Vec<Field> = names.map(|name| Field::new(name, Kind::Whole)).to_vec();
    fields.push(Field::new("tasks", Kind::Words));
    let mut writer = file(created(path)?, "episodes", &fields)?;
    let mut first = 0;
    for (number, rows) in rows_of_files.iter().enumerate() {
        let n = rows.len();
        let mut out = writer.next_row_group()?;
        let counted = |from: usize| (0..n).map(move |i| (first + from + i) as f64);
        let all = |x: usize| std::iter::repeat_n(x as f64, n);
        write_whole(&mut out, counted(0))?;
        write_whole(&mut out, all(1))?;
        write_whole(&mut out, all(number / CHUNK))?;
        write_whole(&mut out, all(number % CHUNK))?;
        write_whole(&mut out, counted(0))?;
        write_whole(&mut out, counted(1))?;
        write_whole(&mut out, all(0))?;
        write_whole(&mut out, all(0))?;
        let words: Vec<String> = rows.iter().map(|&row| task(dataset, row)).collect();
        debug_assert!(words.iter().all(|word| tasks.contains_key(word)));
        write_word_lists(&mut out, &words.iter().map(String::as_str).collect::<Vec<_>>())?;
        out.close()?;
        first += n;
    }
    writer.close()?;
    Ok(())
}

fn info(dataset: &Dataset, layout: &Layout, episodes: usize, tasks: usize) -> Value {
    let feature = |field: &Field| {
        let (width, height) = dataset.image_size_px().unwrap_or((0, 0));
        let (dtype, shape, names) = match field.kind {
            Kind::Image => ("image", json!([height, width, 3]), json!(["height", "width", "channels"])),
            Kind::List(n) => {
                let names = if field.name == STATE { json!(layout.state) } else { Value::Null };
                ("float32", json!([n.unwrap_or(0)]), names)
            }
            Kind::Small if field.name == STATE => ("float32", json!([1]), json!(layout.state)),
            Kind::Small => ("float32", json!([1]), Value::Null),
            Kind::Number => ("float64", json!([1]), Value::Null),
            Kind::Whole => ("int64", json!([1]), Value::Null),
            Kind::Word | Kind::Words => ("string", json!([1]), Value::Null),
        };
        (field.name.clone(), json!({"dtype": dtype, "shape": shape, "names": names}))
    };
    let features: Map<String, Value> = layout.fields().iter().map(feature).collect();
    json!({
        "codebase_version": "v3.0", "robot_type": "ur5e_wsg50_gelsight", "total_episodes": episodes, "total_frames": episodes,
        "total_tasks": tasks, "chunks_size": CHUNK, "data_files_size_in_mb": 100, "video_files_size_in_mb": 200,
        "fps": FPS, "splits": {"train": format!("0:{episodes}")},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": null, "features": features,
    })
}

fn readme(dataset: &Dataset, layout: &Layout, episodes: usize) -> String {
    let traces = if layout.options.traces {
        format!(
            "- `trace.time_s`, `trace.desired_force_n`, `trace.measured_force_n`, `trace.displacement_mm`: the pull, {POINTS} rows of it evenly spread; \
             times below 0 are before the pull\n"
        )
    } else {
        String::new()
    };
    format!(
        "---\nlicense: other\nlicense_name: not-chosen-yet\ntask_categories:\n- robotics\ntags:\n- LeRobot\n- tactile\nconfigs:\n- config_name: default\n\
         \x20 data_files: data/*/*.parquet\n---\n\n# Grips, pulls and slip\n\n\
         {episodes} episodes in the LeRobot format 3.0 (written by `gripgen export`): each is a grip by two jaws with a tactile sensor each and a pull until they \
         slip. An episode has one frame, the grip before the pull; `fps` says nothing.\n\n\
         - `observation.images.left`, `.right`: tactile images, PNG, without loss; there is no video\n\
         - `observation.state`: what is known before the pull: {}\n{traces}\
         - `max_pull_force_n`: the label; `status` says what it is\n- everything else that was set and drawn, below; nan and empty words stand for what is not known\n\n\
         There is no `action`: a pull is commanded by `trace.desired_force_n`. `meta/stats.json` is over all episodes (images: of evenly spread ones); episodes \
         have no statistics of their own. The split in `meta/info.json` names all of them.\n\n{}\n{}{}",
        layout.state.join(", "),
        card::facts(dataset),
        card::columns(dataset, |name| renamed(dataset, name)),
        card::configuration(dataset)
    )
}
