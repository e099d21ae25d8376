//! Readings without a load, screened against the columns of a campaign: a zero that goes with the grip force, say, is cross-talk
//! of the gripper into the sensor. Labels do not show it, because the friction of the parts takes it in.
//!
//! A zero wanders, and so do temperatures: two walks look alike without having to do with each other (Yule 1926). Differences from
//! one trace to the next are held against each other, which leaves walks nearly white, and are shuffled. Differences of a zero that does
//! not wander fall after they rose, as do those of a setting that is drawn anew each time, and look alike more often than shuffled ones: in a
//! simulation of 17 traces and eight columns 7 of 250 such campaigns got a name, where 1 % was meant. So a column has to pass a second time
//! with as much of the last value taken off as the zero itself keeps (prewhitening, Box and Jenkins 1976): none then, and 3 of 250 walks.

use super::context::Context;
use super::data::Column;
use crate::diagnosis::UnknownCovariate;
use crate::draws::Draws;
use gripgen_twin::predict::PullModel;

/// Fewest traces with a reading without a load.
const MIN_TRACES: usize = 10;

/// Orders that the differences are put in.
const SHUFFLES: usize = 4999;

/// Chance at which a column may be named where none acts, over all columns. With 0.01 it was 4 of 153 campaigns of nothing with a dozen traces each
/// (research/loop/worlds.md).
const CHANCE: f64 = 0.005;

/// Least share of the variance of the differences that a column explains.
const LEAST_SHARE: f64 = 0.2;

/// Columns of numbers that say when a pull was made, of which a drift is an effect, and the direction, in which a bias has another sign.
const NOT_LOOKED_AT: [&str; 3] = ["time_s", "pull_index", "pull_direction"];

/// Columns that the readings without a load go with, beyond what a model says of them.
pub(super) fn zeros_that_depend(context: &Context<'_>, model: &PullModel) -> Vec<UnknownCovariate> {
    let zeros = context.zeros(model);
    let seen: Vec<(usize, f64)> =
        (zeros.iter().enumerate()).filter_map(|(i, z)| Some((i, (*z)?.0))).collect();
    if seen.len() < MIN_TRACES {
        return Vec::new();
    }
    let zero_n: Vec<f64> = seen.iter().map(|(_, zero_n)| *zero_n).collect();
    let columns: Vec<(&String, Vec<f64>)> = context
        .data
        .columns
        .iter()
        .filter(|(name, _)| !NOT_LOOKED_AT.contains(&name.as_str()))
        .filter_map(|(name, column)| match column {
            Column::Number(x) => Some((name, seen.iter().map(|(row, _)| x[*row]).collect::<Vec<_>>())),
            Column::Word(..) => None,
        })
        .filter(|(_, x)| x.iter().any(|value| *value != x[0]))
        .collect();
    depends(&columns, &zero_n)
}

/// Columns that a zero goes with from trace to trace, the strongest first. Each has to explain what those before it leave: a column that
/// runs along with the one that acts says nothing of its own.
fn depends(columns: &[(&String, Vec<f64>)], zero_n: &[f64]) -> Vec<UnknownCovariate> {
    let level = CHANCE / columns.len().max(1) as f64;
    let mut found: Vec<UnknownCovariate> = Vec::new();
    let (mut columns, mut zero_n) = (columns.to_vec(), zero_n.to_vec());
    loop {
        let steps_n = steps(&zero_n, 1.0);
        let strength = |k: usize| share(&steps(&columns[k].1, 1.0), &steps_n);
        let best = (0..columns.len()).max_by(|&a, &b| strength(a).total_cmp(&strength(b)));
        let Some(best) = best.filter(|&k| strength(k) >= LEAST_SHARE) else { return found };
        let strength = strength(best);
        let (name, x) = columns.swap_remove(best);
        let p_value = [1.0, kept(&zero_n)]
            .map(|part| chance(&steps(&x, part), &steps(&zero_n, part)))
            .into_iter()
            .fold(0.0, f64::max);
        if p_value > level {
            return found;
        }
        found.push(UnknownCovariate { covariate: name.clone(), strength, p_value });
        zero_n = beside(&zero_n, &x);
        columns.iter_mut().for_each(|(_, own)| *own = beside(own, &x));
    }
}

/// How often a straight line in `x` explains as much of a shuffled `y`.
fn chance(x: &[f64], y: &[f64]) -> f64 {
    let strength = share(x, y);
    let (mut shuffled, mut draws, mut better) = (y.to_vec(), Draws::new(37, 8), 0);
    for _ in 0..SHUFFLES {
        draws.shuffle(&mut shuffled);
        better += usize::from(share(x, &shuffled) >= strength);
    }
    (better + 1) as f64 / (SHUFFLES + 1) as f64
}

/// What is new from one value to the next where `part` of the last one is kept: differences where all of it is, otherwise about their mean.
fn steps(x: &[f64], part: f64) -> Vec<f64> {
    let new: Vec<f64> = x.windows(2).map(|pair| pair[1] - part * pair[0]).collect();
    let mean = if part < 1.0 { new.iter().sum::<f64>() / new.len() as f64 } else { 0.0 };
    new.iter().map(|value| value - mean).collect()
}

/// The part of a value that the next one keeps, 0 to 1: the correlation of neighbours with its bias in short series taken off (Kendall 1954).
fn kept(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let about = |i: usize| x[i] - mean;
    let whole: f64 = (0..x.len()).map(|i| about(i) * about(i)).sum();
    let neighbours: f64 = (1..x.len()).map(|i| about(i) * about(i - 1)).sum();
    let seen = neighbours / whole.max(1e-300);
    (seen + (1.0 + 3.0 * seen) / n).clamp(0.0, 1.0)
}

/// What a straight line in `x` leaves of `y`, its slope that of the differences; nothing where it leaves no more than rounding.
fn beside(y: &[f64], x: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (dy, dx) = (steps(y, 1.0), steps(x, 1.0));
    let slope = dot(&dx, &dy) / dot(&dx, &dx).max(1e-300);
    let left: Vec<f64> = y.iter().zip(x).map(|(y, x)| y - slope * x).collect();
    let changes = steps(&left, 1.0);
    if dot(&changes, &changes) > 1e-9 * dot(&dy, &dy) { left } else { vec![0.0; y.len()] }
}

/// What to say of one.
pub(super) fn said(found: &UnknownCovariate) -> String {
    format!(
        "readings without a load go with {} (it explains {:.0} % of their changes from trace to trace): cross-talk into the force sensor? \
         Labels do not show it, the friction of the parts takes it in",
        found.covariate,
        100.0 * found.strength
    )
}

/// Share of the sum of squares that a straight line through nothing explains.
fn share(x: &[f64], y: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (xx, yy) = (dot(x, x), dot(y, y));
    if xx > 0.0 && yy > 0.0 { dot(x, y).powi(2) / (xx * yy) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The zero goes with the force; an offset that was chosen along with the force explains half of it, and nothing beside it. A second
    /// column that does act is found beside the first.
    #[test]
    fn a_column_that_runs_along_says_nothing_of_its_own() {
        let mut draws = Draws::new(4, 4);
        let mut column = |of: &dyn Fn(&mut Draws, usize) -> f64| (0..40).map(|i| of(&mut draws, i)).collect();
        let force: Vec<f64> = column(&|d, _| 10.0 * d.normal());
        let along: Vec<f64> = column(&|d, i| 0.1 * force[i] + d.normal());
        let other: Vec<f64> = column(&|d, _| d.normal());
        let zero: Vec<f64> = column(&|d, i| 0.02 * force[i] + 0.02 * d.normal());
        let names = ["grip_force_n", "grip_offset_mm", "other"].map(String::from);
        let columns: Vec<_> = names.iter().zip([&force, &along, &other].map(Vec::clone)).collect();
        let found = |zero: &[f64]| -> Vec<String> {
            depends(&columns, zero).into_iter().map(|u| u.covariate).collect()
        };
        assert!(share(&steps(&along, 1.0), &steps(&zero, 1.0)) > 0.3);
        assert_eq!(found(&zero), ["grip_force_n"]);
        let both: Vec<f64> = zero.iter().zip(&other).map(|(z, o)| z + 0.15 * o).collect();
        assert_eq!(found(&both), ["grip_force_n", "other"]);
    }

    /// Of zeros that have nothing to do with any column hardly one gets a name, whether they wander or not.
    #[test]
    fn zeros_that_go_with_nothing_get_no_name() {
        let mut draws = Draws::new(5, 5);
        let names: Vec<String> = (0..8).map(|k| format!("column {k}")).collect();
        for wanders in [false, true] {
            let mut named = 0;
            for _ in 0..300 {
                let mut series = |walk: bool| -> Vec<f64> {
                    let mut at = 0.0;
                    let next = |_| {
                        at = if walk { at } else { 0.0 } + draws.normal();
                        at
                    };
                    (0..17).map(next).collect()
                };
                let zero = series(wanders);
                let columns: Vec<_> =
                    names.iter().enumerate().map(|(k, name)| (name, series(k > 5))).collect();
                named += usize::from(!depends(&columns, &zero).is_empty());
            }
            // Of 300 at 1 % more than 8 in one of 200 cases; by differences alone it is 2 to 3 %.
            assert!(named <= 6, "{named} of 300, wandering {wanders}");
        }
    }
}
