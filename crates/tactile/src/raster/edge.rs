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

/// A triangle over more rows than this has its columns found for many rows at once.
pub(super) const TALL: usize = 4;

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
    whole(&from, &to, (0.0, last))
}

/// First and last column of the pixels that a triangle may reach with points, of those given, in the rows from `y` on; the
/// first is larger where there is none.
#[inline(always)]
pub(super) fn bands(edges: &[Edge; 3], y: f64, columns: (usize, usize)) -> ([i32; ROWS], [i32; ROWS]) {
    let (mut from, mut to) = ([f64::INFINITY; ROWS], [f64::NEG_INFINITY; ROWS]);
    for edge in edges {
        for i in 0..ROWS {
            let y = y + f64::from(i as u32);
            // Where the edge enters and leaves the row of pixels.
            let (upper, under) = (higher(y - 0.5, edge.rows.0), lower(y + 0.5, edge.rows.1));
            let a = edge.x_px + (upper - edge.y_px) * edge.slope;
            let b = edge.x_px + (under - edge.y_px) * edge.slope;
            let (left, right) = (lower(a, b), higher(a, b));
            let meets = upper <= under;
            from[i] = if meets & (left < from[i]) { left } else { from[i] };
            to[i] = if meets & (right > to[i]) { right } else { to[i] };
        }
    }
    for i in 0..ROWS {
        // Points lie a third of a pixel from its centre.
        (from[i], to[i]) = (from[i] - 0.4, to[i] + 0.4);
    }
    whole(&from, &to, (columns.0 as f64, columns.1 as f64))
}

/// The columns between two places in each row, of those from the first to the last; the first is larger where there is none.
#[inline(always)]
fn whole(from: &[f64; ROWS], to: &[f64; ROWS], (first, last): (f64, f64)) -> ([i32; ROWS], [i32; ROWS]) {
    let (mut begin, mut end) = ([0; ROWS], [0; ROWS]);
    for i in 0..ROWS {
        let from = lower(higher(from[i].ceil(), first), last + 1.0);
        let to = higher(lower(to[i].floor(), last), first - 1.0);
        // SAFETY: both lie between one less than the first and one more than the last column.
        (begin[i], end[i]) = unsafe { (from.to_int_unchecked(), to.to_int_unchecked()) };
    }
    (begin, end)
}
