//! `images` of `sweep.toml`: a word, or a table that also says whether the pull is filmed.

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// How images are stored, and which there are beside those of the grip: `images = "png"`, or a section `[images]`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "ImagesForm")]
#[schemars(with = "ImagesForm")]
pub struct ImagesFile {
    /// How images are stored.
    pub storage: ImageStorage,
    /// How much time may be spent on their size.
    pub compression: Compression,
    /// Images while the part is pulled.
    pub during_pull: Option<DuringPullFile>,
}

/// How images are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageStorage {
    /// PNG, lossless.
    #[default]
    Png,
    /// PNG of the frames before sensor noise: a third of the size. What reads them adds the noise, bit for bit.
    Clean,
    /// Raw RGB: larger and faster to read.
    Raw,
    /// No images.
    None,
}

/// How small frames without noise are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compression {
    /// PNG of what the camera sees.
    #[default]
    Fast,
    /// Half of that size, at more time: PNG of what the contact changes, on rows of one colour each. The frame at rest stands in each file
    /// once, and readers of gripgen give the same frames.
    Small,
}

/// What stands in the file.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
#[serde(untagged)]
enum ImagesForm {
    /// `images = "png"`
    Word(ImageStorage),
    /// `[images]`
    Table(ImagesTable),
}

/// `[images]`
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct ImagesTable {
    /// How images are stored.
    storage: ImageStorage,
    /// How small images are stored, with `storage = "clean"`.
    compression: Compression,
    /// Images while the part is pulled; none where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    during_pull: Option<DuringPullFile>,
}

/// Frames of a pull: so many, or so many per second.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DuringPullFile {
    /// Frames of a pull, the grip's first: two thirds of them evenly in time until all of the contact slips, the others
    /// evenly over the way after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<u32>,
    /// Frames per second, as a camera takes them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
}

impl From<ImagesFile> for ImagesForm {
    fn from(file: ImagesFile) -> Self {
        let ImagesFile { storage, compression, during_pull } = file;
        match (compression, during_pull) {
            (Compression::Fast, None) => Self::Word(storage),
            _ => Self::Table(ImagesTable { storage, compression, during_pull }),
        }
    }
}

impl<'de> Deserialize<'de> for ImagesFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WordOrTable;
        impl<'de> Visitor<'de> for WordOrTable {
            type Value = ImagesFile;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("\"png\", \"clean\", \"raw\", \"none\", or a table with storage and during_pull")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<ImagesFile, E> {
                let storage = ImageStorage::deserialize(StrDeserializer::new(word))?;
                Ok(ImagesFile { storage, ..ImagesFile::default() })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ImagesFile, A::Error> {
                let ImagesTable { storage, compression, during_pull } =
                    ImagesTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(ImagesFile { storage, compression, during_pull })
            }
        }
        deserializer.deserialize_any(WordOrTable)
    }
}
