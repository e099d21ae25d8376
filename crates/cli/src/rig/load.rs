//! Files of the rig's verbs.

use crate::failure::Failure;
use gripgen::Location;
use gripgen::twin::config::Document;
use gripgen_rig::experiment::RigConfig;

/// The shipped rig: the virtual one on this machine.
pub const SHIPPED_RIG: &str = "asset:configs/rig.toml";

/// Reads and checks a rig.toml.
pub fn load_rig(path: &str, sets: &[(String, String)]) -> Result<RigConfig, Failure> {
    let at = Location::parse(path);
    let text = at.read_text().map_err(Failure::usage)?;
    let mut document = Document::parse(path, &text)?;
    for (key, value) in sets {
        document.set(key, value)?;
    }
    Ok(RigConfig::read(&document)?)
}
