//! Which effect is missing, if any.
//!
//! Two ways to weigh the rows, one for each kind of noise. Where white noise beside a first-order autoregression leaves
//! nothing but white noise, that model weighs the rows and candidates are compared by their likelihood. Where it does
//! not (residuals of most real sensors are smooth: the model itself is wrong in small ways), rows have equal weight and
//! only the held-out error of contiguous blocks counts. Either way the threshold comes from data that were simulated
//! without the effect, with noise as correlated as the measured one.

use super::candidates::{Candidate, Change};
use super::moments::{Model, Moments, Solution};
use super::noise::{Noise, Whitener, draw, fit_noise, left_correlation};
use super::prepare::Prepared;
use crate::draws::Draws;
use crate::statistics::{gamma_tail, mean_and_error};

/// How rows are weighed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weighing {
    /// By the noise model.
    Likelihood,
    /// Alike, and blocks decide.
    Blocks,
}

/// Everything a comparison needs. Columns: constant, reference, candidates, measured force.
pub(crate) struct Workspace<'a> {
    pub prepared: &'a Prepared,
    pub candidates: &'a [Candidate],
    pub columns: Vec<Vec<f64>>,
    pub noise: Noise,
    pub weighing: Weighing,
    /// Columns as they are fitted.
    pub weighed: Vec<Vec<f64>>,
    pub fit: Moments,
    pub raw: Moments,
}

/// One candidate against a model without it.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Point of its grid that fits best.
    pub point: usize,
    /// Gain in log-likelihood.
    pub gain: f64,
    /// Held-out gain of each block, in log-likelihood.
    pub held_out: Vec<f64>,
    /// What is compared with simulated data.
    pub statistic: f64,
    /// Chance of as much in data without it.
    pub p_value: f64,
    /// Gain less what chance gives: larger is better.
    pub evidence: f64,
}

/// All candidates against a model.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    /// In the order of the candidates; those that are in the model already have none.
    pub scores: Vec<Option<Score>>,
    /// How each candidate scores in data without any.
    tails: Vec<Tail>,
    /// For each simulated data set, the smallest p-value of all, and of effects alone.
    by_chance: Vec<(f64, f64)>,
}

impl Round {
    /// P-value of a statistic of one candidate by itself.
    pub fn p_of(&self, candidate: usize, statistic: f64) -> f64 {
        self.tails[candidate].p(statistic)
    }

    /// Chance that in data without any the best of all, or of effects alone, has a p-value as small as this.
    pub fn family_p(&self, p_value: f64, effects_alone: bool) -> f64 {
        let smallest = self.by_chance.iter().map(|b| if effects_alone { b.1 } else { b.0 });
        let as_small = smallest.filter(|p| *p <= p_value).count();
        (1 + as_small) as f64 / (1 + self.by_chance.len()) as f64
    }
}

/// Where only blocks decide: what takes away less of the held-out squared error is not worth a name.
const MIN_SHARE_OF_ERROR: f64 = 0.1;

impl<'a> Workspace<'a> {
    /// Finds noise and weighing. `columns` end with the measured force.
    pub fn new(prepared: &'a Prepared, candidates: &'a [Candidate], columns: Vec<Vec<f64>>) -> Self {
        let raw = Moments::new(&prepared.units, &columns);
        let mut this = Self {
            prepared,
            candidates,
            weighed: columns.clone(),
            columns,
            noise: Noise::WHITE,
            weighing: Weighing::Likelihood,
            fit: raw.clone(),
            raw,
        };
        // What effects do must not be taken for slow noise: the noise is what the smooth effects and the best of the
        // other candidates leave, all of them together.
        let mut rich = Model::baseline();
        for candidate in candidates.iter().filter(|c| c.is_effect()) {
            if let (_, Change::Add(columns, _)) = &candidate.points[candidate.points.len() / 2] {
                rich = rich.with(columns);
            }
        }
        this.weigh(this.noise_of(&rich));
        let mut model = Model::baseline();
        for turn in 0..3 {
            let base_left = this.fit.solve(&model, |_| true).left;
            let best = candidates
                .iter()
                .filter_map(|c| {
                    let (point, gain) = this.best_point(&model, base_left, c)?;
                    Some((gain - c.points[point].1.size() as f64, &c.points[point].1))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let least = if turn == 0 { 0.5 } else { 6.0 };
            match best {
                Some((gain, change)) if gain > least => {
                    model = change.on(&model);
                    rich = change.on(&rich);
                }
                _ => break,
            }
            this.weigh(this.noise_of(&rich));
        }
        let left = left_correlation(&this.residual(&rich, true));
        if left > (3.2 / libm::sqrt(this.rows())).max(0.08) {
            this.weighing = Weighing::Blocks;
            this.weighed.clone_from(&this.columns);
            this.fit = this.raw.clone();
            this.noise = this.shorter_than(3.0, this.noise_of(&Model::baseline()));
        }
        this
    }

    pub fn rows(&self) -> f64 {
        self.prepared.groups.len() as f64
    }

    fn response(&self) -> usize {
        self.columns.len() - 1
    }

    /// Weighs the rows for this noise.
    pub fn weigh(&mut self, noise: Noise) {
        let whitener = Whitener::new(noise, &self.prepared.group_steps);
        self.weighed.clone_from(&self.columns);
        for column in &mut self.weighed {
            whitener.apply(column);
        }
        self.fit = Moments::new(&self.prepared.units, &self.weighed);
        self.noise = noise;
    }

    /// The noise of largest likelihood beside a model.
    pub fn noise_of(&self, model: &Model) -> Noise {
        self.noise_and_cost(model).0
    }

    /// Gain in log-likelihood of a model over another one, the noise of largest likelihood beside each. Slow noise may
    /// explain what a slow effect does; this asks both.
    pub fn profile_gain(&self, base: &Model, with: &Model) -> f64 {
        self.noise_and_cost(base).1 - self.noise_and_cost(with).1
    }

    fn noise_and_cost(&self, model: &Model) -> (Noise, f64) {
        let mut parts: Vec<Vec<f64>> = vec![self.columns[0].clone()];
        let force = combined(&self.columns, &model.force);
        parts.push(force);
        parts.extend(model.added.iter().map(|c| combined(&self.columns, c)));
        parts.push(self.columns[self.response()].clone());
        let small = Model {
            force: vec![(1, 1.0)],
            added: (0..model.added.len()).map(|k| vec![(2 + k, 1.0)]).collect(),
        };
        let n = self.rows();
        let fitted = (2 * self.fit.sessions + small.added.len()) as f64;
        let cost = |noise: Noise, restricted: bool| {
            let whitener = Whitener::new(noise, &self.prepared.group_steps);
            let mut weighed = parts.clone();
            for column in &mut weighed {
                whitener.apply(column);
            }
            let solution = Moments::new(&self.prepared.units, &weighed).solve(&small, |_| true);
            // The restricted likelihood (Patterson and Thompson 1971) does not take what the fit explained by chance
            // for a lack of noise.
            let (rows, more) = if restricted { (n - fitted, solution.log_determinant) } else { (n, 0.0) };
            let size = (solution.left / rows).max(f64::MIN_POSITIVE);
            0.5 * (rows * libm::log(size) + whitener.log_determinant + more)
        };
        let noise = fit_noise(|noise| cost(self.shorter_than(1.0, noise), true)).0;
        let noise = self.shorter_than(1.0, noise);
        (noise, cost(noise, false))
    }

    /// What a fitted model leaves, row by row, of the weighed or of the plain columns.
    pub fn residual(&self, model: &Model, weighed: bool) -> Vec<f64> {
        let solution = self.fit.solve(model, |_| true);
        let columns = if weighed { &self.weighed } else { &self.columns };
        let predicted = self.predicted(model, &solution, columns);
        columns[self.response()].iter().zip(&predicted).map(|(y, p)| y - p).collect()
    }

    pub fn predicted(&self, model: &Model, solution: &Solution, columns: &[Vec<f64>]) -> Vec<f64> {
        let sessions = self.prepared.group_session();
        let force = combined(columns, &model.force);
        let added: Vec<Vec<f64>> = model.added.iter().map(|c| combined(columns, c)).collect();
        (0..force.len())
            .map(|i| {
                let [offset, gain] = solution.sessions[sessions[i]];
                let more: f64 = added.iter().zip(&solution.added).map(|(c, a)| c[i] * a).sum();
                offset * columns[0][i] + gain * force[i] + more
            })
            .collect()
    }

    /// The point of a candidate's grid that fits best, with its gain in log-likelihood; none where no point is
    /// physical.
    fn best_point(&self, base: &Model, base_left: f64, candidate: &Candidate) -> Option<(usize, f64)> {
        best_point(&self.fit, self.rows(), base, base_left, candidate)
    }

    /// Noise whose correlation time is at most this part of a block. What is slower is no noise to a comparison of
    /// blocks: it is the structure that is to be explained.
    fn shorter_than(&self, part: f64, noise: Noise) -> Noise {
        let blocks = self.prepared.names.len() * super::prepare::FOLDS;
        let longest = libm::exp(-part * blocks as f64 / self.rows());
        Noise { correlation: noise.correlation.min(longest), ..noise }
    }

    /// Scores of all candidates beside `base`; `skip` are in it already.
    pub fn round(&self, base: &Model, skip: &[usize], simulations: usize, seed: u64) -> Round {
        let mut scores = self.scores(&self.fit, base, skip);
        let mut simulated = self.fit.clone();
        let solution = self.fit.solve(base, |_| true);
        let expected = self.predicted(base, &solution, &self.weighed);
        let freedom = (self.rows() - 2.0 * self.fit.sessions as f64).max(1.0);
        let size = match self.weighing {
            Weighing::Likelihood => libm::sqrt(solution.left / freedom),
            // The slow part of the noise as the model without effect leaves it.
            Weighing::Blocks => {
                let whitener = Whitener::new(self.noise, &self.prepared.group_steps);
                let mut left = self.residual(base, false);
                whitener.apply(&mut left);
                libm::sqrt(left.iter().map(|r| r * r).sum::<f64>() / freedom)
            }
        };
        let mut draws = Draws::new(seed, 11 + skip.len() as u64);
        let mut null: Vec<Vec<(f64, bool)>> = vec![Vec::new(); scores.len()];
        for _ in 0..simulations {
            let noise = match self.weighing {
                Weighing::Likelihood => (0..expected.len()).map(|_| draws.normal()).collect(),
                Weighing::Blocks => draw(self.noise, &self.prepared.group_steps, &mut draws),
            };
            let response: Vec<f64> = expected.iter().zip(&noise).map(|(e, z)| e + size * z).collect();
            simulated.replace_response(&self.weighed, &response);
            for (all, score) in null.iter_mut().zip(self.scores(&simulated, base, skip)) {
                all.push(score.map_or((0.0, false), |s| (s.statistic, self.is_worth(&s))));
            }
        }
        let tails: Vec<Tail> = null.iter().map(|all| Tail::new(all)).collect();
        for (score, tail) in scores.iter_mut().zip(&tails) {
            if let Some(score) = score {
                score.p_value = tail.p(score.statistic);
                score.evidence = match self.weighing {
                    Weighing::Likelihood => score.gain - 2.0 * tail.mean,
                    Weighing::Blocks => score.held_out.iter().sum(),
                };
            }
        }
        let smallest = |r: usize, effects_alone: bool| {
            (0..tails.len())
                .filter(|&k| null[k][r].1 && (!effects_alone || self.candidates[k].is_effect()))
                .map(|k| tails[k].p(null[k][r].0))
                .fold(1.0, f64::min)
        };
        let by_chance = (0..simulations).map(|r| (smallest(r, false), smallest(r, true))).collect();
        Round { scores, tails, by_chance }
    }

    /// Whether a candidate takes away enough to be named.
    pub fn is_worth(&self, score: &Score) -> bool {
        self.weighing == Weighing::Likelihood
            || score.held_out.iter().sum::<f64>() >= MIN_SHARE_OF_ERROR * 0.5 * self.rows()
    }

    fn scores(&self, moments: &Moments, base: &Model, skip: &[usize]) -> Vec<Option<Score>> {
        let base_left = moments.solve(base, |_| true).left;
        let base_blocks = match self.weighing {
            Weighing::Likelihood => Vec::new(),
            Weighing::Blocks => self.blocks(&moments.held_out(base, moments)),
        };
        let scale = 0.5 * self.rows() / base_blocks.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        self.candidates
            .iter()
            .enumerate()
            .map(|(k, candidate)| {
                if skip.contains(&k) {
                    return None;
                }
                let (point, gain) = best_point(moments, self.rows(), base, base_left, candidate)?;
                if self.weighing == Weighing::Likelihood {
                    let none = Vec::new();
                    return Some(Score {
                        point,
                        gain,
                        held_out: none,
                        statistic: gain,
                        p_value: 1.0,
                        evidence: gain,
                    });
                }
                let model = candidate.points[point].1.on(base);
                let blocks = self.blocks(&moments.held_out(&model, moments));
                let held_out: Vec<f64> =
                    base_blocks.iter().zip(&blocks).map(|(before, after)| scale * (before - after)).collect();
                let (mean, error) = mean_and_error(&held_out);
                let statistic = if mean > 0.0 && error > 0.0 { (mean / error).min(50.0) } else { 0.0 };
                Some(Score { point, gain, held_out, statistic, p_value: 1.0, evidence: 0.0 })
            })
            .collect()
    }

    /// Sums over blocks: with weighed rows every unit is one, otherwise whole folds of a session are.
    pub fn blocks(&self, by_unit: &[f64]) -> Vec<f64> {
        if self.weighing == Weighing::Likelihood {
            return by_unit.to_vec();
        }
        let mut blocks: Vec<((usize, usize), f64)> = Vec::new();
        for (unit, value) in self.prepared.units.iter().zip(by_unit) {
            let key = (unit.session, unit.fold);
            match blocks.last_mut() {
                Some((last, sum)) if *last == key => *sum += value,
                _ => blocks.push((key, *value)),
            }
        }
        blocks.into_iter().map(|b| b.1).collect()
    }

    /// Held-out gain of `after` over `before`, block by block, in log-likelihood.
    pub fn held_out_gain(&self, before: &Model, after: &Model) -> Vec<f64> {
        let (b, a) = (self.fit.held_out(before, &self.fit), self.fit.held_out(after, &self.fit));
        let scale = 0.5 * self.rows() / a.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let (b, a) = (self.blocks(&b), self.blocks(&a));
        b.iter().zip(&a).map(|(x, y)| scale * (x - y)).collect()
    }
}

/// The distribution of a statistic in data without the effect.
#[derive(Debug, Clone)]
struct Tail {
    mean: f64,
    shape: f64,
    scale: f64,
}

impl Tail {
    fn new(simulated: &[(f64, bool)]) -> Self {
        let values: Vec<f64> = simulated.iter().map(|v| v.0).collect();
        let n = values.len().max(1) as f64;
        let mean = (values.iter().sum::<f64>() / n).max(1e-9);
        let variance = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).max(1e-12);
        Self { mean, shape: mean * mean / variance, scale: variance / mean }
    }

    fn p(&self, value: f64) -> f64 {
        gamma_tail(self.shape, value / self.scale)
    }
}

fn best_point(
    moments: &Moments,
    rows: f64,
    base: &Model,
    base_left: f64,
    candidate: &Candidate,
) -> Option<(usize, f64)> {
    let mut best = None;
    for (k, (_, change)) in candidate.points.iter().enumerate() {
        let solution = moments.solve(&change.on(base), |_| true);
        if let Change::Add(_, (low, high)) = change {
            let size = solution.added[base.added.len()];
            if !(*low..=*high).contains(&size) {
                continue;
            }
        }
        let gain = 0.5 * rows * libm::log(base_left.max(1e-300) / solution.left.max(1e-300));
        if !gain.is_finite() {
            continue;
        }
        let gain = gain.max(0.0);
        if best.is_none_or(|(_, g)| gain > g) {
            best = Some((k, gain));
        }
    }
    best
}

/// A sum of columns with factors.
pub(crate) fn combined(columns: &[Vec<f64>], combination: &[(usize, f64)]) -> Vec<f64> {
    (0..columns[0].len()).map(|i| combination.iter().map(|&(c, f)| f * columns[c][i]).sum()).collect()
}
