//! `gripgen calibrate imprints`: the imprint constant of each part.

use crate::args::{CalibrateImprintsArgs, ConstantOf};
use crate::commands::imprints;
use crate::failure::Failure;
use crate::load::{load_twin, there_is};
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::{calibrate_imprint_table, edited_twin_toml, imprint_calibration_edits};
use gripgen::Location;
use gripgen_identify::{ImprintConstants, ParameterEstimate, SharedConstant};
use serde_json::{Map, Value, json};

/// Runs the verb.
pub fn run(args: &CalibrateImprintsArgs) -> Result<u8, Failure> {
    there_is(&args.measured)?;
    let mut outputs = Outputs::new(args.json.force)
        .reads(&args.measured)
        .reads_all(&args.sensor)
        .reads_config(&args.twin, &[]);
    outputs.allow_all(args.out.as_deref())?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let twin = load_twin(&args.twin, &[])?;
    let set = imprints::load(&args.measured, args.sensor.as_deref(), &twin)?;
    let shared = match args.constant {
        ConstantOf::Grasp => SharedConstant::Grasp,
        ConstantOf::Part => SharedConstant::Part,
    };
    let place = |reason: String| format!("{}: {reason}", args.measured.display());
    let found = calibrate_imprint_table(&set, shared).map_err(|reason| {
        Failure::usage(place(reason))
            .hint("give rows of one grasp the same `grasp`, with two forces or more each")
    })?;
    if let Some(out) = &args.out {
        let edits =
            imprint_calibration_edits(&found, &twin, args.part.as_deref(), &set.sha256).map_err(|e| {
                Failure::usage(place(e))
                    .hint("name the twin that has the part with --twin, or the part of all rows with --part")
            })?;
        let text = edited_twin_toml(&Location::parse(&args.twin), &[], &edits, out).map_err(Failure::new)?;
        outputs.write(out, text.as_bytes())?;
    }
    if sink.wanted() {
        let parts: Map<String, Value> = found
            .parts
            .iter()
            .map(|p| {
                let value = json!({"imprint_mm3_per_n": p.imprint_mm3_per_n, "grasps": p.grasps, "rows": p.rows,
                    "grasp_sd": p.grasp_sd, "rmse_mm3": p.rmse_mm3});
                (p.part.clone(), value)
            })
            .collect();
        let grasps: Map<String, Value> = found
            .grasps
            .iter()
            .map(|g| {
                let value = json!({"part": g.part, "imprint_mm3_per_n": g.imprint_mm3_per_n, "rows": g.rows,
                    "peak_mm3": g.peak_mm3, "rmse_mm3": g.rmse_mm3});
                (g.name.clone(), value)
            })
            .collect();
        sink.document(&json!({
            "schema": "gripgen.imprint_calibration/1",
            "data": {"imprints": set.data.ids.len(), "grasps": set.data.grasps.len(), "sha256": set.sha256},
            "fitted_grip_force_n": [found.force_n.0, found.force_n.1],
            "parts": parts, "grasps": grasps, "twin": args.out, "notes": found.notes,
        }))?;
    }
    if !args.talk.quiet {
        found.notes.iter().for_each(|note| eprintln!("note: {note}"));
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&text(&found))?;
    }
    Ok(0)
}

fn text(found: &ImprintConstants) -> String {
    let mut text =
        format!("{:<28} {:>6} {:>12} {:>22} {:>10}\n", "", "rows", "c mm^3/N", "90 %", "RMSE mm^3");
    let mut line = |name: &str, rows: usize, c: &ParameterEstimate, rmse: f64| {
        let interval = format!("{:.4} to {:.4}", c.low90, c.high90);
        text += &format!("{name:<28} {rows:>6} {:>12.5} {interval:>22} {rmse:>10.3}\n", c.value);
    };
    for g in &found.grasps {
        line(&g.name, g.rows, &g.imprint_mm3_per_n, g.rmse_mm3);
    }
    for p in &found.parts {
        let name = if p.part.is_empty() { "all grasps".into() } else { format!("part {}", p.part) };
        line(&name, p.rows, &p.imprint_mm3_per_n, p.rmse_mm3);
    }
    text
}
