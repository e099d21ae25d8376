//! What `gripgen rig rehearse` stored.

use crate::failure::Failure;
use gripgen::record::{RunFolder, sha256_hex};
use gripgen_rig::experiment::check::CheckLine;
use gripgen_rig::experiment::rehearse::{SCHEMA, StoredRehearsal};
use std::path::Path;

/// Lines of `rig check` that stay the same while a rig stays the same.
const CONSTANT: [&str; 5] = ["dashboard", "controller", "primary interface", "tool offset", "payload"];

/// Reads a file.
pub fn load(path: &Path) -> Result<StoredRehearsal, Failure> {
    let wrong = |problem: String| {
        Failure::usage(format!("{}: {problem}", path.display())).hint("`gripgen rig rehearse` writes it")
    };
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    let stored: StoredRehearsal = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    if stored.schema != SCHEMA {
        return Err(wrong(format!("its schema is `{}`, this version reads `{SCHEMA}`", stored.schema)));
    }
    Ok(stored)
}

/// Puts a copy into a run, named by its content: a run may outlive a morning's rehearsal.
pub fn keep(path: &Path, run: &RunFolder) -> Result<(), Failure> {
    let bytes = std::fs::read(path).map_err(|e| Failure::new(format!("{}: {e}", path.display())))?;
    Ok(run.publish(&format!("rehearsal-{}.json", &sha256_hex(&bytes)[..8]), &bytes)?)
}

/// Whether the rig is the one that rehearsed.
pub fn compared(stored: &StoredRehearsal, lines: &[CheckLine]) -> CheckLine {
    let mut changed = Vec::new();
    for (what, then) in stored.checks.iter().filter(|(what, _)| CONSTANT.contains(&what.as_str())) {
        let now = lines.iter().find(|line| line.what == what).map_or("nothing", |line| &line.found);
        if now != then {
            changed.push(format!("{what}: {now}, it was {then}"));
        }
    }
    let found = match changed.is_empty() {
        true => "the rig is the one that rehearsed".to_string(),
        false => format!("rehearse again, the rig has changed: {}", changed.join("; ")),
    };
    CheckLine { what: "rehearsal", ok: changed.is_empty(), found }
}
