//! The image as the optics effects of a twin change it.
//!
//! An [`OpticsState`] acts in this order, whatever the order of the effects: the edges of the part (`rounding`), the depth of
//! the press and the shape of the gel at rest (here), the relief of the part (`relief`), the
//! kernels of the gel (`kernels`), the shape of the part (`shape`), where the contact is seen (`warp`), shadow,
//! focus and offset of what the contact changes (`shadow`, here), light and camera on the whole frame (`camera`). A
//! stage in which nothing is changed is the plain one, bit for bit. Noise comes after all of it: it is the camera's.

mod camera;
#[cfg(test)]
mod fit_tests;
mod kernels;
mod pattern;
pub(crate) mod relief;
mod rounding;
mod shadow;
mod shape;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod warp;

pub(crate) use camera::level_at;
pub(crate) use rounding::rounded;
pub(crate) use warp::frame_at;

use crate::appearance::appearance_on;
use crate::deform::{Edges, blurred, deform_with};
use crate::grid::{Grid, Plane, added};
use crate::indent::Imprint;
use crate::markers::Shear;
use crate::render::Renderer;
use crate::sensor::GelShape;
use gripgen_twin::{ContactPatch, OpticsState};

/// What the effects add to the gel's shape at rest, in pixels towards the part: a dome over what the camera sees, `view`, on any grid.
pub(crate) fn dome(grid: &Grid, view: &Grid, optics: &OpticsState) -> Option<Plane> {
    GelShape::Dome { sag_m: optics.dome_sag_m }.rest_over(grid, view)
}

/// The part's surface with its edges as they are.
pub(crate) fn rounded_as_seen(heights: Plane, grid: &Grid, optics: &OpticsState) -> Plane {
    if optics.edge_rounding_m == 0.0 {
        return heights;
    }
    rounded(&heights, optics.edge_rounding_m / grid.metres_per_px)
}

/// The imprint at the depth that is seen instead of its own, at most the thickness of the gel.
pub(crate) fn at_depth(
    imprint: Imprint,
    heights: &Plane,
    grid: &Grid,
    thickness_m: f64,
    optics: &OpticsState,
) -> Imprint {
    let press_depth_m = optics.press_depth_m(imprint.press_depth_m).min(thickness_m);
    let press_px = (press_depth_m / grid.metres_per_px) as f32;
    let highest = heights.highest();
    let depth_px = heights.map(|h| (h - highest + press_px).max(0.0));
    let lift_m = f64::from(press_px - highest) * grid.metres_per_px;
    Imprint { depth_px, edges: Edges::default(), press_depth_m, lift_m, ..imprint }
}

impl Renderer<'_> {
    /// The gel's shape at rest with what the effects add to it, in pixels towards the part.
    pub(crate) fn rest_seen(&self, optics: &OpticsState) -> Option<Plane> {
        let grid = &self.sensor.grid;
        match (self.sensor.gel_shape.rest_px(grid), dome(grid, grid, optics)) {
            (Some(rest), dome) => Some(added(rest, dome.as_ref())),
            (None, dome) => dome,
        }
    }

    /// What the camera sees, minus the rest frame of the sensor file, in grey levels of red, green and blue; for an
    /// imprint of [`Renderer::seen`] or without contact. [`crate::finish`] makes an image of it.
    pub fn change_seen(&self, imprint: Option<&Imprint>, optics: &OpticsState) -> [Plane; 3] {
        let grid = &self.sensor.grid;
        let still =
            |change: &mut [Plane; 3], imprint: &Imprint| self.mark(imprint, &Shear::default(), change);
        let mut change = match imprint {
            Some(imprint) => self.contact_seen(imprint, optics, |change| still(change, imprint)),
            None => [0, 1, 2].map(|_| Plane::filled(grid.width_px, grid.height_px, 0.0)),
        };
        if optics.changes_frame() {
            camera::apply(optics, &self.sensor.grid, &self.sensor.rest, &mut change);
        }
        change
    }

    /// The same while the part also pulls at the gel: `tangential_n` is its force on each cell of `patch` along image x and y.
    /// Also returns where the markers are; empty where there are none.
    pub fn change_pulled(
        &self,
        imprint: &Imprint,
        optics: &OpticsState,
        patch: &ContactPatch,
        tangential_n: &[[f64; 2]],
    ) -> ([Plane; 3], Vec<[f64; 2]>) {
        let mut markers_px = Vec::new();
        let mut change = self.contact_seen(imprint, optics, |change| {
            markers_px = self.mark_by_cell(imprint, patch, tangential_n, change);
        });
        if optics.changes_frame() {
            camera::apply(optics, &self.sensor.grid, &self.sensor.rest, &mut change);
        }
        (change, markers_px)
    }

    /// What the contact changes, as it reaches the camera; `mark` is the stage `markers`.
    fn contact_seen(
        &self,
        imprint: &Imprint,
        optics: &OpticsState,
        mark: impl FnOnce(&mut [Plane; 3]),
    ) -> [Plane; 3] {
        let grid = &self.sensor.grid;
        let mut change = if !optics.changes_surface() && optics.shadow_strength == 0.0 {
            self.unmarked_change(imprint)
        } else {
            let mut surface = self.surface_seen(imprint, optics);
            if optics.part_offset_m != 0.0 || optics.edge_blunting_m != 0.0 {
                surface = shape::part(surface, grid, optics, self.level);
            }
            let mut moved = None;
            if optics.moves_contact() {
                surface = warp::surface(&surface, grid, optics);
                moved = Some(warp::surface(&imprint.depth_px, grid, optics));
            }
            let depth_px = moved.as_ref().unwrap_or(&imprint.depth_px);
            let core_px = self.core_px(imprint) as f32;
            let core = |i: usize| depth_px.values[i] > core_px;
            let rest = self.rest_seen(optics);
            let mut change = appearance_on(self.sensor, &surface, rest.as_ref(), core, self.level);
            if optics.shadow_strength != 0.0 {
                shadow::cast(self.sensor, optics, &surface, depth_px, &mut change);
            }
            change
        };
        if optics.defocus_m > 0.0 {
            let weights = kernels::discrete_gaussian(optics.defocus_m / grid.metres_per_px);
            for plane in &mut change {
                *plane = blurred(plane, &weights, self.level);
            }
        }
        mark(&mut change);
        for (plane, offset) in change.iter_mut().zip(optics.rest_offset) {
            if offset != 0.0 {
                plane.values.iter_mut().for_each(|value| *value += offset as f32);
            }
        }
        change
    }

    /// The gel surface around an imprint, with scaled kernels.
    fn surface_seen(&self, imprint: &Imprint, optics: &OpticsState) -> Plane {
        if imprint.elastic.is_some()
            || (optics.kernel_scale == 1.0 && (optics.dome_sag_m == 0.0 || !self.blurs_whole_gel()))
        {
            return self.surface(imprint);
        }
        let (kernels_px, _) = self.pyramid();
        let scaled: Vec<Vec<f32>> =
            kernels_px.iter().map(|&k| kernels::scaled(k, optics.kernel_scale)).collect();
        let rest = self.rest_seen(optics).filter(|_| self.blurs_whole_gel());
        deform_with(imprint, self.core(imprint), &scaled, rest.as_ref(), self.level)
    }
}
