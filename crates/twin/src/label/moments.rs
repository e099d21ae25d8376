//! Labels of pulls whose readings carry noise.

use crate::random::normal_cdf;

/// Deviations of the noise beyond which a reading is on one side of the tolerance for sure.
const WIDE: f64 = 7.0;

/// Deviations of the noise above the tolerance at which a pull is decided: of readings further off, one in three million is within it.
const DECIDED: f64 = 5.0;

/// Nodes of a table for each deviation of the noise: linear between them, with an error below 1e-5.
const NODES: f64 = 64.0;

/// Mean and variance of the label of a pull whose readings carry white noise, exactly: the label rule takes the last
/// reading within the tolerance of the command, and
///
/// ```text
/// P(T_slip = t) = p_t prod over s > t of (1 - p_s),   p_t = P(|F(t) + noise - F_des(t)| < tolerance)
/// ```
///
/// `desired_and_reading_n` are the ticks in order. `None` if no reading is ever near the command.
pub fn label_moments<'a>(
    desired_and_reading_n: impl DoubleEndedIterator<Item = (&'a f64, &'a f64)>,
    tolerance_n: f64,
    noise_n: f64,
) -> Option<(f64, f64)> {
    moments(desired_and_reading_n, tolerance_n, noise_n, |d| within(d, tolerance_n, noise_n))
}

/// The same for many pulls of one sensor: what two error functions and two exponentials say of a reading is looked up.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelRule {
    tolerance_n: f64,
    noise_n: f64,
    /// First difference from the command in the table, and nodes per newton.
    from_n: f64,
    nodes_per_n: f64,
    /// [`within`] over the size of the difference.
    table: Vec<(f64, f64, f64)>,
}

impl LabelRule {
    /// Of a tolerance and the standard deviation of a reading.
    pub fn new(tolerance_n: f64, noise_n: f64) -> Self {
        let from_n = (tolerance_n - WIDE * noise_n).max(0.0);
        let nodes_per_n = if noise_n > 0.0 { NODES / noise_n } else { 0.0 };
        let last = ((tolerance_n + WIDE * noise_n - from_n) * nodes_per_n).ceil() as usize + 1;
        let node = |k: usize| within(from_n + k as f64 / nodes_per_n, tolerance_n, noise_n);
        let table = if noise_n > 0.0 { (0..=last).map(node).collect() } else { vec![] };
        Self { tolerance_n, noise_n, from_n, nodes_per_n, table }
    }

    /// A command that is so much above the reading decides: the label cannot change any more.
    pub fn decided_n(&self) -> f64 {
        self.tolerance_n + DECIDED * self.noise_n
    }

    /// Mean and variance of the label: [`label_moments`].
    pub fn moments<'a>(
        &self,
        desired_and_reading_n: impl DoubleEndedIterator<Item = (&'a f64, &'a f64)>,
    ) -> Option<(f64, f64)> {
        moments(desired_and_reading_n, self.tolerance_n, self.noise_n, |d| {
            let x = (d.abs() - self.from_n) * self.nodes_per_n;
            let (i, w) = (x as usize, x.fract());
            let (a, b) = (self.table[i], self.table[i + 1]);
            let mix = |a: f64, b: f64| a + w * (b - a);
            (mix(a.0, b.0), mix(a.1, b.1).copysign(-d), mix(a.2, b.2))
        })
    }
}

#[inline]
fn moments<'a>(
    desired_and_reading_n: impl DoubleEndedIterator<Item = (&'a f64, &'a f64)>,
    tolerance_n: f64,
    noise_n: f64,
    within: impl Fn(f64) -> (f64, f64, f64),
) -> Option<(f64, f64)> {
    let (mut alive, mut sum, mut mean, mut square) = (1.0, 0.0, 0.0, 0.0);
    let wide = WIDE * noise_n;
    for (desired, reading) in desired_and_reading_n.rev() {
        let d = reading - desired;
        if d.abs() >= tolerance_n + wide {
            continue;
        }
        let (p, value, var) = if d.abs() < tolerance_n - wide || noise_n == 0.0 {
            (1.0, *reading, noise_n * noise_n)
        } else {
            let (p, shift, var) = within(d);
            (p, reading + noise_n * shift, noise_n * noise_n * var)
        };
        let share = alive * p;
        sum += share;
        mean += share * value;
        square += share * (value * value + var);
        alive *= 1.0 - p;
        if alive < 1e-5 {
            break;
        }
    }
    if sum < 1e-3 {
        return None;
    }
    let mean = mean / sum;
    Some((mean, (square / sum - mean * mean).max(0.0)))
}

/// Probability that a reading is within the tolerance, and mean and variance of the noise of those that are, in its deviations.
fn within(difference_n: f64, tolerance_n: f64, noise_n: f64) -> (f64, f64, f64) {
    let (a, b) = ((-tolerance_n - difference_n) / noise_n, (tolerance_n - difference_n) / noise_n);
    let p = normal_cdf(b) - normal_cdf(a);
    if p < 1e-12 {
        return (0.0, 0.0, 0.0);
    }
    let (fa, fb) = (normal_pdf(a), normal_pdf(b));
    let shift = (fa - fb) / p;
    let var = (1.0 + (a * fa - b * fb) / p - shift * shift).max(0.0);
    (p, shift, var)
}

fn normal_pdf(x: f64) -> f64 {
    const ROOT: f64 = 0.398_942_280_401_432_7;
    ROOT * libm::exp(-0.5 * x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase and readings that follow it, stay behind and fall off it, under noise that is small and large beside the tolerance.
    #[test]
    fn what_is_looked_up_is_what_is_worked_out() {
        let desired: Vec<f64> = (0..900).map(|i| 0.7 * f64::from(1 + i / 52)).collect();
        for noise_n in [0.0, 0.03, 0.2, 0.9, 2.0] {
            let rule = LabelRule::new(3.0, noise_n);
            for slip in [150, 500, 899] {
                for left in [0.5, 0.8, 0.97] {
                    let held = |i: i32| 0.7 * f64::from(i.min(slip)) / 52.0;
                    let reading: Vec<f64> =
                        (0..900).map(|i| if i < slip { held(i) } else { left * held(slip) }).collect();
                    let ticks = || desired.iter().zip(&reading);
                    let exact = label_moments(ticks(), 3.0, noise_n).unwrap();
                    let looked_up = rule.moments(ticks()).unwrap();
                    assert!(
                        (exact.0 - looked_up.0).abs() < 1e-4 * (1.0 + noise_n),
                        "{noise_n} {slip} {left}: {exact:?} {looked_up:?}"
                    );
                    assert!(
                        (exact.1 - looked_up.1).abs() < 1e-4 + 1e-3 * exact.1,
                        "{noise_n}: {exact:?} {looked_up:?}"
                    );
                }
            }
        }
    }
}
