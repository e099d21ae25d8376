//! Lag and dead time of the force loop from traces, with what they are known to.

use super::context::Context;
use super::observe::START_S;
use crate::bounded::interval90;
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::predict::PullModel;
use nalgebra::{DMatrix, DVector};

/// Share of the limit up to which the gels are taken for springs.
const STIFF: f64 = 0.4;

/// Standard deviation of the damping over the stiffness, as traces show both.
const RELAXATION: f64 = 0.05;

/// Fewest traces.
const MIN_TRACES: usize = 4;

/// Lag and dead time: value and 90 % interval.
pub(super) type Dynamics = [(f64, f64, f64); 2];

impl Context<'_> {
    /// Fits lag and dead time to all readings of tools that hold, with normal errors, and reads the slips again with them. The
    /// interval is that of traces which differ from each other (a sandwich by trace: Liang and Zeger 1986).
    pub(super) fn settle_dynamics(&mut self) -> Option<Dynamics> {
        let rows: Vec<(usize, Vec<f64>, Vec<f64>)> = self
            .observations
            .iter()
            .filter_map(|o| {
                let trace = self.data.measured.pulls[o.row].trace.as_ref()?;
                let most = o.limit_n.map_or(f64::INFINITY, |l| STIFF * l.value_n);
                let load = o.no_load_n.map_or(0.0, |b| b.0);
                let last_s = o.times_s.iter().zip(&o.readings_n).take_while(|(_, r)| **r < most).last()?.0;
                let held = trace.rows().filter(|r| r.time_s >= START_S && r.time_s <= *last_s);
                // Readings one by one: their means over a step of the staircase would hide how it is followed.
                let (times, readings) = held.map(|r| (r.time_s, r.measured_force_n - load)).unzip();
                Some((o.row, times, readings))
            })
            .filter(|(_, times, _): &(_, Vec<f64>, _)| times.len() >= 5)
            .collect();
        // How fast jaws slide says nothing about the damping of a loop that winds up, nor then readings about its lag.
        if rows.len() < MIN_TRACES || self.predictor.winds_up() {
            return None;
        }
        let asked: Vec<(usize, &[f64])> =
            rows.iter().map(|(row, times, _)| (*row, times.as_slice())).collect();
        let free = |name: &str, start: f64, bounds: (f64, f64), scale: f64| FreeParameter {
            name: name.into(),
            start,
            bounds,
            scale,
        };
        let parameters = [
            // A lag below the time of a reading hardly acts: slopes are taken over that time.
            free("lag_s", self.base.lag_s, (0.0, 1.0), 0.2),
            free("dead_time_s", self.base.dead_time_s, (0.0, 0.5), 0.4),
            free("relaxation", 1.0, (0.5, 2.0), 0.1),
        ];
        let model_of = |v: &[f64]| PullModel {
            lag_s: v[0],
            dead_time_s: v[1],
            stiffness_n_per_m: self.base.stiffness_n_per_m / v[2],
            ..self.base.clone()
        };
        let noise_n = self.base.noise_n;
        let residuals = |v: &[f64]| {
            let predicted = self.predictor.traces(&model_of(v), &asked);
            let mut r = vec![libm::log(v[2]) / RELAXATION];
            for ((_, _, readings), p) in rows.iter().zip(&predicted) {
                r.extend(readings.iter().zip(&p.stuck_n).map(|(a, b)| (a - b) / noise_n));
            }
            r
        };
        // A dead time acts by whole readings: each that may be has its lag.
        let mut best: Option<(f64, Vec<f64>)> = None;
        for step in -8..=8 {
            let dead_time_s = self.base.dead_time_s + 0.002 * f64::from(step);
            if dead_time_s < -1e-9 {
                continue;
            }
            let mut tried = parameters.clone();
            tried[1].start = dead_time_s.max(0.0);
            tried[1].bounds = (tried[1].start, tried[1].start);
            let options = FitOptions { max_steps: 6, min_gain: 1e-5 };
            if let Ok(found) = fit(&tried, options, residuals)
                && best.as_ref().is_none_or(|b| found.cost < b.0)
            {
                best = Some((found.cost, found.values));
            }
        }
        let (_, values) = best?;
        let settled: Vec<FreeParameter> =
            parameters.iter().zip(&values).map(|(p, v)| FreeParameter { start: *v, ..p.clone() }).collect();
        let found = fit(&settled, FitOptions { max_steps: 1, min_gain: 1.0 }, residuals).ok()?;
        let informed = found.jacobian.tr_mul(&found.jacobian);
        let inverse = informed.cholesky()?.inverse();
        let own = |from: usize, count: usize| -> DVector<f64> {
            let residuals = DVector::from_column_slice(&found.residuals[from..from + count]);
            found.jacobian.rows(from, count).tr_mul(&residuals)
        };
        // The prior first: it has the variance that it states.
        let first = found.jacobian.row(0);
        let mut scores: DMatrix<f64> = first.tr_mul(&first);
        let mut at = 1;
        let mut gradient = own(0, 1);
        for (_, times, _) in &rows {
            let score = own(at, times.len());
            scores += &score * score.transpose();
            gradient += score;
            at += times.len();
        }
        let count = rows.len() as f64;
        let covariance = &inverse * scores * &inverse * (count / (count - 2.0));
        let beyond = DVector::from_column_slice(&found.values) - inverse * gradient;
        let estimate = |i: usize| {
            let sd = covariance[(i, i)].max(0.0).sqrt().max(1e-5);
            let (low, high) = interval90(beyond[i], sd, parameters[i].bounds, count - 2.0);
            (found.values[i], low, high)
        };
        let answer = [estimate(0), estimate(1)];
        (self.base.lag_s, self.base.dead_time_s) = (found.values[0], found.values[1]);
        self.read_slips();
        Some(answer)
    }
}
