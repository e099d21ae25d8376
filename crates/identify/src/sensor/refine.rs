//! The joint fit of the effects that were chosen, through the functions of the library, with its intervals.

use super::candidates::{Candidate, Kind, bounds, chain, size_parameter};
use super::noise::{Noise, Whitener, draw};
use super::prepare::Prepared;
use crate::draws::Draws;
use crate::grouped::t_quantile_95;
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::effects::EffectSpec;
use nalgebra::{DMatrix, DVector};

/// Simulated data sets behind an interval, where there is no formula.
const SIMULATIONS: usize = 200;

/// An effect with its values and their intervals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Refined {
    pub spec: &'static EffectSpec,
    /// In the order of the spec.
    pub values: Vec<f64>,
    /// Half lengths of the 90 % intervals; 0 for what was not fitted.
    pub half90: Vec<f64>,
}

/// The whole fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointFit {
    pub effects: Vec<Refined>,
    /// Offset and gain of each session, and half lengths of their 90 % intervals.
    pub sessions: Vec<([f64; 2], [f64; 2])>,
    /// Standard deviation of the weighed residual.
    pub size: f64,
}

/// Fits the effects together with gain and offset of all sessions. `start` are values in the order of each spec;
/// `equal_weights` says that rows are not weighed by the noise, which is then only used for the intervals.
pub(crate) fn joint_fit(
    prepared: &Prepared,
    effects: &[(&'static EffectSpec, Vec<f64>)],
    noise: Noise,
    equal_weights: bool,
) -> JointFit {
    let identity = Whitener::new(Noise::WHITE, &prepared.group_steps);
    let whitener = Whitener::new(noise, &prepared.group_steps);
    let weigher = if equal_weights { &identity } else { &whitener };
    let weighed = |mut column: Vec<f64>| {
        weigher.apply(&mut column);
        column
    };
    let y = weighed(prepared.grouped(&prepared.measured));
    let one = weighed(vec![1.0; prepared.groups.len()]);
    let sessions = ranges(prepared);
    let free: Vec<(usize, usize, FreeParameter)> = effects
        .iter()
        .enumerate()
        .flat_map(|(e, (spec, values))| free_of(e, spec, values, prepared))
        .collect();
    let parameters: Vec<FreeParameter> = free.iter().map(|f| f.2.clone()).collect();
    let at = |theta: &[f64]| -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = effects.iter().map(|e| e.1.clone()).collect();
        for ((e, p, _), value) in free.iter().zip(theta) {
            all[*e][*p] = *value;
        }
        all
    };
    let force = |theta: &[f64]| {
        let values = at(theta);
        let list: Vec<(&EffectSpec, &[f64])> =
            effects.iter().zip(&values).map(|((spec, _), v)| (*spec, v.as_slice())).collect();
        weighed(prepared.grouped(&chain(prepared, &list)))
    };
    let profile = |theta: &[f64]| profile(&y, &one, &force(theta), &sessions);
    let options = FitOptions { max_steps: 40, min_gain: 1e-7 };
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    let found =
        if parameters.is_empty() { None } else { fit(&parameters, options, |theta| profile(theta).1).ok() };
    let (theta, jacobian) = match found {
        Some(found) => (found.values, found.jacobian),
        None => (start, DMatrix::zeros(y.len(), parameters.len())),
    };
    let (baseline, residual) = profile(&theta);
    let n = y.len() as f64;
    let used = (2 * sessions.len() + theta.len()) as f64;
    let size = libm::sqrt(residual.iter().map(|r| r * r).sum::<f64>() / (n - used).max(1.0));
    let f = force(&theta);
    // How gain and offset follow the parameters of the effects.
    let follow: Vec<Vec<[f64; 2]>> = (0..theta.len())
        .map(|k| {
            let mut moved = theta.clone();
            let step = 0.01 * parameters[k].scale;
            let step = if moved[k] + step > parameters[k].bounds.1 { -step } else { step };
            moved[k] += step;
            let there = self::profile(&y, &one, &force(&moved), &sessions).0;
            there.iter().zip(&baseline).map(|(a, b)| [(a[0] - b[0]) / step, (a[1] - b[1]) / step]).collect()
        })
        .collect();
    let inverse = inverse_normal(&parameters, &jacobian);
    let spread = Spread { jacobian: &jacobian, inverse: &inverse, one: &one, force: &f, sessions: &sessions };
    let (theta_sd, base_sd) = if equal_weights {
        // Size of the slow part of the noise.
        let mut left = residual;
        whitener.apply(&mut left);
        let slow = libm::sqrt(left.iter().map(|r| r * r).sum::<f64>() / (n - used).max(1.0));
        spread.simulated(noise, slow, &prepared.group_steps, &follow)
    } else {
        spread.of_white(size, &follow)
    };
    let quantile = t_quantile_95((n - used).max(1.0));
    let refined = effects
        .iter()
        .zip(at(&theta))
        .enumerate()
        .map(|(e, ((spec, _), values))| {
            let mut half90 = vec![0.0; values.len()];
            for (k, (of, p, _)) in free.iter().enumerate() {
                if *of == e {
                    half90[*p] = quantile * theta_sd[k];
                }
            }
            Refined { spec, values, half90 }
        })
        .collect();
    let sessions =
        baseline.iter().zip(&base_sd).map(|(b, sd)| (*b, [quantile * sd[0], quantile * sd[1]])).collect();
    JointFit { effects: refined, sessions, size }
}

/// First group and group behind the last of every session.
fn ranges(prepared: &Prepared) -> Vec<(usize, usize)> {
    let of = prepared.group_session();
    (0..prepared.names.len())
        .map(|s| {
            let from = of.iter().position(|&x| x == s).unwrap_or(0);
            (from, of.iter().rposition(|&x| x == s).map_or(from, |k| k + 1))
        })
        .collect()
}

/// Parameters of an effect that are fitted.
fn free_of(
    effect: usize,
    spec: &'static EffectSpec,
    values: &[f64],
    prepared: &Prepared,
) -> Vec<(usize, usize, FreeParameter)> {
    spec.parameters
        .iter()
        .enumerate()
        .filter(|(_, p)| !spec.references.contains(&p.name))
        .map(|(k, p)| {
            let bounds = bounds(spec, k, prepared);
            let start = values[k].clamp(bounds.0, bounds.1);
            let scale = if start == 0.0 { (bounds.1 - bounds.0) * 1e-3 } else { start.abs() };
            (effect, k, FreeParameter { name: p.name.to_string(), start, bounds, scale })
        })
        .collect()
}

/// Offset and gain of each session by least squares, and what they leave.
fn profile(y: &[f64], one: &[f64], force: &[f64], sessions: &[(usize, usize)]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let mut residual = vec![0.0; y.len()];
    let baseline = sessions
        .iter()
        .map(|&(from, to)| {
            let (o, f, y) = (&one[from..to], &force[from..to], &y[from..to]);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            let (a, b, d) = (dot(o, o), dot(o, f), dot(f, f));
            let (u, v) = (dot(o, y), dot(f, y));
            let determinant = a * d - b * b;
            let [offset, gain] = if determinant > 1e-12 * a * d {
                [(d * u - b * v) / determinant, (a * v - b * u) / determinant]
            } else {
                [if a > 0.0 { u / a } else { 0.0 }, 0.0]
            };
            for i in 0..y.len() {
                residual[from + i] = y[i] - offset * o[i] - gain * f[i];
            }
            [offset, gain]
        })
        .collect();
    (baseline, residual)
}

/// Inverse of J^T J, scaled; what the data leave open gets a very large variance.
fn inverse_normal(parameters: &[FreeParameter], jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let n = parameters.len();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let normal = jacobian.tr_mul(jacobian);
    let scale: Vec<f64> =
        (0..n).map(|i| libm::sqrt(normal[(i, i)]).max(1e-30 / parameters[i].scale)).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (scale[i] * scale[j]));
    let eigen = scaled.symmetric_eigen();
    let mut inverse = DMatrix::zeros(n, n);
    for k in 0..n {
        let v = eigen.eigenvectors.column(k);
        inverse += v * v.transpose() / eigen.eigenvalues[k].max(1e-9);
    }
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (scale[i] * scale[j]))
}

struct Spread<'a> {
    jacobian: &'a DMatrix<f64>,
    inverse: &'a DMatrix<f64>,
    one: &'a [f64],
    force: &'a [f64],
    sessions: &'a [(usize, usize)],
}

type Deviations = (Vec<f64>, Vec<[f64; 2]>);

impl Spread<'_> {
    /// Standard deviations where weighed residuals are independent.
    fn of_white(&self, size: f64, follow: &[Vec<[f64; 2]>]) -> Deviations {
        let p = self.inverse.nrows();
        let theta = (0..p).map(|k| size * libm::sqrt(self.inverse[(k, k)])).collect();
        let base = self
            .sessions
            .iter()
            .enumerate()
            .map(|(s, &(from, to))| {
                let sum = |a: &[f64], b: &[f64]| (from..to).map(|i| a[i] * b[i]).sum::<f64>();
                let (a, b, d) =
                    (sum(self.one, self.one), sum(self.one, self.force), sum(self.force, self.force));
                let determinant = (a * d - b * b).max(1e-300);
                let own = [d / determinant, a / determinant];
                std::array::from_fn(|i| {
                    let mut variance = own[i];
                    for k in 0..p {
                        for l in 0..p {
                            variance += follow[k][s][i] * self.inverse[(k, l)] * follow[l][s][i];
                        }
                    }
                    size * libm::sqrt(variance.max(0.0))
                })
            })
            .collect();
        (theta, base)
    }

    /// Standard deviations of equal-weight fits to correlated noise, by simulation.
    fn simulated(&self, noise: Noise, size: f64, steps: &[f64], follow: &[Vec<[f64; 2]>]) -> Deviations {
        let p = self.inverse.nrows();
        let mut theta = vec![0.0; p];
        let mut base = vec![[0.0; 2]; self.sessions.len()];
        let mut draws = Draws::new(1, 23);
        for _ in 0..SIMULATIONS {
            let drawn: Vec<f64> = draw(noise, steps, &mut draws).into_iter().map(|e| size * e).collect();
            let (own, _) = profile(&drawn, self.one, self.force, self.sessions);
            // The Jacobian of the profiled residual is minus that of the prediction.
            let moved = -(self.inverse * self.jacobian.tr_mul(&DVector::from_column_slice(&drawn)));
            for (sum, m) in theta.iter_mut().zip(moved.iter()) {
                *sum += m * m;
            }
            for (s, sum) in base.iter_mut().enumerate() {
                for i in 0..2 {
                    let d = own[s][i] + (0..p).map(|k| follow[k][s][i] * moved[k]).sum::<f64>();
                    sum[i] += d * d;
                }
            }
        }
        let root = |v: f64| libm::sqrt(v / SIMULATIONS as f64);
        (theta.into_iter().map(root).collect(), base.into_iter().map(|b| b.map(root)).collect())
    }
}

/// Values of an effect as a point of a candidate's grid has them.
pub(crate) fn values_at(
    candidate: &Candidate,
    point: usize,
    size: f64,
) -> Option<(&'static EffectSpec, Vec<f64>)> {
    let Kind::Effect(spec) = candidate.kind else { return None };
    let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
    let inner = candidate.points[point].0;
    if inner.is_none_or(|(k, _)| k != size_parameter(spec)) {
        values[size_parameter(spec)] = size;
    }
    if let Some((k, value)) = inner {
        values[k] = value;
    }
    Some((spec, values))
}
