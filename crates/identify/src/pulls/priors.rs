//! What is believed of a rig and its parts before the first pull.

use gripgen_twin::random::{normal_cdf, normal_quantile};

/// What is believed of a number: normal, or its logarithm is, inside bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Mean; of one whose logarithm is normal, the median.
    pub centre: f64,
    /// Standard deviation, of the logarithm where that is normal.
    pub spread: f64,
    /// Whether the logarithm is normal.
    pub log: bool,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Where it comes from.
    pub source: String,
}

impl Prior {
    /// A normal belief.
    pub fn normal(mean: f64, sd: f64, bounds: (f64, f64), source: &str) -> Self {
        Self { centre: mean, spread: sd, log: false, bounds, source: source.into() }
    }

    /// The value at `z` of a standard normal variable: a draw of the one is a draw of the other.
    pub fn at(&self, z: f64) -> f64 {
        let place = |x: f64| {
            let ratio = if self.log { libm::log(x / self.centre) } else { x - self.centre };
            ratio / self.spread
        };
        let (low, high) = self.bounds;
        if self.spread <= 0.0 {
            return self.centre.clamp(low, high);
        }
        let value = |z: f64| {
            if self.log { self.centre * libm::exp(self.spread * z) } else { self.centre + self.spread * z }
        };
        let below = if self.log && low <= 0.0 { 0.0 } else { normal_cdf(place(low)) };
        let above = normal_cdf(place(high));
        let share = (below + (above - below) * normal_cdf(z)).clamp(1e-15, 1.0 - 1e-15);
        value(normal_quantile(share)).clamp(low, high)
    }

    /// The same belief, `factor` times as wide.
    #[must_use]
    pub fn wider(&self, factor: f64) -> Self {
        Self { spread: self.spread * factor, ..self.clone() }
    }
}

/// What is believed before the first pull.
#[derive(Debug, Clone, PartialEq)]
pub struct PullPriors {
    /// Friction coefficient of a part at large grip forces.
    pub mu: Prior,
    /// Offset b / a of the law mu (a + b / F_G), N.
    pub offset_n: Prior,
    /// Kinetic over static friction.
    pub kinetic_ratio: Prior,
    /// Time constant of the force loop, s.
    pub lag_s: Prior,
    /// Noise of a reading, N.
    pub noise_n: Prior,
    /// Relative scatter of friction from grip to grip.
    pub scatter: Prior,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_belief() {
        let normal = Prior::normal(0.95, 0.05, (0.0, 2.0), "");
        assert!((normal.at(1.0) - 1.0).abs() < 1e-9 && (normal.at(0.0) - 0.95).abs() < 1e-9);
        let log = Prior { centre: 0.2, spread: 0.5, log: true, bounds: (0.001, 9.0), source: String::new() };
        assert!((log.at(-1.0) - 0.2 * (-0.5_f64).exp()).abs() < 1e-6, "{}", log.at(-1.0));
        // A belief that is cut at its mean has its median where the lower half has its own: at 0.6745 deviations below.
        let cut = Prior::normal(0.95, 0.05, (0.0, 0.95), "");
        assert!((cut.at(0.0) - (0.95 - 0.05 * 0.674_489_75)).abs() < 1e-8, "{}", cut.at(0.0));
        assert!(cut.at(9.0) <= 0.95);
    }
}
