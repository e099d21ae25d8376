//! Readings without a load: a zero that wanders from pull to pull is no evidence for an effect.
//!
//! What a zero differs from a model by is taken for an AR(1) process within a session, as labels are: its scale is never below what
//! is known of sensors, its memory never negative.

use super::likelihood::{huber, scale};

/// Deviation of a zero beside the noise of its readings, in newtons.
const ZERO_N: f64 = 0.02;

/// Largest memory that is tried, in tenths.
const MAX_TENTHS: u32 = 9;

/// A memory has to pay for itself.
const PRICE: f64 = 0.5;

/// How a zero wanders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ZeroWander {
    /// Deviation of what is new in each pull, over what is known of sensors; at least 1.
    pub scale: f64,
    /// Correlation of neighbours, 0 to 0.9.
    pub memory: f64,
}

impl ZeroWander {
    /// It does not.
    pub const NONE: Self = Self { scale: 1.0, memory: 0.0 };
}

/// Readings without a load, less what is predicted, of the traces in their order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ZeroReadings {
    /// Mean over the traces in newtons, and its deviation where the zero does not wander.
    mean_n: Option<(f64, f64)>,
    /// About that mean, each in its deviation.
    each: Vec<f64>,
    /// Mean deviation of one of them, in newtons.
    deviation_n: f64,
    session_of: Vec<usize>,
}

impl ZeroReadings {
    /// From the differences in newtons, how many readings each is a mean of, and the sessions; `noise_n`: of one reading.
    pub fn new(differences: &[(f64, usize, usize)], noise_n: f64) -> Self {
        let count = differences.len() as f64;
        if differences.is_empty() {
            return Self::default();
        }
        let deviation = |readings: usize| (ZERO_N * ZERO_N + noise_n * noise_n / readings as f64).sqrt();
        let mean = differences.iter().map(|d| d.0).sum::<f64>() / count;
        let readings: usize = differences.iter().map(|d| d.1).sum();
        Self {
            mean_n: Some((mean, deviation(readings))),
            each: differences.iter().map(|(x, n, _)| (x - mean) / deviation(*n)).collect(),
            deviation_n: differences.iter().map(|(_, n, _)| deviation(*n)).sum::<f64>() / count,
            session_of: differences.iter().map(|d| d.2).collect(),
        }
    }

    /// How the zero wanders most likely, and minus the logarithm of the likelihood of the readings about their mean.
    pub fn judged(&self) -> (ZeroWander, f64) {
        let mut best = (ZeroWander::NONE, f64::INFINITY);
        for tenths in 0..=MAX_TENTHS {
            let memory = f64::from(tenths) * 0.1;
            let (new, starts) = self.innovations(memory);
            let scale = if new.is_empty() { 1.0 } else { scale(&new).max(1.0) };
            let scaled: Vec<f64> = new.iter().map(|r| r / scale).collect();
            let cost = huber(&scaled) + new.len() as f64 * libm::log(scale)
                - 0.5 * starts as f64 * libm::log(1.0 - memory * memory);
            if cost < best.1 - if tenths > 0 && best.0.memory == 0.0 { PRICE } else { 0.0 } {
                best = (ZeroWander { scale, memory }, cost);
            }
        }
        best
    }

    /// What is new in each pull, and how many of them begin a session.
    fn innovations(&self, memory: f64) -> (Vec<f64>, usize) {
        let mut starts = 0;
        let each = (0..self.each.len()).map(|i| {
            if i == 0 || self.session_of[i] != self.session_of[i - 1] {
                starts += 1;
                self.each[i] * (1.0 - memory * memory).sqrt()
            } else {
                self.each[i] - memory * self.each[i - 1]
            }
        });
        let each = each.collect();
        (each, starts)
    }

    /// The mean, in its deviation under a wandering zero; empty without readings.
    pub fn mean(&self, zero: ZeroWander) -> Vec<f64> {
        let Some((mean_n, deviation_n)) = self.mean_n else { return Vec::new() };
        let process = zero.scale * zero.scale / (1.0 - zero.memory * zero.memory);
        let stretch = (1.0 + zero.memory) / (1.0 - zero.memory);
        let wander = (process * stretch - 1.0).max(0.0) * self.deviation_n * self.deviation_n;
        let square = deviation_n * deviation_n + wander / self.each.len() as f64;
        vec![mean_n / square.sqrt()]
    }

    /// The mean and what is new in each pull, in the deviations of a wandering zero.
    pub fn widened(&self, zero: ZeroWander) -> Vec<f64> {
        let mut list = self.mean(zero);
        list.extend(self.innovations(zero.memory).0.iter().map(|r| r / zero.scale));
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    /// 80 zeros of 40 readings of 0.1 N in four sessions.
    fn of(zero_n: impl Fn(usize, f64) -> f64) -> ZeroReadings {
        let mut draws = Draws::new(3, 9);
        let list: Vec<(f64, usize, usize)> = (0..80)
            .map(|i| {
                (
                    zero_n(i, i as f64 / 79.0) + draws.normal() * (ZERO_N.powi(2) + 0.01 / 40.0).sqrt(),
                    40,
                    i / 20,
                )
            })
            .collect();
        ZeroReadings::new(&list, 0.1)
    }

    fn walk() -> Vec<f64> {
        let mut draws = Draws::new(8, 4);
        let mut at = 0.0;
        (0..80)
            .map(|i| {
                at = if i % 20 == 0 { 0.15 * draws.normal() } else { 0.95 * at + 0.047 * draws.normal() };
                at
            })
            .collect()
    }

    #[test]
    fn a_zero_that_stays_is_as_sure_as_its_readings() {
        let (zero, cost) = of(|_, _| 0.0).judged();
        assert!(zero.scale < 1.15 && zero.memory < 0.25, "{zero:?}");
        assert!((cost - 40.0).abs() < 12.0, "{cost}");
    }

    /// A line through a wandering zero of 0.15 N gains little; with nothing but the noise of the readings it would gain hundreds.
    #[test]
    fn a_line_gains_nothing_by_a_wandering_zero() {
        let walk = walk();
        let slope = {
            let mean = walk.iter().sum::<f64>() / 80.0;
            let x = |i: usize| i as f64 / 79.0 - 0.5;
            let xx: f64 = (0..80).map(|i| x(i) * x(i)).sum();
            (0..80).map(|i| x(i) * (walk[i] - mean)).sum::<f64>() / xx
        };
        let (plain, line) = (of(|i, _| walk[i]), of(|i, share| walk[i] - slope * share));
        let gain = plain.judged().1 - line.judged().1;
        // A line has a parameter more, and a memory of 0.95 is not on the grid.
        assert!(gain < 5.0, "{gain}");
        let unwandering = huber(&plain.widened(ZeroWander::NONE)) - huber(&line.widened(ZeroWander::NONE));
        println!("slope {slope:.3} N, gain {gain:.2}, without a wandering zero {unwandering:.1}");
        assert!(plain.judged().0.memory > 0.5);
    }

    /// A drift of 1 N over the campaign stays evidence.
    #[test]
    fn a_drift_is_still_seen() {
        let (plain, line) = (of(|_, share| share), of(|_, _| 0.0));
        let gain = plain.judged().1 - line.judged().1;
        assert!(gain > 30.0, "{gain}");
    }
}
