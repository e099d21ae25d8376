//! One pass over shards: workers make samples in any order, a writer puts them into files in theirs.

use super::shards::OpenShard;
use super::{
    SweepError, SweepEvent, SweepOptions, SweepSummary, count, encode_filmed, guarded, samples_of_shard,
};
use crate::project::Project;
use gripgen_record::{EncodedSample, FolderError, PartialShard, RunFolder, ShardStart, Sidecar};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Samples a worker may be ahead of the writer, per worker.
const AHEAD: usize = 4;

/// One pass over shards.
pub(super) struct Run<'a> {
    pub(super) project: &'a Project,
    pub(super) folder: &'a RunFolder,
    pub(super) options: SweepOptions,
    pub(super) stop: &'a AtomicBool,
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
    /// Shards that another process finished in the meantime.
    done: Vec<Sidecar>,
    /// Place of the next sample in the writer's order.
    next_place: u64,
    error: Option<FolderError>,
}

/// A finished sample and its place in the writer's order.
type Done = (u64, u64, Result<EncodedSample, SweepError>);

impl Run<'_> {
    /// Makes `shards` and returns those that another process was writing.
    pub(super) fn make_shards(
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
            done: vec![],
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
        let written = std::thread::scope(|scope| {
            for _ in 0..jobs {
                let (queue, permits, done) = (&queue, &permits, done_in.clone());
                scope.spawn(move || self.work(queue, permits, &done));
            }
            drop(done_in);
            // Its ends of the channels go with the writer: if it fails, the workers stop.
            self.write(&queue, done_out, permit_in, summary, on_event)
        });
        let queue = queue.into_inner().unwrap_or_else(PoisonError::into_inner);
        // Shards that no sample came to, because the writer failed: nothing of them is left.
        for (_, partial) in queue.begun {
            let _ = partial.give_up();
        }
        written?;
        queue.done.iter().for_each(|sidecar| count(summary, sidecar));
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
                Ok(ShardStart::Begun(partial)) => {
                    let first = shard * self.project.sweep.shard_samples;
                    queue.current = first..first + samples_of_shard(self.project, shard);
                    queue.begun.push_back((shard, partial));
                }
                Ok(ShardStart::Busy) => queue.busy.push_back(shard),
                Ok(ShardStart::Done(sidecar)) => queue.done.push(sidecar),
                Err(e) => queue.error = Some(e),
            }
        }
        let index = queue.current.next()?;
        queue.next_place += 1;
        Some((queue.next_place - 1, index))
    }

    fn make_sample(&self, index: u64) -> Result<EncodedSample, SweepError> {
        let (sample, film) = guarded(self.project, index, self.options.simd);
        // A device that is lost is no fault of the sample: the run stops and can be continued.
        if let Some(fault) = self.project.gpu()?.and_then(|gpu| gpu.fault()) {
            return Err(fault.into());
        }
        Ok(encode_filmed(self.project, &sample, film.as_ref())?)
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
                let encoded: Result<EncodedSample, SweepError> = encoded;
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

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
