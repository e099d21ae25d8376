//! `gripgen compare`: how far a twin or a sensor file is from measurements.

use crate::args::CompareArgs;
use crate::commands::imprints;
use crate::failure::Failure;
use crate::load::{
    TwinOfPulls, drop_doubtful_rest, folders, jobs, load_sensor_and_presses, load_twin, no_pulls, note_jpegs,
    say_circles, say_warnings, suspects, there_is,
};
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::{
    ImageComparison, LabelErrors, compare_images, compare_pulls_with, compare_sensor_table,
    find_circles_with_sensor, is_imprint_set, is_press_set, is_sensor_table, posterior_twins, unmeasured,
};
use gripgen::tactile::metrics::Score;
use gripgen::tactile::presses::{
    Press, PressComparison, PressScore, PressSet, Scores, compare_presses, predict_press,
};
use gripgen::{Location, load_twin_document};
use gripgen_identify::{PartRatio, pull_ratios};
use gripgen_measured::{load_pulls_with, read_sensor_table};
use gripgen_report::{ComparedPulls, PressPage, PressScores, PressShown, press_page, pull_comparison_page};
use serde_json::{Map, Value, json};

/// Runs the verb.
pub fn run(args: &CompareArgs) -> Result<u8, Failure> {
    there_is(&args.measured)?;
    let is_table = is_sensor_table(&args.measured) || is_imprint_set(&args.measured);
    if args.report.is_some() && is_table {
        return Err(Failure::usage("--report: a comparison with a table has no page")
            .hint("`gripgen diagnose FOLDER --report FILE.html` draws one of such a table"));
    }
    let mut outputs = Outputs::new(args.json.force)
        .reads(&args.measured)
        .reads_all(&args.also)
        .reads_all(&args.sensor)
        .reads_config(&args.twin, &[]);
    outputs.allow_all(args.report.as_deref())?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    if is_imprint_set(&args.measured) {
        imprints::compare(args, sink)
    } else if is_sensor_table(&args.measured) {
        sensor_table(args, sink)
    } else if is_press_set(&args.measured) {
        presses(args, &outputs, sink)
    } else {
        pulls(args, &outputs, sink)
    }
}

/// A sensor file against presses.
fn presses(args: &CompareArgs, outputs: &Outputs, sink: JsonSink) -> Result<u8, Failure> {
    let (sensor, mut set) = load_sensor_and_presses(&args.measured, args.sensor.as_deref(), &args.twin)?;
    note_jpegs(&args.measured, &args.talk);
    drop_doubtful_rest(&args.measured, &mut set, &args.talk);
    say_circles(&find_circles_with_sensor(&mut set, &sensor), &args.talk);
    let comparison = compare_presses(&set, &sensor)
        .map_err(|e| Failure::usage(format!("{}: {e}", args.measured.display())))?;
    if let Some(path) = &args.report {
        let page = PressPage {
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
            map: None,
            mean: page_scores(&comparison.mean),
            presses: shown(&set, &comparison),
        };
        let page = press_page(&page, |i| predict_press(&set.presses[i], set.ball_m, &sensor).ok());
        outputs.write(path, page.as_bytes())?;
    }
    let document = || json!({"schema": "gripgen.comparison/1", "presses": comparison_json(&comparison)});
    sink.finish(args.talk.quiet, document, || table(&comparison))
}

/// A twin against a force-sensor table.
fn sensor_table(args: &CompareArgs, sink: JsonSink) -> Result<u8, Failure> {
    let table = read_sensor_table(&args.measured).map_err(Failure::usage)?;
    let twin = load_twin(&args.twin, &[])?;
    let found = compare_sensor_table(&table, &twin)
        .map_err(|reason| Failure::usage(format!("{}: {reason}", args.measured.display())))?;
    if !args.talk.quiet {
        table.missing.notes().for_each(|note| eprintln!("note: {note}"));
    }
    let document = || {
        let by_session: Map<String, Value> = found
            .by_session
            .iter()
            .map(|(name, n, rmse_n)| (name.clone(), json!({"n": n, "rmse_n": rmse_n})))
            .collect();
        json!({
            "schema": "gripgen.comparison/1",
            "sensor": {"n": found.n, "rmse_n": found.rmse_n, "mape_pct": found.mape_pct, "bias_n": found.bias_n,
                "missing_cells": table.missing.counts(), "by_session": by_session},
        })
    };
    let text = || {
        format!(
            "{} rows, error {:.4} N ({:.1} %), gain and offset of each session refitted\n",
            found.n, found.rmse_n, found.mape_pct
        )
    };
    sink.finish(args.talk.quiet, document, text)
}

/// A twin against measured pulls.
fn pulls(args: &CompareArgs, outputs: &Outputs, mut sink: JsonSink) -> Result<u8, Failure> {
    let measured = folders(&args.measured, &args.also);
    let suspects = suspects(args.include_suspect);
    let mut loaded = load_pulls_with(&measured, suspects).map_err(|e| no_pulls(&measured, &e))?;
    let (twin, library, own) =
        TwinOfPulls { path: &args.twin, sets: &[], rig: None }.for_pulls(&mut loaded)?;
    loaded.warnings.extend(unmeasured(&twin, &loaded.pulls));
    say_warnings(&loaded, &args.talk);
    let twin_at = Location::parse(&args.twin);
    let draws =
        posterior_twins(&twin_at, &load_twin_document(&twin_at, &own.sets)?).map_err(Failure::from)?;
    let found = compare_pulls_with(&loaded.pulls, &twin, &draws, &library, jobs())
        .map_err(|e| Failure::usage(e).hint("name a twin that has this part with --twin"))?;
    let images =
        compare_images(&measured, &loaded, suspects, &twin, &library, jobs()).map_err(Failure::usage)?;
    if let Some(path) = &args.report {
        let title = format!("{} against {}", args.measured.display(), args.twin);
        let page = pull_comparison_page(
            &title,
            &ComparedPulls {
                measured: &loaded.pulls,
                label_n: &found.label_n,
                trace_n: &found.trace_n,
                rmse_n: found.pulls.rmse_n,
                mape_pct: found.pulls.mape_pct,
                bias_n: found.pulls.bias_n,
                coverage90: found.coverage90,
                outside_fit: found.outside_fit,
                traces: found.traces,
            },
        );
        outputs.write(path, page.as_bytes())?;
    }
    let errors =
        |e: &LabelErrors| json!({"n": e.n, "rmse_n": e.rmse_n, "mape_pct": e.mape_pct, "bias_n": e.bias_n});
    if sink.wanted() {
        let mut pulls = errors(&found.pulls);
        pulls["by_part"] =
            found.by_part.iter().map(|(name, e)| (name.clone(), errors(e))).collect::<Map<_, _>>().into();
        pulls["ratio"] = pull_ratios(&loaded.pulls, &found.label_n)
            .iter()
            .map(|(name, r)| (name.clone(), ratio_json(r)))
            .collect::<Map<_, _>>()
            .into();
        pulls["n_outside_fit"] = json!(found.outside_fit);
        pulls["coverage90"] = json!(found.coverage90);
        if !loaded.missing.counts().is_empty() {
            pulls["missing_cells"] = json!(loaded.missing.counts());
        }
        let traces = json!({"n": found.traces.0, "rmse_n": found.traces.1});
        let mut document = json!({"schema": "gripgen.comparison/1", "pulls": pulls, "traces": traces});
        if !own.notes.is_empty() {
            document["notes"] = json!(own.notes);
        }
        document["coverage90"] = json!(found.coverage90);
        if let Some(images) = images_json(&images) {
            document["images"] = images;
        }
        sink.document(&document)?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        let mut text =
            format!("{:<16} {:>6} {:>9} {:>7} {:>8}\n", "part", "pulls", "RMSE N", "MAPE %", "bias N");
        for (name, e) in found.by_part.iter().map(|(n, e)| (n.as_str(), e)).chain([("all", &found.pulls)]) {
            text +=
                &format!("{name:<16} {:>6} {:>9.3} {:>7.2} {:>8.3}\n", e.n, e.rmse_n, e.mape_pct, e.bias_n);
        }
        let over = if draws.is_empty() {
            "scatter and noise"
        } else {
            "scatter, noise and the posterior of the twin"
        };
        text += &format!(
            "{:.0} % of the labels lie in their 90 % interval over {over}\n",
            100.0 * found.coverage90
        );
        if found.traces.0 > 0 {
            text += &format!("{} traces: {:.3} N between their readings\n", found.traces.0, found.traces.1);
        }
        text += &images_table(&images);
        print(&text)?;
    }
    if !args.talk.quiet {
        own.notes.iter().chain(&loaded.notes).chain(&images.notes).for_each(|note| eprintln!("note: {note}"));
        if found.outside_fit > 0 {
            eprintln!(
                "note: {} pulls lie outside the grip forces on which an effect was fitted",
                found.outside_fit
            );
        }
    }
    Ok(0)
}

/// Measured over predicted labels of a part: the fit `a + b / F_G`, and errors before and after it.
fn ratio_json(ratio: &PartRatio) -> Value {
    let fit = ratio.fit.map(|f| json!({"a": f.a, "b_n": f.b_n, "covariance": f.covariance}));
    json!({
        "n": ratio.points.len(), "fit": fit, "before_pct": ratio.before_pct, "after_pct": ratio.after_pct,
        "left_out_pct": ratio.left_out_pct,
    })
}

/// The scores of the images of pulls as they stand in `--json`; `None` where no pull has images.
fn images_json(found: &ImageComparison) -> Option<Value> {
    let mut images = score_json(&found.mean()?);
    images["n"] = json!(found.each.len());
    let part = |(name, (n, score)): (String, (usize, Score))| {
        let mut own = score_json(&score);
        own["n"] = json!(n);
        (name, own)
    };
    images["by_part"] = found.by_part().into_iter().map(part).collect::<Map<_, _>>().into();
    let each = found.each.iter().map(|image| {
        let mut own = score_json(&image.score);
        own["pull"] = json!(image.pull);
        own["jaw"] = json!(image.jaw.to_string());
        own
    });
    images["each"] = each.collect::<Vec<_>>().into();
    Some(images)
}

/// The mean scores for people, and the image that is least like the twin's; nothing where no pull has images.
fn images_table(found: &ImageComparison) -> String {
    let Some(mean) = found.mean() else { return String::new() };
    let mut text =
        format!("{:<16} {:>6} {:>9} {:>7} {:>8} {:>7}\n", "part", "images", "MSE", "PSNR dB", "SSIM", "L1");
    let mut row = |name: &str, n: usize, s: &Score| {
        text +=
            &format!("{name:<16} {n:>6} {:>9.2} {:>7.2} {:>8.4} {:>7.2}\n", s.mse, s.psnr_db, s.ssim, s.l1);
    };
    found.by_part().iter().for_each(|(name, (n, score))| row(name, *n, score));
    row("all", found.each.len(), &mean);
    if let Some(worst) = found.each.iter().max_by(|a, b| a.score.mse.total_cmp(&b.score.mse)) {
        text += &format!("least alike: pull {}, {} jaw, MSE {:.2}\n", worst.pull, worst.jaw, worst.score.mse);
    }
    text
}

/// Presses as their page shows them.
pub fn shown<'a>(set: &'a PressSet, comparison: &PressComparison) -> Vec<PressShown<'a>> {
    let press = |(press, scored): (&'a Press, &PressScore)| PressShown {
        name: &press.name,
        image: &press.image,
        circle_px: press.circle.map(|c| [c.x_px, c.y_px, c.radius_px]),
        scores: page_scores(&scored.scores),
    };
    set.presses.iter().zip(&comparison.each).map(press).collect()
}

/// Scores as the page shows them.
pub fn page_scores(scores: &Scores) -> PressScores {
    let of = |s: &Score| gripgen_report::Score { mse: s.mse, psnr_db: s.psnr_db, ssim: s.ssim, l1: s.l1 };
    let Scores { full, crop400, crop200, window } = scores;
    PressScores { full: of(full), crop400: of(crop400), crop200: of(crop200), window: of(window) }
}

/// The scores of presses as they stand in `--json`.
pub fn comparison_json(comparison: &PressComparison) -> Value {
    let each: Vec<Value> = comparison
        .each
        .iter()
        .map(|press| {
            let mut scores = scores_json(&press.scores);
            scores["name"] = json!(press.name);
            scores["shape"] = json!(press.shape);
            scores
        })
        .collect();
    let mut all = scores_json(&comparison.mean);
    all["n"] = json!(comparison.each.len());
    all["each"] = json!(each);
    let named = |(name, n, score): (&str, usize, &Score)| {
        let value = json!({"n": n, "mse": score.mse, "psnr": score.psnr_db, "ssim": score.ssim});
        (name.to_string(), value)
    };
    let shapes = comparison.by_shape.iter().map(|(shape, n, score)| named((shape, *n, score)));
    all["by_shape"] = Value::Object(shapes.collect());
    let zones = comparison.by_zone.iter().map(|(zone, n, score)| named((zone.name(), *n, score)));
    all["by_zone"] = Value::Object(zones.collect());
    if !comparison.by_dots.is_empty() {
        let places = comparison.by_dots.iter().map(|(place, n, score)| named((place.name(), *n, score)));
        all["by_dots"] = Value::Object(places.collect());
    }
    all
}

fn scores_json(scores: &Scores) -> Value {
    json!({
        "full": score_json(&scores.full),
        "crop400": score_json(&scores.crop400),
        "crop200": score_json(&scores.crop200),
        "window": score_json(&scores.window),
    })
}

fn score_json(score: &Score) -> Value {
    // Equal images have an infinite ratio, which JSON cannot hold: null.
    json!({"mse": score.mse, "psnr": score.psnr_db, "ssim": score.ssim, "l1": score.l1})
}

/// The mean scores for people.
pub fn table(comparison: &PressComparison) -> String {
    let mut text = format!("{} presses           MSE    PSNR     SSIM     L1\n", comparison.each.len());
    let mut row = |name: &str, s: &Score| {
        text += &format!("{name:<15} {:>9.2} {:>7.2} {:>8.4} {:>6.2}\n", s.mse, s.psnr_db, s.ssim, s.l1);
    };
    let mean = &comparison.mean;
    row("whole frame", &mean.full);
    row("400 px crop", &mean.crop400);
    row("200 px crop", &mean.crop200);
    if comparison.by_shape.iter().any(|(shape, _, _)| shape != "ball") {
        row("160 px window", &mean.window);
        for (shape, n, score) in &comparison.by_shape {
            row(&format!("  {shape} ({n})"), score);
        }
    }
    comparison.by_dots.iter().for_each(|(place, _, score)| row(place.name(), score));
    text
}
