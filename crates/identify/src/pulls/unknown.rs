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
    // Residuals of everything but this curve.
    let without = |place: usize| {
        let mut terms = accepted.fitted.terms.clone();
        terms.curves.remove(place);
        if terms.effects.is_empty() && terms.curves.is_empty() {
            return before.residuals.clone();
        }
        let found = search.context.fit(&accepted.fitted.model, &terms, &search.rows);
        found.map_or_else(|| before.residuals.clone(), |f| f.residuals)
    };
    let each = accepted.curves.iter().enumerate().map(|(place, &i)| {
        let curve = &search.curves[i];
        let tested = test(data, &accepted.fitted, &without(place), curve);
        UnknownCovariate { covariate: curve.name.clone(), strength: tested.strength, p_value: tested.p_value }
    });
    let mut found: Vec<UnknownCovariate> = each.collect();
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found
}
