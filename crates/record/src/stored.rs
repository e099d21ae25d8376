//! A stored sample as the columns of a pull see it.

use crate::proto::gripgen_v1 as proto;
use gripgen_twin::columns::notes::TEMPERATURE;
use gripgen_twin::columns::{Held, PullView, Scale, find};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{Covariates, is_own_column};

/// The circumstances of a stored sample: the inverse of the message of a scenario. Columns without a field of their own, and those of
/// the user's own, are those that were drawn or measured beside the others.
pub fn sample_covariates(s: &proto::Sample) -> Covariates {
    let numbers = s.drawn_number.iter().filter(|(_, x)| x.is_finite());
    let numbers = numbers.map(|(name, x)| (name, Drawn::Number(*x)));
    let words = s.drawn_text.iter().filter(|(_, word)| !word.is_empty());
    let words = words.map(|(name, word)| (name, Drawn::Text(word.clone())));
    let has_no_field = |name: &str| match find(name) {
        Some(column) => column.name == name && matches!(column.held, Held::Extra),
        None => is_own_column(name),
    };
    // A temperature that was not measured is stored as NaN. A simulation of the pull needs a number: that of a table without the column.
    let unmeasured = s.temperature_c.is_nan();
    let extra = numbers.chain(words).filter(|(name, _)| has_no_field(name));
    Covariates {
        gel_id: s.gel_id.clone(),
        session: s.session.clone(),
        pull_index: s.pull_index,
        time_s: s.time_s,
        temperature_c: if unmeasured { Covariates::default().temperature_c } else { s.temperature_c },
        dwell_s: s.dwell_s,
        grip_offset_m: Scale::Thousandth.to_si(s.grip_offset_mm),
        grip_angle_rad: Scale::Degree.to_si(s.grip_angle_deg),
        pull_direction: f64::from(s.pull_direction),
        extra: extra.map(|(name, value)| (name.clone(), value)).collect(),
        missing: unmeasured.then_some(TEMPERATURE).into_iter().collect(),
    }
}

/// A stored sample as the columns read it, beside its circumstances.
pub fn sample_view<'a>(s: &'a proto::Sample, covariates: &'a Covariates) -> PullView<'a> {
    PullView {
        part: &s.part,
        grip_pose: s.grip_pose as usize,
        grip_force_n: s.grip_force_n,
        increment_n: s.force_increment_n,
        start_n: s.force_start_n,
        step_s: s.step_time_s,
        covariates,
    }
}
