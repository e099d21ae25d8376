//! What the tables of a twin do to a pull.

use super::TableTarget;
use crate::{Scenario, Twin};

/// By what the tables of a twin multiply the friction of a pull; 1 without any.
pub fn table_factor(twin: &Twin, scenario: &Scenario) -> f64 {
    let factors = twin.tables.iter().filter(|t| t.target == TableTarget::Factor);
    factors.filter_map(|t| t.at(scenario.view())).product()
}

/// What the tables of a twin add to the readings of the wrist sensor, in newtons; 0 without any.
pub fn table_offset_n(twin: &Twin, scenario: &Scenario) -> f64 {
    let offsets = twin.tables.iter().filter(|t| t.target == TableTarget::Offset);
    offsets.filter_map(|t| t.at(scenario.view())).fold(0.0, |sum, x| sum + x)
}
