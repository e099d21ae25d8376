//! Predictions of measured pulls for fits: by the reduced mechanics without inertia, which is fast, and through the simulator,
//! which is what a twin is judged by. Expected values over scatter and noise.

mod clock;
mod creep;
mod kept;
mod limit;
mod signals;
mod table;
mod tables;

use crate::cache::Cache;
use crate::{QuasiStatic, RimTable};
use creep::creeps;
use gripgen_twin::config::Feedback;
use gripgen_twin::effects::{CommandChain, Effect, OutsideFit, Per, SensorChain, SensorPoint};
use gripgen_twin::label::moments::LabelRule;
use gripgen_twin::predict::{ModelEffect, PredictPulls, PullModel, PullPrediction, TracePrediction};
use gripgen_twin::{Backbone, Jaw, MeasuredPulls, Robot, Staircase, Twin};
use kept::Kept;
use signals::Signals;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};
use table::{ExactLabels, LabelTable, Tables};

/// Longest pull that is looked at.
const MAX_TIME_S: f64 = 120.0;

/// Tables kept at least: those of a model and of its neighbours for a derivative.
const TABLES: usize = 96;

/// Tables kept of each profile: two kinetic ratios, of a contact that bends and of one that does not, and of two models.
const TABLES_OF_PROFILE: usize = 8;

/// Pulls and tables kept of models whose effects act on signals: a derivative by a friction parameter asks for those of
/// the model itself again.
const SIGNAL_PULLS: usize = 320;
const SIGNAL_TABLES: usize = 192;

/// Tables kept of a pull with signals of its own: of a model, and of its neighbours for a derivative.
const OWN_TABLES: usize = 12;

/// Mean contacts kept.
const BACKBONES: usize = 8;

/// Noises and rim exponents of which tables are kept.
const RULES: usize = 16;

/// Pulls whose contacts are looked at.
const CONTACTS: usize = 12;

/// The simulator as a predictor needs it: pulls of a campaign on any twin, without scatter and noise. Implemented where grips and
/// their contacts are known.
pub trait SimulatePulls: Sync {
    /// Expected labels of pulls: for each a row and the factor on its friction.
    fn labels_n(&self, twin: &Twin, pulls: &[(usize, f64)]) -> Vec<f64>;

    /// Readings of pull `row` at the rate of the sensor, to its end.
    fn readings_n(&self, twin: &Twin, row: usize, factor: f64) -> Vec<f64>;

    /// Of each cell of both contacts its share of the area and of what the jaws hold.
    fn contact(&self, twin: &Twin, row: usize) -> Vec<(f64, f64)>;

    /// Calls `task` for 0..n, in parallel where that is possible. Each call stands for itself.
    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync));
}

/// The commands of each pull of a campaign: those of its own trace, or the planned ones. Pulls with the same commands share them.
pub fn campaign_staircases(measured: &MeasuredPulls) -> Vec<Arc<Staircase>> {
    let mut known: BTreeMap<[u64; 3], Arc<Staircase>> = BTreeMap::new();
    let staircases = measured.pulls.iter().map(|p| {
        let start_n = p.start_n.unwrap_or(p.increment_n);
        let plain = known.entry([p.increment_n, p.step_s, start_n].map(f64::to_bits)).or_insert_with(|| {
            let plain = Staircase::constant(p.increment_n, p.step_s, MAX_TIME_S);
            Arc::new(plain.starting_at(p.start_n))
        });
        let own = p.trace.as_ref().and_then(|t| plain.of_trace(t, p.step_s, MAX_TIME_S));
        own.map_or_else(|| plain.clone(), Arc::new)
    });
    staircases.collect()
}

/// Predicts the pulls of a campaign on a rig.
pub struct PullPredictor<'a> {
    measured: &'a MeasuredPulls,
    /// The twin that models are variations of, and its pulls through the simulator.
    twin: Twin,
    simulator: Box<dyn SimulatePulls + 'a>,
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
    /// Mean contacts by the bits of `shear_by_area`.
    backbones: Cache<u64, Backbone>,
    /// How labels are read, by the bits of the noise.
    rules: Cache<u64, LabelRule>,
    /// How tools creep while the rim of their contact slips, by the bits of the exponent.
    rims: Cache<Option<u64>, RimTable>,
    stuck: Cache<Key, Kept>,
    tables: Cache<Key, LabelTable>,
    exact: Cache<Key, ExactLabels>,
    signal_stuck: Cache<Key, Kept>,
    signal_tables: Cache<Key, LabelTable>,
    /// Of each pull that has signals of its own.
    own_tables: Vec<Cache<Key, LabelTable>>,
}

fn acts_on_signals(model: &PullModel) -> bool {
    model.effects.iter().any(ModelEffect::acts_on_signals)
}

/// What a stuck pull or a table depends on: profile, direction, and the bits of the parameters.
type Key = (usize, bool, Vec<u64>);

impl<'a> PullPredictor<'a> {
    /// For the pulls of a campaign on the rig of `twin`, whose tool answers with `mass_kg`.
    pub fn new(
        measured: &'a MeasuredPulls,
        twin: &Twin,
        mass_kg: f64,
        simulator: Box<dyn SimulatePulls + 'a>,
    ) -> Self {
        // Pulls with the same commands share a staircase, and then a profile.
        let mut staircases: Vec<Arc<Staircase>> = Vec::new();
        let profile_of = campaign_staircases(measured)
            .into_iter()
            .map(|own| {
                staircases.iter().position(|known| Arc::ptr_eq(known, &own)).unwrap_or_else(|| {
                    staircases.push(own);
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
        let tables = TABLES.max(TABLES_OF_PROFILE * staircases.len());
        let mut robot = twin.robot;
        robot.feedback = measured.feedback.unwrap_or(robot.feedback);
        Self {
            measured,
            twin: twin.clone(),
            simulator,
            robot,
            mass_kg,
            rate_hz: twin.wrist.rate_hz,
            staircases,
            profile_of,
            part_names,
            part_of,
            max_n: max_n.min(2000.0),
            contacts: OnceLock::new(),
            backbones: Cache::new(BACKBONES),
            rules: Cache::new(RULES),
            rims: Cache::new(RULES),
            stuck: Cache::new(TABLES),
            tables: Cache::new(tables),
            exact: Cache::new(tables),
            signal_stuck: Cache::new(SIGNAL_PULLS),
            signal_tables: Cache::new(SIGNAL_TABLES),
            own_tables: measured.pulls.iter().map(|_| Cache::new(OWN_TABLES)).collect(),
        }
    }

    /// Names of the parts in the order of a model's coefficients.
    pub fn part_names(&self) -> &[String] {
        &self.part_names
    }

    /// How much softer the gel of a jaw is than its constants say: see [`gripgen_twin::Gel::compliance`].
    pub fn compliance(&self, jaw: Jaw) -> f64 {
        self.twin.gel[jaw].compliance
    }

    /// The twin that a model describes: the one that is written for it.
    pub fn twin_of(&self, model: &PullModel) -> Twin {
        let mut twin = self.twin.clone();
        twin.tables.clear();
        twin.surfaces.clear();
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
        let factor = model.factor.get(row).copied().unwrap_or(1.0);
        let readings = self.simulator.readings_n(&self.twin_of(model), row, factor);
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
        SensorChain::of(own.map(|e| (e.spec, e.values.as_slice())), SensorPoint::start_of(c))
            .along(c.pull_direction)
    }

    fn command(&self, model: &PullModel, row: usize) -> CommandChain {
        let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == self.part_of[row]));
        CommandChain::of(own.map(|e| (e.spec, e.values.as_slice())))
    }

    /// What signals of pull `row` depend on.
    fn key(&self, model: &PullModel, row: usize, more: &[f64]) -> Key {
        let rig =
            [model.lag_s, model.dead_time_s, model.stiffness_n_per_m, model.damping_n_s_per_m, model.fall_s];
        let creep = model.creep.map(|c| c.rate_m_per_n_s).filter(|rate| *rate > 0.0);
        let mut bits: Vec<u64> = rig.iter().chain(more).chain(&creep).map(|x| x.to_bits()).collect();
        let mut signed = false;
        for effect in model.effects.iter().filter(|e| e.acts_on_signals()) {
            if effect.spec.reads_clock {
                let start = SensorPoint::start_of(&self.measured.pulls[row].covariates);
                bits.extend([start.clock_s, start.since_zero_s].map(f64::to_bits));
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
            let rate = model.creep.unwrap_or_default().rate_m_per_n_s;
            self.rig(model).stuck(staircase, &sensor, &command, rate, self.max_n, &mut kept.0);
            kept
        };
        // What a fit tries of an effect on signals would push everything else out: it has a place of its own.
        let cache = if acts_on_signals(model) { &self.signal_stuck } else { &self.stuck };
        cache.made(self.key(model, row, &[]), make)
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
}

/// A loop that yields easily moves fast: its limit is a force of 40 N beyond the contact, as in the shipped twin.
pub fn speed_limit_m_per_s(damping_n_s_per_m: f64) -> f64 {
    (40.0 / damping_n_s_per_m).clamp(0.02, 1.5)
}

impl PredictPulls for PullPredictor<'_> {
    fn pulls(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let clock =
            model.effects.iter().any(|e| e.spec.reads_clock || (e.acts_on_signals() && e.part.is_some()));
        if clock {
            return self.pulls_by_clock(model, rows);
        }
        if creeps(model) {
            return rows.iter().map(|&row| self.crept(model, row, row)).collect();
        }
        let mut known: Vec<Option<Tables>> = vec![None; self.slots()];
        rows.iter()
            .map(|&row| {
                let slot = self.slot(row);
                let tables = known[slot].get_or_insert_with(|| self.tables_of(model, row));
                self.at(tables, self.limit_n(model, row))
            })
            .collect()
    }

    fn labels_n(&self, model: &PullModel, rows: &[usize]) -> Vec<f64> {
        let factor = |row: &usize| model.factor.get(*row).copied().unwrap_or(1.0);
        let pulls: Vec<(usize, f64)> = rows.iter().map(|row| (*row, factor(row))).collect();
        self.simulator.labels_n(&self.twin_of(model), &pulls)
    }

    fn contact(&self, model: &PullModel, row: usize) -> Vec<(f64, f64)> {
        self.simulator.contact(&self.twin_of(model), row)
    }

    fn slips(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let mut signals = Signals::new(self, model);
        rows.iter()
            .map(|&row| {
                let limit_n = self.limit_n(model, row);
                let scatter_n = model.scatter * limit_n;
                let mut read = |limit_n: f64| signals.limit_reading_n(row, limit_n);
                // At the end of the sensor's range all grips read the same.
                let apart_n = read(limit_n + scatter_n) - read(limit_n - scatter_n);
                PullPrediction {
                    limit_n,
                    limit_reading_n: read(limit_n),
                    label_sd_n: 0.5 * apart_n.abs(),
                    ..PullPrediction::default()
                }
            })
            .collect()
    }

    fn creeps_m_per_n_s(&self, model: &PullModel, rows: &[(usize, f64)]) -> Vec<f64> {
        let of = |&(row, to_n): &(usize, f64)| {
            self.creep(model, row).mean_rate_m_per_n_s(to_n / self.limit_n(model, row))
        };
        rows.iter().map(of).collect()
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
        self.simulator.for_each(n, task);
    }
}
