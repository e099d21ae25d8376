//! `gripgen export`: a sample as a file of its own, or all of them as a table.

use crate::args::{ExportArgs, ExportFormat};
use crate::commands::{maker, open_run};
use crate::failure::Failure;
use crate::mark::Format;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::progress::Progress;
use gripgen::record::{Dataset, ParquetOptions, ShardReader, export_parquet, export_sample};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &ExportArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::of("export", args.json.force).reads(&args.run);
    outputs.allow(&args.out)?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    match (args.sample, args.to) {
        (Some(sample), _) => one(args, sample, &outputs, sink),
        (None, Some(ExportFormat::Parquet)) => table(args, &outputs, sink),
        (None, None) => Err(Failure::usage("export what?").hint("--sample K, or --to parquet")),
    }
}

fn table(args: &ExportArgs, outputs: &Outputs, sink: JsonSink) -> Result<u8, Failure> {
    let dataset = Dataset::open(&args.run).map_err(Failure::usage)?;
    let options = ParquetOptions {
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
    let file = pending.publish(outputs)?;
    let bytes = file.metadata().map_err(Failure::new)?.len();
    let document = json!({"schema": "gripgen.export/1", "rows": rows, "file": args.out, "bytes": bytes});
    tell(args, sink, &document)
}

fn tell(args: &ExportArgs, mut sink: JsonSink, document: &serde_json::Value) -> Result<u8, Failure> {
    if sink.wanted() {
        sink.document(document)?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!("{}\n", args.out.display()))?;
    }
    Ok(0)
}

fn one(args: &ExportArgs, sample: u64, outputs: &Outputs, sink: JsonSink) -> Result<u8, Failure> {
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
    outputs.write(&args.out, Format::Marked, &bytes)?;
    tell(
        args,
        sink,
        &json!({"schema": "gripgen.export/1", "sample": sample, "file": args.out, "bytes": bytes.len()}),
    )
}
