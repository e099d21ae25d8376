//! Where the points of a pixel lie, and on which side of an edge.

use super::edge::Corner;

/// Points along a side of a pixel; the middle one is its centre.
const FINE: usize = 3;

/// Points of a pixel.
pub(super) use crate::deform::POINTS;
const _: () = assert!(FINE * FINE == POINTS);

/// Heights of a pixel in memory: its points, and what fills up a vector.
pub(super) const PLACES: usize = 16;

/// An edge as a line, seen from the end with the lower number. `x (row - from.1) - y (column - from.0)` is at least 0 on the
/// triangle's side.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub(super) from: (f64, f64),
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Side {
    /// The edge from `a` to `b` of a triangle that lies on its left; if `turn` is -1, on its right.
    #[inline(always)]
    pub(super) fn new(a: &Corner, b: &Corner, turn: f64) -> Self {
        let (a, b, turn) = if a.number <= b.number { (a, b, turn) } else { (b, a, -turn) };
        Self { from: (a.x_px, a.y_px), x: turn * (b.x_px - a.x_px), y: turn * (b.y_px - a.y_px) }
    }

    /// What is added on the way to the points of a pixel.
    #[inline(always)]
    pub(super) fn offsets(&self) -> Offsets {
        Offsets::new(-self.y, self.x)
    }
}

/// What a linear function adds from the centre of a pixel to its points.
#[derive(Clone, Copy)]
pub(super) struct Offsets(pub(super) [f32; PLACES]);

impl Offsets {
    #[inline(always)]
    pub(super) fn new(per_column: f64, per_row: f64) -> Self {
        let (per_column, per_row) = (per_column as f32, per_row as f32);
        let mut offsets = [0.0; PLACES];
        for i in 0..PLACES {
            offsets[i] = per_column * COLUMNS[i] + per_row * ROWS[i];
        }
        Self(offsets)
    }
}

/// Where the points of a pixel are, from its centre.
const COLUMNS: [f32; PLACES] = off_centre(1);
const ROWS: [f32; PLACES] = off_centre(FINE);

const fn off_centre(step: usize) -> [f32; PLACES] {
    let mut at = [0.0; PLACES];
    let mut i = 0;
    while i < POINTS {
        at[i] = ((i / step % FINE) as f32 - 1.0) / FINE as f32;
        i += 1;
    }
    at
}
