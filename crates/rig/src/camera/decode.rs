//! A frame as pixels.

use gripgen_twin::TactileImage;
use image::codecs::jpeg::JpegDecoder;
use image::{DynamicImage, ImageDecoder};
use std::io::Cursor;

/// The largest frame that is decoded: the size in its header says how much memory it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameLimits {
    /// Most columns.
    pub width_px: u32,
    /// Most rows.
    pub height_px: u32,
}

/// Six times the larger frame of an R1.5 (480 x 640).
pub const SHIPPED_FRAME_LIMITS: FrameLimits = FrameLimits { width_px: 4096, height_px: 4096 };

/// A frame that cannot be used. The stream goes on after it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeFrameError {
    /// Not a JPEG from its first marker to its last: a part of a frame would be filled up with grey.
    #[error("a frame of {bytes} bytes is cut off: it {missing}")]
    Cut {
        /// How many bytes there are.
        bytes: usize,
        /// Which marker is missing.
        missing: &'static str,
    },
    /// Too large.
    #[error(
        "a frame of {width_px} x {height_px} px, at most {max_width_px} x {max_height_px} px are decoded"
    )]
    Size {
        /// Columns.
        width_px: u32,
        /// Rows.
        height_px: u32,
        /// Most columns.
        max_width_px: u32,
        /// Most rows.
        max_height_px: u32,
    },
    /// The decoder gave up.
    #[error("the frame is no JPEG that can be decoded: {reason}")]
    Jpeg {
        /// Its words.
        reason: String,
    },
}

/// Decodes a JPEG into RGB; one of a single channel becomes grey.
///
/// # Errors
///
/// A frame that is cut off, larger than the limits, or no JPEG.
pub fn decode_jpeg(bytes: &[u8], limits: &FrameLimits) -> Result<TactileImage, DecodeFrameError> {
    let cut = |missing| DecodeFrameError::Cut { bytes: bytes.len(), missing };
    if !bytes.starts_with(&[0xff, 0xd8]) {
        return Err(cut("has no start (FF D8)"));
    }
    // Inside the picture an FF is followed by 00, so this pair is the end of an image and nothing else.
    if !bytes.windows(2).any(|pair| pair == [0xff, 0xd9]) {
        return Err(cut("has no end (FF D9)"));
    }
    let jpeg = |e: image::ImageError| DecodeFrameError::Jpeg { reason: e.to_string() };
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(jpeg)?;
    let (width_px, height_px) = decoder.dimensions();
    if width_px > limits.width_px || height_px > limits.height_px {
        let (max_width_px, max_height_px) = (limits.width_px, limits.height_px);
        return Err(DecodeFrameError::Size { width_px, height_px, max_width_px, max_height_px });
    }
    let rgb = DynamicImage::from_decoder(decoder).map_err(jpeg)?.into_rgb8().into_raw();
    Ok(TactileImage { width_px, height_px, rgb })
}
