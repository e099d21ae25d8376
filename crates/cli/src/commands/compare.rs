//! `gripgen compare`: how far a twin or a sensor file is from measurements.

use crate::args::{CompareArgs, TalkArgs};
use crate::failure::Failure;
use crate::output::{JsonSink, print, writable, write_file};
use gripgen::tactile::finish;
use gripgen::tactile::metrics::Score;
use gripgen::tactile::presses::{PressComparison, Scores, compare_presses, predict_press};
use gripgen::{
    FoundCircles, LoadPressesError, LoadSensorError, Location, PressGeometry, PressReportText,
    find_missing_circles, is_press_set, load_presses, load_sensor, load_twin_sensor, press_report,
};
use serde_json::{Value, json};

/// Runs the verb.
pub fn run(args: &CompareArgs) -> Result<u8, Failure> {
    if !args.measured.exists() {
        return Err(Failure::usage(format!("{}: there is no such file or folder", args.measured.display())));
    }
    if !is_press_set(&args.measured) {
        return Err(Failure::usage(format!(
            "{}: neither a `dataPack.npz` nor a folder with `presses.csv`",
            args.measured.display()
        ))
        .hint("this version compares ball presses; pulls and force-sensor tables follow"));
    }
    if let Some(report) = &args.report {
        writable(report)?;
    }
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    let sensor = match &args.sensor {
        Some(path) => load_sensor(&Location::parse(path)),
        None => load_twin_sensor(&Location::parse(&args.twin)),
    };
    let sensor = sensor.map_err(|e| match e {
        LoadSensorError::Twin(e) => Failure::from(e),
        other => Failure::usage(other).hint("`gripgen calibrate presses` writes a sensor file for --sensor"),
    })?;
    let geometry = PressGeometry { ball_m: sensor.ball_m, metres_per_px: Some(sensor.grid.metres_per_px) };
    let mut set = load_presses(&args.measured, geometry).map_err(|e| match e {
        LoadPressesError::Geometry { .. } => Failure::usage(e)
            .hint("a sensor file of `gripgen calibrate presses` holds both; name it with --sensor"),
        other => Failure::usage(other),
    })?;
    if let Some(press) = set.presses.first() {
        let (found, wanted) =
            ((press.image.width_px, press.image.height_px), (sensor.grid.width_px, sensor.grid.height_px));
        if (found.0 as usize, found.1 as usize) != wanted {
            let sizes = format!("{}x{} pixels, the sensor has {}x{}", found.0, found.1, wanted.0, wanted.1);
            return Err(Failure::usage(format!("{}: the images are {sizes}", args.measured.display()))
                .hint("name the sensor file that belongs to these presses with --sensor"));
        }
    }
    if set.rest.is_none() {
        set.rest = Some(finish(&sensor, None, None));
    }
    say_circles(&find_missing_circles(&mut set), &args.talk);
    let comparison = compare_presses(&set, &sensor)
        .map_err(|e| Failure::usage(format!("{}: {e}", args.measured.display())))?;
    if let Some(path) = &args.report {
        let text = PressReportText {
            title: format!(
                "{} against {}",
                args.measured.display(),
                args.sensor.as_ref().unwrap_or(&args.twin)
            ),
            summary: format!(
                "Images that the sensor file predicts for {} presses, against the real ones.",
                set.presses.len()
            ),
            meaning: "All presses as they are; whether the calibration has seen them is not known here."
                .into(),
            facts: vec![
                ("ball".into(), format!("{:.3} mm", set.ball_m * 1e3)),
                ("pixel".into(), format!("{:.4} mm", set.metres_per_px * 1e3)),
            ],
        };
        let page = press_report(&text, &set, &comparison, |i| {
            predict_press(&set.presses[i], set.ball_m, &sensor).ok()
        });
        write_file(path, page.as_bytes())?;
    }
    if sink.wanted() {
        sink.document(&json!({"schema": "gripgen.comparison/1", "presses": comparison_json(&comparison)}))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&table(&comparison))?;
    }
    Ok(0)
}

/// Says which contacts were not marked.
pub fn say_circles(circles: &FoundCircles, talk: &TalkArgs) {
    if talk.quiet {
        return;
    }
    if !circles.found.is_empty() {
        eprintln!("note: nobody marked the contact of {} presses, it was looked for", circles.found.len());
    }
    if !circles.without_contact.is_empty() {
        eprintln!("warning: no contact is visible in {}; left out", circles.without_contact.join(", "));
    }
}

/// The scores of presses as they stand in `--json`.
pub fn comparison_json(comparison: &PressComparison) -> Value {
    let each: Vec<Value> = comparison
        .each
        .iter()
        .map(|press| {
            let mut scores = scores_json(&press.scores);
            scores["name"] = json!(press.name);
            scores
        })
        .collect();
    let mut all = scores_json(&comparison.mean);
    all["n"] = json!(comparison.each.len());
    all["each"] = json!(each);
    all
}

fn scores_json(scores: &Scores) -> Value {
    json!({
        "full": score_json(&scores.full),
        "crop400": score_json(&scores.crop400),
        "crop200": score_json(&scores.crop200),
    })
}

fn score_json(score: &Score) -> Value {
    // Equal images have an infinite ratio, which JSON cannot hold: null.
    json!({"mse": score.mse, "psnr": score.psnr_db, "ssim": score.ssim, "l1": score.l1})
}

/// The mean scores for people.
pub fn table(comparison: &PressComparison) -> String {
    let mut text = format!("{} presses           MSE    PSNR     SSIM     L1\n", comparison.each.len());
    let mean = &comparison.mean;
    for (name, s) in
        [("whole frame", mean.full), ("400 px crop", mean.crop400), ("200 px crop", mean.crop200)]
    {
        text += &format!("{name:<15} {:>9.2} {:>7.2} {:>8.4} {:>6.2}\n", s.mse, s.psnr_db, s.ssim, s.l1);
    }
    text
}
