//! `gripgen calibrate presses`: a sensor file from presses of a ball.

use crate::args::{CalibratePressesArgs, TalkArgs};
use crate::commands::compare::{comparison_json, page_scores, shown, table};
use crate::failure::Failure;
use crate::load::{drop_doubtful_rest, no_presses, note_jpegs, say_circles};
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::{PressGeometry, find_missing_circles, load_presses};
use gripgen::tactile::presses::{
    BallSize, CalibrateError, CalibrateOptions, Calibration, FEW_PRESSES, MarkError, PARTS, PressCoverage,
    PressSet, RIM_M, calibrate_presses, check_ball_size, press_coverage,
};
use gripgen::tactile::{GelShape, Sensor};
use gripgen::twin::TactileImage;
use gripgen_report::{PressMap, PressPage, press_page};
use serde_json::{Value, json};
use std::path::Path;

/// Runs the verb.
pub fn run(args: &CalibratePressesArgs) -> Result<u8, Failure> {
    let report = args.report.clone().unwrap_or_else(|| args.out.with_extension("html"));
    let mut outputs = Outputs::new(args.json.force).reads(&args.presses);
    outputs.allow_all([args.out.as_path(), &report])?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let metres = |mm: Option<f64>| mm.map(|mm| mm * 1e-3);
    let geometry = PressGeometry { ball_m: metres(args.ball_mm), metres_per_px: metres(args.mm_per_px) };
    let mut set = load_presses(&args.presses, geometry).map_err(|e| {
        no_presses(
            &e,
            "--ball-mm: measure the ball with calipers; --mm-per-px: measure a pixel by a known length on the gel",
        )
    })?;
    let had_rest = set.rest.is_some();
    let jpegs = note_jpegs(&args.presses, &args.talk);
    let doubt = drop_doubtful_rest(&args.presses, &mut set, &args.talk);
    say_circles(&find_missing_circles(&mut set), &args.talk);
    if !args.talk.quiet {
        eprintln!("{} presses; fitting, and again without each fold of them", set.presses.len());
    }
    let options = CalibrateOptions::default();
    let calibration = calibrate_presses(&set, &options).map_err(|e| failure(&args.presses, &e))?;
    warn(&calibration, set.presses.len(), &args.talk);
    let ball_size = check_ball_size(&set, &calibration);
    say_what_is_not_shown(&set, &args.talk);
    say_ball_size(&set, ball_size.as_ref(), &args.talk);
    let coverage = press_coverage(&set, &calibration.doubtful);
    say_coverage(coverage.as_ref(), &args.talk);
    let bytes = match calibration.sensor.to_npz() {
        Some(bytes) => bytes.map_err(Failure::new)?,
        None => return Err(Failure::new("the fitted colours have no place in a sensor file")),
    };
    // What cannot be read again is no sensor file.
    Sensor::from_npz(&bytes, None, None).map_err(|e| {
        Failure::usage(format!("{}: the fitted sensor cannot be: {e}", args.presses.display()))
            .hint("are these presses of one ball into one sensor, with the camera's settings fixed?")
    })?;
    outputs.write(&args.out, &bytes)?;
    let page = PressPage {
        map: coverage.as_ref().map(|coverage| map(coverage, &calibration.sensor)),
        ..page(args, &set, &calibration, ball_size.as_ref())
    };
    let page = press_page(&page, |i| calibration.predicted.get(i).cloned());
    outputs.write(&report, page.as_bytes())?;
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.press_calibration/1",
            "sensor": args.out,
            "report": report,
            "folds": calibration.folds,
            "fitted": fitted(&calibration.sensor),
            "ball_size": ball_size_json(ball_size.as_ref()),
            "coverage": coverage.as_ref().map(coverage_json),
            "doubtful": calibration.doubtful,
            "jpeg_images": jpegs,
            "rest": had_rest.then(|| json!({
                "used": doubt.is_none(),
                "differs": doubt.map(|doubt| doubt.differs),
                "presses_differ": doubt.map(|doubt| doubt.presses_differ),
            })),
            "held_out": comparison_json(&calibration.held_out),
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&table(&calibration.held_out))?;
        print(&format!("{}\n{}\n", args.out.display(), report.display()))?;
    }
    Ok(0)
}

/// What a user should know before trusting the fit.
fn warn(calibration: &Calibration, presses: usize, talk: &TalkArgs) {
    if talk.quiet {
        return;
    }
    if !calibration.doubtful.is_empty() {
        let names = calibration.doubtful.join(", ");
        eprintln!("warning: no contact is visible where {names} are marked; scored, but not fitted to");
    }
    if calibration.distrusted > 0 {
        let n = calibration.distrusted;
        eprintln!(
            "warning: {n} of {presses} marks show no contact; either they are wrong, or contacts are hardly visible on this sensor"
        );
    }
    if let Some(markers) = &calibration.sensor.markers {
        eprintln!(
            "note: the gel has {} dots of {:.2} mm; the fit leaves out what they hide, and errors are given outside and in them",
            markers.rest_px.len(),
            2e3 * markers.radius_px * calibration.sensor.grid.metres_per_px
        );
    }
    if presses < FEW_PRESSES {
        eprintln!(
            "warning: {presses} presses are few: elsewhere on the gel the error may be twice the one below"
        );
    }
    if let Some([red, green, blue]) = calibration.sensor.press_gain_sd.map(|sd| sd.map(|s| 100.0 * s)) {
        eprintln!(
            "warning: red, green and blue have another gain in each press ({red:.1}, {green:.1}, {blue:.1} %), as a camera with an \
             automatic white balance has; it was divided out. Switch it off where that can be done"
        );
    }
    if calibration.sensor.noise_rgb == [0.0; 3] {
        eprintln!("warning: no pixel was far from the contacts, so the noise is not known and set to 0");
    }
}

/// What the shapes of the presses leave open.
fn say_what_is_not_shown(set: &PressSet, talk: &TalkArgs) {
    let bodies = set.presses.iter().any(|press| press.indenter.is_some());
    if talk.quiet || bodies {
        return;
    }
    eprintln!(
        "note: balls do not show flat contacts and edges, which are drawn from what they have in common; a press of a known \
         mesh would show them (columns mesh, depth_mm)"
    );
}

/// Whether the ball is as large as was said.
fn say_ball_size(set: &PressSet, size: Option<&BallSize>, talk: &TalkArgs) {
    if talk.quiet || set.presses.iter().all(|press| press.indenter.is_some()) {
        return;
    }
    let Some(size) = size else {
        eprintln!(
            "note: the ball's size cannot be checked, presses of one ball look the same with a wrong diameter; the column depth_mm, or \
             two presses of a known mesh (another ball, too) would show it"
        );
        return;
    };
    if size.is_wrong() {
        let (given_mm, true_mm) = (1e3 * set.ball_m, 1e3 * size.factor * set.ball_m);
        eprintln!(
            "warning: the ball looks {}, {true_mm:.2} mm and not {given_mm:.2} mm; measure it with calipers, and a pixel on the gel again",
            in_words(size)
        );
    } else if !size.tells() {
        eprintln!(
            "note: the ball looks {}: a diameter that is wrong by a factor of 1.5 would not be seen",
            in_words(size)
        );
    }
}

/// Where nothing was pressed.
fn say_coverage(coverage: Option<&PressCoverage>, talk: &TalkArgs) {
    let Some(coverage) = coverage.filter(|coverage| !talk.quiet && coverage.unseen_parts().next().is_some())
    else {
        return;
    };
    eprintln!("note: {}; press there too, or expect larger errors there", coverage_in_words(coverage));
}

/// How much of the frame was pressed, and where nothing was.
fn coverage_in_words(coverage: &PressCoverage) -> String {
    let (percent, rim_mm) = (100.0 * coverage.share, 1e3 * RIM_M);
    let PressCoverage { farthest_m, farthest_px: (x, y), .. } = coverage;
    let all = format!(
        "{percent:.0} % of the frame lay in a contact or within {rim_mm:.1} mm of one; the farthest place, ({x}, {y}) px, is {:.1} mm \
         from the nearest",
        1e3 * farthest_m
    );
    let parts: Vec<String> = coverage
        .unseen_parts()
        .map(|(row, column)| format!("row {} column {}", row + 1, column + 1))
        .collect();
    if parts.is_empty() {
        return all;
    }
    let (columns, rows) = PARTS;
    format!("{all}; of {columns} x {rows} parts of the frame hardly pressed: {}", parts.join(", "))
}

fn coverage_json(coverage: &PressCoverage) -> Value {
    let rounded = |share: f64| (1e4 * share).round() / 1e4;
    let parts: Vec<f64> = coverage.part_shares.iter().map(|share| rounded(*share)).collect();
    let unseen = coverage.unseen_parts().map(|(row, column)| json!({"row": row, "column": column}));
    json!({
        "rim_mm": 1e3 * RIM_M,
        "share": rounded(coverage.share),
        "part_shares": parts.chunks(PARTS.0).collect::<Vec<_>>(),
        "unseen_parts": unseen.collect::<Vec<_>>(),
        "farthest_mm": 1e3 * coverage.farthest_m,
        "farthest_px": [coverage.farthest_px.0, coverage.farthest_px.1],
    })
}

/// The frame at rest, dark and grey where nothing was pressed.
fn map(coverage: &PressCoverage, sensor: &Sensor) -> PressMap {
    let level = |pixel: usize, c: usize| match coverage.seen[pixel] {
        true => sensor.rest[c][pixel].clamp(0.0, 255.0) as u8,
        false => ((0..3).map(|c| sensor.rest[c][pixel]).sum::<f32>() / 9.0).clamp(0.0, 255.0) as u8,
    };
    let rgb = (0..sensor.grid.len()).flat_map(|pixel| [0, 1, 2].map(|c| level(pixel, c))).collect();
    let (width_px, height_px) = (sensor.grid.width_px as u32, sensor.grid.height_px as u32);
    PressMap {
        image: TactileImage { width_px, height_px, rgb },
        title: "Where something was pressed".into(),
        text: format!("{}. Colours elsewhere are continued from there.", coverage_in_words(coverage)),
        caption: "frame at rest, dark where nothing was pressed".into(),
    }
}

fn in_words(size: &BallSize) -> String {
    let BallSize { factor, low90, high90, .. } = size;
    format!("{factor:.2} times as large as given ({low90:.2} to {high90:.2}, by {})", size.by.name())
}

fn ball_size_json(size: Option<&BallSize>) -> Value {
    json!({
        "checked": size.is_some_and(BallSize::tells),
        "by": size.map(|size| size.by.name()),
        "factor": size.map(|size| size.factor),
        "low90": size.map(|size| size.low90),
        "high90": size.map(|size| size.high90),
    })
}

fn failure(presses: &Path, e: &CalibrateError) -> Failure {
    let failure = Failure::usage(format!("{}: {e}", presses.display()));
    match e {
        CalibrateError::Mark(MarkError::Radius { .. }) => {
            failure.hint("is --ball-mm the diameter, and --mm-per-px that of these images?")
        }
        CalibrateError::Mark(_) => failure
            .hint("pixels count from 0 at the top left; leave the cells empty to have a contact looked for"),
        CalibrateError::TooFew { .. } => {
            failure.hint("30 presses or more, spread over the whole gel, at two or three depths")
        }
        CalibrateError::Nothing => {
            failure.hint("are these images with contact, and is the rest frame one without?")
        }
        _ => failure,
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
        "sink_in_fraction": sensor.pyramid.as_ref().map(|p| p.sink_in_fraction),
        "kernels_px": sensor.pyramid.as_ref().map(|p| p.kernels_px.clone()),
        "press_gain_sd_rgb": sensor.press_gain_sd,
        "dots": sensor.markers.as_ref().map(|markers| json!({
            "n": markers.rest_px.len(),
            "radius_px": markers.radius_px,
            "darkness_rgb": markers.darkness_rgb,
        })),
    })
}

/// How the gel gives way, in words.
fn gives_way(sensor: &Sensor) -> String {
    let Some(pyramid) = &sensor.pyramid else { return "as the twin says".into() };
    let widest_mm =
        pyramid.kernels_px.first().map_or(0.0, |&k| f64::from(k) * sensor.grid.metres_per_px * 1e3);
    let percent = 100.0 * pyramid.sink_in_fraction;
    format!("{percent:.0} % of the press at the rim, widest kernel {widest_mm:.1} mm")
}

fn page<'a>(
    args: &CalibratePressesArgs,
    set: &'a PressSet,
    calibration: &Calibration,
    ball_size: Option<&BallSize>,
) -> PressPage<'a> {
    let sensor = &calibration.sensor;
    let gel = match sensor.gel_shape {
        GelShape::Dome { sag_m } => format!("dome, {:.2} mm lower at the corners", sag_m * 1e3),
        _ => "flat".into(),
    };
    let [red, green, blue] = sensor.noise_rgb;
    PressPage {
        title: format!("Calibration from {}", args.presses.display()),
        summary: format!(
            "Colours, frame at rest, noise and gel shape of a tactile sensor, fitted to {} presses of a ball.",
            set.presses.len()
        ),
        meaning: format!(
            "Each press was predicted by a sensor fitted without it and the others of its fold ({} folds): its \
             frame at rest, its gel and its colours.",
            calibration.folds
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
            ("its size".into(), ball_size.map_or_else(|| "not checked".into(), in_words)),
            ("gel at rest".into(), gel),
            ("gel around a contact".into(), gives_way(sensor)),
            ("noise of red, green, blue".into(), format!("{red:.2}, {green:.2}, {blue:.2} grey levels")),
        ],
        map: None,
        mean: page_scores(&calibration.held_out.mean),
        presses: shown(set, &calibration.held_out),
    }
}
