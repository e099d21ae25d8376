//! Measured over simulated labels against grip force: the paper's correction `a + b / F_G` with its covariance.

use crate::levels::{Level, levels};
use gripgen_twin::MeasuredPulls;
use std::collections::BTreeMap;

/// Predictions smaller than this have no ratio.
const MIN_N: f64 = 0.1;
/// Levels from which a left-out one is predicted.
const MIN_LEVELS: usize = 4;

/// The line `a + b / F_G`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatioFit {
    /// Ratio at a large grip force.
    pub a: f64,
    /// Its change with 1 / F_G.
    pub b_n: f64,
    /// Covariance of (a, b).
    pub covariance: [[f64; 2]; 2],
}

/// A part's ratios, their fit and what it is worth.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRatio {
    /// Measured labels by grip force.
    pub measured: Vec<Level>,
    /// Means of what is predicted for the same pulls.
    pub predicted_n: Vec<f64>,
    /// Grip force and ratio of each pull.
    pub points: Vec<(f64, f64)>,
    /// The fit, if there are three pulls and two grip forces.
    pub fit: Option<RatioFit>,
    /// Mean distance of the predicted means of the levels from the measured ones, of the latter.
    pub before_pct: f64,
    /// The same when predictions are multiplied by the fit.
    pub after_pct: Option<f64>,
    /// The same when the fit has not seen the level.
    pub left_out_pct: Option<f64>,
}

impl RatioFit {
    /// Least squares with every pull alike, so that it asks for no model of the noise. The covariance is the sandwich estimate
    /// HC3 (MacKinnon & White 1985): it holds also where the scatter of a ratio differs between grip forces, as that of sensor
    /// noise does.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let x = |p: &(f64, f64)| 1.0 / p.0;
        let mean = points.iter().map(x).sum::<f64>() / n;
        let spread: f64 = points.iter().map(|p| (x(p) - mean) * (x(p) - mean)).sum();
        if points.len() < 3 || spread.is_nan() || spread <= 1e-12 * n * mean * mean {
            return None;
        }
        let middle = points.iter().map(|p| p.1).sum::<f64>() / n;
        let b_n = points.iter().map(|p| (x(p) - mean) * (p.1 - middle)).sum::<f64>() / spread;
        let a = middle - b_n * mean;
        // a and b are sums of the ratios with these weights.
        let mut covariance = [[0.0; 2]; 2];
        for p in points {
            let slope = (x(p) - mean) / spread;
            let weights = [1.0 / n - mean * slope, slope];
            let leverage = (1.0 / n + (x(p) - mean) * slope).min(1.0 - 1e-9);
            let off = (p.1 - a - b_n * x(p)) / (1.0 - leverage);
            for (i, row) in covariance.iter_mut().enumerate() {
                for (j, cell) in row.iter_mut().enumerate() {
                    *cell += weights[i] * weights[j] * off * off;
                }
            }
        }
        Some(Self { a, b_n, covariance })
    }

    /// The ratio at a grip force.
    pub fn at(&self, grip_force_n: f64) -> f64 {
        self.a + self.b_n / grip_force_n
    }

    /// Standard error of that ratio.
    pub fn error_at(&self, grip_force_n: f64) -> f64 {
        let [[aa, ab], [_, bb]] = self.covariance;
        let x = 1.0 / grip_force_n;
        libm::sqrt((aa + 2.0 * ab * x + bb * x * x).max(0.0))
    }
}

/// Measured over predicted labels of each part; `predicted_n`: the label predicted for each pull.
pub fn pull_ratios(measured: &MeasuredPulls, predicted_n: &[f64]) -> BTreeMap<String, PartRatio> {
    let mut parts: BTreeMap<&str, Vec<(f64, f64, f64)>> = BTreeMap::new();
    for (pull, &predicted_n) in measured.pulls.iter().zip(predicted_n) {
        parts.entry(&pull.part).or_default().push((pull.grip_force_n, pull.max_pull_force_n, predicted_n));
    }
    parts.into_iter().map(|(name, pulls)| (name.into(), part_ratio(&pulls))).collect()
}

/// The ratios of a part's pulls, given as grip force, measured and predicted label.
pub fn part_ratio(pulls: &[(f64, f64, f64)]) -> PartRatio {
    let known: Vec<_> = pulls.iter().copied().filter(|p| p.2 >= MIN_N).collect();
    let labels: Vec<(f64, f64)> = known.iter().map(|p| (p.0, p.1)).collect();
    let points: Vec<(f64, f64)> = known.iter().map(|p| (p.0, p.1 / p.2)).collect();
    let measured = levels(&labels);
    let predicted = |level: &Level, factor: &dyn Fn(f64) -> f64| {
        let each = level.rows.iter().map(|&i| known[i].2 * factor(known[i].0));
        each.sum::<f64>() / level.rows.len() as f64
    };
    let off_pct = |level: &Level, factor: &dyn Fn(f64) -> f64| {
        100.0 * (predicted(level, factor) / level.mean_n - 1.0).abs()
    };
    let mean = |each: Vec<f64>| each.iter().sum::<f64>() / each.len().max(1) as f64;
    let fit = RatioFit::of(&points);
    let left_out = |level: &Level| {
        let others: Vec<_> =
            (0..points.len()).filter(|i| !level.rows.contains(i)).map(|i| points[i]).collect();
        let fit = RatioFit::of(&others)?;
        Some(off_pct(level, &|force_n| fit.at(force_n)))
    };
    let left_out: Option<Vec<f64>> = measured.iter().map(left_out).collect();
    PartRatio {
        predicted_n: measured.iter().map(|level| predicted(level, &|_| 1.0)).collect(),
        before_pct: mean(measured.iter().map(|l| off_pct(l, &|_| 1.0)).collect()),
        after_pct: fit.map(|fit| mean(measured.iter().map(|l| off_pct(l, &|n| fit.at(n))).collect())),
        left_out_pct: left_out.filter(|each| each.len() >= MIN_LEVELS).map(mean),
        measured,
        points,
        fit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::random::{Purpose, Stream};

    const FORCES_N: [f64; 7] = [20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0];

    #[test]
    fn a_law_without_scatter_is_given_back() {
        let (mu, a, b_n) = (0.15, 1.36, -12.15);
        let pull = |f: f64| (f, 2.0 * mu * (a * f + b_n), 2.0 * mu * f);
        let found = part_ratio(&FORCES_N.map(pull));
        let fit = found.fit.unwrap();
        assert!((fit.a - a).abs() < 1e-12 && (fit.b_n - b_n).abs() < 1e-10, "{fit:?}");
        assert!(fit.error_at(40.0) < 1e-9 && (fit.at(50.0) - (1.36 - 0.243)).abs() < 1e-12);
        let before = FORCES_N.map(|f| 100.0 * (1.0 / (a + b_n / f) - 1.0).abs()).iter().sum::<f64>() / 7.0;
        assert!((found.before_pct - before).abs() < 1e-9 && before > 10.0, "{}", found.before_pct);
        assert!(found.after_pct.unwrap() < 1e-9 && found.left_out_pct.unwrap() < 1e-9);
        assert_eq!(part_ratio(&[(20.0, 3.0, 3.0); 9]).fit, None, "one grip force");
        assert_eq!(part_ratio(&[]).fit, None);
        assert_eq!(
            part_ratio(&FORCES_N[..3].iter().map(|&f| pull(f)).collect::<Vec<_>>()).left_out_pct,
            None
        );
    }

    /// Of many campaigns of a known law, with scatter of the friction and noise of the sensor, 90 % intervals of a, b and of the
    /// line hold the truth in nine of ten.
    #[test]
    fn the_covariance_is_that_of_many_campaigns() {
        const CAMPAIGNS: u64 = 2000;
        let (mu, a, b_n) = (0.15, 1.2, -6.0);
        let (mut held, mut expected, mut square) = ([0_u32; 3], 0.0, 0.0);
        for seed in 0..CAMPAIGNS {
            let mut noise = Stream::new(seed, 0, Purpose::ForceNoise);
            let pulls: Vec<_> = (0..35)
                .map(|i| {
                    let f = FORCES_N[i % 7];
                    let label =
                        2.0 * mu * (a * f + b_n) * (1.0 + 0.03 * noise.normal()) + 0.3 * noise.normal();
                    (f, label, 2.0 * mu * f)
                })
                .collect();
            let fit = part_ratio(&pulls).fit.unwrap();
            let (error_a, error_b) = (fit.covariance[0][0].sqrt(), fit.covariance[1][1].sqrt());
            let off = [
                (fit.a - a) / error_a,
                (fit.b_n - b_n) / error_b,
                (fit.at(25.0) - 0.96) / fit.error_at(25.0),
            ];
            for (held, off) in held.iter_mut().zip(off) {
                *held += u32::from(off.abs() < 1.645);
            }
            expected += fit.covariance[0][1];
            square += (fit.a - a) * (fit.b_n - b_n);
        }
        let shares = held.map(|n| f64::from(n) / CAMPAIGNS as f64);
        assert!(shares.iter().all(|s| (0.87..=0.93).contains(s)), "{shares:?}");
        assert!((expected / square - 1.0).abs() < 0.15 && expected < 0.0, "{expected} {square}");
    }
}
