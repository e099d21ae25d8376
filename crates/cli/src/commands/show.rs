//! `gripgen show`: pictures of a run.

use crate::args::ShowArgs;
use crate::failure::Failure;
use crate::output::JsonSink;
use crate::outputs::Outputs;
use gripgen::record::RunFolder;
use gripgen::{CONTACT_SHEET, contact_sheet, sample_picture};
use serde_json::json;
use std::path::Path;

/// Runs the verb.
pub fn run(args: &ShowArgs) -> Result<u8, Failure> {
    let folder = RunFolder::open(&args.run)?;
    let name = args.sample.map_or(CONTACT_SHEET.into(), |index| format!("sample-{index:06}.png"));
    let out = args.out.clone().unwrap_or_else(|| args.run.join(name));
    let mut outputs = Outputs::new(args.json.force).reads(&args.run);
    // The run's own sheet is made as the sweep makes it, and by nothing else.
    let own_sheet = args.sample.is_none() && is_sheet_of(&args.run, &out);
    if !own_sheet {
        outputs.allow(&out)?;
    }
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let bytes = match args.sample {
        None => contact_sheet(&folder).map_err(Failure::new)?,
        Some(index) if index >= folder.info().samples => {
            let n = folder.info().samples;
            return Err(Failure::usage(format!(
                "there is no sample {index}, the run has {n} (counted from 0)"
            )));
        }
        Some(index) => sample_picture(&folder, index).map_err(Failure::new)?,
    };
    if own_sheet {
        folder.publish(CONTACT_SHEET, &bytes)?;
    } else {
        outputs.write(&out, &bytes)?;
    }
    let document =
        || json!({"schema": "gripgen.picture/1", "sample": args.sample, "file": out, "bytes": bytes.len()});
    sink.finish(args.talk.quiet, document, || format!("{}\n", out.display()))
}

fn is_sheet_of(run: &Path, out: &Path) -> bool {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let same = run.canonicalize().ok().zip(folder.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    same && out.file_name().is_some_and(|name| name == CONTACT_SHEET)
}
