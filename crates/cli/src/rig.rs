//! What the verbs of a rig do, without arguments, progress and printing: for the command line and for Python.
//!
//! `gripgen-rig` makes the experiment and tells what happens; here that is written into a run folder.

mod check;
mod config_text;
mod plant;
mod programs;
mod pull;
mod record;
mod rehearsal;
mod standing;

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

/// The shipped rig: the virtual one on this machine.
pub const SHIPPED_RIG: &str = "asset:configs/rig.toml";

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
