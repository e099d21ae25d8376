//! Does every device of a rig answer, and does what the robot would be sent do what its numbers say.

use super::programs::checked_programs;
use crate::output::size;
use crate::rig::plain_campaign;
use gripgen_rig::experiment::RigConfig;
use gripgen_rig::experiment::check::{CheckLine, check};
use gripgen_rig::experiment::rehearse::StoredRehearsal;
use std::cell::RefCell;

/// Free space that a day of pulls needs.
const MIN_FREE: u64 = 2_000_000_000;

/// Checks a rig; `tell` gets each line when it is known. Nothing moves.
pub fn check_rig(
    config: &RigConfig,
    rehearsal: Option<&StoredRehearsal>,
    mut tell: impl FnMut(&CheckLine),
) -> Vec<CheckLine> {
    let lines = RefCell::new(Vec::new());
    let mut add = |line: CheckLine| {
        tell(&line);
        lines.borrow_mut().push(line);
    };
    check(config, &mut add);
    add(programs_line(config));
    if let Some(stored) = rehearsal {
        let compared = stored.compare(&lines.borrow());
        add(compared);
    }
    add(free_space());
    lines.into_inner()
}

/// What the robot would be sent, run on the virtual robot through every way out.
fn programs_line(config: &RigConfig) -> CheckLine {
    let campaign = plain_campaign(&["part".into()], &[20.0], 1, 0);
    let (ok, found) = match checked_programs(config, &campaign) {
        Ok(count) => (true, format!("{count} do what their numbers say, on the virtual robot")),
        Err(problem) => (false, problem),
    };
    CheckLine { what: "programs", ok, found }
}

fn free_space() -> CheckLine {
    let (ok, found) = match fs4::available_space(".") {
        Ok(bytes) => (bytes >= MIN_FREE, format!("{} free here", size(bytes))),
        Err(e) => (false, e.to_string()),
    };
    CheckLine { what: "disk", ok, found }
}
