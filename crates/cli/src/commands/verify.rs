//! `gripgen verify`: is the folder what it says it is?

use crate::args::VerifyArgs;
use crate::commands::maker;
use crate::failure::{Failure, code};
use crate::output::{JsonSink, count, print, program};
use crate::outputs::Outputs;
use crate::progress::Progress;
use crate::shell;
use gripgen::VERSION;
use gripgen::record::{RIG_SOURCE, RunFolder, can_be_made_again, repair, verify};
use serde_json::json;

/// Runs the verb.
pub fn run(args: &VerifyArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads(&args.run);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let folder = RunFolder::open(&args.run)?;
    let mut progress = Progress::start("shards", 0, folder.info().shards, &args.talk);
    let result = verify(&args.run, |_| progress.step())?;
    progress.finish();
    let complete = result.missing_shards == 0;
    let good = result.faults.is_empty();
    let removed = if args.repair && !good { repair(&folder, &result)? } else { vec![] };
    // What cannot be made again stays, broken or not.
    let again = can_be_made_again(&folder);
    let repaired = !removed.is_empty() && (again || result.broken_shards.is_empty());
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.verification/1", "ok": good, "complete": complete,
            "good_shards": result.good_shards, "missing_shards": result.missing_shards,
            "samples": result.samples, "faults": result.faults, "removed": removed,
        }))?;
    }
    for fault in &result.faults {
        eprintln!("error: {fault}");
    }
    if !sink.on_stdout() && !args.talk.quiet {
        let missing = match result.missing_shards {
            0 => String::new(),
            n => format!(", {} not made yet", count(n, "shard")),
        };
        let verdict = if good { "ok" } else { "mismatch" };
        print(&format!(
            "{verdict}: {}, {}{missing}\n",
            count(result.good_shards, "shard"),
            count(result.samples, "sample")
        ))?;
    }
    for path in &removed {
        eprintln!("removed {}", path.display());
    }
    if repaired {
        if !result.broken_shards.is_empty() {
            eprintln!("next: run the {} again, which makes what was removed", maker(&folder));
        }
        return Ok(0);
    }
    if !good {
        eprintln!(
            "\nhint: {}",
            match folder.info().source == RIG_SOURCE {
                true => "measured pulls cannot be computed again: a copy of the run may have them whole"
                    .to_string(),
                false if !again => format!(
                    "gripgen {} made this run, and only it makes the same samples again; this is gripgen {VERSION}, which leaves them",
                    folder.info().gripgen_version
                ),
                false if result.broken_shards.is_empty() && !result.index_is_broken =>
                    "what is named is no shard that can be made again: restore it from a copy, or sweep into a new folder"
                        .to_string(),
                false => format!(
                    "`{} verify {} --repair` removes what is broken, and the same sweep makes it again",
                    program(),
                    shell::path(&args.run)
                ),
            }
        );
    }
    Ok(if good { 0 } else { code::MISMATCH })
}
