//! What a fit has besides the baseline.

use super::candidates::Candidate;
use super::curves::Curve;

/// What is fitted: effects of the library, each from a start, and unnamed curves.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// Effects with the values that their fits start from.
    pub effects: Vec<(Candidate, Vec<f64>)>,
    /// Unnamed dependences with their coefficients.
    pub curves: Vec<(Curve, Vec<f64>)>,
    /// What was learnt without a name: curves with coefficients that fits leave alone.
    pub learnt: Vec<(Curve, Vec<f64>)>,
    /// By how much it was shrunk, for who learns it again.
    pub learnt_share: f64,
    /// Whether lag, dead time, kinetic ratio and what acts on signals stay as they are given, which makes fits of friction
    /// beside them fast.
    pub hold_signals: bool,
    /// Whether the model is one that a twin can hold: without the nuisance of labels that are read too high.
    pub stated: bool,
}

impl Terms {
    /// Whether readings or commands are changed.
    pub fn act_on_signals(&self) -> bool {
        self.effects.iter().any(|(c, _)| c.acts_on_signals())
    }

    /// Whether tools creep.
    pub fn creep(&self) -> bool {
        self.effects.iter().any(|(c, _)| c.spec.creep.is_some())
    }

    pub(super) fn holds(&self, candidate: &Candidate) -> bool {
        self.hold_signals && candidate.acts_on_signals()
    }

    /// Parameters that the data have to pay for.
    pub fn cost(&self) -> usize {
        self.effects.iter().map(|(c, _)| c.cost()).sum::<usize>()
            + self.curves.iter().map(|(c, _)| c.cost).sum::<usize>()
    }
}
