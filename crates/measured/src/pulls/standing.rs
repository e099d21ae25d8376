//! How measured pulls stand: what their table says, and what their traces say of their labels.

use super::cells::{Cells, Column, LABEL};
use super::gaps::MissingCells;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_twin::label::check::{Behind, Expected, LabelEvidence, Verdict, check_label};
use gripgen_twin::{MeasuredPull, MeasuredPulls, slip_label};

/// Labels and readings of files agree to two decimals.
const ROUNDING_N: f64 = 6e-3;

/// Measured pulls of a table, whatever became of them.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedPulls {
    /// The pulls, those without a label too: it is NaN.
    pub pulls: MeasuredPulls,
    /// How each of them stands.
    pub standing: Vec<Standing>,
    /// Their traces hold every reading of the sensor.
    pub every_reading: bool,
    /// Cells that are missing, by column.
    pub missing: MissingCells,
    /// What was not read and may be misspelt, a sentence each.
    pub warnings: Vec<String>,
}

/// How a pull stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Standing {
    /// How it ended.
    pub status: Status,
    /// Why, with numbers; empty where it slipped.
    pub reason: String,
    /// What may be behind a suspect label.
    pub behind: Behind,
    /// Its label was compared with evidence.
    pub judged: bool,
    /// It failed because its part, its grip force or its label is missing.
    pub lacks_value: bool,
}

/// What the table says. A pull that slipped, held or is suspect has a part, a grip force and a label: one that lacks them failed.
pub(super) fn stated(columns: &[Column], pulls: &mut [MeasuredPull]) -> Vec<Standing> {
    let statuses = columns.iter().find_map(|column| match &column.cells {
        Cells::Status(found) => Some(found),
        _ => None,
    });
    let reasons = columns.iter().find_map(|column| match &column.cells {
        Cells::Reason(found) => Some(found),
        _ => None,
    });
    let stated = |(row, pull): (usize, &mut MeasuredPull)| {
        let mut status = statuses.and_then(|s| s.get(row)).copied().unwrap_or(Status::Slipped);
        let mut reason = reasons.and_then(|r| r.get(row)).cloned().unwrap_or_default();
        if status == Status::NoContact && pull.max_pull_force_n.is_nan() {
            pull.max_pull_force_n = 0.0;
        }
        let lacks = match () {
            () if pull.part.is_empty() => Some("part"),
            () if pull.grip_force_n.is_nan() => Some("grip_force_n"),
            () if pull.max_pull_force_n.is_nan() => Some(LABEL),
            () => None,
        };
        let lacks = lacks.filter(|_| !matches!(status, Status::NoContact | Status::Failed));
        if let Some(column) = lacks {
            (status, reason) = (Status::Failed, format!("its `{column}` is missing"));
        }
        Standing { status, reason, behind: Behind::Pull, judged: false, lacks_value: lacks.is_some() }
    };
    pulls.iter_mut().enumerate().map(stated).collect()
}

/// Judges the labels of pulls with a trace; `after_n` are their readings without a load after the pull.
pub(super) fn judge_labels(measured: &MeasuredPulls, after_n: &[Vec<f64>], standing: &mut [Standing]) {
    let every_reading = labels_are_rows(measured, standing);
    for ((pull, after_n), standing) in measured.pulls.iter().zip(after_n).zip(standing) {
        let censored = standing.status == Status::Censored;
        if standing.status != Status::Slipped && !censored {
            continue;
        }
        let (tolerance_n, stop_m) = (measured.label_tolerance_n, measured.stop_m);
        let of_trace =
            LabelEvidence::of_trace(pull.max_pull_force_n, tolerance_n, stop_m, pull.trace.as_ref());
        let evidence = LabelEvidence { censored, every_reading, no_load_after_n: after_n, ..of_trace };
        let judgement = check_label(&evidence, &Expected::default());
        standing.judged = judgement.verdict != Verdict::NoEvidence;
        if let Some(reason) = judgement.reason() {
            *standing = Standing {
                status: Status::Suspect,
                reason,
                behind: judgement.behind(),
                judged: true,
                lacks_value: false,
            };
        }
    }
}

/// Whether the labels of a campaign are rows of their traces: most of them are. In traces with fewer rows than the label was
/// chosen from, few are.
fn labels_are_rows(measured: &MeasuredPulls, standing: &[Standing]) -> bool {
    let slipped = measured.pulls.iter().zip(standing).filter(|(_, s)| s.status == Status::Slipped);
    let (mut traced, mut equal) = (0, 0);
    for (pull, _) in slipped {
        let Some(trace) = &pull.trace else { continue };
        let kept = trace.until_displacement(measured.stop_m);
        let Ok(found) = slip_label(&kept, measured.label_tolerance_n, true) else {
            traced += 1;
            continue;
        };
        let is = |force_n: f64| (found.max_pull_force_n - force_n).abs() <= ROUNDING_N;
        // Of a force that stands still every reading is the label: that says nothing.
        let row = kept.time_s.partition_point(|&t| t < found.slip_time_s);
        let still = |i: usize| kept.measured_force_n.get(i).is_some_and(|&n| is(n));
        if still(row + 1) || row.checked_sub(1).is_some_and(still) {
            continue;
        }
        traced += 1;
        equal += usize::from(is(pull.max_pull_force_n));
    }
    traced > 0 && 2 * equal >= traced
}
