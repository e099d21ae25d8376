//! What predicts pulls, and what it predicts them from.

use crate::effects::{Creep, EffectSpec};

/// An effect of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEffect {
    /// Which.
    pub spec: &'static EffectSpec,
    /// Values in the order of the spec.
    pub values: Vec<f64>,
    /// The only part it acts on, by position, or all.
    pub part: Option<usize>,
    /// Grip forces at whose ends the law is held, if it is.
    pub held_grip_force_n: Option<(f64, f64)>,
}

impl ModelEffect {
    /// An effect on all parts.
    pub fn new(spec: &'static EffectSpec, values: Vec<f64>) -> Self {
        Self { spec, values, part: None, held_grip_force_n: None }
    }

    /// Whether it changes readings or commands, and not only what the jaws hold.
    pub fn acts_on_signals(&self) -> bool {
        self.spec.sensor.is_some() || self.spec.command.is_some()
    }
}

/// A twin, reduced to what pulls depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct PullModel {
    /// Friction coefficient of each part.
    pub mu: Vec<f64>,
    /// Kinetic over static friction.
    pub kinetic_ratio: f64,
    /// Time constant of the force loop.
    pub lag_s: f64,
    /// Dead time of the force loop.
    pub dead_time_s: f64,
    /// Shear stiffness of both gels together.
    pub stiffness_n_per_m: f64,
    /// Share of it that the points of a contact have by their area, as the traces show it. Fits leave it alone: it says how
    /// far a contact bends before it slips, and not what it holds.
    pub shear_by_area: f64,
    /// Lag and dead time at which predictions of effects on signals work out what the bend does. Fits leave it alone.
    pub bent_at_s: (f64, f64),
    /// Force per speed that the force loop yields to.
    pub damping_n_s_per_m: f64,
    /// Mass with which the tool answers, where the traces show another than the rig's own.
    pub apparent_mass_kg: Option<f64>,
    /// Time constant with which the force falls after a slip: as the traces show it.
    pub fall_s: f64,
    /// What labels and slips are read too high by; known to be small. A nuisance of fits: it is in no twin, and in no error that
    /// is stated.
    pub misread_n: f64,
    /// Noise of one reading.
    pub noise_n: f64,
    /// Relative scatter of friction from grip to grip.
    pub scatter: f64,
    /// The effects, in order.
    pub effects: Vec<ModelEffect>,
    /// How the tools of all pulls creep, in place of what the effects say: labels are worked out at a few rates. Fits leave it alone.
    pub creep: Option<Creep>,
    /// Factor on the friction of each pull, 1 where this is empty.
    pub factor: Vec<f64>,
}

/// What a model predicts of a pull.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PullPrediction {
    /// What the jaws hold, without scatter.
    pub limit_n: f64,
    /// The reading of that force, when it is reached.
    pub limit_reading_n: f64,
    /// Expected label over scatter and noise.
    pub label_n: f64,
    /// Its standard deviation over scatter and noise; of a slip, that of its reading over scatter alone.
    pub label_sd_n: f64,
}

impl PullPrediction {
    /// The prediction between two, `weight` of the way to `other`.
    #[must_use]
    pub fn mixed(&self, other: &Self, weight: f64) -> Self {
        let mix = |a: f64, b: f64| a * (1.0 - weight) + b * weight;
        Self {
            limit_n: mix(self.limit_n, other.limit_n),
            limit_reading_n: mix(self.limit_reading_n, other.limit_reading_n),
            label_n: mix(self.label_n, other.label_n),
            label_sd_n: mix(self.label_sd_n, other.label_sd_n),
        }
    }
}

/// What a model predicts of the readings of a pull.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TracePrediction {
    /// Reading without load, before the pull.
    pub no_load_n: f64,
    /// Readings of a tool that holds, at each time asked for.
    pub stuck_n: Vec<f64>,
}

/// Predicts the pulls of a campaign. Implemented where mechanics are known.
pub trait PredictPulls: Sync {
    /// Predictions of the pulls at `rows`.
    fn pulls(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction>;

    /// Expected labels of the pulls at `rows` of the twin that is written for this model, through the simulator: what a
    /// comparison with that twin says. Slow; [`PredictPulls::pulls`] is what fits are made with.
    fn labels_n(&self, model: &PullModel, rows: &[usize]) -> Vec<f64> {
        self.pulls(model, rows).iter().map(|p| p.label_n).collect()
    }

    /// What the jaws hold and the reading of it with what scatter makes of that, of the pulls at `rows`; labels may be left at 0.
    fn slips(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction>;

    /// Limits alone, of all pulls: friction and normal force, no sensor.
    fn limits_n(&self, model: &PullModel) -> Vec<f64>;

    /// Readings of pulls if they never slipped: for each a row and times.
    fn traces(&self, model: &PullModel, asked: &[(usize, &[f64])]) -> Vec<TracePrediction>;

    /// Way over impulse in m/(N s) that tools creep by up to a force: for each a row and that force.
    fn creeps_m_per_n_s(&self, _model: &PullModel, rows: &[(usize, f64)]) -> Vec<f64> {
        vec![0.0; rows.len()]
    }

    /// The contact of one pull: of each point its share of the area and its share of what the jaws hold.
    fn contact(&self, _model: &PullModel, _row: usize) -> Vec<(f64, f64)> {
        vec![]
    }

    /// Readings of one pull.
    fn trace(&self, model: &PullModel, row: usize, times_s: &[f64]) -> TracePrediction {
        self.traces(model, &[(row, times_s)]).pop().unwrap_or_default()
    }

    /// Mass with which the tool of the rig answers along the pull.
    fn mass_kg(&self) -> f64 {
        0.0
    }

    /// Whether the force loop closes on its sensor: it then winds up while the jaws slide, and how fast they do says nothing
    /// about its damping.
    fn winds_up(&self) -> bool {
        false
    }

    /// Calls `task` for 0..n, in parallel where that is possible. Each call stands for itself.
    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(task);
    }
}
