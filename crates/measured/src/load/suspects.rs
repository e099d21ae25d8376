//! What becomes of measured pulls whose label is suspect.

use super::Standing;
use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_twin::PullTrace;
use gripgen_twin::label::check::{Behind, recorded_behind};

/// What becomes of measured pulls whose label is suspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Suspects {
    /// They are left out, and counted in a note.
    #[default]
    LeaveOut,
    /// For fits: those that an effect of sensor or robot may be behind stay where they are many ([`OF_THE_RIG`]), and those that a contact
    /// may be behind where they are most ([`OF_THE_CONTACT`]), because then it is the rig and not the pull.
    Screen,
    /// They are taken like all others.
    Include,
}

/// Share of the judged pulls from which on it is the rig.
pub const OF_THE_RIG: f64 = 0.2;

/// Share of the judged pulls from which on it is the contact: readings of most pulls jump where it sticks and slips. Without these pulls no
/// trace might be left to calibrate the loop by (a line contact in an engine for rigid bodies: a baseline 6.9 N off, 1.3 N with them).
pub const OF_THE_CONTACT: f64 = 0.5;

/// How a pull of a run stands: as it was judged when it was made, with more than the run keeps (the readings without a load after it).
pub(super) fn standing_of(sample: &Sample, trace: Option<&PullTrace>) -> Standing {
    Standing {
        status: sample.status(),
        reason: sample.status_reason.clone(),
        behind: recorded_behind(&sample.status_reason),
        judged: trace.is_some(),
        lacks_value: false,
    }
}

/// Which pulls are taken: those that slipped, and of the suspect ones what was asked for. Beside it a note for people.
pub(super) fn kept(standing: &[Standing], ids: &[&str], suspects: Suspects) -> (Vec<bool>, Option<String>) {
    let is_suspect = |s: &Standing| s.status == Status::Suspect;
    let judged = standing.iter().filter(|s| s.judged).count().max(1) as f64;
    let share = |least: Behind| {
        standing.iter().filter(|s| is_suspect(s) && s.behind >= least).count() as f64 / judged
    };
    let contact = share(Behind::Contact) >= OF_THE_CONTACT;
    let rig = contact || share(Behind::Rig) >= OF_THE_RIG;
    let taken = |s: &Standing| match (suspects, s.behind) {
        (Suspects::Include, _) => true,
        (Suspects::Screen, Behind::Rig) => rig,
        (Suspects::Screen, Behind::Contact) => contact,
        (Suspects::Screen, Behind::Pull) | (Suspects::LeaveOut, _) => false,
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
        let stands = |status, behind| Standing {
            status,
            reason: "because".into(),
            behind,
            judged: true,
            lacks_value: false,
        };
        let of_three = |rig: usize, contact: usize, pull: usize, fine: usize| -> Vec<Standing> {
            let many = [(rig, Behind::Rig), (contact, Behind::Contact), (pull, Behind::Pull)];
            let suspect = many.into_iter().flat_map(|(n, behind)| vec![stands(Status::Suspect, behind); n]);
            suspect.chain(vec![stands(Status::Slipped, Behind::Pull); fine]).collect()
        };
        let of = |rig, pull, fine| of_three(rig, 0, pull, fine);
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
        // What failed is none of them, whatever its reason.
        let failed = vec![stands(Status::Failed, Behind::Rig); 4];
        assert_eq!(taken(&[failed, of(2, 0, 14)].concat(), Suspects::Screen).0, 14);
        // A contact that sticks and slips makes most readings jump; a bump now and then is one of its pull.
        assert_eq!(taken(&of_three(1, 9, 1, 9), Suspects::Screen).0, 19);
        assert_eq!(taken(&of_three(1, 5, 1, 13), Suspects::Screen).0, 13);
        assert_eq!(taken(&of_three(4, 5, 0, 11), Suspects::Screen).0, 15);
    }

    #[test]
    fn a_zero_that_moved_is_the_rig_unless_something_else_speaks_too() {
        let of = |status: Status, status_reason: &str| {
            let status_reason = status_reason.into();
            let sample = Sample { status: status.into(), status_reason, ..Sample::default() };
            standing_of(&sample, None).behind == Behind::Rig
        };
        let moved = "the sensor's zero is 0.87 N, and was -0.00 N before the pull (0.30 N are allowed)";
        assert!(of(Status::Suspect, moved));
        assert!(!of(Status::Suspect, &format!("{moved}; the left camera fell silent")));
    }
}
