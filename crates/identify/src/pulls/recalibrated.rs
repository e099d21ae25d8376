//! The recalibrated baseline: what a calibration writes, and a diagnosis that finds nothing.

use super::context::Context;
use super::fitting::Fitted;
use super::scatter::scatter;
use super::terms::Terms;
use gripgen_twin::predict::PullModel;

/// Least scatter with which a fit weighs residuals.
const MIN_SCATTER: f64 = 0.002;

/// Value and 90 % interval of the scatter.
type Scatter = (f64, f64, f64);

/// The plain baseline as a calibration states and writes it, with the context that predicts it and its scatter: what a diagnosis is compared
/// with, and what it writes where it finds nothing. `context` has seen the tails of the residuals and nothing else.
pub(super) fn recalibrated<'a>(
    mut context: Context<'a>,
    rows: &[usize],
) -> Option<(Context<'a>, Fitted, Scatter)> {
    context.learn_lag(rows);
    context.settle_dynamics();
    context.free_lag = context.observations.is_empty();
    let (found, scattered) = corrected(&mut context, &Terms::default(), rows)?;
    context.free_lag = false;
    let (context, stated) = context.stated(&found);
    Some((context, stated, scattered))
}

/// A fit through the simulator at the scatter that it shows, and that scatter with its interval.
pub(super) fn corrected(
    context: &mut Context<'_>,
    terms: &Terms,
    rows: &[usize],
) -> Option<(Fitted, Scatter)> {
    let first = context.fit(&context.base, terms, rows)?;
    let start = PullModel { scatter: scatter(context, &first, rows).0.max(MIN_SCATTER), ..first.model };
    context.correct_at(&start);
    let found = context.fit(&start, &first.terms, rows)?;
    let scattered = scatter(context, &found, rows);
    Some((found, scattered))
}
