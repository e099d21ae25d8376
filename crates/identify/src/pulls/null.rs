//! What the best of all rivals gains in campaigns like this one in which nothing acts: the residuals of the baseline in
//! another order, at the same pulls.
//!
//! How much a search finds by chance depends on the campaign: on how many rivals its columns allow, on how few pulls there
//! are, and on how bad the bad ones are. The shuffled residuals have all of that. A rival moves them along its slope at nothing
//! (Rao 1948), from each of its starts and, where its fit moves other parameters than its size too, from beside them; a curve that was chosen
//! for what it explains is chosen again. Baseline and rival are both fitted to the shuffled residuals, by weighted least squares with the weights
//! of Student's t, and judged by the likelihood by which fits are judged. Shuffled are the innovations of the fitted memory, so that neighbours
//! remember each other as they do in the data (Freedman and Lane 1983 for the residuals of a smaller model). Effects on readings compete with what they
//! do to labels and slips; what only traces show is left out.

use super::candidates::Candidate;
use super::chosen::chosen_from;
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
const JUDGED: usize = 6;

/// Rounds of weights.
const ROUNDS: usize = 2;

/// Deviations beyond which a residual is remembered no more, as in the likelihood.
const REMEMBERED: f64 = 3.0;

/// Share of the shuffled campaigns with the largest gains that tell how gains thin out beyond them.
const TAIL: f64 = 0.1;

/// Gains of the best effect and of the best curve in each of the shuffled campaigns, the largest first.
#[derive(Debug, Clone)]
pub struct NullGains {
    effects: Vec<f64>,
    curves: Vec<f64>,
}

impl NullGains {
    /// Share of campaigns in which nothing acts and a rival of this kind gains as much or more.
    pub fn p_value(&self, rival: &ModelTerm, gain: f64) -> f64 {
        share_above(if rival.effect().is_some() { &self.effects } else { &self.curves }, gain)
    }
}

/// Share of gains, largest first, as large or larger. In the tail they are taken to thin out exponentially, as ratios of likelihoods do (Knijnenburg,
/// Wessels, Reinders and Shmulevich 2009 fit the tail of permutations so).
fn share_above(gains: &[f64], gain: f64) -> f64 {
    let n = gains.len();
    let tail = (TAIL * n as f64) as usize;
    match gains.get(tail) {
        Some(&from) if gain > from => {
            let excess = gains[..tail].iter().map(|g| g - from).sum::<f64>() / tail.max(1) as f64;
            tail as f64 / n as f64 * libm::exp(-(gain - from) / excess.max(1e-9))
        }
        _ => (gains.iter().filter(|g| **g >= gain).count() + 1) as f64 / (n + 1) as f64,
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
        let known = orthonormal(test.slopes());
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
        let log = |left: &DVector<f64>| likelihood(left.as_slice(), &log_sd, sessions, tails).log;
        let with = |more: &DMatrix<f64>| {
            let all = known.iter().cloned().chain(more.column_iter().map(|c| c.into_owned()));
            DMatrix::from_columns(&all.collect::<Vec<_>>())
        };
        let nothing = with(&DMatrix::zeros(innovations.len(), 0));
        for _ in 0..CAMPAIGNS {
            draws.shuffle(&mut order);
            let shuffled: Vec<f64> = order.iter().map(|&i| innovations[i]).collect();
            let shuffled = DVector::from_vec(remembered(&shuffled, memory, sessions));
            let noise = without(&shuffled, &shuffled, &nothing, tails);
            let before = log(&noise);
            let clipped = noise.map(|x| x.clamp(-3.0, 3.0));
            for (named, best) in [(true, &mut effects), (false, &mut curves)] {
                let own = directions.iter().filter(|d| d.named == named);
                let mut promised: Vec<(f64, &Direction)> =
                    own.map(|d| (0.5 * d.vectors.tr_mul(&clipped).norm_squared() - d.cost, d)).collect();
                promised.sort_by(|a, b| b.0.total_cmp(&a.0));
                let judged = promised.iter().take(JUDGED).map(|(_, d)| {
                    log(&without(&shuffled, &noise, &with(&d.vectors), tails)) - before - d.cost
                });
                best.push(judged.fold(f64::NEG_INFINITY, f64::max));
            }
        }
        for gains in [&mut effects, &mut curves] {
            gains.sort_by(|a, b| b.total_cmp(a));
        }
        NullGains { effects, curves }
    }
}

/// The directions of all rivals that labels and slips can show.
fn directions(search: &Search<'_>, test: &ScoreTest<'_>) -> Vec<Direction> {
    let context = search.context;
    let each = 0.5 * libm::log(search.rows.len().max(2) as f64);
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
        for from in starts_and_beside(candidate) {
            add(true, candidate.cost(), vec![test.direction(candidate, &from)]);
            if search.may_differ(i) {
                let own = candidate.by_part(&context.data.parts);
                let cost = own.iter().map(Candidate::cost).sum();
                add(true, cost, own.iter().map(|c| test.direction(c, &from)).collect());
            }
        }
    }
    let by_share = test.by_share();
    for curve in search.curves.iter().flat_map(|c| chosen_from(c, context.data)) {
        let columns = if curve.additive {
            test.directions_of(&curve)
        } else {
            let of = |k: usize| by_share.map_with_location(|i, _, share| share * curve.basis[i][k]);
            (0..curve.len()).map(|k| test.free(&of(k))).collect()
        };
        add(false, curve.cost, columns);
    }
    found
}

/// The starts of an effect, and those with one of the parameters that are fitted beside its size moved by its scale.
fn starts_and_beside(candidate: &Candidate) -> Vec<Vec<f64>> {
    let mut all = candidate.starts.clone();
    for from in &candidate.starts {
        for (k, p) in candidate.parameters(from).iter().enumerate().skip(1) {
            for sign in [-1.0, 1.0] {
                let mut moved = from.clone();
                moved[candidate.free[k].0] = (p.start + sign * p.scale).clamp(p.bounds.0, p.bounds.1);
                all.push(moved);
            }
        }
    }
    all
}

/// What is left of residuals when everything that moves them along `vectors` is taken out, bad pulls weighed as in a fit. `like` are residuals which tell
/// those of the first round.
fn without(
    residuals: &DVector<f64>,
    like: &DVector<f64>,
    vectors: &DMatrix<f64>,
    tails: Tails,
) -> DVector<f64> {
    let mut left = like.clone();
    for _ in 0..ROUNDS {
        let s = tails.scale(left.as_slice());
        let mut weighted = vectors.clone();
        for (mut row, r) in weighted.row_iter_mut().zip(left.iter()) {
            row.scale_mut(tails.weight_of(r / s));
        }
        let informed = weighted.tr_mul(vectors);
        let Some(solved) = informed.cholesky().map(|c| c.solve(&weighted.tr_mul(residuals))) else {
            return left;
        };
        left = residuals - vectors * solved;
    }
    left
}

/// What is new in each residual, and a residual put together again; a far one is remembered as one of three deviations.
fn innovations(residuals: &[f64], memory: f64, sessions: &[usize]) -> Vec<f64> {
    (0..residuals.len())
        .map(|i| match i.checked_sub(1).filter(|&k| sessions[k] == sessions[i]) {
            Some(last) => residuals[i] - memory * residuals[last].clamp(-REMEMBERED, REMEMBERED),
            None => residuals[i] * (1.0 - memory * memory).sqrt(),
        })
        .collect()
}

fn remembered(innovations: &[f64], memory: f64, sessions: &[usize]) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::with_capacity(innovations.len());
    for (i, e) in innovations.iter().enumerate() {
        let next = match i.checked_sub(1).filter(|&k| sessions[k] == sessions[i]) {
            Some(last) => memory * found[last].clamp(-REMEMBERED, REMEMBERED) + e,
            None => e / (1.0 - memory * memory).sqrt(),
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

    /// A residual far off is remembered as one of three deviations: after one of a hundred, with a memory of 0.5, the next one is new by itself and 1.5.
    #[test]
    fn a_bad_pull_is_remembered_as_one_of_three_deviations() {
        let residuals = [0.2, 100.0, 1.7, -0.4];
        let found = innovations(&residuals, 0.5, &[0; 4]);
        assert!((found[2] - 0.2).abs() < 1e-12, "{found:?}");
        let back = remembered(&found, 0.5, &[0; 4]);
        assert!(back.iter().zip(&residuals).all(|(a, b)| (a - b).abs() < 1e-12), "{back:?}");
    }

    /// Gains that thin out exponentially, with a mean of 1.3: beyond all of them the share is that of the exponential, within them it is counted.
    #[test]
    fn the_tail_is_that_of_an_exponential() {
        let of = |share: f64| -1.3 * libm::log(share);
        let gains: Vec<f64> = (0..300).map(|i| of((f64::from(i) + 0.5) / 300.0)).collect();
        for share in [0.02, 0.005, 1e-3, 1e-4] {
            let found = share_above(&gains, of(share));
            assert!((found / share - 1.0).abs() < 0.25, "{share} {found}");
        }
        assert!((share_above(&gains, of(0.4)) - 121.0 / 301.0).abs() < 1e-12);
        assert_eq!(share_above(&gains, -1.0), 1.0);
        assert_eq!(share_above(&[], 3.0), 1.0);
    }

    /// A bad pull does not bend a line: what is left keeps it whole, and the slope of the others is gone.
    #[test]
    fn bad_pulls_hardly_weigh() {
        let n = 40;
        let line = DVector::from_iterator(n, (0..n).map(|i| i as f64 / 39.0 - 0.5));
        let mut draws = Draws::new(4, 4);
        let mut residuals = 6.0 * &line + DVector::from_iterator(n, (0..n).map(|_| 0.3 * draws.normal()));
        residuals[n - 1] -= 30.0;
        let left =
            without(&residuals, &residuals, &DMatrix::from_columns(&[&line / line.norm()]), Tails::FEW);
        assert!(left[n - 1] < -28.0, "{}", left[n - 1]);
        let slope = left.rows(0, n - 1).dot(&line.rows(0, n - 1)) / line.rows(0, n - 1).norm_squared();
        assert!(slope.abs() < 0.6, "{slope}");
    }
}
