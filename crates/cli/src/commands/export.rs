//! `gripgen export`: a sample as a file of its own.

use crate::args::ExportArgs;
use crate::commands::open_run;
use crate::failure::Failure;
use crate::output::{JsonSink, print, write_file};
use gripgen::record::{ShardReader, export_sample};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &ExportArgs) -> Result<u8, Failure> {
    let folder = open_run(&args.run)?;
    let info = folder.info();
    if args.sample >= info.samples {
        let (k, n) = (args.sample, info.samples);
        return Err(Failure::usage(format!("there is no sample {k}, the run has {n} (counted from 0)")));
    }
    let shard = args.sample / info.shard_samples;
    if folder.finished(shard)?.is_none() {
        return Err(Failure::new(format!(
            "sample {} belongs to shard {shard}, which is not done",
            args.sample
        ))
        .hint("run the sweep again to finish it"));
    }
    let bytes = export_sample(&ShardReader::open(&folder.shard_path(shard))?, args.sample)?;
    write_file(&args.out, &bytes)?;
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.export/1", "sample": args.sample, "file": args.out, "bytes": bytes.len(),
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!("{}\n", args.out.display()))?;
    }
    Ok(0)
}
