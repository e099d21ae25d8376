//! `gripgen calibrate sensor`: gain and offset of a force sensor.

use crate::args::CalibrateSensorArgs;
use crate::failure::Failure;
use crate::load::there_is;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::{calibrate_sensor_table, edited_twin_toml, sensor_calibration_edits};
use gripgen::Location;
use gripgen_identify::{ParameterEstimate, SensorCalibration};
use gripgen_measured::read_sensor_table;
use serde_json::json;
use std::fmt::Write;

/// Runs the verb.
pub fn run(args: &CalibrateSensorArgs) -> Result<u8, Failure> {
    there_is(&args.measured)?;
    let mut outputs = Outputs::new(args.json.force).reads(&args.measured).reads_config(&args.twin, &[]);
    outputs.allow_all(args.out.as_deref())?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let table = read_sensor_table(&args.measured).map_err(Failure::usage)?;
    let calibration = calibrate_sensor_table(&table).map_err(|reason| {
        Failure::usage(format!("{}: {reason}", args.measured.display()))
            .hint("press the sensor to several forces beside the reference, 30 rows per session at least")
    })?;
    if let Some(out) = &args.out {
        let edits = sensor_calibration_edits(&calibration, &table.sha256)
            .map_err(|e| Failure::usage(format!("{}: {e}", args.measured.display())))?;
        let text = edited_twin_toml(&Location::parse(&args.twin), &[], &edits, out).map_err(Failure::new)?;
        outputs.write(out, text.as_bytes())?;
    }
    if sink.wanted() {
        let sessions: Vec<_> = calibration
            .sessions
            .iter()
            .map(|s| {
                json!({"name": s.name, "rows": s.rows, "gain": s.gain, "offset_n": s.offset, "rmse_n": s.rmse_n,
                    "lag_one": s.lag_one})
            })
            .collect();
        let (low, high) = calibration.reference_range_n;
        sink.document(&json!({
            "schema": "gripgen.sensor_calibration/1",
            "data": {"rows": table.time_s.len(), "missing_cells": table.missing.counts(), "sha256": table.sha256},
            "fitted_reference_force_n": [low, high],
            "sessions": sessions,
            "twin": args.out,
            "notes": calibration.notes,
        }))?;
    }
    if !args.talk.quiet {
        let notes = calibration.notes.iter().cloned().chain(table.missing.notes());
        notes.for_each(|note| eprintln!("note: {note}"));
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&text(&calibration))?;
    }
    Ok(0)
}

fn text(calibration: &SensorCalibration) -> String {
    let mut text = format!(
        "{:<12} {:>7} {:>12} {:>24} {:>10} {:>24} {:>9} {:>6}\n",
        "session", "rows", "gain", "90 %", "offset N", "90 %", "rmse N", "lag 1"
    );
    for s in &calibration.sessions {
        let interval = |p: &ParameterEstimate| format!("{:.5} to {:.5}", p.low90, p.high90);
        let _ = writeln!(
            text,
            "{:<12} {:>7} {:>12.6} {:>24} {:>10.4} {:>24} {:>9.4} {:>6.2}",
            s.name,
            s.rows,
            s.gain.value,
            interval(&s.gain),
            s.offset.value,
            interval(&s.offset),
            s.rmse_n,
            s.lag_one
        );
    }
    text
}
