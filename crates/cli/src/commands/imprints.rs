//! Sets of imprints: loading, `gripgen compare` and `gripgen diagnose` of them.

use crate::Diagnosed;
use crate::args::{CompareArgs, DiagnoseArgs};
use crate::failure::Failure;
use crate::load::load_twin;
use crate::output::{JsonSink, print};
use crate::{ImprintSet, compare_imprint_table, diagnose_imprint_table, load_imprint_set, load_sensor};
use gripgen::Location;
use gripgen::twin::{Jaw, Twin};
use serde_json::{Map, Value, json};
use std::path::Path;

/// The set of a folder; images are read through the sensor file, or not at all.
pub fn load(measured: &Path, sensor: Option<&str>, twin: &Twin) -> Result<ImprintSet, Failure> {
    let sensor = sensor.map(|path| load_sensor(&Location::parse(path))).transpose().map_err(|e| {
        Failure::usage(e).hint("`gripgen calibrate presses` writes a sensor file for --sensor")
    })?;
    let gel = &twin.gel[Jaw::Left];
    load_imprint_set(measured, sensor.as_deref().map(|s| (s, gel))).map_err(|e| {
        let hint = e.hint();
        Failure::usage(e).hint_if(hint)
    })
}

/// Diagnoses the imprints of the arguments.
pub fn diagnose(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let twin = load_twin(&args.twin, &args.set)?;
    let set = load(&args.measured, args.sensor.as_deref(), &twin)?;
    Ok(diagnose_imprint_table(&set, &twin))
}

/// Compares the twin of the arguments with imprints.
pub fn compare(args: &CompareArgs, mut sink: JsonSink) -> Result<u8, Failure> {
    let twin = load_twin(&args.twin, &[])?;
    let set = load(&args.measured, args.sensor.as_deref(), &twin)?;
    let found = compare_imprint_table(&set, &twin)
        .map_err(|reason| Failure::usage(format!("{}: {reason}", args.measured.display())))?;
    if sink.wanted() {
        let grasp = |(name, n, rmse, pct): &(String, usize, f64, f64)| {
            (name.clone(), json!({"n": n, "rmse_mm3": rmse, "rmse_pct_of_peak": pct}))
        };
        let by_grasp: Map<String, Value> = found.by_grasp.iter().map(grasp).collect();
        sink.document(&json!({
            "schema": "gripgen.comparison/1",
            "imprints": {"n": found.n, "rmse_mm3": found.rmse_mm3, "rmse_pct_of_peak": found.rmse_pct_of_peak,
                "by_grasp": by_grasp},
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        let mut text = format!("{:<28} {:>6} {:>10} {:>10}\n", "grasp", "rows", "RMSE mm^3", "% of peak");
        for (name, n, rmse, pct) in &found.by_grasp {
            text += &format!("{name:<28} {n:>6} {rmse:>10.3} {pct:>10.2}\n");
        }
        text += &format!(
            "{:<28} {:>6} {:>10.3} {:>10.2}   the constant of each grasp refitted\n",
            "all", found.n, found.rmse_mm3, found.rmse_pct_of_peak
        );
        print(&text)?;
    }
    if !args.talk.quiet {
        found.notes.iter().chain(&set.notes).for_each(|note| eprintln!("note: {note}"));
    }
    Ok(0)
}
