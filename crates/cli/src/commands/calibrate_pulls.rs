//! `gripgen calibrate pulls`: fit a twin to measured pulls.

use crate::args::CalibratePullsArgs;
use crate::failure::Failure;
use crate::load::{TwinOfPulls, folders, jobs, load_pulls_to_fit, suspects};
use crate::output::{JsonSink, print};
use crate::outputs::{Outputs, draws_of};
use crate::{
    CalibratePullsError, ImprintCalibrations, calibrate_imprints, calibrate_twin, edited_twin_toml,
    pull_priors,
};
use gripgen::twin::Part;
use gripgen::{Location, load_twin_document};
use gripgen_identify::ParameterEstimate;
use gripgen_identify::pulls::calibrate::{CalibrateError, CalibrateRequest, PullCalibration};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;

/// Runs the verb.
pub fn run(args: &CalibratePullsArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force)
        .reads(&args.measured)
        .reads_all(&args.also)
        .reads_config(&args.twin, &args.set);
    outputs.allow_twin(&args.out)?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let measured = folders(&args.measured, &args.also);
    let mut loaded = load_pulls_to_fit(&measured, suspects(args.include_suspect), &args.talk, false)?;
    let (twin, library, own) =
        TwinOfPulls { path: &args.twin, sets: &args.set, rig: None }.for_fit(&mut loaded)?;
    let sets = [&args.set[..], &own.sets].concat();
    let twin_at = Location::parse(&args.twin);
    let document = load_twin_document(&twin_at, &sets)?;
    let request = CalibrateRequest {
        offset_law: args.law.is_some(),
        effects: args.fit.clone(),
        priors: Some(pull_priors(&twin, &document, &loaded.pulls)),
    };
    let (found, mut edits) =
        calibrate_twin(&loaded.pulls, &twin, &library, &request, jobs()).map_err(|e| {
            let hint = match &e {
                CalibratePullsError::Twin(e) => e.hint(),
                CalibratePullsError::Fit(
                    CalibrateError::UnknownEffect(_) | CalibrateError::NotInPulls { .. },
                ) => "`gripgen effects` lists the effects, and what shows them",
                CalibratePullsError::Fit(CalibrateError::NotExcited { .. }) => {
                    "`gripgen campaign` plans pulls that vary everything"
                }
                _ => "`gripgen campaign` plans pulls that can be calibrated",
            };
            Failure::usage(e).hint(hint)
        })?;
    let pulls = &loaded.pulls.pulls;
    let seen = loaded.pulls.kept(|i| twin.parts.get(&pulls[i].part).is_some_and(Part::has_geometry));
    let imprints = calibrate_imprints(&args.measured, &seen, &twin_at, &sets).map_err(|e| {
        Failure::usage(e).hint("images/<pull_id>_left.png and _right.png have the size of the twin's sensor")
    })?;
    edits.values.extend(imprints.values(&loaded.pulls));
    let text = edited_twin_toml(&twin_at, &sets, &edits, &args.out).map_err(Failure::new)?;
    outputs.write_twin(&args.out, &text, Some(&found.posterior))?;
    if sink.wanted() {
        let mut document = json_of(&found, &imprints, loaded.pulls.pulls.len(), &loaded.pulls.sha256);
        if let Some(name) = draws_of(&args.out).as_deref().and_then(Path::file_name) {
            let file = name.to_string_lossy();
            document["posterior"] = json!({"file": file, "draws": found.posterior.draws.len()});
        }
        document["warnings"] = json!([&loaded.warnings[..], &own.notes].concat());
        if !loaded.missing.counts().is_empty() {
            document["data"]["missing_cells"] = json!(loaded.missing.counts());
        }
        sink.document(&document)?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&summary(&found, &imprints))?;
    }
    if !args.talk.quiet {
        own.notes
            .iter()
            .chain(&loaded.notes)
            .chain(&imprints.notes)
            .chain(&found.notes)
            .for_each(|note| eprintln!("note: {note}"));
        if found.leans_on_beliefs {
            eprintln!("note: {}", beliefs(loaded.pulls.pulls.len()));
        }
        eprintln!("the twin: {}", args.out.display());
    }
    Ok(0)
}

/// What is to be known of a fit to a few pulls.
fn beliefs(pulls: usize) -> String {
    let few = match pulls {
        1 => "one pull is not enough on its own".into(),
        n => format!("{n} pulls like these are not enough on their own"),
    };
    format!(
        "{few}: the intervals lean on what is believed of parts and rigs (assets/priors/pulls.toml, or a calibrated --twin; docs/few-pulls.md)"
    )
}

fn estimate(p: &ParameterEstimate) -> Value {
    json!({"value": p.value, "low90": p.low90, "high90": p.high90, "unit": p.unit})
}

fn json_of(found: &PullCalibration, imprints: &ImprintCalibrations, pulls: usize, sha256: &str) -> Value {
    let named = |values: &std::collections::BTreeMap<String, ParameterEstimate>| {
        values.iter().map(|(name, p)| (name.clone(), estimate(p))).collect::<Map<_, _>>()
    };
    let laws: Vec<Value> = found
        .laws
        .iter()
        .map(|law| {
            json!({
                "part": law.part,
                "a": estimate(&law.a),
                "b_n": estimate(&law.b_n),
                "covariance": {"a_a": law.covariance[0], "a_b_n": law.covariance[1], "b_n_b_n": law.covariance[2]},
                "largest_relative_sigma": law.largest_relative_sigma,
                "largest_relative_sigma_of_three_levels": law.of_three_levels,
            })
        })
        .collect();
    let effects: Vec<Value> =
        found.effects.iter().map(|(name, p)| json!({"name": name, "parameters": named(p)})).collect();
    json!({
        "schema": "gripgen.calibration/1",
        "channel": "pulls",
        "data": {"pulls": pulls, "sha256": sha256},
        "notes": found.notes,
        "outliers": found.outliers,
        "leans_on_beliefs": found.leans_on_beliefs,
        "fitted_grip_force_n": [found.grip_force_n.0, found.grip_force_n.1],
        "baseline": named(&found.baseline),
        "laws": laws,
        "effects": effects,
        "imprints": imprints.parts.iter().map(|i| (i.part.clone(), json!({
            "imprint_mm3_per_n": estimate(&i.estimate.imprint_mm3_per_n),
            "exponent": i.estimate.exponent.as_ref().map(estimate),
            "pulls": i.pulls,
            "explained": i.explained,
        }))).collect::<Map<_, _>>(),
        "error": found.error.map(|e| json!({
            "heldout": "repetitions", "rmse_n": e.rmse_n, "low90": e.low90, "high90": e.high90, "mape_pct": e.mape_pct
        })),
    })
}

fn summary(found: &PullCalibration, imprints: &ImprintCalibrations) -> String {
    let mut text = String::new();
    let line = |text: &mut String, name: &str, p: &ParameterEstimate| {
        let unit = if p.unit == "1" { "" } else { p.unit.as_str() };
        let _ = if p.low90 < p.high90 {
            writeln!(text, "{name:<36} {:>10.4} {unit:<7} ({:.4} to {:.4})", p.value, p.low90, p.high90)
        } else {
            writeln!(text, "{name:<36} {:>10.4} {unit}", p.value)
        };
    };
    for (name, p) in &found.baseline {
        line(&mut text, name, p);
    }
    for found in &imprints.parts {
        let (name, c) =
            (format!("parts.{}.imprint_mm3_per_n", found.part), &found.estimate.imprint_mm3_per_n);
        line(&mut text, &name, c);
        let share = 100.0 * found.explained;
        let _ = writeln!(
            text,
            "  it explains {share:.0} % of what changes in the images of {} pulls",
            found.pulls
        );
        if let Some(p) = found.estimate.exponent.as_ref().filter(|p| p.low90 > 1.0 || p.high90 < 1.0) {
            line(&mut text, "  imprints grow as F^p (imprint_nonlinearity) with p", p);
        }
    }
    for law in &found.laws {
        line(&mut text, &format!("load_offset of {}: a", law.part), &law.a);
        line(&mut text, &format!("load_offset of {}: b_n", law.part), &law.b_n);
        let few = law
            .of_three_levels
            .map_or(String::new(), |s| format!(", {:.1} % from three forces alone", 100.0 * s));
        let _ = writeln!(
            text,
            "  its coefficient is known to {:.1} % (standard deviation, worst){few}",
            100.0 * law.largest_relative_sigma
        );
    }
    for (name, parameters) in &found.effects {
        for (parameter, p) in parameters {
            line(&mut text, &format!("{name}.{parameter}"), p);
        }
    }
    if let Some(error) = &found.error {
        let rmse = error.rmse_n.unwrap_or_default();
        let _ = writeln!(
            text,
            "error on held-out repetitions: {rmse:.3} N ({:.3} to {:.3})",
            error.low90, error.high90
        );
    }
    text
}
