//! Intervals of what a calibration fits.
//!
//! Around the fit the likelihood is normal in the parameters, but some of them end: a kinetic ratio at 1, lag and dead time at
//! 0. A parameter that ends has the interval of Feldman and Cousins; any other the inverted likelihood ratio, with the
//! parameters that end inside their bounds (profile likelihood).

use super::fitting::Fitted;
use crate::bounded::interval90;
use crate::draws::Draws;
use crate::grouped::t_quantile_95;
use nalgebra::{DMatrix, DVector};

/// A fit as a normal likelihood inside bounds.
pub struct NormalFit {
    /// The best values, as if nothing ended.
    free: DVector<f64>,
    fitted: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Parameters that end: place and bounds.
    ends: Vec<(usize, (f64, f64))>,
    freedom: f64,
}

/// Standard deviations of what is assumed of the kinetic ratio that its range has to either side: nine of ten values are inside.
const RANGE: f64 = 1.3;

/// Standard deviation of a kinetic ratio of which nothing is known.
const WIDE: f64 = 0.5;

/// Draws that may lie beyond an end before one is put onto it.
const TRIES: usize = 4000;

/// Bounds of the parameters that end.
fn bounds(name: &str) -> Option<(f64, f64)> {
    match name {
        "kinetic_ratio" => Some((0.3, 1.0)),
        "robot.lag_s" => Some((0.0, 1.0)),
        "robot.dead_time_s" => Some((0.0, 0.5)),
        _ => None,
    }
}

impl NormalFit {
    /// Of a fit to so many pulls of so many parts. `assumed` is the kinetic ratio that is taken for granted where no trace shows it,
    /// with its standard deviation.
    pub fn new(fitted: &Fitted, pulls: usize, parts: usize, assumed: Option<(f64, f64)>) -> Self {
        let n = fitted.values.len();
        let ratio = fitted.names.iter().position(|name| name == "kinetic_ratio");
        let mut known = fitted.information.clone();
        // A parameter that was held has no say, and a curve without a name stays as it is written.
        let stays = |&i: &usize| fitted.information[(i, i)] <= 0.0 || fitted.names[i].starts_with("curve.");
        for i in (0..n).filter(stays) {
            known[(i, i)] = 1e30;
        }
        let mut free = fitted.beyond.clone();
        if let (Some(_), Some(ratio)) = (assumed, ratio) {
            // What is assumed is no measurement but a range, in which no value is better than another; and what labels say of the
            // ratio beside its product with mu hangs on their branch, which is no matter of slopes.
            let others = known.clone().remove_row(ratio).remove_column(ratio);
            let cross = known.column(ratio).clone_owned().remove_row(ratio);
            if let Some(others) = others.cholesky() {
                known[(ratio, ratio)] = cross.dot(&others.solve(&cross)) + WIDE.powi(-2);
                free.clone_from(&fitted.values);
            }
        }
        let range = assumed.map(|(mean, sd)| (mean - RANGE * sd, (mean + RANGE * sd).min(1.0)));
        let covariance = known.cholesky().map_or_else(|| fitted.covariance.clone(), |c| c.inverse());
        let end = |i: usize| {
            let own = bounds(&fitted.names[i])?;
            Some((i, if Some(i) == ratio { range.unwrap_or(own) } else { own }))
        };
        let ends = (0..n).filter_map(end).collect();
        Self {
            free: DVector::from_vec(free),
            fitted: DVector::from_column_slice(&fitted.values),
            covariance,
            ends,
            freedom: pulls.saturating_sub(parts).max(2) as f64,
        }
    }

    /// Covariance of the parameters.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// Draws of the parameters: normal inside the bounds, with the scale of Student's t, `wider` times as wide. `lane` keeps the draws of
    /// several fits apart.
    pub fn draws(&self, count: usize, wider: f64, lane: u64) -> Vec<Vec<f64>> {
        let n = self.free.len();
        let Some(root) = (self.covariance.clone() * (wider * wider)).cholesky().map(|c| c.l()) else {
            return vec![self.fitted.iter().copied().collect(); count];
        };
        let mut random = Draws::new(43, lane);
        let inside = |x: &DVector<f64>| self.ends.iter().all(|(i, b)| (b.0..=b.1).contains(&x[*i]));
        let mut draw = || {
            // A chi-squared variable over its degrees of freedom (Wilson and Hilferty 1931).
            let few = 2.0 / (9.0 * self.freedom);
            let chi2 = (1.0 - few + random.normal() * few.sqrt()).max(0.05).powi(3);
            &self.free + &root * DVector::from_fn(n, |_, _| random.normal()) / chi2.sqrt()
        };
        (0..count)
            .map(|_| {
                let mut x = draw();
                for _ in 0..TRIES {
                    if inside(&x) {
                        break;
                    }
                    x = draw();
                }
                self.ends.iter().for_each(|(i, b)| x[*i] = x[*i].clamp(b.0, b.1));
                x.iter().copied().collect()
            })
            .collect()
    }

    /// 90 % interval of a parameter.
    pub fn of_parameter(&self, place: usize) -> (f64, f64) {
        if let Some((_, bounds)) = self.ends.iter().find(|(i, _)| *i == place) {
            let sd = self.covariance[(place, place)].max(0.0).sqrt();
            return interval90(self.free[place], sd, *bounds, self.freedom);
        }
        let mut gradient = vec![0.0; self.free.len()];
        gradient[place] = 1.0;
        self.of(self.fitted[place], &gradient)
    }

    /// 90 % interval of a quantity with this value at the fit and this gradient.
    pub fn of(&self, value: f64, gradient: &[f64]) -> (f64, f64) {
        let slope = DVector::from_column_slice(gradient);
        let centre = value + slope.dot(&(&self.free - &self.fitted));
        let along = &self.covariance * &slope;
        let variance = slope.dot(&along).max(1e-300);
        let ends: Vec<usize> = self.ends.iter().map(|(i, _)| *i).collect();
        let m = ends.len();
        let own = DMatrix::from_fn(m, m, |i, j| self.covariance[(ends[i], ends[j])]);
        let cross = DVector::from_fn(m, |i, _| along[ends[i]]);
        let mean = DVector::from_fn(m, |i, _| self.free[ends[i]]);
        let tiny = DMatrix::from_fn(m, m, |i, j| if i == j { 1e-12 * own[(i, i)] + 1e-300 } else { 0.0 });
        let given = &own - &cross * cross.transpose() / variance + &tiny;
        let (Some(sharp), Some(plain)) = (given.cholesky(), (&own + &tiny).cholesky()) else {
            let half = t_quantile_95(self.freedom) * variance.sqrt();
            return (centre - half, centre + half);
        };
        let (sharp, plain) = (sharp.inverse(), plain.inverse());
        let (least, best) = self.nearest(&plain, &mean);
        let start = centre + (cross.transpose() * &plain * (&best - &mean))[0];
        let cost = |x: f64| {
            let moved = &mean + &cross * ((x - centre) / variance);
            (x - centre) * (x - centre) / variance + self.nearest(&sharp, &moved).0 - least
        };
        let critical = t_quantile_95(self.freedom).powi(2);
        let end = |sign: f64| {
            let (mut inside, mut outside) = (0.0, 12.0 * variance.sqrt());
            for _ in 0..50 {
                let middle = 0.5 * (inside + outside);
                if cost(start + sign * middle) <= critical {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            start + sign * inside
        };
        (end(-1.0), end(1.0))
    }

    /// The point inside the bounds that is nearest to `mean` in the metric of `sharp`, and its squared distance: one
    /// coordinate after the other.
    fn nearest(&self, sharp: &DMatrix<f64>, mean: &DVector<f64>) -> (f64, DVector<f64>) {
        let mut x = mean.clone();
        self.ends.iter().enumerate().for_each(|(i, (_, b))| x[i] = x[i].clamp(b.0, b.1));
        for _ in 0..200 {
            let mut moved = 0.0_f64;
            for (i, (_, b)) in self.ends.iter().enumerate() {
                let pull: f64 = (0..x.len()).map(|j| sharp[(i, j)] * (x[j] - mean[j])).sum();
                let next = (x[i] - pull / sharp[(i, i)]).clamp(b.0, b.1);
                moved = moved.max((next - x[i]).abs() * sharp[(i, i)].sqrt());
                x[i] = next;
            }
            if moved < 1e-9 {
                break;
            }
        }
        let d = &x - mean;
        ((d.transpose() * sharp * &d)[0], x)
    }
}
