//! Which label is expected of a grip of a part at a grip force, and how far a pull is from it.

use super::rows::Rows;
use gripgen_identify::RobustLine;
use std::collections::BTreeMap;

/// What is expected of a pull, and how far it is from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// Label that its grip has at its force.
    pub(super) label_n: f64,
    /// Standard deviations of the grip by which its label is above that.
    pub(super) deviations: f64,
}

/// Lines by part and grip, and what they say of each row.
pub(super) struct ExpectedLabels {
    pub(super) lines: BTreeMap<(String, String), RobustLine>,
    rows: Vec<Option<Expected>>,
}

impl ExpectedLabels {
    pub(super) fn of_row(&self, row: usize) -> Option<Expected> {
        self.rows[row]
    }
}

/// Fits a line to the slipped pulls of each grip of each part.
pub(super) fn expected(rows: &Rows<'_>) -> ExpectedLabels {
    let key = |row: usize| (rows.part(row).to_string(), rows.grip(row));
    let mut of_grip: BTreeMap<(String, String), Vec<(f64, f64)>> = BTreeMap::new();
    let pull = |row: usize| {
        let (force, label) = (rows.force_n(row), rows.label_n(row));
        (force > 0.0 && force.is_finite() && label.is_finite()).then_some((force, label))
    };
    for row in (0..rows.len()).filter(|&row| rows.status(row) == "slipped") {
        if let Some(pull) = pull(row) {
            of_grip.entry(key(row)).or_default().push(pull);
        }
    }
    let lines: BTreeMap<(String, String), RobustLine> =
        of_grip.into_iter().filter_map(|(grip, pulls)| Some((grip, RobustLine::of(&pulls)?))).collect();
    let of_row = |row: usize| {
        let line = lines.get(&key(row))?;
        // A lower bound, or nothing, is no deviation.
        let (force, label) = pull(row).filter(|_| ["slipped", "suspect"].contains(&rows.status(row)))?;
        let expected = line.at(force);
        Some(Expected { label_n: expected, deviations: (label - expected) / (line.scatter * force) })
    };
    ExpectedLabels { rows: (0..rows.len()).map(of_row).collect(), lines }
}
