//! Learning a residual beside a model from some of the pulls.

use super::context::Context;
use super::curves::{CLOCKS, Curve, SESSION};
use super::evidence::{Grouped, Learnt, MOST};
use super::fitting::Fitted;
use super::smooth::smooths;
use gripgen_twin::predict::PullModel;
use nalgebra::{DMatrix, DVector};

/// Step of the logarithm of the friction by which the labels are differentiated.
const STEP: f64 = 0.02;

/// Shares of the memory of a fit with which a residual may be learnt: what goes with a slow column is memory to a model without it.
const OF_MEMORY: [f64; 3] = [1.0, 0.5, 0.0];

/// What is left of the pulls at `rows` beside a model, as groups of columns in units of the noise.
pub(super) fn grouped(
    context: &Context<'_>,
    fitted: &Fitted,
    rows: &[usize],
    curves: &[Curve],
) -> Option<Grouped> {
    grouped_with(context, fitted, rows, curves, &[1.0])?.pop()
}

/// The same for some shares of the memory that pulls of a session have.
fn grouped_with(
    context: &Context<'_>,
    fitted: &Fitted,
    rows: &[usize],
    curves: &[Curve],
    shares: &[f64],
) -> Option<Vec<Grouped>> {
    let model = &fitted.model;
    let n = context.data.len();
    let sd = context.deviations(model, rows);
    let residuals = DVector::from_vec(context.friction_residuals(model, rows, &sd));
    let slope = |changed: &PullModel, step: f64| {
        (&residuals - DVector::from_vec(context.friction_residuals(changed, rows, &sd))) / step
    };
    let mut known = Vec::new();
    for k in 0..model.mu.len() {
        let mut moved = model.clone();
        moved.mu[k] *= 1.0 + STEP;
        known.push(slope(&moved, STEP));
    }
    for (e, (candidate, _)) in fitted.terms.effects.iter().enumerate() {
        for &(i, scale) in &candidate.free {
            let mut moved = model.clone();
            let p = &candidate.spec.parameters[i];
            let step = if moved.effects[e].values[i] + 0.1 * scale <= p.bounds.1 { 0.1 } else { -0.1 };
            moved.effects[e].values[i] += step * scale;
            known.push(slope(&moved, step));
        }
    }
    let mut stronger = model.clone();
    if stronger.factor.is_empty() {
        stronger.factor = vec![1.0; n];
    }
    stronger.factor.iter_mut().for_each(|f| *f *= 1.0 + STEP);
    let by_factor = slope(&stronger, STEP);
    let scale = fitted.likelihood.scale.max(0.1);
    let weights: Vec<f64> = residuals
        .iter()
        .map(|r| (context.tails.weight_of(r / scale) / context.tails.weight_of(0.0)).sqrt() / scale)
        .collect();
    let sessions: Vec<usize> = rows.iter().map(|&i| context.data.session_of[i]).collect();
    let last_of = |k: usize| k.checked_sub(1).filter(|&last| sessions[last] == sessions[k]);
    let followers = (0..rows.len()).filter(|&k| last_of(k).is_some()).count() as f64;
    let each = shares.iter().map(|share| {
        let memory = share * fitted.likelihood.memory;
        // Neighbours that remember each other: what is new in each pull.
        let new = 1.0 - memory * memory;
        let whitened = |raw: &dyn Fn(usize) -> f64| {
            let own = |k: usize| weights[k] * raw(k);
            let one = |k: usize| match last_of(k) {
                Some(last) => (own(k) - memory * own(last)) / new.sqrt(),
                None => own(k),
            };
            DVector::from_iterator(rows.len(), (0..rows.len()).map(one))
        };
        let y = whitened(&|k| residuals[k]);
        let known: Vec<DVector<f64>> = known.iter().map(|c| whitened(&|k| c[k])).collect();
        let group = |curve: &Curve| {
            // What sessions and clocks explain is what pulls of a session remember, and no explanation of it.
            if *share < 1.0
                && curve.name.split('*').any(|column| column == SESSION || CLOCKS.contains(&column))
            {
                return DMatrix::zeros(rows.len(), curve.len());
            }
            let of = |j: usize| whitened(&|k| by_factor[k] * curve.basis[rows[k]][j]);
            DMatrix::from_columns(&(0..curve.len()).map(of).collect::<Vec<_>>())
        };
        let groups: Vec<DMatrix<f64>> = curves.iter().map(group).collect();
        Grouped::new(&y, &DMatrix::from_columns(&known), &groups, -0.5 * followers * libm::log(new))
    });
    each.collect()
}

/// What is left beside a model with the memory that has the most evidence together with what the pulls at `rows` teach, and that.
pub(super) fn learnt_beside_memory(
    context: &Context<'_>,
    fitted: &Fitted,
    rows: &[usize],
    curves: &[Curve],
    most: usize,
) -> Option<(Grouped, Learnt)> {
    let shares = if fitted.likelihood.memory == 0.0 { &OF_MEMORY[..1] } else { &OF_MEMORY };
    let each = grouped_with(context, fitted, rows, curves, shares)?;
    let all = each.into_iter().map(|left| {
        let learnt = left.learn(most);
        (left.evidence_of_nothing() + learnt.gain, left, learnt)
    });
    let best = all.reduce(|a, b| if b.0 > a.0 { b } else { a });
    best.map(|(_, left, learnt)| (left, learnt))
}

/// `fitted` with what the pulls at `rows` teach beside it, of at most so many groups, shrunk once more to `share` of it.
pub(super) fn with_residual(
    context: &Context<'_>,
    fitted: &Fitted,
    rows: &[usize],
    curves: &[Curve],
    share: f64,
    most: usize,
) -> Option<Fitted> {
    let (_, learnt) = learnt_beside_memory(context, fitted, rows, curves, most)?;
    if learnt.groups.is_empty() {
        return None;
    }
    let shrunk = |c: Vec<f64>| c.into_iter().map(|c| share * c).collect::<Vec<f64>>();
    let mut terms = fitted.terms.clone();
    terms.learnt = learnt.groups.into_iter().map(|(g, c)| (curves[g].clone(), shrunk(c))).collect();
    terms.learnt_share = share;
    context.fit_again(&fitted.model, &terms, rows)
}

/// The fit of a fold, in which the residual of a model is learnt again.
pub(super) fn learnt_again(context: &Context<'_>, fitted: Fitted, rows: &[usize], share: f64) -> Fitted {
    with_residual(context, &fitted, rows, &smooths(context.data), share, MOST).unwrap_or(fitted)
}
