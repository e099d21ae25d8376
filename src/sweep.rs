//! Running a sweep: shards over threads, in order, resumable.

mod pipeline;
mod shards;

use crate::film::Film;
use crate::generate::{drawn_scenario, generate_filmed};
use crate::project::Project;
use crate::version::VERSION;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_record::{
    FolderError, PictureError, RUN_SCHEMA, RunFolder, RunInfo, ShardError, Sidecar, differences,
    extra_columns,
};
use gripgen_tactile::SimdLevel;
use gripgen_tactile::gpu::{GpuAdapter, GpuError};
use gripgen_twin::{Outcome, Sample};
use pipeline::Run;
pub use shards::{encode_filmed, encode_options, noise_rgb};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time between two looks at a shard that another process is writing.
const WAIT: Duration = Duration::from_millis(200);

/// How a sweep is run. None of it changes a byte of the result.
#[derive(Debug, Clone, Copy)]
pub struct SweepOptions {
    /// Number of worker threads.
    pub jobs: usize,
    /// Piece `i` of `n` of the shards; 0 and `n` both name the first piece.
    pub slice: Option<(u64, u64)>,
    /// The vector unit of the image pipeline.
    pub simd: SimdLevel,
}

/// What happens during a sweep.
#[derive(Debug, Clone, PartialEq)]
pub enum SweepEvent {
    /// The work is known.
    Planned {
        /// Samples of the run (of this slice).
        samples: u64,
        /// Of these, samples in shards that are done already.
        done: u64,
        /// Shards to make.
        shards: u64,
    },
    /// A sample was written.
    Sample {
        /// Its global index.
        index: u64,
        /// How it ended.
        status: Status,
        /// Why, if it failed.
        failure: String,
        /// Part.
        part: String,
        /// Grip force of a jaw.
        grip_force_n: f64,
        /// Label, where it has one.
        label_n: Option<f64>,
    },
    /// A shard is done.
    Shard {
        /// Its number.
        shard: u64,
        /// Its size.
        bytes: u64,
        /// Samples of it that failed.
        failed: u64,
    },
    /// The images are made by a graphics processor.
    Gpu {
        /// Which.
        adapter: GpuAdapter,
        /// The adapter that made what is there already, where it was another one.
        another: Option<String>,
    },
    /// Another process is writing the shards of this run that are left; said once, and again when their number
    /// changes.
    Waiting {
        /// How many.
        shards: u64,
    },
}

/// How a sweep ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SweepSummary {
    /// Samples in finished shards of this slice.
    pub samples: u64,
    /// Of these, samples that failed.
    pub failed: u64,
    /// Of these, pulls that ended before the jaws slipped: their label is a lower bound.
    pub censored: u64,
    /// Of these, grips that missed the part.
    pub no_contact: u64,
    /// Of these, pulls whose trace contradicts their label.
    pub suspect: u64,
    /// The run was interrupted before its end.
    pub interrupted: bool,
    /// All shards of the run are done and `index.csv` is written.
    pub complete: bool,
}

/// Why a sweep stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The folder holds a run of another configuration.
    #[error("{path} holds another run: {differences}")]
    AnotherConfig {
        /// The folder.
        path: PathBuf,
        /// The keys that differ, each with both values.
        differences: String,
    },
    /// A shard.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// An image.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The graphics processor.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The slice does not exist.
    #[error("there is no slice {index} of {count}; slices are counted from 0 (or from 1) up to {count}")]
    Slice {
        /// Slice asked for.
        index: u64,
        /// Number of slices.
        count: u64,
    },
}

/// What the folder of a project says of itself.
pub fn run_info(project: &Project) -> RunInfo {
    let sweep = &project.sweep;
    RunInfo {
        schema: RUN_SCHEMA.into(),
        gripgen_version: VERSION.into(),
        name: project.name.clone(),
        source: "sim".into(),
        config_sha256: project.config_sha256.clone(),
        samples: sweep.samples,
        shard_samples: sweep.shard_samples,
        shards: sweep.shards(),
        extra_columns: extra_columns(sweep.drawn_keys()),
        files_sha256: project.library.files_sha256(),
        config_toml: project.config_toml.clone(),
        gpu_adapter: project.gpu().ok().flatten().map(|gpu| gpu.adapter().to_string()),
    }
}

/// Makes the folder of a run, or opens it: `run.json` and the files that it depends on, no sample yet. Refuses a folder that
/// holds another run.
///
/// # Errors
///
/// A folder that cannot be written, or that holds another run.
pub fn prepare_run(project: &Project, out: &Path) -> Result<RunFolder, SweepError> {
    RunFolder::create(out, run_info(project), &project.library.disk_files())
        .map_err(|e| explain_refusal(project, e))
}

/// Runs a sweep into `out`, or what is missing of it. `stop` ends it after the shards under way.
///
/// # Errors
///
/// As [`prepare_run`]; a slice that there is not, a shard that cannot be written, or no device for the GPU backend.
pub fn sweep(
    project: &Project,
    out: &Path,
    options: SweepOptions,
    stop: &AtomicBool,
    mut on_event: impl FnMut(SweepEvent),
) -> Result<SweepSummary, SweepError> {
    let shards = shards_of_slice(project.sweep.shards(), options.slice)?;
    let gpu = project.prepare_gpu()?;
    let folder = prepare_run(project, out)?;
    if let Some(gpu) = gpu {
        let (adapter, there) = (gpu.adapter().clone(), folder.info().gpu_adapter.clone());
        let another = there.filter(|there| *there != adapter.to_string());
        on_event(SweepEvent::Gpu { adapter, another });
    }
    let mut summary = SweepSummary::default();
    let mut todo = VecDeque::new();
    let mut samples = 0;
    for shard in shards {
        samples += samples_of_shard(project, shard);
        match folder.finished(shard)? {
            Some(sidecar) => count(&mut summary, &sidecar),
            None => todo.push_back(shard),
        }
    }
    on_event(SweepEvent::Planned { samples, done: summary.samples, shards: todo.len() as u64 });
    let mut waiting = 0;
    loop {
        let run = Run { project, folder: &folder, options, stop };
        let busy = run.make_shards(std::mem::take(&mut todo), &mut summary, &mut on_event)?;
        if busy.is_empty() || stop.load(Ordering::SeqCst) {
            todo = busy;
            break;
        }
        if busy.len() != waiting {
            waiting = busy.len();
            on_event(SweepEvent::Waiting { shards: waiting as u64 });
        }
        std::thread::sleep(WAIT);
        todo = busy;
    }
    summary.interrupted = summary.samples < samples || !todo.is_empty();
    summary.complete = !summary.interrupted && folder.write_index()?;
    Ok(summary)
}

/// Says which keys differ where a folder holds a run of another configuration.
fn explain_refusal(project: &Project, error: FolderError) -> SweepError {
    let FolderError::AnotherRun { path, what: "config_sha256", .. } = &error else { return error.into() };
    let Ok(there) = RunFolder::open(path) else { return error.into() };
    match differences(&there.info().config_toml, &project.config_toml) {
        Some(differences) => SweepError::AnotherConfig { path: path.clone(), differences },
        None => error.into(),
    }
}

fn count(summary: &mut SweepSummary, sidecar: &Sidecar) {
    let with_status = |status| sidecar.rows_with_status(status);
    summary.samples += sidecar.samples;
    summary.failed += sidecar.failed;
    summary.censored += with_status(Status::Censored);
    summary.no_contact += with_status(Status::NoContact);
    summary.suspect += with_status(Status::Suspect);
}

/// The shards of a slice: every `count`-th one.
fn shards_of_slice(shards: u64, slice: Option<(u64, u64)>) -> Result<Vec<u64>, SweepError> {
    let (index, count) = slice.unwrap_or((0, 1));
    if count == 0 || index > count {
        return Err(SweepError::Slice { index, count });
    }
    Ok((0..shards).filter(|shard| shard % count == index % count).collect())
}

fn samples_of_shard(project: &Project, shard: u64) -> u64 {
    let first = shard * project.sweep.shard_samples;
    project.sweep.shard_samples.min(project.sweep.samples - first)
}

/// Generates a sample; a panic (a bug, or the engine's) fails that sample instead of losing the run.
pub fn guarded(project: &Project, index: u64, simd: SimdLevel) -> (Sample, Option<Film>) {
    catch_unwind(AssertUnwindSafe(|| generate_filmed(project, index, simd))).unwrap_or_else(|panic| {
        let what = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("unknown panic");
        let seed = project.sweep.seed;
        let reason = format!("internal error: {what} (sample {index}, seed {seed}); please report it");
        (Sample { scenario: drawn_scenario(project, index), outcome: Outcome::Failed { reason } }, None)
    })
}
