//! `gripgen calibrate presses`: a sensor file from presses of a ball.

use crate::args::CalibratePressesArgs;
use crate::commands::compare::{comparison_json, say_circles, table};
use crate::failure::Failure;
use crate::output::{JsonSink, print, write_file};
use gripgen::tactile::presses::{CalibrateError, CalibrateOptions, Calibration, PressSet, calibrate_presses};
use gripgen::tactile::{GelShape, Sensor};
use gripgen::{
    LoadPressesError, PressGeometry, PressReportText, find_missing_circles, load_presses, press_report,
};
use serde_json::{Value, json};

/// Runs the verb.
pub fn run(args: &CalibratePressesArgs) -> Result<u8, Failure> {
    let folder = args.out.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(Failure::usage(format!(
            "{}: there is no folder {}",
            args.out.display(),
            folder.display()
        )));
    }
    let metres = |mm: Option<f64>| mm.map(|mm| mm * 1e-3);
    let geometry = PressGeometry { ball_m: metres(args.ball_mm), metres_per_px: metres(args.mm_per_px) };
    let mut set = load_presses(&args.presses, geometry).map_err(|e| match e {
        LoadPressesError::Geometry { .. } => {
            Failure::usage(e).hint("measure the ball with calipers, and a pixel by a known length on the gel")
        }
        other => Failure::usage(other),
    })?;
    say_circles(&find_missing_circles(&mut set), &args.talk);
    if !args.talk.quiet {
        eprintln!("{} presses; fitting, and fitting again without each quarter of them", set.presses.len());
    }
    let options = CalibrateOptions::default();
    let calibration = calibrate_presses(&set, &options).map_err(failure)?;
    if !calibration.doubtful.is_empty() && !args.talk.quiet {
        let names = calibration.doubtful.join(", ");
        eprintln!("warning: no contact is visible where {names} are marked; scored, but not fitted to");
    }
    let bytes = match calibration.sensor.to_npz() {
        Some(bytes) => bytes.map_err(Failure::new)?,
        None => return Err(Failure::new("the fitted colours have no place in a sensor file")),
    };
    write_file(&args.out, &bytes)?;
    let report = args.report.clone().unwrap_or_else(|| args.out.with_extension("html"));
    let page =
        press_report(&text(args, &set, &calibration, options.folds), &set, &calibration.held_out, |i| {
            calibration.predicted.get(i).cloned()
        });
    write_file(&report, page.as_bytes())?;
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.press_calibration/1",
            "sensor": args.out,
            "report": report,
            "folds": options.folds,
            "fitted": fitted(&calibration.sensor),
            "doubtful": calibration.doubtful,
            "held_out": comparison_json(&calibration.held_out),
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&table(&calibration.held_out))?;
        print(&format!("{}\n{}\n", args.out.display(), report.display()))?;
    }
    Ok(0)
}

fn failure(e: CalibrateError) -> Failure {
    match e {
        CalibrateError::Radius { .. } => {
            Failure::usage(e).hint("is --ball-mm the diameter, and --mm-per-px that of these images?")
        }
        CalibrateError::TooFew { .. } => {
            Failure::usage(e).hint("30 presses or more, spread over the whole gel, at two or three depths")
        }
        other => Failure::usage(other),
    }
}

fn fitted(sensor: &Sensor) -> Value {
    let dome_mm = match sensor.gel_shape {
        GelShape::Dome { sag_m } => Some(sag_m * 1e3),
        _ => None,
    };
    json!({
        "width_px": sensor.grid.width_px,
        "height_px": sensor.grid.height_px,
        "mm_per_px": sensor.grid.metres_per_px * 1e3,
        "ball_mm": sensor.ball_m.map(|m| m * 1e3),
        "noise_rgb": sensor.noise_rgb,
        "gel": if dome_mm.is_some() { "dome" } else { "flat" },
        "dome_sag_mm": dome_mm,
    })
}

fn text(
    args: &CalibratePressesArgs,
    set: &PressSet,
    calibration: &Calibration,
    folds: usize,
) -> PressReportText {
    let sensor = &calibration.sensor;
    let gel = match sensor.gel_shape {
        GelShape::Dome { sag_m } => format!("dome, {:.2} mm lower at the corners", sag_m * 1e3),
        _ => "flat".into(),
    };
    let [red, green, blue] = sensor.noise_rgb;
    PressReportText {
        title: format!("Calibration from {}", args.presses.display()),
        summary: format!(
            "Colours, frame at rest, noise and gel shape of a tactile sensor, fitted to {} presses of a ball.",
            set.presses.len()
        ),
        meaning: format!(
            "Each press was predicted by a sensor fitted without it and without a {folds}th of the others: its \
             frame at rest, its gel and its colours."
        ),
        facts: vec![
            (
                "image".into(),
                format!(
                    "{} x {} pixels of {:.4} mm",
                    sensor.grid.width_px,
                    sensor.grid.height_px,
                    set.metres_per_px * 1e3
                ),
            ),
            ("ball".into(), format!("{:.3} mm", set.ball_m * 1e3)),
            ("gel at rest".into(), gel),
            ("noise of red, green, blue".into(), format!("{red:.2}, {green:.2}, {blue:.2} grey levels")),
        ],
    }
}
