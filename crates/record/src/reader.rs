//! Reading a shard: any sample, in any order, one at a time.

mod file;
mod messages;
mod rig;

use crate::background::Background;
use crate::picture::{PictureError, decode};
use crate::proto::foxglove::{CompressedImage, RawImage};
use crate::proto::gripgen_v1::{PullTrace, Sample};
use crate::shard::RIG_SOURCE;
use crate::shard::{CLEAN, EVEN, LAYOUT_VERSION, METADATA_NAME, rest_name};
use file::{attachment, metadata_record, open_mcap, read_summary};
use gripgen_twin::image::pixel_noise::PixelNoise;
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use mcap::{McapError, Summary};
use prost::Message;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A shard opened for reading. Its summary is in memory; a sample is read when it is asked for. Nothing is mapped: a file
/// that is cut off while it is open is an error and not the end of the process.
pub struct ShardReader {
    path: PathBuf,
    file: File,
    bytes: u64,
    summary: Summary,
    metadata: BTreeMap<String, String>,
    slot_ns: u64,
    samples: u64,
    first_sample: u64,
    /// What its images are stored without.
    background: Option<PerJaw<Background>>,
}

/// One sample of a shard.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// What was asked and what came out.
    pub sample: Sample,
    /// The images, where there are any.
    pub images: Option<PerJaw<TactileImage>>,
    /// The force over time, where it is stored.
    pub trace: Option<gripgen_twin::PullTrace>,
}

/// The undecoded messages of a sample.
pub(crate) struct RawRecord {
    pub(crate) sample: Vec<u8>,
    pub(crate) images: Option<PerJaw<Vec<u8>>>,
    pub(crate) raw_images: bool,
    pub(crate) trace: Option<Vec<u8>>,
}

/// Why a shard could not be read. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened.
    #[error("{path}: {source}")]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not an MCAP file, cut off, or damaged.
    #[error("{path}: not a readable MCAP file: {source}")]
    Mcap {
        /// The file.
        path: PathBuf,
        /// What the format reader says.
        source: McapError,
    },
    /// An MCAP file that is no shard, a sample that is not in it, or a damaged message.
    #[error("{path}: {problem}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

impl ReadError {
    fn foreign(path: &Path, problem: &str) -> Self {
        Self::Content { path: path.into(), problem: format!("not a gripgen shard: {problem}") }
    }
}

impl ShardReader {
    /// Opens a shard and checks that it is one.
    ///
    /// # Errors
    ///
    /// A file that cannot be opened, is no MCAP file or no shard of gripgen.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let foreign = |problem: String| ReadError::foreign(path, &problem);
        let bad = |source| ReadError::Mcap { path: path.into(), source };
        let (file, bytes) = open_mcap(path)?;
        let summary =
            read_summary(&file, bytes).map_err(bad)?.ok_or_else(|| foreign("it has no summary".into()))?;
        let metadata = metadata_record(&file, bytes, &summary, METADATA_NAME)
            .map_err(bad)?
            .ok_or_else(|| foreign(format!("it has no metadata record `{METADATA_NAME}`")))?;
        let number = |key: &str| {
            metadata
                .get(key)
                .and_then(|v| v.parse::<u64>().ok())
                .ok_or_else(|| foreign(format!("its metadata has no number `{key}`")))
        };
        let version = number("schema_version")?;
        if version != u64::from(LAYOUT_VERSION) {
            return Err(foreign(format!(
                "its layout is version {version}, this gripgen reads {LAYOUT_VERSION}"
            )));
        }
        let (slot_ns, samples, first_sample) =
            (number("slot_ns")?, number("n_samples")?, number("first_sample")?);
        if slot_ns == 0 {
            return Err(foreign("its time slots are 0 ns long".into()));
        }
        if samples.checked_mul(slot_ns).is_none() || first_sample.checked_add(samples).is_none() {
            return Err(foreign(format!(
                "{samples} samples from number {first_sample} on, {slot_ns} ns each, end beyond what can be counted"
            )));
        }
        if let Some(other) = metadata.get("images").filter(|images| *images != CLEAN) {
            return Err(foreign(format!(
                "its images are stored as `{other}`, which this gripgen does not read"
            )));
        }
        let background = match metadata.get("background").map(String::as_str) {
            None => None,
            Some(EVEN) => Some(PerJaw::try_from_fn(|jaw| {
                let png = attachment(&file, bytes, &summary, rest_name(jaw))
                    .map_err(bad)?
                    .ok_or_else(|| foreign(format!("it has no attachment `{}`", rest_name(jaw))))?;
                decode(&png).map(Background::new).map_err(|e| foreign(format!("{}: {e}", rest_name(jaw))))
            })?),
            Some(other) => return Err(foreign(format!("its images are without a background `{other}`"))),
        };
        let path = path.into();
        Ok(Self { path, file, bytes, summary, slot_ns, samples, first_sample, metadata, background })
    }

    /// What the shard says about itself.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// Whether a rig made it.
    pub(crate) fn is_rig(&self) -> bool {
        self.metadata.get("source").is_some_and(|source| source == RIG_SOURCE)
    }

    /// Whether its samples have images.
    pub fn has_images(&self) -> bool {
        self.summary.channels.values().any(|c| c.topic.starts_with("/tactile/"))
    }

    /// Whether it has a topic.
    pub(crate) fn has_topic(&self, topic: &str) -> bool {
        self.summary.channels.values().any(|c| c.topic == topic)
    }

    /// Whether these are stored without their noise, which every reader here adds.
    pub fn has_clean_images(&self) -> bool {
        self.metadata.get("images").is_some_and(|images| images == CLEAN)
    }

    /// Whether these are stored without PNG.
    pub(crate) fn has_raw_images(&self) -> bool {
        self.summary.schemas.values().any(|s| s.name == "foxglove.RawImage")
    }

    /// Global indices of its samples.
    pub fn indices(&self) -> std::ops::Range<u64> {
        self.first_sample..self.first_sample + self.samples
    }

    /// The configuration it was made with.
    ///
    /// # Errors
    ///
    /// A file that cannot be read.
    pub fn config_toml(&self) -> Result<String, ReadError> {
        let foreign = |problem: &str| ReadError::foreign(&self.path, problem);
        let text = attachment(&self.file, self.bytes, &self.summary, "config.toml")
            .map_err(|source| ReadError::Mcap { path: self.path.clone(), source })?
            .ok_or_else(|| foreign("it has no attachment `config.toml`"))?;
        String::from_utf8(text).map_err(|_| foreign("its configuration is not text"))
    }

    /// The `/sample` message of a sample, without its images and trace.
    ///
    /// # Errors
    ///
    /// As [`Self::record`].
    pub fn sample(&self, index: u64) -> Result<Sample, ReadError> {
        let mut found = None;
        self.each_message(index, |topic, data| {
            if topic == "/sample" {
                found = Some(Sample::decode(data).map_err(|e| e.to_string())?);
            }
            Ok(())
        })?;
        found.ok_or_else(|| self.damaged(index, "/sample", "it is missing"))
    }

    /// Everything of a sample.
    ///
    /// # Errors
    ///
    /// A sample that is not in the shard, or a message that cannot be read.
    pub fn record(&self, index: u64) -> Result<Record, ReadError> {
        let raw = self.raw(index)?;
        let bad = |topic: &str, problem: String| self.damaged(index, topic, &problem);
        let sample = Sample::decode(&raw.sample[..]).map_err(|e| bad("/sample", e.to_string()))?;
        let images = raw
            .images
            .map(|both| {
                PerJaw::try_from_fn(|jaw| {
                    let image = if raw.raw_images { raw_image(&both[jaw]) } else { png_image(&both[jaw]) };
                    let mut image = image.map_err(|problem| bad(&format!("/tactile/{jaw}"), problem))?;
                    self.put_back(jaw, &mut image.rgb);
                    if let Some(noise) = noise_apart(&sample, jaw) {
                        noise.add(&mut image.rgb);
                    }
                    Ok(image)
                })
            })
            .transpose()?;
        let trace = raw
            .trace
            .map(|bytes| {
                let message = PullTrace::decode(&bytes[..]).map_err(|e| e.to_string());
                message.and_then(|m| trace_of(&m)).map_err(|problem| bad("/pull/trace", problem))
            })
            .transpose()?;
        Ok(Record { sample, images, trace })
    }

    /// Puts back what an image was stored without, but for its noise.
    pub(crate) fn put_back(&self, jaw: Jaw, rgb: &mut [u8]) {
        if let Some(background) = &self.background {
            background[jaw].put_back(rgb);
        }
    }

    /// The `/sample` message of a sample and its force over time, where it is stored, without its images.
    ///
    /// # Errors
    ///
    /// As [`Self::record`].
    pub fn pull(&self, index: u64) -> Result<(Sample, Option<gripgen_twin::PullTrace>), ReadError> {
        let (mut sample, mut trace) = (None, None);
        self.each_message(index, |topic, data| {
            match topic {
                "/sample" => sample = Some(Sample::decode(data).map_err(|e| e.to_string())?),
                "/pull/trace" => {
                    trace = Some(trace_of(&PullTrace::decode(data).map_err(|e| e.to_string())?)?);
                }
                _ => {}
            }
            Ok(())
        })?;
        let sample = sample.ok_or_else(|| self.damaged(index, "/sample", "it is missing"))?;
        Ok((sample, trace))
    }

    /// The messages of a sample, as they are stored.
    pub(crate) fn raw(&self, index: u64) -> Result<RawRecord, ReadError> {
        let (mut sample, mut left, mut right, mut trace) = (None, None, None, None);
        self.each_message(index, |topic, data| {
            match topic {
                "/sample" => sample = Some(data.to_vec()),
                "/tactile/left" => left = Some(data.to_vec()),
                "/tactile/right" => right = Some(data.to_vec()),
                "/pull/trace" => trace = Some(data.to_vec()),
                _ => {}
            }
            Ok(())
        })?;
        let sample = sample.ok_or_else(|| self.damaged(index, "/sample", "it is missing"))?;
        let images = match (left, right) {
            (Some(left), Some(right)) => Some(PerJaw { left, right }),
            (None, None) => None,
            (left, _) => {
                let missing = if left.is_none() { Jaw::Left } else { Jaw::Right };
                return Err(self.damaged(index, &format!("/tactile/{missing}"), "it is missing"));
            }
        };
        let raw_images = self.has_raw_images();
        Ok(RawRecord { sample, images, raw_images, trace })
    }

    pub(crate) fn damaged(&self, sample: u64, topic: &str, problem: &str) -> ReadError {
        let problem = format!("sample {sample}, {topic}: {problem}");
        ReadError::Content { path: self.path.clone(), problem }
    }
}

/// The noise that a stored image does not have; `None` where it has it, or there is none.
pub(crate) fn noise_apart(sample: &Sample, jaw: Jaw) -> Option<PixelNoise> {
    let noise = match jaw {
        Jaw::Left => &sample.left_image_noise,
        Jaw::Right => &sample.right_image_noise,
    };
    noise.as_ref().map(|n| PixelNoise { key: n.key, sd_rgb: [n.red, n.green, n.blue] })
}

pub(crate) fn raw_image(data: &[u8]) -> Result<TactileImage, String> {
    let raw = RawImage::decode(data).map_err(|e| e.to_string())?;
    let bytes = 3 * raw.width as usize * raw.height as usize;
    if raw.encoding != "rgb8" || raw.data.len() != bytes {
        return Err(format!("{} bytes of `{}`, expected {bytes} of `rgb8`", raw.data.len(), raw.encoding));
    }
    Ok(TactileImage { width_px: raw.width, height_px: raw.height, rgb: raw.data })
}

pub(crate) fn png_image(data: &[u8]) -> Result<TactileImage, String> {
    let compressed = CompressedImage::decode(data).map_err(|e| e.to_string())?;
    decode(&compressed.data).map_err(|e: PictureError| e.to_string())
}

/// The columns of a trace message in SI units.
pub(crate) fn trace_of(message: &PullTrace) -> Result<gripgen_twin::PullTrace, String> {
    let rows = message.measured_force_n.len();
    let time_s: Vec<f64> = if message.rate_hz > 0.0 {
        (0..rows).map(|i| message.start_s + i as f64 / message.rate_hz).collect()
    } else {
        message.time_s.clone()
    };
    let lengths = [time_s.len(), message.desired_force_n.len(), message.displacement_mm.len()];
    if lengths.iter().any(|&n| n != rows) {
        return Err(format!("its columns have {lengths:?} and {rows} rows"));
    }
    Ok(gripgen_twin::PullTrace {
        time_s,
        desired_force_n: message.desired_force_n.iter().map(|&x| f64::from(x)).collect(),
        measured_force_n: message.measured_force_n.iter().map(|&x| f64::from(x)).collect(),
        displacement_m: message.displacement_mm.iter().map(|&x| f64::from(x) * 1e-3).collect(),
    })
}
