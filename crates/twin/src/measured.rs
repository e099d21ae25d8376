//! Pulls that were measured, or simulated and taken as if they were.

use crate::config::Feedback;
use crate::draw::Drawn;
use crate::values::median;
use crate::{Covariates, PULLS_SINCE_REST, PullCount, PullTrace, SINCE_ZERO, Values};

/// Medians of a label over twice the grip force that gels and parts can give; beyond it the numbers are in another unit.
pub const POSSIBLE_LABEL_RATIO: (f64, f64) = (0.004, 4.0);

/// Labels over twice the grip force of a jaw, their (upper) median; `None` without pulls.
pub fn median_label_ratio(pulls: &[MeasuredPull]) -> Option<f64> {
    median(pulls.iter().map(|p| p.max_pull_force_n / (2.0 * p.grip_force_n)).collect())
}

/// One measured pull.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPull {
    /// Its name.
    pub id: String,
    /// Name of the part.
    pub part: String,
    /// Which of the part's grips in the twin; 0 where nobody wrote it down.
    pub grip_pose: usize,
    /// Grip force, per jaw.
    pub grip_force_n: f64,
    /// Height of a step of the staircase.
    pub increment_n: f64,
    /// Command of the first step; one increment where it is `None`.
    pub start_n: Option<f64>,
    /// Length of a step.
    pub step_s: f64,
    /// Circumstances; those that nobody wrote down have their defaults.
    pub covariates: Covariates,
    /// The label, less [`zero_shift_n`](Self::zero_shift_n).
    pub max_pull_force_n: f64,
    /// How far the sensor's zero had moved along the pull when the jaws slipped, from readings without a load before and after;
    /// readings of the trace still have it. 0 where nobody read them.
    pub zero_shift_n: f64,
    /// The force over time. Rows before time 0 are the no-load reading.
    pub trace: Option<PullTrace>,
}

/// A column whose meaning is not known.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraColumn {
    /// Its name.
    pub name: String,
    /// One value per pull.
    pub values: Values,
}

/// A campaign of measured pulls, in the order in which they were made.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPulls {
    /// The pulls.
    pub pulls: Vec<MeasuredPull>,
    /// Names of those of [`crate::columns::covariates`] that were written down.
    pub recorded: Vec<String>,
    /// Columns whose meaning is not known.
    pub extra: Vec<ExtraColumn>,
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
    /// Displacement at which a pull ends.
    pub stop_m: f64,
    /// What the force loop closed on, where it is known.
    pub feedback: Option<Feedback>,
    /// SHA-256 of the files it was read from.
    pub sha256: String,
}

impl MeasuredPulls {
    /// Every so many pulls, in order, with their columns.
    #[must_use]
    pub fn every(&self, step: usize) -> Self {
        let step = step.max(1);
        self.kept(|i| i % step == 0)
    }

    /// The pulls for whose place `keep` is true, in order, with their columns.
    #[must_use]
    pub fn kept(&self, keep: impl Fn(usize) -> bool) -> Self {
        let extra = self
            .extra
            .iter()
            .map(|column| ExtraColumn { name: column.name.clone(), values: column.values.kept(&keep) });
        Self {
            pulls: self.pulls.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, p)| p.clone()).collect(),
            recorded: self.recorded.clone(),
            extra: extra.collect(),
            sha256: self.sha256.clone(),
            ..*self
        }
    }

    /// Gives every pull the covariates [`PULLS_SINCE_REST`] and [`SINCE_ZERO`], unless they were written down. Without a rest, or without a
    /// zeroing after the first pull, it is not added.
    pub fn count(&mut self) {
        let known = |name: &str| self.recorded.iter().any(|c| c == name);
        let written = |name: &str| self.extra.iter().any(|c| c.name == name);
        if !(known("session") || known("time_s")) {
            return;
        }
        let indexed = known("pull_index");
        let mut count = PullCount::default();
        let each = |(i, pull): (usize, &MeasuredPull)| {
            let index = if indexed { pull.covariates.pull_index } else { i as u64 };
            count.next(&Covariates { pull_index: index, ..pull.covariates.clone() })
        };
        let counted: Vec<(u64, f64)> = self.pulls.iter().enumerate().map(each).collect();
        let rests = count.rests > 0 && !written(PULLS_SINCE_REST);
        let zeroings = count.zeroings > 0 && known("time_s") && !written(SINCE_ZERO);
        for (pull, (pulls, seconds)) in self.pulls.iter_mut().zip(counted) {
            let extra = &mut pull.covariates.extra;
            if rests {
                extra.insert(PULLS_SINCE_REST.into(), Drawn::Number(pulls as f64));
            }
            if zeroings {
                extra.insert(SINCE_ZERO.into(), Drawn::Number(seconds));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulls_are_counted_from_the_last_rest() {
        let pull = |i: u64, session: &str, time_s: f64| MeasuredPull {
            id: i.to_string(),
            part: "p".into(),
            grip_pose: 0,
            grip_force_n: 10.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.1,
            covariates: Covariates { pull_index: i, session: session.into(), time_s, ..Default::default() },
            max_pull_force_n: 3.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        let mut measured = MeasuredPulls {
            pulls: vec![
                pull(4, "1", 0.0),
                pull(5, "1", 60.0),
                pull(8, "1", 120.0),
                pull(9, "1", 1200.0),
                pull(10, "2", 1260.0),
                pull(11, "2", 1320.0),
            ],
            recorded: vec!["session".into(), "pull_index".into(), "time_s".into()],
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            sha256: String::new(),
        };
        let since = |m: &MeasuredPulls| -> Vec<Option<Drawn>> {
            m.pulls.iter().map(|p| p.covariates.extra.get(PULLS_SINCE_REST).cloned()).collect()
        };
        measured.count();
        let wanted = [0.0, 1.0, 4.0, 0.0, 0.0, 1.0].map(|x| Some(Drawn::Number(x)));
        assert_eq!(since(&measured), wanted);
        let half = measured.every(2);
        assert_eq!(half.pulls.iter().map(|p| p.id.as_str()).collect::<Vec<_>>(), ["4", "8", "10"]);
        assert_eq!(since(&half), [wanted[0].clone(), wanted[2].clone(), wanted[4].clone()]);
        measured.pulls.truncate(3);
        measured.pulls.iter_mut().for_each(|p| p.covariates.extra.clear());
        measured.count();
        assert_eq!(since(&measured), [None, None, None], "no rest, nothing to count from");
    }
}
