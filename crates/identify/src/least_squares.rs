//! Bounded nonlinear least squares.

use nalgebra::{DMatrix, DVector};

/// A parameter that a fit may change.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// Name, for messages.
    pub name: String,
    /// Where the fit starts.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// A change of this size is a small one; steps of finite differences are a hundredth of it.
    pub scale: f64,
}

/// How long a fit may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Steps that are accepted or refused at most.
    pub max_steps: usize,
    /// The fit ends when a step lowers the cost by less than this part of it.
    pub min_gain: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { max_steps: 40, min_gain: 1e-6 }
    }
}

/// Where a fit ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Values in the order of the parameters.
    pub values: Vec<f64>,
    /// Sum of squares of the residuals.
    pub cost: f64,
    /// Residuals at the values.
    pub residuals: Vec<f64>,
    /// Derivatives of the residuals: rows are residuals, columns parameters.
    pub jacobian: DMatrix<f64>,
    /// Inverse of J^T J: the covariance of the values if residuals are in units of their standard deviation.
    /// Directions that the data leave open have very large variances.
    pub covariance: DMatrix<f64>,
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The residuals at the start are no numbers.
    #[error("{bad} of {all} residuals are no finite numbers at the start of the fit")]
    Start {
        /// How many.
        bad: usize,
        /// Of how many.
        all: usize,
    },
}

/// Minimises the sum of squares of `residuals(values)` inside the bounds: Levenberg-Marquardt with finite differences
/// (Marquardt 1963; damping after Nielsen 1999), steps clipped to the bounds. A trial whose residuals are not finite
/// counts as a step that is too long. Nothing is drawn: the same input gives the same output.
///
/// # Errors
///
/// Residuals that are not finite at the start.
pub fn fit(
    parameters: &[FreeParameter],
    options: FitOptions,
    mut residuals: impl FnMut(&[f64]) -> Vec<f64>,
) -> Result<Fit, FitError> {
    let n = parameters.len();
    let mut values: Vec<f64> = parameters.iter().map(|p| p.start.clamp(p.bounds.0, p.bounds.1)).collect();
    let mut r = DVector::from_vec(residuals(&values));
    let bad = r.iter().filter(|x| !x.is_finite()).count();
    if bad > 0 {
        return Err(FitError::Start { bad, all: r.len() });
    }
    let mut cost = r.norm_squared();
    let mut jacobian = derivatives(parameters, &values, &r, &mut residuals);
    let mut damping = 1e-3;
    let mut growth = 2.0;
    for _ in 0..options.max_steps {
        if n == 0 {
            break;
        }
        let normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&r);
        // A parameter at its bound that wants to go on is left out.
        let held: Vec<bool> = (0..n)
            .map(|i| {
                let (low, high) = parameters[i].bounds;
                (values[i] <= low && gradient[i] > 0.0) || (values[i] >= high && gradient[i] < 0.0)
            })
            .collect();
        let mut damped = normal.clone();
        let mut wanted = -gradient.clone();
        for i in 0..n {
            damped[(i, i)] +=
                damping * normal[(i, i)].max(1e-12 / (parameters[i].scale * parameters[i].scale));
            if held[i] {
                damped.row_mut(i).fill(0.0);
                damped.column_mut(i).fill(0.0);
                damped[(i, i)] = 1.0;
                wanted[i] = 0.0;
            }
        }
        let Some(step) = damped.clone().cholesky().map(|c| c.solve(&wanted)) else {
            damping *= 10.0;
            continue;
        };
        let trial: Vec<f64> = (0..n)
            .map(|i| (values[i] + step[i]).clamp(parameters[i].bounds.0, parameters[i].bounds.1))
            .collect();
        let moved = DVector::from_iterator(n, (0..n).map(|i| trial[i] - values[i]));
        let trial_r = DVector::from_vec(residuals(&trial));
        let trial_cost = trial_r.norm_squared();
        let predicted = -(2.0 * gradient.dot(&moved) + (&jacobian * &moved).norm_squared());
        if trial_cost.is_finite() && trial_cost < cost {
            let gain = (cost - trial_cost) / cost.max(f64::MIN_POSITIVE);
            let quality = if predicted > 0.0 { (cost - trial_cost) / predicted } else { 0.0 };
            values = trial;
            r = trial_r;
            cost = trial_cost;
            jacobian = derivatives(parameters, &values, &r, &mut residuals);
            let c = 2.0 * quality - 1.0;
            damping = (damping * (1.0 - c * c * c).max(1.0 / 3.0)).max(1e-12);
            growth = 2.0;
            if gain < options.min_gain {
                break;
            }
        } else {
            let small = moved.iter().zip(parameters).all(|(m, p)| m.abs() < 1e-9 * p.scale);
            if small || predicted.abs() < options.min_gain * 1e-3 * cost {
                break;
            }
            damping *= growth;
            growth *= 2.0;
        }
    }
    let covariance = covariance(parameters, &jacobian);
    Ok(Fit { values, cost, residuals: r.as_slice().to_vec(), jacobian, covariance })
}

/// Forward differences, backwards at an upper bound.
fn derivatives(
    parameters: &[FreeParameter],
    values: &[f64],
    r: &DVector<f64>,
    residuals: &mut impl FnMut(&[f64]) -> Vec<f64>,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(r.len(), values.len());
    let mut at = values.to_vec();
    for (i, p) in parameters.iter().enumerate() {
        let step = 0.01 * p.scale;
        let step = if values[i] + step > p.bounds.1 { -step } else { step };
        at[i] = values[i] + step;
        let moved = residuals(&at);
        for (row, (new, old)) in moved.iter().zip(r.iter()).enumerate() {
            let slope = (new - old) / step;
            jacobian[(row, i)] = if slope.is_finite() { slope } else { 0.0 };
        }
        at[i] = values[i];
    }
    jacobian
}

/// Inverse of J^T J with a floor under its eigenvalues, in units of the parameters' scales.
fn covariance(parameters: &[FreeParameter], jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let n = parameters.len();
    let scales = DVector::from_iterator(n, parameters.iter().map(|p| p.scale));
    let mut scaled = jacobian.clone();
    for i in 0..n {
        scaled.column_mut(i).scale_mut(scales[i]);
    }
    let eigen = scaled.tr_mul(&scaled).symmetric_eigen();
    let mut inverse = DMatrix::zeros(n, n);
    for k in 0..n {
        let v = eigen.eigenvectors.column(k);
        inverse += v * v.transpose() / eigen.eigenvalues[k].max(1e-9);
    }
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scales[i] * scales[j])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free(name: &str, start: f64, bounds: (f64, f64)) -> FreeParameter {
        FreeParameter { name: name.into(), start, bounds, scale: 1.0 }
    }

    /// Rosenbrock's valley (1960) has its minimum 0 at (1, 1).
    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let parameters = [free("x", -1.2, (-5.0, 5.0)), free("y", 1.0, (-5.0, 5.0))];
        let options = FitOptions { max_steps: 200, min_gain: 0.0 };
        let found = fit(&parameters, options, |v| vec![10.0 * (v[1] - v[0] * v[0]), 1.0 - v[0]]).unwrap();
        assert!((found.values[0] - 1.0).abs() < 1e-3 && (found.values[1] - 1.0).abs() < 1e-3, "{found:?}");
    }

    /// The minimum lies outside: the bound is the answer, and the other parameter is that of the bounded problem.
    #[test]
    fn bounds_hold_and_the_rest_is_still_fitted() {
        let parameters = [free("a", 0.0, (0.0, 1.0)), free("b", 0.0, (-10.0, 10.0))];
        let found = fit(&parameters, FitOptions::default(), |v| vec![v[0] - 3.0, v[0] + v[1] - 5.0]).unwrap();
        assert!((found.values[0] - 1.0).abs() < 1e-9 && (found.values[1] - 4.0).abs() < 1e-6, "{found:?}");
    }

    /// A straight line: covariance (X^T X)^-1 in closed form.
    #[test]
    fn the_covariance_of_a_line_is_that_of_the_textbook() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let parameters = [free("a", 0.0, (-10.0, 10.0)), free("b", 0.0, (-10.0, 10.0))];
        let found = fit(&parameters, FitOptions::default(), |v| {
            x.iter().map(|x| v[0] + v[1] * x - (1.0 + 2.0 * x)).collect()
        })
        .unwrap();
        assert!(
            (found.covariance[(0, 0)] - 0.7).abs() < 1e-6 && (found.covariance[(1, 1)] - 0.2).abs() < 1e-6
        );
    }

    #[test]
    fn residuals_that_are_no_numbers_are_an_error() {
        let e =
            fit(&[free("a", 0.0, (0.0, 1.0))], FitOptions::default(), |_| vec![f64::NAN, 1.0]).unwrap_err();
        assert_eq!(e.to_string(), "1 of 2 residuals are no finite numbers at the start of the fit");
    }
}
