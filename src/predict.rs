//! Predictions of measured pulls for fits: by the reduced mechanics without inertia, which is fast, and through the simulator,
//! which is what a twin is judged by. Expected values over scatter and noise.

mod kept;
mod limit;
mod signals;
mod table;

use crate::cache::Cache;
use crate::expect::{Expectations, QuietTwin};
use crate::gripped::answering_mass_kg;
use crate::library::Library;
use crate::parallel::in_parallel;
use gripgen_identify::pulls::model::{ModelEffect, PredictPulls, PullModel, PullPrediction, TracePrediction};
use gripgen_physics::{QuasiStatic, StuckPull};
use gripgen_twin::config::Feedback;
use gripgen_twin::effects::{CommandChain, Effect, OutsideFit, Per, SensorChain};
use gripgen_twin::{Backbone, Jaw, MeasuredPulls, Robot, Staircase, Twin};
use kept::Kept;
use signals::Signals;
use std::convert::Infallible;
use std::sync::{Arc, OnceLock};
use table::{ExactLabels, LabelTable, Scattered, enough_for};

/// Longest pull that is looked at.
const MAX_TIME_S: f64 = 120.0;

/// Tables kept: those of a model and of its neighbours for a derivative.
const TABLES: usize = 96;

/// Pulls and tables kept of models whose effects act on signals: a derivative by a friction parameter asks for those of
/// the model itself again.
const SIGNAL_PULLS: usize = 320;
const SIGNAL_TABLES: usize = 192;

/// Pulls whose contacts are looked at.
const CONTACTS: usize = 12;

/// Distance of the kinetic ratios for which there are tables; those between are interpolated.
const RATIO_STEP: f64 = 0.025;

/// Tables of two kinetic ratios and the weight of the second.
type Tables = (Arc<LabelTable>, Arc<LabelTable>, f64);

/// Predicts the pulls of a campaign on a rig.
pub struct PullPredictor<'a> {
    measured: &'a MeasuredPulls,
    /// The twin that models are variations of, and its pulls through the simulator.
    twin: Twin,
    expectations: Expectations<'a>,
    robot: Robot,
    /// Mass with which the tool answers.
    mass_kg: f64,
    rate_hz: f64,
    /// Commands of the campaign: those planned, and those that traces bring themselves.
    staircases: Vec<Arc<Staircase>>,
    profile_of: Vec<usize>,
    part_names: Vec<String>,
    part_of: Vec<usize>,
    /// Force up to which pulls are looked at.
    max_n: f64,
    /// Cells of contacts from all over the campaign: shares of area and limit.
    contacts: OnceLock<Vec<(f64, f64)>>,
    jobs: usize,
    stuck: Cache<Key, Kept>,
    tables: Cache<Key, LabelTable>,
    exact: Cache<Key, ExactLabels>,
    signal_stuck: Cache<Key, Kept>,
    signal_tables: Cache<Key, LabelTable>,
}

fn acts_on_signals(model: &PullModel) -> bool {
    model.effects.iter().any(ModelEffect::acts_on_signals)
}

/// What a stuck pull or a table depends on: profile, direction, and the bits of the parameters.
type Key = (usize, bool, Vec<u64>);

impl<'a> PullPredictor<'a> {
    /// For the pulls of a campaign on the rig of `twin`, whose files `library` holds. `jobs` threads share the work.
    pub fn new(measured: &'a MeasuredPulls, twin: &Twin, library: &'a Library, jobs: usize) -> Self {
        let expectations = Expectations::new(measured, library);
        // Pulls with the same commands share a staircase, and then a profile.
        let mut staircases: Vec<Arc<Staircase>> = Vec::new();
        let profile_of = (0..measured.pulls.len())
            .map(|row| {
                let own = expectations.staircase(row);
                staircases.iter().position(|known| Arc::ptr_eq(known, own)).unwrap_or_else(|| {
                    staircases.push(own.clone());
                    staircases.len() - 1
                })
            })
            .collect();
        let mut part_names: Vec<String> = measured.pulls.iter().map(|p| p.part.clone()).collect();
        part_names.sort();
        part_names.dedup();
        let part_of = measured.pulls.iter().map(|p| part_names.partition_point(|n| *n < p.part)).collect();
        let labels = measured.pulls.iter().map(|p| p.max_pull_force_n);
        let traces = measured.pulls.iter().filter_map(|p| p.trace.as_ref());
        let readings = traces.flat_map(|t| t.measured_force_n.iter().copied());
        let max_n = 1.4 * labels.chain(readings).fold(1.0, f64::max) + 6.0;
        let mut robot = twin.robot;
        robot.feedback = measured.feedback.unwrap_or(robot.feedback);
        Self {
            measured,
            twin: twin.clone(),
            expectations,
            robot,
            mass_kg: answering_mass_kg(twin, library),
            rate_hz: twin.wrist.rate_hz,
            staircases,
            profile_of,
            part_names,
            part_of,
            max_n: max_n.min(2000.0),
            contacts: OnceLock::new(),
            jobs: jobs.max(1),
            stuck: Cache::new(TABLES),
            tables: Cache::new(TABLES),
            exact: Cache::new(TABLES),
            signal_stuck: Cache::new(SIGNAL_PULLS),
            signal_tables: Cache::new(SIGNAL_TABLES),
        }
    }

    /// Names of the parts in the order of a model's coefficients.
    pub fn part_names(&self) -> &[String] {
        &self.part_names
    }

    /// The twin that a model describes: the one that is written for it.
    pub fn twin_of(&self, model: &PullModel) -> Twin {
        let mut twin = self.twin.clone();
        twin.tables.clear();
        (twin.robot.lag_s, twin.robot.dead_time_s) = (model.lag_s, model.dead_time_s);
        twin.robot.feedback = self.robot.feedback;
        if model.damping_n_s_per_m != twin.robot.damping_n_s_per_m {
            twin.robot.damping_n_s_per_m = model.damping_n_s_per_m;
            twin.robot.speed_limit_m_per_s = speed_limit_m_per_s(model.damping_n_s_per_m);
        }
        twin.robot.apparent_mass_kg = model.apparent_mass_kg.or(twin.robot.apparent_mass_kg);
        let both = twin.gel.left.shear_stiffness_n_per_m + twin.gel.right.shear_stiffness_n_per_m;
        if model.stiffness_n_per_m != both {
            for jaw in Jaw::BOTH {
                twin.gel[jaw].shear_stiffness_n_per_m = 0.5 * model.stiffness_n_per_m;
            }
        }
        for jaw in Jaw::BOTH {
            twin.gel[jaw].shear_by_area = model.shear_by_area;
        }
        twin.wrist.noise_n = model.noise_n;
        for (name, mu) in self.part_names.iter().zip(&model.mu) {
            if let Some(part) = twin.parts.get_mut(name) {
                (part.mu, part.scatter) = (*mu, model.scatter);
                (part.kinetic_ratio, part.kinetic_fall_s) = (model.kinetic_ratio, model.fall_s);
            }
        }
        let named = |effect: &ModelEffect| Effect {
            spec: effect.spec,
            part: effect.part.map(|p| self.part_names[p].clone()),
            values: effect.values.clone(),
            fitted_grip_force_n: None,
            outside_fit: OutsideFit::Extrapolate,
            per: Per::Jaw,
            reference_area_m2: None,
        };
        twin.effects = model.effects.iter().map(named).collect();
        twin
    }

    /// Readings of pull `row` at `times_s` of the twin that `model` describes, without scatter and noise, as far as the pull
    /// lasts.
    pub fn simulated_trace_n(&self, model: &PullModel, row: usize, times_s: &[f64]) -> Vec<f64> {
        let quiet = QuietTwin::new(&self.twin_of(model));
        let factor = model.factor.get(row).copied().unwrap_or(1.0);
        let readings = self.expectations.readings(&quiet, row, factor).measured_n;
        times_s
            .iter()
            .map_while(|t| readings.get((t * self.rate_hz).round().max(0.0) as usize).copied())
            .collect()
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
        if model.damping_n_s_per_m != self.twin.robot.damping_n_s_per_m {
            robot.speed_limit_m_per_s = speed_limit_m_per_s(model.damping_n_s_per_m);
        }
        QuasiStatic {
            robot,
            stiffness_n_per_m: model.stiffness_n_per_m,
            rate_hz: self.rate_hz,
            fall_s: model.fall_s,
            stop_m: self.measured.stop_m,
            max_time_s: MAX_TIME_S,
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

    /// What signals of pull `row` depend on.
    fn key(&self, model: &PullModel, row: usize, more: &[f64]) -> Key {
        let rig =
            [model.lag_s, model.dead_time_s, model.stiffness_n_per_m, model.damping_n_s_per_m, model.fall_s];
        let mut bits: Vec<u64> = rig.iter().chain(more).map(|x| x.to_bits()).collect();
        let mut signed = false;
        for effect in model.effects.iter().filter(|e| e.acts_on_signals()) {
            if effect.spec.reads_clock {
                bits.push(self.measured.pulls[row].covariates.time_s.to_bits());
            }
            if let Some(part) = effect.part {
                bits.push(u64::from(part == self.part_of[row]));
            }
            signed = true;
            bits.push(effect.spec.id.as_ptr() as u64);
            bits.extend(effect.values.iter().map(|x| x.to_bits()));
        }
        let against = signed && self.measured.pulls[row].covariates.pull_direction < 0.0;
        (self.profile_of[row], against, bits)
    }

    fn stuck(&self, model: &PullModel, row: usize) -> Arc<Kept> {
        let make = || {
            let (sensor, command) = (self.sensor(model, row), self.command(model, row));
            let staircase = &self.staircases[self.profile_of[row]];
            let mut kept = Kept::spare();
            self.rig(model).stuck(staircase, &sensor, &command, self.max_n, &mut kept.0);
            Ok::<_, Infallible>(kept)
        };
        // What a fit tries of an effect on signals would push everything else out: it has a place of its own.
        let cache = if acts_on_signals(model) { &self.signal_stuck } else { &self.stuck };
        cache.get(self.key(model, row, &[]), make).unwrap_or_else(|never| match never {})
    }

    fn scattered<'s>(
        &'s self,
        model: &'s PullModel,
        row: usize,
        stuck: &'s StuckPull,
        backbone: &'s Backbone,
    ) -> Scattered<'s> {
        Scattered {
            rig: self.rig(model),
            stuck,
            staircase: &self.staircases[self.profile_of[row]],
            kinetic_ratio: model.kinetic_ratio,
            backbone,
            scatter: model.scatter,
            noise_n: model.noise_n,
            tolerance_n: self.measured.label_tolerance_n,
            sensor: self.sensor(model, row),
            command: self.command(model, row),
        }
    }

    /// The mean contact of the campaign.
    fn backbone(&self, model: &PullModel) -> Backbone {
        let cells = self.contacts.get_or_init(|| {
            let n = self.measured.pulls.len();
            let rows = (0..n).step_by(n.div_ceil(CONTACTS).max(1));
            rows.flat_map(|row| self.expectations.contact(&QuietTwin::new(&self.twin), row)).collect()
        });
        Backbone::new(cells, model.shear_by_area)
    }

    /// The tables of two kinetic ratios around the model's, and the weight of the second.
    fn table(&self, model: &PullModel, row: usize) -> Tables {
        let never = |made: Result<Arc<LabelTable>, Infallible>| made.unwrap_or_else(|never| match never {});
        let build = |model: &PullModel| Ok::<_, Infallible>(self.label_table(model, row));
        if acts_on_signals(model) {
            let (bent_lag_s, bent_dead_s) = model.bent_at_s;
            let own = [
                model.kinetic_ratio,
                model.scatter,
                model.noise_n,
                model.shear_by_area,
                bent_lag_s,
                bent_dead_s,
            ];
            let make = || Ok(self.signal_table(model, row));
            let table = never(self.signal_tables.get(self.key(model, row, &own), make));
            return (table.clone(), table, 0.0);
        }
        let steps = (model.kinetic_ratio / RATIO_STEP).min(1.0 / RATIO_STEP);
        let at = |ratio: f64| {
            let key = self.key(model, row, &[ratio, model.scatter, model.noise_n, model.shear_by_area]);
            let model = PullModel { kinetic_ratio: ratio, ..model.clone() };
            never(self.tables.get(key, || build(&model)))
        };
        let low = steps.floor();
        let weight = steps - low;
        let first = at(low * RATIO_STEP);
        let second = if weight > 0.0 { at((low + 1.0) * RATIO_STEP) } else { first.clone() };
        (first, second, weight)
    }

    fn label_table(&self, model: &PullModel, row: usize) -> LabelTable {
        let stuck = self.stuck(model, row);
        let backbone = self.backbone(model);
        let pull = self.scattered(model, row, &stuck, &backbone);
        if acts_on_signals(model) {
            return LabelTable::new(&pull, &ExactLabels::new(&pull, self.max_n, model.scatter), self.max_n);
        }
        let most = enough_for(model.scatter);
        let own = [model.kinetic_ratio, most, model.noise_n, model.shear_by_area];
        let make = || Ok::<_, Infallible>(ExactLabels::new(&pull, self.max_n, most));
        let exact = self.exact.get(self.key(model, row, &own), make).unwrap_or_else(|never| match never {});
        LabelTable::new(&pull, &exact, self.max_n)
    }

    /// Labels of a model whose effects act on signals: those of a contact that lets go at once, and what a bend adds to labels
    /// without these effects, at the lag and dead time of `bent_at_s`. Fits try thousands of such models, and a contact that
    /// bends takes five times as long.
    fn signal_table(&self, model: &PullModel, row: usize) -> LabelTable {
        if !self.backbone(model).bends() {
            return self.label_table(model, row);
        }
        let straight = self.label_table(&PullModel { shear_by_area: 0.0, ..model.clone() }, row);
        let (lag_s, dead_time_s) = model.bent_at_s;
        let plain = PullModel { effects: vec![], factor: vec![], lag_s, dead_time_s, ..model.clone() };
        let unbent = PullModel { shear_by_area: 0.0, ..plain.clone() };
        straight.bent(&self.table(&plain, row), &self.table(&unbent, row))
    }

    fn slots(&self) -> usize {
        2 * self.staircases.len()
    }

    /// Pulls of one profile and direction share a place.
    fn slot(&self, row: usize) -> usize {
        2 * self.profile_of[row] + usize::from(self.measured.pulls[row].covariates.pull_direction < 0.0)
    }

    /// Whether pulls of one profile and direction have the same signals.
    fn shares_signals(&self, model: &PullModel) -> bool {
        !model.effects.iter().any(|e| e.spec.reads_clock || (e.acts_on_signals() && e.part.is_some()))
    }

    /// Labels with signals that depend on the clock: tables at the first, the middle and the last pull of each profile
    /// and direction, and a parabola in time between them. Signals of one part are taken pull by pull.
    fn pulls_by_clock(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let time = |row: usize| self.measured.pulls[row].covariates.time_s;
        let backbone = self.backbone(model);
        let alone = |row: usize| {
            let stuck = self.stuck(model, row);
            self.scattered(model, row, &stuck, &backbone).predict(self.limit_n(model, row))
        };
        let of_part = model.effects.iter().any(|e| e.acts_on_signals() && e.part.is_some());
        let mut places: Vec<Vec<usize>> = vec![vec![]; self.slots()];
        for (k, &row) in rows.iter().enumerate() {
            places[self.slot(row)].push(k);
        }
        let mut found = vec![PullPrediction::default(); rows.len()];
        for place in places.iter_mut().filter(|p| !p.is_empty()) {
            place.sort_by(|&a, &b| time(rows[a]).total_cmp(&time(rows[b])));
            let nodes = [place[0], place[place.len() / 2], place[place.len() - 1]].map(|k| rows[k]);
            let t = nodes.map(time);
            if of_part || place.len() < 12 || t[0] >= t[1] || t[1] >= t[2] {
                place.iter().for_each(|&k| found[k] = alone(rows[k]));
                continue;
            }
            let tables = nodes.map(|row| self.table(model, row).0);
            for &k in place.iter() {
                let (at, limit_n) = (time(rows[k]), self.limit_n(model, rows[k]));
                let p = [0, 1, 2].map(|i| tables[i].at(limit_n));
                let weight = |i: usize, j: usize, k: usize| {
                    (at - t[j]) * (at - t[k]) / ((t[i] - t[j]) * (t[i] - t[k]))
                };
                let w = [weight(0, 1, 2), weight(1, 0, 2), weight(2, 0, 1)];
                let sum = |f: &dyn Fn(&PullPrediction) -> f64| (0..3).map(|i| w[i] * f(&p[i])).sum::<f64>();
                found[k] = PullPrediction {
                    limit_n,
                    limit_reading_n: sum(&|p| p.limit_reading_n),
                    label_n: sum(&|p| p.label_n),
                    label_sd_n: sum(&|p| p.label_sd_n).max(0.5 * p[1].label_sd_n),
                };
            }
        }
        found
    }
}

/// A loop that yields easily moves fast: its limit is a force of 40 N beyond the contact, as in the shipped twin.
pub(crate) fn speed_limit_m_per_s(damping_n_s_per_m: f64) -> f64 {
    (40.0 / damping_n_s_per_m).clamp(0.02, 1.5)
}

impl PredictPulls for PullPredictor<'_> {
    fn pulls(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let clock =
            model.effects.iter().any(|e| e.spec.reads_clock || (e.acts_on_signals() && e.part.is_some()));
        if clock {
            return self.pulls_by_clock(model, rows);
        }
        let mut known: Vec<Option<Tables>> = vec![None; self.slots()];
        rows.iter()
            .map(|&row| {
                let slot = self.slot(row);
                let (first, second, weight) = known[slot].get_or_insert_with(|| self.table(model, row));
                let limit_n = self.limit_n(model, row);
                first.at(limit_n).mixed(&second.at(limit_n), *weight)
            })
            .collect()
    }

    fn labels_n(&self, model: &PullModel, rows: &[usize]) -> Vec<f64> {
        let quiet = QuietTwin::new(&self.twin_of(model));
        in_parallel(rows.len(), self.jobs, |k| {
            let factor = model.factor.get(rows[k]).copied().unwrap_or(1.0);
            self.expectations.expected(&quiet, rows[k], factor).label_n
        })
    }

    fn contact(&self, model: &PullModel, row: usize) -> Vec<(f64, f64)> {
        self.expectations.contact(&QuietTwin::new(&self.twin_of(model)), row)
    }

    fn slips(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let mut signals = Signals::new(self, model);
        rows.iter()
            .map(|&row| {
                let limit_n = self.limit_n(model, row);
                PullPrediction {
                    limit_n,
                    limit_reading_n: signals.limit_reading_n(row, limit_n),
                    ..PullPrediction::default()
                }
            })
            .collect()
    }

    fn limits_n(&self, model: &PullModel) -> Vec<f64> {
        (0..self.measured.pulls.len()).map(|row| self.limit_n(model, row)).collect()
    }

    fn traces(&self, model: &PullModel, asked: &[(usize, &[f64])]) -> Vec<TracePrediction> {
        let mut signals = Signals::new(self, model);
        asked
            .iter()
            .map(|(row, times_s)| TracePrediction {
                no_load_n: self.sensor(model, *row).read(0.0, -0.25, 0.0),
                stuck_n: signals.stuck_n(*row, times_s),
            })
            .collect()
    }

    fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    fn winds_up(&self) -> bool {
        self.robot.feedback == Feedback::Measured
    }

    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        in_parallel(n, self.jobs, task);
    }
}
