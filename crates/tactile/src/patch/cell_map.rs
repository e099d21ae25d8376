//! Which cell of the patch a pixel of the contact belongs to, also after the contact has moved.

use super::{CELLS_PER_SIDE, CellPlaces};
use crate::convolve::Area;
use crate::grid::{Grid, Plane};

/// The cells of a contact as places in its bounding box.
#[derive(Debug, Clone)]
pub struct CellMap {
    /// The grid on which they were cut.
    grid: Grid,
    area: Area,
    /// Number of the cell, from 1, at each place; a place without one has that of the nearest.
    cell_at: [u8; CELLS_PER_SIDE * CELLS_PER_SIDE],
}

impl CellMap {
    /// The cells of the patch that has these places.
    pub fn new(places: &CellPlaces) -> Self {
        let CellPlaces { grid, area, .. } = *places;
        let mut cell_at = [0; CELLS_PER_SIDE * CELLS_PER_SIDE];
        if area.is_empty() {
            return Self { grid, area, cell_at };
        }
        let mut count = 0;
        for (place, cell) in cell_at.iter_mut().enumerate() {
            if places.held >> place & 1 == 1 {
                count += 1;
                *cell = count;
            }
        }
        let found = cell_at;
        let apart = |a: usize, b: usize| {
            let along = |f: fn(usize) -> usize| f(a).abs_diff(f(b));
            let (x, y) = (along(|p| p % CELLS_PER_SIDE), along(|p| p / CELLS_PER_SIDE));
            x * x + y * y
        };
        for place in 0..cell_at.len() {
            let nearest = (0..found.len()).filter(|&p| found[p] > 0).min_by_key(|&p| apart(place, p));
            cell_at[place] = nearest.map_or(0, |p| found[p]);
        }
        Self { grid, area, cell_at }
    }

    /// The number of the cell, from 1, of each pixel of a contact that has moved by `moved_m` along image x and y, with its depths on
    /// any grid; 0 outside the contact.
    pub fn of_contact(&self, depth_px: &Plane, grid: &Grid, moved_m: [f64; 2]) -> Vec<u8> {
        let mut cells = vec![0; depth_px.values.len()];
        if self.area.is_empty() {
            return cells;
        }
        // The cell of column or row i of n is 8 i / n.
        let place = |at_m: f64, size: usize, (first, end): (usize, usize)| {
            let at_px = at_m / self.grid.metres_per_px + size as f64 / 2.0 - 0.5;
            let from = (at_px - first as f64).round().max(0.0) as usize;
            (CELLS_PER_SIDE * from / (end - first)).min(CELLS_PER_SIDE - 1)
        };
        let column_of = |x| place(grid.centre_m(x, 0).0 - moved_m[0], self.grid.width_px, self.area.x);
        let columns: Vec<usize> = (0..depth_px.width).map(column_of).collect();
        for (y, cells) in cells.chunks_exact_mut(depth_px.width).enumerate() {
            let at_m = grid.centre_m(0, y).1 - moved_m[1];
            let row = CELLS_PER_SIDE * place(at_m, self.grid.height_px, self.area.y);
            for ((cell, &depth), &column) in cells.iter_mut().zip(depth_px.row(y)).zip(&columns) {
                if depth > 0.0 {
                    *cell = self.cell_at[row + column];
                }
            }
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indent::{PressedGel, indent};

    /// Pixels of a cell are as many as its area says, at rest; a contact that moves takes them along.
    #[test]
    fn pixels_belong_to_the_cells_of_the_patch() {
        let grid = Grid { width_px: 96, height_px: 80, metres_per_px: 1e-4 };
        // A ring: its middle holds no cell.
        let heights = Plane::from_fn(96, 80, |x, y| {
            let (u, v) = (x as f32 - 40.0, y as f32 - 37.0);
            -((u * u + v * v).sqrt() - 20.0).abs()
        });
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
        let imprint = indent(&heights, &grid, &gel, 10.0).unwrap();
        let map = CellMap::new(&imprint.places);
        let cells = map.of_contact(&imprint.depth_px, &grid, [0.0, 0.0]);
        for (k, cell) in imprint.patch.cells.iter().enumerate() {
            let pixels = cells.iter().filter(|&&c| usize::from(c) == k + 1).count();
            assert!((pixels as f64 * 1e-8 - cell.area_m2).abs() < 1e-12, "cell {k}: {pixels} pixels");
        }
        let mut moved = Plane::filled(96, 80, 0.0);
        for y in 0..70 {
            moved.values[96 * (y + 10)..96 * (y + 11)]
                .copy_from_slice(&imprint.depth_px.values[96 * y..96 * (y + 1)]);
        }
        assert_eq!(map.of_contact(&moved, &grid, [0.0, 10.0 * 1e-4])[96 * 10..], cells[..96 * 70]);
    }
}
