//! Least squares over groups of observations that err together: the presses of a sensor, say.
//!
//! The pixels of one image are no independent observations, so nothing here counts them. A group enters by its moments;
//! what is held out, resampled and averaged over is the group.

use crate::least_squares::FreeParameter;
pub use gripgen_twin::values::t_quantile_95;
use nalgebra::{DMatrix, DVector};

/// What one group says about parameters near a point: with residuals r (predicted minus measured) and derivatives J
/// there, the cost after a step d is `cost + 2 gradient d + d normal d`.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupMoments {
    /// r^T r.
    pub cost: f64,
    /// J^T r.
    pub gradient: DVector<f64>,
    /// J^T J.
    pub normal: DMatrix<f64>,
}

impl GroupMoments {
    /// No observation of `n` parameters.
    pub fn zero(n: usize) -> Self {
        Self { cost: 0.0, gradient: DVector::zeros(n), normal: DMatrix::zeros(n, n) }
    }

    /// Adds a residual, its derivatives and its weight.
    pub fn add(&mut self, residual: f64, derivatives: &[f64], weight: f64) {
        self.cost += weight * residual * residual;
        for (i, di) in derivatives.iter().enumerate() {
            if *di == 0.0 {
                continue;
            }
            let scaled = weight * di;
            self.gradient[i] += scaled * residual;
            for (j, dj) in derivatives[..=i].iter().enumerate() {
                self.normal[(i, j)] += scaled * dj;
            }
        }
    }

    /// Fills the half of `normal` that [`GroupMoments::add`] leaves out.
    pub fn finish(&mut self) {
        self.normal.fill_upper_triangle_with_lower_triangle();
    }

    /// The cost after a step of the parameters, to second order.
    pub fn cost_after(&self, step: &DVector<f64>) -> f64 {
        (self.cost + 2.0 * self.gradient.dot(step) + step.dot(&(&self.normal * step))).max(0.0)
    }
}

/// How groups are predicted.
pub trait GroupedModel {
    /// The moments of each group at some values of the parameters.
    fn moments(&self, values: &[f64]) -> Vec<GroupMoments>;
    /// The cost of each group alone.
    fn costs(&self, values: &[f64]) -> Vec<f64>;
}

/// Where a grouped fit ended.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupedFit {
    /// Values in the order of the parameters.
    pub values: Vec<f64>,
    /// Moments of each group there.
    pub moments: Vec<GroupMoments>,
}

/// The step that minimises the weighted cost, kept inside the bounds; parameters in units of their scales get a
/// faint pull to where they are, so that what the data leave open stays.
pub fn grouped_step(
    parameters: &[FreeParameter],
    values: &[f64],
    moments: &[GroupMoments],
    weights: &[f64],
) -> DVector<f64> {
    let n = parameters.len();
    let mut normal = DMatrix::zeros(n, n);
    let mut gradient = DVector::zeros(n);
    for (group, &w) in moments.iter().zip(weights) {
        if w > 0.0 {
            normal += &group.normal * w;
            gradient += &group.gradient * w;
        }
    }
    let largest = (0..n).map(|i| normal[(i, i)] * parameters[i].scale.powi(2)).fold(0.0, f64::max);
    for i in 0..n {
        normal[(i, i)] += (1e-7 * largest).max(1e-300) / parameters[i].scale.powi(2);
    }
    let mut held = vec![false; n];
    let mut step = DVector::zeros(n);
    // Parameters that leave their bounds are set on them, one round after another, and the rest is solved again.
    for _ in 0..=n {
        let (mut a, mut b) = (normal.clone(), -gradient.clone());
        for i in (0..n).filter(|&i| held[i]) {
            for j in (0..n).filter(|&j| !held[j]) {
                b[j] -= normal[(j, i)] * step[i];
            }
        }
        for i in (0..n).filter(|&i| held[i]) {
            a.row_mut(i).fill(0.0);
            a.column_mut(i).fill(0.0);
            a[(i, i)] = 1.0;
            b[i] = step[i];
        }
        let Some(solved) = a.cholesky().map(|c| c.solve(&b)) else { return DVector::zeros(n) };
        step = solved;
        let mut more = false;
        for i in 0..n {
            let (low, high) = parameters[i].bounds;
            let kept = (values[i] + step[i]).clamp(low, high) - values[i];
            if !held[i] && (kept - step[i]).abs() > 1e-12 * parameters[i].scale {
                (step[i], held[i], more) = (kept, true, true);
            }
        }
        if !more {
            break;
        }
    }
    step
}

/// Gauss-Newton with halved steps over groups: at most `max_steps` of them.
pub fn fit_grouped(
    parameters: &[FreeParameter],
    max_steps: usize,
    weights: &[f64],
    model: &impl GroupedModel,
) -> GroupedFit {
    let total = |costs: &[f64]| costs.iter().zip(weights).map(|(c, w)| c * w).sum::<f64>();
    let mut values: Vec<f64> = parameters.iter().map(|p| p.start.clamp(p.bounds.0, p.bounds.1)).collect();
    let mut moments = model.moments(&values);
    for _ in 0..max_steps {
        let now: f64 = total(&moments.iter().map(|m| m.cost).collect::<Vec<_>>());
        let step = grouped_step(parameters, &values, &moments, weights);
        let mut length = 1.0;
        let found = loop {
            let trial: Vec<f64> = values.iter().zip(step.iter()).map(|(v, s)| v + length * s).collect();
            let cost = total(&model.costs(&trial));
            if cost.is_finite() && cost < now {
                break Some((trial, cost));
            }
            length *= 0.4;
            if length < 0.02 {
                break None;
            }
        };
        let Some((trial, cost)) = found else { break };
        values = trial;
        moments = model.moments(&values);
        if now - cost < 1e-3 * now {
            break;
        }
    }
    GroupedFit { values, moments }
}

/// The step that each fold is predicted with: solved from the groups outside it. `fold_of` tells the fold of a group.
pub fn fold_steps(
    parameters: &[FreeParameter],
    fit: &GroupedFit,
    weights: &[f64],
    fold_of: &[usize],
) -> Vec<DVector<f64>> {
    let folds = fold_of.iter().max().map_or(0, |m| m + 1);
    (0..folds)
        .map(|fold| {
            let kept: Vec<f64> =
                weights.iter().zip(fold_of).map(|(w, f)| if *f == fold { 0.0 } else { *w }).collect();
            grouped_step(parameters, &fit.values, &fit.moments, &kept)
        })
        .collect()
}

/// Cost of each group under the step of its fold.
pub fn held_out_costs(
    parameters: &[FreeParameter],
    fit: &GroupedFit,
    weights: &[f64],
    fold_of: &[usize],
) -> Vec<f64> {
    let steps = fold_steps(parameters, fit, weights, fold_of);
    fit.moments.iter().zip(fold_of).map(|(group, &fold)| group.cost_after(&steps[fold])).collect()
}

/// 90 % intervals of the values from the scatter of the groups' gradients (sandwich estimator: White 1980, by cluster:
/// Liang and Zeger 1986; n / (n - 1) and Student's t for few groups).
pub fn grouped_intervals(parameters: &[FreeParameter], fit: &GroupedFit, weights: &[f64]) -> Vec<(f64, f64)> {
    let k = parameters.len();
    let n = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let (mut normal, mut meat) = (DMatrix::zeros(k, k), DMatrix::zeros(k, k));
    for (group, &w) in fit.moments.iter().zip(weights) {
        normal += &group.normal * w;
        // A group pulls the fit towards itself: its residuals are smaller than those it would have held out.
        meat += &group.gradient * group.gradient.transpose() * (w * w);
    }
    let largest = (0..k).map(|i| normal[(i, i)] * parameters[i].scale.powi(2)).fold(0.0, f64::max);
    for i in 0..k {
        normal[(i, i)] += (1e-9 * largest).max(1e-300) / parameters[i].scale.powi(2);
    }
    let Some(inverse) = normal.try_inverse() else {
        return parameters.iter().map(|p| p.bounds).collect();
    };
    let covariance = &inverse * meat * &inverse * (n / (n - 1.0).max(1.0));
    let t = t_quantile_95(n - 1.0);
    (0..k)
        .map(|i| {
            let half = t * covariance[(i, i)].max(0.0).sqrt();
            let (low, high) = parameters[i].bounds;
            ((fit.values[i] - half).max(low), (fit.values[i] + half).min(high))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Lines(Vec<Vec<(f64, f64)>>);

    impl GroupedModel for Lines {
        fn moments(&self, values: &[f64]) -> Vec<GroupMoments> {
            let group = |points: &Vec<(f64, f64)>| {
                let mut m = GroupMoments::zero(2);
                points.iter().for_each(|(x, y)| m.add(values[0] + values[1] * x - y, &[1.0, *x], 1.0));
                m.finish();
                m
            };
            self.0.iter().map(group).collect()
        }
        fn costs(&self, values: &[f64]) -> Vec<f64> {
            self.moments(values).iter().map(|m| m.cost).collect()
        }
    }

    fn free(bounds: (f64, f64)) -> FreeParameter {
        FreeParameter { name: "p".into(), start: 0.0, bounds, scale: 1.0 }
    }

    /// Groups whose points all err alike: the interval is that of the groups' means, however many points each has.
    #[test]
    fn intervals_count_groups_and_not_points() {
        let errors = [0.3, -0.5, 0.1, 0.7, -0.2, -0.4, 0.25, -0.25];
        for points in [1, 50] {
            let groups = errors.map(|e| vec![(0.0, 2.0 + e); points]).to_vec();
            let parameters = [free((-9.0, 9.0)), free((-9.0, 9.0))];
            let model = Lines(groups);
            let fit = fit_grouped(&parameters, 10, &[1.0; 8], &model);
            let (low, high) = grouped_intervals(&parameters, &fit, &[1.0; 8])[0];
            // Standard deviation over 7 degrees of freedom, over the root of 8, times t = 1.895.
            let sd = (errors.iter().map(|e| e * e).sum::<f64>() / 7.0).sqrt();
            let half = 1.8946 * sd / 8f64.sqrt();
            assert!((fit.values[0] - 2.0).abs() < 1e-3);
            assert!(((high - low) / 2.0 / half - 1.0).abs() < 0.01, "{points}: {low} {high}, {half}");
        }
    }

    /// A mean that is predicted from the others: each is off by n / (n - 1) of its deviation.
    #[test]
    fn held_out_costs_are_those_of_the_others() {
        let values = [1.0, 2.0, 4.0, 9.0];
        let model = Lines(values.map(|v| vec![(0.0, v)]).to_vec());
        let parameters = [free((-99.0, 99.0)), free((-99.0, 99.0))];
        let fit = fit_grouped(&parameters, 10, &[1.0; 4], &model);
        let costs = held_out_costs(&parameters, &fit, &[1.0; 4], &[0, 1, 2, 3]);
        for (cost, v) in costs.iter().zip(values) {
            let exact = ((v - 4.0) * 4.0 / 3.0f64).powi(2);
            assert!((cost - exact).abs() < 1e-3 * (1.0 + exact), "{cost} {exact}");
        }
    }

    #[test]
    fn steps_stop_at_the_bounds_and_the_rest_follows() {
        let model = Lines(vec![vec![(0.0, 3.0), (1.0, 5.0)], vec![(2.0, 7.0)]]);
        let parameters = [free((-9.0, 9.0)), free((-1.0, 1.0))];
        let fit = fit_grouped(&parameters, 10, &[1.0; 2], &model);
        assert!((fit.values[1] - 1.0).abs() < 1e-9);
        assert!((fit.values[0] - 4.0).abs() < 1e-3, "the mean of what a slope of 1 leaves: {:?}", fit.values);
    }

    #[test]
    fn quantiles_are_those_of_the_table() {
        for (v, t) in [(2.0, 2.920), (5.0, 2.015), (11.0, 1.796), (35.0, 1.690)] {
            assert!((t_quantile_95(v) / t - 1.0).abs() < 0.02, "{v}: {}", t_quantile_95(v));
        }
    }
}
