//! The draws of a posterior beside the twin that they belong to.

use crate::failure::Failure;
use crate::mark::{Format, short_hash};
use crate::outputs::Outputs;
use gripgen::twin::Posterior;
use std::path::{Path, PathBuf};

/// Where the draws of a twin lie: beside it, if it is a file with the ending of one.
pub fn beside(twin: &Path) -> Option<PathBuf> {
    let name = twin.file_name()?.to_str().filter(|name| name.ends_with(".toml"))?;
    Some(twin.with_file_name(Posterior::name_beside(name)))
}

/// Asks for the twin and for its draws, before the work.
pub fn allow(outputs: &mut Outputs, twin: &Path) -> Result<(), Failure> {
    outputs.allow(twin)?;
    beside(twin).map_or(Ok(()), |draws| outputs.allow_beside(&draws, twin))
}

/// Writes a twin, and its draws first: the twin names them by their hash. Those of an earlier command hold no longer.
pub fn write(outputs: &Outputs, twin: &Path, text: &str, draws: Option<&Posterior>) -> Result<(), Failure> {
    let mut hashes = vec![];
    match (beside(twin), draws) {
        (Some(path), Some(draws)) => {
            let text = draws.to_csv();
            outputs.write(&path, Format::Bare, text.as_bytes())?;
            hashes.push(short_hash(text.as_bytes()));
        }
        (Some(path), None) => outputs.remove_beside(&path, twin)?,
        (None, _) => {}
    }
    outputs.write_with(twin, Format::Toml, text.as_bytes(), &hashes)
}
