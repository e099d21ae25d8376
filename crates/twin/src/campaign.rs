//! A campaign: pulls to make, in order.

use crate::config::Feedback;
use crate::draw::Drawn;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is done at one place of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PullKind {
    /// A part is gripped and pulled.
    #[default]
    Pull,
    /// The jaws are open, and the wrist sensor is read for `dwell_s`.
    NoLoad,
}

/// One entry of `pulls` of a campaign file, in its units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PlannedPull {
    /// What is done.
    pub kind: PullKind,
    /// Name of the part; empty without a load.
    pub part: String,
    /// Grip force, in the convention of the file; 0 without a load.
    pub grip_force_n: f64,
    /// Height of a step of the staircase.
    pub force_increment_n: f64,
    /// Command of the first step; one increment where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_start_n: Option<f64>,
    /// Length of a step.
    pub step_time_s: f64,
    /// Time from closing the jaws to the start of the pull; without a load, how long the sensor is read.
    pub dwell_s: f64,
    /// 1 up, -1 down.
    pub pull_direction: f64,
    /// Lever between grip centre and pull line, along the part's long axis.
    pub grip_offset_mm: f64,
    /// Angle of the grip about the jaw axis.
    pub grip_angle_deg: f64,
    /// Pause before it.
    pub pause_s: f64,
    /// Session of work.
    pub session: String,
    /// Which gel is mounted.
    pub gel_id: String,
    /// What a lab notes of it: `temperature_c`, `operator`, any column that is none of the others.
    #[serde(flatten)]
    pub notes: BTreeMap<String, Drawn>,
}

impl Default for PlannedPull {
    /// What an entry leaves out; part and grip force of a pull have to be there.
    fn default() -> Self {
        Self {
            kind: PullKind::Pull,
            part: String::new(),
            grip_force_n: 0.0,
            force_increment_n: 1.0,
            force_start_n: None,
            step_time_s: 0.104,
            dwell_s: 1.0,
            pull_direction: 1.0,
            grip_offset_mm: 0.0,
            grip_angle_deg: 0.0,
            pause_s: 0.0,
            session: "1".into(),
            gel_id: "g1".into(),
            notes: BTreeMap::new(),
        }
    }
}

/// A campaign. Grip forces are per jaw.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
    /// Displacement at which a pull ends.
    pub stop_m: f64,
    /// What the force loop closes on, where it is known.
    pub feedback: Option<Feedback>,
    /// What is done, in order.
    pub pulls: Vec<PlannedPull>,
}

/// Friction coefficient with which the length of a pull is estimated before anything is known.
const GUESSED_MU: f64 = 0.2;

/// Time to go to the part and home again, to close and open the jaws, and to take the images.
const HANDLING_S: f64 = 25.0;

impl PlannedPull {
    /// How long it takes, estimated: the pause before it, handling, dwell, and the staircase up to twice
    /// `0.2 x grip force` and past the tolerance of the label rule.
    pub fn estimated_s(&self, label_tolerance_n: f64) -> f64 {
        match self.kind {
            PullKind::NoLoad => self.pause_s + self.dwell_s,
            PullKind::Pull => {
                let highest_n = 2.0 * GUESSED_MU * self.grip_force_n + label_tolerance_n;
                let first_n = self.force_start_n.map_or(0.0, |start_n| start_n - self.force_increment_n);
                let steps = ((highest_n - first_n) / self.force_increment_n).ceil().max(1.0);
                self.pause_s + HANDLING_S + self.dwell_s + steps * self.step_time_s
            }
        }
    }
}

impl Campaign {
    /// How long the robot is busy with it, pauses included.
    pub fn estimated_minutes(&self) -> f64 {
        self.pulls.iter().map(|p| p.estimated_s(self.label_tolerance_n)).sum::<f64>() / 60.0
    }
}
