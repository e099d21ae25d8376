//! How large an effect would have had to be, to be seen in a campaign.

use super::candidates::Candidate;
use super::context::Context;
use super::curves::Curve;
use super::terms::Terms;
use super::trace_residuals::Widening;
use crate::diagnosis::Detectable;
use gripgen_twin::predict::PullModel;
use nalgebra::{DMatrix, DVector, Dyn, SVD};

/// Standard errors that an effect has to be away from nothing to be seen with a probability of 0.8 at a level of 1 %.
pub(super) const SEEN: f64 = 3.42;

/// What a term promises to gain in log-likelihood beside a model, from its slope at nothing (a score test, Rao 1948).
pub(super) struct ScoreTest<'a> {
    context: &'a Context<'a>,
    model: &'a PullModel,
    rows: &'a [usize],
    sd: Vec<f64>,
    /// Scale of the residuals of pulls.
    pub scale: f64,
    /// Residuals, and what of them no parameter of the model explains.
    residuals: DVector<f64>,
    left: DVector<f64>,
    /// Derivatives by the parameters of the model.
    basis: DMatrix<f64>,
    svd: SVD<f64, Dyn, Dyn>,
    signals: bool,
    widening: Widening,
}

impl<'a> ScoreTest<'a> {
    /// Beside `model`, whose effects are those of `terms`. `signals` tells whether what traces say is looked at.
    pub fn new(
        context: &'a Context<'a>,
        model: &'a PullModel,
        terms: &Terms,
        rows: &'a [usize],
        signals: bool,
    ) -> Self {
        let sd = context.deviations(model, rows);
        let mut test = Self {
            context,
            model,
            rows,
            sd,
            scale: 1.0,
            residuals: DVector::zeros(0),
            left: DVector::zeros(0),
            basis: DMatrix::zeros(0, 0),
            svd: DMatrix::zeros(1, 1).svd(true, true),
            signals,
            widening: if signals { context.trace_residuals(model, rows).widening() } else { Widening::NONE },
        };
        test.residuals = test.residuals_of(model);
        test.scale = context.tails.scale(&test.residuals.as_slice()[..rows.len()]).max(0.1);
        let mut columns: Vec<DVector<f64>> =
            (0..model.mu.len()).map(|k| test.slope(&|m| m.mu[k] *= 1.01, 0.01 * model.mu[k])).collect();
        columns.push(test.slope(&|m| m.kinetic_ratio -= 0.01, -0.01));
        if signals {
            columns.push(test.slope(&|m| m.lag_s += 2e-3, 2e-3));
            columns.push(test.slope(&|m| m.dead_time_s += 4e-3, 4e-3));
        }
        for (e, (candidate, _)) in terms.effects.iter().enumerate() {
            for &(i, scale) in &candidate.free {
                let bounds = candidate.spec.parameters[i].bounds;
                let step = if model.effects[e].values[i] + 0.1 * scale <= bounds.1 { 0.1 } else { -0.1 };
                columns.push(test.slope(&|m| m.effects[e].values[i] += step * scale, step * scale));
            }
        }
        test.basis = DMatrix::from_columns(&columns);
        test.svd = test.basis.clone().svd(true, true);
        // Far residuals count as in the fit.
        let clipped = test.own(&test.residuals).map(|x| x.clamp(-3.0, 3.0));
        test.left = test.free(&clipped);
        test
    }

    /// Residuals of another model, in the deviations of this one.
    pub fn residuals_of(&self, model: &PullModel) -> DVector<f64> {
        let mut r = self.context.friction_residuals(model, self.rows, &self.sd);
        if self.signals {
            r.extend(self.context.trace_residuals(model, self.rows).widened(self.widening));
        }
        DVector::from_vec(r)
    }

    /// Residuals of pulls in units of their scale.
    pub fn own(&self, v: &DVector<f64>) -> DVector<f64> {
        let n = self.rows.len();
        DVector::from_iterator(
            v.len(),
            v.iter().enumerate().map(|(i, x)| if i < n { x / self.scale } else { *x }),
        )
    }

    fn slope(&self, change: &dyn Fn(&mut PullModel), step: f64) -> DVector<f64> {
        let mut moved = self.model.clone();
        change(&mut moved);
        self.own(&((self.residuals_of(&moved) - &self.residuals) / step))
    }

    /// What no parameter of the model explains.
    pub fn free(&self, v: &DVector<f64>) -> DVector<f64> {
        self.svd.solve(v, 1e-9).map(|c| v - &self.basis * c).unwrap_or_else(|_| v.clone())
    }

    /// What an effect promises from a start.
    pub fn effect(&self, candidate: &Candidate, from: &[f64]) -> f64 {
        let flat = candidate.spec.pulls.is_ok_and(|fit| fit.flat_at_neutral);
        if candidate.free.is_empty() || flat {
            return f64::INFINITY;
        }
        let raw = self.direction(candidate, from);
        let length = raw.norm_squared();
        if length < 1e-12 { 0.0 } else { 0.5 * raw.dot(&self.left).powi(2) / length }
    }

    /// How an effect from a start moves the residuals for its size, as far as no parameter of the model does.
    pub fn direction(&self, candidate: &Candidate, from: &[f64]) -> DVector<f64> {
        let Some(&(size, scale)) = candidate.free.first() else { return DVector::zeros(self.left.len()) };
        let p = &candidate.spec.parameters[size];
        let mut values = from.to_vec();
        let step = if p.neutral + 0.3 * scale <= p.bounds.1 { 0.3 * scale } else { -0.3 * scale };
        values[size] = p.neutral + step;
        self.free(&self.slope(&|m| m.effects.push(candidate.with(&values)), step))
    }

    /// What an unnamed curve promises.
    pub fn curve(&self, curve: &Curve) -> f64 {
        let columns = self.directions_of(curve);
        if columns.is_empty() {
            return 0.0;
        }
        let columns = DMatrix::from_columns(&columns);
        let explained = columns.clone().svd(true, true).solve(&self.left, 1e-9).map(|c| &columns * c);
        explained.map_or(f64::INFINITY, |e| 0.5 * self.left.dot(&e))
    }

    /// How the coefficients of a curve move the residuals, as far as no parameter of the model does.
    pub fn directions_of(&self, curve: &Curve) -> Vec<DVector<f64>> {
        let n = self.context.data.len();
        let limits = if curve.additive { self.context.predictor.limits_n(self.model) } else { vec![] };
        let step = 0.02;
        (0..curve.len())
            .map(|k| {
                let mut coefficients = vec![0.0; curve.len()];
                coefficients[k] = step;
                let moved = |m: &mut PullModel| {
                    if m.factor.is_empty() {
                        m.factor = vec![1.0; n];
                    }
                    curve.apply(&coefficients, &limits, &mut m.factor);
                };
                self.free(&self.slope(&moved, step))
            })
            .collect()
    }

    /// How the parameters of the model move the residuals.
    pub fn slopes(&self) -> Vec<DVector<f64>> {
        self.basis.column_iter().map(|c| c.into_owned()).collect()
    }

    /// How more friction moves the residual of each pull, for a share of it.
    pub fn by_share(&self) -> DVector<f64> {
        let (n, step) = (self.context.data.len(), 0.02);
        let more = |m: &mut PullModel| {
            let known = if m.factor.is_empty() { vec![1.0; n] } else { m.factor.clone() };
            m.factor = known.iter().map(|f| f * libm::exp(step)).collect();
        };
        self.slope(&more, step)
    }

    /// The detectable size of an effect beside the model; `None` where the campaign cannot show it at any physical size.
    pub fn detectable(&self, candidate: &Candidate) -> Option<Detectable> {
        // A little of such an effect does nothing: no slope says from where on it would be seen.
        if candidate.spec.pulls.is_ok_and(|fit| fit.flat_at_neutral) {
            return None;
        }
        let size = candidate.size();
        let p = &candidate.spec.parameters[size];
        let step = 0.2 * candidate.free.first()?.1;
        let up = p.neutral + step <= p.bounds.1;
        let amount = if up { step } else { -step };
        let mut values = candidate.starts[candidate.starts.len() / 2].clone();
        values[size] = (p.neutral + amount).clamp(p.bounds.0, p.bounds.1);
        let raw = self.slope(&|m| m.effects.push(candidate.with(&values)), amount);
        let left = self.free(&raw).norm();
        if left < 1e-3 * raw.norm() || left < 1e-9 {
            return None;
        }
        let needed = SEEN / left;
        let value = p.neutral + if up { needed } else { -needed };
        (p.bounds.0..=p.bounds.1).contains(&value).then(|| Detectable {
            parameter: p.name.into(),
            value,
            power: 0.8,
        })
    }
}
