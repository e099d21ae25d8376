//! How far readings of traces lie from a model, and what that says.

use super::likelihood::{huber, scale};
use super::zero_wander::{ZeroReadings, ZeroWander};

/// Force by which the response of an arm differs from that of a first-order loop, and its part that grows with force: what
/// all traces of a campaign share says no more than this.
pub(super) const SHARED_N: (f64, f64) = (0.06, 0.02);

/// The same from trace to trace.
pub(super) const OWN_N: (f64, f64) = (0.03, 0.005);

/// What the readings of traces differ from a model by, in the deviations that arms and sensors are known to have.
pub(super) struct TraceResiduals {
    /// Of all traces together, by level of force.
    pub shared: Vec<f64>,
    /// Of each trace about that, by level of force.
    pub own: Vec<f64>,
    /// How many traces.
    pub traces: usize,
    /// Of the readings without a load.
    pub zeros: ZeroReadings,
}

/// By how much further readings lie apart than is known of arms and sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Widening {
    /// Factor on the deviations between traces.
    pub own: f64,
    /// How the sensor's zero wanders from pull to pull.
    pub zero: ZeroWander,
}

impl Widening {
    /// As far as is known.
    pub const NONE: Self = Self { own: 1.0, zero: ZeroWander::NONE };
}

impl TraceResiduals {
    /// By how much further traces lie from each other than is known of arms and sensors: what is not in the model, like the
    /// drag of a cable, moves a whole trace, so its levels say no more than one of them.
    pub fn widening(&self) -> Widening {
        let zero = self.zeros.judged().0;
        if self.own.is_empty() {
            return Widening { own: 1.0, zero };
        }
        let s = scale(&self.own).max(1.0);
        Widening { own: s * self.correlated(s), zero }
    }

    /// Root of the number of levels that say the same.
    fn correlated(&self, s: f64) -> f64 {
        let levels = self.own.len() as f64 / self.traces.max(1) as f64;
        (1.0 + (levels - 1.0).max(0.0) * (1.0 - 1.0 / (s * s))).sqrt()
    }

    /// As one list, in the deviations that `widening` makes of those known.
    pub fn widened(mut self, widening: Widening) -> Vec<f64> {
        self.shared.extend(self.own.iter().map(|r| r / widening.own));
        self.shared.extend(self.zeros.widened(widening.zero));
        self.shared
    }

    /// Minus the logarithm of their likelihood, with the most likely scale between traces, of at least 1.
    pub fn cost(&self) -> f64 {
        let (_, zero_cost) = self.zeros.judged();
        let s = if self.own.is_empty() { 1.0 } else { scale(&self.own).max(1.0) };
        let correlated = self.correlated(s);
        let own: Vec<f64> = self.own.iter().map(|r| r / (s * correlated)).collect();
        let apart = self.own.len() as f64 / (correlated * correlated);
        huber(&self.shared) + huber(&own) + apart * libm::log(s) + zero_cost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::random::normal_quantile;

    fn of(own: Vec<f64>) -> TraceResiduals {
        TraceResiduals { shared: vec![0.5], own, traces: 20, zeros: ZeroReadings::default() }
    }

    /// Deviations that are those of a standard normal variable cost what a Gaussian likelihood says: half of one each, on
    /// average (the mean of chi-squared is its number of degrees of freedom).
    #[test]
    fn traces_that_agree_count_fully() {
        let mut own: Vec<f64> = (0..80).map(|i| normal_quantile((f64::from(i) + 0.5) / 80.0)).collect();
        // Each trace has levels of both signs.
        own.rotate_left(37);
        let r = of(own);
        assert!((r.widening().own - 1.0).abs() < 0.05, "{:?}", r.widening());
        let gaussian = 0.5 * 0.25 + 0.5 * 80.0;
        assert!((r.cost() / gaussian - 1.0).abs() < 0.05, "{} {gaussian}", r.cost());
        assert_eq!(r.widened(Widening::NONE).len(), 81);
    }

    /// Twenty traces that are each shifted by ten deviations, at four levels: twenty numbers with a scale of ten.
    #[test]
    fn traces_that_are_shifted_count_once() {
        let shift = |i: usize| if (i / 4).is_multiple_of(2) { 10.0 } else { -10.0 };
        let r = of((0..80).map(shift).collect());
        let widening = r.widening().own;
        // Four levels count as one, nearly.
        assert!((widening / 2.0 - 10.0).abs() < 1.5, "{widening}");
        let twice = of((0..80).map(|i| 2.0 * shift(i)).collect());
        // Scale alone: 20 traces, each a factor of two.
        let gained = twice.cost() - r.cost();
        assert!((gained - 20.0 * 2.0_f64.ln()).abs() < 1.0, "{gained}");
    }
}
