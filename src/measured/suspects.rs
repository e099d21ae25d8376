//! What becomes of measured pulls whose label is suspect.

use super::Standing;
use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_twin::PullTrace;
use gripgen_twin::evidence::recorded_may_be_the_rig;

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

/// How a pull of a run stands: as it was judged when it was made, with more than the run keeps (the readings without a load after it).
pub(super) fn standing_of(sample: &Sample, trace: Option<&PullTrace>) -> Standing {
    let suspect = sample.status() == Status::Suspect;
    Standing {
        status: sample.status(),
        reason: sample.status_reason.clone(),
        may_be_the_rig: suspect && recorded_may_be_the_rig(&sample.status_reason),
        judged: trace.is_some(),
    }
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

    #[test]
    fn a_zero_that_moved_is_the_rig_unless_something_else_speaks_too() {
        let of = |status: Status, status_reason: &str| {
            let status_reason = status_reason.into();
            let sample = Sample { status: status.into(), status_reason, ..Sample::default() };
            standing_of(&sample, None).may_be_the_rig
        };
        let moved = "the sensor's zero is 0.87 N, and was -0.00 N before the pull (0.30 N are allowed)";
        assert!(of(Status::Suspect, moved));
        assert!(!of(Status::Suspect, &format!("{moved}; the left camera fell silent")));
        assert!(!of(Status::Slipped, moved));
    }
}
