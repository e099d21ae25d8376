//! A model against a campaign: how far labels, slips and readings lie from what it predicts, and in which deviations.

use super::context::{Context, Observation};
use super::observe::LEVELS;
use super::slip::SlipLimit;
use super::trace_residuals::{OWN_N, SHARED_N, TraceResiduals};
use super::zero_screen::zeros_that_depend;
use super::zero_walk::{Pulls, SlowZero, Zero, ZeroWalk};
use super::zero_wander::ZeroReadings;
use gripgen_twin::predict::{PullModel, PullPrediction};
use std::borrow::Cow;

/// Force by which slips and labels of a rig differ from those of a pull without inertia: an offset as small as this says
/// nothing about friction.
const MISREAD_N: f64 = 0.05;

/// By how much more both differ where the loop closes on its sensor: it then answers with the arm's inertia, which the fast
/// prediction lacks.
const CLOSED_LOOP: f64 = 5.0;

impl Context<'_> {
    /// Pulls as their zero goes through them.
    fn in_order(&self) -> Pulls<'_> {
        let pulls = &self.data.measured.pulls;
        let turned = pulls.iter().map(|p| p.covariates.pull_direction < 0.0).collect();
        Pulls { session_of: &self.data.session_of, turned }
    }

    /// Readings without a load less what a model says of them, by pull.
    pub(super) fn zeros(&self, model: &PullModel) -> Vec<Zero> {
        let mut zeros = vec![None; self.data.len()];
        let seen: Vec<_> = self.observations.iter().filter_map(|o| Some((o.row, o.no_load_n?))).collect();
        let asked: Vec<(usize, &[f64])> = seen.iter().map(|(row, _)| (*row, [].as_slice())).collect();
        for ((row, (mean_n, n)), p) in seen.iter().zip(self.predictor.traces(model, &asked)) {
            zeros[*row] = Some((mean_n - p.no_load_n, model.noise_n / (*n as f64).sqrt()));
        }
        zeros
    }

    /// Looks for a walk of the zero under the baseline.
    pub(super) fn find_walk(&mut self) {
        let zeros = self.zeros(&self.base);
        let pulls = self.in_order();
        // A zero that goes with a column is no walk, be it that the column was set in order.
        let walk =
            ZeroWalk::likely(&zeros, &pulls).filter(|_| zeros_that_depend(self, &self.base).is_empty());
        self.walk = walk.map(|walk| (walk, walk.smoothed(&zeros, &pulls)));
    }

    /// Mean and slow part of the zero in each pull, beyond what a model says of it; nothing where none was seen.
    pub(super) fn slow_zeros(&self, model: &PullModel) -> Option<Cow<'_, [SlowZero]>> {
        let (walk, still) = self.walk.as_ref()?;
        if model.effects.iter().any(|e| e.acts_on_signals()) {
            return Some(walk.smoothed(&self.zeros(model), &self.in_order()).into());
        }
        Some(still.into())
    }

    /// Predictions of the pulls at `rows`, with the zero that their readings have as far as the traces show it; those with a slip in their trace have no label.
    pub(super) fn predicted(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let seen: Vec<usize> = rows.iter().copied().filter(|&i| self.limit_of(i).is_some()).collect();
        let unseen: Vec<usize> = rows.iter().copied().filter(|&i| self.limit_of(i).is_none()).collect();
        let mut slips = self.predictor.slips(model, &seen).into_iter();
        let mut labels = self.predictor.pulls(model, &unseen).into_iter();
        let next = |&i: &usize| if self.limit_of(i).is_some() { slips.next() } else { labels.next() };
        let mut all: Vec<PullPrediction> = rows.iter().map(next).map(Option::unwrap_or_default).collect();
        if let Some(zeros) = self.slow_zeros(model) {
            for (p, &i) in all.iter_mut().zip(rows) {
                p.limit_reading_n += zeros[i].mean_n;
                p.label_n += zeros[i].mean_n;
            }
        }
        all
    }

    /// Standard deviation of what is compared of each pull: its slip where there is a trace, its label otherwise.
    pub(super) fn deviations(&self, model: &PullModel, rows: &[usize]) -> Vec<f64> {
        rows.iter().zip(&self.predicted(model, rows)).map(|(&i, p)| self.deviation_n(i, p)).collect()
    }

    pub(super) fn deviation_n(&self, row: usize, p: &PullPrediction) -> f64 {
        // The zero is as sure as the traces around make it, whatever the model.
        let zero = self.walk.as_ref().map_or(0.0, |(_, zeros)| zeros[row].variance_n2) + 0.03 * 0.03;
        match self.limit_of(row) {
            Some(limit) => (p.label_sd_n * p.label_sd_n + limit.sd_n * limit.sd_n + zero).sqrt(),
            None => (p.label_sd_n * p.label_sd_n + zero).sqrt(),
        }
    }

    pub(super) fn limit_of(&self, row: usize) -> Option<SlipLimit> {
        self.observations[self.observed[row]?].limit_n
    }

    /// What was measured less what is predicted, in standard deviations, of the pulls at `rows`.
    pub(super) fn friction_residuals(&self, model: &PullModel, rows: &[usize], sd: &[f64]) -> Vec<f64> {
        let predicted = self.predicted(model, rows);
        rows.iter().zip(&predicted).zip(sd).map(|((&i, p), sd)| self.difference_n(model, i, p) / sd).collect()
    }

    pub(super) fn difference_n(&self, model: &PullModel, row: usize, p: &PullPrediction) -> f64 {
        match self.limit_of(row) {
            Some(limit) => {
                let read_at = self.kinetic.map_or(model.kinetic_ratio, |k| k.0);
                let limit_n = limit.value_n + limit.slope_n * (model.kinetic_ratio - read_at);
                limit_n - p.limit_reading_n - model.misread_n
            }
            None => {
                let predicted_n = p.label_n + self.above_fast_n[row] + model.misread_n;
                self.data.label_n[row] - predicted_n
            }
        }
    }

    /// What the readings of the traces at `rows` differ from a model by, in standard deviations: their mean over all
    /// traces by level of force, and each trace about that mean.
    pub(super) fn trace_residuals(&self, model: &PullModel, rows: &[usize]) -> TraceResiduals {
        let mut levels: Vec<Vec<(f64, f64, usize)>> = vec![vec![]; LEVELS];
        let mut no_load = Vec::new();
        let noise = model.noise_n;
        let seen: Vec<&Observation> =
            rows.iter().filter_map(|&i| self.observed[i]).map(|o| &self.observations[o]).collect();
        let asked: Vec<(usize, &[f64])> = seen.iter().map(|o| (o.row, o.times_s.as_slice())).collect();
        for (observation, predicted) in seen.iter().zip(self.predictor.traces(model, &asked)) {
            // The zero of a pull is in all of its readings: it is judged once, and the others are taken from it.
            let mut zero_n = 0.0;
            if let Some((mean, n)) = observation.no_load_n {
                zero_n = mean - predicted.no_load_n;
                no_load.push((zero_n, n, self.data.session_of[observation.row]));
            }
            let mut sums = [(0.0, 0.0, 0_usize); LEVELS];
            for (k, level) in observation.levels.iter().enumerate() {
                sums[*level].0 += observation.readings_n[k] - predicted.stuck_n[k] - zero_n;
                sums[*level].1 += observation.readings_n[k];
                sums[*level].2 += 1;
            }
            for (level, (difference, force, n)) in levels.iter_mut().zip(sums) {
                if n > 0 {
                    level.push((difference / n as f64, force / n as f64, n * observation.each));
                }
            }
        }
        let wide = if self.predictor.winds_up() { CLOSED_LOOP } else { 1.0 };
        let zeros = ZeroReadings::new(&no_load, noise);
        let mut r = TraceResiduals { shared: vec![], own: vec![], traces: seen.len(), zeros };
        for level in levels.iter().filter(|l| !l.is_empty()) {
            let count = level.len() as f64;
            let mean = level.iter().map(|x| x.0).sum::<f64>() / count;
            let force = level.iter().map(|x| x.1.abs()).sum::<f64>() / count;
            let readings: usize = level.iter().map(|x| x.2).sum();
            let shared = wide * (SHARED_N.0 + SHARED_N.1 * force);
            r.shared.push(mean / (shared * shared + noise * noise / readings as f64).sqrt());
            for (difference, force, n) in level {
                let own = wide * (OWN_N.0 + OWN_N.1 * force.abs());
                r.own.push((difference - mean) / (own * own + noise * noise / *n as f64).sqrt());
            }
        }
        r
    }

    /// Kinetic ratio that is taken for granted where no trace shows it, with its standard deviation.
    pub(super) fn assumed_ratio(&self) -> Option<(f64, f64)> {
        self.kinetic.is_none().then(|| (self.given.2.min(0.95), 0.05))
    }

    /// What is known beside the pulls, as residuals.
    pub(super) fn priors(&self, model: &PullModel, signals: bool) -> Vec<f64> {
        let mut r = vec![model.misread_n / MISREAD_N];
        if let Some(creep) = &self.creep {
            let rows: Vec<(usize, f64)> = creep.seen().map(|(row, c)| (row, c.to_n)).collect();
            let predicted = self.predictor.creeps_m_per_n_s(model, &rows);
            r.extend(creep.seen().zip(predicted).map(|((_, c), predicted)| (c.rate - predicted) / c.sd));
        }
        match self.kinetic {
            Some((ratio, error)) => r.push((model.kinetic_ratio - ratio) / error),
            None => r.extend(self.assumed_ratio().map(|(mean, sd)| (model.kinetic_ratio - mean) / sd)),
        }
        if self.free_lag || signals {
            let (wide_lag, wide_dead) = if self.observations.is_empty() { (0.04, 0.02) } else { (0.5, 0.5) };
            let (lag, dead) = if self.observations.is_empty() {
                (self.given.0, self.given.1)
            } else {
                (self.base.lag_s, self.base.dead_time_s)
            };
            r.push((model.lag_s - lag) / wide_lag);
            r.push((model.dead_time_s - dead) / wide_dead);
        }
        r
    }
}
