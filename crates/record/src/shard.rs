//! Writing a shard: one MCAP file with a number of samples.

use crate::background::Background;
use crate::encode::EncodedSample;
use crate::film_frame::{film_topic, label_topic};
use crate::picture::{PictureError, encode_small_png};
use crate::proto::{
    COMPRESSED_IMAGE_DESCRIPTOR, FILM_DESCRIPTOR, PULL_DESCRIPTOR, RAW_IMAGE_DESCRIPTOR, RIG_DESCRIPTOR,
};
use gripgen_twin::config::ImageStorage;
use gripgen_twin::{Jaw, PerJaw};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// What the `source` of a run and of a shard is where a rig made it.
pub const RIG_SOURCE: &str = "rig";

/// Version of the layout, in the shard's metadata.
pub const LAYOUT_VERSION: u32 = 1;

/// Name of the metadata record.
pub const METADATA_NAME: &str = "gripgen.shard";

/// What the metadata say of images that are stored without their noise.
pub const CLEAN: &str = "clean";

/// What they say of images that are stored without what the frame at rest adds to even rows.
pub const EVEN: &str = "even";

/// Name of the attachment with a jaw's frame at rest.
pub(crate) fn rest_name(jaw: Jaw) -> &'static str {
    match jaw {
        Jaw::Left => "rest_left.png",
        Jaw::Right => "rest_right.png",
    }
}

/// What a shard says about itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardInfo {
    /// Version of gripgen.
    pub gripgen_version: String,
    /// Hash of everything the samples depend on.
    pub config_sha256: String,
    /// `sim` or `rig`.
    pub source: String,
    /// Number of this shard.
    pub shard: u64,
    /// Number of shards.
    pub shards: u64,
    /// Global index of the first sample.
    pub first_sample: u64,
    /// Samples in this shard.
    pub samples: u64,
    /// Time between the starts of two samples.
    pub slot_ns: u64,
    /// The resolved configuration.
    pub config_toml: String,
}

impl ShardInfo {
    fn metadata(&self) -> BTreeMap<String, String> {
        [
            ("schema_version", LAYOUT_VERSION.to_string()),
            ("gripgen_version", self.gripgen_version.clone()),
            ("config_sha256", self.config_sha256.clone()),
            ("source", self.source.clone()),
            ("shard_index", self.shard.to_string()),
            ("shard_count", self.shards.to_string()),
            ("first_sample", self.first_sample.to_string()),
            ("n_samples", self.samples.to_string()),
            ("slot_ns", self.slot_ns.to_string()),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_string(), value))
        .collect()
    }
}

/// Writes samples in order. [`ShardWriter::finish`] ends the file; without it the file is not readable.
pub struct ShardWriter<W: Write + Seek> {
    writer: Writer<W>,
    channels: Channels,
    written: u64,
    expected: u64,
}

struct Channels {
    sample: u16,
    images: Option<PerJaw<u16>>,
    trace: u16,
    state: u16,
    film: Option<FilmChannels>,
    rig: Option<RigChannels>,
}

/// Channels that only a shard with films has.
struct FilmChannels {
    image: PerJaw<u16>,
    labels: PerJaw<u16>,
}

/// Channels that only a shard of a rig has.
struct RigChannels {
    rest: PerJaw<u16>,
    log: u16,
    events: u16,
}

/// Why a shard could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShardError {
    /// The file system, or the format's limits.
    #[error("writing the shard: {0}")]
    Mcap(#[from] McapError),
    /// A frame at rest.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Not as many samples as announced.
    #[error("the shard was announced with {expected} samples and ended after {written}")]
    Count {
        /// Samples announced.
        expected: u64,
        /// Samples written.
        written: u64,
    },
}

impl<W: Write + Seek> ShardWriter<W> {
    /// Starts a file. Nothing in it depends on time, host or path.
    ///
    /// Chunks are not compressed: images are PNG already, and no sample depends on a compressor's version.
    ///
    /// # Errors
    ///
    /// What `to` says.
    pub fn new(to: W, info: &ShardInfo, images: ImageStorage) -> Result<Self, ShardError> {
        Self::without(to, info, images, None)
    }

    /// The same of images that are stored without their background, which the file holds once.
    ///
    /// # Errors
    ///
    /// What `to` says, or a frame at rest that cannot be compressed.
    pub fn without(
        to: W,
        info: &ShardInfo,
        images: ImageStorage,
        background: Option<&PerJaw<Background>>,
    ) -> Result<Self, ShardError> {
        let options = WriteOptions::new()
            .profile("")
            .library(format!("gripgen/{}", info.gripgen_version))
            .compression(None)
            .chunk_size(None);
        let mut writer = Writer::with_options(to, options)?;
        let mut metadata = info.metadata();
        if images == ImageStorage::Clean {
            metadata.insert("images".into(), CLEAN.into());
        }
        if background.is_some() {
            metadata.insert("background".into(), EVEN.into());
        }
        writer.write_metadata(&Metadata { name: METADATA_NAME.into(), metadata })?;
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: "config.toml".into(),
            media_type: "text/x-toml".into(),
            data: Cow::Borrowed(info.config_toml.as_bytes()),
        })?;
        for (jaw, background) in background.iter().flat_map(|both| both.iter()) {
            let png = encode_small_png(background.rest())?;
            writer.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: rest_name(jaw).into(),
                media_type: "image/png".into(),
                data: Cow::Owned(png),
            })?;
        }
        let none = BTreeMap::new();
        let mut channel = |schema: &str, descriptor: &[u8], topic: &str| -> Result<u16, McapError> {
            let schema = writer.add_schema(schema, "protobuf", descriptor)?;
            writer.add_channel(schema, topic, "protobuf", &none)
        };
        let sample = channel("gripgen.v1.Sample", PULL_DESCRIPTOR, "/sample")?;
        let image_schema = match images {
            ImageStorage::Png | ImageStorage::Clean => {
                Some(("foxglove.CompressedImage", COMPRESSED_IMAGE_DESCRIPTOR))
            }
            ImageStorage::Raw => Some(("foxglove.RawImage", RAW_IMAGE_DESCRIPTOR)),
            ImageStorage::None => None,
        };
        let images = match image_schema {
            None => None,
            Some((name, descriptor)) => Some(PerJaw {
                left: channel(name, descriptor, "/tactile/left")?,
                right: channel(name, descriptor, "/tactile/right")?,
            }),
        };
        let trace = channel("gripgen.v1.PullTrace", PULL_DESCRIPTOR, "/pull/trace")?;
        let state = channel("gripgen.v1.PullState", PULL_DESCRIPTOR, "/pull/state")?;
        let rig = match info.source == RIG_SOURCE {
            false => None,
            true => Some(RigChannels {
                rest: PerJaw {
                    left: channel(
                        "foxglove.CompressedImage",
                        COMPRESSED_IMAGE_DESCRIPTOR,
                        "/tactile/left_rest",
                    )?,
                    right: channel(
                        "foxglove.CompressedImage",
                        COMPRESSED_IMAGE_DESCRIPTOR,
                        "/tactile/right_rest",
                    )?,
                },
                log: channel("gripgen.v1.RigStream", RIG_DESCRIPTOR, "/rig/log")?,
                events: channel("gripgen.v1.RigEvent", RIG_DESCRIPTOR, "/rig/events")?,
            }),
        };
        let channels = Channels { sample, images, trace, state, film: None, rig };
        Ok(Self { writer, channels, written: 0, expected: info.samples })
    }

    /// The same of samples whose pulls are filmed.
    ///
    /// # Errors
    ///
    /// What `to` says.
    pub fn with_films(mut self, images: ImageStorage) -> Result<Self, ShardError> {
        let none = BTreeMap::new();
        let (name, descriptor) = match images {
            ImageStorage::Raw => ("foxglove.RawImage", RAW_IMAGE_DESCRIPTOR),
            _ => ("foxglove.CompressedImage", COMPRESSED_IMAGE_DESCRIPTOR),
        };
        let schema = self.writer.add_schema(name, "protobuf", descriptor)?;
        let image =
            PerJaw::try_from_fn(|jaw| self.writer.add_channel(schema, film_topic(jaw), "protobuf", &none))?;
        let schema = self.writer.add_schema("gripgen.v1.FilmFrame", "protobuf", FILM_DESCRIPTOR)?;
        let labels =
            PerJaw::try_from_fn(|jaw| self.writer.add_channel(schema, label_topic(jaw), "protobuf", &none))?;
        self.channels.film = Some(FilmChannels { image, labels });
        Ok(self)
    }

    /// Appends a sample: one chunk with what training reads, one with what viewers draw; of a rig one with the images
    /// without contact and one with the log between them.
    ///
    /// # Errors
    ///
    /// What the writer says.
    pub fn push(&mut self, sample: &EncodedSample) -> Result<(), ShardError> {
        let sequence = self.written as u32;
        let mut write = |channel_id, time_ns, data: &[u8]| {
            let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
            self.writer.write_to_known_channel(&header, data)
        };
        write(self.channels.sample, sample.start_ns, &sample.sample)?;
        if let (Some(channels), Some(images)) = (&self.channels.images, &sample.images) {
            for (jaw, &channel) in channels.iter() {
                write(channel, sample.start_ns, &images[jaw])?;
            }
        }
        if let Some(trace) = &sample.trace {
            write(self.channels.trace, sample.start_ns, trace)?;
        }
        self.writer.flush()?;
        self.push_film(sample, sequence)?;
        self.push_rig(sample, sequence)?;
        if !sample.states.is_empty() {
            for state in &sample.states {
                let (channel_id, time_ns) = (self.channels.state, state.time_ns);
                let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
                self.writer.write_to_known_channel(&header, &state.data)?;
            }
            self.writer.flush()?;
        }
        self.written += 1;
        Ok(())
    }

    /// The film, in a chunk of its own.
    fn push_film(&mut self, sample: &EncodedSample, sequence: u32) -> Result<(), ShardError> {
        let Some(channels) = self.channels.film.as_ref().filter(|_| !sample.film.is_empty()) else {
            return Ok(());
        };
        for frame in &sample.film {
            for jaw in Jaw::BOTH {
                let of_jaw =
                    [(channels.image[jaw], &frame.image[jaw]), (channels.labels[jaw], &frame.labels[jaw])];
                for (channel_id, data) in of_jaw {
                    let (log_time, publish_time) = (frame.time_ns, frame.time_ns);
                    let header = MessageHeader { channel_id, sequence, log_time, publish_time };
                    self.writer.write_to_known_channel(&header, data)?;
                }
            }
        }
        Ok(self.writer.flush()?)
    }

    /// What only a rig has, in chunks of its own.
    fn push_rig(&mut self, sample: &EncodedSample, sequence: u32) -> Result<(), ShardError> {
        let (Some(channels), Some(rig)) = (&self.channels.rig, &sample.rig) else { return Ok(()) };
        let time_ns = sample.start_ns;
        let write = |writer: &mut Writer<W>, channel_id, data: &[u8]| {
            let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
            writer.write_to_known_channel(&header, data)
        };
        if let Some(rest) = &rig.rest {
            for (jaw, &channel) in channels.rest.iter() {
                write(&mut self.writer, channel, &rest[jaw])?;
            }
            self.writer.flush()?;
        }
        for stream in &rig.streams {
            write(&mut self.writer, channels.log, stream)?;
        }
        for event in &rig.events {
            write(&mut self.writer, channels.events, event)?;
        }
        if !(rig.streams.is_empty() && rig.events.is_empty()) {
            self.writer.flush()?;
        }
        Ok(())
    }

    /// Ends the file and gives back what it was written to.
    ///
    /// # Errors
    ///
    /// What the writer says, or another number of samples than was announced.
    pub fn finish(mut self) -> Result<W, ShardError> {
        if self.written != self.expected {
            return Err(ShardError::Count { expected: self.expected, written: self.written });
        }
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}
