//! What the report of a diagnosis of pulls shows in addition to the answer itself.

use super::decisive::decisive;
use super::doubt::one_for_all;
use super::{EvidenceRow, ReportData, WorstRow};
use crate::text::spread;
use crate::{Plot, PlotGroup, Series};
use gripgen_identify::pulls::answer::{PullAnswer, PullFits};
use gripgen_identify::pulls::search::{Entry, ModelTerm};
use gripgen_identify::{Level, levels};
use gripgen_twin::MeasuredPulls;
use gripgen_twin::columns::{covariates, value};
use gripgen_twin::draw::Drawn;
use gripgen_twin::effects::find;
use gripgen_twin::predict::PullModel;
use std::collections::BTreeMap;

/// Pull curves shown, rows of the tables.
const CURVES: usize = 6;
const CANDIDATES: usize = 14;
const WORST: usize = 10;

/// Readings that a model predicts for the times of a pull, without its scatter.
pub type SimulatePull<'a> = dyn Fn(&PullModel, usize, &[f64]) -> Vec<f64> + 'a;

/// What two models predict for each pull, before and after what was found was added, in newtons.
#[derive(Debug, Clone, Copy)]
pub struct Predictions<'a> {
    /// For pulls that were held out.
    pub heldout_label_n: [&'a [f64]; 2],
    /// By the fits to all pulls.
    pub label_n: [&'a [f64]; 2],
    /// Measured less predicted label of the second model, in standard deviations.
    pub deviations: &'a [f64],
}

/// Plots and tables of an answer. Empty where nothing was fitted.
pub fn pull_report(measured: &MeasuredPulls, simulate: &SimulatePull<'_>, answer: &PullAnswer) -> ReportData {
    let Some(fits) = &answer.fits else { return ReportData::default() };
    let predictions = Predictions {
        heldout_label_n: [&fits.heldout_label_n[0], &fits.heldout_label_n[1]],
        label_n: [&fits.label_n[0], &fits.label_n[1]],
        deviations: &fits.after.residuals,
    };
    let mut report = prediction_report(measured, predictions, &important(answer));
    report.groups.push(PlotGroup {
        title: "Pull curves".into(),
        about: "The twin over the measurement; its curve ends the rise at the expected limit, without the scatter of this \
                pull."
            .into(),
        plots: curves(measured, simulate, fits),
    });
    if let Some(group) = decisive(measured, fits, answer, axis_label) {
        report.groups.insert(0, group);
        report.decides = 1;
    }
    report.evidence = evidence(fits, answer);
    report
}

/// Plots and tables of two models that were compared; the columns of `first` come first.
pub fn prediction_report(
    measured: &MeasuredPulls,
    predictions: Predictions<'_>,
    first: &[String],
) -> ReportData {
    let groups = vec![
        PlotGroup {
            title: "Residual against each covariate".into(),
            about: "Measured less predicted label of held-out pulls, before and after what was found was added. Those that \
                    matter come first."
                .into(),
            plots: residuals(measured, predictions, first),
        },
        PlotGroup {
            title: "Maximum pull force over grip force".into(),
            about: "Means of the measured labels with their standard deviations, and the means of what is predicted for the \
                    same pulls."
                .into(),
            plots: limits(measured, predictions),
        },
    ];
    ReportData { groups, worst: worst(measured, predictions), ..Default::default() }
}

/// Covariates that the answer names, in its order.
fn important(answer: &PullAnswer) -> Vec<String> {
    let d = &answer.diagnosis;
    let of_effects = d.effects.iter().filter_map(|e| find(&e.name)).flat_map(|spec| spec.covariates.iter());
    let unknown = d.unknown.iter().flat_map(|u| u.covariate.split('*'));
    unknown.map(String::from).chain(of_effects.map(|c| c.to_string())).collect()
}

fn residuals(measured: &MeasuredPulls, predictions: Predictions<'_>, first: &[String]) -> Vec<Plot> {
    let extra = measured.extra.iter().map(|e| e.name.as_str());
    let known = covariates().map(|c| c.name).filter(|c| measured.recorded.iter().any(|r| r == c));
    let mut names: Vec<&str> = known.chain(extra).collect();
    // A stable sort: the rest keeps its order.
    names.sort_by_key(|name| first.iter().position(|f| f == name).unwrap_or(first.len()));
    names.into_iter().filter_map(|name| residual(measured, predictions, name)).collect()
}

/// The plot over one column; none where it does not vary.
fn residual(measured: &MeasuredPulls, predictions: Predictions<'_>, name: &str) -> Option<Plot> {
    let values: Vec<Option<Drawn>> = measured.pulls.iter().map(|p| value(name, p.view())).collect();
    let mut words: Vec<String> = values
        .iter()
        .filter_map(|v| match v {
            Some(Drawn::Text(word)) => Some(word.clone()),
            _ => None,
        })
        .collect();
    words.sort();
    words.dedup();
    let x = |v: &Option<Drawn>| match v {
        Some(Drawn::Number(x)) => *x,
        Some(Drawn::Text(word)) => words.partition_point(|w| w < word) as f64,
        None => f64::NAN,
    };
    let x: Vec<f64> = values.iter().map(x).collect();
    let known: Vec<f64> = x.iter().copied().filter(|x| x.is_finite()).collect();
    if known.iter().all(|v| *v == known[0]) {
        return None;
    }
    let series = |name: &str, predicted: &[f64]| {
        let pulls = x.iter().zip(&measured.pulls).zip(predicted);
        Series::points(name, pulls.map(|((x, pull), predicted)| (*x, pull.max_pull_force_n - predicted)))
    };
    let both = predictions.heldout_label_n;
    let both = vec![series("before", both[0]), series("after", both[1])];
    Some(Plot { x_words: words, ..Plot::new(name, axis_label(name), "measured \u{2212} predicted, N", both) })
}

/// The name of a column in words, with the unit that its name ends in.
fn axis_label(name: &str) -> String {
    let units = [
        ("_mm_per_s", "mm/s"),
        ("_n_per_s", "N/s"),
        ("_n", "N"),
        ("_mm", "mm"),
        ("_s", "s"),
        ("_c", "\u{b0}C"),
        ("_deg", "\u{b0}"),
        ("_pct", "%"),
        ("_hz", "Hz"),
        ("_v", "V"),
        ("_a", "A"),
    ];
    let found = units.iter().find_map(|(suffix, unit)| Some((name.strip_suffix(suffix)?, unit)));
    match found {
        Some((stem, unit)) if !stem.is_empty() => format!("{}, {unit}", stem.replace('_', " ")),
        _ => name.replace('_', " "),
    }
}

/// One plot a part.
fn limits(measured: &MeasuredPulls, predictions: Predictions<'_>) -> Vec<Plot> {
    let mut parts: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (i, pull) in measured.pulls.iter().enumerate() {
        parts.entry(&pull.part).or_default().push(i);
    }
    let plot = |(part, pulls): (&str, Vec<usize>)| {
        let of = |value: &dyn Fn(usize) -> f64| {
            levels(&pulls.iter().map(|&i| (measured.pulls[i].grip_force_n, value(i))).collect::<Vec<_>>())
        };
        let means = |all: &[Level]| all.iter().map(|l| (l.grip_force_n, l.mean_n)).collect::<Vec<_>>();
        let line = |name: &str, predicted: &[f64]| Series::line(name, means(&of(&|i| predicted[i])));
        let labels = of(&|i| measured.pulls[i].max_pull_force_n);
        let deviation = |level: &Level| {
            let n = level.rows.len().max(2) as f64;
            level.rms_n * libm::sqrt(level.rows.len() as f64 / (n - 1.0))
        };
        let errors = labels.iter().map(deviation).collect();
        let measured = Series { errors, ..Series::points("measured", means(&labels)) };
        let series =
            vec![line("before", predictions.label_n[0]), line("after", predictions.label_n[1]), measured];
        Plot::new(part, "grip force per jaw, N", "maximum pull force, N", series)
    };
    parts.into_iter().map(plot).collect()
}

/// A few pulls with a trace, from the weakest to the strongest grip.
fn curves(measured: &MeasuredPulls, simulate: &SimulatePull<'_>, fits: &PullFits) -> Vec<Plot> {
    let mut traced: Vec<usize> =
        (0..measured.pulls.len()).filter(|&i| measured.pulls[i].trace.is_some()).collect();
    traced.sort_by(|&a, &b| measured.pulls[a].grip_force_n.total_cmp(&measured.pulls[b].grip_force_n));
    let curve = |&row: &usize| {
        let pull = &measured.pulls[row];
        // What follows the slip is a tool that runs to its stop.
        let kept = pull.trace.as_ref()?.until_displacement(measured.stop_m);
        let pulled: Vec<f64> = kept.time_s.iter().copied().filter(|t| *t >= 0.0).collect();
        let simulated = simulate(&fits.after.model, row, &pulled);
        let column = |of: &[f64]| kept.time_s.iter().copied().zip(of.iter().copied()).collect::<Vec<_>>();
        let series = vec![
            Series::line("measured", column(&kept.measured_force_n)),
            Series::line("twin", pulled.iter().copied().zip(simulated)),
            Series::line("command", column(&kept.desired_force_n)),
        ];
        let title = format!("{}: {}, {} N", pull.id, pull.part, pull.grip_force_n);
        Some(Plot::new(title, "time, s", "force, N", series))
    };
    spread(&traced, CURVES).filter_map(curve).collect()
}

fn evidence(fits: &PullFits, answer: &PullAnswer) -> Vec<EvidenceRow> {
    let name = |entry: &Entry| match entry.rival {
        ModelTerm::Effect(i) => fits.candidates.get(i).map_or("?", |c| c.spec.id).to_string(),
        ModelTerm::ByPart(i) => {
            format!("{}, by part", fits.candidates.get(i).map_or("?", |c| c.spec.id))
        }
        ModelTerm::Curve(i) => format!("curve in {}", fits.curve_names.get(i).map_or("?", String::as_str)),
    };
    let values = |entry: &Entry| {
        let Some(candidate) = entry.rival.effect().and_then(|i| fits.candidates.get(i)) else {
            return String::new();
        };
        let own = entry.fitted.model.effects.iter().filter(|e| e.spec == candidate.spec);
        let pairs = own.flat_map(|e| e.spec.parameters.iter().zip(&e.values));
        let free = pairs.filter(|(p, _)| !candidate.spec.references.contains(&p.name));
        free.map(|(p, v)| format!("{} {v:.4}", p.name)).collect::<Vec<_>>().join(", ")
    };
    let d = &answer.diagnosis;
    // A curve in a covariate of a named effect says the same with more parameters.
    let own = |name: &str| {
        let column = name.strip_prefix("curve in ");
        let specs = d.effects.iter().filter_map(|e| find(&e.name));
        column.is_some_and(|c| specs.into_iter().any(|spec| spec.covariates.contains(&c)))
    };
    let fate = |name: &str| {
        let tied =
            d.effects.iter().find(|e| e.indistinguishable_from.iter().any(|r| r.name == one_for_all(name)));
        let unknown = d.unknown.iter().any(|u| name.strip_prefix("curve in ") == Some(u.covariate.as_str()));
        match tied {
            _ if d.effects.iter().any(|e| e.name == one_for_all(name)) || unknown => "named".to_string(),
            Some(effect) => format!("not told apart from {}", effect.name),
            None if own(name) => "the same covariate without a name".into(),
            None => "worse".into(),
        }
    };
    let row = |(k, entry): (usize, &Entry)| {
        let score = fits.scores.get(k).copied().flatten();
        EvidenceRow {
            name: name(entry),
            heldout_gain: score.map_or(f64::NAN, |s| s.gain),
            standard_error: score.map_or(f64::NAN, |s| s.standard_error),
            heldout_error: score.map_or(f64::NAN, |s| s.rmse_n),
            values: values(entry),
            fate: fate(&name(entry)),
        }
    };
    // Best first, so of several curves in one column the best stays.
    let mut rows: Vec<EvidenceRow> = Vec::new();
    for entry in fits.accepted.entries.iter().enumerate().map(row) {
        if rows.len() < CANDIDATES
            && entry.heldout_gain.is_finite()
            && !rows.iter().any(|r| r.name == entry.name)
        {
            rows.push(entry);
        }
    }
    as_good(&mut rows);
    rows
}

/// What predicts held-out pulls at least as well as all that was named is not worse: it was not named for what it costs, or for
/// what the traces say.
fn as_good(rows: &mut [EvidenceRow]) {
    let named = rows.iter().filter(|row| row.fate == "named").map(|row| row.heldout_gain);
    let Some(best) = named.reduce(f64::max) else { return };
    for row in rows.iter_mut().filter(|row| row.fate == "worse" && row.heldout_gain >= best) {
        row.fate = "as good on held-out pulls".into();
    }
}

fn worst(measured: &MeasuredPulls, predictions: Predictions<'_>) -> Vec<WorstRow> {
    let deviations = predictions.deviations;
    let mut order: Vec<usize> = (0..measured.pulls.len().min(deviations.len())).collect();
    order.sort_by(|&a, &b| deviations[b].abs().total_cmp(&deviations[a].abs()));
    order
        .into_iter()
        .take(WORST)
        .map(|i| {
            let pull = &measured.pulls[i];
            WorstRow {
                id: pull.id.clone(),
                about: format!("{}, {} N, session {}", pull.part, pull.grip_force_n, pull.covariates.session),
                measured: pull.max_pull_force_n,
                predicted: predictions.label_n[1][i],
                deviations: deviations[i],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_labelled_with_its_unit() {
        let labels = ["grip_force_n", "speed_mm_per_s", "dwell_s", "operator"].map(axis_label);
        assert_eq!(labels, ["grip force, N", "speed, mm/s", "dwell, s", "operator"]);
    }

    #[test]
    fn what_predicts_as_well_as_the_named_effect_is_not_worse() {
        let row = |name: &str, heldout_gain: f64, fate: &str| EvidenceRow {
            name: name.into(),
            heldout_gain,
            standard_error: 5.0,
            heldout_error: 0.14,
            values: String::new(),
            fate: fate.into(),
        };
        let mut rows = [
            row("area_saturation", 10.4, "named"),
            row("load_power_law", 13.0, "worse"),
            row("wear", -1.0, "worse"),
        ];
        as_good(&mut rows);
        assert_eq!(rows.map(|row| row.fate), ["named", "as good on held-out pulls", "worse"]);
        let mut none = [row("wear", 3.0, "worse")];
        as_good(&mut none);
        assert_eq!(none[0].fate, "worse");
    }
}
