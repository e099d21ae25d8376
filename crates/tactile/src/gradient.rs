//! Stage `gradient`: the slope of the gel surface.

use crate::grid::Plane;

/// Slopes along x and y, pixels of height per pixel: central differences, the border copies its neighbour (Taxim).
pub fn gradient(surface: &Plane) -> (Plane, Plane) {
    let (w, h) = (surface.width, surface.height);
    let mut along_x = Plane::filled(w, h, 0.0);
    let mut along_y = Plane::filled(w, h, 0.0);
    if w < 3 || h < 3 {
        return (along_x, along_y);
    }
    for y in 0..h {
        let inner = y.clamp(1, h - 2);
        let (here, above, below) = (surface.row(inner), surface.row(inner - 1), surface.row(inner + 1));
        let out_x = &mut along_x.values[y * w..(y + 1) * w];
        for x in 1..w - 1 {
            out_x[x] = (here[x + 1] - here[x - 1]) * 0.5;
        }
        out_x[0] = out_x[1];
        out_x[w - 1] = out_x[w - 2];
        let out_y = &mut along_y.values[y * w..(y + 1) * w];
        for x in 0..w {
            out_y[x] = (below[x] - above[x]) * 0.5;
        }
        out_y[0] = out_y[1];
        out_y[w - 1] = out_y[w - 2];
    }
    (along_x, along_y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_its_slope_everywhere() {
        let plane = Plane::from_fn(7, 5, |x, y| 0.25 * x as f32 - 0.5 * y as f32 + 3.0);
        let (gx, gy) = gradient(&plane);
        assert!(gx.values.iter().all(|&g| g == 0.25) && gy.values.iter().all(|&g| g == -0.5));
    }
}
