//! Rehearsals of a rig, and their files.

use super::programs::checked_programs;
use super::{after_stop, no_pose, unprepared};
use crate::failure::Failure;
use crate::rig::plain_campaign;
use gripgen::VERSION;
use gripgen::record::{RunFolder, sha256_hex};
use gripgen_rig::experiment::check::{CheckLine, check};
use gripgen_rig::experiment::rehearse::{SCHEMA, StoredRehearsal};
use gripgen_rig::experiment::{
    Devices, RehearsalPlan, RehearseError, RigConfig, RigEvent, check_campaign, rehearse,
};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A rehearsal on a part, the first that is taught where none is named.
///
/// # Errors
///
/// A rig on which nothing is taught (`rig` is its name for the message), or a dwell out of range.
pub fn plan_rehearsal(
    config: &RigConfig,
    rig: &str,
    part: Option<String>,
    grip_force_n: f64,
    dwell_s: f64,
) -> Result<RehearsalPlan, Failure> {
    let Some(part) = part.or_else(|| config.poses.keys().next().cloned()) else {
        return Err(no_pose(rig));
    };
    if !(0.5..=3600.0).contains(&dwell_s) {
        return Err(Failure::usage(format!("--dwell-s: {dwell_s} s, it must be from 0.5 to 3600 s")));
    }
    Ok(RehearsalPlan { part, grip_force_n, dwell_s })
}

/// Finds out what the rig is like today: checks everything, then moves it.
///
/// # Errors
///
/// A part that is not taught or too much force; a device that does not answer; what ends a pull. After the last of them everything
/// was stopped.
pub fn rehearse_rig(
    config: &RigConfig,
    plan: &RehearsalPlan,
    stop: &AtomicBool,
    emit: &mut dyn FnMut(RigEvent),
) -> Result<StoredRehearsal, Failure> {
    let unmoved = |failure: Failure| failure.hint("nothing was sent and nothing moved");
    let campaign = plain_campaign(std::slice::from_ref(&plan.part), &[plan.grip_force_n], 1, 0);
    check_campaign(config, &campaign).map_err(|e| unmoved(Failure::usage(e)))?;
    checked_programs(config, &campaign).map_err(|e| unmoved(Failure::new(e)))?;
    let mut lines: Vec<CheckLine> = Vec::new();
    check(config, |line| lines.push(line));
    if let Some(bad) = lines.iter().find(|line| !line.ok) {
        return Err(Failure::new(format!("{}: {}", bad.what, bad.found))
            .hint("`gripgen rig check` says all; nothing was moved"));
    }
    let devices = Devices::connect(config)
        .map_err(|e| Failure::new(e).hint("`gripgen rig check` says which devices answer"))?;
    let rehearsal = rehearse(config, devices, plan, stop, emit).map_err(|e| match e {
        RehearseError::Prepare(e) => unprepared(&e),
        RehearseError::Stopped(stopped) => {
            let hint = after_stop(&stopped, "then rehearse again");
            Failure::new(stopped).hint(hint)
        }
        other => Failure::new(other),
    })?;
    Ok(StoredRehearsal::new(VERSION, config, lines, rehearsal))
}

/// The text of its file.
///
/// # Errors
///
/// A number that JSON cannot hold.
pub fn rehearsal_text(stored: &StoredRehearsal) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(stored).map_err(Failure::new)?;
    Ok(text + "\n")
}

/// Reads the file of a rehearsal.
///
/// # Errors
///
/// A file that cannot be read or is none.
pub fn load_rehearsal(path: &Path) -> Result<StoredRehearsal, Failure> {
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
