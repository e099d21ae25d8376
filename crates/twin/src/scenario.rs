//! One pull, fully specified.

pub(crate) mod keys;
pub(crate) mod staircase;

use crate::draw::Drawn;
use std::collections::{BTreeMap, BTreeSet};

/// The circumstances of a pull: the columns that a table of measured pulls may have.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariates {
    /// Which gel is mounted.
    pub gel_id: String,
    /// Which session of work.
    pub session: String,
    /// Pulls made since the gel was new.
    pub pull_index: u64,
    /// Time since the start of the campaign.
    pub time_s: f64,
    /// Temperature of the gel, in degrees Celsius.
    pub temperature_c: f64,
    /// Time from closing the jaws to the start of the pull.
    pub dwell_s: f64,
    /// Lever between grip centre and pull line, along the part's long axis.
    pub grip_offset_m: f64,
    /// Angle of the grip about the jaw axis.
    pub grip_angle_rad: f64,
    /// +1 along the pull direction of the sweep, -1 against it.
    pub pull_direction: f64,
    /// Columns without a field of their own, in the units of the columns: mostly of unknown meaning. A table of the twin may
    /// depend on them.
    pub extra: BTreeMap<String, Drawn>,
    /// Columns that other pulls of the campaign have and this one lacks: a field then holds a stand-in from its neighbours, for
    /// a simulation, and [`crate::columns::Column::value`] is `None`.
    pub missing: BTreeSet<&'static str>,
}

impl Default for Covariates {
    fn default() -> Self {
        Self {
            gel_id: "g1".into(),
            session: "1".into(),
            pull_index: 0,
            time_s: 0.0,
            temperature_c: 23.0,
            dwell_s: 1.0,
            grip_offset_m: 0.0,
            grip_angle_rad: 0.0,
            pull_direction: 1.0,
            extra: BTreeMap::new(),
            missing: BTreeSet::new(),
        }
    }
}

/// How a pull is made and ended.
#[derive(Debug, Clone, PartialEq)]
pub struct PullSettings {
    /// Height of a step of the staircase.
    pub increment_n: f64,
    /// Command of the first step; one increment where it is `None`.
    pub start_n: Option<f64>,
    /// Mean length of a step.
    pub step_s: f64,
    /// Half width of the uniform jitter of a step, as a fraction of its mean length.
    pub step_jitter: f64,
    /// Displacement at which the pull ends.
    pub stop_m: f64,
    /// Unit vector of the pull in `world`.
    pub direction: [f64; 3],
    /// Commanded force at which the pull ends without slip, if there is such a limit.
    pub max_force_n: Option<f64>,
    /// Longest time of a pull.
    pub max_time_s: f64,
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
}

impl Default for PullSettings {
    /// The pull of a sweep that says nothing of it.
    fn default() -> Self {
        Self {
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            step_jitter: 0.0,
            stop_m: 5e-3,
            direction: [0.0, 0.0, 1.0],
            max_force_n: None,
            max_time_s: 60.0,
            label_tolerance_n: 3.0,
        }
    }
}

/// One pull: everything a sample is a function of, beside the twin and the sweep seed. The default grips no part with no force.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// Seed of the sweep.
    pub seed: u64,
    /// Global index of the sample.
    pub index: u64,
    /// Which drawn configuration; its repetitions share it.
    pub group: u64,
    /// Which repetition of that configuration.
    pub repetition: u64,
    /// Name of the part in the twin.
    pub part: String,
    /// Which of the part's grips.
    pub grip_pose: usize,
    /// Grip force, per jaw.
    pub grip_force_n: f64,
    /// Circumstances.
    pub covariates: Covariates,
    /// The pull.
    pub pull: PullSettings,
    /// What `[vary]` drew for this sample, by key.
    pub drawn: BTreeMap<String, Drawn>,
}
