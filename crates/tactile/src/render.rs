//! The whole pipeline behind a few calls.

mod pad;
mod scratch;

use crate::appearance::appearance;
use crate::colour::LocalColours;
use crate::convolve::Follow;
use crate::deform::Core;
use crate::grid::Plane;
use crate::indent::press::Press;
use crate::indent::{Imprint, IndentError};
use crate::markers::{
    MarkerGel, Shear, draw_markers, marker_displacements, marker_displacements_by_cell,
    marker_displacements_by_surface, without_markers,
};
use crate::noise::finish_on;
use crate::raster::ClusteredMesh;
use crate::sensor::Sensor;
use crate::shading::change;
use crate::simd::SimdLevel;
use gripgen_twin::frames::Pose;
use gripgen_twin::{ContactPatch, Gel, TactileImage};
pub use pad::Pad;
use scratch::{Prepared, Scratch, with_scratch};

/// One sensor with its gel.
///
/// Each thread keeps the memory of the stages and what they derive from the last few sensors and gels; results do
/// not depend on it.
#[derive(Debug, Clone, Copy)]
pub struct Renderer<'a> {
    /// The sensor.
    pub sensor: &'a Sensor,
    /// The gel in front of it.
    pub gel: &'a Gel,
    /// The vector unit to use; the result does not depend on it.
    pub level: SimdLevel,
}

impl Renderer<'_> {
    /// Presses a part into the gel as the sensor's pixels resolve it: stages `raster` and `indent`. The contact of a grip is that of
    /// its pad ([`crate::Pad::press`]).
    ///
    /// # Errors
    ///
    /// No surface in front of the gel, or a press deeper than the gel.
    pub fn press(
        &self,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        imprint_m3_per_n: f64,
        force_n: f64,
    ) -> Result<Imprint, IndentError> {
        let press = Press { gel: self.gel, imprint_m3_per_n, force_n, level: self.level };
        with_scratch(self, |scratch, prepared| {
            let rest = prepared.rest_px.as_ref();
            press.mesh(&mut scratch.map, mesh, gel_from_mesh, &self.sensor.grid, rest)
        })
    }

    /// Presses a height map, in pixels above the gel at rest, into the gel.
    pub(crate) fn press_heights(
        &self,
        heights: &Plane,
        imprint_m3_per_n: f64,
        force_n: f64,
    ) -> Result<Imprint, IndentError> {
        let press = Press { gel: self.gel, imprint_m3_per_n, force_n, level: self.level };
        press.heights(heights, &self.sensor.grid)
    }

    /// The gel surface around an imprint, in pixels towards the camera above its rest: stage `deform`. For an elastic
    /// gel it is part of the solution.
    pub fn surface(&self, imprint: &Imprint) -> Plane {
        if let Some(field) = &imprint.elastic {
            return field.surface_px.clone();
        }
        with_scratch(self, |scratch, prepared| {
            self.deform(imprint, scratch, prepared);
            scratch.deform.surface_plane()
        })
    }

    /// The image of an imprint, or of the gel at rest: stages `deform` to `noise`. `noise_key` chooses the noise;
    /// without it there is none, and the gel at rest gives the rest frame of the sensor.
    pub fn image(&self, imprint: Option<&Imprint>, noise_key: Option<u64>) -> TactileImage {
        let Some(imprint) = imprint else { return finish_on(self.sensor, None, noise_key, self.level) };
        let lit = with_scratch(self, |scratch, prepared| {
            let local = imprint.elastic.is_none() && self.sensor.markers.is_none();
            let colours = self.local_colours(prepared).filter(|_| local)?;
            self.deform(imprint, scratch, prepared);
            let Scratch { deform, change, .. } = scratch;
            let done = |change: &[Plane; 3]| finish_on(self.sensor, Some(change), noise_key, self.level);
            Some(change.with(colours, deform.surface(), self.level, done))
        });
        lit.unwrap_or_else(|| finish_on(self.sensor, Some(&self.change(imprint)), noise_key, self.level))
    }

    /// What an imprint changes in the image, in grey levels of red, green and blue: stages `deform` to `shadow`. The
    /// stage `noise`, [`crate::finish`], makes an image of it.
    pub fn change(&self, imprint: &Imprint) -> [Plane; 3] {
        self.change_under_shear(imprint, &Shear::default())
    }

    /// The same while the part also pulls sideways: stage `markers`, of sensors that have them.
    pub fn change_under_shear(&self, imprint: &Imprint, shear: &Shear) -> [Plane; 3] {
        let mut change = self.unmarked_change(imprint);
        self.mark(imprint, shear, &mut change);
        change
    }

    /// Moves the markers as the cells of a patch pull at the gel, each with its force along image x and y. Returns where
    /// they are; empty where there are none.
    pub(crate) fn mark_by_cell(
        &self,
        imprint: &Imprint,
        patch: &ContactPatch,
        tangential_n: &[[f64; 2]],
        change: &mut [Plane; 3],
    ) -> Vec<[f64; 2]> {
        let Sensor { grid, markers: Some(markers), .. } = self.sensor else { return vec![] };
        let moved = match self.marker_gel() {
            Some(gel) => marker_displacements_by_cell(&gel, patch, tangential_n, grid, &markers.rest_px),
            None => {
                let sum = |a: usize| tangential_n.iter().map(|force| force[a]).sum();
                self.moved_by_surface(imprint, [sum(0), sum(1)], &markers.rest_px)
            }
        };
        self.draw_moved(&moved, change);
        markers.rest_px.iter().zip(&moved).map(|(at, by)| [at[0] + by[0], at[1] + by[1]]).collect()
    }

    /// The stage `markers`.
    pub(crate) fn mark(&self, imprint: &Imprint, shear: &Shear, change: &mut [Plane; 3]) {
        let Sensor { grid, markers: Some(markers), .. } = self.sensor else { return };
        let moved = match self.marker_gel() {
            Some(gel) => marker_displacements(&gel, &imprint.patch, shear, grid, &markers.rest_px),
            None => self.moved_by_surface(imprint, shear.force_n, &markers.rest_px),
        };
        self.draw_moved(&moved, change);
    }

    /// Moves the markers of the sensor, if it has any.
    pub(crate) fn draw_moved(&self, moved_px: &[[f64; 2]], change: &mut [Plane; 3]) {
        let Sensor { grid, rest, markers, .. } = self.sensor;
        if let Some(markers) = markers {
            draw_markers(markers, moved_px, &without_markers(rest, grid, markers), change);
        }
    }

    /// The gel as markers know it, where its modulus is known.
    fn marker_gel(&self) -> Option<MarkerGel> {
        let elastic = self.gel.elastic?;
        Some(MarkerGel::new(self.gel.thickness_m, elastic.young_modulus_pa, elastic.poisson_ratio, 0.0))
    }

    /// Displacements of markers by the surface of the gel, which a force takes along by its shear stiffness where it is highest.
    fn moved_by_surface(&self, imprint: &Imprint, force_n: [f64; 2], rest_px: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let surface = self.surface(imprint);
        let (highest_px, metres_per_px) = (f64::from(surface.highest()), self.sensor.grid.metres_per_px);
        let stiffness = self.gel.shear_stiffness_n_per_m * metres_per_px * highest_px;
        let shear = force_n.map(|force| if stiffness > 0.0 { force / stiffness } else { 0.0 });
        marker_displacements_by_surface(&surface, metres_per_px, shear, rest_px)
    }

    /// The stages `deform` to `shadow`.
    pub(crate) fn unmarked_change(&self, imprint: &Imprint) -> [Plane; 3] {
        let core_px = self.core_px(imprint) as f32;
        let core = |i: usize| imprint.depth_px.values[i] > core_px;
        if let Some(field) = &imprint.elastic {
            return appearance(self.sensor, &field.surface_px, core, self.level);
        }
        with_scratch(self, |scratch, prepared| {
            self.deform(imprint, scratch, prepared);
            let (sheet, area) = scratch.deform.surface();
            if let Some(colours) = self.local_colours(prepared) {
                return change(colours, sheet, area, self.level);
            }
            appearance(self.sensor, &sheet.plane(area), core, self.level)
        })
    }

    /// The colours where the image is a function of the displacement of the gel alone.
    fn local_colours(&self, prepared: &Prepared) -> Option<LocalColours<'_>> {
        let flat = prepared.rest_px.is_none();
        self.sensor.colour.local(flat).filter(|_| self.sensor.shadow.is_none())
    }

    /// Whether the deformation blurs the gel as a whole, as Taxim does, which moves a gel that is not flat at rest even
    /// far from the contact. With other colours it blurs the displacement alone: far from a contact nothing moves.
    pub(crate) fn blurs_whole_gel(&self) -> bool {
        self.sensor.colour.takes_whole_slope()
    }

    /// Kernels and restored share of the deformation. A calibrated sensor says which; without its word those of the
    /// gel are used.
    pub(crate) fn pyramid(&self) -> (&[u32], f64) {
        match &self.sensor.pyramid {
            Some(pyramid) => (&pyramid.kernels_px, pyramid.restore_depth_fraction),
            None => (&self.gel.kernels_px, self.gel.restore_depth_fraction),
        }
    }

    /// Depth from which on the gel follows the part.
    pub(crate) fn core_px(&self, imprint: &Imprint) -> f64 {
        self.pyramid().1 * imprint.press_depth_m / self.sensor.grid.metres_per_px
    }

    /// The core of an imprint. Taxim's tables know it in whole pixels alone.
    pub(crate) fn core(&self, imprint: &Imprint) -> Core {
        Core { from_px: self.core_px(imprint), follow: self.follow(), whole_pixels: self.blurs_whole_gel() }
    }

    /// How the gel follows the part there: as the calibration says, and at least where nothing was calibrated.
    pub(crate) fn follow(&self) -> Follow {
        match &self.sensor.pyramid {
            _ if self.blurs_whole_gel() => Follow::Exactly,
            Some(pyramid) => pyramid.follow,
            None => Follow::AtLeast,
        }
    }

    fn deform(&self, imprint: &Imprint, scratch: &mut Scratch, prepared: &Prepared) {
        let rest = prepared.blurred_rest.as_ref();
        scratch.deform.deform(imprint, self.core(imprint), &prepared.weights, rest, self.level);
    }
}
