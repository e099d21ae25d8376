//! Weighted sums over pixels from which any fit of the regressor follows.
//!
//! A feature is an input times a monomial of the position, so a product of two features is a product of two inputs
//! times a monomial of twice the degree. Summing those (496 pairs x 28 monomials) is a third of the work of summing
//! the products of all features, and serves fields of every degree.

use super::samples::{INPUTS, Samples};
use crate::colour::regressor::NEAR_FIELD;

/// Monomials `u^i v^j` of degree at most 6.
const MONOMIALS: usize = 28;

/// Pixels summed in f32 before they join the f64 sums.
const CHUNK: usize = 256;

/// Sums of one press, or of several.
#[derive(Clone)]
pub(super) struct Moments {
    /// For each pair of inputs a <= b the sums with each monomial.
    pairs: Vec<[f64; MONOMIALS]>,
    /// For each channel and input the sums of target times input times monomial.
    targets: Vec<[f64; NEAR_FIELD]>,
    /// Sum of the squared targets.
    energy: f64,
    /// Sum of the weights.
    weight: f64,
}

/// Place of the pair a <= b.
fn pair(a: usize, b: usize) -> usize {
    let (a, b) = (a.min(b), a.max(b));
    a * INPUTS - a * (a + 1) / 2 + b
}

/// Place of `u^i v^j` in the order `1, u, v, u^2, u v, v^2, ...`.
pub(super) fn monomial(i: usize, j: usize) -> usize {
    (i + j) * (i + j + 1) / 2 + j
}

/// Exponents (i, j) in that order.
pub(super) fn exponents(count: usize) -> impl Iterator<Item = (usize, usize)> + Clone {
    (0..).flat_map(|degree| (0..=degree).map(move |j| (degree - j, j))).take(count)
}

fn monomials<const N: usize>([u, v]: [f32; 2], weight: f32) -> [f32; N] {
    let mut powers = [[1.0f32; 2]; 7];
    for d in 1..7 {
        powers[d] = [powers[d - 1][0] * u, powers[d - 1][1] * v];
    }
    let mut out = [0.0; N];
    for (value, (i, j)) in out.iter_mut().zip(exponents(N)) {
        *value = weight * powers[i][0] * powers[j][1];
    }
    out
}

impl Moments {
    /// No pixels.
    pub(super) fn zero() -> Self {
        Self {
            pairs: vec![[0.0; MONOMIALS]; INPUTS * (INPUTS + 1) / 2],
            targets: vec![[0.0; NEAR_FIELD]; 3 * INPUTS],
            energy: 0.0,
            weight: 0.0,
        }
    }

    /// The sums of one press that do not depend on its colours.
    pub(super) fn of_inputs(samples: &Samples) -> Self {
        let mut sums = Self::zero();
        let mut chunk = vec![[0.0f32; MONOMIALS]; sums.pairs.len()];
        let pixels: Vec<usize> = (0..samples.pixels.len()).collect();
        for some in pixels.chunks(CHUNK) {
            chunk.fill([0.0; MONOMIALS]);
            // Two pixels share a pass over the sums.
            for two in some.chunks(2) {
                let (p, q) = (two[0], two[two.len() - 1]);
                let wp = monomials::<MONOMIALS>(samples.places[p], samples.weights[p]);
                let wq =
                    monomials::<MONOMIALS>(samples.places[q], if p == q { 0.0 } else { samples.weights[q] });
                let (zp, zq) =
                    (&samples.inputs[p * INPUTS..][..INPUTS], &samples.inputs[q * INPUTS..][..INPUTS]);
                let mut at = 0;
                for a in 0..INPUTS {
                    for b in a..INPUTS {
                        let (x, y) = (zp[a] * zp[b], zq[a] * zq[b]);
                        for (m, sum) in chunk[at].iter_mut().enumerate() {
                            *sum += x * wp[m] + y * wq[m];
                        }
                        at += 1;
                    }
                }
            }
            for (sums, some) in sums.pairs.iter_mut().zip(&chunk) {
                sums.iter_mut().zip(some).for_each(|(s, &x)| *s += f64::from(x));
            }
        }
        sums.weight = samples.weights.iter().map(|&w| f64::from(w)).sum();
        sums
    }

    /// Replaces the sums that depend on the colours.
    pub(super) fn set_targets(&mut self, samples: &Samples, targets: &[[f32; 3]]) {
        self.targets.fill([0.0; NEAR_FIELD]);
        self.energy = 0.0;
        for (p, target) in targets.iter().enumerate() {
            let m = monomials::<NEAR_FIELD>(samples.places[p], samples.weights[p]).map(f64::from);
            let inputs = &samples.inputs[p * INPUTS..][..INPUTS];
            for (channel, &y) in target.iter().enumerate() {
                let y = f64::from(y);
                self.energy += f64::from(samples.weights[p]) * y * y;
                for (sums, &z) in self.targets[channel * INPUTS..][..INPUTS].iter_mut().zip(inputs) {
                    let yz = y * f64::from(z);
                    sums.iter_mut().zip(m).for_each(|(s, m)| *s += yz * m);
                }
            }
        }
    }

    /// Adds the sums of another press.
    pub(super) fn add(&mut self, other: &Self) {
        for (s, o) in self.pairs.iter_mut().zip(&other.pairs) {
            s.iter_mut().zip(o).for_each(|(s, o)| *s += o);
        }
        for (s, o) in self.targets.iter_mut().zip(&other.targets) {
            s.iter_mut().zip(o).for_each(|(s, o)| *s += o);
        }
        self.energy += other.energy;
        self.weight += other.weight;
    }

    /// Sum of the products of two features, each an input and exponents of its monomial.
    pub(super) fn product(&self, (a, (i, j)): Feature, (b, (k, l)): Feature) -> f64 {
        self.pairs[pair(a, b)][monomial(i + k, j + l)]
    }

    /// Sum of the products of a feature and the colour of a channel.
    pub(super) fn target(&self, channel: usize, (a, (i, j)): Feature) -> f64 {
        self.targets[channel * INPUTS + a][monomial(i, j)]
    }

    /// Sum of the squared colours, and of the weights.
    pub(super) fn energy_and_weight(&self) -> (f64, f64) {
        (self.energy, self.weight)
    }
}

/// An input and the exponents of u and v.
pub(super) type Feature = (usize, (usize, usize));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_features_are_sums_over_pixels() {
        let n = 301;
        let number = |i: usize| ((i * 7919 % 1000) as f32) / 500.0 - 1.0;
        let samples = Samples {
            pixels: (0..n).collect(),
            weights: (0..n).map(|i| 0.5 + number(i).abs()).collect(),
            inputs: (0..n * INPUTS).map(|i| number(3 * i + 1)).collect(),
            places: (0..n).map(|i| [number(i + 5), 0.7 * number(11 * i)]).collect(),
            steepest: 0.0,
            largest: vec![],
        };
        let targets: Vec<[f32; 3]> = (0..n).map(|i| [number(i), number(2 * i), number(5 * i)]).collect();
        let mut moments = Moments::of_inputs(&samples);
        moments.set_targets(&samples, &targets);
        let value = |p: usize, (a, (i, j)): Feature| {
            let [u, v] = samples.places[p].map(f64::from);
            f64::from(samples.inputs[p * INPUTS + a]) * u.powi(i as i32) * v.powi(j as i32)
        };
        let weight = |p: usize| f64::from(samples.weights[p]);
        for (f, g) in [((0, (0, 0)), (0, (0, 0))), ((3, (2, 1)), (17, (0, 3))), ((19, (1, 1)), (8, (2, 0)))] {
            let exact: f64 = (0..n).map(|p| weight(p) * value(p, f) * value(p, g)).sum();
            assert!((moments.product(f, g) - exact).abs() < 1e-3 * n as f64 * 1e-2);
            assert_eq!(moments.product(f, g), moments.product(g, f));
            let exact: f64 = (0..n).map(|p| weight(p) * value(p, f) * f64::from(targets[p][1])).sum();
            assert!((moments.target(1, f) - exact).abs() < 1e-6 * n as f64);
        }
    }
}
