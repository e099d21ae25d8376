//! PNG and JPEG, through the `image` crate.

use gripgen_twin::TactileImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Why an image could not be coded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("image: {0}")]
pub struct PictureError(String);

/// A PNG of an RGB image. Fast compression and one filter for all rows: slower settings gain nothing on noisy tactile
/// images, choosing a filter for each row costs a third more time for 4 % of the size.
pub fn encode_png(image: &TactileImage) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 2);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Sub)
        .write_image(&image.rgb, image.width_px, image.height_px, ExtendedColorType::Rgb8)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// Decodes a PNG or JPEG into RGB.
pub fn decode(bytes: &[u8]) -> Result<TactileImage, PictureError> {
    let decoded = image::load_from_memory(bytes).map_err(|e| PictureError(e.to_string()))?.into_rgb8();
    Ok(TactileImage { width_px: decoded.width(), height_px: decoded.height(), rgb: decoded.into_raw() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_is_lossless() {
        let rgb = (0..3 * 17 * 9).map(|i: u32| (i * 37 % 251) as u8).collect();
        let image = TactileImage { width_px: 17, height_px: 9, rgb };
        assert_eq!(decode(&encode_png(&image).unwrap()).unwrap(), image);
        assert!(decode(b"no image").is_err());
    }
}
