//! A sensor with fewer, larger pixels.

use crate::grid::Grid;
use crate::sensor::{GelShape, Pyramid, Sensor};
use crate::shadow::Shadow;

/// The sensor with squares of `factor` x `factor` pixels as one; `None` where that cannot be: its markers are drawn in
/// pixels.
pub(super) fn reduced_sensor(sensor: &Sensor, factor: usize) -> Option<Sensor> {
    if factor == 1 || sensor.markers.is_some() {
        return None;
    }
    let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
    let grid = Grid {
        width_px: w / factor,
        height_px: h / factor,
        metres_per_px: sensor.grid.metres_per_px * factor as f64,
    };
    let means = |plane: &[f32]| means(plane, w, h, factor);
    let colour = sensor.colour.of_wider_pixels(factor, means);
    let gel_shape = match &sensor.gel_shape {
        GelShape::Map(heights) => {
            GelShape::Map(means(heights).into_iter().map(|v| v / factor as f32).collect())
        }
        other => other.clone(),
    };
    let pyramid = sensor.pyramid.as_ref().map(|pyramid| Pyramid {
        kernels_px: pyramid.kernels_px.iter().map(|&k| reduced_kernel(k, factor)).collect(),
        restore_depth_fraction: pyramid.restore_depth_fraction,
        sink_in_fraction: pyramid.sink_in_fraction,
        follow: pyramid.follow,
    });
    let shadow = sensor.shadow.as_ref().map(|shadow| {
        Box::new(Shadow::new(shadow.table().clone(), grid.metres_per_px, grid.width_px, &colour))
    });
    let rest = [0, 1, 2].map(|c| means(&sensor.rest[c]));
    let plain = Sensor::new(grid, rest, sensor.noise_rgb.map(|s| s / factor as f32), colour);
    let (ball_m, press_gain_sd) = (sensor.ball_m, sensor.press_gain_sd);
    Some(Sensor { gel_shape, shadow, pyramid, ball_m, press_gain_sd, ..plain })
}

/// The odd size next to a `factor`-th of a kernel.
fn reduced_kernel(size_px: u32, factor: usize) -> u32 {
    let half = f64::from(size_px) / factor as f64 / 2.0;
    2 * (half - 0.5).round().max(1.0) as u32 + 1
}

/// Means over squares of `factor` x `factor` pixels.
pub(in crate::presses) fn means(plane: &[f32], width: usize, height: usize, factor: usize) -> Vec<f32> {
    let (w, h) = (width / factor, height / factor);
    let share = 1.0 / (factor * factor) as f32;
    let mut out = vec![0.0; w * h];
    for (y, row) in plane.chunks_exact(width).take(h * factor).enumerate() {
        for (x, value) in row.iter().take(w * factor).enumerate() {
            out[y / factor * w + x / factor] += share * value;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_become_their_means_and_kernels_stay_odd() {
        let plane: Vec<f32> = (0..24).map(|i| i as f32).collect();
        assert_eq!(means(&plane, 6, 4, 2), [3.5, 5.5, 7.5, 15.5, 17.5, 19.5]);
        for (k, factor, wanted) in [(71, 2, 35), (35, 2, 17), (17, 2, 9), (5, 2, 3), (3, 4, 3)] {
            assert_eq!(reduced_kernel(k, factor), wanted, "{k} / {factor}");
        }
    }
}
