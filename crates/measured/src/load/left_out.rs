//! Pulls that are left out, and why.

use gripgen_record::proto::gripgen_v1::Status;

/// Pulls of a run that are left out, by reason.
#[derive(Default)]
pub(super) struct LeftOut {
    pub(super) rig: bool,
    pub(super) failed: usize,
    pub(super) no_contact: usize,
    pub(super) censored: usize,
    pub(super) other_rule: usize,
    pub(super) unfinished_shards: u64,
}

impl LeftOut {
    pub(super) fn count(&mut self, status: Status) {
        match status {
            Status::Slipped | Status::Suspect => {}
            Status::Censored => self.censored += 1,
            Status::NoContact => self.no_contact += 1,
            _ => self.failed += 1,
        }
    }

    pub(super) fn notes(&self) -> Vec<String> {
        let counted = [
            (self.failed, "failed"),
            (self.no_contact, "had no contact"),
            (self.censored, "ended before the jaws slipped"),
            (self.other_rule, "have another tolerance or stop than the first"),
        ];
        let mut notes: Vec<String> = counted
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{n} pulls were left out: they {what}"))
            .collect();
        match self.unfinished_shards {
            0 => {}
            n if self.rig => notes.push(format!("{n} pulls of the campaign are not made yet")),
            n => notes.push(format!("{n} shards are not finished and were left out")),
        }
        notes
    }
}
