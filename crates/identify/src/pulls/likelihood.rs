//! How likely residuals are: heavy tails for bad pulls, one scale, memory within a session.

/// Degrees of freedom of Student's t: a few pulls may lie far off.
const FREEDOM: f64 = 6.0;

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
pub fn likelihood(residuals: &[f64], log_sd: &[f64], session_of: &[usize]) -> Likelihood {
    let n = residuals.len();
    let plain_scale = scale(residuals);
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
        let s = scale(&innovations);
        let log =
            innovations.iter().map(|e| log_density(e / s)).sum::<f64>() - n as f64 * libm::log(s) - widths
                + 0.5 * starts as f64 * libm::log(1.0 - memory * memory);
        // A memory has to pay for itself.
        if log > best.log + if best.memory == 0.0 && tenth > 0 { 0.5 } else { 0.0 } {
            best = Likelihood { log, scale: s, memory };
        }
    }
    best
}

/// Most likely scale of residuals with heavy tails.
pub fn scale(residuals: &[f64]) -> f64 {
    let n = residuals.len() as f64;
    let mut sorted: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    sorted.sort_by(f64::total_cmp);
    let mut square = sorted.get(sorted.len() / 2).map_or(1.0, |m| (m * 1.4826).powi(2)).max(1e-12);
    for _ in 0..30 {
        let new = residuals.iter().map(|r| weight_of(r * r / square) * r * r).sum::<f64>() / n;
        let new = new.max(1e-12);
        if (new / square - 1.0).abs() < 1e-6 {
            break;
        }
        square = new;
    }
    square.sqrt()
}

/// Weight of a residual whose square, in units of the scale, is given.
pub fn weight_of(square: f64) -> f64 {
    (FREEDOM + 1.0) / (FREEDOM + square)
}

/// Logarithm of the density of Student's t.
pub(super) fn log_density(x: f64) -> f64 {
    // Gamma(3.5) / (sqrt(6 pi) Gamma(3)).
    const CONSTANT: f64 = 0.382_732_772_098_226_6;
    libm::log(CONSTANT) - 0.5 * (FREEDOM + 1.0) * libm::log1p(x * x / FREEDOM)
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
        let sum: f64 =
            (-4000..4000).map(|i| (f64::from(i) * 0.01, 0.01)).map(|(x, w)| log_density(x).exp() * w).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }

    /// White noise has no memory, an AR(1) process has its own.
    #[test]
    fn memory_is_that_of_the_process() {
        let white = normal(400, 3);
        let session = vec![0; 400];
        let none = vec![0.0; 400];
        assert!(likelihood(&white, &none, &session).memory <= 0.15);
        let mut ar = vec![0.0; 400];
        for i in 1..400 {
            ar[i] = 0.6 * ar[i - 1] + white[i];
        }
        let judged = likelihood(&ar, &none, &session);
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
}
