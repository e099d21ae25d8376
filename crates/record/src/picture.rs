//! PNG and JPEG, through the `image` crate.

use gripgen_twin::TactileImage;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Why an image could not be coded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("image: {0}")]
pub struct PictureError(String);

/// A PNG of an RGB image. Fast compression and one filter for all rows: slower settings gain nothing on noisy tactile
/// images, choosing a filter for each row costs a third more time for 4 % of the size.
///
/// # Errors
///
/// Bytes that do not fit the size of the image.
pub fn encode_png(image: &TactileImage) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 2);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Sub)
        .write_image(&image.rgb, image.width_px, image.height_px, ExtendedColorType::Rgb8)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// The same of an image without noise, which is worth more time: 38 kB in 1.9 ms of a 320 x 240 frame, where fast compression takes
/// 54 kB and 0.5 ms, the default 35 kB and 4.6 ms, the best 31 kB and 40 ms or more.
///
/// # Errors
///
/// As [`encode_png`].
pub fn encode_small_png(image: &TactileImage) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 4);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Level(4), FilterType::Up)
        .write_image(&image.rgb, image.width_px, image.height_px, ExtendedColorType::Rgb8)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// A JPEG of an RGB image without subsampled colours, for pages that people look at; nothing that is measured or trained on goes through it.
///
/// # Errors
///
/// As [`encode_png`].
pub fn encode_jpeg(image: &TactileImage, quality: u8) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 8);
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(&image.rgb, image.width_px, image.height_px, ExtendedColorType::Rgb8)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// The same of a frame whose background has been taken off: 18 kB.
pub(crate) fn encode_smallest_png(image: &TactileImage) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 8);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Level(6), FilterType::Sub)
        .write_image(&image.rgb, image.width_px, image.height_px, ExtendedColorType::Rgb8)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// A PNG of one channel: bytes of `L8`, or of `L16` in the order of the machine. Labels are flat: the fast setting takes most.
pub(crate) fn encode_grey(
    values: &[u8],
    size: (u32, u32),
    kind: ExtendedColorType,
) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(values.len() / 8);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up)
        .write_image(values, size.0, size.1, kind)
        .map_err(|e| PictureError(e.to_string()))?;
    Ok(bytes)
}

/// The values of a PNG of one channel, of 8 or 16 bits.
pub(crate) fn decode_grey(bytes: &[u8], wanted: (u32, u32)) -> Result<Vec<u16>, PictureError> {
    let decoded = image::load_from_memory(bytes).map_err(|e| PictureError(e.to_string()))?;
    let size = (decoded.width(), decoded.height());
    if size != wanted {
        return Err(PictureError(format!("{size:?} pixels of {wanted:?}")));
    }
    Ok(match decoded {
        image::DynamicImage::ImageLuma8(grey) => grey.into_raw().into_iter().map(u16::from).collect(),
        other => other.into_luma16().into_raw(),
    })
}

/// Whether bytes begin like a JPEG, whatever their file is called.
pub fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xd8, 0xff])
}

/// Decodes a PNG or JPEG into RGB.
///
/// # Errors
///
/// Bytes that are no picture.
pub fn decode(bytes: &[u8]) -> Result<TactileImage, PictureError> {
    let decoded = image::load_from_memory(bytes).map_err(|e| PictureError(e.to_string()))?.into_rgb8();
    Ok(TactileImage { width_px: decoded.width(), height_px: decoded.height(), rgb: decoded.into_raw() })
}

/// Decodes an RGB PNG of a known size into `out` without a copy; the inner error is the size of another one.
///
/// Checksums of the PNG are not looked at: chunks of a shard have their own.
pub(crate) fn decode_png_into(
    bytes: &[u8],
    wanted: (u32, u32),
    out: &mut [u8],
) -> Result<Result<(), (u32, u32)>, PictureError> {
    let mut options = png::DecodeOptions::default();
    options.set_ignore_checksums(true);
    let decoder = png::Decoder::new_with_options(std::io::Cursor::new(bytes), options);
    let mut reader = decoder.read_info().map_err(|e| PictureError(e.to_string()))?;
    let info = reader.info();
    if (info.width, info.height) != wanted {
        return Ok(Err((info.width, info.height)));
    }
    if info.color_type != png::ColorType::Rgb || info.bit_depth != png::BitDepth::Eight {
        // Somebody else's images: grey, with transparency, of 16 bits.
        let image = decode(bytes)?;
        out.copy_from_slice(&image.rgb);
        return Ok(Ok(()));
    }
    reader.next_frame(out).map_err(|e| PictureError(e.to_string()))?;
    Ok(Ok(()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What presses are refused for: a picture of one channel comes out as three equal ones.
    #[test]
    fn a_picture_of_one_channel_has_three_equal_ones() {
        let levels: Vec<u8> = (0..17 * 9).map(|i| (i * 5 % 251) as u8).collect();
        let mut png = Vec::new();
        PngEncoder::new(&mut png).write_image(&levels, 17, 9, ExtendedColorType::L8).unwrap();
        let read = decode(&png).unwrap();
        assert!(read.rgb.chunks_exact(3).zip(&levels).all(|(rgb, level)| rgb == [*level; 3]));
        assert!(!is_jpeg(&png));
    }

    #[test]
    fn png_is_lossless() {
        let rgb = (0..3 * 17 * 9).map(|i: u32| (i * 37 % 251) as u8).collect();
        let image = TactileImage { width_px: 17, height_px: 9, rgb };
        assert_eq!(decode(&encode_png(&image).unwrap()).unwrap(), image);
        assert!(decode(b"no image").is_err());
        let mut out = vec![0; image.rgb.len()];
        let png = encode_png(&image).unwrap();
        assert_eq!(decode_png_into(&png, (17, 9), &mut out), Ok(Ok(())));
        assert_eq!(out, image.rgb);
        assert_eq!(decode_png_into(&png, (9, 17), &mut out), Ok(Err((17, 9))));
        assert!(decode_png_into(&png[..png.len() / 2], (17, 9), &mut out).is_err());
    }
}
