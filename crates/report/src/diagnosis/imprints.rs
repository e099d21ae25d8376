//! What the report of a set of imprints shows.

use super::{EvidenceRow, ReportData, WorstRow};
use crate::{Plot, PlotGroup, Series};
use gripgen_identify::{ImprintDiagnosis, ImprintRow};

/// Grasps with a plot of their own.
const PLOTS: usize = 6;
/// Rows in the list of the worst.
const WORST: usize = 6;
/// Sets of effects in the table of evidence.
const EVIDENCE: usize = 8;

/// Plots and tables of an answer.
pub fn imprint_report(answer: &ImprintDiagnosis) -> ReportData {
    let floor = answer.diagnosis.noise_floor_mm3.unwrap_or(1.0).max(f64::MIN_POSITIVE);
    let mut rows: Vec<&ImprintRow> = answer.rows.iter().collect();
    let left = |r: &ImprintRow| r.measured_mm3 - r.after_mm3;
    rows.sort_by(|a, b| left(b).abs().total_cmp(&left(a).abs()));
    let worst = rows.iter().take(WORST).map(|r| WorstRow {
        id: answer.grasps[r.grasp].constant.name.clone(),
        about: format!("{:.2} N at {:.2} s", r.force_n, r.time_s),
        measured: r.measured_mm3,
        predicted: r.after_mm3,
        deviations: left(r).abs() / floor,
    });
    let evidence = answer.evidence.iter().take(EVIDENCE).map(|e| EvidenceRow {
        name: e.name.clone(),
        heldout_gain: e.gain.0,
        standard_error: e.gain.1,
        heldout_error: e.rmse_mm3,
        values: e.values.clone(),
        fate: e.fate.clone(),
    });
    ReportData {
        groups: if answer.rows.is_empty() { Vec::new() } else { groups(answer) },
        evidence: evidence.collect(),
        worst: worst.collect(),
        ..ReportData::default()
    }
}

fn groups(answer: &ImprintDiagnosis) -> Vec<PlotGroup> {
    let against = |title: &str, x_label: &str, x: fn(&ImprintRow) -> f64| {
        let of = |name: &str, predicted: fn(&ImprintRow) -> f64| {
            let points = answer.rows.iter().map(|r| (x(r), r.measured_mm3 - predicted(r)));
            Series::points(name, points.filter(|p| p.0.is_finite()))
        };
        let series = vec![of("V = c F", |r| r.before_mm3), of("with the effects", |r| r.after_mm3)];
        Plot::new(title, x_label, "residual [mm^3]", series)
    };
    let force = "force of the jaw [N]";
    let mut left = vec![against("Against the force", force, |r| r.force_n)];
    if answer.rows.iter().any(|r| r.time_s.is_finite()) {
        left.push(against("Against time", "time since the start of the grasp [s]", |r| r.time_s));
    }
    let grasp = |(g, name): (usize, &str)| {
        let of = |name: &str, y: fn(&ImprintRow) -> f64| {
            Series::points(name, answer.rows.iter().filter(|r| r.grasp == g).map(|r| (r.force_n, y(r))))
        };
        let series = vec![
            of("measured", |r| r.measured_mm3),
            of("V = c F", |r| r.before_mm3),
            of("with the effects", |r| r.after_mm3),
        ];
        Plot::new(name, force, "volume of the imprint [mm^3]", series)
    };
    let names = answer.grasps.iter().map(|g| g.constant.name.as_str()).enumerate();
    vec![
        PlotGroup {
            title: "What is left".into(),
            about: "Volume less prediction; c comes from other stretches of the same grasp, effects from other grasps.".into(),
            plots: left,
        },
        PlotGroup {
            title: "Grasps".into(),
            about: "Volume over the force that was read, measured and predicted.".into(),
            plots: names.take(PLOTS).map(grasp).collect(),
        },
    ]
}
