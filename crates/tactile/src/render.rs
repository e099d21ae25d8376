//! The whole pipeline behind two calls.

use crate::colour::shade;
use crate::deform::deform;
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::indent::{Imprint, IndentError, PressedGel, indent};
use crate::noise::finish;
use crate::raster::raster;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gel, TactileImage, TriMesh};

/// One sensor with its gel.
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
    /// Presses a part into the gel: stages `raster` and `indent`.
    pub fn press(
        &self,
        mesh: &TriMesh,
        gel_from_mesh: &Pose,
        imprint_m3_per_n: f64,
        force_n: f64,
    ) -> Result<Imprint, IndentError> {
        let grid = &self.sensor.grid;
        let depth_px = self.gel.thickness_m / grid.metres_per_px;
        let heights = raster(mesh, gel_from_mesh, grid, depth_px);
        let gel = PressedGel { thickness_m: self.gel.thickness_m, imprint_m3_per_n };
        indent(&heights, grid, &gel, force_n)
    }

    /// The gel surface around an imprint, in pixels towards the camera: stage `deform`. A calibrated sensor says with
    /// which kernels; without its word those of the gel are used.
    pub fn surface(&self, imprint: &Imprint) -> Plane {
        let (kernels_px, restore_depth_fraction) = match &self.sensor.pyramid {
            Some(pyramid) => (&pyramid.kernels_px, pyramid.restore_depth_fraction),
            None => (&self.gel.kernels_px, self.gel.restore_depth_fraction),
        };
        let metres_per_px = self.sensor.grid.metres_per_px;
        deform(imprint, kernels_px, restore_depth_fraction, metres_per_px, None, self.level)
    }

    /// The image of an imprint, or of the gel at rest: stages `deform` to `noise`. `noise_key` chooses the noise;
    /// without it there is none, and the gel at rest gives the rest frame of the sensor.
    pub fn image(&self, imprint: Option<&Imprint>, noise_key: Option<u64>) -> TactileImage {
        finish(self.sensor, imprint.map(|i| self.change(i)).as_ref(), noise_key)
    }

    /// What an imprint changes in the image, in grey levels of red, green and blue: stages `deform` to `shade`. The
    /// stage `noise`, [`finish`], makes an image of it.
    pub fn change(&self, imprint: &Imprint) -> [Plane; 3] {
        let (along_x, along_y) = gradient(&self.surface(imprint));
        shade(&self.sensor.colour, &along_x, &along_y)
    }
}
