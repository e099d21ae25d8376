//! Dependences without a name, as they are reported.

use super::data::PullData;
use super::fitting::Fitted;
use super::screen::test;
use super::search::{Accepted, Search};
use crate::diagnosis::UnknownCovariate;

/// The covariates of accepted curves.
pub(super) fn unknown(
    search: &Search<'_>,
    before: &Fitted,
    accepted: &Accepted,
    data: &PullData<'_>,
) -> Vec<UnknownCovariate> {
    // Residuals of everything but the curves.
    let residuals = if accepted.effects.is_empty() {
        before.residuals.clone()
    } else {
        let mut terms = accepted.fitted.terms.clone();
        terms.curves.clear();
        match search.context.fit(&accepted.fitted.model, &terms, &search.rows) {
            Some(f) => f.residuals,
            None => before.residuals.clone(),
        }
    };
    let each = accepted.curves.iter().map(|&i| {
        let curve = &search.curves[i];
        let tested = test(data, &accepted.fitted, &residuals, curve);
        UnknownCovariate { covariate: curve.name.clone(), strength: tested.strength, p_value: tested.p_value }
    });
    let mut found: Vec<UnknownCovariate> = each.collect();
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found
}
