//! The end of a range that only one level of the grip force reaches.

use crate::diagnosis::Diagnosis;
use gripgen_twin::effects::find;

/// Share of the error on held-out levels that an effect which more than one level feels takes off.
const FELT_ELSEWHERE: f64 = 0.03;

/// What is said of the end of a range, where only one level of the grip force reaches it.
pub(super) fn of_one_level(diagnosis: &Diagnosis) -> Option<String> {
    let ends = |id: &str| find(id).is_some_and(|spec| spec.pulls.is_ok_and(|fit| fit.flat_at_neutral));
    let [only] = &diagnosis.effects[..] else { return None };
    let levels = diagnosis.error.as_ref()?.by.levels.as_ref()?;
    let (before_n, after_n) = (levels.before.rmse_n?, levels.after.rmse_n?);
    (ends(&only.name) && after_n > (1.0 - FELT_ELSEWHERE) * before_n).then(|| {
        format!(
            "{} rests on one level of the grip force: where a level is held out the error is {before_n:.2} N without and {after_n:.2} N with it; \
             whatever else takes from that level looks the same, and pulls at levels between tell",
            only.name
        )
    })
}
