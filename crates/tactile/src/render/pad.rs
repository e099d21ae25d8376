//! The contact of a part with the pad of a gel, and what a camera sees of it.
//!
//! Contact is solved on a grid of its own over the pad, which is flat at rest. A picture is drawn from the same pose and the same
//! depth on the pixels of the sensor; the shape that a sensor file gives its gel bends the picture alone. So forces do not depend on
//! the sensor that looks at them, and where pad and picture have the same pixels one imprint serves both.

use super::Renderer;
use super::scratch::with_map;
use crate::deform::Edges;
use crate::grid::{Grid, Plane, added};
use crate::indent::press::{Press, reach_px};
use crate::indent::{ElasticField, Imprint, IndentError, Indentation, PressedGel};
use crate::optics::{at_depth, dome, relief, rounded_as_seen};
use crate::raster::ClusteredMesh;
use crate::simd::SimdLevel;
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gel, OpticsState};
use std::borrow::Cow;

/// Relative difference of two pixel sizes that is rounding.
const SAME_SCALE: f64 = 1e-9;

/// The pad of a gel.
#[derive(Debug, Clone, Copy)]
pub struct Pad<'a> {
    /// The gel.
    pub gel: &'a Gel,
    /// The vector unit to use; the result does not depend on it.
    pub level: SimdLevel,
}

impl Pad<'_> {
    /// The grid of its contact: the pad in pixels of `contact_m_per_px`, rounded to whole ones.
    pub fn grid(&self) -> Grid {
        let metres_per_px = self.gel.contact_m_per_px;
        let pixels = |size_m: f64| (size_m / metres_per_px).round().max(1.0) as usize;
        Grid { width_px: pixels(self.gel.width_m), height_px: pixels(self.gel.height_m), metres_per_px }
    }

    /// Presses a part into the pad: stages `raster` and `indent`. An elastic gel needs no imprint constant.
    ///
    /// # Errors
    ///
    /// No surface in front of the pad, or a press deeper than the gel.
    pub fn press(
        &self,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        imprint_m3_per_n: f64,
        force_n: f64,
    ) -> Result<Imprint, IndentError> {
        let press = Press { gel: self.gel, imprint_m3_per_n, force_n, level: self.level };
        with_map(|map| press.mesh(map, mesh, gel_from_mesh, &self.grid(), None))
    }

    /// The imprint that the optics effects of `renderer` make of it: what the camera sees is its place, no force acts by it.
    ///
    /// # Errors
    ///
    /// As [`Pad::press`].
    pub fn press_seen(
        &self,
        renderer: &Renderer<'_>,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        imprint_m3_per_n: f64,
        force_n: f64,
        optics: &OpticsState,
    ) -> Result<Imprint, IndentError> {
        if !optics.changes_press() {
            return self.press(mesh, gel_from_mesh, imprint_m3_per_n, force_n);
        }
        let grid = self.grid();
        let rest = dome(&grid, &renderer.sensor.grid, optics);
        let heights = mesh.raster(gel_from_mesh, &grid, reach_px(self.gel, &grid, rest.as_ref()));
        let heights = added(rounded_as_seen(heights, &grid, optics), rest.as_ref());
        let press = Press { gel: self.gel, imprint_m3_per_n, force_n, level: self.level };
        let imprint = press.heights(&heights, &grid)?;
        Ok(if optics.changes_depth() {
            at_depth(imprint, &heights, &grid, self.gel.thickness_m, optics)
        } else {
            imprint
        })
    }
}

impl Renderer<'_> {
    /// Whether the camera sees the pad pixel by pixel: the same number of pixels of the same size, and a gel that is flat at rest.
    pub fn sees_pad(&self) -> bool {
        let (pad, seen) = (Pad { gel: self.gel, level: self.level }.grid(), &self.sensor.grid);
        (pad.width_px, pad.height_px) == (seen.width_px, seen.height_px)
            && (pad.metres_per_px / seen.metres_per_px - 1.0).abs() < SAME_SCALE
            && self.sensor.gel_shape.is_flat()
    }

    /// What the camera sees of the imprint `contact` that [`Pad::press`] or [`Pad::press_seen`] made of a part in this pose: the part
    /// in the same place, on the sensor's pixels and on the gel's shape in the sensor file.
    pub fn seen<'a>(
        &self,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        contact: &'a Imprint,
        optics: &OpticsState,
    ) -> Cow<'a, Imprint> {
        let mut seen = self.seen_smooth(mesh, gel_from_mesh, contact, optics);
        // An elastic gel was solved for a smooth part, and its surface is known.
        if optics.relief_m > 0.0 && seen.elastic.is_none() {
            relief::add(seen.to_mut(), gel_from_mesh, &self.sensor.grid, optics);
        }
        seen
    }

    /// The same of a part without relief.
    fn seen_smooth<'a>(
        &self,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        contact: &'a Imprint,
        optics: &OpticsState,
    ) -> Cow<'a, Imprint> {
        if self.sees_pad() {
            return Cow::Borrowed(contact);
        }
        let grid = &self.sensor.grid;
        let lift_px = contact.lift_m / grid.metres_per_px;
        if contact.elastic.is_none() && !optics.changes_press() {
            let gel = PressedGel::of(self.gel, 0.0);
            let rest = self.sensor.gel_shape.rest_px(grid);
            let placed =
                Indentation { grid, gel: &gel, force_n: 0.0, rest: rest.as_ref(), level: self.level };
            let (depth_px, edges) = with_map(|map| {
                map.start(mesh, gel_from_mesh, grid);
                placed.lifted(map, mesh, lift_px)
            });
            return Cow::Owned(Imprint { depth_px, edges, ..contact.clone() });
        }
        let rest = self.rest_seen(optics);
        let heights = mesh.raster(gel_from_mesh, grid, reach_px(self.gel, grid, rest.as_ref()));
        let part_px = added(rounded_as_seen(heights, grid, optics), rest.as_ref())
            .map(|height| (f64::from(height) + lift_px) as f32);
        Cow::Owned(match &contact.elastic {
            None => {
                let depth_px = part_px.map(|depth| depth.max(0.0));
                Imprint { depth_px, edges: Edges::default(), ..contact.clone() }
            }
            Some(field) => self.elastic_seen(contact, field, &part_px),
        })
    }

    /// An elastic gel on the sensor's pixels: its surface between those of the pad, and that of the part where it would lie in it.
    fn elastic_seen(&self, contact: &Imprint, field: &ElasticField, part_px: &Plane) -> Imprint {
        let (pad, grid) = (Pad { gel: self.gel, level: self.level }.grid(), &self.sensor.grid);
        let per_px = (pad.metres_per_px / grid.metres_per_px) as f32;
        let mut surface_px = resampled(&field.surface_px, &pad, grid).map(|height| per_px * height);
        let pressure_pa = resampled(&field.pressure_pa, &pad, grid);
        let mut depth_px = Plane::filled(grid.width_px, grid.height_px, 0.0);
        for i in 0..depth_px.values.len() {
            let part = part_px.values[i];
            if pressure_pa.values[i] > 0.0 || part > surface_px.values[i] {
                (depth_px.values[i], surface_px.values[i]) = (part, part);
            }
        }
        Imprint { depth_px, elastic: Some(ElasticField { surface_px, pressure_pa }), ..contact.clone() }
    }
}

/// A plane between its pixels, linear along both axes; beyond its rim 0.
fn resampled(plane: &Plane, from: &Grid, to: &Grid) -> Plane {
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < plane.width as i64 && y < plane.height as i64;
        if inside { f64::from(plane.at(x as usize, y as usize)) } else { 0.0 }
    };
    to.plane(|x_m, y_m| {
        let u = x_m / from.metres_per_px + from.width_px as f64 / 2.0 - 0.5;
        let v = y_m / from.metres_per_px + from.height_px as f64 / 2.0 - 0.5;
        let (x, y) = (u.floor(), v.floor());
        let (right, down) = (u - x, v - y);
        let (x, y) = (x as i64, y as i64);
        let upper = at(x, y) * (1.0 - right) + at(x + 1, y) * right;
        let lower = at(x, y + 1) * (1.0 - right) + at(x + 1, y + 1) * right;
        upper * (1.0 - down) + lower * down
    })
}
