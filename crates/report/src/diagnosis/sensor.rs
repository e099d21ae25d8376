//! What the report of a force-sensor table shows.

use super::{EvidenceRow, ReportData, WorstRow};
use crate::{Plot, PlotGroup, Series};
use gripgen_identify::{SensorDiagnosis, SensorRow};

/// Most points of a plot.
const MAX_POINTS: usize = 1500;
/// Blocks in the list of the worst.
const WORST: usize = 6;
/// Sessions with a plot of their own.
const SESSIONS: usize = 6;

/// Plots and tables of an answer.
pub fn sensor_report(answer: &SensorDiagnosis) -> ReportData {
    let diagnosis = &answer.diagnosis;
    let evidence = answer.evidence.iter().map(|e| EvidenceRow {
        name: e.name.clone(),
        heldout_gain: e.heldout_gain,
        standard_error: e.standard_error,
        heldout_error: e.heldout_rmse_n,
        values: e.values.clone(),
        fate: e.fate.clone(),
    });
    let worst = answer.blocks.iter().take(WORST).map(|b| WorstRow {
        id: format!("{} {:.1}..{:.1} s", b.session, b.from_to_s.0, b.from_to_s.1),
        about: format!("held-out error {:.4} N", b.rmse_n),
        measured: b.measured_n,
        predicted: b.predicted_n,
        deviations: b.rmse_n / diagnosis.noise_floor_n.unwrap_or(b.rmse_n).max(f64::MIN_POSITIVE),
    });
    ReportData {
        groups: if answer.rows.is_empty() { Vec::new() } else { groups(answer) },
        evidence: evidence.collect(),
        worst: worst.collect(),
        error_unit: "N".into(),
        ..ReportData::default()
    }
}

fn groups(answer: &SensorDiagnosis) -> Vec<PlotGroup> {
    let step = answer.rows.len().div_ceil(MAX_POINTS);
    let rows: Vec<&SensorRow> = answer.rows.iter().step_by(step).collect();
    let against = |title: &str, x_label: &str, x: fn(&SensorRow) -> f64| {
        let of = |name: &str, predicted: fn(&SensorRow) -> f64| {
            Series::points(name, rows.iter().map(|r| (x(r), r.measured_n - predicted(r))))
        };
        let series = vec![of("gain and offset", |r| r.before_n), of("with the effects", |r| r.after_n)];
        Plot::new(title, x_label, "residual [N]", series)
    };
    let clock = "time since the start of the table [s]";
    let residuals = vec![
        against("Against time", clock, |r| r.clock_s),
        against("Against the force", "reference force [N]", |r| r.reference_n),
        against("Against its change", "change of the reference force [N/s]", |r| r.rate_n_per_s),
    ];
    let session = |(s, name): (usize, &String)| {
        let over = |y: fn(&SensorRow) -> f64| {
            let own = rows.iter().filter(move |r| r.session == s);
            own.map(move |r| (r.clock_s, y(r)))
        };
        let series = vec![
            Series::points("measured", over(|r| r.measured_n)),
            Series::line("gain and offset", over(|r| r.before_n)),
            Series::line("with the effects", over(|r| r.after_n)),
        ];
        Plot::new(format!("Session {name}"), clock, "reading [N]", series)
    };
    vec![
        PlotGroup {
            title: "What is left".into(),
            about: "Reading less prediction; every block was predicted from the other five of its session."
                .into(),
            plots: residuals,
        },
        PlotGroup {
            title: "Readings".into(),
            about: "Measured, and predicted from the other blocks.".into(),
            plots: answer.sessions.iter().enumerate().take(SESSIONS).map(session).collect(),
        },
    ]
}
