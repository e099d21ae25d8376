//! What the report of `compare` shows of pulls: the panels of Wucherer et al. 2023, for any measurements and any twin.

use crate::compare::PullComparison;
use gripgen_identify::Level;
use gripgen_identify::{PartRatio, part_ratio};
use crate::report::{Mark, PageTable, Plot, PlotGroup, Series, comparison_page};
use gripgen_twin::MeasuredPulls;
use std::collections::BTreeMap;

/// Grip force of the profile that the paper shows.
const PROFILE_N: f64 = 40.0;
/// Points of a drawn law.
const LINE: usize = 48;
/// Two-sided 90 % of a normal distribution, in standard errors.
const Z90: f64 = 1.645;

/// Measured over predicted labels of each part.
pub fn pull_ratios(measured: &MeasuredPulls, found: &PullComparison) -> BTreeMap<String, PartRatio> {
    let mut parts: BTreeMap<&str, Vec<(f64, f64, f64)>> = BTreeMap::new();
    for (pull, &predicted_n) in measured.pulls.iter().zip(&found.label_n) {
        parts.entry(&pull.part).or_default().push((pull.grip_force_n, pull.max_pull_force_n, predicted_n));
    }
    parts.into_iter().map(|(name, pulls)| (name.into(), part_ratio(&pulls))).collect()
}

/// The page: mean and RMS over grip force, a pull profile, ratios with their fit, errors before and after it.
pub fn pull_comparison_page(title: &str, measured: &MeasuredPulls, found: &PullComparison) -> String {
    let ratios = pull_ratios(measured, found);
    let e = &found.pulls;
    let sentence = format!(
        "Predicted labels of {} pulls are {:.3} N (RMSE) or {:.1} % off the measured ones, {:.3} N too {} in the mean.",
        e.n,
        e.rmse_n,
        e.mape_pct,
        e.bias_n.abs(),
        if e.bias_n < 0.0 { "small" } else { "large" }
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
            plots: ratios.keys().filter_map(|name| profile(name, measured, found)).collect(),
        },
        PlotGroup {
            title: "Measured over predicted".into(),
            about: "Means of the ratio at each grip force with their RMS deviation, before and after division by the fit a + b / F_G \
                    to all pulls of the part; the band holds the fit with 90 %."
                .into(),
            plots: ratios.iter().map(|(name, ratio)| ratio_plot(name, ratio)).collect(),
        },
    ];
    let tables = [fits(&ratios), labels(&ratios)];
    let traces = format!("{}, {:.3} N between their readings", found.traces.0, found.traces.1);
    let facts = [
        ("pulls", e.n.to_string()),
        ("labels in the 90 % interval", format!("{:.0} %", 100.0 * found.coverage90)),
        ("traces compared", if found.traces.0 > 0 { traces } else { "none".into() }),
        ("outside a fitted range", found.outside_fit.to_string()),
        ("SHA-256 of the data", measured.sha256.chars().take(12).collect()),
    ];
    comparison_page(title, &sentence, &facts, &groups, &tables)
}

fn series(name: &str, mark: Mark, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.into(), mark, points, errors: Vec::new() }
}

fn plot(title: &str, x_label: &str, y_label: &str, series: Vec<Series>) -> Plot {
    let (title, x_label, y_label) = (title.into(), x_label.into(), y_label.into());
    Plot { title, x_label, y_label, x_words: Vec::new(), series }
}

fn means(name: &str, ratio: &PartRatio) -> Plot {
    let at = |of: &dyn Fn(usize, &Level) -> f64| -> Vec<(f64, f64)> {
        ratio.measured.iter().enumerate().map(|(i, level)| (level.grip_force_n, of(i, level))).collect()
    };
    let mut all = vec![
        Series {
            errors: ratio.measured.iter().map(|level| level.rms_n).collect(),
            ..series("measured", Mark::Points, at(&|_, level| level.mean_n))
        },
        series("predicted", Mark::Line, at(&|i, _| ratio.predicted_n[i])),
    ];
    if let Some(fit) = ratio.fit {
        let corrected = at(&|i, level| ratio.predicted_n[i] * fit.at(level.grip_force_n));
        all.push(series("predicted x (a + b / F_G)", Mark::Line, corrected));
    }
    plot(name, "grip force per jaw, N", "maximum pull force, N", all)
}

fn ratio_plot(name: &str, ratio: &PartRatio) -> Plot {
    let points = |of: &dyn Fn(f64) -> f64| {
        let at = |level: &Level| -> (f64, f64) {
            let each: Vec<f64> =
                level.rows.iter().map(|&i| ratio.points[i].1 / of(ratio.points[i].0)).collect();
            let n = each.len() as f64;
            let mean = each.iter().sum::<f64>() / n;
            (mean, libm::sqrt(each.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / n))
        };
        let values: Vec<_> = ratio.measured.iter().map(at).collect();
        let forces = ratio.measured.iter().map(|level| level.grip_force_n);
        (forces.zip(values.iter().map(|v| v.0)).collect(), values.iter().map(|v| v.1).collect::<Vec<_>>())
    };
    let with_errors = |name: &str, (points, errors)| Series { errors, ..series(name, Mark::Points, points) };
    let mut all = vec![with_errors("before", points(&|_| 1.0))];
    if let Some(fit) = ratio.fit {
        let ends = |end: Option<&Level>| end.map_or(1.0, |level| level.grip_force_n);
        let (low_n, high_n) = (ends(ratio.measured.first()), ends(ratio.measured.last()));
        let forces: Vec<f64> =
            (0..=LINE).map(|i| low_n + (high_n - low_n) * i as f64 / LINE as f64).collect();
        let line = |z: f64| forces.iter().map(move |&n| (n, fit.at(n) + z * fit.error_at(n)));
        all.push(series("a + b / F_G", Mark::Line, line(0.0).collect()));
        all.push(with_errors("after", points(&|n| fit.at(n))));
        all.push(series("90 % of the fit", Mark::Band, line(Z90).chain(line(-Z90).rev()).collect()));
    }
    plot(name, "grip force per jaw, N", "measured / predicted", all)
}

/// The traced pull of a part whose grip force is nearest to that of the paper's profile.
fn profile(name: &str, measured: &MeasuredPulls, found: &PullComparison) -> Option<Plot> {
    let away = |i: &usize| (measured.pulls[*i].grip_force_n - PROFILE_N).abs();
    let row = (0..measured.pulls.len())
        .filter(|&i| measured.pulls[i].part == name && measured.pulls[i].trace.is_some())
        .min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let pull = &measured.pulls[row];
    let kept = pull.trace.as_ref()?.until_displacement(measured.stop_m);
    let first = kept.time_s.iter().filter(|t| **t < 0.0).count();
    let pairs = |times_s: &[f64], forces_n: &[f64]| -> Vec<(f64, f64)> {
        times_s.iter().copied().zip(forces_n.iter().copied()).collect()
    };
    let all = vec![
        series("measured", Mark::Line, pairs(&kept.time_s, &kept.measured_force_n)),
        series("simulated", Mark::Line, pairs(&kept.time_s[first..], &found.trace_n[row])),
        series("command", Mark::Line, pairs(&kept.time_s, &kept.desired_force_n)),
    ];
    let title = format!("{name}, {} N: {}", pull.grip_force_n, pull.id);
    Some(plot(&title, "time, s", "pull force, N", all))
}

fn fits(ratios: &BTreeMap<String, PartRatio>) -> PageTable {
    let row = |(name, ratio): (&String, &PartRatio)| {
        let pct = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.2}"));
        let mut cells = vec![name.clone(), ratio.points.len().to_string(), ratio.measured.len().to_string()];
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
    PageTable {
        title: "The correction a + b / F_G".into(),
        about: "Fitted to measured over predicted labels, with standard errors that hold whatever the scatter of each grip force. \
                Errors are mean distances of the predicted means from the measured ones; left out: of a grip force that its fit has \
                not seen."
            .into(),
        head: head.map(String::from).to_vec(),
        rows: ratios.iter().map(row).collect(),
    }
}

fn labels(ratios: &BTreeMap<String, PartRatio>) -> PageTable {
    let rows = ratios.iter().flat_map(|(name, ratio)| {
        ratio.measured.iter().zip(&ratio.predicted_n).map(move |(level, predicted_n)| {
            let numbers = [level.mean_n, level.rms_n, level.low_n, level.high_n, *predicted_n];
            let force = format!("{:.4}", level.grip_force_n);
            let force = force.trim_end_matches('0').trim_end_matches('.').to_string();
            let cells = [name.clone(), force, level.rows.len().to_string()].into_iter();
            cells.chain(numbers.map(|x| format!("{x:.3}"))).collect()
        })
    });
    let head = ["part", "F_G, N", "pulls", "mean, N", "RMS, N", "low, N", "high, N", "predicted, N"];
    PageTable {
        title: "Labels".into(),
        about: "Measured maximum pull forces; RMS is the root mean square deviation from the mean.".into(),
        head: head.map(String::from).to_vec(),
        rows: rows.collect(),
    }
}
