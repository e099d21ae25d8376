//! Samples of a sweep, made while somebody reads them, without a disk.
//!
//! Workers make samples ahead of the reader, who gets them in the order of their indices: each is the sample that a sweep would
//! write, whatever the number of threads. No more than so many are kept, so that memory is bounded and a slow reader slows the
//! workers down.

use gripgen::record::proto::gripgen_v1::Status;
use gripgen::record::{EncodeOptions, Film, PictureError, encode};
use gripgen::tactile::SimdLevel;
use gripgen::tactile::gpu::GpuError;
use gripgen::twin::config::{ImageStorage, TraceStorage};
use gripgen::twin::image::pixel_noise::PixelNoise;
use gripgen::twin::{Jaw, Outcome, PerJaw, TactileImage};
use gripgen::{Project, encode_options, guarded, noise_rgb};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Which samples of a sweep, and how they are made. Only `first` and `every` change what comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamOptions {
    /// Index of the first sample.
    pub first: u64,
    /// Distance of two indices: the number of readers who share the sweep.
    pub every: u64,
    /// Worker threads.
    pub jobs: usize,
    /// Samples that are kept at most.
    pub ahead: usize,
    /// Whether samples come with the films of their pulls, where the sweep has films.
    pub films: bool,
}

/// A sample of a sweep, as its data set has it.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamedSample {
    /// Its global index.
    pub index: u64,
    /// How it ended.
    pub status: Status,
    /// Its row of the index.
    pub row: Vec<String>,
    /// Both images, where the sweep makes some and the sample did not fail.
    pub images: Option<PerJaw<TactileImage>>,
    /// The film of its pull, where it was asked for and there is one.
    pub film: Option<Film>,
}

/// Why a stream ends before its end.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
    /// The graphics processor was lost.
    #[error(transparent)]
    Gpu(#[from] Arc<GpuError>),
    /// A row that cannot be written.
    #[error(transparent)]
    Row(#[from] Arc<PictureError>),
    /// The threads that make samples are those of the process that began the stream.
    #[error(
        "this stream was begun in another process ({begun_by}) and has no threads in this one ({read_by})"
    )]
    Forked {
        /// The process that began it.
        begun_by: u32,
        /// The process that reads it.
        read_by: u32,
    },
    /// A bug of ours beside the sample itself, whose own make it a failed one.
    #[error("internal error in sample {index}, beside its simulation; please report it")]
    Internal {
        /// Its global index.
        index: u64,
    },
}

/// What a reader gets.
#[derive(Debug, Clone)]
pub enum Streamed {
    /// The next sample.
    Sample(Box<StreamedSample>),
    /// Not yet: the time that the reader wanted to wait is over.
    Pending,
    /// There are no more.
    End,
}

/// A sample that was made, or why it was not.
type Made = Result<StreamedSample, StreamError>;

struct State {
    /// Places among the samples of this reader: that of the next to make, and of the next to read.
    made: u64,
    read: u64,
    waiting: BTreeMap<u64, Made>,
    stop: bool,
}

struct Shared {
    project: Arc<Project>,
    options: StreamOptions,
    state: Mutex<State>,
    changed: Condvar,
}

/// Samples of a sweep in order, made ahead by threads that end with it.
pub struct SampleStream {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
    /// The process that the workers are threads of. A child that was forked off has the memory and not the threads.
    process: u32,
}

impl SampleStream {
    /// Begins to make samples.
    pub fn new(project: Arc<Project>, options: StreamOptions) -> Self {
        let state = State { made: 0, read: 0, waiting: BTreeMap::new(), stop: false };
        let options = StreamOptions {
            every: options.every.max(1),
            jobs: options.jobs.max(1),
            ahead: options.ahead.max(1),
            ..options
        };
        let shared = Arc::new(Shared { project, options, state: Mutex::new(state), changed: Condvar::new() });
        let workers = (0..options.jobs)
            .map(|_| {
                let shared = shared.clone();
                std::thread::spawn(move || shared.work())
            })
            .collect();
        Self { shared, workers, process: std::process::id() }
    }

    /// The next sample, waiting for at most so long.
    ///
    /// # Errors
    ///
    /// A graphics processor that is lost, or a sample that cannot be written down: nothing comes after it. Another process than the one
    /// that began the stream.
    pub fn next(&self, wait: Duration) -> Result<Streamed, StreamError> {
        let (begun_by, read_by) = (self.process, std::process::id());
        if begun_by != read_by {
            return Err(StreamError::Forked { begun_by, read_by });
        }
        let shared = &self.shared;
        let mut state = shared.lock();
        if shared.index(state.read).is_none() {
            return Ok(Streamed::End);
        }
        let place = state.read;
        if !state.waiting.contains_key(&place) {
            let waited = shared.changed.wait_timeout_while(state, wait, |s| !s.waiting.contains_key(&place));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let Some(made) = state.waiting.remove(&place) else { return Ok(Streamed::Pending) };
        let sample = made.inspect_err(|_| state.stop = true)?;
        state.read += 1;
        drop(state);
        shared.changed.notify_all();
        Ok(Streamed::Sample(Box::new(sample)))
    }
}

impl Drop for SampleStream {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            // There is nobody to tell and nobody to wait for; the lock may be held by a thread that is not here.
            self.workers.drain(..).for_each(std::mem::forget);
            return;
        }
        self.shared.lock().stop = true;
        self.shared.changed.notify_all();
        for worker in self.workers.drain(..) {
            // A worker that panicked has nothing to say any more.
            let _ = worker.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The index of a place; `None` beyond the sweep.
    fn index(&self, place: u64) -> Option<u64> {
        let index = place.checked_mul(self.options.every)?.checked_add(self.options.first)?;
        (index < self.project.sweep.samples).then_some(index)
    }

    fn work(&self) {
        loop {
            let place = {
                let full = |s: &mut State| !s.stop && s.made - s.read >= self.options.ahead as u64;
                let waited = self.changed.wait_while(self.lock(), full);
                let mut state = waited.unwrap_or_else(PoisonError::into_inner);
                if state.stop || self.index(state.made).is_none() {
                    return;
                }
                state.made += 1;
                state.made - 1
            };
            let Some(index) = self.index(place) else { return };
            let made = catch_unwind(AssertUnwindSafe(|| self.make(index)))
                .unwrap_or(Err(StreamError::Internal { index }));
            self.lock().waiting.insert(place, made);
            self.changed.notify_all();
        }
    }

    fn make(&self, index: u64) -> Made {
        // Frames are made when they are asked for.
        let (sample, film) = guarded(&self.project, index, SimdLevel::best());
        let gpu = self.project.gpu().map_err(Arc::new)?;
        if let Some(fault) = gpu.and_then(|gpu| gpu.fault()) {
            return Err(Arc::new(fault).into());
        }
        // The row is that of the data set; pictures and traces are not encoded.
        let options = EncodeOptions {
            images: ImageStorage::None,
            trace: TraceStorage::None,
            ..encode_options(&self.project, index)
        };
        let encoded = encode(&sample, &options).map_err(Arc::new)?;
        let shard_samples = self.project.sweep.shard_samples;
        let mut row = encoded.row;
        (row[1], row[2]) = ((index / shard_samples).to_string(), (index % shard_samples).to_string());
        let mut images = match sample.outcome {
            Outcome::Pulled(pulled) => pulled.images,
            Outcome::NoContact { images } => images,
            Outcome::Failed { .. } => None,
        };
        // What a reader of the data set would add.
        let apart =
            (self.project.sweep.images == ImageStorage::Clean).then(|| noise_rgb(&self.project, index));
        if let (Some(images), Some(sd_rgb)) = (&mut images, apart.flatten()) {
            for jaw in Jaw::BOTH {
                let key = PixelNoise::key_of(sample.scenario.seed, index, jaw);
                PixelNoise { key, sd_rgb: sd_rgb[jaw] }.add(&mut images[jaw].rgb);
            }
        }
        let film = film.filter(|_| self.options.films).and_then(|film| {
            // It ends where a sweep ends it.
            let frames = (0..film.len()).map_while(|number| film.frame(number).ok());
            Film::as_read(frames, film.incipient_slip_s, film.whole_slip_s)
        });
        Ok(StreamedSample { index, status: encoded.status, row, images, film })
    }
}
