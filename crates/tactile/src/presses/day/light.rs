//! Another light: each colour of today as a mixture of the colours of the sensor file, with a smooth gain over the frame.
//!
//! `today_c = sum_d m_cd before_d + (f_c1 u + f_c2 v + f_c3 u^2 + f_c4 u v + f_c5 v^2) before_c`. Light adds up, so what the lights do to
//! the frame at rest they do to the change of a contact. That is linear in the eight numbers of a colour, and a fit follows from
//! sums over pixels. u and v are those of the colours of a sensor file.

use super::ZONE_COUNT;
use super::taken::{ROUNDING, Taken};
use crate::grid::Plane;
use nalgebra::{Cholesky, SMatrix, SVector};

/// Terms of the gain over the frame: `u, v, u^2, u v, v^2`.
pub(super) const FIELD: usize = 5;

/// Numbers of a colour.
const NUMBERS: usize = 3 + FIELD;

/// Rounds in which each zone of each press comes to count by what the fit leaves in it.
const ROUNDS: usize = 6;

/// Standard deviation of a number before anything was seen. A frame of one even colour leaves its mixture open.
const PRIOR_SD: f64 = 0.3;

/// What became of the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Red, green and blue of today from those of the sensor file.
    pub mixture: [[f64; 3]; 3],
    /// Gain of each colour over the frame: terms `u, v, u^2, u v, v^2`, -1 to 1 along the width.
    pub field: [[f64; FIELD]; 3],
}

impl Light {
    /// No change.
    pub const SAME: Self =
        Self { mixture: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], field: [[0.0; FIELD]; 3] };

    fn numbers(&self, c: usize) -> SVector<f64, NUMBERS> {
        SVector::from_fn(|i, _| if i < 3 { self.mixture[c][i] } else { self.field[c][i - 3] })
    }

    /// The terms of a place.
    pub(super) fn terms(u: f64, v: f64) -> [f64; FIELD] {
        [u, v, u * u, u * v, v * v]
    }

    /// Planes of red, green and blue under this light.
    pub(super) fn on(&self, planes: [&[f32]; 3], width: usize) -> [Vec<f32>; 3] {
        let place = place(width, planes[0].len() / width.max(1));
        [0, 1, 2].map(|c| {
            let level = |p: usize| {
                let mixed: f64 = (0..3).map(|d| self.mixture[c][d] * f64::from(planes[d][p])).sum();
                let [u, v] = place(p);
                let gain: f64 = Self::terms(u, v).iter().zip(&self.field[c]).map(|(t, f)| t * f).sum();
                (mixed + gain * f64::from(planes[c][p])) as f32
            };
            (0..planes[0].len()).map(level).collect()
        })
    }
}

/// Where a pixel lies, as the colours of a sensor file have it.
pub(super) fn place(width: usize, height: usize) -> impl Fn(usize) -> [f64; 2] {
    let unit = 2.0 / width as f64;
    let at = move |i: usize, n: usize| (i as f64 - (n as f64 - 1.0) / 2.0) * unit;
    move |p: usize| [at(p % width, width), at(p / width, height)]
}

/// Sums over the pixels of a zone, for one colour.
#[derive(Clone)]
struct Sums {
    products: SMatrix<f64, NUMBERS, NUMBERS>,
    targets: SVector<f64, NUMBERS>,
    energy: f64,
}

/// Sums of one press by zone and colour, with the number of pixels.
pub(super) struct PressSums(Vec<([Sums; 3], usize)>);

impl PressSums {
    /// Of a press and of what the sensor file says of it.
    pub(super) fn of(taken: &Taken, rest: &[Vec<f32>; 3], change: &[Plane; 3]) -> Self {
        let zero = || Sums { products: SMatrix::zeros(), targets: SVector::zeros(), energy: 0.0 };
        let mut zones: Vec<([Sums; 3], usize)> =
            (0..ZONE_COUNT).map(|_| ([zero(), zero(), zero()], 0)).collect();
        let place = place(taken.width, taken.zones.len() / taken.width);
        for (p, zone) in taken.zones.iter().enumerate() {
            let before = [0, 1, 2].map(|c| f64::from(rest[c][p] + change[c].values[p]).clamp(0.0, 255.0));
            let [u, v] = place(p);
            let terms = Light::terms(u, v);
            let (sums, count) = &mut zones[*zone as usize];
            *count += 1;
            for (c, sums) in sums.iter_mut().enumerate() {
                let mut inputs = [before[0], before[1], before[2], 0.0, 0.0, 0.0, 0.0, 0.0];
                inputs[3..].iter_mut().zip(terms).for_each(|(input, term)| *input = term * before[c]);
                let target = f64::from(taken.measured[c][p]);
                for j in 0..NUMBERS {
                    for i in j..NUMBERS {
                        sums.products[(i, j)] += inputs[i] * inputs[j];
                    }
                    sums.targets[j] += inputs[j] * target;
                }
                sums.energy += target * target;
            }
        }
        for (sums, _) in &mut zones {
            for s in sums {
                for j in 0..NUMBERS {
                    for i in 0..j {
                        s.products[(i, j)] = s.products[(j, i)];
                    }
                }
            }
        }
        Self(zones)
    }
}

/// The light under which some presses were taken: the least sum of the logarithms of the residual in each zone of each press.
pub(super) fn fit<'a>(presses: impl Iterator<Item = &'a PressSums> + Clone) -> Light {
    let mut light = Light::SAME;
    for _ in 0..ROUNDS {
        let mut next = light;
        let prior = 1.0 / (PRIOR_SD * PRIOR_SD);
        for c in 0..3 {
            let same = Light::SAME.numbers(c);
            let mut products = SMatrix::<f64, NUMBERS, NUMBERS>::identity() * prior;
            let mut targets = same * prior;
            for (zone, count) in presses.clone().flat_map(|press| &press.0).filter(|(_, count)| *count > 0) {
                let left: f64 = (0..3).map(|c| left(&zone[c], &light.numbers(c))).sum();
                let weight = 1.0 / (left / (3 * count) as f64 + ROUNDING) / *count as f64;
                products += zone[c].products * weight;
                targets += zone[c].targets * weight;
            }
            let Some(solved) = Cholesky::new(products).map(|cholesky| cholesky.solve(&targets)) else {
                return light;
            };
            next.mixture[c] = [solved[0], solved[1], solved[2]];
            next.field[c] = [solved[3], solved[4], solved[5], solved[6], solved[7]];
        }
        light = next;
    }
    light
}

/// Squares that numbers leave in a zone. Plain loops: a matrix product of the library sums in an order that depends on the processor.
fn left(sums: &Sums, numbers: &SVector<f64, NUMBERS>) -> f64 {
    let mut left = sums.energy;
    for i in 0..NUMBERS {
        let product: f64 = (0..NUMBERS).map(|j| sums.products[(i, j)] * numbers[j]).sum();
        left += numbers[i] * (product - 2.0 * sums.targets[i]);
    }
    left.max(0.0)
}
