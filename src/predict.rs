//! Predictions of measured pulls by the reduced mechanics without inertia: expected values over scatter and noise.

mod table;

use crate::cache::Cache;
use gripgen_identify::pulls::model::{PredictPulls, PullModel, PullPrediction, TracePrediction};
use gripgen_physics::{QuasiStatic, StuckPull};
use gripgen_twin::config::Feedback;
use gripgen_twin::effects::{CommandChain, GripPoint, SensorChain};
use gripgen_twin::{Jaw, MeasuredPulls, Robot, Staircase, Twin};
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use table::{LabelTable, Scattered};

/// Longest pull that is looked at.
const MOST_TIME_S: f64 = 120.0;

/// Tables kept: those of a model and of its neighbours for a derivative.
const TABLES: usize = 96;

/// Distance of the kinetic ratios for which there are tables; those between are interpolated.
const RATIO_STEP: f64 = 0.025;

/// Tables of two kinetic ratios and the weight of the second.
type Tables = (Arc<LabelTable>, Arc<LabelTable>, f64);

/// Ids of sensor effects that depend on the campaign's clock.
const CLOCKS: [&str; 2] = ["sensor_drift", "sensor_gain_drift"];

/// Predicts the pulls of a campaign on a rig.
pub struct PullPredictor<'a> {
    measured: &'a MeasuredPulls,
    robot: Robot,
    rate_hz: f64,
    /// Commands of the campaign: height and length of a step.
    profiles: Vec<(f64, f64)>,
    staircases: Vec<Staircase>,
    profile_of: Vec<usize>,
    part_names: Vec<String>,
    part_of: Vec<usize>,
    /// Force up to which pulls are looked at.
    most_n: f64,
    jobs: usize,
    stuck: Cache<Key, StuckPull>,
    tables: Cache<Key, LabelTable>,
}

/// What a stuck pull or a table depends on: profile, direction, and the bits of the parameters.
type Key = (usize, bool, Vec<u64>);

impl<'a> PullPredictor<'a> {
    /// For the pulls of a campaign on the rig of `twin`. `jobs` threads share the work.
    pub fn new(measured: &'a MeasuredPulls, twin: &Twin, jobs: usize) -> Self {
        let mut profiles: Vec<(f64, f64)> = Vec::new();
        let profile_of = measured
            .pulls
            .iter()
            .map(|p| {
                let own = (p.increment_n, p.step_s);
                profiles.iter().position(|q| *q == own).unwrap_or_else(|| {
                    profiles.push(own);
                    profiles.len() - 1
                })
            })
            .collect();
        let staircases = profiles.iter().map(|&(n, s)| Staircase::constant(n, s, MOST_TIME_S)).collect();
        let mut part_names: Vec<String> = measured.pulls.iter().map(|p| p.part.clone()).collect();
        part_names.sort();
        part_names.dedup();
        let part_of = measured.pulls.iter().map(|p| part_names.partition_point(|n| *n < p.part)).collect();
        let labels = measured.pulls.iter().map(|p| p.max_pull_force_n);
        let traces = measured.pulls.iter().filter_map(|p| p.trace.as_ref());
        let readings = traces.flat_map(|t| t.measured_force_n.iter().copied());
        let most_n = 1.4 * labels.chain(readings).fold(1.0, f64::max) + 6.0;
        let mut robot = twin.robot;
        robot.feedback = measured.feedback.unwrap_or(robot.feedback);
        Self {
            measured,
            robot,
            rate_hz: twin.wrist.rate_hz,
            profiles,
            staircases,
            profile_of,
            part_names,
            part_of,
            most_n: most_n.min(2000.0),
            jobs: jobs.max(1),
            stuck: Cache::new(TABLES),
            tables: Cache::new(TABLES),
        }
    }

    /// Names of the parts in the order of a model's coefficients.
    pub fn part_names(&self) -> &[String] {
        &self.part_names
    }

    /// What the force loop closes on.
    pub fn feedback(&self) -> Feedback {
        self.robot.feedback
    }

    fn rig(&self, model: &PullModel) -> QuasiStatic {
        let mut robot = self.robot;
        robot.lag_s = model.lag_s;
        robot.dead_time_s = model.dead_time_s;
        robot.damping_n_s_per_m = model.damping_n_s_per_m;
        // A loop that yields easily moves fast: its limit is a force of 40 N beyond the contact, as in the shipped twin.
        robot.speed_limit_m_per_s = robot.speed_limit_m_per_s.max(40.0 / model.damping_n_s_per_m);
        QuasiStatic {
            robot,
            stiffness_n_per_m: model.stiffness_n_per_m,
            rate_hz: self.rate_hz,
            stop_m: self.measured.stop_m,
            max_time_s: MOST_TIME_S,
        }
    }

    fn sensor(&self, model: &PullModel, row: usize) -> SensorChain {
        let c = &self.measured.pulls[row].covariates;
        let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == self.part_of[row]));
        SensorChain::of(own.map(|e| (e.spec, e.values.as_slice())), c.time_s).along(c.pull_direction)
    }

    fn command(&self, model: &PullModel, row: usize) -> CommandChain {
        let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == self.part_of[row]));
        CommandChain::of(own.map(|e| (e.spec, e.values.as_slice())))
    }

    /// What signals of pull `row` depend on, if other pulls share it.
    fn key(&self, model: &PullModel, row: usize, more: &[f64]) -> Option<Key> {
        let rig = [model.lag_s, model.dead_time_s, model.stiffness_n_per_m, model.damping_n_s_per_m];
        let mut bits: Vec<u64> = rig.iter().chain(more).map(|x| x.to_bits()).collect();
        let mut signed = false;
        for effect in model.effects.iter().filter(|e| e.acts_on_signals()) {
            if CLOCKS.contains(&effect.spec.id) || effect.part.is_some() {
                return None;
            }
            signed = true;
            bits.push(effect.spec.id.as_ptr() as u64);
            bits.extend(effect.values.iter().map(|x| x.to_bits()));
        }
        let against = signed && self.measured.pulls[row].covariates.pull_direction < 0.0;
        Some((self.profile_of[row], against, bits))
    }

    fn stuck(&self, model: &PullModel, row: usize) -> Arc<StuckPull> {
        let make = || {
            let (sensor, command) = (self.sensor(model, row), self.command(model, row));
            let staircase = &self.staircases[self.profile_of[row]];
            Ok::<_, Infallible>(self.rig(model).stuck(staircase, &sensor, &command, self.most_n))
        };
        let made = match self.key(model, row, &[]) {
            Some(key) => self.stuck.get(key, make),
            None => make().map(Arc::new),
        };
        made.unwrap_or_else(|never| match never {})
    }

    fn scattered<'s>(&'s self, model: &'s PullModel, row: usize, stuck: &'s StuckPull) -> Scattered<'s> {
        Scattered {
            rig: self.rig(model),
            stuck,
            staircase: &self.staircases[self.profile_of[row]],
            kinetic_ratio: model.kinetic_ratio,
            scatter: model.scatter,
            noise_n: model.noise_n,
            tolerance_n: self.measured.label_tolerance_n,
            sensor: self.sensor(model, row),
            command: self.command(model, row),
        }
    }

    /// The tables of two kinetic ratios around the model's, and the weight of the second.
    fn table(&self, model: &PullModel, row: usize) -> Option<Tables> {
        let steps = (model.kinetic_ratio / RATIO_STEP).min(1.0 / RATIO_STEP);
        let at = |ratio: f64| {
            let key = self.key(model, row, &[ratio, model.scatter, model.noise_n])?;
            let made = self.tables.get(key, || {
                let (stuck, model) =
                    (self.stuck(model, row), PullModel { kinetic_ratio: ratio, ..model.clone() });
                Ok::<_, Infallible>(LabelTable::new(&self.scattered(&model, row, &stuck), self.most_n))
            });
            Some(made.unwrap_or_else(|never| match never {}))
        };
        let low = steps.floor();
        let weight = steps - low;
        let first = at(low * RATIO_STEP)?;
        let second = if weight > 0.0 { at((low + 1.0) * RATIO_STEP)? } else { first.clone() };
        Some((first, second, weight))
    }

    /// What the jaws of pull `row` hold, without scatter.
    fn limit_n(&self, model: &PullModel, row: usize) -> f64 {
        let pull = &self.measured.pulls[row];
        let part = self.part_of[row];
        let mut sum = 0.0;
        for jaw in Jaw::BOTH {
            let mut at = GripPoint {
                jaw,
                grip_force_n: pull.grip_force_n,
                contact_area_m2: 0.0,
                pull_rate_n_per_s: pull.increment_n / pull.step_s,
                covariates: &pull.covariates,
            };
            let own = || model.effects.iter().filter(|e| e.part.is_none_or(|p| p == part));
            let force_n = own().fold(at.grip_force_n, |f, e| match e.spec.normal_force {
                Some(hook) => hook(&e.values, f, &at).max(0.0),
                None => f,
            });
            at.grip_force_n = force_n;
            let mu = own().fold(model.mu[part], |mu, e| match e.spec.friction {
                Some(hook) => {
                    let held = e.held_grip_force_n.map_or(force_n, |(low, high)| force_n.clamp(low, high));
                    hook(&e.values, mu, &GripPoint { grip_force_n: held, ..at }).max(0.0)
                }
                None => mu,
            });
            sum += mu * force_n;
        }
        sum * model.factor.get(row).copied().unwrap_or(1.0)
    }
}

impl PredictPulls for PullPredictor<'_> {
    fn pulls(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let mut known: Vec<Option<Tables>> = vec![None; 2 * self.profiles.len()];
        rows.iter()
            .map(|&row| {
                let limit_n = self.limit_n(model, row);
                let against = self.measured.pulls[row].covariates.pull_direction < 0.0;
                let slot = 2 * self.profile_of[row] + usize::from(against);
                if known[slot].is_none() {
                    known[slot] = self.table(model, row);
                }
                match &known[slot] {
                    Some((first, second, weight)) => first.at(limit_n).mixed(&second.at(limit_n), *weight),
                    None => {
                        let stuck = self.stuck(model, row);
                        self.scattered(model, row, &stuck).predict(limit_n)
                    }
                }
            })
            .collect()
    }

    fn slips(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let changed = model.effects.iter().any(gripgen_identify::pulls::model::ModelEffect::acts_on_signals);
        rows.iter()
            .map(|&row| {
                let limit_n = self.limit_n(model, row);
                let limit_reading_n = match changed {
                    true => table::reading_n(&self.stuck(model, row), limit_n),
                    false => limit_n,
                };
                PullPrediction { limit_n, limit_reading_n, ..PullPrediction::default() }
            })
            .collect()
    }

    fn limits_n(&self, model: &PullModel) -> Vec<f64> {
        (0..self.measured.pulls.len()).map(|row| self.limit_n(model, row)).collect()
    }

    fn trace(&self, model: &PullModel, row: usize, times_s: &[f64]) -> TracePrediction {
        let stuck = self.stuck(model, row);
        let last = stuck.reading_n.len() - 1;
        let stuck_n = times_s
            .iter()
            .map(|t| {
                let x = (t * self.rate_hz).clamp(0.0, last as f64);
                let (i, w) = (x as usize, x.fract());
                stuck.reading_n[i] * (1.0 - w) + stuck.reading_n[(i + 1).min(last)] * w
            })
            .collect();
        TracePrediction { no_load_n: self.sensor(model, row).read(0.0, -0.25, 0.0), stuck_n }
    }

    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.min(n) {
                scope.spawn(|| {
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        if i >= n {
                            break;
                        }
                        task(i);
                    }
                });
            }
        });
    }
}
