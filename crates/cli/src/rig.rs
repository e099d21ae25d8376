//! What the verbs of a rig do, without arguments, progress and printing: for the command line and for Python.
//!
//! `gripgen-rig` makes the experiment and tells what happens; here that is written into a run folder.

mod ask;
mod check;
mod config_text;
mod plant;
mod programs;
mod pull;
mod record;
mod rehearsal;
mod standing;

pub use ask::ask_at_keyboard;
pub use check::check_rig;
pub use config_text::{plain_campaign, rig_run_differences, rig_run_toml};
pub use gripgen_rig::experiment::check::CheckLine;
pub use gripgen_rig::experiment::prepare::Permit;
pub use gripgen_rig::experiment::pull::ExecutedPull;
pub use gripgen_rig::experiment::rehearse::StoredRehearsal;
pub use gripgen_rig::experiment::{PullOutcome, RehearsalPlan, RigConfig, RigEvent};
pub use plant::{Fixture, OpenPlantError, TwinPlant};
pub use pull::{HowToPull, PullJob, PullProgress, PullRun, PullSummary, plan_pulls};
pub use record::Standing;
pub use rehearsal::{load_rehearsal, plan_rehearsal, rehearsal_text, rehearse_rig};

use crate::failure::Failure;
use gripgen::Location;
use gripgen::twin::config::Document;
use gripgen_rig::experiment::Stopped;
use gripgen_rig::experiment::prepare::PrepareError;

/// The shipped rig: the virtual one on this machine.
pub const SHIPPED_RIG: &str = "asset:configs/rig.toml";

/// What to do after a safe stop, the red button first where it may be needed; `again` says how the work goes on.
fn after_stop(stopped: &Stopped, again: &str) -> String {
    let moves = "press the red button (emergency stop): the robot may still move; then look at the rig";
    let look = if stopped.still { "look at the rig" } else { moves };
    let hint = stopped.hint.map(|hint| format!("; {hint}")).unwrap_or_default();
    format!("{look}{hint}; {again}")
}

/// A robot that is not ready, with what a person at the rig does about it.
fn unprepared(e: &PrepareError) -> Failure {
    Failure::new(e).hint(match e {
        PrepareError::Local => "nothing was moved; the switch is in the upper right corner of the teach pendant",
        PrepareError::Protective => "nothing was moved; the same command with --unlock leaves the stop, 5 s after it at the earliest",
        PrepareError::Power { .. } => "nothing was moved; the same command with --power-on switches the arm on and releases its brakes",
        PrepareError::Safety { .. } => "nothing was moved; find out why, release what was pressed, and restart the robot on its teach pendant",
        PrepareError::Version { .. } => "nothing was moved; `gripgen rig check` says what the controller is",
        _ => "`gripgen rig check` says what the robot answers",
    })
}

/// A rig on which no part is taught.
fn no_pose(rig: &str) -> Failure {
    Failure::usage(format!("{rig}: no pose is taught"))
        .hint("move the tool to a part by hand, then `gripgen rig teach NAME`")
}

/// Reads and checks a rig.toml.
///
/// # Errors
///
/// A file that cannot be read, or a key of it.
pub fn load_rig(path: &str, sets: &[(String, String)]) -> Result<RigConfig, Failure> {
    let at = Location::parse(path);
    let text = at.read_text().map_err(Failure::usage)?;
    let mut document = Document::parse(path, &text)?;
    for (key, value) in sets {
        document.set(key, value)?;
    }
    Ok(RigConfig::read(&document)?)
}
