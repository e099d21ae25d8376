//! Measured pulls as rows of a dataset.

use crate::pulls::{
    JudgedPulls, PULLS_FILE, PullFolderError, pulls_with_images, read_judged_pulls, read_pull_images,
};
use gripgen_record::{Dataset, DatasetError, MeasuredRows, PictureFileError, Table, status_name};
use gripgen_twin::columns::recorded_covariates;
use gripgen_twin::label::forces::PullForces;
use gripgen_twin::{MeasuredPull, PULLS_SINCE_REST, SINCE_ZERO, Values};
use std::path::Path;

/// Why a dataset could not be opened. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenDatasetError {
    /// A run, a shard, or neither of them.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A table of pulls.
    #[error(transparent)]
    Pulls(#[from] PullFolderError),
    /// Their images.
    #[error(transparent)]
    Images(#[from] PictureFileError),
}

/// Opens a run folder, a single shard, or a folder with `pulls.csv`.
///
/// # Errors
///
/// A path that is none of them, or files that cannot be read.
pub fn open_dataset(path: &Path) -> Result<Dataset, OpenDatasetError> {
    if path.join("run.json").is_file() || !path.join(PULLS_FILE).is_file() {
        return Ok(Dataset::open(path)?);
    }
    let judged = read_judged_pulls(path)?;
    let with_images = pulls_with_images(path)?;
    let table = Table::of_columns(columns(&judged));
    let pulls = judged.pulls.pulls;
    let image_size_px = match pulls.iter().find(|p| with_images.contains(&p.id)) {
        Some(pull) => {
            let image = read_pull_images(path, &pull.id)?.grip.left;
            Some((image.width_px, image.height_px))
        }
        None => None,
    };
    let folder = path.to_path_buf();
    let images = move |id: &str| match with_images.contains(id) {
        true => Ok(Some(read_pull_images(&folder, id)?.grip)),
        false => Ok(None),
    };
    let (ids, traces) = pulls.into_iter().map(|pull| (pull.id, pull.trace)).unzip();
    Ok(Dataset::of_measured(
        path,
        table,
        MeasuredRows { ids, traces, images: Box::new(images), image_size_px },
    ))
}

/// What was recorded of the known columns, and every further column.
fn columns(judged: &JudgedPulls) -> Vec<(String, Values)> {
    let JudgedPulls { pulls: measured, standing, .. } = judged;
    let pulls = &measured.pulls;
    let words = |of: &dyn Fn(&MeasuredPull) -> String| Values::Words(pulls.iter().map(of).collect());
    let numbers = |of: &dyn Fn(&MeasuredPull) -> f64| Values::Numbers(pulls.iter().map(of).collect());
    let statuses = standing.iter().map(|s| status_name(s.status).into()).collect();
    let mut columns = vec![
        ("pull_id".to_string(), words(&|p| p.id.clone())),
        ("status".to_string(), Values::Words(statuses)),
    ];
    for column in recorded_covariates(&measured.recorded) {
        columns.push((column.name.into(), column.values(pulls)));
    }
    if pulls.iter().any(|p| p.start_n.is_some()) {
        columns.push(("force_start_n".into(), numbers(&|p| p.start_n.unwrap_or(p.increment_n))));
    }
    for extra in measured.extra.iter().filter(|e| e.name != PULLS_SINCE_REST && e.name != SINCE_ZERO) {
        let values = Values::of_drawn(pulls.iter().map(|p| p.covariates.extra.get(&extra.name)));
        columns.push((extra.name.clone(), values));
    }
    columns.push(("max_pull_force_n".into(), numbers(&|p| p.max_pull_force_n)));
    if pulls.iter().any(|p| p.trace.is_some()) {
        let forces: Vec<PullForces> =
            pulls.iter().map(|p| p.trace.as_ref().map_or(PullForces::default(), PullForces::of)).collect();
        let of = |f: fn(&PullForces) -> Option<f64>| {
            Values::Numbers(forces.iter().map(|all| f(all).unwrap_or(f64::NAN)).collect())
        };
        columns.push(("peak_force_n".into(), of(|f| f.peak_force_n)));
        columns.push(("kinetic_force_n".into(), of(|f| f.kinetic_force_n)));
    }
    let reasons = standing.iter().map(|s| s.reason.clone()).collect();
    columns.push(("status_reason".into(), Values::Words(reasons)));
    columns
}
