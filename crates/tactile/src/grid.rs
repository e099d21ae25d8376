//! Images of numbers: height maps and the planes of the pipeline.

/// The pixel grid of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Side of a pixel on the gel.
    pub metres_per_px: f64,
}

impl Grid {
    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.width_px * self.height_px
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of a pixel's centre in the `gel` frame.
    pub fn centre_m(&self, column: usize, row: usize) -> (f64, f64) {
        let at = |i: usize, n: usize| (i as f64 + 0.5 - n as f64 / 2.0) * self.metres_per_px;
        (at(column, self.width_px), at(row, self.height_px))
    }
}

/// One number per pixel, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values.
    pub values: Vec<f32>,
}

impl Plane {
    /// A plane of one value.
    pub fn filled(width: usize, height: usize, value: f32) -> Self {
        Self { width, height, values: vec![value; width * height] }
    }

    /// Row `y`.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// The value in column `x`, row `y`.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }
}
