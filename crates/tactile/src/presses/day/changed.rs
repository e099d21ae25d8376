//! The sensor file of another day.

use super::light::place;
use super::polynomial::Mapped;
use super::{Change, Light};
use crate::colour::regressor::{AROUND_FIELD, NEAR, NEAR_FIELD, SURROUNDINGS};
use crate::colour::{ColourModel, Lambert, Regressor};
use crate::grid::Grid;
use crate::presses::calibrate::MAX_KERNEL_PX;
use crate::sensor::{GelShape, MAX_SINK_IN, Pyramid, Sensor};
use crate::shadow::Shadow;

/// Terms of the fields of lights.
const LAMBERT_FIELD: usize = 6;

/// The sensor as a change leaves it; of a ball and of marks the same.
pub(super) fn changed(sensor: &Sensor, change: &Change) -> Sensor {
    match change {
        Change::Nothing | Change::Ball { .. } | Change::Force { .. } => sensor.clone(),
        Change::Light(light) => under(sensor, light),
        Change::Gel { sink_in_fraction, width } => {
            let pyramid = sensor.pyramid.as_ref().map(|old| of_gel(old, *sink_in_fraction, *width));
            Sensor { pyramid, ..sensor.clone() }
        }
        Change::Scale { zoom, shift } => zoomed(sensor, *zoom, *shift),
    }
}

fn of_gel(old: &Pyramid, sink_in_fraction: f64, width: f64) -> Pyramid {
    let restored = old.restore_depth_fraction + sink_in_fraction - old.sink_in_fraction;
    Pyramid {
        kernels_px: old.kernels_px.iter().map(|&k| odd(f64::from(k) * width)).collect(),
        restore_depth_fraction: restored.clamp(0.0, 1.0),
        sink_in_fraction: sink_in_fraction.clamp(0.0, MAX_SINK_IN),
        follow: old.follow,
    }
}

/// The odd size of a kernel next to a length.
fn odd(px: f64) -> u32 {
    2 * ((px.clamp(3.0, f64::from(MAX_KERNEL_PX)) - 1.0) / 2.0).round() as u32 + 1
}

/// The colours of a model, field by field: `field` makes the three channels' coefficients of a feature new.
fn with_fields(colour: &ColourModel, field: impl Fn([Vec<f64>; 3]) -> [Vec<f64>; 3]) -> ColourModel {
    let over = |all: &[f64], features: usize, terms: usize| {
        let mut out = vec![0.0; all.len()];
        for feature in 0..features {
            let at = |c: usize| (c * features + feature) * terms;
            let new = field([0, 1, 2].map(|c| all[at(c)..at(c) + terms].to_vec()));
            for (c, new) in new.iter().enumerate() {
                out[at(c)..at(c) + terms].copy_from_slice(new);
            }
        }
        out
    };
    let wide = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect::<Vec<f64>>();
    let narrow = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect::<Vec<f32>>();
    match colour {
        ColourModel::Lambert(lambert) => {
            let fields = over(&lambert.coefficients(), 3, LAMBERT_FIELD);
            ColourModel::Lambert(Box::new(Lambert::new(&fields)))
        }
        ColourModel::Regressor(model) => ColourModel::Regressor(Box::new(Regressor {
            near: narrow(over(&wide(&model.near), NEAR, NEAR_FIELD)),
            around: narrow(over(&wide(&model.around), SURROUNDINGS, AROUND_FIELD)),
            ..(**model).clone()
        })),
        // Its places are pixels of another image, and no sensor file holds it.
        ColourModel::Taxim(_) => colour.clone(),
    }
}

fn under(sensor: &Sensor, light: &Light) -> Sensor {
    let grid = sensor.grid;
    let rest = [0, 1, 2].map(|c| &sensor.rest[c][..]);
    let mut rest = light.on(rest, grid.width_px);
    rest.iter_mut().flatten().for_each(|level| *level = level.clamp(0.0, 255.0));
    let height = grid.height_px as f64 / grid.width_px as f64;
    let colour = with_fields(&sensor.colour, |old| {
        [0, 1, 2].map(|c| {
            let n = old[c].len();
            let gained = Mapped::times(n, &light.field[c], height).map(|map| map.of(&old[c]));
            let gained = gained.unwrap_or_else(|| vec![0.0; n]);
            (0..n).map(|i| gained[i] + (0..3).map(|d| light.mixture[c][d] * old[d][i]).sum::<f64>()).collect()
        })
    });
    let shadow = sensor.shadow.as_ref().map(|old| {
        let mut table = old.table().clone();
        for rays in &mut table.rays {
            for (c, ray) in rays.iter_mut().enumerate() {
                ray.iter_mut().for_each(|level| *level *= light.mixture[c][c] as f32);
            }
        }
        Box::new(Shadow::new(table, grid.metres_per_px, grid.width_px, &colour))
    });
    Sensor { rest, colour, shadow, ..sensor.clone() }
}

/// Which pixels of a zoomed frame the old one shows.
pub(super) fn seen_before(grid: &Grid, zoom: f64, shift: [f64; 2]) -> Vec<bool> {
    let old = old_place(grid, zoom, shift);
    let inside = |v: f64, n: usize| (0.0..=(n - 1) as f64).contains(&v);
    (0..grid.len())
        .map(|p| {
            let [x, y] = old(p);
            inside(x, grid.width_px) && inside(y, grid.height_px)
        })
        .collect()
}

/// Where the old camera saw what a pixel shows: column and row.
fn old_place(grid: &Grid, zoom: f64, shift: [f64; 2]) -> impl Fn(usize) -> [f64; 2] {
    let (w, h) = (grid.width_px, grid.height_px);
    let place = place(w, h);
    let px = move |along: f64, n: usize| along * w as f64 / 2.0 + (n as f64 - 1.0) / 2.0;
    move |p: usize| {
        let [u, v] = place(p);
        [px(u / zoom + shift[0], w), px(v / zoom + shift[1], h)]
    }
}

/// A plane of the old frame as a zoomed camera sees it, by lines between its pixels; beyond its border as at the border.
pub(super) fn zoomed_plane(plane: &[f32], grid: &Grid, zoom: f64, shift: [f64; 2]) -> Vec<f32> {
    let (w, h) = (grid.width_px, grid.height_px);
    let old = old_place(grid, zoom, shift);
    let level = |p: usize| {
        let [x, y] = old(p);
        let (x, y) = (x.clamp(0.0, (w - 1) as f64), y.clamp(0.0, (h - 1) as f64));
        let (x0, y0) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let at = |x: usize, y: usize| plane[y.min(h - 1) * w + x.min(w - 1)];
        let row = |y: usize| at(x0, y) + fx * (at(x0 + 1, y) - at(x0, y));
        row(y0) + fy * (row(y0 + 1) - row(y0))
    };
    (0..grid.len()).map(level).collect()
}

fn zoomed(sensor: &Sensor, zoom: f64, shift: [f64; 2]) -> Sensor {
    let grid = Grid { metres_per_px: sensor.grid.metres_per_px / zoom, ..sensor.grid };
    let plane = |plane: &[f32]| zoomed_plane(plane, &sensor.grid, zoom, shift);
    let rest = [0, 1, 2].map(|c| plane(&sensor.rest[c]));
    let mut colour = with_fields(&sensor.colour, |old| {
        old.map(|field| Mapped::zoomed(field.len(), zoom, shift).of(&field))
    });
    if let ColourModel::Regressor(model) = &mut colour {
        model.mm_per_px /= zoom;
    }
    let gel_shape = match &sensor.gel_shape {
        GelShape::Flat => GelShape::Flat,
        // The corners of the frame lie nearer to the apex.
        GelShape::Dome { sag_m } => GelShape::Dome { sag_m: sag_m / (zoom * zoom) },
        GelShape::Map(heights) => {
            GelShape::Map(plane(heights).into_iter().map(|h| h * zoom as f32).collect())
        }
    };
    let markers = sensor.markers.as_ref().map(|old| {
        let mut markers = old.clone();
        let middle = |n: usize| (n as f64 - 1.0) / 2.0;
        let half = sensor.grid.width_px as f64 / 2.0;
        let (mx, my) = (middle(sensor.grid.width_px), middle(sensor.grid.height_px));
        let new = |at: f64, middle: f64, shift: f64| middle + zoom * (at - middle - shift * half);
        for [x, y] in &mut markers.rest_px {
            (*x, *y) = (new(*x, mx, shift[0]), new(*y, my, shift[1]));
        }
        markers.radius_px *= zoom;
        markers
    });
    let pyramid = sensor.pyramid.as_ref().map(|old| Pyramid {
        kernels_px: old.kernels_px.iter().map(|&k| odd(f64::from(k) * zoom)).collect(),
        ..old.clone()
    });
    let shadow = sensor
        .shadow
        .as_ref()
        .map(|old| Box::new(Shadow::new(old.table().clone(), grid.metres_per_px, grid.width_px, &colour)));
    Sensor { grid, rest, colour, gel_shape, markers, pyramid, shadow, ..sensor.clone() }
}
