//! A shard being written, and what stands in it beside the samples.

use super::pipeline::Run;
use super::{SweepError, SweepEvent, SweepSummary, count, samples_of_shard};
use crate::film::Film;
use crate::project::Project;
use crate::version::VERSION;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_record::{
    EncodeOptions, EncodedSample, FilmOptions, INDEX_COLUMNS, PartialShard, PictureError, ShardError,
    ShardInfo, ShardWriter, VIEW_RATE_HZ, encode, encode_frame, extra_columns,
};
use gripgen_twin::config::{ImageNoise, ImageStorage};
use gripgen_twin::{PerJaw, Sample};
use std::io::BufWriter;

/// A shard being written.
pub(super) struct OpenShard {
    shard: u64,
    writer: ShardWriter<BufWriter<std::fs::File>>,
    partial: PartialShard,
    rows: Vec<Vec<String>>,
    failed: u64,
}

impl OpenShard {
    pub(super) fn new(project: &Project, shard: u64, partial: PartialShard) -> Result<Self, SweepError> {
        let info = shard_info(project, shard);
        let file = partial.duplicate()?;
        let images = project.sweep.images;
        let background = project.background();
        let writer = ShardWriter::without(BufWriter::new(file), &info, images, background.as_deref());
        let writer = match project.sweep.film {
            None => writer,
            Some(_) => writer.and_then(|writer| writer.with_films(images)),
        };
        let writer = match writer {
            Ok(writer) => writer,
            Err(e) => return Err(lost(partial, e)),
        };
        Ok(Self { shard, writer, partial, rows: Vec::with_capacity(info.samples as usize), failed: 0 })
    }

    /// Writes a sample; gives the shard back until its last sample closes it.
    pub(super) fn push(
        mut self,
        run: &Run<'_>,
        index: u64,
        encoded: EncodedSample,
        summary: &mut SweepSummary,
        on_event: &mut impl FnMut(SweepEvent),
    ) -> Result<Option<Self>, SweepError> {
        if let Err(e) = self.writer.push(&encoded) {
            drop(self.writer);
            return Err(lost(self.partial, e));
        }
        let mut row = encoded.row;
        row[1] = self.shard.to_string();
        row[2] = self.rows.len().to_string();
        let failed = encoded.status == Status::Failed;
        self.failed += u64::from(failed);
        on_event(SweepEvent::Sample {
            index,
            status: encoded.status,
            failure: if failed { cell(&row, "failure").to_string() } else { String::new() },
            part: cell(&row, "part").to_string(),
            grip_force_n: cell(&row, "grip_force_n").parse().unwrap_or_default(),
            label_n: cell(&row, "max_pull_force_n").parse().ok(),
        });
        self.rows.push(row);
        let samples = samples_of_shard(run.project, self.shard);
        if (self.rows.len() as u64) < samples {
            return Ok(Some(self));
        }
        let first = self.shard * run.project.sweep.shard_samples;
        match self.writer.finish().map(BufWriter::into_inner) {
            Ok(Ok(_)) => {}
            Ok(Err(e)) => return Err(lost(self.partial, ShardError::Mcap(e.into_error().into()))),
            Err(e) => return Err(lost(self.partial, e)),
        }
        let sidecar = run.folder.finish_shard(self.shard, first, self.partial, self.failed, self.rows)?;
        count(summary, &sidecar);
        let (bytes, failed) = (sidecar.bytes, sidecar.failed);
        on_event(SweepEvent::Shard { shard: self.shard, bytes, failed });
        Ok(None)
    }
}

/// A shard that could not be written: a disk that is full gets its room back.
fn lost(partial: PartialShard, e: ShardError) -> SweepError {
    let failure = partial.blame(e);
    // What cannot be removed is never read, and is written anew by the next run.
    let _ = partial.give_up();
    failure
}

/// A cell of an index row.
fn cell<'a>(row: &'a [String], column: &str) -> &'a str {
    let at = INDEX_COLUMNS.iter().position(|c| *c == column).expect("a fixed column");
    &row[at]
}

/// Encodes a sample, and its film where there is one. A film ends where the part has left the window, or is pressed through the gel
/// there.
pub fn encode_filmed(
    project: &Project,
    sample: &Sample,
    film: Option<&Film>,
) -> Result<EncodedSample, PictureError> {
    let mut encoded = encode(sample, &encode_options(project, sample.scenario.index))?;
    let Some(film) = film else { return Ok(encoded) };
    let options = FilmOptions {
        images: project.sweep.images,
        start_ns: encoded.start_ns,
        incipient_slip_s: film.incipient_slip_s,
        whole_slip_s: film.whole_slip_s,
    };
    for number in 0..film.len() {
        let Ok(frame) = film.frame(number) else { break };
        encoded.film.push(encode_frame(number, &frame, &options)?);
    }
    Ok(encoded)
}

/// How sample `index` of a project is encoded into its shard.
pub fn encode_options(project: &Project, index: u64) -> EncodeOptions {
    let sweep = &project.sweep;
    EncodeOptions {
        images: sweep.images,
        trace: sweep.trace,
        view_rate_hz: Some(VIEW_RATE_HZ),
        extra_columns: extra_columns(sweep.drawn_keys()),
        noise_apart_rgb: (sweep.images == ImageStorage::Clean).then(|| noise_rgb(project, index)).flatten(),
        background: project.background(),
        first_sample: index / sweep.shard_samples * sweep.shard_samples,
        slot_ns: slot_ns(project),
    }
}

/// Noise of both sensors of a sample, in levels; `None` where the sample's twin cannot be, and has no images either.
pub fn noise_rgb(project: &Project, index: u64) -> Option<PerJaw<[f32; 3]>> {
    let twin = project.twin_of(index).ok()?;
    PerJaw::try_from_fn(|jaw| match twin.optics[jaw].image_noise {
        ImageNoise::Off => Ok([0.0; 3]),
        ImageNoise::Measured => project.library.sensor(&twin.optics[jaw]).map(|sensor| sensor.noise_rgb),
    })
    .ok()
}

/// Time between the starts of two samples in a file: longer than any pull, in whole seconds.
fn slot_ns(project: &Project) -> u64 {
    (project.sweep.pull().max_time_s.ceil() as u64 + 1) * 1_000_000_000
}

/// What shard `shard` of a project says about itself.
fn shard_info(project: &Project, shard: u64) -> ShardInfo {
    ShardInfo {
        gripgen_version: VERSION.into(),
        config_sha256: project.config_sha256.clone(),
        source: "sim".into(),
        shard,
        shards: project.sweep.shards(),
        first_sample: shard * project.sweep.shard_samples,
        samples: samples_of_shard(project, shard),
        slot_ns: slot_ns(project),
        config_toml: project.config_toml.clone(),
    }
}
