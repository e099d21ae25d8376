//! Differences between 8-bit images.

use gripgen_twin::TactileImage;

/// Two images of different size.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("images differ in size: {}x{} against {}x{} pixels", .first.0, .first.1, .second.0, .second.1)]
pub struct SizeMismatch {
    /// Width and height of the first image.
    pub first: (u32, u32),
    /// Width and height of the second image.
    pub second: (u32, u32),
}

/// Mean squared difference over all channels, in squared grey levels.
pub fn mean_squared_error(a: &TactileImage, b: &TactileImage) -> Result<f64, SizeMismatch> {
    if (a.width_px, a.height_px) != (b.width_px, b.height_px) {
        return Err(SizeMismatch { first: (a.width_px, a.height_px), second: (b.width_px, b.height_px) });
    }
    let sum: u64 = a.rgb.iter().zip(&b.rgb).map(|(&x, &y)| u64::from(x.abs_diff(y)).pow(2)).sum();
    Ok(sum as f64 / a.rgb.len() as f64)
}

/// Peak signal-to-noise ratio in decibels for 8-bit images: `10 log10(255^2 / MSE)`, infinite for MSE 0.
///
/// ```
/// // Wucherer et al. 2023 print both numbers for one pair of images.
/// assert!((gripgen_tactile::metrics::psnr_db(262.95) - 23.93).abs() < 0.006);
/// ```
pub fn psnr_db(mean_squared_error: f64) -> f64 {
    10.0 * libm::log10(255.0 * 255.0 / mean_squared_error)
}
