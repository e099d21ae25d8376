//! Ridge regression on the sums of presses, and the choice of its strength.

use super::moments::{Feature, Moments, exponents};
use super::samples::INPUTS;
use crate::colour::regressor::{AROUND_FIELD, AROUND_FITTED, NEAR, NEAR_FIELD, SURROUNDINGS};
use nalgebra::{Cholesky, DMatrix};

/// How freely the colours may vary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothness {
    /// Ridge, relative to the mean square of each feature.
    pub ridge: f64,
    /// Factor on the ridge for each degree by which a field varies over the image.
    pub stiffness: f64,
}

impl Smoothness {
    /// Where there is no time to choose.
    pub(super) const USUAL: Self = Self { ridge: 1e-3, stiffness: 10.0 };
}

/// Strengths that are tried, from stiff to free.
const RIDGES: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
const STIFFNESSES: [f64; 3] = [100.0, 10.0, 1.0];

fn features() -> Vec<Feature> {
    let fields = |input: usize| exponents(if input < NEAR { NEAR_FIELD } else { AROUND_FIELD });
    (0..INPUTS).flat_map(|input| fields(input).map(move |e| (input, e))).collect()
}

/// Coefficients of a fit.
pub(super) struct Solution {
    features: Vec<Feature>,
    coefficients: DMatrix<f64>,
}

/// The coefficients with the least squared error plus ridge; `None` if the sums hold no information.
pub(super) fn solve(sums: &Moments, smoothness: &Smoothness) -> Option<Solution> {
    let features = features();
    let weight = sums.energy_and_weight().1;
    let scale: Vec<f64> = features.iter().map(|&f| (sums.product(f, f) / weight).max(1e-18).sqrt()).collect();
    let n = features.len();
    let mut gram = gram(sums, &features);
    for (j, mut column) in gram.column_iter_mut().enumerate() {
        for (i, value) in column.iter_mut().enumerate() {
            *value /= weight * scale[i] * scale[j];
        }
        let (i, k) = features[j].1;
        column[j] += smoothness.ridge * libm::pow(smoothness.stiffness, (i + k) as f64);
    }
    let right = DMatrix::from_fn(n, 3, |i, c| sums.target(c, features[i]) / (weight * scale[i]));
    let mut coefficients = Cholesky::new(gram)?.solve(&right);
    for (i, mut row) in coefficients.row_iter_mut().enumerate() {
        row /= scale[i];
    }
    Some(Solution { features, coefficients })
}

fn gram(sums: &Moments, features: &[Feature]) -> DMatrix<f64> {
    let n = features.len();
    let mut gram = DMatrix::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let value = sums.product(features[i], features[j]);
            gram[(i, j)] = value;
            gram[(j, i)] = value;
        }
    }
    gram
}

impl Solution {
    /// Mean squared error over the three channels on the sums of other presses.
    pub(super) fn error_on(&self, sums: &Moments) -> f64 {
        let gram = gram(sums, &self.features);
        let (energy, weight) = sums.energy_and_weight();
        let mut error = energy;
        // Plain loops: a matrix product of the library sums in an order that depends on the processor.
        for c in 0..3 {
            for (i, &feature) in self.features.iter().enumerate() {
                let w = self.coefficients[(i, c)];
                let product: f64 =
                    (0..self.features.len()).map(|j| gram[(i, j)] * self.coefficients[(j, c)]).sum();
                error += w * (product - 2.0 * sums.target(c, feature));
            }
        }
        error / (3.0 * weight)
    }

    /// Coefficients in the order of a sensor file: channel, term or feature, monomial. Of the features of the surroundings the
    /// fitted ones alone have any.
    pub(super) fn near_and_around(&self) -> (Vec<f32>, Vec<f32>) {
        let mut near = vec![0.0; 3 * NEAR * NEAR_FIELD];
        let mut around = vec![0.0; 3 * SURROUNDINGS * AROUND_FIELD];
        for (row, &(input, (i, j))) in self.features.iter().enumerate() {
            let m = super::moments::monomial(i, j);
            for c in 0..3 {
                let value = self.coefficients[(row, c)] as f32;
                match input.checked_sub(NEAR) {
                    None => near[(c * NEAR + input) * NEAR_FIELD + m] = value,
                    Some(level) => {
                        around[(c * SURROUNDINGS + AROUND_FITTED[level]) * AROUND_FIELD + m] = value;
                    }
                }
            }
        }
        (near, around)
    }
}

/// Presses split into those that a fit sees and those that it does not, several times.
pub(super) struct Folds {
    folds: Vec<(Moments, Moments)>,
}

impl Folds {
    /// Press i is unseen in fold `i % folds`.
    pub(super) fn split(presses: &[Moments], folds: usize) -> Self {
        let folds = folds.min(presses.len()).max(2);
        let split = |fold: usize| {
            let (mut seen, mut unseen) = (Moments::zero(), Moments::zero());
            for (i, press) in presses.iter().enumerate() {
                if i % folds == fold { unseen.add(press) } else { seen.add(press) }
            }
            (seen, unseen)
        };
        Self { folds: (0..folds).map(split).collect() }
    }

    /// Mean squared error on unseen presses.
    pub(super) fn error(&self, smoothness: &Smoothness) -> f64 {
        let error = |(seen, unseen): &(Moments, Moments)| {
            solve(seen, smoothness).map_or(f64::INFINITY, |solution| solution.error_on(unseen))
        };
        self.folds.iter().map(error).sum::<f64>() / self.folds.len() as f64
    }

    /// A ridge for fields of the usual stiffness, then a stiffness for that ridge: each time the stiffest whose error
    /// is within one part in a hundred of the least.
    pub(super) fn choose(&self) -> Smoothness {
        let pick = |tried: &[Smoothness]| {
            let errors: Vec<f64> = tried.iter().map(|s| self.error(s)).collect();
            let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
            let first = errors.iter().position(|&error| error <= 1.01 * least);
            first.map_or(Smoothness::USUAL, |i| tried[i])
        };
        let best = pick(&RIDGES.map(|ridge| Smoothness { ridge, ..Smoothness::USUAL }));
        pick(&STIFFNESSES.map(|stiffness| Smoothness { stiffness, ..best }))
    }
}
