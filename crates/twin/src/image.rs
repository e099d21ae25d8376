//! Tactile images.

/// An 8-bit RGB image, row by row from the top, three bytes per pixel. Up in the image is +z of `world`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TactileImage {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// `3 * width_px * height_px` bytes, red first.
    pub rgb: Vec<u8>,
}

impl TactileImage {
    /// The pixel in column `x`, row `y`.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        let at = 3 * (y as usize * self.width_px as usize + x as usize);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }
}
