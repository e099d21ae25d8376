//! Sweeps from Python: the same bytes as the command line.

use crate::{error, values};
use gripgen::record::{FolderError, RunFolder};
use gripgen::tactile::SimdLevel;
use gripgen::{Location, Project, SweepEvent, SweepOptions, SweepSummary};
use gripgen_report::{CONTACT_SHEET, contact_sheet_samples, publish_contact_sheet};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks at the interpreter: signals, and the caller's progress.
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

/// Makes a run, or what is missing of it. Without `config` the run is the one that `out` already is (see prepare_run).
/// `on_progress(done, samples)` is called about ten times per second. Returns counts and whether the run is complete.
#[pyfunction]
#[pyo3(signature = (config, out, overrides = None, jobs = 1, slice = None, on_progress = None))]
pub fn sweep<'py>(
    py: Python<'py>,
    config: Option<&str>,
    out: PathBuf,
    overrides: Option<&Bound<'py, PyDict>>,
    jobs: usize,
    slice: Option<(u64, u64)>,
    on_progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let sets = values::overrides(overrides)?;
    let project = load(py, config, &out, &sets)?;
    let stop = AtomicBool::new(false);
    let options = SweepOptions { jobs: jobs.max(1), slice, simd: SimdLevel::best() };
    let mut raised: Option<PyErr> = None;
    let swept = py.detach(|| {
        let (mut done, mut all, mut looked) = (0, 0, Instant::now());
        gripgen::sweep(&project, &out, options, &stop, |event| {
            match event {
                SweepEvent::Planned { samples, done: there, .. } => (done, all) = (there, samples),
                SweepEvent::Sample { .. } => done += 1,
                _ => {}
            }
            if raised.is_some() || (looked.elapsed() < BETWEEN_LOOKS && done < all) {
                return;
            }
            looked = Instant::now();
            let seen = Python::attach(|py| {
                py.check_signals()?;
                on_progress.as_ref().map(|tell| tell.call1(py, (done, all))).transpose()
            });
            if let Err(e) = seen {
                // The shards under way are finished, then the caller has its KeyboardInterrupt.
                stop.store(true, Ordering::SeqCst);
                raised = Some(e);
            }
        })
    });
    if let Some(e) = raised {
        return Err(e);
    }
    let summary = swept.map_err(|e| error::sweep(py, e))?;
    if summary.complete {
        py.detach(|| draw_contact_sheet(&out)).map_err(|what| error::missing(py, &what, None))?;
    }
    dict_of(py, &summary)
}

/// Makes the folder of a run, without samples. Returns the number of samples and of shards.
#[pyfunction]
#[pyo3(signature = (config, out, overrides = None))]
pub fn prepare_run(
    py: Python<'_>,
    config: &str,
    out: PathBuf,
    overrides: Option<&Bound<'_, PyDict>>,
) -> PyResult<(u64, u64)> {
    let sets = values::overrides(overrides)?;
    let project = load(py, Some(config), &out, &sets)?;
    let folder = py.detach(|| gripgen::prepare_run(&project, &out)).map_err(|e| error::sweep(py, e))?;
    Ok((folder.info().samples, folder.info().shards))
}

/// Shards whose samples the overview of a run shows; of the others the sidecar and the size of the file are enough to finish
/// the run.
#[pyfunction]
pub fn contact_sheet_shards(py: Python<'_>, out: PathBuf) -> PyResult<Vec<u64>> {
    let found = py.detach(|| {
        let folder = RunFolder::open(&out)?;
        let samples = contact_sheet_samples(&folder)?;
        Ok((samples, folder.info().shard_samples))
    });
    let (samples, shard_samples) = found.map_err(|e: FolderError| error::sweep(py, e.into()))?;
    let mut shards: Vec<u64> = samples.into_iter().map(|index| index / shard_samples).collect();
    shards.sort_unstable();
    shards.dedup();
    Ok(shards)
}

fn load(py: Python<'_>, config: Option<&str>, out: &Path, sets: &[(String, String)]) -> PyResult<Project> {
    let loaded = py.detach(|| match config {
        Some(config) => Project::load(&Location::parse(config), sets).map_err(Ok),
        None => RunFolder::open(out).map_err(Err).and_then(|run| Project::from_run(&run).map_err(Ok)),
    });
    loaded.map_err(|e| match e {
        Ok(e) => error::load(py, e),
        Err(e) => error::sweep(py, e.into()),
    })
}

fn draw_contact_sheet(out: &Path) -> Result<(), String> {
    if out.join(CONTACT_SHEET).exists() {
        return Ok(());
    }
    let folder = RunFolder::open(out).map_err(|e| e.to_string())?;
    publish_contact_sheet(&folder).map_err(|e| e.to_string())
}

fn dict_of<'py>(py: Python<'py>, summary: &SweepSummary) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("samples", summary.samples)?;
    found.set_item("failed", summary.failed)?;
    found.set_item("censored", summary.censored)?;
    found.set_item("no_contact", summary.no_contact)?;
    found.set_item("suspect", summary.suspect)?;
    found.set_item("interrupted", summary.interrupted)?;
    found.set_item("complete", summary.complete)?;
    Ok(found)
}
