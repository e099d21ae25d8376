//! A shadow table as plain lists, for a device that draws it.

use super::Shadow;
use super::blur::{Blur, Border};
use super::table::ShadowKind;

/// What stage `shadow` needs beside the image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FlatShadow {
    /// What the values of the targets are.
    pub(crate) kind: ShadowKind,
    /// Pixels around the core from which rays go out.
    pub(crate) rim_px: usize,
    /// Begin of the first row in pixels of height, rows per pixel, and whether the outermost rows hold beyond their heights.
    pub(crate) first_px: f64,
    pub(crate) per_px: f64,
    pub(crate) held: bool,
    /// Number of rows.
    pub(crate) heights: usize,
    /// Cosine and sine of the lower border of each sector of direction.
    pub(crate) borders: Vec<[f64; 2]>,
    /// First and end of the targets of sector `n` and row `h`, at `n * heights + h`.
    pub(crate) fans: Vec<[usize; 2]>,
    /// Where each target lies from the origin, and its red, green and blue; infinite where a channel has none.
    pub(crate) targets: Vec<([i32; 2], [f32; 3])>,
    /// Centre and one side of each blur, and whether its mirrored border has the edge once.
    pub(crate) blurs: Vec<(Vec<f32>, bool)>,
    /// What takes the place of the background with Taxim's colours and table.
    pub(crate) base: Option<[Vec<f32>; 3]>,
}

impl Shadow {
    /// The table laid out for one sensor.
    pub(crate) fn flat(&self) -> FlatShadow {
        let rays = &self.rays;
        let one_blur = |b: &Blur| (b.weights.clone(), b.border == Border::EdgeOnce);
        FlatShadow {
            kind: self.table.kind,
            rim_px: self.rim_px,
            first_px: rays.first_px,
            per_px: rays.per_px,
            held: rays.clamped,
            heights: rays.heights,
            borders: rays.sectors.borders(),
            fans: rays.fans.iter().map(|&(from, to, _)| [from, to]).collect(),
            targets: rays
                .targets
                .iter()
                .map(|t| ([t.dx, t.dy], [t.value[0], t.value[1], t.value[2]]))
                .collect(),
            blurs: self.blurs.iter().map(one_blur).collect(),
            base: self.base.clone(),
        }
    }
}
