//! Images of a row: decoding them, and the noise that they may be stored without.

use crate::picture::decode_png_into;
use crate::proto::foxglove::{CompressedImage, RawImage};
use crate::proto::gripgen_v1::Sample;
use crate::reader::{ReadError, ShardReader, noise_apart};
use gripgen_twin::image::pixel_noise::PixelNoise;
use gripgen_twin::{Jaw, PerJaw};
use prost::Message;

/// Which noise images are read with that are stored without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseMode {
    /// That of the sample: the bytes that `images = "png"` stores.
    #[default]
    Stored,
    /// None.
    Off,
    /// Other noise of the same size, that of a pass over the data.
    Again {
        /// Number of the pass.
        pass: u64,
    },
}

impl NoiseMode {
    pub(super) fn of(self, noise: PixelNoise) -> Option<PixelNoise> {
        match self {
            Self::Stored => Some(noise),
            Self::Off => None,
            Self::Again { pass } => Some(noise.drawn_again(pass)),
        }
    }
}

impl ShardReader {
    /// What is not in the stored images of a sample.
    pub(super) fn noise_of(
        &self,
        index: u64,
        sample: &[u8],
    ) -> Result<PerJaw<Option<PixelNoise>>, ReadError> {
        if !self.has_clean_images() {
            return Ok(PerJaw { left: None, right: None });
        }
        let sample = Sample::decode(sample).map_err(|e| self.damaged(index, "/sample", &e.to_string()))?;
        Ok(PerJaw::from_fn(|jaw| noise_apart(&sample, jaw)))
    }

    /// Both images of a sample as they are stored.
    pub(super) fn images_png(&self, index: u64) -> Result<Option<[Vec<u8>; 2]>, ReadError> {
        let both = self.raw(index)?.images;
        both.map(|both| self.png_of(index, "", &both)).transpose()
    }

    /// The PNGs in two messages; `kind` is the end of their topics.
    pub(super) fn png_of(
        &self,
        index: u64,
        kind: &str,
        both: &PerJaw<Vec<u8>>,
    ) -> Result<[Vec<u8>; 2], ReadError> {
        let png = |jaw: Jaw| {
            let image = CompressedImage::decode(&both[jaw][..]);
            image
                .map(|image| image.data.to_vec())
                .map_err(|e| self.damaged(index, &format!("/tactile/{jaw}{kind}"), &e.to_string()))
        };
        Ok([png(Jaw::Left)?, png(Jaw::Right)?])
    }

    /// One image of a sample into `out`; the inner error is the size of an image that is not of the wanted one.
    pub(super) fn image_into(
        &self,
        index: u64,
        jaw: Jaw,
        message: &[u8],
        raw: bool,
        wanted: (u32, u32),
        out: &mut [u8],
    ) -> Result<Result<(), (u32, u32)>, ReadError> {
        let damaged = |problem: String| self.damaged(index, &format!("/tactile/{jaw}"), &problem);
        if raw {
            let image = RawImage::decode(message).map_err(|e| damaged(e.to_string()))?;
            if (image.width, image.height) != wanted {
                return Ok(Err((image.width, image.height)));
            }
            if image.data.len() != out.len() {
                return Err(damaged(format!("{} bytes, expected {}", image.data.len(), out.len())));
            }
            out.copy_from_slice(&image.data);
            return Ok(Ok(()));
        }
        let image = CompressedImage::decode(message).map_err(|e| damaged(e.to_string()))?;
        decode_png_into(&image.data, wanted, out).map_err(|e| damaged(e.to_string()))
    }
}
