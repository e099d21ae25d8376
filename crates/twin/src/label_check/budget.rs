//! By how much a label may be off.

/// Standard errors of a label by their cause, N; 0 where the evidence for it is missing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LabelBudget {
    /// Noise of the one reading that the label is.
    pub noise_n: f64,
    /// The rule: what the jaws held before the label and more than it, and steps that jump over its tolerance.
    pub rule_n: f64,
    /// The loop's time constant times the slope of the force after the label.
    pub lag_n: f64,
    /// The reading without a load.
    pub zero_n: f64,
    /// What the reading is more or less than a share of the command.
    pub gain_n: f64,
    /// Half the time between two rows times the slope at the label, where the label may lie between them.
    pub timing_n: f64,
}

impl LabelBudget {
    /// All causes together, as if they were independent.
    pub fn total_n(&self) -> f64 {
        let Self { noise_n, rule_n, lag_n, zero_n, gain_n, timing_n } = *self;
        [noise_n, rule_n, lag_n, zero_n, gain_n, timing_n].iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}
