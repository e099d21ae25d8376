//! `gripgen view`: a run, measured pulls or a shard on one page.

use crate::args::ViewArgs;
use crate::failure::Failure;
use crate::load::there_is;
use crate::output::{JsonSink, size};
use crate::outputs::Outputs;
use gripgen_measured::open_dataset;
use gripgen_report::{ViewOptions, view_page};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Name of the page in a folder.
const PAGE: &str = "view.html";

/// Runs the verb.
pub fn run(args: &ViewArgs) -> Result<u8, Failure> {
    there_is(&args.data).map_err(|e| e.hint("name a run folder, a folder with pulls.csv, or a shard"))?;
    let out = args.out.clone().unwrap_or_else(|| beside(&args.data));
    let mut outputs = Outputs::new(args.json.force).reads(&args.data);
    outputs.allow(&out)?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let dataset = open_dataset(&args.data)?;
    let absolute = std::path::absolute(&args.data).unwrap_or_else(|_| args.data.clone());
    let title =
        absolute.file_name().map_or_else(|| "pulls".into(), |name| name.to_string_lossy().into_owned());
    let options = ViewOptions { title, pulls: args.pulls as usize };
    let page = view_page(&dataset, &options).map_err(Failure::new)?;
    outputs.write(&out, page.html.as_bytes())?;
    if !args.talk.quiet {
        let bytes = size(page.html.len() as u64);
        eprintln!("{} of {} pulls with images and curves, {bytes}", page.shown, page.pulls);
    }
    let document = || {
        json!({
            "schema": "gripgen.view/1", "file": out, "pulls": page.pulls, "shown": page.shown,
            "bytes": page.html.len(),
        })
    };
    sink.finish(args.talk.quiet, document, || format!("{}\n", out.display()))
}

/// In a folder, or beside a shard.
fn beside(data: &Path) -> PathBuf {
    if data.is_dir() {
        return data.join(PAGE);
    }
    let stem = data.file_stem().map_or_else(|| "shard".into(), |stem| stem.to_string_lossy().into_owned());
    data.with_file_name(format!("{stem}-{PAGE}"))
}
