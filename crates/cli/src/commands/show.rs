//! `gripgen show`: pictures of a run.

use crate::args::ShowArgs;
use crate::failure::Failure;
use crate::output::JsonSink;
use crate::outputs::Outputs;
use gripgen::record::RunFolder;
use gripgen::twin::{Jaw, PerJaw};
use gripgen::{Project, press_only};
use gripgen_report::{CONTACT_SHEET, JawPress, contact_sheet, sample_picture};
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
        Some(index) => {
            sample_picture(&folder, index, || press_again(&folder, index)).map_err(Failure::new)?
        }
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

/// The imprints of a simulated sample, made again from the configuration of its run.
fn press_again(folder: &RunFolder, index: u64) -> Option<PerJaw<JawPress>> {
    let project = Project::from_run(folder).ok()?;
    let twin = project.twin_of(index).ok()?;
    let (scenario, usable) = project.sweep.scenario(index, &twin);
    usable.ok()?;
    let pressed = press_only(&twin, &project.library, &scenario, project.sweep.mechanics).ok()??;
    let of = |jaw: Jaw| {
        let imprint = &pressed.imprint[jaw];
        let plane = &imprint.depth_px;
        JawPress {
            size_px: (plane.width as u32, plane.height as u32),
            depth_px: plane.values.clone(),
            mm_per_px: pressed.sensors[jaw].grid.metres_per_px * 1e3,
            press_depth_mm: imprint.press_depth_m * 1e3,
            peak_pressure_pa: imprint.patch.cells.iter().map(|c| c.pressure_pa()).fold(0.0, f64::max),
        }
    };
    Some(PerJaw { left: of(Jaw::Left), right: of(Jaw::Right) })
}

fn is_sheet_of(run: &Path, out: &Path) -> bool {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let same = run.canonicalize().ok().zip(folder.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    same && out.file_name().is_some_and(|name| name == CONTACT_SHEET)
}
