//! The friction of one part on a rig that is given: draws of its posterior by importance sampling.
//!
//! Coefficient and offset are drawn from a Student t around the most likely values, with the curvature there (Geweke 1989), and
//! weighed by likelihood and prior over the density that they were drawn from. The mean weight is the evidence of the rig.

use super::super::context::Context;
use super::super::priors::PullPriors;
use crate::draws::Draws;
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::effects::OFFSET_LAW;
use gripgen_twin::predict::{ModelEffect, PullModel};
use nalgebra::DVector;

/// Draws of a part on each rig.
const DRAWS: usize = 40;

/// Degrees of freedom of the distribution that is drawn from, and by how much its deviations are wider.
const FREEDOM: usize = 5;
const WIDER: f64 = 1.15;

/// Share of pulls that are bad, and how many times as wide their residuals are.
const BAD: (f64, f64) = (0.05, 8.0);

/// Residual from which on a pull pulls with a constant force while the most likely values are looked for.
const HUBER: f64 = 2.5;

/// A draw of a part.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartDraw {
    pub(super) weight: f64,
    pub(super) mu: f64,
    /// Of the law mu (1 + offset / F_G); 0 without it.
    pub(super) offset_n: f64,
}

/// What the pulls of a part say on a rig.
#[derive(Debug, Clone)]
pub(super) struct PartAnswer {
    /// Logarithm of the evidence, up to what all rigs share.
    pub(super) log_evidence: f64,
    /// Draws, whose weights sum to 1.
    pub(super) draws: Vec<PartDraw>,
}

/// A part on a rig.
pub(super) struct PartOnRig<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) priors: &'a PullPriors,
    /// The rig: everything but the friction of the part.
    pub(super) rig: &'a PullModel,
    pub(super) part: usize,
    pub(super) rows: &'a [usize],
    /// Whether the part has an offset.
    pub(super) law: bool,
}

impl PartOnRig<'_> {
    /// Coefficient and offset at standard normal variables.
    pub(super) fn friction(&self, z: &[f64]) -> (f64, f64) {
        (self.priors.mu.at(z[0]), z.get(1).map_or(0.0, |z| self.priors.offset_n.at(*z)))
    }

    pub(super) fn model(&self, (mu, offset_n): (f64, f64)) -> PullModel {
        let mut model = self.rig.clone();
        model.mu[self.part] = mu;
        model.effects.clear();
        if self.law {
            let values = OFFSET_LAW.values(&[("b_n", offset_n)]);
            model.effects.push(ModelEffect { part: Some(self.part), ..ModelEffect::new(OFFSET_LAW, values) });
        }
        model
    }

    pub(super) fn log_likelihood(&self, model: &PullModel) -> f64 {
        let (share, wide) = BAD;
        let each = |(difference, sd): (f64, f64)| {
            let z = difference / sd;
            let good = (1.0 - share) * libm::exp(-0.5 * z * z);
            let bad = share / wide * libm::exp(-0.5 * (z / wide).powi(2));
            libm::log((good + bad).max(1e-300) / sd)
        };
        self.context.compared(model, self.rows).into_iter().map(each).sum()
    }

    /// Draws of the part. `lane` keeps the draws of rigs apart.
    pub(super) fn answer(&self, lane: u64) -> Option<PartAnswer> {
        let ratio = |&i: &usize| {
            let pull = &self.context.data.measured.pulls[i];
            let kinetic_ratio = self.rig.kinetic_ratio;
            (pull.max_pull_force_n / (2.0 * pull.grip_force_n * kinetic_ratio)).max(1e-3)
        };
        let mut ratios: Vec<f64> = self.rows.iter().map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let middle = ratios.get(ratios.len() / 2).copied().unwrap_or(self.priors.mu.centre);
        let start = libm::log(middle / self.priors.mu.centre) / self.priors.mu.spread.max(1e-9);
        let free = |name: &str, start: f64| FreeParameter {
            name: name.into(),
            start: start.clamp(-6.0, 6.0),
            bounds: (-8.0, 8.0),
            scale: 0.1,
        };
        let mut parameters = vec![free("mu", start)];
        if self.law {
            parameters.push(free("offset_n", 0.0));
        }
        let found = fit(&parameters, FitOptions { max_steps: 12, min_gain: 1e-4 }, |z| {
            let compared = self.context.compared(&self.model(self.friction(z)), self.rows);
            let residual = |(difference, sd): (f64, f64)| {
                let x: f64 = difference / sd;
                let far = x.abs() > HUBER;
                if far { x.signum() * (2.0 * HUBER * x.abs() - HUBER * HUBER).sqrt() } else { x }
            };
            compared.into_iter().map(residual).chain(z.iter().copied()).collect()
        })
        .ok()?;
        let n = parameters.len();
        let root = (found.covariance.clone() * (WIDER * WIDER)).cholesky()?.l();
        // Logarithm of what both densities have before their exponents: of the draws, and of the prior.
        let (freedom, size) = (FREEDOM as f64, n as f64);
        let log_width: f64 = (0..n).map(|i| libm::log(root[(i, i)])).sum::<f64>()
            + libm::lgamma(0.5 * freedom)
            - libm::lgamma(0.5 * (freedom + size))
            + 0.5 * size * libm::log(freedom * std::f64::consts::PI);
        let log_prior = -0.5 * size * libm::log(std::f64::consts::TAU);
        let mut random = Draws::new(29, lane);
        let drawn = (0..DRAWS).map(|_| {
            let normal = DVector::from_fn(n, |_, _| random.normal());
            let chi2: f64 = (0..FREEDOM).map(|_| random.normal().powi(2)).sum();
            let stretched = &normal * (freedom / chi2.max(1e-12)).sqrt();
            let z: Vec<f64> =
                (DVector::from_column_slice(&found.values) + &root * &stretched).iter().copied().collect();
            let drawn_from =
                -0.5 * (freedom + size) * libm::log1p(stretched.norm_squared() / freedom) - log_width;
            let friction = self.friction(&z);
            let prior = log_prior - 0.5 * z.iter().map(|z| z * z).sum::<f64>();
            (friction, self.log_likelihood(&self.model(friction)) + prior - drawn_from)
        });
        let drawn: Vec<((f64, f64), f64)> = drawn.filter(|(_, log)| log.is_finite()).collect();
        let most = drawn.iter().map(|d| d.1).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = drawn.iter().map(|d| libm::exp(d.1 - most)).sum();
        let draws = drawn.iter().map(|&((mu, offset_n), log)| PartDraw {
            weight: libm::exp(log - most) / sum,
            mu,
            offset_n,
        });
        let log_evidence = most + libm::log(sum / DRAWS as f64);
        (sum > 0.0).then(|| PartAnswer { log_evidence, draws: draws.collect() })
    }
}
