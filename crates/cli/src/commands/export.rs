//! `gripgen export`: a sample as a file of its own, or all of them as a table or for WebDataset.

use crate::args::{ExportArgs, ExportFormat};
use crate::commands::maker;
use crate::failure::Failure;
use crate::output::{JsonSink, count};
use crate::outputs::Outputs;
use crate::progress::Progress;
use gripgen::record::{
    Dataset, ExportOptions, RunFolder, ShardReader, export_lerobot, export_parquet, export_sample,
    export_webdataset, webdataset_card, webdataset_rows,
};
use gripgen_measured::open_dataset;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &ExportArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads(&args.run);
    if args.sample.is_none() && args.to == Some(ExportFormat::Webdataset) {
        return webdataset(args, outputs);
    }
    if args.sample.is_none() && args.to == Some(ExportFormat::Lerobot) {
        return lerobot(args, outputs);
    }
    outputs.allow(&args.out)?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    match (args.sample, args.to) {
        (Some(sample), _) => one(args, sample, &outputs, sink),
        (None, Some(_)) => table(args, &outputs, sink),
        (None, None) => Err(Failure::usage("export what?").hint("--sample K, or --to parquet")),
    }
}

fn table(args: &ExportArgs, outputs: &Outputs, sink: JsonSink) -> Result<u8, Failure> {
    let dataset = open_dataset(&args.run)?;
    let options = ExportOptions {
        images: !args.no_images && dataset.image_size_px().is_some(),
        traces: !args.no_traces,
    };
    let pending = outputs.begin(&args.out)?;
    let rows = dataset.table().rows();
    let mut progress = Progress::start("rows", 0, rows as u64, &args.talk);
    let mut written = 0;
    let out = std::io::BufWriter::new(&pending.file);
    let exported = export_parquet(&dataset, options, out, |so_far| {
        (written..so_far).for_each(|_| progress.step());
        written = so_far;
    });
    progress.finish();
    exported.map_err(Failure::new)?;
    let file = pending.publish()?;
    let bytes = file.metadata().map_err(Failure::new)?.len();
    let document = json!({"schema": "gripgen.export/1", "rows": rows, "file": args.out, "bytes": bytes});
    sink.finish(args.talk.quiet, || document, || format!("{}\n", args.out.display()))
}

fn lerobot(args: &ExportArgs, mut outputs: Outputs) -> Result<u8, Failure> {
    let dataset = open_dataset(&args.run)?;
    outputs.allow_new_folder(&args.out)?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let rows = dataset.table().rows();
    let options = wanted(args, &dataset);
    let folder = outputs.begin_folder(&args.out)?;
    let mut progress = Progress::start("rows", 0, rows as u64, &args.talk);
    let made = export_lerobot(&dataset, options, folder.path(), || progress.step());
    progress.finish();
    let episodes = made.map_err(Failure::new)?;
    folder.publish()?;
    let left_out = rows - episodes;
    if left_out > 0 && !args.talk.quiet {
        eprintln!("{} without images or trace left out", count(left_out as u64, "row"));
    }
    let document =
        json!({"schema": "gripgen.export/1", "rows": episodes, "left_out": left_out, "file": args.out});
    sink.finish(args.talk.quiet, || document, || format!("{}\n", args.out.display()))
}

/// What is exported: nothing that no row has.
fn wanted(args: &ExportArgs, dataset: &Dataset) -> ExportOptions {
    let has_trace = |row| dataset.trace(row).ok().flatten().is_some();
    ExportOptions {
        images: !args.no_images && dataset.image_size_px().is_some(),
        traces: !args.no_traces && (0..dataset.table().rows()).any(has_trace),
    }
}

/// Rows of a tar file whose name has a number.
const ROWS: usize = 1000;

fn webdataset(args: &ExportArgs, mut outputs: Outputs) -> Result<u8, Failure> {
    let dataset = open_dataset(&args.run)?;
    let options = wanted(args, &dataset);
    let rows = webdataset_rows(&dataset, options);
    let name = args.out.to_string_lossy();
    let files: Vec<(PathBuf, &[usize])> = match numbered(&name) {
        Some(numbered) => {
            rows.chunks(ROWS).enumerate().map(|(i, rows)| (PathBuf::from(numbered(i)), rows)).collect()
        }
        None => vec![(args.out.clone(), &rows)],
    };
    let card = card_path(&args.out);
    outputs.allow_all(files.iter().map(|(path, _)| path.as_path()).chain([card.as_path()]))?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let mut progress = Progress::start("rows", 0, rows.len() as u64, &args.talk);
    let (mut written, mut bytes) = (0, 0);
    for (path, rows) in &files {
        let pending = outputs.begin(path)?;
        let out = std::io::BufWriter::new(&pending.file);
        let made = export_webdataset(&dataset, rows, options, out, || progress.step());
        written += made.map_err(Failure::new)?;
        bytes += pending.publish()?.metadata().map_err(Failure::new)?.len();
    }
    progress.finish();
    outputs.write(&card, webdataset_card(&dataset).as_bytes())?;
    let left_out = dataset.table().rows() - written;
    if left_out > 0 && !args.talk.quiet {
        eprintln!("{} without images left out", count(left_out as u64, "row"));
    }
    let paths: Vec<&PathBuf> = files.iter().map(|(path, _)| path).collect();
    let document = json!({
        "schema": "gripgen.export/1", "rows": written, "left_out": left_out, "file": args.out, "files": paths,
        "card": card, "bytes": bytes,
    });
    let lines = || paths.iter().map(|path| format!("{}\n", path.display())).collect();
    sink.finish(args.talk.quiet, || document, lines)
}

/// Where the card of tar files lies: `train.md` of `train-%05d.tar`.
fn card_path(out: &Path) -> PathBuf {
    let name = out.file_stem().unwrap_or_default().to_string_lossy();
    let stem = name.split_once('%').map_or(&*name, |(before, _)| before.trim_end_matches(['-', '_', '.']));
    out.with_file_name(format!("{}.md", if stem.is_empty() { "card" } else { stem }))
}

/// The names that a name with `%d` or `%05d` in it stands for; `None` without one.
fn numbered(name: &str) -> Option<impl Fn(usize) -> String> {
    let (before, rest) = name.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let width: usize = if digits.is_empty() { 0 } else { digits.strip_prefix('0')?.parse().ok()? };
    let (before, after) = (before.to_string(), after.to_string());
    (width < 20).then_some(move |i: usize| format!("{before}{i:0width$}{after}"))
}

fn one(args: &ExportArgs, sample: u64, outputs: &Outputs, sink: JsonSink) -> Result<u8, Failure> {
    let folder = RunFolder::open(&args.run)?;
    let info = folder.info();
    if sample >= info.samples {
        let (k, n) = (sample, info.samples);
        return Err(Failure::usage(format!("there is no sample {k}, the run has {n} (counted from 0)")));
    }
    let shard = sample / info.shard_samples;
    if folder.finished(shard)?.is_none() {
        return Err(Failure::new(format!("sample {} belongs to shard {shard}, which is not done", sample))
            .hint(format!("run the {} again to finish it", maker(&folder))));
    }
    let bytes = export_sample(&ShardReader::open(&folder.shard_path(shard))?, sample)?;
    outputs.write(&args.out, &bytes)?;
    let document =
        json!({"schema": "gripgen.export/1", "sample": sample, "file": args.out, "bytes": bytes.len()});
    sink.finish(args.talk.quiet, || document, || format!("{}\n", args.out.display()))
}
