//! Memory that a thread uses again from image to image.

use super::Renderer;
use crate::deform::{BlurredRest, DeformScratch, weights};
use crate::grid::{Grid, Plane};
use crate::raster::HeightMap;
use crate::sensor::GelShape;
use crate::shading::ChangeScratch;
use std::cell::RefCell;

/// Sensors with gels that a thread keeps prepared: those of two jaws, twice.
const PREPARED: usize = 4;

/// Memory of the stages.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    pub(super) map: HeightMap,
    pub(super) deform: DeformScratch,
    pub(super) change: ChangeScratch,
}

/// What depends on sensor and gel only.
#[derive(Debug)]
pub(super) struct Prepared {
    grid: Grid,
    kernels_px: Vec<u32>,
    gel_shape: GelShape,
    whole_gel: bool,
    /// Halves of the kernels.
    pub(super) weights: Vec<Vec<f32>>,
    /// The surface at rest; `None` if it is flat.
    pub(super) rest_px: Option<Plane>,
    /// There where the blurs work on the whole gel.
    pub(super) blurred_rest: Option<BlurredRest>,
}

impl Prepared {
    fn new(renderer: &Renderer<'_>) -> Self {
        let (sensor, kernels_px) = (renderer.sensor, renderer.pyramid().0);
        let rest_px = sensor.gel_shape.rest_px(&sensor.grid);
        Self {
            grid: sensor.grid,
            kernels_px: kernels_px.to_vec(),
            gel_shape: sensor.gel_shape.clone(),
            whole_gel: renderer.blurs_whole_gel(),
            weights: weights(kernels_px),
            blurred_rest: rest_px
                .as_ref()
                .filter(|_| renderer.blurs_whole_gel())
                .map(|rest| BlurredRest::new(rest, kernels_px, renderer.level)),
            rest_px,
        }
    }

    fn fits(&self, renderer: &Renderer<'_>) -> bool {
        self.grid == renderer.sensor.grid
            && self.kernels_px == renderer.pyramid().0
            && self.whole_gel == renderer.blurs_whole_gel()
            && self.gel_shape == renderer.sensor.gel_shape
    }
}

thread_local! {
    static MEMORY: RefCell<(Scratch, Vec<Prepared>)> = RefCell::default();
}

/// Runs `f` with this thread's height map.
pub(crate) fn with_map<T>(f: impl FnOnce(&mut HeightMap) -> T) -> T {
    MEMORY.with_borrow_mut(|(scratch, _)| f(&mut scratch.map))
}

/// Runs `f` with this thread's memory.
pub(super) fn with_scratch<T>(renderer: &Renderer<'_>, f: impl FnOnce(&mut Scratch, &Prepared) -> T) -> T {
    MEMORY.with_borrow_mut(|(scratch, prepared)| {
        let place = prepared.iter().position(|p| p.fits(renderer)).unwrap_or_else(|| {
            prepared.truncate(PREPARED - 1);
            prepared.insert(0, Prepared::new(renderer));
            0
        });
        f(scratch, &prepared[place])
    })
}
