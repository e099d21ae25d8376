//! Bodies made of boxes on a grid of planes: the surface between full and empty boxes.

use super::Builder;

/// Planes across x, y and z, in millimetres, and which boxes between them are full.
pub(super) struct Grid<'a> {
    /// Planes in rising order.
    pub(super) planes: [Vec<f64>; 3],
    /// Whether the box after plane i, j, k is full. Full boxes share faces, or nothing.
    pub(super) full: &'a dyn Fn([usize; 3]) -> bool,
}

impl Grid<'_> {
    /// Adds the body to a mesh.
    pub(super) fn add(&self, b: &mut Builder) {
        let boxes: [usize; 3] = [0, 1, 2].map(|axis| self.planes[axis].len() - 1);
        let corners = boxes.map(|n| n + 1);
        let mut numbers = vec![u32::MAX; corners.iter().product()];
        let mut corner = |b: &mut Builder, at: [usize; 3]| {
            let slot = &mut numbers[(at[0] * corners[1] + at[1]) * corners[2] + at[2]];
            if *slot == u32::MAX {
                let [x, y, z] = [0, 1, 2].map(|axis| self.planes[axis][at[axis]] * 1e-3);
                *slot = b.vertex(x, y, z);
            }
            *slot
        };
        let all = (0..boxes[0])
            .flat_map(|i| (0..boxes[1]).flat_map(move |j| (0..boxes[2]).map(move |k| [i, j, k])));
        for at in all.filter(|&at| (self.full)(at)) {
            for axis in 0..3 {
                for side in [0, 1] {
                    let edge = if side == 0 { at[axis] == 0 } else { at[axis] + 1 == boxes[axis] };
                    let mut beside = at;
                    if !edge {
                        beside[axis] = at[axis] + 2 * side;
                        beside[axis] -= 1;
                    }
                    if !edge && (self.full)(beside) {
                        continue;
                    }
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                        let mut at = at;
                        at[axis] += side;
                        at[u] += du;
                        at[v] += dv;
                        corner(b, at)
                    });
                    match side {
                        0 => b.quad(quad[3], quad[2], quad[1], quad[0]),
                        _ => b.quad(quad[0], quad[1], quad[2], quad[3]),
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_of_boxes_is_closed_and_has_its_volume() {
        let planes = || vec![0.0, 2.0, 10.0, 12.0];
        // Posts and bars along the edges of a cube: at least two of three in the outer layers.
        let full = |at: [usize; 3]| at.iter().filter(|&&i| i != 1).count() >= 2;
        let mut b = Builder::default();
        Grid { planes: [planes(), planes(), planes()], full: &full }.add(&mut b);
        let look = b.finish().look();
        assert!(
            look.is_closed() && look.turned_edges + look.crowded_edges == 0 && look.bodies == 1,
            "{look:?}"
        );
        assert!((look.volume_m3 * 1e9 - (8.0 * 8.0 + 12.0 * 32.0)).abs() < 1e-6);
    }
}
