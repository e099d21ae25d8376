//! Readings without a load: a zero that wanders from pull to pull is no evidence for an effect.
//!
//! What a zero differs from a model by is taken for an AR(1) process within a session, as labels are: its scale is never below what
//! is known of sensors, its memory never negative. Memory and scale are chosen together with what they say of the mean: with a
//! zero that remembers, ten readings of 0.1 N more are no ten witnesses of a bias. (Taken from the readings about their mean, and
//! the mean judged afterwards, a walk of 0.15 N was a bias or a drift in one campaign of seven.)

use super::likelihood::{huber, scale};
use crate::draws::Draws;

/// Deviation of a zero beside the noise of its readings, in newtons: of each, and of all together.
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
    /// Each in its deviation.
    each: Vec<f64>,
    /// What a newton is in the deviation of each.
    newton: Vec<f64>,
    session_of: Vec<usize>,
}

/// Readings of one memory: their mean, and what is new in each pull about it.
struct Whitened {
    /// The mean by generalized least squares, in newtons.
    mean_n: f64,
    /// Information on it where the scale is 1, 1/N^2.
    information: f64,
    /// What is new in each pull about the mean, and about nothing.
    about_mean: Vec<f64>,
    about_nothing: Vec<f64>,
    /// Pulls that begin a session.
    starts: usize,
}

impl Whitened {
    /// The mean in its deviation, and that deviation over the one of all zeros together.
    fn mean(&self, scale: f64) -> (f64, f64) {
        let own = scale * scale / self.information;
        let square = own + ZERO_N * ZERO_N;
        (self.mean_n / square.sqrt(), (square / own).sqrt())
    }

    /// Minus the logarithm of the likelihood.
    fn cost(&self, memory: f64, scale: f64) -> f64 {
        let scaled: Vec<f64> = self.about_mean.iter().map(|r| r / scale).collect();
        let (mean, wider) = self.mean(scale);
        huber(&scaled) + huber(&[mean]) + libm::log(wider) + scaled.len() as f64 * libm::log(scale)
            - 0.5 * self.starts as f64 * libm::log(1.0 - memory * memory)
    }
}

impl ZeroReadings {
    /// From the differences in newtons, how many readings each is a mean of, and the sessions; `noise_n`: of one reading.
    pub fn new(differences: &[(f64, usize, usize)], noise_n: f64) -> Self {
        let deviation = |readings: usize| (ZERO_N * ZERO_N + noise_n * noise_n / readings as f64).sqrt();
        Self {
            each: differences.iter().map(|(x, n, _)| x / deviation(*n)).collect(),
            newton: differences.iter().map(|(_, n, _)| 1.0 / deviation(*n)).collect(),
            session_of: differences.iter().map(|d| d.2).collect(),
        }
    }

    /// How the zero wanders most likely, and minus the logarithm of the likelihood of the readings.
    pub fn judged(&self) -> (ZeroWander, f64) {
        if self.each.is_empty() {
            return (ZeroWander::NONE, 0.0);
        }
        let mut best = (ZeroWander::NONE, f64::INFINITY);
        for tenths in 0..=MAX_TENTHS {
            let memory = f64::from(tenths) * 0.1;
            let white = self.whitened(memory);
            // The mean is far from nothing because the zero wanders far, or because there is a bias.
            for new in [&white.about_mean, &white.about_nothing] {
                let scale = scale(new).max(1.0);
                let cost = white.cost(memory, scale);
                if cost < best.1 - if tenths > 0 && best.0.memory == 0.0 { PRICE } else { 0.0 } {
                    best = (ZeroWander { scale, memory }, cost);
                }
            }
        }
        best
    }

    /// The readings less an effect, in newtons.
    pub fn less(&self, effect_n: impl Fn(usize) -> f64) -> Self {
        let each = self.each.iter().zip(&self.newton).enumerate();
        Self { each: each.map(|(i, (x, newton))| x - effect_n(i) * newton).collect(), ..self.clone() }
    }

    /// The zero that is farthest from nothing, in newtons.
    pub fn farthest_n(&self) -> f64 {
        self.each.iter().zip(&self.newton).map(|(x, newton)| (x / newton).abs()).fold(0.0, f64::max)
    }

    /// Ways in which a zero may wander around nothing, and how likely the readings make each: a memory with its scale, and sessions that begin anew, as
    /// where the sensor is zeroed, or go on where the last one ended.
    pub fn ways(&self) -> Vec<(Self, ZeroWander, f64)> {
        let onward = Self { session_of: vec![0; self.each.len()], ..self.clone() };
        let mut found: Vec<_> = [self.clone(), onward]
            .into_iter()
            .flat_map(|zeros| {
                (0..=MAX_TENTHS).map(move |tenths| {
                    let memory = f64::from(tenths) * 0.1;
                    let white = zeros.whitened(memory);
                    let scale = scale(&white.about_nothing).max(1.0);
                    let scaled: Vec<f64> = white.about_nothing.iter().map(|x| x / scale).collect();
                    let log = 0.5 * white.starts as f64 * libm::log(1.0 - memory * memory)
                        - huber(&scaled)
                        - scaled.len() as f64 * libm::log(scale);
                    (zeros.clone(), ZeroWander { scale, memory }, log)
                })
            })
            .collect();
        let most = found.iter().map(|w| w.2).fold(f64::NEG_INFINITY, f64::max);
        found.iter_mut().for_each(|w| w.2 = libm::exp(w.2 - most));
        found
    }

    /// A zero that wanders around nothing in one of these ways, read as this one is.
    pub fn drawn(&self, ways: &[(Self, ZeroWander, f64)], draws: &mut Draws) -> Self {
        let mut left = draws.uniform() * ways.iter().map(|w| w.2).sum::<f64>();
        let at = ways.iter().position(|w| {
            left -= w.2;
            left < 0.0
        });
        let (zeros, ZeroWander { scale, memory }, _) = &ways[at.unwrap_or(0)];
        let mut each: Vec<f64> = Vec::with_capacity(self.each.len());
        for i in 0..self.each.len() {
            let new = scale * draws.normal();
            let start = zeros.starts_at(i);
            each.push(if start { new / (1.0 - memory * memory).sqrt() } else { memory * each[i - 1] + new });
        }
        Self { each, ..self.clone() }
    }

    fn starts_at(&self, i: usize) -> bool {
        i == 0 || self.session_of[i] != self.session_of[i - 1]
    }

    fn whitened(&self, memory: f64) -> Whitened {
        let new = |x: &[f64]| -> Vec<f64> {
            let one = |i: usize| {
                if self.starts_at(i) {
                    x[i] * (1.0 - memory * memory).sqrt()
                } else {
                    x[i] - memory * x[i - 1]
                }
            };
            (0..x.len()).map(one).collect()
        };
        let (about_nothing, newton) = (new(&self.each), new(&self.newton));
        let information = newton.iter().map(|n| n * n).sum::<f64>();
        let mean_n = newton.iter().zip(&about_nothing).map(|(n, r)| n * r).sum::<f64>() / information;
        Whitened {
            mean_n,
            information,
            about_mean: about_nothing.iter().zip(&newton).map(|(r, n)| r - mean_n * n).collect(),
            about_nothing,
            starts: (0..self.each.len()).filter(|&i| self.starts_at(i)).count(),
        }
    }

    /// The mean and what is new in each pull, in the deviations of a wandering zero; empty without readings.
    pub fn widened(&self, zero: ZeroWander) -> Vec<f64> {
        if self.each.is_empty() {
            return Vec::new();
        }
        let white = self.whitened(zero.memory);
        let mut list = vec![white.mean(zero.scale).0];
        list.extend(white.about_mean.iter().map(|r| r / zero.scale));
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Gains of a bias and of a line by ten zeros or so, every fourth pull of a walk of 0.15 N in sessions of 8 to 20 pulls, over
    /// 200 campaigns: a bias of no newton is seldom seen, one of 0.5 N mostly.
    #[test]
    fn a_walk_is_seldom_a_bias_and_a_bias_mostly_one() {
        let mut draws = Draws::new(5, 2);
        let (mut false_bias, mut false_line, mut found) = (0, 0, 0);
        for _ in 0..200 {
            let (pulls, block) = (24 + draws.below(37), 8 + draws.below(13));
            let mut at = draws.normal();
            let walk: Vec<f64> = (0..pulls)
                .map(|_| {
                    at = 0.9 * at + 0.19f64.sqrt() * draws.normal();
                    0.15 * at + 0.025 * draws.normal()
                })
                .collect();
            let judged = |less_n: &dyn Fn(f64) -> f64| {
                let each = (0..pulls).step_by(4);
                let list: Vec<(f64, usize, usize)> =
                    each.map(|i| (walk[i] - less_n(i as f64 / pulls as f64), 50, i / block)).collect();
                ZeroReadings::new(&list, 0.1).judged().1
            };
            let best = |of: &dyn Fn(f64, f64) -> f64, from: f64| {
                let steps = (0..=60).map(|k| from + f64::from(k) * 0.02);
                steps.map(|size| judged(&|share| of(size, share))).fold(f64::INFINITY, f64::min)
            };
            let plain = judged(&|_| 0.0);
            false_bias += u32::from(plain - best(&|size, _| size, -0.6) > 5.0);
            false_line += u32::from(plain - best(&|size, share| size * share, -0.6) > 5.0);
            // The same walk on top of half a newton.
            found += u32::from(judged(&|_| -0.5) - best(&|size, _| size - 0.5, -0.1) > 5.0);
        }
        println!("of 200: bias {false_bias}, line {false_line}, found {found}");
        assert!(false_bias <= 8 && false_line <= 8 && found >= 150, "{false_bias} {false_line} {found}");
    }

    /// A drift of 1 N over the campaign stays evidence.
    #[test]
    fn a_drift_is_still_seen() {
        let (plain, line) = (of(|_, share| share), of(|_, _| 0.0));
        let gain = plain.judged().1 - line.judged().1;
        assert!(gain > 30.0, "{gain}");
    }
}
