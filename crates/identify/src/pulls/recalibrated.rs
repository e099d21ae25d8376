//! The recalibrated baseline: what a calibration writes, and a diagnosis that finds nothing.

use super::context::Context;
use super::fitting::Fitted;
use super::model::PullModel;
use super::scatter::scatter;
use super::terms::Terms;

/// Least scatter with which a fit weighs residuals.
const MIN_SCATTER: f64 = 0.002;

/// The plain baseline as a calibration states and writes it, with the context that predicts it: what a diagnosis is compared with, and
/// what it writes where it finds nothing. `context` has seen the tails of the residuals and nothing else.
pub(super) fn recalibrated<'a>(mut context: Context<'a>, rows: &[usize]) -> Option<(Context<'a>, Fitted)> {
    context.learn_lag(rows);
    context.settle_dynamics();
    context.free_lag = context.observations.is_empty();
    let (found, _) = corrected(&mut context, &Terms::default(), rows)?;
    context.free_lag = false;
    Some(context.stated(&found))
}

/// A fit through the simulator at the scatter that it shows, and that scatter with its interval.
pub(super) fn corrected(
    context: &mut Context<'_>,
    terms: &Terms,
    rows: &[usize],
) -> Option<(Fitted, (f64, f64, f64))> {
    let first = context.fit(&context.base, terms, rows)?;
    let start = PullModel { scatter: scatter(context, &first, rows).0.max(MIN_SCATTER), ..first.model };
    context.correct_at(&start);
    let found = context.fit(&start, &first.terms, rows)?;
    let scattered = scatter(context, &found, rows);
    Some((found, scattered))
}
