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

/// A message: its channel, its time and its bytes.
type ChannelMessage<'a> = (u16, u64, &'a [u8]);

impl Channels {
    /// The messages of a sample, chunk by chunk; what is not there leaves its chunk empty.
    fn chunks<'a>(&self, sample: &'a EncodedSample) -> [Vec<ChannelMessage<'a>>; 5] {
        let start_ns = sample.start_ns;
        let mut chunks: [Vec<ChannelMessage<'a>>; 5] = Default::default();
        let [core, film, rest, log, states] = &mut chunks;
        core.push((self.sample, start_ns, &sample.sample));
        for (jaw, &channel) in self.images.iter().flat_map(PerJaw::iter) {
            core.extend(sample.images.iter().map(|both| (channel, start_ns, &both[jaw][..])));
        }
        core.extend(sample.trace.iter().map(|trace| (self.trace, start_ns, &trace[..])));
        for (frame, channels) in sample.film.iter().flat_map(|frame| Some((frame, self.film.as_ref()?))) {
            for jaw in Jaw::BOTH {
                film.push((channels.image[jaw], frame.time_ns, &frame.image[jaw]));
                film.push((channels.labels[jaw], frame.time_ns, &frame.labels[jaw]));
            }
        }
        if let (Some(channels), Some(rig)) = (&self.rig, &sample.rig) {
            for (jaw, &channel) in channels.rest.iter() {
                rest.extend(rig.rest.iter().map(|both| (channel, start_ns, &both[jaw][..])));
            }
            log.extend(rig.streams.iter().map(|stream| (channels.log, start_ns, &stream[..])));
            log.extend(rig.events.iter().map(|event| (channels.events, start_ns, &event[..])));
        }
        states.extend(sample.states.iter().map(|state| (self.state, state.time_ns, &state.data[..])));
        chunks
    }
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
            Some((name, descriptor)) => {
                Some(PerJaw::try_from_fn(|jaw| channel(name, descriptor, &format!("/tactile/{jaw}")))?)
            }
        };
        let trace = channel("gripgen.v1.PullTrace", PULL_DESCRIPTOR, "/pull/trace")?;
        let state = channel("gripgen.v1.PullState", PULL_DESCRIPTOR, "/pull/state")?;
        let rig = match info.source == RIG_SOURCE {
            false => None,
            true => Some(RigChannels {
                rest: PerJaw::try_from_fn(|jaw| {
                    let topic = format!("/tactile/{jaw}_rest");
                    channel("foxglove.CompressedImage", COMPRESSED_IMAGE_DESCRIPTOR, &topic)
                })?,
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

    /// Appends a sample: one chunk with what training reads, one with the film, one with what viewers draw; of a rig one with the
    /// images without contact and one with the log between them.
    ///
    /// # Errors
    ///
    /// What the writer says.
    pub fn push(&mut self, sample: &EncodedSample) -> Result<(), ShardError> {
        let sequence = self.written as u32;
        for chunk in self.channels.chunks(sample).iter().filter(|chunk| !chunk.is_empty()) {
            for &(channel_id, time_ns, data) in chunk {
                let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
                self.writer.write_to_known_channel(&header, data)?;
            }
            self.writer.flush()?;
        }
        self.written += 1;
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
