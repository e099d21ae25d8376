//! Whether measured pulls can be in the units that they are read in: numbers a thousand times too large are fitted as well as any.

use gripgen_twin::values::median;
use gripgen_twin::{MeasuredPull, POSSIBLE_LABEL_RATIO, median_label_ratio, rounded};
use std::path::Path;

/// Labels that no gel and no part give.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct ImplausibleLabels {
    /// What is wrong, with the numbers.
    pub problem: String,
    /// What may be behind it, and what is wanted.
    pub hint: String,
    /// Whether a diagnosis cannot answer either: it is their sign, or a staircase of many minutes.
    pub unanswerable: bool,
}

/// Labels over twice the grip force that gels and parts mostly have; 0.06 is an oily part.
const USUAL: (f64, f64) = (0.05, 1.0);
/// Beyond these something may be wrong.
const ODD: (f64, f64) = (0.04, 3.0);

/// Newtons of a kilogram-force and of a pound-force.
const KGF_N: f64 = 9.80665;
const LBF_N: f64 = 4.448_222;

/// Units that people write instead of newtons, with the factor on labels over grip forces.
const UNITS: [(&str, f64); 10] = [
    ("labels in millinewtons", 1e-3),
    ("labels in grams", 1e-3 * KGF_N),
    ("labels in kilograms-force (kgf)", KGF_N),
    ("labels in pounds-force (lbf)", LBF_N),
    ("grip forces in millinewtons", 1e3),
    ("grip forces in grams", 1e3 / KGF_N),
    ("grip forces in kilograms-force (kgf)", 1.0 / KGF_N),
    ("grip forces in pounds-force (lbf)", 1.0 / LBF_N),
    ("labels in kilonewtons", 1e3),
    ("grip forces in kilonewtons", 1e-3),
];

/// A sensor that is off reads a little less than nothing of a grip that hardly holds: by less than this, or less than this share of
/// twice the grip force.
const OFF_N: f64 = 1.0;
const OFF_SHARE: f64 = 0.05;

/// Longest pull that the mechanics predict (`gripgen_physics`): a label beyond it is never reached.
const LONGEST_S: f64 = 120.0;
/// Steps over labels that no staircase has: a label is read on a step that the jaws held, within the tolerance of a few newtons.
const HIGHEST_STEP: f64 = 10.0;

/// How much longer or shorter than its staircase a trace may be.
const LONGER: f64 = 100.0;
/// Times between readings.
const INTERVAL_S: (f64, f64) = (1e-5, 0.2);
/// Displacement of a tool that still holds what it pulls.
const FARTHEST_M: f64 = 0.2;
/// Force over displacement that no gel reaches: fits end at twice of it.
const STIFFEST_N_PER_M: f64 = 1e6;

/// Labels in other units than newtons, or with the sign of the direction.
pub(super) fn implausible(path: &Path, pulls: &[MeasuredPull]) -> Option<ImplausibleLabels> {
    let path = path.display();
    if let Some((n, first)) = wrong_sign(pulls) {
        let label_n = first.max_pull_force_n;
        return Some(ImplausibleLabels {
            problem: format!(
                "{path}: {n} of {} labels are below 0: pull {} has {label_n} N at a grip force of {} N",
                pulls.len(),
                first.id,
                first.grip_force_n
            ),
            hint: format!(
                "`max_pull_force_n` is a magnitude along the pull, whatever `pull_direction` says: write {}",
                -label_n
            ),
            unanswerable: true,
        });
    }
    let (low, high) = POSSIBLE_LABEL_RATIO;
    let Some(ratio) = above_zero(pulls).filter(|ratio| !(low..=high).contains(ratio)) else {
        return endless(pulls).map(|problem| ImplausibleLabels {
            problem: format!("{path}: {problem}"),
            hint: "`step_time_s` is in seconds, labels and `force_increment_n` are in newtons: write 0.104 for 104 ms"
                .into(),
            unanswerable: true,
        });
    };
    let first = pulls.iter().find(|p| p.max_pull_force_n > 0.0)?;
    Some(ImplausibleLabels {
        problem: format!(
            "{path}: the labels are {} times twice the grip force in the median, which no gel gives ({low} to {high}): pull {} has {} N at a \
             grip force of {} N",
            rounded(ratio, &[]),
            first.id,
            first.max_pull_force_n,
            first.grip_force_n
        ),
        hint: format!(
            "millinewtons? grams? forces are newtons, grip forces those of one jaw{}",
            units(ratio)
        ),
        unanswerable: false,
    })
}

/// Staircases that take longer than a pull is predicted.
fn endless(pulls: &[MeasuredPull]) -> Option<String> {
    let lasts_s = |p: &MeasuredPull| p.max_pull_force_n / p.increment_n * p.step_s;
    let median_s = median(pulls.iter().map(lasts_s).collect())?;
    let first = pulls.iter().find(|p| lasts_s(p) > LONGEST_S).filter(|_| median_s > LONGEST_S)?;
    Some(format!(
        "pulls take {} s by their staircase in the median, and are predicted for {LONGEST_S} s at most: pull {} reaches {} N in steps of {} N \
         of {} s each (of {} s, were they milliseconds)",
        rounded(median_s, &[]),
        first.id,
        first.max_pull_force_n,
        first.increment_n,
        first.step_s,
        rounded(1e-3 * first.step_s, &[])
    ))
}

/// Steps that are higher than what they lead to.
fn high_steps(pulls: &[MeasuredPull]) -> Option<String> {
    let steps = median(pulls.iter().map(|p| p.max_pull_force_n / p.increment_n).collect())?;
    let above_zero = pulls.iter().any(|p| p.max_pull_force_n > 0.0);
    let first = pulls.iter().find(|_| above_zero && steps < 1.0 / HIGHEST_STEP)?;
    Some(format!(
        "steps of the staircase are {} times as high as the labels in the median (pull {}: {} N and {} N): is `force_increment_n` in newtons?",
        rounded(1.0 / steps.max(1e-9), &[]),
        first.id,
        first.increment_n,
        first.max_pull_force_n
    ))
}

/// What is to be looked at again.
pub(super) fn warnings(path: &Path, pulls: &[MeasuredPull]) -> Vec<String> {
    let odd = above_zero(pulls).filter(|ratio| !(ODD.0..=ODD.1).contains(ratio));
    let of_labels = odd.map(|ratio| {
        format!(
            "the labels are {} times twice the grip force in the median, usual are {} to {}: are they newtons, and grip forces those of \
             one jaw?{}",
            rounded(ratio, &[]),
            USUAL.0,
            USUAL.1,
            units(ratio)
        )
    });
    let traces: Vec<Seen> = pulls.iter().filter_map(seen).collect();
    let found =
        of_labels.into_iter().chain(high_steps(pulls)).chain(times(&traces)).chain(displacements(&traces));
    found.map(|said| format!("{}: {said}", path.display())).collect()
}

/// How many labels are below 0, and one that no sensor explains.
fn wrong_sign(pulls: &[MeasuredPull]) -> Option<(usize, &MeasuredPull)> {
    let below: Vec<&MeasuredPull> = pulls.iter().filter(|p| p.max_pull_force_n < 0.0).collect();
    let beyond = |p: &&&MeasuredPull| {
        p.max_pull_force_n < -OFF_N && p.max_pull_force_n < -OFF_SHARE * 2.0 * p.grip_force_n
    };
    let most = 2 * below.len() > pulls.len();
    let first = below.iter().find(beyond).or_else(|| below.first().filter(|_| most))?;
    Some((below.len(), *first))
}

/// The median label over twice the grip force; labels of 0 say nothing of their unit.
fn above_zero(pulls: &[MeasuredPull]) -> Option<f64> {
    median_label_ratio(pulls).filter(|ratio| *ratio > 0.0)
}

/// Units with which a ratio would be usual.
fn units(ratio: f64) -> String {
    let usual = UNITS.iter().map(|(name, factor)| (name, ratio * factor));
    let usual = usual.filter(|(_, ratio)| (USUAL.0..=USUAL.1).contains(ratio));
    let said: Vec<String> =
        usual.map(|(name, ratio)| format!("{} with {name}", rounded(ratio, &[]))).collect();
    if said.is_empty() { String::new() } else { format!(" (it would be {})", said.join(", ")) }
}

/// What is looked at in a trace.
struct Seen {
    /// Its time over that of its staircase.
    over_staircase: f64,
    interval_s: f64,
    farthest_m: f64,
    largest_n: f64,
}

fn seen(pull: &MeasuredPull) -> Option<Seen> {
    let trace = pull.trace.as_ref()?;
    let begun = trace.time_s.partition_point(|&t| t < 0.0);
    let pulled = trace.time_s.get(begun..).filter(|times| times.len() > 1)?;
    let lasted_s = pulled[pulled.len() - 1] - pulled[0];
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let start_n = pull.start_n.unwrap_or(pull.increment_n);
    let steps = (largest(&trace.desired_force_n) - start_n).max(0.0) / pull.increment_n + 1.0;
    Some(Seen {
        over_staircase: lasted_s / (steps * pull.step_s),
        interval_s: lasted_s / (pulled.len() - 1) as f64,
        farthest_m: largest(&trace.displacement_m),
        largest_n: largest(&trace.measured_force_n),
    })
}

fn times(traces: &[Seen]) -> Option<String> {
    let over = median(traces.iter().map(|t| t.over_staircase).collect())?;
    let interval_s = median(traces.iter().map(|t| t.interval_s).collect())?;
    let long = over > LONGER || interval_s > INTERVAL_S.1;
    let short = over < 1.0 / LONGER || interval_s < INTERVAL_S.0;
    let unit = match (long, short) {
        (true, _) => "`time_s` in milliseconds",
        (_, true) => "`time_s` in minutes, or `step_time_s` in milliseconds",
        _ => return None,
    };
    Some(format!(
        "traces go on for {} times as long as their staircase takes ({} to {LONGER} are plausible), with a reading every {} s ({} to {}; medians \
         of {}): is {unit}?",
        rounded(over, &[]),
        1.0 / LONGER,
        rounded(interval_s, &[]),
        rounded(INTERVAL_S.0, &[]),
        INTERVAL_S.1,
        traces.len()
    ))
}

fn displacements(traces: &[Seen]) -> Option<String> {
    let farthest_m = median(traces.iter().map(|t| t.farthest_m).collect())?;
    let stiffness = median(traces.iter().map(|t| t.largest_n / t.farthest_m.max(1e-12)).collect())?;
    let n = traces.len();
    if farthest_m > FARTHEST_M {
        return Some(format!(
            "displacements of traces reach {} mm ({} mm are plausible; median of {n}): is `displacement_mm` in micrometres?",
            rounded(1e3 * farthest_m, &[]),
            1e3 * FARTHEST_M
        ));
    }
    (stiffness > STIFFEST_N_PER_M).then(|| {
        format!(
            "displacements of traces reach {} mm, {} N over each mm ({} are plausible; medians of {n}): is `displacement_mm` in metres?",
            rounded(1e3 * farthest_m, &[]),
            rounded(1e-3 * stiffness, &[]),
            1e-3 * STIFFEST_N_PER_M
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::traces::tests::pull;
    use gripgen_twin::{PullTrace, TraceRow};

    /// Pulls with a coefficient of 0.2 at 10, 20 and 40 N and a trace of 5 mm at 100 readings a second, in other units.
    fn pulls(label: f64, grip: f64, time: f64, displacement: f64) -> Vec<MeasuredPull> {
        let one = |i: usize| {
            let grip_force_n = [10.0, 20.0, 40.0][i % 3];
            let row = |k: usize| TraceRow {
                time_s: time * 0.01 * k as f64,
                desired_force_n: (1 + k / 10) as f64,
                measured_force_n: 0.1 * k as f64,
                displacement_m: displacement * 5e-5 * k as f64,
            };
            MeasuredPull {
                grip_force_n: grip * grip_force_n,
                max_pull_force_n: label * 0.4 * grip_force_n,
                trace: Some((0..=100).map(row).collect::<PullTrace>()),
                ..pull(i)
            }
        };
        (0..9).map(one).collect()
    }

    fn refused(pulls: &[MeasuredPull]) -> String {
        let said = implausible(Path::new("lab"), pulls).unwrap();
        format!("{said}; {}", said.hint)
    }

    #[test]
    fn plausible_pulls_are_taken_without_a_word() {
        let fine = pulls(1.0, 1.0, 1.0, 1.0);
        assert_eq!((implausible(Path::new("lab"), &fine), warnings(Path::new("lab"), &fine)), (None, vec![]));
        // Labels of 0, a sensor that is a little off, and nothing but labels of 0.
        let mut weak = fine;
        (weak[0].max_pull_force_n, weak[1].max_pull_force_n) = (0.0, -0.286);
        assert_eq!((implausible(Path::new("lab"), &weak), warnings(Path::new("lab"), &weak)), (None, vec![]));
        weak.iter_mut().for_each(|p| p.max_pull_force_n = 0.0);
        assert_eq!(implausible(Path::new("lab"), &weak), None);
    }

    #[test]
    fn labels_that_no_gel_gives_are_refused_with_both_numbers() {
        let milli = refused(&pulls(1e3, 1.0, 1.0, 1.0));
        assert!(
            milli.contains("200 times twice") && milli.contains("4000 N at a grip force of 10 N"),
            "{milli}"
        );
        assert!(milli.contains("millinewtons? grams?"), "{milli}");
        assert!(
            milli.contains("(it would be 0.2") && milli.contains("with labels in millinewtons"),
            "{milli}"
        );
        let grip = refused(&pulls(1.0, 1e3, 1.0, 1.0));
        assert!(grip.contains("0.0002") && grip.contains("with grip forces in millinewtons"), "{grip}");
        let all = refused(&pulls(-1.0, 1.0, 1.0, 1.0));
        assert!(all.contains("9 of 9 labels are below 0: pull 0 has -4 N"), "{all}");
        assert!(all.contains("a magnitude along the pull") && all.ends_with("write 4"), "{all}");
        let mut signed = pulls(1.0, 1.0, 1.0, 1.0);
        signed[4].max_pull_force_n *= -1.0;
        let signed = refused(&signed);
        assert!(signed.contains("1 of 9 labels are below 0: pull 4 has -8 N"), "{signed}");
    }

    /// Labels alone, in steps of other units.
    fn stairs(height: f64, length: f64) -> Vec<MeasuredPull> {
        let mut all = pulls(1.0, 1.0, 1.0, 1.0);
        for pull in &mut all {
            pull.trace = None;
            (pull.increment_n, pull.step_s) = (height * pull.increment_n, length * pull.step_s);
        }
        all
    }

    /// 8 N in steps of 1 N each 100 ms: of 100 s each they are 13 minutes, of 5 s a slow pull.
    #[test]
    fn a_staircase_of_many_minutes_is_refused_by_all() {
        let found = implausible(Path::new("lab"), &stairs(1.0, 1e3)).unwrap();
        assert!(found.unanswerable && found.problem.contains("pulls take 800 s"), "{found}");
        assert!(found.problem.contains("steps of 1 N of 100 s each (of 0.1 s, were they"), "{found}");
        assert_eq!(implausible(Path::new("lab"), &stairs(1.0, 50.0)), None);
    }

    #[test]
    fn odd_units_are_named() {
        for (given, says) in [
            (pulls(1.0 / KGF_N, 1.0, 1.0, 1.0), "with labels in kilograms-force (kgf)"),
            (pulls(18.0, 1.0, 1.0, 1.0), "3.6"),
            (pulls(1.0, 1.0, 1e3, 1.0), "with a reading every 10"),
            (pulls(1.0, 1.0, 1e3, 1.0), "is `time_s` in milliseconds?"),
            (pulls(1.0, 1.0, 1e-3, 1.0), "`step_time_s` in milliseconds?"),
            (pulls(1.0, 1.0, 1.0, 1e3), "reach 5000 mm (200 mm are plausible; median of 9)"),
            (pulls(1.0, 1.0, 1.0, 1e-3), "is `displacement_mm` in metres?"),
            (stairs(1e3, 1.0), "is `force_increment_n` in newtons?"),
        ] {
            assert_eq!(implausible(Path::new("lab"), &given), None);
            let said = warnings(Path::new("lab"), &given);
            assert!(
                said.len() == 1 && said[0].starts_with("lab: ") && said[0].contains(says),
                "{says}: {said:?}"
            );
        }
    }
}
