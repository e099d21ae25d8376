//! A triangle at the centres of pixels.

use super::edge::{Corner, Edge, ROWS, TALL, higher, lower, spans};

/// Pixels of a row that are written at once.
const COLUMNS: usize = 8;

/// Writes one triangle into a map where it is nearer than what is there.
#[inline(always)]
pub(super) fn fill(map: &mut [f32], width: usize, t: [Corner; 3], rows: (usize, usize)) {
    // Plane through the corners, relative to the first one so that small triangles far away stay exact.
    let (ux, uy, uh) = (t[1].x_px - t[0].x_px, t[1].y_px - t[0].y_px, t[1].height_px - t[0].height_px);
    let (vx, vy, vh) = (t[2].x_px - t[0].x_px, t[2].y_px - t[0].y_px, t[2].height_px - t[0].height_px);
    let area = ux * vy - uy * vx;
    if area == 0.0 {
        return;
    }
    let surface = Surface {
        slope: ((uh * vy - vh * uy) / area, (vh * ux - uh * vx) / area),
        top: higher(higher(t[0].height_px, t[1].height_px), t[2].height_px),
        bottom: lower(lower(t[0].height_px, t[1].height_px), t[2].height_px),
        corner: t[0],
    };
    let edges = [Edge::new(&t[0], &t[1]), Edge::new(&t[1], &t[2]), Edge::new(&t[2], &t[0])];
    let last_column = (width - 1) as f64;
    if rows.1 - rows.0 >= TALL {
        for start in (rows.0..=rows.1).step_by(ROWS) {
            let (from, to) = spans(&edges, f64::from(start as i32), last_column);
            for i in 0..ROWS.min(rows.1 + 1 - start) {
                if from[i] <= to[i] {
                    surface.draw(&mut map[(start + i) * width..][..width], start + i, from[i], to[i]);
                }
            }
        }
        return;
    }
    for row in rows.0..=rows.1 {
        let y = f64::from(row as i32);
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for edge in &edges {
            if let Some(x) = edge.crossing(y) {
                from = lower(x, from);
                to = higher(x, to);
            }
        }
        let from = higher(from.ceil(), 0.0);
        let to = lower(to.floor(), last_column);
        if from <= to {
            // SAFETY: both lie between 0 and the last column.
            let (from, to) = unsafe { (from.to_int_unchecked::<i32>(), to.to_int_unchecked::<i32>()) };
            surface.draw(&mut map[row * width..][..width], row, from, to);
        }
    }
}

/// The plane of a triangle.
struct Surface {
    corner: Corner,
    /// Per column and per row.
    slope: (f64, f64),
    top: f64,
    bottom: f64,
}

impl Surface {
    /// One row, from one column up to another. A closure would not be compiled for the vector unit.
    #[inline(always)]
    fn draw(&self, cells: &mut [f32], row: usize, from: i32, to: i32) {
        let along_row = self.corner.height_px + self.slope.1 * (f64::from(row as i32) - self.corner.y_px);
        if cells.len() < COLUMNS {
            for column in from..=to {
                let cell = &mut cells[column as usize];
                *cell = self.raised(along_row, column, *cell);
            }
            return;
        }
        let mut start = from;
        while start <= to {
            // Whole groups, for most triangles are narrow; the last one of a row lies further to the left.
            let first = start.min((cells.len() - COLUMNS) as i32);
            let group = &mut cells[first as usize..first as usize + COLUMNS];
            for i in 0..COLUMNS {
                let column = first + i as i32;
                let height = self.raised(along_row, column, group[i]);
                group[i] = if (column >= from) & (column <= to) { height } else { group[i] };
            }
            start += COLUMNS as i32;
        }
    }

    #[inline(always)]
    fn raised(&self, along_row: f64, column: i32, old: f32) -> f32 {
        let height = along_row + self.slope.0 * (f64::from(column) - self.corner.x_px);
        let height = lower(self.top, higher(self.bottom, height)) as f32;
        if height > old { height } else { old }
    }
}
