//! How likely residuals are: heavy tails for bad pulls, one scale, memory within a session.

/// How residuals of pulls are distributed: Student's t with 6 degrees of freedom, and a share of bad pulls, of which nothing is known
/// but that they are six times as wide (a contaminated distribution, Tukey 1960). Student's t alone takes six bad pulls of sixty into its scale,
/// which is then 1.2 to 1.6 times that of the others, and what it should show has to be as much larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tails {
    /// Share of bad pulls.
    bad: f64,
}

/// Degrees of freedom.
const FREEDOM: f64 = 6.0;

/// Logarithm of the density at 0: Gamma(3.5) / (sqrt(6 pi) Gamma(3)).
const LOG_PEAK: f64 = -0.960_418_255_751_598_7;

/// Variance of a location that is fitted to normal residuals, over the square of their scale: the integral of the squared score over the
/// squared integral of its slope.
const LOCATION: f64 = 1.394;

/// Standard deviation of normal residuals over the median of their sizes.
pub(super) const SD_OF_MEDIAN: f64 = 1.4826;

/// Width of bad pulls over that of the others.
pub(super) const BAD: f64 = 6.0;

/// Shares of bad pulls that are tried.
const SHARES: [f64; 3] = [0.03, 0.08, 0.15];

impl Tails {
    /// No pull is bad, though a few may lie far off.
    pub const FEW: Self = Self { bad: 0.0 };

    /// Those that residuals have: bad pulls have to be twice as likely as none.
    pub fn of(residuals: &[f64]) -> Self {
        let log = |tails: Self| {
            let s = tails.scale(residuals);
            residuals.iter().map(|r| tails.log_of(*r, s)).sum::<f64>()
        };
        let mut best = (Self::FEW, log(Self::FEW) + PRICE);
        for tails in SHARES.map(|bad| Self { bad }) {
            let found = log(tails);
            if found > best.1 {
                best = (tails, found);
            }
        }
        best.0
    }

    /// These with fewer bad pulls, the fewest last.
    fn fewer(self) -> impl Iterator<Item = Self> {
        [0.0].into_iter().chain(SHARES).rev().filter(move |bad| *bad < self.bad).map(|bad| Self { bad })
    }

    /// Most likely scale of residuals: 0.88 standard deviations of normal ones.
    pub fn scale(self, residuals: &[f64]) -> f64 {
        let n = residuals.len() as f64;
        let mut sorted: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let mut square = sorted.get(sorted.len() / 2).map_or(1.0, |m| (m * SD_OF_MEDIAN).powi(2)).max(1e-12);
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

    /// Density of a bad pull over that of another one, by the square of the residual over the scale.
    fn odds(self, square: f64) -> f64 {
        let ratio = (FREEDOM + square) / (FREEDOM + square / (BAD * BAD));
        self.bad / ((1.0 - self.bad) * BAD) * ratio * ratio * ratio * ratio.sqrt()
    }

    fn weight(self, square: f64) -> f64 {
        let good = (FREEDOM + 1.0) / (FREEDOM + square);
        if self.bad == 0.0 {
            return good;
        }
        let odds = self.odds(square);
        let bad = (FREEDOM + 1.0) / (FREEDOM * BAD * BAD + square);
        (good + odds * bad) / (1.0 + odds)
    }

    /// Weight of a residual over its scale.
    pub fn weight_of(self, residual: f64) -> f64 {
        self.weight(residual * residual)
    }

    /// Variance of a location that is fitted to such residuals; bad ones say nothing.
    pub fn location_variance(self, residuals: &[f64]) -> f64 {
        LOCATION * self.scale(residuals).powi(2) / (1.0 - self.bad)
    }

    /// Logarithm of the density of a residual with this scale.
    pub fn log_of(self, residual: f64, scale: f64) -> f64 {
        let square = (residual / scale).powi(2);
        let good = LOG_PEAK - 0.5 * (FREEDOM + 1.0) * libm::log1p(square / FREEDOM) - libm::log(scale);
        if self.bad == 0.0 { good } else { good + libm::log((1.0 - self.bad) * (1.0 + self.odds(square))) }
    }
}

/// By how much the logarithm of the likelihood has to be larger for bad pulls than for none.
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
/// wandering of the rig is no evidence for an effect. What explains pulls that were bad may have fewer of them than `tails`.
pub fn likelihood(residuals: &[f64], log_sd: &[f64], session_of: &[usize], tails: Tails) -> Likelihood {
    let n = residuals.len();
    let plain_scale = tails.scale(residuals);
    let clipped: Vec<f64> =
        residuals.iter().map(|r| r.clamp(-3.0 * plain_scale, 3.0 * plain_scale)).collect();
    let widths: f64 = log_sd.iter().sum();
    let mut best = Likelihood { log: f64::NEG_INFINITY, scale: plain_scale, memory: 0.0 };
    let mut innovations = vec![0.0; n];
    let look = |memory: f64, innovations: &mut [f64]| {
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
        0.5 * starts as f64 * libm::log(1.0 - memory * memory) - widths
    };
    let of = |tails: Tails, innovations: &[f64]| {
        let s = tails.scale(innovations);
        (s, innovations.iter().map(|e| tails.log_of(*e, s)).sum::<f64>())
    };
    for tenth in 0..10 {
        let memory = f64::from(tenth) * 0.1;
        let more = look(memory, &mut innovations);
        let (scale, log) = of(tails, &innovations);
        // A memory has to pay for itself.
        if log + more > best.log + if best.memory == 0.0 && tenth > 0 { 0.5 } else { 0.0 } {
            best = Likelihood { log: log + more, scale, memory };
        }
    }
    let more = look(best.memory, &mut innovations);
    for tails in tails.fewer() {
        let (scale, log) = of(tails, &innovations);
        if log + more > best.log {
            best = Likelihood { log: log + more, scale, ..best };
        }
    }
    best
}

/// Most likely scale of residuals of which a few may lie far off.
pub fn scale(residuals: &[f64]) -> f64 {
    Tails::FEW.scale(residuals)
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
        for tails in [Tails::FEW, Tails { bad: 0.08 }] {
            let each = (-100_000..100_000).map(|i| f64::from(i) * 0.01);
            let sum: f64 = each.map(|x| tails.log_of(x, 1.0).exp() * 0.01).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{tails:?} {sum}");
        }
    }

    /// The weight is the slope of the density, over the residual.
    #[test]
    fn weights_are_those_of_the_density() {
        for tails in [Tails::FEW, Tails { bad: 0.08 }] {
            for x in [0.3, 1.4, 4.0, 5.5, 30.0] {
                let slope = (tails.log_of(x + 1e-4, 1.0) - tails.log_of(x - 1e-4, 1.0)) / 2e-4;
                assert!(
                    (tails.weight_of(x) + slope / x).abs() < 1e-6 * tails.weight_of(0.0),
                    "{tails:?} {x}"
                );
            }
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

    /// With one pull in ten ten deviations off, or one in thirty, their share is found within a factor of three (three shares are tried), and the scale is that of the others within 6 %,
    /// where Student's t alone has 1.14 to 1.6 times as much. Without, none is bad.
    #[test]
    fn tails_follow_the_bad_pulls() {
        let good = normal(240, 11);
        assert_eq!(Tails::of(&good), Tails::FEW);
        for (every, more) in [(30, 1.12), (9, 1.5)] {
            let mut bad = good.clone();
            bad.iter_mut().step_by(every).for_each(|r| *r -= 10.0);
            let tails = Tails::of(&bad);
            assert!((1.0 / 3.0..3.0).contains(&(tails.bad * every as f64)), "{tails:?}");
            let one = scale(&good);
            assert!((tails.scale(&bad) / one - 1.0).abs() < 0.06, "{tails:?} {}", tails.scale(&bad) / one);
            assert!(scale(&bad) > more * one, "{}", scale(&bad) / one);
        }
    }
}
