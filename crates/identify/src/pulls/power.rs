//! How large an effect would have had to be, to be seen in a campaign.

use super::candidates::Candidate;
use super::context::Context;
use super::fitting::Fitted;
use super::model::PullModel;
use crate::diagnosis::Detectable;
use nalgebra::{DMatrix, DVector};

/// Standard errors that an effect has to be away from nothing to be seen with a probability of 0.8 at a level of 1 %.
const SEEN: f64 = 3.42;

/// What changes when parameters of a model move a little, in standard deviations.
fn signature(
    context: &Context<'_>,
    fitted: &Fitted,
    sd: &[f64],
    change: impl Fn(&mut PullModel),
) -> DVector<f64> {
    let rows: Vec<usize> = (0..context.data.len()).collect();
    let mut moved = fitted.model.clone();
    change(&mut moved);
    let r = |model: &PullModel| {
        let mut r = context.friction_residuals(model, &rows, sd);
        r.iter_mut().for_each(|x| *x /= fitted.likelihood.scale.max(0.1));
        if !context.observations.is_empty() {
            r.extend(context.trace_residuals(model, &rows));
        }
        DVector::from_vec(r)
    };
    r(&moved) - r(&fitted.model)
}

/// The detectable size of `candidate` beside `fitted`; `None` where the campaign cannot show it at any physical size.
pub fn detectable(context: &Context<'_>, fitted: &Fitted, candidate: &Candidate) -> Option<Detectable> {
    let rows: Vec<usize> = (0..context.data.len()).collect();
    let sd = context.deviations(&fitted.model, &rows);
    let size = candidate.size();
    let p = &candidate.spec.parameters[size];
    let step = 0.2 * candidate.free.first()?.1;
    let values = |amount: f64| {
        let mut values = candidate.starts[candidate.starts.len() / 2].clone();
        values[size] = (p.neutral + amount).clamp(p.bounds.0, p.bounds.1);
        values
    };
    let up = p.neutral + step <= p.bounds.1;
    let amount = if up { step } else { -step };
    let raw = signature(context, fitted, &sd, |m| m.effects.push(candidate.with(&values(amount)))) / amount;
    let mut columns = Vec::new();
    for k in 0..fitted.model.mu.len() {
        let d = 0.01 * fitted.model.mu[k];
        columns.push(signature(context, fitted, &sd, |m| m.mu[k] += d) / d);
    }
    if candidate.acts_on_signals() {
        columns.push(signature(context, fitted, &sd, |m| m.lag_s += 2e-3) / 2e-3);
        columns.push(signature(context, fitted, &sd, |m| m.dead_time_s += 2e-3) / 2e-3);
    }
    let basis = DMatrix::from_columns(&columns);
    let solved = basis.clone().svd(true, true).solve(&raw, 1e-9).ok()?;
    let left = (&raw - basis * solved).norm();
    if left * amount.abs() < 1e-3 * raw.norm() * amount.abs() || left < 1e-9 {
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

impl Context<'_> {
    /// What an effect on signals promises to gain in log-likelihood beside `model`, from its slope at nothing (a score
    /// test, Rao 1948). Effects on friction, and effects without a slope there, promise everything.
    pub(super) fn promise(
        &self,
        model: &PullModel,
        candidate: &Candidate,
        from: &[f64],
        rows: &[usize],
    ) -> f64 {
        let Some(&(size, scale)) = candidate.free.first() else { return f64::INFINITY };
        let p = &candidate.spec.parameters[size];
        if !candidate.acts_on_signals() || ["sensor_saturation", "deadband"].contains(&candidate.spec.id) {
            return f64::INFINITY;
        }
        let sd = self.deviations(model, rows);
        let residuals = |model: &PullModel| {
            let mut r = self.friction_residuals(model, rows, &sd);
            r.extend(self.trace_residuals(model, rows));
            DVector::from_vec(r)
        };
        let r = residuals(model);
        let s = super::likelihood::scale(&r.as_slice()[..rows.len()]).max(0.1);
        let own = |v: DVector<f64>| {
            DVector::from_iterator(
                v.len(),
                v.iter().enumerate().map(|(i, x)| if i < rows.len() { x / s } else { *x }),
            )
        };
        let slope = |change: &dyn Fn(&mut PullModel), step: f64| {
            let mut moved = model.clone();
            change(&mut moved);
            own((residuals(&moved) - &r) / step)
        };
        let mut values = from.to_vec();
        let step = if p.neutral + 0.3 * scale <= p.bounds.1 { 0.3 * scale } else { -0.3 * scale };
        values[size] = p.neutral + step;
        let raw = slope(&|m| m.effects.push(candidate.with(&values)), step);
        let mut columns: Vec<DVector<f64>> =
            (0..model.mu.len()).map(|k| slope(&|m| m.mu[k] *= 1.01, 0.01 * model.mu[k])).collect();
        columns.push(slope(&|m| m.lag_s += 2e-3, 2e-3));
        columns.push(slope(&|m| m.dead_time_s += 4e-3, 4e-3));
        columns.push(slope(&|m| m.kinetic_ratio -= 0.01, -0.01));
        let basis = DMatrix::from_columns(&columns);
        let svd = basis.clone().svd(true, true);
        // Far residuals count as in the fit.
        let r = own(r).map(|x| x.clamp(-3.0, 3.0));
        let free =
            |v: &DVector<f64>| svd.solve(v, 1e-9).map(|c| v - &basis * c).unwrap_or_else(|_| v.clone());
        let (raw, r) = (free(&raw), free(&r));
        let length = raw.norm_squared();
        if length < 1e-12 { 0.0 } else { 0.5 * raw.dot(&r).powi(2) / length }
    }
}
