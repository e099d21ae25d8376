//! The one plot that decides: how far measured labels are from what the twin predicted, level by level, and the law that was found.

use crate::{Plot, PlotGroup, Series};
use gripgen_identify::pulls::answer::{PullAnswer, PullFits};
use gripgen_twin::columns::{find, value};
use gripgen_twin::draw::Drawn;
use gripgen_twin::effects;
use gripgen_twin::{MeasuredPull, MeasuredPulls, rounded};
use std::collections::BTreeMap;

/// Different values that are levels; with more, pulls are put together into this many groups.
const LEVELS: usize = 12;
const GROUPS: usize = 10;
/// Half width of a 90 % interval in standard errors.
const NINETY: f64 = 1.645;
/// Levels are geometric from this ratio between the ends on, if their ratios differ less than their distances.
const WIDE: f64 = 8.0;
/// Letters of a level.
const LETTERS: usize = 18;

/// The plot over the first covariate that the answer speaks of, or over the grip force; nothing where nothing was found.
pub(super) fn decisive(
    measured: &MeasuredPulls,
    fits: &PullFits,
    answer: &PullAnswer,
    label: impl Fn(&str) -> String,
) -> Option<PlotGroup> {
    let d = &answer.diagnosis;
    let effect = d.effects.first();
    let of_effect = effect.and_then(|e| effects::find(&e.name)).map_or(&[][..], |spec| spec.covariates);
    let unknown = d.unknown.first().and_then(|u| u.covariate.split('*').next());
    let names: Vec<&str> = match (effect, unknown) {
        (Some(_), _) => of_effect.iter().copied().chain(["grip_force_n"]).collect(),
        (None, Some(name)) => vec![name],
        (None, None) => return None,
    };
    let part = effect.and_then(|e| e.part.as_deref());
    let mut curves = fits.after.terms.curves.iter().map(|(curve, _)| curve);
    let first = d.unknown.first().filter(|_| effect.is_none());
    let only = first.and_then(|u| curves.find(|c| c.name == u.covariate)?.only.as_ref());
    let only =
        only.map(|(column, word)| (column.as_str(), word.as_str())).or(part.map(|part| ("part", part)));
    let rows = rows_where(measured, only);
    let plot = names.iter().find_map(|name| over(measured, fits, &rows, name, &label))?;
    let whose = match only {
        Some(("part", part)) => format!(" of {part}"),
        Some((column, word)) => format!(" where {column} is {word}"),
        None => String::new(),
    };
    Some(PlotGroup {
        title: "What decides it".into(),
        about: format!(
            "By how much measured labels{whose} are above what the twin predicted before: means with their 90 % intervals, and the law that was found."
        ),
        plots: vec![plot],
    })
}

/// The pulls in which it was seen: those of one part, or those with one word in a column.
fn rows_where(measured: &MeasuredPulls, only: Option<(&str, &str)>) -> Vec<usize> {
    let is = |pull: &MeasuredPull, (column, word): (&str, &str)| match column {
        "part" => pull.part == word,
        _ => matches!(cell(column, pull), Some(Drawn::Text(own)) if own == word),
    };
    let rows = 0..measured.pulls.len();
    rows.filter(|&i| only.is_none_or(|only| is(&measured.pulls[i], only))).collect()
}

fn cell(name: &str, pull: &MeasuredPull) -> Option<Drawn> {
    let known = find(name).and_then(|column| column.value(pull.view()));
    known.or_else(|| value(name, pull.view()))
}

/// A level: where it stands, what it is called, its rows.
struct Level {
    at: f64,
    name: String,
    rows: Vec<usize>,
}

fn over(
    measured: &MeasuredPulls,
    fits: &PullFits,
    rows: &[usize],
    name: &str,
    label: &impl Fn(&str) -> String,
) -> Option<Plot> {
    let [before, after] = &fits.heldout_label_n;
    let usable = |i: usize| {
        let (before, after) = (*before.get(i)?, *after.get(i)?);
        (before.is_finite() && before > 0.0 && after.is_finite()).then_some((before, after))
    };
    let mut numbers: Vec<(f64, usize)> = Vec::new();
    let mut words: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for &i in rows.iter().filter(|&&i| usable(i).is_some()) {
        match cell(name, &measured.pulls[i]) {
            Some(Drawn::Number(x)) if x.is_finite() => numbers.push((x, i)),
            Some(Drawn::Text(word)) => words.entry(word).or_default().push(i),
            _ => {}
        }
    }
    let (levels, named) = if words.is_empty() {
        let levels = of_numbers(numbers);
        let geometric = is_geometric(&levels.iter().map(|level| level.at).collect::<Vec<_>>());
        (levels, geometric)
    } else {
        let level = |(name, rows): (String, Vec<usize>)| Level { at: 0.0, name, rows };
        (words.into_iter().map(level).collect(), true)
    };
    if levels.len() < 2 {
        return None;
    }
    // Levels that grow by a factor stand evenly: a logarithmic axis.
    let at = |k: usize| if named { k as f64 } else { levels[k].at };
    let (mut means, mut errors, mut law) = (Vec::new(), Vec::new(), Vec::new());
    for (k, level) in levels.iter().enumerate() {
        let shares: Vec<(f64, f64)> = level
            .rows
            .iter()
            .filter_map(|&i| {
                let (before, after) = usable(i)?;
                Some((measured.pulls[i].max_pull_force_n / before - 1.0, after / before - 1.0))
            })
            .map(|(measured, law)| (100.0 * measured, 100.0 * law))
            .collect();
        let n = shares.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| shares.iter().map(of).sum::<f64>() / n;
        let middle = mean(|s| s.0);
        let squares: f64 = shares.iter().map(|s| (s.0 - middle) * (s.0 - middle)).sum();
        means.push((at(k), middle));
        errors.push(if n > 1.0 { NINETY * (squares / (n - 1.0) / n).sqrt() } else { 0.0 });
        law.push((at(k), mean(|s| s.1)));
    }
    let zero = [(means[0].0, 0.0), (means[means.len() - 1].0, 0.0)];
    let series = vec![
        Series::line("before", zero),
        Series::line("after", law),
        Series { errors, ..Series::points("measured", means) },
    ];
    let x_words = if named { levels.into_iter().map(|level| level.name).collect() } else { vec![] };
    let plot =
        Plot::new(format!("over {}", label(name)), label(name), "above the prediction before, %", series);
    Some(Plot { x_words, ..plot })
}

fn of_numbers(mut numbers: Vec<(f64, usize)>) -> Vec<Level> {
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut levels: Vec<Level> = Vec::new();
    for (x, row) in &numbers {
        match levels.last_mut() {
            Some(level) if level.at == *x => level.rows.push(*row),
            _ => levels.push(Level { at: *x, name: named(*x), rows: vec![*row] }),
        }
    }
    if levels.len() <= LEVELS {
        return levels;
    }
    let groups = numbers.chunks(numbers.len().div_ceil(GROUPS));
    let group = |group: &[(f64, usize)]| {
        let at = group.iter().map(|(x, _)| x).sum::<f64>() / group.len() as f64;
        Level { at, name: named(at), rows: group.iter().map(|(_, row)| *row).collect() }
    };
    groups.map(group).collect()
}

fn named(x: f64) -> String {
    rounded(x, &[]).chars().take(LETTERS).collect()
}

/// Whether places are spread more evenly by their logarithms.
fn is_geometric(at: &[f64]) -> bool {
    let (Some(first), Some(last)) = (at.first(), at.last()) else { return false };
    if *first <= 0.0 || last / first < WIDE || at.len() < 3 {
        return false;
    }
    let uneven = |of: fn(f64) -> f64| {
        let steps: Vec<f64> = at.windows(2).map(|w| of(w[1]) - of(w[0])).collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        steps.iter().map(|s| (s / mean - 1.0) * (s / mean - 1.0)).sum::<f64>()
    };
    uneven(libm::log) < uneven(|x| x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_that_grow_by_a_factor_have_a_logarithmic_axis() {
        assert!(is_geometric(&[1.0, 3.0, 10.0, 30.0, 100.0]) && is_geometric(&[0.5, 2.0, 8.0, 60.0]));
        assert!(!is_geometric(&[5.0, 20.0, 40.0, 60.0, 80.0]) && !is_geometric(&[0.0, 1.0, 100.0]));
        assert!(!is_geometric(&[1.0, 100.0]) && !is_geometric(&[]));
    }

    #[test]
    fn few_values_are_levels_and_many_are_put_together() {
        let levels = of_numbers((0..30).map(|i| (f64::from(i % 3), i as usize)).collect());
        assert_eq!(
            levels.iter().map(|l| (l.at, l.rows.len())).collect::<Vec<_>>(),
            [(0.0, 10), (1.0, 10), (2.0, 10)]
        );
        let groups = of_numbers((0..95).map(|i| (f64::from(i), i as usize)).collect());
        assert_eq!(
            (groups.len(), groups[0].at, groups.iter().map(|g| g.rows.len()).sum::<usize>()),
            (10, 4.5, 95)
        );
    }

    #[test]
    fn what_was_seen_at_one_word_alone_is_drawn_there_alone() {
        let pull = |(i, (part, session)): (usize, (&str, &str))| MeasuredPull {
            id: format!("p{i}"),
            part: part.into(),
            grip_pose: 0,
            grip_force_n: 20.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.1,
            covariates: gripgen_twin::Covariates { session: session.into(), ..Default::default() },
            max_pull_force_n: 8.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        let pulls = [("lever", "a"), ("knob", "b"), ("lever", "b")];
        let measured = MeasuredPulls {
            pulls: pulls.into_iter().enumerate().map(pull).collect(),
            recorded: vec!["session".into()],
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 0.005,
            feedback: None,
            sha256: String::new(),
        };
        assert_eq!(rows_where(&measured, Some(("part", "lever"))), [0, 2]);
        assert_eq!(rows_where(&measured, Some(("session", "b"))), [1, 2]);
        assert_eq!(rows_where(&measured, None), [0, 1, 2]);
    }
}
