//! What becomes of measured pulls whose label is suspect.

use super::Standing;
use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_twin::PullTrace;
use gripgen_twin::evidence::{Expected, Finding, FindingKind, LabelEvidence, ZERO_SHIFT, judge};

/// What becomes of measured pulls whose label is suspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Suspects {
    /// They are left out, and counted in a note.
    #[default]
    LeaveOut,
    /// For a diagnosis, which looks for effects of sensor and robot: those that such an effect may be behind stay where they are
    /// many ([`OF_THE_RIG`]), because then it is the rig and not the pull.
    Screen,
    /// They are taken like all others.
    Include,
}

/// Share of the judged pulls from which on it is the rig.
pub const OF_THE_RIG: f64 = 0.2;

/// How a pull of a run stands; what is recorded there was judged when it was made. The readings without a load after it are not
/// kept, but how far the zero had moved is, and is taken off the label: such a zero is the rig.
pub(super) fn standing_of(sample: &Sample, trace: Option<&PullTrace>) -> Standing {
    let suspect = sample.status() == Status::Suspect;
    let rig = || {
        let (label_n, stop_m) = (sample.max_pull_force_n.unwrap_or(f64::NAN), sample.stop_mm * 1e-3);
        let of_trace = LabelEvidence::of_trace(label_n, sample.label_tolerance_n, stop_m, trace);
        let judgement = judge(&LabelEvidence { every_reading: true, ..of_trace }, &Expected::default());
        let again: Vec<String> = judgement.reasons().map(Finding::to_string).collect();
        let again: Vec<String> = again.iter().flat_map(|reason| words_of(reason)).collect();
        let moved = sample.drawn_number.get(ZERO_SHIFT).is_some_and(|n| n.is_finite());
        // Any other reason in the record was a camera, the gripper, a push from the side: nothing that a twin can have.
        let known = |words: &String| again.contains(words) || (moved && is_of_the_zero(words));
        let mut recorded = words_of(&sample.status_reason).peekable();
        recorded.peek().is_some()
            && recorded.all(|words| known(&words))
            && judgement.reasons().all(|finding| finding.kind.may_be_the_rig())
    };
    Standing {
        status: sample.status(),
        reason: sample.status_reason.clone(),
        may_be_the_rig: suspect && rig(),
        judged: trace.is_some(),
    }
}

/// The reasons of a record, which are joined by semicolons, without their numbers and what stands in brackets.
fn words_of(status_reason: &str) -> impl Iterator<Item = String> {
    let words = |reason: &str| -> String {
        let before = reason.split(" (").next().unwrap_or_default();
        before.chars().filter(|c| !c.is_ascii_digit() && *c != '-').collect()
    };
    // In brackets there is a semicolon too: "(0.33 N are allowed; at 0.10 s)".
    status_reason.split("; ").filter(|reason| !reason.is_empty() && !reason.starts_with("at ")).map(words)
}

/// Whether a reason without its numbers says that the zero moved.
fn is_of_the_zero(words: &str) -> bool {
    let kind = FindingKind::ZeroShift;
    let finding = Finding { kind, found: 0.0, wanted: 0.0, allowed: 0.0, time_s: None };
    words_of(&finding.to_string()).any(|of_finding| of_finding == words)
}

/// Which pulls are taken: those that slipped, and of the suspect ones what was asked for. Beside it a note for people.
pub(super) fn kept(standing: &[Standing], ids: &[&str], suspects: Suspects) -> (Vec<bool>, Option<String>) {
    let is_suspect = |s: &Standing| s.status == Status::Suspect;
    let of_the_rig = standing.iter().filter(|s| s.may_be_the_rig).count();
    let judged = standing.iter().filter(|s| s.judged).count();
    let rig = suspects == Suspects::Screen && of_the_rig as f64 >= OF_THE_RIG * judged.max(1) as f64;
    let taken = |s: &Standing| match suspects {
        Suspects::Include => true,
        Suspects::Screen => rig && s.may_be_the_rig,
        Suspects::LeaveOut => false,
    };
    let keep = standing.iter().map(|s| s.status == Status::Slipped || (is_suspect(s) && taken(s))).collect();
    let all = standing.iter().filter(|s| is_suspect(s)).count();
    let out = standing.iter().filter(|s| is_suspect(s) && !taken(s)).count();
    let mut notes = Vec::new();
    if out > 0 {
        let first = standing.iter().zip(ids).find(|(s, _)| is_suspect(s) && !taken(s));
        let first = first.map_or(String::new(), |(s, id)| format!("; pull {id}: {}", s.reason));
        notes.push(format!("{out} pulls were left out: their labels are suspect (--include-suspect){first}"));
    }
    if out < all {
        let why = match suspects {
            Suspects::Include => "taken as asked",
            _ => "taken because so many of them are so that it is the rig and not the pulls",
        };
        let first = standing.iter().zip(ids).find(|(s, _)| is_suspect(s) && taken(s));
        let first = first.map_or(String::new(), |(s, id)| format!("; pull {id}: {}", s.reason));
        notes.push(format!("{} pulls whose labels are suspect were {why}{first}", all - out));
    }
    (keep, (!notes.is_empty()).then(|| notes.join(". ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::slip_label;

    #[test]
    fn suspects_are_taken_where_they_are_asked_for_or_are_the_rig() {
        let stands = |status, may_be_the_rig| Standing {
            status,
            reason: "because".into(),
            may_be_the_rig,
            judged: true,
        };
        let of = |rig: usize, pull: usize, fine: usize| -> Vec<Standing> {
            let suspect = (0..rig + pull).map(|i| stands(Status::Suspect, i < rig));
            suspect.chain((0..fine).map(|_| stands(Status::Slipped, false))).collect()
        };
        let taken = |all: &[Standing], suspects| {
            let ids: Vec<&str> = all.iter().map(|_| "p").collect();
            let (keep, note) = kept(all, &ids, suspects);
            (keep.iter().filter(|k| **k).count(), note.unwrap_or_default())
        };
        let many = of(5, 2, 13);
        assert_eq!(taken(&many, Suspects::LeaveOut).0, 13);
        assert!(taken(&many, Suspects::LeaveOut).1.starts_with("7 pulls were left out"));
        assert_eq!(taken(&many, Suspects::Screen).0, 18);
        assert_eq!(taken(&many, Suspects::Include).0, 20);
        assert_eq!(taken(&of(2, 0, 18), Suspects::Screen).0, 18, "two pulls are no rig");
        assert_eq!(taken(&of(0, 0, 3), Suspects::Screen), (3, String::new()));
    }

    /// A second without a load, 10 N in steps of 0.1 s, then it slips.
    fn trace() -> PullTrace {
        let (mut trace, mut held_n) = (PullTrace::default(), 0.0);
        for i in -50..=70 {
            let time_s = 0.02 * f64::from(i);
            let desired_n = if time_s < 0.0 { 0.0 } else { 1.0 + (10.0 * time_s + 1e-9).floor() };
            let slipped_s = (time_s - 1.0).max(0.0);
            trace.time_s.push(time_s);
            trace.desired_force_n.push(desired_n);
            let wiggle_n = if i % 2 == 0 { 0.02 } else { -0.02 };
            trace.measured_force_n.push(if slipped_s > 0.0 { 6.0 } else { held_n } + wiggle_n);
            held_n += 0.2 * (desired_n - held_n);
            trace.displacement_m.push(1e-5 * desired_n + 0.02 * slipped_s);
        }
        trace
    }

    #[test]
    fn a_zero_that_moved_is_the_rig_unless_something_else_speaks_too() {
        let trace = trace();
        let of = |shift_n: f64, status_reason: &str| {
            let sample = Sample {
                status: Status::Suspect.into(),
                status_reason: status_reason.into(),
                max_pull_force_n: slip_label(&trace, 3.0, true).ok().map(|label| label.max_pull_force_n),
                label_tolerance_n: 3.0,
                stop_mm: 5.0,
                drawn_number: [(ZERO_SHIFT.to_string(), shift_n)].into(),
                ..Sample::default()
            };
            standing_of(&sample, Some(&trace)).may_be_the_rig
        };
        let moved = "the sensor's zero is 0.81 N, and was 0.00 N before the pull";
        assert!(of(0.8, moved));
        assert!(!of(0.8, &format!("{moved}; the left camera fell silent")));
        assert!(of(0.28, moved), "0.33 N after the pull are less at its slip");
        assert!(!of(0.01, "the left camera fell silent"));
        assert!(!of(f64::NAN, moved), "nobody read it");
    }
}
