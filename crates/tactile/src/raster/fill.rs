//! A triangle at the centres of pixels.

use super::edge::{Corner, Edge, ROWS, higher, lower, spans};

/// A triangle over more rows than this has its columns found for many rows at once.
const TALL: usize = 4;

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
    let slope_x = (uh * vy - vh * uy) / area;
    let slope_y = (vh * ux - uh * vx) / area;
    let top = higher(higher(t[0].height_px, t[1].height_px), t[2].height_px);
    let bottom = lower(lower(t[0].height_px, t[1].height_px), t[2].height_px);
    let edges = [Edge::new(&t[0], &t[1]), Edge::new(&t[1], &t[2]), Edge::new(&t[2], &t[0])];
    let last_column = (width - 1) as f64;
    let mut draw = |row: usize, from: i32, to: i32| {
        let along_row = t[0].height_px + slope_y * (f64::from(row as i32) - t[0].y_px);
        let cells = &mut map[row * width..][from as usize..=to as usize];
        for (i, cell) in cells.iter_mut().enumerate() {
            let column = from + i as i32;
            let height = along_row + slope_x * (f64::from(column) - t[0].x_px);
            let height = lower(top, higher(bottom, height)) as f32;
            *cell = if height > *cell { height } else { *cell };
        }
    };
    if rows.1 - rows.0 >= TALL {
        for start in (rows.0..=rows.1).step_by(ROWS) {
            let (from, to) = spans(&edges, f64::from(start as i32), last_column);
            for i in 0..ROWS.min(rows.1 + 1 - start) {
                if from[i] <= to[i] {
                    draw(start + i, from[i], to[i]);
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
            draw(row, from, to);
        }
    }
}
