//! Presses at the pixels that are looked at, and how much each pixel counts.

use super::predict::{ActingEffect, PRESS_ZONES, PredictPresses, PressPixels};
use std::sync::Mutex;

/// Presses with what was measured of them and what predicts them.
pub(super) struct Observed<'a> {
    pub(super) predictor: &'a dyn PredictPresses,
    /// Of each press.
    pub(super) pixels: Vec<PressPixels>,
    /// Mean square that counts as 1, of each zone.
    zone_scale: [f64; PRESS_ZONES],
}

impl<'a> Observed<'a> {
    /// All zones count by their own scatter after [`Observed::rescale`] only.
    pub(super) fn new(predictor: &'a dyn PredictPresses) -> Self {
        let pixels = (0..predictor.circumstances().len()).map(|i| predictor.pixels(i)).collect();
        Self { predictor, pixels, zone_scale: [1.0; PRESS_ZONES] }
    }

    /// How many presses there are.
    pub(super) fn count(&self) -> usize {
        self.pixels.len()
    }

    /// Grey levels at the pixels of a press.
    pub(super) fn levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]> {
        self.predictor.levels(press, acting)
    }

    /// `of` for 0 to `n - 1` in order, in parallel where the predictor can.
    pub(super) fn for_each<T: Send>(&self, n: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let slots: Vec<Mutex<Option<T>>> = (0..n).map(|_| Mutex::new(None)).collect();
        self.predictor.for_each(n, &|i| {
            let value = of(i);
            if let Some(Ok(mut slot)) = slots.get(i).map(Mutex::lock) {
                *slot = Some(value);
            }
        });
        let value =
            |(i, slot): (usize, Mutex<Option<T>>)| slot.into_inner().ok().flatten().unwrap_or_else(|| of(i));
        slots.into_iter().enumerate().map(value).collect()
    }

    /// Measures the zones by what a model leaves in them: the median over the presses, so that each counts alike.
    pub(super) fn rescale(&mut self, model: &[ActingEffect]) {
        let squares = self.zone_squares(model);
        let noise = self.predictor.noise_mse();
        for (z, scale) in self.zone_scale.iter_mut().enumerate() {
            let mut list: Vec<f64> = squares.iter().map(|s| s[z]).filter(|s| s.is_finite()).collect();
            list.sort_by(f64::total_cmp);
            *scale = list.get(list.len() / 2).copied().unwrap_or(1.0).max(noise).max(0.02);
        }
    }

    /// Mean squared residual in each zone of each press; NaN where a zone is empty.
    fn zone_squares(&self, model: &[ActingEffect]) -> Vec<[f64; PRESS_ZONES]> {
        self.for_each(self.count(), |i| {
            let levels = self.levels(i, model);
            let (mut sums, mut counts) = ([0.0; PRESS_ZONES], [0.0; PRESS_ZONES]);
            let pixels = &self.pixels[i];
            for ((zone, level), measured) in pixels.zones.iter().zip(&levels).zip(&pixels.measured) {
                for c in 0..3 {
                    sums[place(*zone)] += f64::from(level[c] - measured[c]).powi(2);
                    counts[place(*zone)] += 1.0;
                }
            }
            std::array::from_fn(|z| sums[z] / counts[z])
        })
    }

    /// Mean squared residual in each zone over the presses that have it; 0 where none has.
    pub(super) fn zone_mse(&self, model: &[ActingEffect]) -> [f64; PRESS_ZONES] {
        let squares = self.zone_squares(model);
        std::array::from_fn(|z| {
            let there: Vec<f64> = squares.iter().map(|s| s[z]).filter(|s| s.is_finite()).collect();
            there.iter().sum::<f64>() / there.len().max(1) as f64
        })
    }

    /// Weight of each pixel of a press: zones count alike.
    pub(super) fn pixel_weights(&self, press: usize) -> Vec<f64> {
        let zones = &self.pixels[press].zones;
        let mut counts = [0.0; PRESS_ZONES];
        zones.iter().for_each(|z| counts[place(*z)] += 3.0);
        let there = counts.iter().filter(|c| **c > 0.0).count() as f64;
        let weight = |z: &u8| 1.0 / (there * counts[place(*z)] * self.zone_scale[place(*z)]);
        zones.iter().map(weight).collect()
    }
}

/// Position of a zone in lists of them.
fn place(zone: u8) -> usize {
    usize::from(zone).min(PRESS_ZONES - 1)
}
