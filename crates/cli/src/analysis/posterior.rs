//! Twins that stand for the posterior of a twin.

use gripgen::Location;
use gripgen_twin::config::{ConfigError, Document};
use gripgen_twin::{Posterior, Twin};

/// Twins that stand for a posterior: draws at equal steps of probability.
const TWINS: usize = 12;

/// Twins that stand for the posterior beside a twin; none where there is no such file.
///
/// # Errors
///
/// A file that is no posterior, or draws that make no twin.
pub fn posterior_twins(twin: &Location, document: &Document) -> Result<Vec<Twin>, ConfigError> {
    let Location::Disk(path) = twin else { return Ok(vec![]) };
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let path = path.with_file_name(Posterior::name_beside(&name));
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(vec![]) };
    let fault = |problem: String| ConfigError::new("twin", format!("{}: {problem}", path.display()));
    twins_of(&text, document)
        .map_err(|e| fault(e).hint("it belongs to the twin that was written with it; move it away"))
}

fn twins_of(text: &str, document: &Document) -> Result<Vec<Twin>, String> {
    let posterior = Posterior::parse(text).map_err(|e| e.to_string())?;
    let of = |k: usize| posterior.twin(posterior.at((k as f64 + 0.5) / TWINS as f64), document.table());
    (0..TWINS).map(of).collect::<Result<_, _>>().map_err(|e| e.to_string())
}
