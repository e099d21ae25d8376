//! A Gaussian vector with groups of features: its evidence, its coefficients, and what a further group would add.
//!
//! z = sum over blocks of Phi_t c_t + noise, with c_t ~ N(0, s_t^2 I) and noise of variance w_i (r^2 + a^2 q_i): relative scatter r, noise of
//! a reading a, of which a label shows q_i. With A = Phi' W Phi + V^-1 and m = A^-1 Phi' W z (Bishop 2006, 3.5),
//!
//! log N(z) = -1/2 (sum log var_i + sum M_t log s_t^2 + log |A| + z'Wz - m'Phi'Wz + n log 2 pi).
//!
//! Standard deviations are at the mode of their logarithms under log-normal priors; the evidence is Laplace's (MacKay 1992), with the
//! curvature 2 gamma_t of a block, gamma_t = M_t - tr(A^-1)_tt / s_t^2, the number of coefficients that the data determine.

use gripgen_twin::random::normal_cdf;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What is believed of a standard deviation: its logarithm is normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SdPrior {
    pub(super) median: f64,
    pub(super) spread: f64,
}

impl SdPrior {
    /// Value of the logarithm at `z` standard deviations.
    fn at(self, z: f64) -> f64 {
        libm::log(self.median) + self.spread * z
    }
}

/// Features that share a standard deviation.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// n rows.
    pub(super) features: DMatrix<f64>,
    /// What is believed of the deviation; one without spread is known.
    pub(super) sd: SdPrior,
    /// Where the coefficients may lie, of an effect whose size has bounds.
    pub(super) range: Option<(f64, f64)>,
}

impl Block {
    /// What the range of its coefficients says: the share of N(mean, sd^2) that lies in it over that of N(0, prior_sd^2), as a logarithm.
    fn log_share(&self, mean: f64, sd: f64, prior_sd: f64) -> f64 {
        let Some((low, high)) = self.range else { return 0.0 };
        let within = |mean: f64, sd: f64| {
            // Both tails far on one side: the difference of the smaller ones.
            let (a, b) = ((low - mean) / sd, (high - mean) / sd);
            let share = if a > 0.0 { normal_cdf(-a) - normal_cdf(-b) } else { normal_cdf(b) - normal_cdf(a) };
            libm::log(share.max(1e-300))
        };
        within(mean, sd) - within(0.0, prior_sd)
    }
}

/// What was measured, ready to be explained.
#[derive(Debug, Clone)]
pub(super) struct Measured {
    /// n values.
    pub(super) z: DVector<f64>,
    /// Variance that a unit of variance of a reading makes in each.
    pub(super) of_reading: DVector<f64>,
    /// Factor on the variance of each: more than 1 of an outlier, infinite of one that must not be seen.
    pub(super) wider: DVector<f64>,
    /// Logarithm of dz/dy over all values: evidences of different transformations are compared as densities of y.
    pub(super) log_jacobian: f64,
}

/// Priors of scatter and of noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct NoisePriors {
    pub(super) scatter: SdPrior,
    pub(super) reading: SdPrior,
}

/// A fitted vector.
#[derive(Debug, Clone)]
pub(super) struct Gaussian {
    /// Logarithms of the deviations of the blocks.
    pub(super) log_sd: Vec<f64>,
    /// Logarithms of scatter and noise.
    pub(super) log_noise: [f64; 2],
    /// Coefficients of all blocks, one behind the other.
    pub(super) mean: DVector<f64>,
    /// Root of their covariance: U with U'U = A^-1, of which each column belongs to a coefficient.
    root: DMatrix<f64>,
    /// Where each block begins; one more than there are blocks.
    pub(super) begins: Vec<usize>,
    /// z less what the features say.
    pub(super) residual: DVector<f64>,
    /// Inverse variance of each value.
    pub(super) weight: DVector<f64>,
    /// Logarithm of the evidence.
    pub(super) log_evidence: f64,
    /// All features.
    features: DMatrix<f64>,
    /// Phi' W.
    weighted: DMatrix<f64>,
}

/// What the coefficients add to the variance of each value.
fn spread(features: &DMatrix<f64>, root: &DMatrix<f64>) -> DVector<f64> {
    let through = root * features.transpose();
    DVector::from_iterator(features.nrows(), through.column_iter().map(|c| c.norm_squared()))
}

/// The inverse of a lower triangular matrix, by columns, which lie in memory as they are read.
fn lower_inverse(lower: &DMatrix<f64>) -> DMatrix<f64> {
    let n = lower.nrows();
    let mut inverse = DMatrix::zeros(n, n);
    for j in 0..n {
        let mut column = inverse.column_mut(j);
        column[j] = 1.0;
        for k in j..n {
            column[k] /= lower[(k, k)];
            let x = column[k];
            column.rows_mut(k + 1, n - k - 1).axpy(-x, &lower.column(k).rows(k + 1, n - k - 1), 1.0);
        }
    }
    inverse
}

/// Steps of the search for the mode at most, and what its last step gains less than.
const STEPS: usize = 40;
const CONVERGED: f64 = 1e-3;
/// Logarithms of deviations move by this at most in a step.
const LONGEST: f64 = 1.5;

/// Standard normal quantiles of equal shares over which a deviation is averaged in a screening.
const QUANTILES: [f64; 14] =
    [-1.803, -1.242, -0.921, -0.674, -0.464, -0.272, -0.090, 0.090, 0.272, 0.464, 0.674, 0.921, 1.242, 1.803];

/// One evaluation at some deviations.
struct At {
    objective: f64,
    gradient: Vec<f64>,
    curvature: Vec<f64>,
    mean: DVector<f64>,
    root: DMatrix<f64>,
    residual: DVector<f64>,
    weight: DVector<f64>,
    weighted: DMatrix<f64>,
}

/// The problem of a set of blocks.
struct Problem<'a> {
    measured: &'a Measured,
    blocks: &'a [&'a Block],
    features: DMatrix<f64>,
    begins: Vec<usize>,
    priors: Vec<SdPrior>,
}

impl<'a> Problem<'a> {
    fn new(measured: &'a Measured, blocks: &'a [&'a Block], noise: NoisePriors) -> Self {
        let mut begins = vec![0];
        for block in blocks {
            begins.push(begins[begins.len() - 1] + block.features.ncols());
        }
        let mut features = DMatrix::zeros(measured.z.len(), begins[blocks.len()]);
        for (block, &at) in blocks.iter().zip(&begins) {
            features.columns_mut(at, block.features.ncols()).copy_from(&block.features);
        }
        let mut priors: Vec<SdPrior> = blocks.iter().map(|block| block.sd).collect();
        priors.extend([noise.scatter, noise.reading]);
        Self { measured, blocks, features, begins, priors }
    }

    /// Log evidence at the deviations, with the priors, its gradient and curvature by their logarithms; `None` where numbers fail.
    fn at(&self, theta: &[f64]) -> Option<At> {
        let (n, blocks) = (self.measured.z.len(), self.blocks.len());
        let [scatter, reading] = [theta[blocks], theta[blocks + 1]].map(|t| libm::exp(2.0 * t));
        let wider = |i: usize| Some(self.measured.wider[i]).filter(|wider| wider.is_finite());
        let own = |i: usize| wider(i).map_or(0.0, |wider| wider * scatter);
        let read = |i: usize| wider(i).map_or(0.0, |wider| wider * reading * self.measured.of_reading[i]);
        let weight = DVector::from_fn(n, |i, _| wider(i).map_or(0.0, |_| 1.0 / (own(i) + read(i))));
        let seen = || weight.iter().filter(|w| **w > 0.0);
        let weighted = weighted(&self.features, &weight);
        let mut precision = &weighted * &self.features;
        let mut log_prior = 0.0;
        for (t, &log_sd) in theta[..blocks].iter().enumerate() {
            let v = libm::exp(2.0 * log_sd);
            for k in self.begins[t]..self.begins[t + 1] {
                precision[(k, k)] += 1.0 / v;
                log_prior += 2.0 * log_sd;
            }
        }
        let factor: Cholesky<f64, Dyn> = Cholesky::new(precision)?;
        let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| libm::log(*d)).sum::<f64>();
        let b = &weighted * &self.measured.z;
        let mean = factor.solve(&b);
        let root = lower_inverse(factor.l_dirty());
        let variance = |k: usize| root.column(k).norm_squared();
        let residual = &self.measured.z - &self.features * &mean;
        let wz = weight.component_mul(&self.measured.z);
        let log_var: f64 = seen().map(|w| -libm::log(*w)).sum();
        let mut objective = self.measured.log_jacobian
            - 0.5
                * (log_var + log_prior + log_det + wz.dot(&self.measured.z) - b.dot(&mean)
                    + seen().count() as f64 * libm::log(std::f64::consts::TAU));
        let (mut gradient, mut curvature) = (vec![0.0; theta.len()], vec![0.0; theta.len()]);
        for t in 0..blocks {
            let v = libm::exp(2.0 * theta[t]);
            let range = self.begins[t]..self.begins[t + 1];
            let trace: f64 = range.clone().map(variance).sum();
            let square: f64 = range.clone().map(|k| mean[k] * mean[k]).sum();
            let determined = (range.len() as f64 - trace / v).max(0.0);
            gradient[t] = square / v - determined;
            curvature[t] = 2.0 * determined;
        }
        let spread = spread(&self.features, &root);
        for i in 0..n {
            let w = weight[i];
            let of_model = w * spread[i];
            let by_variance = 0.5 * w * (w * residual[i] * residual[i] + of_model - 1.0);
            // The share of this value that the features leave to the noise.
            let left = (1.0 - of_model).max(0.0);
            for (t, part) in [(blocks, own(i)), (blocks + 1, read(i))] {
                gradient[t] += 2.0 * part * by_variance;
                let share = part * w * left;
                curvature[t] += 2.0 * share * share;
            }
        }
        for (t, prior) in self.priors.iter().enumerate() {
            if prior.spread > 0.0 {
                let far = (theta[t] - prior.at(0.0)) / prior.spread;
                objective -= 0.5 * far * far;
                gradient[t] -= far / prior.spread;
                curvature[t] += 1.0 / (prior.spread * prior.spread);
            } else {
                (gradient[t], curvature[t]) = (0.0, f64::INFINITY);
            }
        }
        objective.is_finite().then_some(At {
            objective,
            gradient,
            curvature,
            mean,
            root,
            residual,
            weight,
            weighted,
        })
    }

    /// The mode from a start.
    fn mode(&self, mut theta: Vec<f64>) -> Option<(Vec<f64>, At)> {
        let mut at = self.at(&theta)?;
        for _ in 0..STEPS {
            let direction: Vec<f64> = at
                .gradient
                .iter()
                .zip(&at.curvature)
                .map(|(g, c)| (g / c).clamp(-LONGEST, LONGEST))
                .collect();
            let promised: f64 = direction.iter().zip(&at.gradient).map(|(d, g)| d * g).sum();
            if promised < CONVERGED {
                break;
            }
            let mut length = 1.0;
            let next = loop {
                let tried: Vec<f64> = theta.iter().zip(&direction).map(|(t, d)| t + length * d).collect();
                match self.at(&tried).filter(|next| next.objective > at.objective) {
                    Some(next) => break Some((tried, next)),
                    None if length < 0.01 => break None,
                    None => length *= 0.4,
                }
            };
            let Some((tried, next)) = next else { break };
            let gained = next.objective - at.objective;
            (theta, at) = (tried, next);
            if gained < CONVERGED {
                break;
            }
        }
        Some((theta, at))
    }
}

impl Gaussian {
    /// The vector with these blocks, its deviations at their mode. `from` are logarithms of deviations near it, of the first blocks and of
    /// the noise; other blocks start at the middle of their priors.
    pub(super) fn fit(
        measured: &Measured,
        blocks: &[&Block],
        noise: NoisePriors,
        from: Option<&Gaussian>,
    ) -> Option<Self> {
        let problem = Problem::new(measured, blocks, noise);
        let known = from.map_or(&[][..], |g| &g.log_sd);
        let start = |t: usize| known.get(t).copied().filter(|_| t < blocks.len());
        let mut theta: Vec<f64> =
            (0..blocks.len()).map(|t| start(t).unwrap_or(problem.priors[t].at(0.0))).collect();
        theta.extend(from.map_or([noise.scatter.at(0.0), noise.reading.at(0.0)], |g| g.log_noise));
        let (theta, at) = problem.mode(theta)?;
        let count = blocks.len();
        let mut log_evidence = at.objective;
        for (curvature, prior) in at.curvature.iter().zip(&problem.priors) {
            if prior.spread > 0.0 {
                log_evidence -= 0.5 * libm::log(curvature * prior.spread * prior.spread);
            }
        }
        for (t, block) in blocks.iter().enumerate().filter(|(_, block)| block.range.is_some()) {
            for k in problem.begins[t]..problem.begins[t + 1] {
                log_evidence += block.log_share(at.mean[k], at.root.column(k).norm(), libm::exp(theta[t]));
            }
        }
        Some(Self {
            log_sd: theta[..count].to_vec(),
            log_noise: [theta[count], theta[count + 1]],
            mean: at.mean,
            root: at.root,
            begins: problem.begins,
            residual: at.residual,
            weight: at.weight,
            log_evidence,
            features: problem.features,
            weighted: at.weighted,
        })
    }

    /// Standard deviation of a coefficient.
    pub(super) fn sd(&self, coefficient: usize) -> f64 {
        self.root.column(coefficient).norm()
    }

    /// What a block says of each value.
    pub(super) fn part(&self, block: usize) -> DVector<f64> {
        let (at, width) = (self.begins[block], self.begins[block + 1] - self.begins[block]);
        self.features.columns(at, width) * self.mean.rows(at, width)
    }

    /// What some blocks say of the values at `rows`, learnt from all others with the deviations as they are.
    pub(super) fn predicted_without(
        &self,
        measured: &Measured,
        rows: &[usize],
        own: &dyn Fn(usize) -> bool,
    ) -> Option<Vec<f64>> {
        let blocks = self.log_sd.len();
        let mut precision = &self.weighted * &self.features;
        let mut b = &self.weighted * &measured.z;
        for (t, log_sd) in self.log_sd.iter().enumerate() {
            (self.begins[t]..self.begins[t + 1]).for_each(|k| precision[(k, k)] += libm::exp(-2.0 * log_sd));
        }
        for &row in rows {
            let weighted = self.weighted.column(row);
            precision.ger(-1.0, &weighted, &self.features.row(row).transpose(), 1.0);
            b.axpy(-measured.z[row], &weighted, 1.0);
        }
        let mut mean = Cholesky::new(precision)?.solve(&b);
        for t in (0..blocks).filter(|t| !own(*t)) {
            mean.rows_mut(self.begins[t], self.begins[t + 1] - self.begins[t]).fill(0.0);
        }
        Some(rows.iter().map(|&row| self.features.row(row).transpose().dot(&mean)).collect())
    }

    /// Residual of each value predicted from all others, over its deviation.
    pub(super) fn left_out(&self) -> Vec<f64> {
        let spread = spread(&self.features, &self.root);
        let one = |i: usize| {
            let w = self.weight[i];
            let of_model = w * spread[i];
            w * self.residual[i] / (w * (1.0 - of_model).max(1e-9)).sqrt()
        };
        (0..self.residual.len()).map(one).collect()
    }

    /// By how much the logarithm of the evidence would rise with each of some groups of features, roughly: their deviation is averaged
    /// over its prior, everything else stays where it is.
    pub(super) fn screen(&self, block: &Block) -> f64 {
        let width = block.features.ncols();
        let weighted = weighted(&block.features, &self.weight);
        let cross = &self.weighted * &block.features;
        let known = &self.root * &cross;
        let within = &weighted * &block.features - known.transpose() * &known;
        let b = weighted * &self.residual;
        let (lambda, along) = if width == 1 {
            (DVector::from_element(1, within[(0, 0)]), b)
        } else {
            let eigen = within.symmetric_eigen();
            let along = eigen.eigenvectors.tr_mul(&b);
            (eigen.eigenvalues, along)
        };
        let each = QUANTILES.map(|z| {
            let v = libm::exp(2.0 * block.sd.at(z));
            let of = |(l, b): (&f64, &f64)| {
                let grown = 1.0 + v * l.max(0.0);
                0.5 * (v * b * b / grown - libm::log(grown))
            };
            let gain: f64 = lambda.iter().zip(along.iter()).map(of).sum();
            // Mean and deviation of the coefficient, where it is one.
            let variance = v / (1.0 + v * lambda[0].max(0.0));
            gain + if width == 1 {
                block.log_share(variance * along[0], variance.sqrt(), v.sqrt())
            } else {
                0.0
            }
        });
        log_mean(&each)
    }
}

/// Phi' W.
fn weighted(features: &DMatrix<f64>, weight: &DVector<f64>) -> DMatrix<f64> {
    let mut weighted = features.transpose();
    for (mut column, w) in weighted.column_iter_mut().zip(weight) {
        column *= *w;
    }
    weighted
}

/// Logarithm of the mean of exponentials.
pub(super) fn log_mean(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return f64::NEG_INFINITY;
    }
    most + libm::log(logs.iter().map(|x| libm::exp(x - most)).sum::<f64>() / logs.len() as f64)
}

#[cfg(test)]
mod tests;
