//! Running a sweep: shards over threads, in order, resumable.

use crate::generate::generate;
use crate::project::Project;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_record::{
    EncodeOptions, EncodedSample, FolderError, PartialShard, PictureError, RUN_SCHEMA, RunFolder, RunInfo,
    ShardError, ShardInfo, ShardWriter, Sidecar, VIEW_RATE_HZ, encode, extra_columns,
};
use gripgen_tactile::SimdLevel;
use gripgen_twin::{Outcome, Sample};
use std::collections::{BTreeMap, VecDeque};
use std::io::BufWriter;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Version of gripgen, part of every run.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Samples a worker may be ahead of the writer, per worker.
const AHEAD: usize = 4;

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
    /// Another process is writing shards of this run; waiting for it.
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
    /// A shard.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// An image.
    #[error(transparent)]
    Picture(#[from] PictureError),
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
        extra_columns: extra_columns(sweep.vary.iter().map(|v| v.key.as_str())),
        files_sha256: project.library.files_sha256(),
        config_toml: project.config_toml.clone(),
    }
}

/// Runs a sweep into `out`, or what is missing of it. `stop` ends it after the shards under way.
pub fn sweep(
    project: &Project,
    out: &Path,
    options: SweepOptions,
    stop: &AtomicBool,
    mut on_event: impl FnMut(SweepEvent),
) -> Result<SweepSummary, SweepError> {
    let shards = shards_of_slice(project.sweep.shards(), options.slice)?;
    let folder = RunFolder::create(out, run_info(project), &project.library.disk_files())?;
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
    loop {
        let run = Run { project, folder: &folder, options, stop };
        let busy = run.make_shards(std::mem::take(&mut todo), &mut summary, &mut on_event)?;
        if busy.is_empty() || stop.load(Ordering::SeqCst) {
            todo = busy;
            break;
        }
        on_event(SweepEvent::Waiting { shards: busy.len() as u64 });
        std::thread::sleep(WAIT);
        for shard in busy {
            match folder.finished(shard)? {
                Some(sidecar) => count(&mut summary, &sidecar),
                None => todo.push_back(shard),
            }
        }
    }
    summary.interrupted = summary.samples < samples || !todo.is_empty();
    summary.complete = !summary.interrupted && folder.write_index()?;
    Ok(summary)
}

fn count(summary: &mut SweepSummary, sidecar: &Sidecar) {
    summary.samples += sidecar.samples;
    summary.failed += sidecar.failed;
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

/// One pass over shards.
struct Run<'a> {
    project: &'a Project,
    folder: &'a RunFolder,
    options: SweepOptions,
    stop: &'a AtomicBool,
}

/// The work that is left to hand out.
struct Queue {
    shards: VecDeque<u64>,
    /// Samples of the shard at hand.
    current: std::ops::Range<u64>,
    /// Shards begun, for the writer, in the order of their samples.
    begun: VecDeque<(u64, PartialShard)>,
    /// Shards that another process is writing.
    busy: VecDeque<u64>,
    /// Place of the next sample in the writer's order.
    next_place: u64,
    error: Option<FolderError>,
}

/// A finished sample and its place in the writer's order.
type Done = (u64, u64, Result<EncodedSample, PictureError>);

impl Run<'_> {
    /// Makes `shards` and returns those that another process was writing.
    fn make_shards(
        &self,
        shards: VecDeque<u64>,
        summary: &mut SweepSummary,
        on_event: &mut impl FnMut(SweepEvent),
    ) -> Result<VecDeque<u64>, SweepError> {
        let jobs = self.options.jobs.max(1);
        let queue = Mutex::new(Queue {
            shards,
            current: 0..0,
            begun: VecDeque::new(),
            busy: VecDeque::new(),
            next_place: 0,
            error: None,
        });
        let (done_in, done_out) = sync_channel::<Done>(jobs * AHEAD);
        // Workers take a permit before they take a sample, the writer gives it back: memory stays bounded.
        let (permit_in, permit_out) = sync_channel::<()>(jobs * AHEAD);
        for _ in 0..jobs * AHEAD {
            permit_in.send(()).expect("the channel has room for all permits");
        }
        let permits = Mutex::new(permit_out);
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                let (queue, permits, done) = (&queue, &permits, done_in.clone());
                scope.spawn(move || self.work(queue, permits, &done));
            }
            drop(done_in);
            // Its ends of the channels go with the writer: if it fails, the workers stop.
            self.write(&queue, done_out, permit_in, summary, on_event)
        })?;
        let queue = queue.into_inner().unwrap_or_else(PoisonError::into_inner);
        match queue.error {
            Some(e) => Err(e.into()),
            None => Ok(queue.busy),
        }
    }

    /// A worker: takes samples in order until there are no more.
    fn work(&self, queue: &Mutex<Queue>, permits: &Mutex<Receiver<()>>, done: &SyncSender<Done>) {
        loop {
            // The writer hangs up when it failed.
            if permits.lock().unwrap_or_else(PoisonError::into_inner).recv().is_err() {
                return;
            }
            let Some((place, index)) = self.next_sample(&mut lock(queue)) else { return };
            let encoded = self.make_sample(index);
            if done.send((place, index, encoded)).is_err() {
                return;
            }
        }
    }

    fn next_sample(&self, queue: &mut Queue) -> Option<(u64, u64)> {
        while queue.current.is_empty() {
            if queue.error.is_some() || self.stop.load(Ordering::SeqCst) {
                return None;
            }
            let shard = queue.shards.pop_front()?;
            match self.folder.start_shard(shard) {
                Ok(Some(partial)) => {
                    let first = shard * self.project.sweep.shard_samples;
                    queue.current = first..first + samples_of_shard(self.project, shard);
                    queue.begun.push_back((shard, partial));
                }
                Ok(None) => queue.busy.push_back(shard),
                Err(e) => queue.error = Some(e),
            }
        }
        let index = queue.current.next()?;
        queue.next_place += 1;
        Some((queue.next_place - 1, index))
    }

    fn make_sample(&self, index: u64) -> Result<EncodedSample, PictureError> {
        let options = encode_options(self.project, index);
        encode(&guarded(self.project, index, self.options.simd), &options)
    }

    /// The writer: puts samples into shards in order.
    #[expect(clippy::needless_pass_by_value, reason = "its ends of the channels close when it returns")]
    fn write(
        &self,
        queue: &Mutex<Queue>,
        done: Receiver<Done>,
        permits: SyncSender<()>,
        summary: &mut SweepSummary,
        on_event: &mut impl FnMut(SweepEvent),
    ) -> Result<(), SweepError> {
        let mut waiting = BTreeMap::new();
        let mut place = 0;
        let mut open: Option<OpenShard> = None;
        loop {
            while let Some((index, encoded)) = waiting.remove(&place) {
                place += 1;
                let encoded: Result<EncodedSample, PictureError> = encoded;
                let shard = match open.take() {
                    Some(shard) => shard,
                    None => {
                        let (shard, partial) =
                            lock(queue).begun.pop_front().expect("its samples come after it was begun");
                        OpenShard::new(self.project, shard, partial)?
                    }
                };
                open = shard.push(self, index, encoded?, summary, on_event)?;
                // A worker that is gone needs no permit.
                let _ = permits.try_send(());
            }
            match done.recv() {
                Ok((place, index, encoded)) => {
                    waiting.insert(place, (index, encoded));
                }
                Err(_) => return Ok(()),
            }
        }
    }
}

/// A shard being written.
struct OpenShard {
    shard: u64,
    writer: ShardWriter<BufWriter<std::fs::File>>,
    partial: PartialShard,
    rows: Vec<Vec<String>>,
    failed: u64,
}

impl OpenShard {
    fn new(project: &Project, shard: u64, partial: PartialShard) -> Result<Self, SweepError> {
        let info = shard_info(project, shard);
        let file = partial.duplicate()?;
        let writer = ShardWriter::new(BufWriter::new(file), &info, project.sweep.images)?;
        Ok(Self { shard, writer, partial, rows: Vec::with_capacity(info.samples as usize), failed: 0 })
    }

    /// Writes a sample; gives the shard back until its last sample closes it.
    fn push(
        mut self,
        run: &Run<'_>,
        index: u64,
        encoded: EncodedSample,
        summary: &mut SweepSummary,
        on_event: &mut impl FnMut(SweepEvent),
    ) -> Result<Option<Self>, SweepError> {
        self.writer.push(&encoded)?;
        let mut row = encoded.row;
        row[1] = self.shard.to_string();
        row[2] = self.rows.len().to_string();
        let failure =
            if encoded.status == Status::Failed { failure_of(&row).to_string() } else { String::new() };
        self.failed += u64::from(encoded.status == Status::Failed);
        self.rows.push(row);
        on_event(SweepEvent::Sample { index, status: encoded.status, failure });
        let samples = samples_of_shard(run.project, self.shard);
        if (self.rows.len() as u64) < samples {
            return Ok(Some(self));
        }
        let first = self.shard * run.project.sweep.shard_samples;
        self.writer.finish()?.into_inner().map_err(|e| self.partial.error(e.into_error()))?;
        let sidecar = run.folder.finish_shard(self.shard, first, self.partial, self.failed, self.rows)?;
        count(summary, &sidecar);
        let (bytes, failed) = (sidecar.bytes, sidecar.failed);
        on_event(SweepEvent::Shard { shard: self.shard, bytes, failed });
        Ok(None)
    }
}

/// The `failure` cell of an index row.
fn failure_of(row: &[String]) -> &str {
    let at = gripgen_record::INDEX_COLUMNS.iter().position(|c| *c == "failure").expect("a fixed column");
    &row[at]
}

/// Generates a sample; a panic (a bug, or the engine's) fails that sample instead of losing the run.
pub(crate) fn guarded(project: &Project, index: u64, simd: SimdLevel) -> Sample {
    catch_unwind(AssertUnwindSafe(|| generate(project, index, simd))).unwrap_or_else(|panic| {
        let what = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("unknown panic");
        let seed = project.sweep.seed;
        let reason = format!("internal error: {what} (sample {index}, seed {seed}); please report it");
        Sample { scenario: crate::generate::placeholder(project, index), outcome: Outcome::Failed { reason } }
    })
}

/// How sample `index` of a project is encoded into its shard.
pub(crate) fn encode_options(project: &Project, index: u64) -> EncodeOptions {
    let sweep = &project.sweep;
    EncodeOptions {
        images: sweep.images,
        trace: sweep.trace,
        view_rate_hz: Some(VIEW_RATE_HZ),
        extra_columns: extra_columns(sweep.vary.iter().map(|v| v.key.as_str())),
        first_sample: index / sweep.shard_samples * sweep.shard_samples,
        slot_ns: slot_ns(project),
    }
}

/// Time between the starts of two samples in a file: longer than any pull, in whole seconds.
pub(crate) fn slot_ns(project: &Project) -> u64 {
    (project.sweep.pull().max_time_s.ceil() as u64 + 1) * 1_000_000_000
}

/// What shard `shard` of a project says about itself.
pub(crate) fn shard_info(project: &Project, shard: u64) -> ShardInfo {
    ShardInfo {
        gripgen_version: VERSION.into(),
        config_sha256: project.config_sha256.clone(),
        name: project.name.clone(),
        source: "sim".into(),
        shard,
        shards: project.sweep.shards(),
        first_sample: shard * project.sweep.shard_samples,
        samples: samples_of_shard(project, shard),
        slot_ns: slot_ns(project),
        config_toml: project.config_toml.clone(),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
