//! Exports: what all of them share, and one sample as a file of its own, with every reading as a message for viewers.

use crate::dataset::DatasetError;
use crate::encode::{EncodedSample, state_messages, timestamp};
use crate::film_frame::EncodedFrame;
use crate::picture::encode_png;
use crate::proto::foxglove::{CompressedImage, RawImage};
use crate::proto::gripgen_v1::{FilmFrame, PullTrace, Sample};
use crate::reader::{ReadError, ShardReader, trace_of};
use crate::shard::{ShardError, ShardInfo, ShardWriter};
use gripgen_twin::config::ImageStorage;
use gripgen_twin::{Jaw, PerJaw};
use parquet::errors::ParquetError;
use prost::Message;
use prost_types::Timestamp;
use std::io::Cursor;
use std::path::PathBuf;

/// What of each row of a dataset is exported beside its cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExportOptions {
    /// Both images. LeRobot and WebDataset leave out rows without them.
    pub images: bool,
    /// The force over time. LeRobot leaves out rows without it.
    pub traces: bool,
}

/// Why a dataset could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportDatasetError {
    /// The dataset.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A Parquet file.
    #[error("Parquet: {0}")]
    Parquet(#[from] ParquetError),
    /// A tar file.
    #[error("tar: {0}")]
    Tar(#[from] std::io::Error),
    /// A file of a folder.
    #[error("{}: {source}", .path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Nothing is left.
    #[error("no row has what is wanted of it: images {}, traces {}", .0.images, .0.traces)]
    Empty(ExportOptions),
}

/// Why a sample could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The shard.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The new file.
    #[error(transparent)]
    Write(#[from] ShardError),
}

/// The bytes of a one-sample MCAP file: the messages of the shard, starting at time 0, and every row of the trace as
/// a `/pull/state` message.
///
/// # Errors
///
/// A sample that is not in the shard or cannot be read.
pub fn export_sample(reader: &ShardReader, index: u64) -> Result<Vec<u8>, ExportError> {
    let raw = reader.raw(index)?;
    let storage = match (&raw.images, raw.raw_images) {
        (None, _) => ImageStorage::None,
        (_, true) => ImageStorage::Raw,
        (_, false) => ImageStorage::Png,
    };
    let zero = Some(timestamp(0));
    let damaged = |topic: &str, e: prost::DecodeError| reader.damaged(index, topic, &e.to_string());
    let mut sample = Sample::decode(&raw.sample[..]).map_err(|e| damaged("/sample", e))?;
    sample.timestamp = zero;
    // A file of its own has the images as they are read.
    let whole = reader.has_clean_images().then(|| reader.record(index)).transpose()?.and_then(|r| r.images);
    (sample.left_image_noise, sample.right_image_noise) = (None, None);
    let images = raw
        .images
        .map(|both| {
            PerJaw::try_from_fn(|jaw| -> Result<Vec<u8>, ReadError> {
                let topic = format!("/tactile/{jaw}");
                let whole = whole.as_ref().map(|whole| encode_png(&whole[jaw])).transpose();
                let whole = whole.map_err(|e| reader.damaged(index, &topic, &e.to_string()))?;
                image_at(zero, &both[jaw], raw.raw_images, whole).map_err(|e| damaged(&topic, e))
            })
        })
        .transpose()?;
    let (mut trace, mut states) = (None, Vec::new());
    if let Some(bytes) = raw.trace {
        let mut message = PullTrace::decode(&bytes[..]).map_err(|e| damaged("/pull/trace", e))?;
        message.timestamp = zero;
        let rows = trace_of(&message).map_err(|problem| reader.damaged(index, "/pull/trace", &problem))?;
        states = state_messages(&rows, 0, None);
        trace = Some(message.encode_to_vec());
    }
    let film = film_from_zero(reader, index)?;
    let encoded = EncodedSample {
        start_ns: 0,
        status: sample.status(),
        sample: sample.encode_to_vec(),
        images,
        trace,
        states,
        film,
        // A pull of a rig has a file of its own already, which starts at time 0.
        rig: reader.raw_rig(index)?,
        row: vec![],
    };
    let mut writer = ShardWriter::new(Cursor::new(Vec::new()), &info(reader, index)?, storage)?;
    if reader.has_film() {
        writer = writer.with_films(storage)?;
    }
    writer.push(&encoded)?;
    Ok(writer.finish()?.into_inner())
}

/// The message of an image at another time, with another PNG where there is one.
fn image_at(
    time: Option<Timestamp>,
    message: &[u8],
    raw: bool,
    png: Option<Vec<u8>>,
) -> Result<Vec<u8>, prost::DecodeError> {
    if raw {
        let image = RawImage::decode(message)?;
        return Ok(RawImage { timestamp: time, ..image }.encode_to_vec());
    }
    let mut image = CompressedImage::decode(message)?;
    image.timestamp = time;
    image.data = png.unwrap_or(image.data);
    Ok(image.encode_to_vec())
}

/// The film of a sample, starting at time 0.
fn film_from_zero(reader: &ShardReader, index: u64) -> Result<Vec<EncodedFrame>, ReadError> {
    let mut film = reader.raw_film(index)?;
    // That of a rig starts at the time of its trace already.
    let of_rig = reader.has_topic("/rig/log");
    let start_ns = film.first().map_or(0, |frame| if of_rig { 0 } else { frame.time_ns });
    for frame in &mut film {
        frame.time_ns -= start_ns;
        let now = Some(timestamp(frame.time_ns));
        for jaw in Jaw::BOTH {
            let damaged = |e: prost::DecodeError| reader.damaged(index, "/tactile/film", &e.to_string());
            let mut labels = FilmFrame::decode(&frame.labels[jaw][..]).map_err(damaged)?;
            labels.timestamp = now;
            frame.labels[jaw] = labels.encode_to_vec();
            frame.image[jaw] =
                image_at(now, &frame.image[jaw], reader.has_raw_images(), None).map_err(damaged)?;
        }
    }
    Ok(film)
}

/// What the shard says about itself, for one of its samples.
fn info(reader: &ShardReader, index: u64) -> Result<ShardInfo, ReadError> {
    let text = |key: &str| reader.metadata().get(key).cloned().unwrap_or_default();
    let number = |key: &str| text(key).parse().unwrap_or(0);
    Ok(ShardInfo {
        gripgen_version: text("gripgen_version"),
        config_sha256: text("config_sha256"),
        source: text("source"),
        shard: number("shard_index"),
        shards: number("shard_count"),
        first_sample: index,
        samples: 1,
        slot_ns: number("slot_ns"),
        config_toml: reader.config_toml()?,
    })
}
