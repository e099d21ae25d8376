//! A campaign with what its traces say.

use super::creep::{Creep, without_slips_that_rise};
use super::data::PullData;
use super::likelihood::Tails;
use super::observe::{LEVELS, TraceObservation, fall_s, noise_n, observe};
use super::slip::{SlipLimit, SlipRig, SlipTrace, Slips, read_slips};
use super::terms::Terms;
use super::trace_residuals::{SHARED_N, Widening};
use super::zero_walk::{SlowZero, ZeroWalk};
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::predict::{PredictPulls, PullModel};

/// Scatter of friction from grip to grip with which residuals are weighed; their true scale is fitted.
const SCATTER: f64 = 0.04;

/// Time before the slip whose readings do not set the scale of the tool that holds: the rim may slip.
const UNSCALED_S: f64 = 0.15;

/// Readings of a trace that are looked at before the slip.
const READINGS: usize = 36;

/// Levels of force that readings are averaged in.
const EDGES_N: [f64; LEVELS] = [3.0, 6.0, 10.0, 16.0, 26.0, f64::INFINITY];

/// What a trace says, ready to be compared.
#[derive(Debug, Clone)]
pub struct Observation {
    /// Which pull.
    pub row: usize,
    /// Mean reading without load and the number of readings.
    pub no_load_n: Option<(f64, usize)>,
    /// Times while the jaws held.
    pub times_s: Vec<f64>,
    /// Readings at these times, means over a few neighbours.
    pub readings_n: Vec<f64>,
    /// Readings in each mean.
    pub each: usize,
    /// Level of force of each.
    pub levels: Vec<usize>,
    /// Where the force stops to follow, roughly.
    pub slip_s: Option<f64>,
    /// Reading at which the jaws slipped, given the kinetic ratio of the context.
    pub limit_n: Option<SlipLimit>,
    /// Mean reading while the jaws slid and the number of readings.
    pub slid_n: Option<(f64, usize)>,
}

/// A campaign, ready to be fitted.
#[derive(Clone)]
pub struct Context<'a> {
    /// The pulls.
    pub data: &'a PullData<'a>,
    /// What predicts them.
    pub predictor: &'a dyn PredictPulls,
    /// What the traces say.
    pub observations: Vec<Observation>,
    /// Observation of each pull.
    pub observed: Vec<Option<usize>>,
    /// Ratio of sliding to slipping forces over all traces, and its standard error.
    pub kinetic: Option<(f64, f64)>,
    /// What the slips of all traces say, be there as few as one.
    pub slips: Option<Slips>,
    /// The baseline as the traces see it.
    pub base: PullModel,
    /// Lag and dead time of the twin that was given, for campaigns without traces.
    pub given: (f64, f64, f64),
    /// Damping of that twin.
    pub given_damping_n_s_per_m: f64,
    /// How heavy the tails of its residuals are.
    pub tails: Tails,
    /// Whether the noise of a reading is that of the twin, whatever labels alone would say.
    pub knows_noise: bool,
    /// 90 % interval of the noise of a reading, where labels alone say it.
    pub noise90_n: Option<(f64, f64)>,
    /// Whether lag and dead time are fitted with friction alone, which is slow.
    pub free_lag: bool,
    /// Half the sum of squares of the traces under the baseline.
    pub baseline_trace_cost: f64,
    /// What the labels of the simulator lie above those of the fast prediction, near the model that is fitted.
    pub above_fast_n: Vec<f64>,
    /// How tools creep while the jaws hold, where the displacements of traces show that they do.
    pub(super) creep: Option<Creep>,
    /// Lag and dead time of models that creep, in which the damping takes its share of what the others have for lag.
    pub(super) creeping: Option<(f64, f64)>,
    /// How the zero of the sensor wanders, where the traces show that it does, and what that makes it in each pull where nothing acts on readings.
    pub(super) walk: Option<(ZeroWalk, Vec<SlowZero>)>,
}

impl<'a> Context<'a> {
    /// Looks at the traces and fits what they say alone: noise, lag, dead time, stiffness, damping, kinetic ratio.
    pub fn new(data: &'a PullData<'a>, predictor: &'a dyn PredictPulls, given: &PullModel) -> Self {
        let mut base = given.clone();
        base.effects.clear();
        base.factor.clear();
        base.scatter = SCATTER;
        let pulls = &data.measured.pulls;
        if let Some(noise) = noise_n(pulls) {
            base.noise_n = noise.max(0.01);
        }
        let creep = Creep::of(pulls);
        let raw: Vec<TraceObservation> = pulls
            .iter()
            .enumerate()
            .filter_map(|(i, p)| {
                let trace = p.trace.as_ref()?;
                Some(match &creep {
                    Some(creep) => {
                        without_slips_that_rise(observe(i, &creep.taken_off(i, p, trace), base.noise_n))
                    }
                    None => observe(i, trace, base.noise_n),
                })
            })
            .collect();
        let mut context = Self {
            data,
            predictor,
            observations: vec![],
            observed: vec![None; data.len()],
            kinetic: None,
            slips: None,
            given: (given.lag_s, given.dead_time_s, given.kinetic_ratio),
            given_damping_n_s_per_m: given.damping_n_s_per_m,
            tails: Tails::FEW,
            knows_noise: false,
            noise90_n: None,
            base,
            free_lag: false,
            baseline_trace_cost: 0.0,
            above_fast_n: vec![0.0; data.len()],
            creep,
            creeping: None,
            walk: None,
        };
        context.look_at(&raw);
        context
    }

    /// Speed per newton at which tools creep, in the middle of the campaign, where displacements show that they do.
    pub(super) fn creep_m_per_n_s(&self) -> Option<f64> {
        self.creep.as_ref().map(Creep::median_m_per_n_s)
    }

    /// Looks how many pulls are bad: what of them the baseline leaves.
    pub(super) fn see_tails(&mut self, rows: &[usize]) {
        if let Some(plain) = self.fit(&self.base, &Terms::default(), rows) {
            self.tails = Tails::of(&plain.residuals);
        }
    }

    /// Without traces the labels are all that knows of force loop and sensor: lag, dead time, damping and noise from them, once. Where they
    /// have said it already, that stands.
    pub(super) fn learn_lag(&mut self, rows: &[usize]) {
        if !self.observations.is_empty() || self.noise90_n.is_some() {
            return;
        }
        self.free_lag = true;
        if let Some((model, interval)) = self.noise_of_labels(rows) {
            (self.base, self.noise90_n) = (model, Some(interval));
        }
        self.free_lag = false;
    }

    /// Lag and dead time that labels, slips and readings say together, before effects compete: those on signals are fitted
    /// with both free, and would win by them alone.
    pub(super) fn share_lag(&mut self, rows: &[usize]) {
        if self.observations.is_empty() {
            return self.learn_lag(rows);
        }
        self.free_lag = true;
        let found = self.fit(&self.base, &Terms::default(), rows);
        self.free_lag = false;
        let Some(found) = found else { return };
        (self.base.lag_s, self.base.dead_time_s) = (found.model.lag_s, found.model.dead_time_s);
        self.read_slips();
        self.baseline_trace_cost = self.trace_residuals(&self.base, rows).cost();
    }

    fn look_at(&mut self, raw: &[TraceObservation]) {
        if raw.is_empty() {
            return;
        }
        if let Some(stiffness) = stiffness(raw) {
            self.base.stiffness_n_per_m = stiffness;
        }
        for _ in 0..2 {
            self.fit_dynamics(raw);
            if let Some(fall_s) = fall_s(raw, self.base.noise_n) {
                self.base.fall_s = fall_s;
            }
            self.read_slides(raw);
        }
        for trace in raw {
            let observation = self.observation(trace);
            self.observed[trace.row] = Some(self.observations.len());
            self.observations.push(observation);
        }
        let rows: Vec<usize> = (0..self.data.len()).collect();
        (self.base.lag_s, self.base.dead_time_s) = self.lag_by_readings(&self.base, &rows);
        if let Some(creep) = &self.creep {
            let effects = creep.effects(&self.data.parts);
            self.creeping = Some(self.lag_by_readings(&PullModel { effects, ..self.base.clone() }, &rows));
        }
        self.read_slips();
        if self.creep.is_none() {
            self.read_bend();
        }
        self.find_walk();
        self.baseline_trace_cost = self.trace_residuals(&self.base, &rows).cost();
    }

    /// Lag and dead time of `base` against what effects on the readings will be judged by.
    fn lag_by_readings(&self, base: &PullModel, rows: &[usize]) -> (f64, f64) {
        let mut best = (f64::INFINITY, base.lag_s, base.dead_time_s);
        for step in 0..16 {
            // Every dead time has its lag; the best of both is where effects start from.
            let dead_time_s = 0.004 * f64::from(step);
            let lag = [dynamics(base)[0].clone()];
            let found = fit(&lag, FitOptions { max_steps: 10, min_gain: 1e-5 }, |v| {
                let model = PullModel { lag_s: v[0], dead_time_s, ..base.clone() };
                let mut r = self.trace_residuals(&model, rows).widened(Widening::NONE);
                // Huber's cost as a sum of squares.
                r.iter_mut()
                    .filter(|x| x.abs() > 2.5)
                    .for_each(|x| *x = x.signum() * (5.0 * x.abs() - 6.25).sqrt());
                r
            });
            if let Ok(found) = found
                && found.cost < best.0
            {
                best = (found.cost, found.values[0], dead_time_s);
            }
        }
        (best.1, best.2)
    }

    /// Lag and dead time from the readings while the jaws held.
    fn fit_dynamics(&mut self, raw: &[TraceObservation]) {
        let parameters = [("lag_s", self.base.lag_s, 1.0), ("dead_time_s", self.base.dead_time_s, 0.5)].map(
            |(name, start, most)| FreeParameter {
                name: name.into(),
                start,
                bounds: (0.0, most),
                scale: 0.02,
            },
        );
        let thinned: Vec<(usize, Vec<f64>, Vec<f64>)> = raw
            .iter()
            .map(|t| {
                let step = t.held_s.len().div_ceil(READINGS).max(1);
                let pick = |x: &[f64]| x.iter().copied().step_by(step).collect();
                (t.row, pick(&t.held_s), pick(&t.held_n))
            })
            .collect();
        let found = fit(&parameters, FitOptions { max_steps: 15, min_gain: 1e-4 }, |v| {
            let mut model = self.base.clone();
            (model.lag_s, model.dead_time_s) = (v[0], v[1]);
            let mut r = Vec::new();
            let asked: Vec<(usize, &[f64])> =
                thinned.iter().map(|(row, times, _)| (*row, times.as_slice())).collect();
            for ((_, _, readings), predicted) in thinned.iter().zip(self.predictor.traces(&model, &asked)) {
                r.extend(readings.iter().zip(&predicted.stuck_n).map(|(a, b)| {
                    let x = (a - b) / (SHARED_N.0 + SHARED_N.1 * b.abs() + self.base.noise_n);
                    // Readings of a sensor that is off by much do not pull the loop with them.
                    x.signum() * (1.0 + x.abs()).sqrt().min(x.abs())
                }));
            }
            r
        });
        if let Ok(found) = found {
            (self.base.lag_s, self.base.dead_time_s) = (found.values[0], found.values[1]);
        }
    }

    /// Limits and kinetic ratio of the traces that slipped.
    pub(super) fn read_slips(&mut self) {
        let seen = self.observations.iter().enumerate();
        let slipped: Vec<(usize, f64, SlipTrace)> = seen.filter_map(|(k, o)| self.slip_trace(k, o)).collect();
        let rig = SlipRig {
            noise_n: self.base.noise_n,
            relaxation_s: self.base.damping_n_s_per_m / self.base.stiffness_n_per_m,
            fall_s: self.base.fall_s,
            winds_per_s: if self.predictor.winds_up() { 1.0 / self.base.lag_s.max(2e-3) } else { 0.0 },
        };
        let traces: Vec<SlipTrace> = slipped.iter().map(|(_, _, t)| t.clone()).collect();
        let Some(slips) = read_slips(&traces, rig) else { return };
        for ((k, no_load_n, _), limit) in slipped.iter().zip(&slips.limits) {
            // As the label, without what the zero moved since it was read.
            let shift_n = self.data.measured.pulls[self.observations[*k].row].zero_shift_n;
            let reading = SlipLimit { value_n: limit.value_n + no_load_n - shift_n, ..*limit };
            self.observations[*k].limit_n = Some(reading);
        }
        if slipped.len() >= 3 {
            self.kinetic = Some((slips.ratio, libm::hypot(slips.ratio_sd, slips.model_sd)));
            self.base.kinetic_ratio = slips.ratio;
        }
        self.slips = Some(slips);
    }

    /// The rows of a trace that slipped, with its number and its reading without load.
    fn slip_trace(&self, k: usize, trace: &Observation) -> Option<(usize, f64, SlipTrace)> {
        let slip_s = trace.slip_s.filter(|_| trace.slid_n.is_some())?;
        let no_load_n = trace.no_load_n.map_or(0.0, |b| b.0);
        let rows = self.data.measured.pulls[trace.row].trace.as_ref()?;
        let pulled = rows.rows().filter(|r| r.time_s >= 0.0);
        let (time_s, reading_n): (Vec<f64>, Vec<f64>) =
            pulled.map(|r| (r.time_s, r.measured_force_n - no_load_n)).unzip();
        let mut stuck_n = self.predictor.trace(&self.base, trace.row, &time_s).stuck_n;
        let enough = time_s.len() >= 16 && stuck_n.len() == time_s.len();
        // A sensor or a loop whose scale nobody has named yet is no slip: the tool that holds reads what this one did.
        let held = time_s.partition_point(|t| *t < slip_s - UNSCALED_S);
        let (by, of) = stuck_n[..held.min(stuck_n.len())]
            .iter()
            .zip(&reading_n)
            .fold((0.0, 0.0), |(by, of), (s, r)| (by + s * r, of + s * s));
        if held >= 16 && of > 0.0 {
            let scale = (by / of).clamp(0.3, 3.0);
            stuck_n.iter_mut().for_each(|s| *s *= scale);
        }
        enough.then_some((k, no_load_n, SlipTrace { time_s, reading_n, stuck_n, slip_s }))
    }

    fn observation(&self, trace: &TraceObservation) -> Observation {
        let each = trace.held_s.len().div_ceil(READINGS).max(1);
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let times_s: Vec<f64> = trace.held_s.chunks(each).map(mean).collect();
        let readings_n: Vec<f64> = trace.held_n.chunks(each).map(mean).collect();
        let stuck = self.predictor.trace(&self.base, trace.row, &times_s).stuck_n;
        let levels =
            stuck.iter().map(|f| EDGES_N.iter().position(|e| f <= e).unwrap_or(LEVELS - 1)).collect();
        Observation {
            row: trace.row,
            no_load_n: trace.no_load_n.filter(|(_, n)| *n >= 5),
            times_s,
            readings_n,
            each,
            levels,
            slip_s: trace.slip_s,
            limit_n: None,
            slid_n: trace.slid_n,
        }
    }
}

/// Lag and dead time, free.
fn dynamics(base: &PullModel) -> [FreeParameter; 2] {
    [("lag_s", base.lag_s, 1.0), ("dead_time_s", base.dead_time_s, 0.5)].map(|(name, start, most)| {
        FreeParameter { name: name.into(), start, bounds: (0.0, most), scale: 0.02 }
    })
}

/// Shear stiffness of both gels: median over the traces of reading over displacement.
fn stiffness(raw: &[TraceObservation]) -> Option<f64> {
    let mut each: Vec<f64> = raw
        .iter()
        .filter_map(|t| {
            let n = t.held_n.len() as f64;
            if n < 8.0 {
                return None;
            }
            let (mf, mx) = (t.held_n.iter().sum::<f64>() / n, t.held_m.iter().sum::<f64>() / n);
            let pairs = t.held_n.iter().zip(&t.held_m);
            let (fx, ff) = pairs
                .fold((0.0, 0.0), |(fx, ff), (f, x)| (fx + (f - mf) * (x - mx), ff + (f - mf) * (f - mf)));
            (ff > 0.0 && fx > 0.0).then(|| ff / fx)
        })
        .collect();
    each.sort_by(f64::total_cmp);
    (each.len() >= 2).then(|| each[each.len() / 2].clamp(200.0, 2e6))
}
