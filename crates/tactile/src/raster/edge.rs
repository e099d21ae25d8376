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

    /// Between which columns it lies from one row to another; the first is larger where it does not.
    #[inline(always)]
    fn reach(&self, rows: (f64, f64)) -> (f64, f64) {
        let (from, to) = (higher(rows.0, self.rows.0), lower(rows.1, self.rows.1));
        let x = |y: f64| self.x_px + (y - self.y_px) * self.slope;
        let (a, b) = (x(from), x(to));
        if from <= to { (lower(a, b), higher(a, b)) } else { (f64::INFINITY, f64::NEG_INFINITY) }
    }
}

/// Between which columns a triangle lies from one row to another.
#[inline(always)]
pub(super) fn reach(edges: &[Edge; 3], rows: (f64, f64)) -> (f64, f64) {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for edge in edges {
        let (a, b) = edge.reach(rows);
        (from, to) = (lower(from, a), higher(to, b));
    }
    (from, to)
}

/// Rows whose columns are found at once.
pub(super) const ROWS: usize = 8;

/// First and last column of a triangle in the rows from `y` on, of those from 0 to `last`; the first is larger where there
/// is none.
#[inline(always)]
pub(super) fn spans(edges: &[Edge; 3], y: f64, last: f64) -> ([i32; ROWS], [i32; ROWS]) {
    let (mut from, mut to) = ([f64::INFINITY; ROWS], [f64::NEG_INFINITY; ROWS]);
    for edge in edges {
        for i in 0..ROWS {
            let y = y + f64::from(i as u32);
            let crossed = (y >= edge.rows.0) & (y <= edge.rows.1);
            let x = edge.x_px + (y - edge.y_px) * edge.slope;
            from[i] = if crossed & (x < from[i]) { x } else { from[i] };
            to[i] = if crossed & (x > to[i]) { x } else { to[i] };
        }
    }
    let (mut first, mut end) = ([0; ROWS], [0; ROWS]);
    for i in 0..ROWS {
        let from = lower(higher(from[i].ceil(), 0.0), last + 1.0);
        let to = higher(lower(to[i].floor(), last), -1.0);
        // SAFETY: both lie between -1 and one more than the last column.
        (first[i], end[i]) = unsafe { (from.to_int_unchecked(), to.to_int_unchecked()) };
    }
    (first, end)
}
