//! What the report of presses shows.

use super::PressDiagnosisInput;
use gripgen::report::{EvidenceRow, Mark, Plot, PlotGroup, ReportData, Series, WorstRow};
use gripgen_identify::{Diagnosis, PressCovariate, PressDiagnosis, PressTrial, PressValues, Verdict};
use gripgen_tactile::presses::ZONES;

/// The page where nothing can be said.
pub(super) fn without_answer(diagnosis: &Diagnosis) -> ReportData {
    ReportData {
        title: "Diagnosis of presses".into(),
        sentence: sentence(diagnosis),
        error_unit: "grey levels^2".into(),
        ..Default::default()
    }
}

/// The page.
pub(super) fn report(
    input: &PressDiagnosisInput<'_>,
    covariates: &[PressCovariate],
    found: &PressDiagnosis,
) -> ReportData {
    let mut report = without_answer(&found.diagnosis);
    let frames = &found.frame_mse;
    report.groups = vec![by_zone(&found.zone_mse), by_covariate(covariates, frames)];
    report.evidence = evidence(&found.diagnosis, &found.trials);
    let mut worst: Vec<usize> = (0..frames.len()).collect();
    worst.sort_by(|&a, &b| frames[b].1.total_cmp(&frames[a].1));
    let mean = frames.iter().map(|f| f.1).sum::<f64>() / frames.len() as f64;
    let sd =
        (frames.iter().map(|f| (f.1 - mean).powi(2)).sum::<f64>() / frames.len() as f64).sqrt().max(1e-9);
    report.worst = worst
        .into_iter()
        .take(8)
        .map(|i| {
            let press = &input.set.presses[i];
            let circle = press.circle.map_or(String::new(), |c| {
                format!("at ({:.0}, {:.0}), radius {:.0} px", c.x_px, c.y_px, c.radius_px)
            });
            WorstRow {
                id: press.name.clone(),
                about: circle,
                measured: frames[i].0,
                predicted: frames[i].1,
                deviations: (frames[i].1 - mean) / sd,
            }
        })
        .collect();
    report
}

/// The verdict in a sentence.
fn sentence(diagnosis: &Diagnosis) -> String {
    let names: Vec<&str> = diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
    let unknown: Vec<&str> = diagnosis.unknown.iter().map(|u| u.covariate.as_str()).collect();
    let error = diagnosis.error.as_ref().map_or(String::new(), |e| {
        let mse = |e: &gripgen_identify::HeldOutError| e.mse.unwrap_or(f64::NAN);
        format!(
            ": the mean squared error of whole frames goes from {:.2} to {:.2} on presses that were held out",
            mse(&e.before),
            mse(&e.after)
        )
    });
    match diagnosis.verdict {
        Verdict::None => "The sensor file lacks nothing that these presses show.".into(),
        Verdict::Insufficient => diagnosis.notes.first().cloned().unwrap_or_default(),
        Verdict::Unknown => format!(
            "No effect of the library explains what these presses show; it depends on {}.",
            unknown.join(", ")
        ),
        Verdict::Effect if unknown.is_empty() => {
            format!("The sensor file lacks {}{error}.", names.join(" and "))
        }
        Verdict::Effect => format!(
            "The sensor file lacks {}, and something that depends on {}{error}.",
            names.join(" and "),
            unknown.join(", ")
        ),
    }
}

fn by_zone([before, after]: &[[f64; ZONES.len()]; 2]) -> PlotGroup {
    let points = |mse: &[f64]| mse.iter().enumerate().map(|(z, mse)| (z as f64, *mse)).collect();
    let series =
        |name: &str, points| Series { name: name.into(), mark: Mark::Points, points, errors: Vec::new() };
    PlotGroup {
        title: "Where the residual lies".into(),
        about: "Mean squared residual by zone: inside the contact, up to 0.4 radii outside its rim, up to 2.2 radii, and beyond.".into(),
        plots: vec![Plot {
            title: "residual by zone".into(),
            x_label: "zone".into(),
            y_label: "mean squared residual, grey levels^2".into(),
            x_words: ZONES.iter().map(|z| z.name().to_string()).collect(),
            series: vec![
                series("before", points(before)),
                series("after", points(after)),
            ],
        }],
    }
}

fn by_covariate(covariates: &[PressCovariate], frames: &[(f64, f64)]) -> PlotGroup {
    let plots = covariates
        .iter()
        .map(|covariate| {
            let (x, words) = match &covariate.values {
                PressValues::Numbers(values) => (values.clone(), Vec::new()),
                PressValues::Words(words) => {
                    let mut levels = words.clone();
                    levels.sort();
                    levels.dedup();
                    let at = |w: &String| levels.iter().position(|l| l == w).unwrap_or(0) as f64;
                    (words.iter().map(at).collect(), levels)
                }
            };
            let series = |name: &str, y: &dyn Fn(&(f64, f64)) -> f64| Series {
                name: name.into(),
                mark: Mark::Points,
                points: x.iter().copied().zip(frames.iter().map(y)).collect(),
                errors: Vec::new(),
            };
            Plot {
                title: format!("error against {}", covariate.name),
                x_label: covariate.name.clone(),
                y_label: "mean squared error of the frame, grey levels^2".into(),
                x_words: words,
                series: vec![series("before", &|f| f.0), series("after", &|f| f.1)],
            }
        })
        .collect();
    PlotGroup {
        title: "What the residual depends on".into(),
        about: "Error of each press, whole frame, held out.".into(),
        plots,
    }
}

fn evidence(diagnosis: &Diagnosis, trials: &[PressTrial]) -> Vec<EvidenceRow> {
    trials
        .iter()
        .map(|trial| {
            let tied = diagnosis
                .effects
                .iter()
                .find(|e| e.indistinguishable_from.iter().any(|r| r.name == trial.name));
            let fate = if diagnosis.effects.iter().any(|e| e.name == trial.name) {
                "named".to_string()
            } else if let Some(effect) = tied {
                format!("tied with {}", effect.name)
            } else if diagnosis.unknown.iter().any(|u| trial.name == format!("curve in {}", u.covariate)) {
                "reported as unknown".into()
            } else {
                "no gain that counts".into()
            };
            EvidenceRow {
                name: format!("{}. {}", trial.round + 1, trial.name),
                heldout_gain: trial.gain,
                standard_error: trial.standard_error,
                heldout_error: trial.cost,
                values: trial.values.clone(),
                fate,
            }
        })
        .collect()
}
