//! Tactile images.

pub mod film;
pub mod pixel_noise;

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

    /// Turned clockwise by so many quarters, then mirrored.
    #[must_use]
    pub fn turned(&self, quarters: u32, mirror: bool) -> Self {
        if quarters.is_multiple_of(4) && !mirror {
            return self.clone();
        }
        let (columns, rows) = (self.width_px, self.height_px);
        let (width_px, height_px) =
            if quarters.is_multiple_of(2) { (columns, rows) } else { (rows, columns) };
        let mut rgb = Vec::with_capacity(self.rgb.len());
        for y in 0..height_px {
            for x in 0..width_px {
                let x = if mirror { width_px - 1 - x } else { x };
                let (from_x, from_y) = match quarters % 4 {
                    0 => (x, y),
                    1 => (y, rows - 1 - x),
                    2 => (columns - 1 - x, rows - 1 - y),
                    _ => (columns - 1 - y, x),
                };
                rgb.extend(self.pixel(from_x, from_y));
            }
        }
        Self { width_px, height_px, rgb }
    }

    /// What lies in this many columns and rows from a first column and row on; `None` if that is empty or reaches beyond the image.
    pub fn cut_out(&self, [x, y, columns, rows]: [u32; 4]) -> Option<Self> {
        let inside =
            |from: u32, size: u32, end: u32| size > 0 && from.checked_add(size).is_some_and(|to| to <= end);
        if !inside(x, columns, self.width_px) || !inside(y, rows, self.height_px) {
            return None;
        }
        let line = |row: u32| {
            let from = 3 * (row as usize * self.width_px as usize + x as usize);
            &self.rgb[from..from + 3 * columns as usize]
        };
        let rgb = (y..y + rows).flat_map(line).copied().collect();
        Some(Self { width_px: columns, height_px: rows, rgb })
    }
}
