//! What predicts presses, and from what.

use super::candidates::{fitted, free_parameter};
use gripgen_twin::Covariates;
use gripgen_twin::effects::EffectSpec;

/// Zones of a press whose pixels count alike: inside the contact, at its rim, near it and far from it.
pub const PRESS_ZONES: usize = 4;

/// An optics effect with the values of all its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct ActingEffect {
    /// Which.
    pub spec: &'static EffectSpec,
    /// Values in the order of the spec.
    pub values: Vec<f64>,
    /// How many of its leading parameters are fitted; the others stay neutral, but for the one that is tried.
    pub fitted: usize,
}

impl ActingEffect {
    /// The effect with its values at the start of a fit; `px_mm`: side of a pixel on the gel.
    pub(super) fn start(spec: &'static EffectSpec, px_mm: f64) -> Self {
        let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
        let orders = spec.presses.map_or(&[] as &[usize], |fit| fit.orders);
        let first = orders.first().copied().unwrap_or(values.len());
        for j in fitted(spec).into_iter().filter(|&j| j < first) {
            values[j] = free_parameter(spec, j, px_mm).start;
        }
        Self { spec, values, fitted: first }
    }

    /// Positions of the parameters that are fitted.
    pub(super) fn free(&self) -> impl Iterator<Item = usize> {
        fitted(self.spec).into_iter().filter(|&j| j < self.fitted)
    }
}

/// The pixels of a press that are looked at. All lists have one entry per pixel, in one order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressPixels {
    /// Grey levels of red, green and blue that were measured.
    pub measured: Vec<[f32; 3]>,
    /// Zone, below [`PRESS_ZONES`]; larger numbers count as the last zone.
    pub zones: Vec<u8>,
    /// Place in the frame, from -1 to 1 along rows and columns.
    pub places: Vec<[f64; 2]>,
}

/// Predicts what the camera sees of presses, numbered from 0 in the order in which they were taken. Implemented where
/// pictures can be drawn.
pub trait PredictPresses: Sync {
    /// Circumstances of each press: as many as there are presses.
    fn circumstances(&self) -> &[Covariates];

    /// Side of a pixel on the gel, at the resolution of [`PredictPresses::pixels`].
    fn px_mm(&self) -> f64;

    /// Mean square of the camera's noise at one of [`PredictPresses::pixels`], in grey levels squared.
    fn noise_mse(&self) -> f64;

    /// The pixels of a press that are looked at, with what was measured there.
    fn pixels(&self, press: usize) -> PressPixels;

    /// Grey levels of red, green and blue at each of these pixels where some effects act beside the sensor file.
    fn levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]>;

    /// The part of [`PredictPresses::levels`] that the contact changes, before light and camera act on it, in grey levels.
    fn contact_levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]>;

    /// Mean squared error of the whole frame in grey levels squared, at the resolution of the image: what a comparison
    /// with the twin that has these effects says. Slow; [`PredictPresses::levels`] is what fits are made with.
    fn frame_mse(&self, press: usize, acting: &[ActingEffect]) -> f64;

    /// Calls `task` for 0..n, in parallel where that is possible. Each call stands for itself.
    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(task);
    }
}
