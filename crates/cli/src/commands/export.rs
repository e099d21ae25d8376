//! `gripgen export`: a sample as a file of its own, or all of them as a table.

use crate::args::{ExportArgs, ExportFormat};
use crate::commands::{maker, open_run};
use crate::failure::Failure;
use crate::output::{JsonSink, print, write_file};
use crate::progress::Progress;
use gripgen::record::{Dataset, ParquetOptions, ShardReader, export_parquet, export_sample};
use serde_json::json;
use std::path::PathBuf;

/// Runs the verb.
pub fn run(args: &ExportArgs) -> Result<u8, Failure> {
    match (args.sample, args.to) {
        (Some(sample), _) => one(args, sample),
        (None, Some(ExportFormat::Parquet)) => table(args),
        (None, None) => Err(Failure::usage("export what?").hint("--sample K, or --to parquet")),
    }
}

fn table(args: &ExportArgs) -> Result<u8, Failure> {
    let dataset = Dataset::open(&args.run).map_err(Failure::usage)?;
    let options = ParquetOptions {
        images: !args.no_images && dataset.image_size_px().is_some(),
        traces: !args.no_traces,
    };
    let io = |e: std::io::Error| Failure::new(format!("{}: {e}", args.out.display()));
    // Under a temporary name first: a file that is there is whole.
    let mut partial = args.out.clone().into_os_string();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    let file = std::fs::File::create(&partial).map_err(io)?;
    let rows = dataset.table().rows();
    let mut progress = Progress::start("rows", 0, rows as u64, &args.talk);
    let mut written = 0;
    let out = std::io::BufWriter::new(file);
    let exported = export_parquet(&dataset, options, out, |so_far| {
        (written..so_far).for_each(|_| progress.step());
        written = so_far;
    });
    progress.finish();
    if let Err(e) = exported {
        let _ = std::fs::remove_file(&partial);
        return Err(Failure::new(e));
    }
    std::fs::rename(&partial, &args.out).map_err(io)?;
    let bytes = std::fs::metadata(&args.out).map_err(io)?.len();
    let document = json!({"schema": "gripgen.export/1", "rows": rows, "file": args.out, "bytes": bytes});
    tell(args, &document)
}

fn tell(args: &ExportArgs, document: &serde_json::Value) -> Result<u8, Failure> {
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    if sink.wanted() {
        sink.document(document)?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!("{}\n", args.out.display()))?;
    }
    Ok(0)
}

fn one(args: &ExportArgs, sample: u64) -> Result<u8, Failure> {
    let folder = open_run(&args.run)?;
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
    write_file(&args.out, &bytes)?;
    tell(
        args,
        &json!({"schema": "gripgen.export/1", "sample": sample, "file": args.out, "bytes": bytes.len()}),
    )
}
