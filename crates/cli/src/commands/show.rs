//! `gripgen show`: pictures of a run.

use crate::args::ShowArgs;
use crate::commands::open_run;
use crate::failure::Failure;
use crate::output::{JsonSink, print, write_file};
use gripgen::{CONTACT_SHEET, contact_sheet, sample_picture};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &ShowArgs) -> Result<u8, Failure> {
    let folder = open_run(&args.run)?;
    let (bytes, name) = match args.sample {
        None => (contact_sheet(&folder).map_err(Failure::new)?, CONTACT_SHEET.to_string()),
        Some(index) => {
            if index >= folder.info().samples {
                let n = folder.info().samples;
                return Err(Failure::usage(format!(
                    "there is no sample {index}, the run has {n} (counted from 0)"
                )));
            }
            (sample_picture(&folder, index).map_err(Failure::new)?, format!("sample-{index:06}.png"))
        }
    };
    let out = args.out.clone().unwrap_or_else(|| args.run.join(name));
    write_file(&out, &bytes)?;
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.picture/1", "sample": args.sample, "file": out, "bytes": bytes.len(),
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!("{}\n", out.display()))?;
    }
    Ok(0)
}
