//! How likely residuals are: heavy tails for bad pulls, one scale, memory within a session.

/// How heavy the tails of residuals are: Student's t with so many degrees of freedom, and what follows from them for normal residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tails {
    /// Degrees of freedom.
    freedom: f64,
    /// Logarithm of the density at 0.
    log_peak: f64,
    /// Its scale over that of a distribution with few bad pulls.
    scale: f64,
    /// Variance of a location over the square of the scale: the integral of the squared score over the squared integral of its slope.
    location: f64,
}

impl Tails {
    /// A few pulls may lie far off.
    pub const FEW: Self =
        // Gamma(3.5) / (sqrt(6 pi) Gamma(3)).
        Self { freedom: 6.0, log_peak: -0.960_418_255_751_598_7, scale: 1.0, location: 1.394 };

    /// One in ten does, say. Six degrees of freedom then make a scale of twice the one of the others, in which nothing shows.
    pub const MANY: Self =
        // Gamma(1.75) / (sqrt(2.5 pi) Gamma(1.25)).
        Self {
            freedom: 2.5,
            log_peak: -1.016_639_593_460_450_2,
            scale: 0.876_516_875_902_332,
            location: 2.078,
        };

    /// Those that residuals have: many bad pulls have to be twice as likely.
    pub fn of(residuals: &[f64]) -> Self {
        let log = |tails: Self| {
            let s = tails.raw_scale(residuals);
            residuals.iter().map(|r| tails.log_density(r / s) - libm::log(s)).sum::<f64>()
        };
        if log(Self::MANY) > log(Self::FEW) + PRICE { Self::MANY } else { Self::FEW }
    }

    /// Most likely scale of residuals, in the meaning that it has for few bad pulls: 0.88 standard deviations of normal residuals.
    pub fn scale(self, residuals: &[f64]) -> f64 {
        self.raw_scale(residuals) / self.scale
    }

    /// The scale of the distribution itself.
    fn raw_scale(self, residuals: &[f64]) -> f64 {
        let n = residuals.len() as f64;
        let mut sorted: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let mut square = sorted.get(sorted.len() / 2).map_or(1.0, |m| (m * 1.4826).powi(2)).max(1e-12);
        for _ in 0..30 {
            let new = residuals.iter().map(|r| self.weight(r * r / square) * r * r).sum::<f64>() / n;
            let new = new.max(1e-12);
            if (new / square - 1.0).abs() < 1e-6 {
                break;
            }
            square = new;
        }
        square.sqrt()
    }

    fn weight(self, square: f64) -> f64 {
        (self.freedom + 1.0) / (self.freedom + square)
    }

    /// Weight of a residual over a scale as [`Self::scale`] gives it.
    pub fn weight_of(self, residual: f64) -> f64 {
        self.weight((residual / self.scale).powi(2))
    }

    fn log_density(self, x: f64) -> f64 {
        self.log_peak - 0.5 * (self.freedom + 1.0) * libm::log1p(x * x / self.freedom)
    }

    /// Variance of a location that is fitted to such residuals.
    pub fn location_variance(self, residuals: &[f64]) -> f64 {
        self.location * self.raw_scale(residuals).powi(2)
    }

    /// Variance of a location over what the weights and the scale of its fit say, against few bad pulls.
    pub fn spread(self) -> f64 {
        let own = |t: Self| t.location * t.scale * t.scale * t.weight(0.0);
        own(self) / own(Self::FEW)
    }

    /// Logarithm of the density of a residual, with a scale as [`Self::scale`] gives it.
    pub fn log_of(self, residual: f64, scale: f64) -> f64 {
        let s = scale * self.scale;
        self.log_density(residual / s) - libm::log(s)
    }
}

/// By how much more likely many bad pulls have to be than few.
const PRICE: f64 = 0.7;

/// Residuals of pulls, judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// Logarithm of the likelihood.
    pub log: f64,
    /// Scale of the residuals that is most likely.
    pub scale: f64,
    /// Correlation of neighbours within a session that is most likely; 0 to 0.9.
    pub memory: f64,
}

/// Judges residuals in the order of the pulls. They are in units of the standard deviation whose logarithms are given;
/// their common scale and the correlation of neighbours (AR(1) within a session, never negative) are fitted: a slow
/// wandering of the rig is no evidence for an effect.
pub fn likelihood(residuals: &[f64], log_sd: &[f64], session_of: &[usize], tails: Tails) -> Likelihood {
    let n = residuals.len();
    let plain_scale = tails.scale(residuals);
    let clipped: Vec<f64> =
        residuals.iter().map(|r| r.clamp(-3.0 * plain_scale, 3.0 * plain_scale)).collect();
    let widths: f64 = log_sd.iter().sum();
    let mut best = Likelihood { log: f64::NEG_INFINITY, scale: plain_scale, memory: 0.0 };
    let mut innovations = vec![0.0; n];
    for tenth in 0..10 {
        let memory = f64::from(tenth) * 0.1;
        let mut starts = 0;
        for i in 0..n {
            let first = i == 0 || session_of[i] != session_of[i - 1];
            starts += usize::from(first);
            innovations[i] = if first {
                residuals[i] * (1.0 - memory * memory).sqrt()
            } else {
                residuals[i] - memory * clipped[i - 1]
            };
        }
        let s = tails.scale(&innovations);
        let log = innovations.iter().map(|e| tails.log_of(*e, s)).sum::<f64>() - widths
            + 0.5 * starts as f64 * libm::log(1.0 - memory * memory);
        // A memory has to pay for itself.
        if log > best.log + if best.memory == 0.0 && tenth > 0 { 0.5 } else { 0.0 } {
            best = Likelihood { log, scale: s, memory };
        }
    }
    best
}

/// Most likely scale of residuals of which a few may lie far off.
pub fn scale(residuals: &[f64]) -> f64 {
    Tails::FEW.raw_scale(residuals)
}

/// Half of Huber's cost.
pub fn huber(residuals: &[f64]) -> f64 {
    const K: f64 = 2.5;
    residuals.iter().map(|r| if r.abs() <= K { 0.5 * r * r } else { K * (r.abs() - 0.5 * K) }).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::random::{Purpose, Stream};

    fn normal(n: usize, seed: u64) -> Vec<f64> {
        let mut stream = Stream::new(seed, 0, Purpose::ForceNoise);
        (0..n).map(|_| stream.normal()).collect()
    }

    #[test]
    fn the_density_integrates_to_one() {
        for (tails, within) in [(Tails::FEW, 1e-4), (Tails::MANY, 1e-3)] {
            let each = (-100_000..100_000).map(|i| f64::from(i) * 0.01);
            let sum: f64 = each.map(|x| tails.log_density(x).exp() * 0.01).sum();
            assert!((sum - 1.0).abs() < within, "{tails:?} {sum}");
        }
    }

    /// White noise has no memory, an AR(1) process has its own.
    #[test]
    fn memory_is_that_of_the_process() {
        let white = normal(400, 3);
        let session = vec![0; 400];
        let none = vec![0.0; 400];
        assert!(likelihood(&white, &none, &session, Tails::FEW).memory <= 0.15);
        let mut ar = vec![0.0; 400];
        for i in 1..400 {
            ar[i] = 0.6 * ar[i - 1] + white[i];
        }
        let judged = likelihood(&ar, &none, &session, Tails::FEW);
        assert!((judged.memory - 0.6).abs() < 0.15, "{judged:?}");
        // In terms of a normal distribution the scale of the core is a little smaller.
        assert!((judged.scale - 0.9).abs() < 0.15, "{judged:?}");
    }

    #[test]
    fn a_few_bad_pulls_do_not_move_the_scale() {
        let mut r = normal(200, 5);
        let before = scale(&r);
        for i in 0..8 {
            r[i * 20] = 40.0;
        }
        assert!((scale(&r) / before) < 1.35, "{} {}", scale(&r), before);
    }

    /// With one pull in ten ten deviations off, the heavy tails are those that are more likely, and their scale stays that of the
    /// others; without, they are not, and both scales are the same.
    #[test]
    fn tails_follow_the_bad_pulls() {
        let good = normal(240, 11);
        let mut bad = good.clone();
        bad.iter_mut().step_by(9).for_each(|r| *r -= 10.0);
        assert_eq!((Tails::of(&good), Tails::of(&bad)), (Tails::FEW, Tails::MANY));
        let [few, many] = [Tails::FEW, Tails::MANY].map(|t| (t.scale(&good), t.scale(&bad)));
        assert!((many.0 / few.0 - 1.0).abs() < 0.04, "{few:?} {many:?}");
        assert!(many.1 < 1.45 * many.0 && few.1 > 1.5 * few.0, "{few:?} {many:?}");
    }
}
