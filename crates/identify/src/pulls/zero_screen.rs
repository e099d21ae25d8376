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
    let level = CHANCE / columns.len().max(1) as f64;
    let mut found: Vec<UnknownCovariate> = Vec::new();
    for (name, steps) in &columns {
        let strength = share(steps, &steps_n);
        if strength < LEAST_SHARE {
            continue;
        }
        let (mut shuffled, mut draws, mut better) = (steps_n.clone(), Draws::new(37, 8), 0);
        for _ in 0..SHUFFLES {
            draws.shuffle(&mut shuffled);
            better += usize::from(share(steps, &shuffled) >= strength);
        }
        let p_value = (better + 1) as f64 / (SHUFFLES + 1) as f64;
        if p_value <= level {
            found.push(UnknownCovariate { covariate: (*name).clone(), strength, p_value });
        }
    }
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found
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
