//! The surface that is drawn.

use crate::grid::Plane;
use std::ops::Range;

/// A surface by rows, in pixels, 0 outside of some rows and columns.
pub(crate) trait Terrain {
    /// Width and height.
    fn size(&self) -> (usize, usize);
    /// Rows with heights or slopes other than 0.
    fn rows(&self) -> Range<usize>;
    /// Columns with heights or slopes other than 0.
    fn columns(&self) -> Range<usize>;
    /// Heights of a row; other columns than those may hold anything.
    fn heights(&self, y: usize) -> &[f32];
    /// Writes the slopes of a row into those columns.
    fn slopes(&self, y: usize, along_x: &mut [f32], along_y: &mut [f32]);
}

/// A surface as planes of heights and slopes.
pub(crate) struct Planes<'a> {
    heights: &'a Plane,
    slopes: Option<[&'a Plane; 2]>,
}

impl<'a> Planes<'a> {
    pub(crate) fn new(heights: &'a Plane, along_x: &'a Plane, along_y: &'a Plane) -> Self {
        Self { heights, slopes: Some([along_x, along_y]) }
    }

    /// Without slopes.
    pub(crate) fn of_heights(heights: &'a Plane) -> Self {
        Self { heights, slopes: None }
    }
}

impl Terrain for Planes<'_> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.heights.width, self.heights.height)
    }
    #[inline(always)]
    fn rows(&self) -> Range<usize> {
        0..self.heights.height
    }
    #[inline(always)]
    fn columns(&self) -> Range<usize> {
        0..self.heights.width
    }
    #[inline(always)]
    fn heights(&self, y: usize) -> &[f32] {
        self.heights.row(y)
    }
    #[inline(always)]
    fn slopes(&self, y: usize, along_x: &mut [f32], along_y: &mut [f32]) {
        if let Some([x, y_plane]) = self.slopes {
            along_x[..x.width].copy_from_slice(x.row(y));
            along_y[..x.width].copy_from_slice(y_plane.row(y));
        }
    }
}
