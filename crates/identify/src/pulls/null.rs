//! What the best of all rivals gains in campaigns like this one in which nothing acts: the residuals of the baseline in
//! another order, at the same pulls.
//!
//! How much a search finds by chance depends on the campaign: on how many rivals its columns allow, on how few pulls there
//! are, and on how bad the bad ones are. The shuffled residuals have all of that. A rival moves them along its slope at nothing,
//! from each of its starts (Rao 1948); its coefficients are those of weighted least squares with the weights of Student's t, and
//! its gain is that of the same likelihood by which fits are judged. Shuffled are the innovations of the fitted memory, so that neighbours
//! remember each other as they do in the data (Freedman and Lane 1983 for the residuals of a smaller model). What only traces
//! show is left out.

use super::fitting::Fitted;
use super::likelihood::{Tails, likelihood};
use super::power::ScoreTest;
use super::search::{ModelTerm, Search};
use super::simulate::orthonormal;
use super::terms::Terms;
use crate::draws::Draws;
use nalgebra::{DMatrix, DVector};

/// Shuffled campaigns.
const CAMPAIGNS: usize = 300;

/// Rivals of a shuffled campaign, the most promising ones, whose likelihood is worked out.
const JUDGED: usize = 4;

/// Rounds of weights.
const ROUNDS: usize = 2;

/// Gains of the best effect and of the best curve in each of the shuffled campaigns.
#[derive(Debug, Clone)]
pub struct NullGains {
    effects: Vec<f64>,
    curves: Vec<f64>,
}

impl NullGains {
    /// Share of campaigns in which nothing acts and a rival of this kind gains as much or more.
    pub fn p_value(&self, rival: &ModelTerm, gain: f64) -> f64 {
        let all = if rival.effect().is_some() { &self.effects } else { &self.curves };
        let above = all.iter().filter(|g| **g >= gain).count();
        (above + 1) as f64 / (all.len() + 1) as f64
    }
}

/// Ways in which a rival moves the residuals, orthonormal, and what its parameters cost.
struct Direction {
    named: bool,
    cost: f64,
    vectors: DMatrix<f64>,
}

impl Search<'_> {
    /// Shuffles the residuals of the baseline and lets all rivals compete for them.
    pub(super) fn null_gains(&self, baseline: &Fitted) -> NullGains {
        let test = ScoreTest::new(self.context, &baseline.model, &Terms::default(), &self.rows, false);
        let directions = directions(self, &test);
        let residuals = test.own(&test.residuals_of(&baseline.model));
        let sessions = &self.context.data.session_of;
        let memory = baseline.likelihood.memory;
        let innovations = innovations(residuals.as_slice(), memory, sessions);
        let (mut effects, mut curves) = (Vec::new(), Vec::new());
        let mut draws = Draws::new(29, 6);
        let mut order: Vec<usize> = (0..innovations.len()).collect();
        let log_sd = vec![0.0; innovations.len()];
        let tails = self.context.tails;
        for _ in 0..CAMPAIGNS {
            draws.shuffle(&mut order);
            let shuffled: Vec<f64> = order.iter().map(|&i| innovations[i]).collect();
            let noise = test.free(&DVector::from_vec(remembered(&shuffled, memory, sessions)));
            let before = likelihood(noise.as_slice(), &log_sd, sessions, tails).log;
            let clipped = noise.map(|x| x.clamp(-3.0, 3.0));
            for (named, best) in [(true, &mut effects), (false, &mut curves)] {
                let own = directions.iter().filter(|d| d.named == named);
                let mut promised: Vec<(f64, &Direction)> =
                    own.map(|d| (0.5 * d.vectors.tr_mul(&clipped).norm_squared() - d.cost, d)).collect();
                promised.sort_by(|a, b| b.0.total_cmp(&a.0));
                let judged = promised.iter().take(JUDGED).map(|(_, d)| {
                    let left = without(&noise, &d.vectors, tails);
                    likelihood(left.as_slice(), &log_sd, sessions, tails).log - before - d.cost
                });
                best.push(judged.fold(f64::NEG_INFINITY, f64::max));
            }
        }
        NullGains { effects, curves }
    }
}

/// The directions of all rivals that labels and slips can show.
fn directions(search: &Search<'_>, test: &ScoreTest<'_>) -> Vec<Direction> {
    let context = search.context;
    let each = 0.5 * libm::log(search.rows.len().max(2) as f64);
    let traces = !context.observations.is_empty();
    let mut found = Vec::new();
    let mut add = |named: bool, cost: usize, columns: Vec<DVector<f64>>| {
        let vectors = orthonormal(columns);
        if !vectors.is_empty() {
            found.push(Direction {
                named,
                cost: each * cost as f64,
                vectors: DMatrix::from_columns(&vectors),
            });
        }
    };
    for (i, candidate) in search.candidates.iter().enumerate() {
        if traces && candidate.acts_on_signals() {
            continue;
        }
        for from in &candidate.starts {
            add(true, candidate.cost(), vec![test.direction(candidate, from)]);
            if search.may_differ(i) {
                let own = candidate.by_part(&context.data.parts);
                let cost = own.iter().map(super::candidates::Candidate::cost).sum();
                add(true, cost, own.iter().map(|c| test.direction(c, from)).collect());
            }
        }
    }
    for curve in &search.curves {
        add(false, curve.cost, test.directions_of(curve));
    }
    found
}

/// What is left of residuals when a rival has taken its part, bad pulls weighed as in a fit.
fn without(residuals: &DVector<f64>, vectors: &DMatrix<f64>, tails: Tails) -> DVector<f64> {
    let mut left = residuals.clone();
    for _ in 0..ROUNDS {
        let s = tails.scale(left.as_slice());
        let weights = left.map(|r| tails.weight_of(r / s));
        let mut weighted = vectors.clone();
        for (mut row, w) in weighted.row_iter_mut().zip(weights.iter()) {
            row.scale_mut(*w);
        }
        let informed = weighted.tr_mul(vectors);
        let Some(solved) = informed.cholesky().map(|c| c.solve(&weighted.tr_mul(residuals))) else {
            return left;
        };
        left = residuals - vectors * solved;
    }
    left
}

fn innovations(residuals: &[f64], memory: f64, sessions: &[usize]) -> Vec<f64> {
    (0..residuals.len())
        .map(|i| match i.checked_sub(1).filter(|&k| sessions[k] == sessions[i]) {
            Some(last) => (residuals[i] - memory * residuals[last]) / (1.0 - memory * memory).sqrt(),
            None => residuals[i],
        })
        .collect()
}

fn remembered(innovations: &[f64], memory: f64, sessions: &[usize]) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::with_capacity(innovations.len());
    for (i, e) in innovations.iter().enumerate() {
        let next = match i.checked_sub(1).filter(|&k| sessions[k] == sessions[i]) {
            Some(last) => memory * found[last] + (1.0 - memory * memory).sqrt() * e,
            None => *e,
        };
        found.push(next);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Innovations put together again are the residuals, whatever the memory.
    #[test]
    fn innovations_are_the_residuals_taken_apart() {
        let residuals: Vec<f64> = (0..20).map(|i| libm::sin(1.7 * f64::from(i))).collect();
        let sessions: Vec<usize> = (0..20).map(|i| i / 7).collect();
        for memory in [0.0, 0.6, 0.9] {
            let back = remembered(&innovations(&residuals, memory, &sessions), memory, &sessions);
            let worst = back.iter().zip(&residuals).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{memory} {worst}");
        }
    }

    /// A bad pull does not bend a line: what is left keeps it whole, and the slope of the others is gone.
    #[test]
    fn bad_pulls_hardly_weigh() {
        let n = 40;
        let line = DVector::from_iterator(n, (0..n).map(|i| i as f64 / 39.0 - 0.5));
        let mut draws = Draws::new(4, 4);
        let mut residuals = 6.0 * &line + DVector::from_iterator(n, (0..n).map(|_| 0.3 * draws.normal()));
        residuals[n - 1] -= 30.0;
        let left = without(&residuals, &DMatrix::from_columns(&[&line / line.norm()]), Tails::FEW);
        assert!(left[n - 1] < -28.0, "{}", left[n - 1]);
        let slope = left.rows(0, n - 1).dot(&line.rows(0, n - 1)) / line.rows(0, n - 1).norm_squared();
        assert!(slope.abs() < 0.6, "{slope}");
    }
}
