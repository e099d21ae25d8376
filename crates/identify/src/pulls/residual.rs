//! What no name explains is still learnt: a residual over several columns at once, beside the named effects. It multiplies the friction, is
//! shrunk (`evidence.rs`), and is kept where it is rarer than chance and pays on pulls, levels and sessions that it has not seen.

use super::context::Context;
use super::curves::Curve;
use super::evidence::Grouped;
use super::fitting::Fitted;
use super::heldout::{by_value, predicted};
use super::model::PullModel;
use super::paying::{held_out, root_mean_square, share};
use super::search::Search;
use super::smooth::smooths;
use super::terms::Terms;
use crate::diagnosis::{Residual, UnknownCovariate};
use nalgebra::{DMatrix, DVector};

/// How often chance may look as good.
const CHANCE: f64 = 0.015;

/// Share of the error on held-out pulls that a residual has to take off, and may add on held-out levels and sessions.
const PAYS: f64 = 0.03;
const WORSE: f64 = 0.01;

/// Step of the logarithm of the friction by which the labels are differentiated.
const STEP: f64 = 0.02;

/// Fewest pulls.
const MIN_PULLS: usize = 16;

/// Part of a residual that held-out pulls have to confirm.
const CONFIRMED: f64 = 0.4;

/// A residual that is kept.
pub(super) struct Kept {
    /// The model with it.
    pub fitted: Fitted,
    /// As it is reported.
    pub report: Residual,
    /// Its columns, as structure that no name explains.
    pub unknown: Vec<UnknownCovariate>,
}

/// What is left of the pulls at `rows` beside a model, as groups of columns in units of the noise.
fn grouped(context: &Context<'_>, fitted: &Fitted, rows: &[usize], curves: &[Curve]) -> Option<Grouped> {
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
    let memory = fitted.likelihood.memory;
    let sessions: Vec<usize> = rows.iter().map(|&i| context.data.session_of[i]).collect();
    // Neighbours that remember each other: what is new in each pull.
    let whitened = |raw: &dyn Fn(usize) -> f64| {
        let own = |k: usize| weights[k] * raw(k);
        DVector::from_iterator(
            rows.len(),
            (0..rows.len()).map(|k| match k.checked_sub(1).filter(|&last| sessions[last] == sessions[k]) {
                Some(last) => (own(k) - memory * own(last)) / (1.0 - memory * memory).sqrt(),
                None => own(k),
            }),
        )
    };
    let y = whitened(&|k| residuals[k]);
    let known: Vec<DVector<f64>> = known.iter().map(|c| whitened(&|k| c[k])).collect();
    let groups: Vec<DMatrix<f64>> = curves
        .iter()
        .map(|curve| {
            let of = |j: usize| whitened(&|k| by_factor[k] * curve.basis[rows[k]][j]);
            DMatrix::from_columns(&(0..curve.len()).map(of).collect::<Vec<_>>())
        })
        .collect();
    Grouped::new(&y, &DMatrix::from_columns(&known), &groups)
}

/// `fitted` with what the pulls at `rows` teach beside it, shrunk once more to `share` of it.
fn with_residual(
    context: &Context<'_>,
    fitted: &Fitted,
    rows: &[usize],
    curves: &[Curve],
    share: f64,
) -> Option<Fitted> {
    let learnt = grouped(context, fitted, rows, curves)?.learn();
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
    with_residual(context, &fitted, rows, &smooths(context.data), share).unwrap_or(fitted)
}

/// What is left beside `fitted` in several columns at once, if it is rarer than chance and pays. `near` are the pulls that count.
pub(super) fn kept(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Kept> {
    let context = search.context;
    let data = context.data;
    let curves = smooths(data);
    if data.len() < MIN_PULLS || curves.is_empty() {
        return None;
    }
    // What traces show of signals stays as it is, which is fast.
    let held = Terms { hold_signals: fitted.terms.act_on_signals(), ..fitted.terms.clone() };
    let plain = context.fit_again(&fitted.model, &held, &search.rows)?;
    let left = grouped(context, &plain, &search.rows, &curves)?;
    let learnt = left.learn();
    if learnt.groups.is_empty() {
        return None;
    }
    let p_value = left.p_value();
    if p_value > CHANCE {
        return None;
    }
    let full = with_residual(context, &plain, &search.rows, &curves, 1.0)?;
    // As much of it as held-out pulls confirm.
    let expected = context.predictor.pulls(&plain.model, &search.rows);
    let [without, with] = [&plain, &full].map(|f| held_out(context, f, repetitions, near));
    let (mut along, mut square) = (0.0, 0.0);
    for ((i, before), (k, after)) in without.iter().zip(&with) {
        if i != k {
            return None;
        }
        let sd = expected[*i].label_sd_n.max(0.03);
        let moved = (after - before) / sd;
        // A few bad pulls decide nothing.
        let error = (before / sd).clamp(-4.0, 4.0);
        along -= moved * error;
        square += moved * moved;
    }
    let confirmed = (along / square.max(1e-300)).clamp(0.0, 1.0);
    if confirmed < CONFIRMED {
        return None;
    }
    let chosen = with_residual(context, &plain, &search.rows, &curves, confirmed)?;
    let with = held_out(context, &chosen, repetitions, near);
    let error = |e: &[(usize, f64)]| root_mean_square(e.iter().map(|(_, e)| *e));
    let weighed =
        |e: &[(usize, f64)]| root_mean_square(e.iter().map(|(i, e)| e / expected[*i].label_sd_n.max(0.03)));
    let gain = share([error(&without), error(&with)]);
    if gain.max(share([weighed(&without), weighed(&with)])) < PAYS
        || gain < 0.0
        || !holds(context, &plain, &chosen, near)
    {
        return None;
    }
    let mut strengths: Vec<UnknownCovariate> = Vec::new();
    for (group, coefficients) in &learnt.groups {
        let (covariate, strength) = (&curves[*group].name, left.strength(*group, coefficients));
        match strengths.iter_mut().find(|u| u.covariate == *covariate) {
            Some(known) => known.strength += strength,
            None => strengths.push(UnknownCovariate { covariate: covariate.clone(), strength, p_value }),
        }
    }
    strengths.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let report = Residual { gain, covariates: strengths.iter().map(|u| u.covariate.clone()).collect() };
    let mut fitted = chosen;
    fitted.terms.hold_signals = false;
    Some(Kept { fitted, report, unknown: strengths })
}

/// A residual in the place of the unnamed curves of `fitted`, where it predicts pulls and sessions that were held out better together:
/// a curve of few knots, or one at one word, may stand for several columns.
pub(super) fn in_place_of_curves(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Kept> {
    let context = search.context;
    let terms = Terms { curves: vec![], hold_signals: fitted.terms.act_on_signals(), ..fitted.terms.clone() };
    let bare = context.fit(&fitted.model, &terms, &search.rows)?;
    let found = kept(search, &bare, repetitions, near)?;
    let error =
        |f: &Fitted| root_mean_square(held_out(context, f, repetitions, near).into_iter().map(|(_, e)| e));
    let pulls = error(&found.fitted) / error(fitted).max(1e-300);
    let session: Vec<u64> = context.data.session_of.iter().map(|&s| s as u64).collect();
    let sessions = by_value(&session);
    let together = if (3..=20).contains(&sessions.len()) {
        pulls * error_on(context, &found.fitted, &sessions, near)
            / error_on(context, fitted, &sessions, near).max(1e-300)
    } else {
        pulls
    };
    (together < 1.0 && pulls <= 1.0 + PAYS).then_some(found)
}

/// Error on sets that are held out, of the pulls of `near`.
fn error_on(context: &Context<'_>, fitted: &Fitted, sets: &[Vec<usize>], near: &[usize]) -> f64 {
    let labels = predicted(context, fitted, sets, true);
    let known = near.iter().map(|&i| labels[i] - context.data.label_n[i]).filter(|e| e.is_finite());
    root_mean_square(known)
}

/// Whether levels and sessions that were held out are predicted no worse with a residual, where there are enough of them.
fn holds(context: &Context<'_>, plain: &Fitted, with: &Fitted, near: &[usize]) -> bool {
    let data = context.data;
    let force: Vec<u64> = data.measured.pulls.iter().map(|p| p.grip_force_n.to_bits()).collect();
    let session: Vec<u64> = data.session_of.iter().map(|&s| s as u64).collect();
    [by_value(&force), by_value(&session)].iter().all(|sets| {
        if !(3..=20).contains(&sets.len()) {
            return true;
        }
        let errors = [plain, with].map(|f| error_on(context, f, sets, near));
        share(errors) >= -WORSE
    })
}
