//! Images of numbers: height maps and the planes of the pipeline.

use gripgen_twin::TactileImage;

/// The pixel grid of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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

    /// A plane from a function of the position of each pixel's centre.
    pub fn plane(&self, value: impl Fn(f64, f64) -> f64) -> Plane {
        Plane::from_fn(self.width_px, self.height_px, |column, row| {
            let (x_m, y_m) = self.centre_m(column, row);
            value(x_m, y_m) as f32
        })
    }
}

/// Grey levels of red, green and blue of an image.
pub(crate) fn levels_of(image: &TactileImage) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| image.rgb.iter().skip(c).step_by(3).map(|&v| f32::from(v)).collect())
}

/// Heights with those of a gel at rest, where it is not flat.
pub(crate) fn added(heights: Plane, rest: Option<&Plane>) -> Plane {
    match rest {
        Some(rest) => heights.zip(rest, |height, rest| height + rest),
        None => heights,
    }
}

/// Sets of marked pixels that touch along a side, each in rising order, by their first pixels. `marked` is row by row.
pub(crate) fn islands(mut marked: Vec<bool>, width: usize) -> Vec<Vec<usize>> {
    let mut islands = Vec::new();
    for first in 0..marked.len() {
        if !std::mem::take(&mut marked[first]) {
            continue;
        }
        let (mut island, mut next) = (vec![first], 0);
        while let Some(&pixel) = island.get(next) {
            next += 1;
            let (x, end) = (pixel % width, marked.len());
            let sides = [
                (x > 0).then(|| pixel - 1),
                (x + 1 < width).then_some(pixel + 1),
                pixel.checked_sub(width),
                Some(pixel + width).filter(|&below| below < end),
            ];
            island.extend(sides.into_iter().flatten().filter(|&side| std::mem::take(&mut marked[side])));
        }
        island.sort_unstable();
        islands.push(island);
    }
    islands
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

    /// A plane from a function of column and row.
    pub fn from_fn(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> f32) -> Self {
        let values = (0..width * height).map(|i| value(i % width, i / width)).collect();
        Self { width, height, values }
    }

    /// A function of each value.
    pub(crate) fn map(&self, of: impl Fn(f32) -> f32) -> Self {
        Self { values: self.values.iter().map(|&v| of(v)).collect(), ..*self }
    }

    /// A function of the values of this plane and of another one of its size.
    pub(crate) fn zip(&self, other: &Self, of: impl Fn(f32, f32) -> f32) -> Self {
        Self { values: self.values.iter().zip(&other.values).map(|(&a, &b)| of(a, b)).collect(), ..*self }
    }

    /// The largest value; `-inf` without any.
    pub(crate) fn highest(&self) -> f32 {
        self.values.iter().fold(f32::NEG_INFINITY, |m, &v| m.max(v))
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
