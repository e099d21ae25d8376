//! Stage `markers`: dots on the gel, how contact moves them, and how they look.
//!
//! A contact moves the surface of the gel in its plane: a pressed gel gives way sideways, a pulled one follows. Each
//! cell of the contact patch moves every marker by the displacement of an elastic layer on a rigid base under a
//! normal and a tangential force (see `docs/decisions/0007-markers-by-layer-greens-functions.md`). Where the modulus of the gel is not
//! known they go with its surface: [`marker_displacements_by_surface`].

mod find;
mod green;

pub use find::{Dot, find_dots, follow_dots};
pub use green::MarkerGel;

use crate::grid::{Grid, Plane};
use crate::npz::{Array, ElementType, Npz};
use crate::sensor::{SensorError, check_range};
use gripgen_twin::ContactPatch;

/// Dots on the gel.
#[derive(Debug, Clone, PartialEq)]
pub struct Markers {
    /// Centres at rest, column and row; pixel centres are whole numbers.
    pub rest_px: Vec<[f64; 2]>,
    /// Radius of a dot.
    pub radius_px: f64,
    /// Share of red, green and blue light that a dot takes away.
    pub darkness_rgb: [f32; 3],
}

/// Shear of one jaw on its gel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shear {
    /// Force of the part on the gel, along image x and y.
    pub force_n: [f64; 2],
    /// Moment about the centre of pressure, positive from x to y.
    pub moment_n_m: f64,
}

/// Furthest that a marker may lie outside of the image.
const FURTHEST_PX: f64 = 8192.0;

impl Markers {
    /// `columns` x `rows` dots in the middle of the image.
    pub fn regular(
        grid: &Grid,
        columns: usize,
        rows: usize,
        pitch_px: f64,
        radius_px: f64,
        darkness_rgb: [f32; 3],
    ) -> Self {
        let at = |i: usize, count: usize, pixels: usize| {
            (pixels as f64 - 1.0) / 2.0 + (i as f64 - (count as f64 - 1.0) / 2.0) * pitch_px
        };
        let place =
            |i: usize| [at(i % columns, columns, grid.width_px), at(i / columns, rows, grid.height_px)];
        Self { rest_px: (0..columns * rows).map(place).collect(), radius_px, darkness_rgb }
    }

    /// The markers of a sensor file, if it has any: `marker_px` (N, 2), `marker_radius_px`, `marker_darkness_rgb` (3).
    pub(crate) fn read(npz: &mut Npz<'_>) -> Result<Option<Self>, SensorError> {
        let Some(centres) = npz.optional("marker_px", &[None, Some(2)])? else { return Ok(None) };
        let centres = centres.values;
        if centres.iter().any(|v| !v.is_finite()) {
            return Err(SensorError::NotFinite { key: "marker_px" });
        }
        let near = -FURTHEST_PX..=FURTHEST_PX;
        check_range("marker_px", centres.iter().copied(), near, "within 8192 pixels of the image")?;
        let radius_px = npz.array_of_shape("marker_radius_px", &[])?.values[0];
        check_range("marker_radius_px", [radius_px], 0.5..=64.0, "from 0.5 to 64 pixels")?;
        let dark = npz.array_of_shape("marker_darkness_rgb", &[Some(3)])?.values;
        check_range("marker_darkness_rgb", dark.iter().copied(), 0.0..=1.0, "from 0 to 1")?;
        let rest_px = centres.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        Ok(Some(Self { rest_px, radius_px, darkness_rgb: [dark[0] as f32, dark[1] as f32, dark[2] as f32] }))
    }

    /// What [`Markers::read`] reads.
    pub(crate) fn arrays(&self) -> [(&'static str, Array, ElementType); 3] {
        let array = |shape: &[usize], values| Array { shape: shape.to_vec(), values };
        let centres = self.rest_px.iter().flatten().copied().collect();
        let dark = self.darkness_rgb.iter().map(|&d| f64::from(d)).collect();
        [
            ("marker_px", array(&[self.rest_px.len(), 2], centres), ElementType::F64),
            ("marker_radius_px", array(&[], vec![self.radius_px]), ElementType::F64),
            ("marker_darkness_rgb", array(&[3], dark), ElementType::F64),
        ]
    }

    /// How much of the pixel `(x, y)` a dot at `centre` covers; one pixel of soft edge.
    fn cover(&self, centre: [f64; 2], x: usize, y: usize) -> f32 {
        let (dx, dy) = (x as f64 - centre[0], y as f64 - centre[1]);
        (self.radius_px + 0.5 - (dx * dx + dy * dy).sqrt()).clamp(0.0, 1.0) as f32
    }
}

/// Columns and rows, from and to, within `reach` of any of the centres.
pub(crate) fn window(reach: f64, centres: &[[f64; 2]], width: usize, height: usize) -> [usize; 4] {
    let range = |axis: usize, end: usize| {
        let low = centres.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min) - reach;
        let high = centres.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max) + reach;
        let to = if high < 0.0 { 0 } else { (high.floor() as usize + 1).min(end) };
        ((low.ceil().max(0.0) as usize).min(to), to)
    };
    let ((left, right), (top, bottom)) = (range(0, width), range(1, height));
    [left, right, top, bottom]
}

/// Displacement of each marker in pixels, under the cells of `patch` and a shear that is shared by normal force.
///
/// The twist moment is shared as forces that grow with the distance from the centre of pressure, by normal force
/// too. Without contact nothing moves, to the bit. Small strains: the markers do not stick to the part, and a marker
/// is moved from where it is at rest.
pub fn marker_displacements(
    gel: &MarkerGel,
    patch: &ContactPatch,
    shear: &Shear,
    grid: &Grid,
    rest_px: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let normal_n = patch.normal_force_n();
    let (cx, cy) = patch.centre_m();
    let inertia: f64 = patch
        .cells
        .iter()
        .map(|c| c.force_n * ((c.x_m - cx) * (c.x_m - cx) + (c.y_m - cy) * (c.y_m - cy)))
        .sum();
    let turn = if inertia > 0.0 { shear.moment_n_m / inertia } else { 0.0 };
    if normal_n <= 0.0 {
        return vec![[0.0; 2]; rest_px.len()];
    }
    let tangential_n: Vec<[f64; 2]> = patch
        .cells
        .iter()
        .map(|cell| {
            let share = cell.force_n / normal_n;
            [
                share * shear.force_n[0] - turn * cell.force_n * (cell.y_m - cy),
                share * shear.force_n[1] + turn * cell.force_n * (cell.x_m - cx),
            ]
        })
        .collect();
    marker_displacements_by_cell(gel, patch, &tangential_n, grid, rest_px)
}

/// The same where the force of the part on the gel along image x and y is known of each cell.
pub fn marker_displacements_by_cell(
    gel: &MarkerGel,
    patch: &ContactPatch,
    tangential_n: &[[f64; 2]],
    grid: &Grid,
    rest_px: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let mut moved = vec![[0.0; 2]; rest_px.len()];
    for (cell, &tangential) in patch.cells.iter().zip(tangential_n) {
        let load = gel.load(cell.force_n, tangential, cell.area_m2);
        for (rest, moved) in rest_px.iter().zip(&mut moved) {
            let x = (rest[0] + 0.5 - grid.width_px as f64 / 2.0) * grid.metres_per_px - cell.x_m;
            let y = (rest[1] + 0.5 - grid.height_px as f64 / 2.0) * grid.metres_per_px - cell.y_m;
            let [ux, uy] = gel.displacement_m(&load, x, y);
            moved[0] += ux / grid.metres_per_px;
            moved[1] += uy / grid.metres_per_px;
        }
    }
    moved
}

/// How far the dots lie from the part of the skin that only bends: 2.5 px of 0.063 mm, fitted to a GelSight Mini with dots, 26 presses of a
/// ball (yepengfei81-cpu/gelsight_gripper_controller, 2026).
const DOT_LEVER_M: f64 = 0.16e-3;

/// Displacement of each marker in pixels where the surface of the gel is known and not its modulus: `u = s h - L grad h`.
///
/// h is the height of the surface towards the camera, in pixels. Where the skin is tilted, what lies at the distance L from it moves aside;
/// `shear` is s, the sideways displacement of the surface for each pixel of height. Of the displacements of real dots under a ball the tilt
/// explains a tenth, and both two thirds (`shear` fitted to each press).
pub fn marker_displacements_by_surface(
    surface_px: &Plane,
    metres_per_px: f64,
    shear: [f64; 2],
    rest_px: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let lever_px = DOT_LEVER_M / metres_per_px;
    let moved = |(height, slope): (f64, [f64; 2])| [0, 1].map(|a| shear[a] * height - lever_px * slope[a]);
    rest_px.iter().map(|&at| moved(height_and_slope(surface_px, at))).collect()
}

/// Height and slope of a surface at the pixel that is nearest to a point; 0 outside of it.
pub(crate) fn height_and_slope(surface_px: &Plane, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
    let (x, y) = (x.round(), y.round());
    let inside = |v: f64, n: usize| v >= 1.0 && v + 1.0 < n as f64;
    if !inside(x, surface_px.width) || !inside(y, surface_px.height) {
        return (0.0, [0.0; 2]);
    }
    let (x, y) = (x as usize, y as usize);
    let at = |x: usize, y: usize| f64::from(surface_px.at(x, y));
    (at(x, y), [(at(x + 1, y) - at(x - 1, y)) / 2.0, (at(x, y + 1) - at(x, y - 1)) / 2.0])
}

/// The rest frame without its markers: each is filled with the mean of a ring around it.
pub fn without_markers(rest: &[Vec<f32>; 3], grid: &Grid, markers: &Markers) -> [Vec<f32>; 3] {
    let mut clean = rest.clone();
    for &centre in &markers.rest_px {
        let reach = markers.radius_px + 4.0;
        let [left, right, top, bottom] = window(reach, &[centre], grid.width_px, grid.height_px);
        let (inner, outer) = ((markers.radius_px + 1.5) * (markers.radius_px + 1.5), reach * reach);
        // Squared distance and index of the pixels around the dot.
        let around = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))).map(|(x, y)| {
            let (dx, dy) = (x as f64 - centre[0], y as f64 - centre[1]);
            (dx * dx + dy * dy, y * grid.width_px + x)
        });
        let (mut sum, mut count) = ([0.0_f32; 3], 0.0);
        for (_, i) in around.clone().filter(|(r2, _)| (inner..outer).contains(r2)) {
            sum = [0, 1, 2].map(|c| sum[c] + rest[c][i]);
            count += 1.0;
        }
        if count > 0.0 {
            for (_, i) in around.filter(|(r2, _)| *r2 < inner) {
                for channel in 0..3 {
                    clean[channel][i] = sum[channel] / count;
                }
            }
        }
    }
    clean
}

/// Moves the markers of a rest frame: takes each dot away where it is at rest and draws it where it moved to.
///
/// `change` is the change of colour against the rest frame, which shows the dots at rest; `clean` is the rest frame
/// [`without_markers`]. With D the share of light that a dot takes, and cover from 0 to 1 with one pixel of soft edge:
///
/// ```text
/// change' = change (1 - D cover_moved) - clean D (cover_moved - cover_rest)
/// ```
///
/// Markers that did not move add exactly 0.
pub fn draw_markers(
    markers: &Markers,
    moved_px: &[[f64; 2]],
    clean: &[Vec<f32>; 3],
    change: &mut [Plane; 3],
) {
    for (&rest, moved) in markers.rest_px.iter().zip(moved_px) {
        let now = [rest[0] + moved[0], rest[1] + moved[1]];
        let (width, height) = (change[0].width, change[0].height);
        let [left, right, top, bottom] = window(markers.radius_px + 0.5, &[rest, now], width, height);
        for y in top..bottom {
            for x in left..right {
                let (before, after) = (markers.cover(rest, x, y), markers.cover(now, x, y));
                if before == 0.0 && after == 0.0 {
                    continue;
                }
                let i = y * width + x;
                for channel in 0..3 {
                    let dark = markers.darkness_rgb[channel];
                    let value = &mut change[channel].values[i];
                    *value = *value * (1.0 - dark * after) - clean[channel][i] * dark * (after - before);
                }
            }
        }
    }
}

/// Puts markers at rest into a rest frame that has none.
pub fn print_markers(rest: &mut [Vec<f32>; 3], grid: &Grid, markers: &Markers) {
    for &centre in &markers.rest_px {
        let [left, right, top, bottom] =
            window(markers.radius_px + 0.5, &[centre], grid.width_px, grid.height_px);
        for y in top..bottom {
            for x in left..right {
                for channel in 0..3 {
                    let dark = markers.darkness_rgb[channel] * markers.cover(centre, x, y);
                    rest[channel][y * grid.width_px + x] *= 1.0 - dark;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
