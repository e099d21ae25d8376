//! Readings without a load, screened against the columns of a campaign: a zero that goes with the grip force, say, is cross-talk
//! of the gripper into the sensor. Labels do not show it, because the friction of the parts takes it in.
//!
//! A zero wanders, and so do temperatures: two walks look alike without having to do with each other (Yule 1926). Differences from
//! one trace to the next are held against each other, which leaves walks nearly white, and are shuffled.

use super::context::Context;
use super::data::Column;
use super::model::PullModel;
use crate::diagnosis::UnknownCovariate;
use crate::draws::Draws;

/// Fewest traces with a reading without a load.
const MIN_TRACES: usize = 10;

/// Orders that the differences are put in.
const SHUFFLES: usize = 4999;

/// Chance at which a column may be named where none acts, over all columns.
const CHANCE: f64 = 0.01;

/// Least share of the variance of the differences that a column explains.
const LEAST_SHARE: f64 = 0.2;

/// Columns of numbers that say when a pull was made, of which a drift is an effect, and the direction, in which a bias has another sign.
const NOT_LOOKED_AT: [&str; 3] = ["time_s", "pull_index", "pull_direction"];

/// Columns that the readings without a load go with, beyond what a model says of them.
pub(super) fn zeros_that_depend(context: &Context<'_>, model: &PullModel) -> Vec<UnknownCovariate> {
    let seen: Vec<_> = context.observations.iter().filter_map(|o| Some((o.row, o.no_load_n?.0))).collect();
    if seen.len() < MIN_TRACES {
        return Vec::new();
    }
    let asked: Vec<(usize, &[f64])> = seen.iter().map(|(row, _)| (*row, [].as_slice())).collect();
    let predicted = context.predictor.traces(model, &asked);
    let zero_n: Vec<f64> = seen.iter().zip(&predicted).map(|((_, z), p)| z - p.no_load_n).collect();
    let difference = |x: &[f64]| x.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>();
    let steps_n = difference(&zero_n);
    let columns: Vec<(&String, Vec<f64>)> = context
        .data
        .columns
        .iter()
        .filter(|(name, _)| !NOT_LOOKED_AT.contains(&name.as_str()))
        .filter_map(|(name, column)| match column {
            Column::Number(x) => {
                Some((name, difference(&seen.iter().map(|(row, _)| x[*row]).collect::<Vec<_>>())))
            }
            Column::Word(..) => None,
        })
        .filter(|(_, steps)| steps.iter().any(|s| *s != 0.0))
        .collect();
    depends(&columns, &steps_n)
}

/// Columns that the steps of a zero go with, the strongest first. Each has to explain what those before it leave: a column that runs
/// along with the one that acts says nothing of its own.
fn depends(columns: &[(&String, Vec<f64>)], steps_n: &[f64]) -> Vec<UnknownCovariate> {
    let level = CHANCE / columns.len().max(1) as f64;
    let mut found: Vec<UnknownCovariate> = Vec::new();
    let (mut columns, mut left_n) = (columns.to_vec(), steps_n.to_vec());
    loop {
        let strength = |k: usize| share(&columns[k].1, &left_n);
        let best = (0..columns.len()).max_by(|&a, &b| strength(a).total_cmp(&strength(b)));
        let Some(best) = best.filter(|&k| strength(k) >= LEAST_SHARE) else { return found };
        let (name, steps) = columns.swap_remove(best);
        let strength = share(&steps, &left_n);
        let (mut shuffled, mut draws, mut better) = (left_n.clone(), Draws::new(37, 8), 0);
        for _ in 0..SHUFFLES {
            draws.shuffle(&mut shuffled);
            better += usize::from(share(&steps, &shuffled) >= strength);
        }
        let p_value = (better + 1) as f64 / (SHUFFLES + 1) as f64;
        if p_value > level {
            return found;
        }
        found.push(UnknownCovariate { covariate: name.clone(), strength, p_value });
        left_n = beside(&left_n, &steps);
        columns.iter_mut().for_each(|(_, own)| *own = beside(own, &steps));
    }
}

/// What a straight line in `x` leaves of `y`; nothing where it leaves no more than rounding.
fn beside(y: &[f64], x: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let slope = dot(x, y) / dot(x, x).max(1e-300);
    let left: Vec<f64> = y.iter().zip(x).map(|(y, x)| y - slope * x).collect();
    if dot(&left, &left) > 1e-9 * dot(y, y) { left } else { vec![0.0; y.len()] }
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
        assert!(share(&along, &zero) > 0.3, "{}", share(&along, &zero));
        assert_eq!(found(&zero), ["grip_force_n"]);
        let both: Vec<f64> = zero.iter().zip(&other).map(|(z, o)| z + 0.15 * o).collect();
        assert_eq!(found(&both), ["grip_force_n", "other"]);
    }
}
