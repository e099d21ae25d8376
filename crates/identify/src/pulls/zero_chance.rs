//! How often a zero that wanders, and nothing else, looks like a bias or a drift.
//!
//! A dozen readings without a load say little of how a zero wanders, so that the gain of an effect on it has no known distribution. It is made: zeros
//! are drawn from what the readings say of a wandering zero around nothing (memory, scale, and whether sessions go on where the last one ended, by their likelihood), and an
//! offset and a line over the campaign compete for each (a parametric bootstrap of the likelihood ratio, Efron and Tibshirani 1993).

use super::fitting::Fitted;
use super::search::{Entry, Search};
use super::zero_wander::ZeroReadings;
use crate::draws::Draws;

/// Campaigns that are drawn.
const CAMPAIGNS: usize = 400;

/// Sizes that are tried, from minus to plus the farthest zero and half as much again.
const SIZES: i32 = 24;

/// Share of the gain of an effect from which on it is a matter of the zero. Labels are read by the sensor that wanders, so they say the same as
/// its zero and are no second witness.
const SHARE: f64 = 0.25;

impl Search<'_> {
    /// How often a zero that wanders gains what it gains by an effect, if the zero speaks for the effect; otherwise nothing.
    pub(super) fn zero_chance(&self, before: &Fitted, entry: &Entry) -> f64 {
        let acts = entry.rival.effect().is_some_and(|i| self.candidates[i].acts_on_signals());
        if self.context.observations.is_empty() || !acts {
            return 0.0;
        }
        let zeros = |of: &Fitted| self.context.trace_residuals(&of.model, &self.rows).zeros;
        let plain = zeros(before);
        let gain = plain.judged().1 - zeros(&entry.fitted).judged().1;
        let score = |f: &Fitted| f.likelihood.log - f.trace_cost;
        if gain < SHARE * (score(&entry.fitted) - score(before)) {
            return 0.0;
        }
        let pulls = &self.context.data.measured.pulls;
        let seen =
            self.rows.iter().filter_map(|&i| self.context.observed[i]).map(|o| &self.context.observations[o]);
        let time_s: Vec<f64> =
            seen.filter(|o| o.no_load_n.is_some()).map(|o| pulls[o.row].covariates.time_s).collect();
        let first_s = pulls.iter().map(|p| p.covariates.time_s).fold(f64::INFINITY, f64::min);
        let last_s = pulls.iter().map(|p| p.covariates.time_s).fold(f64::NEG_INFINITY, f64::max);
        let clock: Vec<f64> = time_s.iter().map(|t| (t - first_s) / (last_s - first_s).max(1e-9)).collect();
        chance_of_zero(&plain, &clock, gain, CAMPAIGNS)
    }
}

/// Share of the campaigns in which the zero wanders and nothing acts, and an offset or a line gains as much or more. `clock`: when each reading was made,
/// from 0 to 1.
fn chance_of_zero(zeros: &ZeroReadings, clock: &[f64], gain: f64, campaigns: usize) -> f64 {
    let mut draws = Draws::new(41, 3);
    let ways = zeros.ways();
    let better = (0..campaigns).filter(|_| best_gain(&zeros.drawn(&ways, &mut draws), clock) >= gain).count();
    (better + 1) as f64 / (campaigns + 1) as f64
}

/// What the better of an offset and a line gains.
fn best_gain(zeros: &ZeroReadings, clock: &[f64]) -> f64 {
    let plain = zeros.judged().1;
    let most_n = 1.5 * zeros.farthest_n();
    let with = |shape: &dyn Fn(f64) -> f64| {
        let sizes = (-SIZES..=SIZES).map(|k| most_n * f64::from(k) / f64::from(SIZES));
        sizes.map(|size| zeros.less(|i| size * shape(clock[i])).judged().1).fold(f64::INFINITY, f64::min)
    };
    plain - with(&|_| 1.0).min(with(&|at| at))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve zeros of 40 readings of 0.1 N in three sessions.
    fn of(zero_n: impl Fn(usize) -> f64) -> ZeroReadings {
        let list: Vec<(f64, usize, usize)> = (0..12).map(|i| (zero_n(i), 40, i / 4)).collect();
        ZeroReadings::new(&list, 0.1)
    }

    fn clock() -> Vec<f64> {
        (0..12).map(|i| f64::from(i) / 11.0).collect()
    }

    /// A zero that walks, as often as not in the sessions of one sign, is what the drawn ones do; half a newton that stays through all sessions
    /// is not.
    #[test]
    fn a_walk_is_no_bias_and_half_a_newton_is_one() {
        let mut draws = Draws::new(12, 1);
        let mut rare = 0;
        for _ in 0..40 {
            let mut at = 0.0;
            let walk: Vec<f64> = (0..12)
                .map(|i| {
                    let new = draws.normal();
                    at = if i % 4 == 0 { new } else { 0.8 * at + 0.6 * new };
                    0.15 * at
                })
                .collect();
            let walk = of(|i| walk[i]);
            rare += usize::from(chance_of_zero(&walk, &clock(), best_gain(&walk, &clock()), 60) < 0.05);
        }
        assert!(rare <= 6, "{rare} of 40 at 5 %");
        let bias = of(|i| 0.5 + 0.03 * draws_at(i));
        let found = chance_of_zero(&bias, &clock(), best_gain(&bias, &clock()), CAMPAIGNS);
        assert!(found < 0.006, "{found}");
    }

    fn draws_at(i: usize) -> f64 {
        Draws::new(i as u64 + 1, 7).normal()
    }
}
