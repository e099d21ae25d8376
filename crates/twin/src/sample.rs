//! The result of simulating one scenario.

use crate::label::forces::PullForces;
use crate::{ContactPatch, Grasp, PerJaw, PullTrace, Scenario, SlipLabel, TactileImage};

/// One sample: what was asked and what came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// What was asked.
    pub scenario: Scenario,
    /// What came out.
    pub outcome: Outcome,
}

/// How a sample ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The jaws gripped and pulled.
    Pulled(Box<Pulled>),
    /// The jaws closed without touching the part: the label is 0 and the images are those at rest.
    NoContact {
        /// Images without contact, unless the sweep makes none.
        images: Option<PerJaw<TactileImage>>,
    },
    /// The sample could not be simulated; it keeps its place in the data set.
    Failed {
        /// Why, with the numbers.
        reason: String,
    },
}

/// A grip and its pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Pulled {
    /// The settled grip.
    pub grasp: Grasp,
    /// What each gel feels of it.
    pub imprint: PerJaw<ImprintSummary>,
    /// What each camera sees of it, unless the sweep makes no images.
    pub images: Option<PerJaw<TactileImage>>,
    /// The part's friction coefficient as it was drawn for this grip, scatter included.
    pub mu_drawn: f64,
    /// The coefficient that acted: what friction laws, tables and the contact make of it.
    pub mu_effective: f64,
    /// A friction law was used outside its fitted range.
    pub outside_fit: bool,
    /// The force loop trails the staircase by more than half the label tolerance, so that the label rule may take a
    /// force from before the slip.
    pub lag_exceeds_tolerance: bool,
    /// The force over time.
    pub trace: PullTrace,
    /// The label.
    pub label: SlipLabel,
    /// Forces that the trace has in addition to the label.
    pub forces: PullForces,
    /// What both jaws held along the pull, without noise and label rule.
    pub limit_force_n: f64,
    /// When the first cell of the contact slid, since the start of the pull; `None` if none did.
    pub slip_onset_s: Option<f64>,
    /// When all cells did.
    pub slip_s: Option<f64>,
    /// Why the trace contradicts the label, with numbers; `None` if it does not, and without a trace.
    pub suspect: Option<String>,
}

/// The contact of one jaw in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintSummary {
    /// Depth of the deepest point below the unloaded gel surface.
    pub press_depth_m: f64,
    /// The pressure field as a few cells.
    pub patch: ContactPatch,
}
