//! A campaign as numbers.

use super::levels::levels;
use gripgen_twin::columns::covariates;
use gripgen_twin::values::distinct;
use gripgen_twin::{MeasuredPulls, Values};
use std::collections::BTreeMap;

/// A column of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers, all finite.
    Number(Vec<f64>),
    /// Words, as positions in a sorted list of them; behind its end where nobody wrote one down.
    Word(Vec<usize>, Vec<String>),
}

impl From<Values> for Column {
    /// Numbers without gaps, words as positions.
    fn from(values: Values) -> Self {
        match values.without_gaps() {
            Values::Numbers(x) => Column::Number(x),
            Values::Words(words) => {
                let (at, names) = Values::coded(&words);
                // The empty word is the first of all, and no word.
                match names.split_first() {
                    Some((first, names)) if first.is_empty() => {
                        let at = at.into_iter().map(|i| i.checked_sub(1).unwrap_or(names.len()));
                        Column::Word(at.collect(), names.to_vec())
                    }
                    _ => Column::Word(at, names),
                }
            }
        }
    }
}

/// Rows that have no value.
fn missing(values: &Values) -> Vec<usize> {
    (0..values.len()).filter(|&row| values.at(row).is_none()).collect()
}

impl Column {
    /// Number of different values.
    pub fn distinct(&self) -> usize {
        match self {
            Column::Word(_, words) => words.len(),
            Column::Number(x) => distinct(x),
        }
    }
}

/// What is asked about a campaign beside its pulls.
#[derive(Debug, Clone)]
pub struct PullData<'a> {
    /// The pulls.
    pub measured: &'a MeasuredPulls,
    /// Names of the parts; positions elsewhere mean these.
    pub parts: Vec<String>,
    /// Part of each pull.
    pub part_of: Vec<usize>,
    /// Labels.
    pub label_n: Vec<f64>,
    /// Columns that were written down, by name, in a fixed order; dwells as the levels that were meant (`levels.rs`).
    pub columns: BTreeMap<String, Column>,
    /// Rows of a column in which nobody wrote a value down, of those columns that have such rows.
    pub missing: BTreeMap<String, Vec<usize>>,
    /// Session of each pull, as a position.
    pub session_of: Vec<usize>,
    /// Pulls of one configuration share a number.
    pub group_of: Vec<usize>,
}

/// Numbers of consecutive runs of equal keys, in the order of their first pulls.
fn numbered<K: Ord + Clone>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut known = BTreeMap::new();
    keys.map(|k| {
        let next = known.len();
        *known.entry(k).or_insert(next)
    })
    .collect()
}

impl<'a> PullData<'a> {
    /// Looks at a campaign.
    pub fn new(measured: &'a MeasuredPulls) -> Self {
        let pulls = &measured.pulls;
        let mut columns = BTreeMap::new();
        let mut gaps = BTreeMap::new();
        let mut add = |name: &str, values: Values| {
            gaps.insert(name.to_string(), missing(&values));
            columns.insert(name.to_string(), values.into());
        };
        for column in covariates().filter(|c| measured.recorded.iter().any(|name| name == c.name)) {
            add(column.name, column.values(pulls));
        }
        for extra in &measured.extra {
            add(&extra.name, extra.values.clone());
        }
        gaps.retain(|_, rows| !rows.is_empty());
        let mut dwell_s: Vec<f64> = pulls.iter().map(|p| p.covariates.dwell_s).collect();
        if let Some(Column::Number(carried_out)) = columns.get_mut("dwell_s") {
            *carried_out = levels(carried_out);
            dwell_s.clone_from(carried_out);
        }
        let (part_of, parts) = Values::coded(&pulls.iter().map(|p| p.part.clone()).collect::<Vec<_>>());
        let session_of = numbered(pulls.iter().map(|p| p.covariates.session.clone()));
        let group_of = numbered(pulls.iter().zip(&dwell_s).map(|(p, dwell_s)| {
            let c = &p.covariates;
            let numbers = [
                p.grip_force_n,
                p.increment_n,
                p.start_n.unwrap_or(p.increment_n),
                p.step_s,
                *dwell_s,
                c.grip_offset_m,
                c.grip_angle_rad,
                c.pull_direction,
            ];
            (p.part.clone(), numbers.map(f64::to_bits))
        }));
        Self {
            measured,
            parts,
            part_of,
            label_n: pulls.iter().map(|p| p.max_pull_force_n).collect(),
            columns,
            missing: gaps,
            session_of,
            group_of,
        }
    }

    /// Number of pulls.
    pub fn len(&self) -> usize {
        self.label_n.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.label_n.is_empty()
    }

    /// Whether a column was written down, or counted, and varies.
    pub fn varies(&self, name: &str) -> bool {
        let counted = || {
            let each: Vec<_> = self.measured.pulls.iter().map(|p| p.covariates.extra.get(name)).collect();
            each.windows(2).any(|pair| pair[0] != pair[1])
        };
        self.columns.get(name).map_or_else(counted, |c| c.distinct() > 1)
    }

    /// Numbers of a column, words as their positions.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        Some(match self.columns.get(name)? {
            Column::Number(x) => x.clone(),
            Column::Word(at, _) => at.iter().map(|&i| i as f64).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::{Covariates, MeasuredPull, PlannedPull};

    /// A rig that should wait for 1 s and 10 s does so nearly: two settings, of two and three repetitions.
    #[test]
    fn pulls_that_waited_nearly_the_same_time_are_repetitions() {
        let pull = |dwell_s: f64| MeasuredPull {
            id: String::new(),
            part: "rod".into(),
            grip_pose: 0,
            grip_force_n: 20.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates { dwell_s, ..PlannedPull::default().covariates() },
            max_pull_force_n: 8.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        let measured = |dwells_s: &[f64]| MeasuredPulls {
            pulls: dwells_s.iter().map(|s| pull(*s)).collect(),
            recorded: vec!["dwell_s".into()],
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            sha256: String::new(),
        };
        let two = measured(&[1.02, 10.2, 1.11, 10.1, 10.4]);
        let data = PullData::new(&two);
        assert_eq!(data.group_of, [0, 1, 0, 1, 1]);
        assert_eq!(data.columns["dwell_s"].distinct(), 2);
        assert!(!PullData::new(&measured(&[1.02, 1.31, 1.11])).varies("dwell_s"), "planned as one");
    }
}
