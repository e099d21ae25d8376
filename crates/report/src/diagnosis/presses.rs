//! What the report of presses shows.

use super::{EvidenceRow, ReportData, WorstRow};
use crate::{Plot, PlotGroup, Series};
use gripgen_identify::{Diagnosis, PRESS_ZONES, PressCovariate, PressDiagnosis, PressTrial, PressValues};

/// Presses in the list of the worst.
const WORST: usize = 8;

/// A press: what it is called, and where its contact is, for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PressPlace {
    /// Its name.
    pub name: String,
    /// Place and size of the contact, or nothing.
    pub place: String,
}

/// Plots and tables of an answer; `zones`: what the zones of a press are called.
pub fn press_report(
    presses: &[PressPlace],
    zones: [&str; PRESS_ZONES],
    covariates: &[PressCovariate],
    found: &PressDiagnosis,
) -> ReportData {
    let frames = &found.frame_mse;
    let mut worst: Vec<usize> = (0..frames.len()).collect();
    worst.sort_by(|&a, &b| frames[b].1.total_cmp(&frames[a].1));
    let mean = frames.iter().map(|f| f.1).sum::<f64>() / frames.len() as f64;
    let sd =
        (frames.iter().map(|f| (f.1 - mean).powi(2)).sum::<f64>() / frames.len() as f64).sqrt().max(1e-9);
    let worst = worst.into_iter().take(WORST).map(|i| WorstRow {
        id: presses[i].name.clone(),
        about: presses[i].place.clone(),
        measured: frames[i].0,
        predicted: frames[i].1,
        deviations: (frames[i].1 - mean) / sd,
    });
    ReportData {
        groups: vec![by_zone(zones, &found.zone_mse), by_covariate(covariates, frames)],
        evidence: evidence(&found.diagnosis, &found.trials),
        worst: worst.collect(),
        title: "Diagnosis of presses".into(),
        error_unit: "grey levels^2".into(),
        ..ReportData::default()
    }
}

fn by_zone(zones: [&str; PRESS_ZONES], [before, after]: &[[f64; PRESS_ZONES]; 2]) -> PlotGroup {
    let of = |name: &str, mse: &[f64]| {
        Series::points(name, mse.iter().enumerate().map(|(z, mse)| (z as f64, *mse)))
    };
    let series = vec![of("before", before), of("after", after)];
    let plot = Plot::new("residual by zone", "zone", "mean squared residual, grey levels^2", series);
    PlotGroup {
        title: "Where the residual lies".into(),
        about: "Mean squared residual by zone: inside the contact, up to 0.4 radii outside its rim, up to 2.2 radii, and beyond.".into(),
        plots: vec![Plot { x_words: zones.map(String::from).to_vec(), ..plot }],
    }
}

fn by_covariate(covariates: &[PressCovariate], frames: &[(f64, f64)]) -> PlotGroup {
    let plot = |covariate: &PressCovariate| {
        let (x, x_words): (Vec<f64>, Vec<String>) = match &covariate.values {
            PressValues::Numbers(values) => (values.clone(), Vec::new()),
            PressValues::Words(words) => {
                let mut levels = words.clone();
                levels.sort();
                levels.dedup();
                let at = |word: &String| levels.partition_point(|level| level < word) as f64;
                (words.iter().map(at).collect(), levels)
            }
        };
        let of = |name: &str, y: fn(&(f64, f64)) -> f64| {
            Series::points(name, x.iter().copied().zip(frames.iter().map(y)))
        };
        let title = format!("error against {}", covariate.name);
        let y_label = "mean squared error of the frame, grey levels^2";
        let series = vec![of("before", |f| f.0), of("after", |f| f.1)];
        Plot { x_words, ..Plot::new(title, &covariate.name, y_label, series) }
    };
    PlotGroup {
        title: "What the residual depends on".into(),
        about: "Error of each press, whole frame, held out.".into(),
        plots: covariates.iter().map(plot).collect(),
    }
}

fn evidence(diagnosis: &Diagnosis, trials: &[PressTrial]) -> Vec<EvidenceRow> {
    let fate = |name: &str| {
        let mut effects = diagnosis.effects.iter();
        let tied = effects.clone().find(|e| e.indistinguishable_from.iter().any(|r| r.name == name));
        if effects.any(|e| e.name == name) {
            "named".to_string()
        } else if let Some(effect) = tied {
            format!("tied with {}", effect.name)
        } else if diagnosis.unknown.iter().any(|u| name == format!("curve in {}", u.covariate)) {
            "reported as unknown".into()
        } else {
            "no gain that counts".into()
        }
    };
    let row = |trial: &PressTrial| EvidenceRow {
        name: format!("{}. {}", trial.round + 1, trial.name),
        heldout_gain: trial.gain,
        standard_error: trial.standard_error,
        heldout_error: trial.cost,
        values: trial.values.clone(),
        fate: fate(&trial.name),
    };
    trials.iter().map(row).collect()
}
