//! What the report of `compare` shows of pulls: the panels of Wucherer et al. 2023, for any measurements and any twin.

use crate::page::{Page, PlotBudget, Table};
use crate::text::{NAME, clean};
use crate::{Mark, Plot, PlotGroup, Series};
use gripgen_identify::{Level, PartRatio, levels, pull_ratios};
use gripgen_twin::MeasuredPulls;
use std::collections::BTreeMap;

/// Grip force of the profile that the paper shows.
const PROFILE_N: f64 = 40.0;
/// Points of a drawn law.
const LINE: usize = 48;
/// Two-sided 90 % of a normal distribution, in standard errors.
const Z90: f64 = 1.645;

/// What a twin predicts for measured pulls, and how far it is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComparedPulls<'a> {
    /// The pulls.
    pub measured: &'a MeasuredPulls,
    /// Label predicted for each pull.
    pub label_n: &'a [f64],
    /// Readings predicted for the rows of each pull's trace from time 0 on, as far as the pull lasts; empty without a trace.
    pub trace_n: &'a [Vec<f64>],
    /// Root of the mean squared error of the labels.
    pub rmse_n: f64,
    /// Mean of the absolute error as a share of the label.
    pub mape_pct: f64,
    /// Mean of predicted less measured.
    pub bias_n: f64,
    /// Share of the labels inside their predictive 90 % interval.
    pub coverage90: f64,
    /// Pulls outside the grip forces on which an effect was fitted.
    pub outside_fit: usize,
    /// Traces, and the root of the mean squared difference of their readings.
    pub traces: (usize, f64),
}

/// The page: mean and RMS over grip force, a pull profile, ratios with their fit, errors before and after it.
pub fn pull_comparison_page(title: &str, found: &ComparedPulls<'_>) -> String {
    let ratios = pull_ratios(found.measured, found.label_n);
    let sentence = format!(
        "Predicted labels of {} pulls are {:.3} N (RMSE) or {:.1} % off the measured ones, {:.3} N too {} in the mean.",
        found.label_n.len(),
        found.rmse_n,
        found.mape_pct,
        found.bias_n.abs(),
        if found.bias_n < 0.0 { "small" } else { "large" }
    );
    let groups = [
        PlotGroup {
            title: "Maximum pull force over grip force".into(),
            about: "Means of the measured labels with their RMS deviation, and the means of what the twin predicts for the same \
                    pulls, as it is and times the fit below. Grip forces of a jaw; where they never repeat, in ranges."
                .into(),
            plots: ratios.iter().map(|(name, ratio)| means(name, ratio)).collect(),
        },
        PlotGroup {
            title: format!("The pull nearest to {PROFILE_N} N"),
            about: "Force over time of a measured pull beside the twin's, without the scatter of this pull, up to the \
                    displacement at which it was stopped."
                .into(),
            plots: ratios.keys().filter_map(|name| profile(name, found)).collect(),
        },
        PlotGroup {
            title: "Measured over predicted".into(),
            about: "Means of the ratio at each grip force with their RMS deviation, before and after division by the fit a + b / F_G \
                    to all pulls of the part; the band holds the fit with 90 %."
                .into(),
            plots: ratios.iter().map(|(name, ratio)| ratio_plot(name, ratio)).collect(),
        },
    ];
    let traces = format!("{}, {:.3} N between their readings", found.traces.0, found.traces.1);
    let mut page = Page::new(title);
    page.text(&sentence);
    page.facts(&[
        ("pulls", found.label_n.len().to_string()),
        ("labels in the 90 % interval", format!("{:.0} %", 100.0 * found.coverage90)),
        ("traces compared", if found.traces.0 > 0 { traces } else { "none".into() }),
        ("outside a fitted range", found.outside_fit.to_string()),
        ("SHA-256 of the data", found.measured.sha256.chars().take(12).collect()),
    ]);
    page.groups(&groups, &mut PlotBudget::of(&groups));
    page.section(
        "The correction a + b / F_G",
        "Fitted to measured over predicted labels, with standard errors that hold whatever the scatter of each grip force. \
         Errors are mean distances of the predicted means from the measured ones; left out: of a grip force that its fit has \
         not seen.",
    );
    page.table(&fits(&ratios));
    page.section(
        "Labels",
        "Measured maximum pull forces; RMS is the root mean square deviation from the mean.",
    );
    page.table(&labels(&ratios));
    page.html()
}

fn means(name: &str, ratio: &PartRatio) -> Plot {
    let at = |of: &dyn Fn(usize, &Level) -> f64| -> Vec<(f64, f64)> {
        ratio.measured.iter().enumerate().map(|(i, level)| (level.grip_force_n, of(i, level))).collect()
    };
    let errors = ratio.measured.iter().map(|level| level.rms_n).collect();
    let mut all = vec![
        Series { errors, ..Series::points("measured", at(&|_, level| level.mean_n)) },
        Series::line("predicted", at(&|i, _| ratio.predicted_n[i])),
    ];
    if let Some(fit) = ratio.fit {
        let corrected = at(&|i, level| ratio.predicted_n[i] * fit.at(level.grip_force_n));
        all.push(Series::line("predicted x (a + b / F_G)", corrected));
    }
    Plot::new(name, "grip force per jaw, N", "maximum pull force, N", all)
}

fn ratio_plot(name: &str, ratio: &PartRatio) -> Plot {
    let series = |name: &str, by: &dyn Fn(f64) -> f64| {
        let each: Vec<(f64, f64)> = ratio.points.iter().map(|(n, r)| (*n, r / by(*n))).collect();
        let levels = levels(&each);
        let errors = levels.iter().map(|level| level.rms_n).collect();
        Series { errors, ..Series::points(name, levels.iter().map(|l| (l.grip_force_n, l.mean_n))) }
    };
    let mut all = vec![series("before", &|_| 1.0)];
    if let Some(fit) = ratio.fit {
        let ends = |end: Option<&Level>| end.map_or(1.0, |level| level.grip_force_n);
        let (low_n, high_n) = (ends(ratio.measured.first()), ends(ratio.measured.last()));
        let forces: Vec<f64> =
            (0..=LINE).map(|i| low_n + (high_n - low_n) * i as f64 / LINE as f64).collect();
        let line = |z: f64| forces.iter().map(move |&n| (n, fit.at(n) + z * fit.error_at(n)));
        all.push(Series::line("a + b / F_G", line(0.0)));
        all.push(series("after", &|n| fit.at(n)));
        all.push(Series::new("90 % of the fit", Mark::Band, line(Z90).chain(line(-Z90).rev())));
    }
    Plot::new(name, "grip force per jaw, N", "measured / predicted", all)
}

/// The traced pull of a part whose grip force is nearest to that of the paper's profile.
fn profile(name: &str, found: &ComparedPulls<'_>) -> Option<Plot> {
    let pulls = &found.measured.pulls;
    let away = |i: &usize| (pulls[*i].grip_force_n - PROFILE_N).abs();
    let row = (0..pulls.len())
        .filter(|&i| pulls[i].part == name && pulls[i].trace.is_some())
        .min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let pull = &pulls[row];
    let kept = pull.trace.as_ref()?.until_displacement(found.measured.stop_m);
    let first = kept.time_s.iter().filter(|t| **t < 0.0).count();
    let line = |name: &str, times_s: &[f64], forces_n: &[f64]| {
        Series::line(name, times_s.iter().copied().zip(forces_n.iter().copied()))
    };
    let all = vec![
        line("measured", &kept.time_s, &kept.measured_force_n),
        line("simulated", &kept.time_s[first..], &found.trace_n[row]),
        line("command", &kept.time_s, &kept.desired_force_n),
    ];
    let title = format!("{name}, {} N: {}", pull.grip_force_n, pull.id);
    Some(Plot::new(title, "time, s", "pull force, N", all))
}

fn fits(ratios: &BTreeMap<String, PartRatio>) -> Table {
    let row = |(name, ratio): (&String, &PartRatio)| {
        let pct = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.2}"));
        let mut cells =
            vec![clean(name, NAME), ratio.points.len().to_string(), ratio.measured.len().to_string()];
        cells.extend(match ratio.fit {
            Some(fit) => {
                let [[aa, ab], [_, bb]] = fit.covariance;
                let error = |variance: f64| libm::sqrt(variance);
                vec![
                    format!("{:.3} \u{b1} {:.3}", fit.a, error(aa)),
                    format!("{:.2} \u{b1} {:.2}", fit.b_n, error(bb)),
                    format!("{ab:.2e}"),
                ]
            }
            None => vec!["-".to_string(); 3],
        });
        cells.extend([pct(Some(ratio.before_pct)), pct(ratio.after_pct), pct(ratio.left_out_pct)]);
        cells
    };
    let head =
        ["part", "pulls", "grip forces", "a", "b, N", "cov(a, b), N", "before, %", "after, %", "left out, %"];
    Table::new(&head, ratios.iter().map(row))
}

fn labels(ratios: &BTreeMap<String, PartRatio>) -> Table {
    let rows = ratios.iter().flat_map(|(name, ratio)| {
        ratio.measured.iter().zip(&ratio.predicted_n).map(move |(level, predicted_n)| {
            let numbers = [level.mean_n, level.rms_n, level.low_n, level.high_n, *predicted_n];
            let force = format!("{:.4}", level.grip_force_n);
            let force = force.trim_end_matches('0').trim_end_matches('.').to_string();
            let cells = [clean(name, NAME), force, level.rows.len().to_string()].into_iter();
            cells.chain(numbers.map(|x| format!("{x:.3}"))).collect()
        })
    });
    let head = ["part", "F_G, N", "pulls", "mean, N", "RMS, N", "low, N", "high, N", "predicted, N"];
    Table::new(&head, rows)
}
