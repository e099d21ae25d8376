//! How large an effect would have had to be, to be seen in a campaign.

use super::candidates::Candidate;
use super::context::Context;
use super::fitting::Fitted;
use crate::diagnosis::Detectable;
use nalgebra::{DMatrix, DVector};

/// Standard errors that an effect has to be away from nothing to be seen with a probability of 0.8 at a level of 1 %.
const SEEN: f64 = 3.42;

/// What changes when parameters of a model move a little, in standard deviations.
fn signature(
    context: &Context<'_>,
    fitted: &Fitted,
    sd: &[f64],
    change: impl Fn(&mut super::model::PullModel),
) -> DVector<f64> {
    let rows: Vec<usize> = (0..context.data.len()).collect();
    let mut moved = fitted.model.clone();
    change(&mut moved);
    let r = |model: &super::model::PullModel| {
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
