//! Corners and edges of triangles in an image.

/// A triangle corner in pixels; `height_px` grows towards the gel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) x_px: f64,
    pub(super) y_px: f64,
    pub(super) height_px: f64,
    /// Grows with the number of the vertex in the mesh.
    pub(super) number: u32,
}

/// The higher of two numbers, in one instruction.
#[inline(always)]
pub(super) fn higher(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
pub(super) fn lower(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// An edge, seen from the end with the lower number.
pub(super) struct Edge {
    x_px: f64,
    y_px: f64,
    slope: f64,
    rows: (f64, f64),
}

impl Edge {
    #[inline(always)]
    pub(super) fn new(a: &Corner, b: &Corner) -> Self {
        let (a, b) = if a.number <= b.number { (a, b) } else { (b, a) };
        // A horizontal edge crosses no row.
        let rows = if a.y_px == b.y_px {
            (f64::INFINITY, f64::NEG_INFINITY)
        } else {
            (lower(a.y_px, b.y_px), higher(a.y_px, b.y_px))
        };
        Self { x_px: a.x_px, y_px: a.y_px, slope: (b.x_px - a.x_px) / (b.y_px - a.y_px), rows }
    }

    /// Where it crosses row `y`.
    #[inline(always)]
    pub(super) fn crossing(&self, y: f64) -> Option<f64> {
        (y >= self.rows.0 && y <= self.rows.1).then_some(self.x_px + (y - self.y_px) * self.slope)
    }
}
