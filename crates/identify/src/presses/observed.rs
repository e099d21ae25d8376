//! Presses at the pixels that are looked at, and how much each pixel counts.

use super::candidates::tried;
use super::predict::{ActingEffect, PRESS_ZONES, PredictPresses, PressPixels};
use gripgen_twin::values::median;
use std::sync::Mutex;

/// Presses with what was measured of them and what predicts them.
pub(super) struct Observed<'a> {
    pub(super) predictor: &'a dyn PredictPresses,
    /// Of each press.
    pub(super) pixels: Vec<PressPixels>,
    /// Mean square that counts as 1, of each zone.
    zone_scale: [f64; PRESS_ZONES],
    /// Square of a gain that counts as 1, of each channel: a camera that balances white leaves green alone.
    gain_scale: [f64; 3],
    /// Standard deviations by which the camera's gains are known to wander.
    gain_sd: Option<[f64; 3]>,
    /// Where each press has gains of its own: the levels at its pixels without effects, on which they act.
    gains: Option<Vec<Vec<[f32; 3]>>>,
}

/// Mean squared residual of a press in each zone, and the squares of its gains.
type PressSquares = ([f64; PRESS_ZONES], [f64; 3]);

/// Gains count as 1 at this many standard deviations at most.
const WIDE: f64 = 2.0;

/// Smallest scatter of gains that counts as 1.
const MIN_GAIN: f64 = 1e-3;

impl<'a> Observed<'a> {
    /// All zones count by their own scatter after [`Observed::rescale`] only.
    pub(super) fn new(predictor: &'a dyn PredictPresses) -> Self {
        let pixels = (0..predictor.circumstances().len()).map(|i| predictor.pixels(i)).collect();
        Self {
            predictor,
            pixels,
            zone_scale: [1.0; PRESS_ZONES],
            gain_scale: [1.0; 3],
            gain_sd: None,
            gains: None,
        }
    }

    /// From here on each press has gains of its own: pixels are compared without them, and the gains with those that a model
    /// predicts, as a zone of their own.
    pub(super) fn divide_gains(&mut self) {
        self.gains = Some(self.for_each(self.count(), |i| self.levels(i, &[])));
    }

    /// Gains that lie further apart than the camera's wander, by their standard deviations, are for effects to explain: they do
    /// not set their own measure.
    pub(super) fn measure_gains_by(&mut self, sd: [f64; 3]) {
        self.gain_sd = Some(sd);
    }

    /// As before [`Observed::divide_gains`].
    pub(super) fn keep_gains(&mut self) {
        self.gains = None;
    }

    /// Whether presses have gains of their own.
    pub(super) fn divides_gains(&self) -> bool {
        self.gains.is_some()
    }

    /// The gain of each channel that a change of the levels at the pixels of a press amounts to, as a share; 0 where nothing is
    /// away from the contact, or presses have no gains of their own.
    pub(super) fn gain_of(&self, press: usize, change: impl Fn(usize, usize) -> f64) -> [f64; 3] {
        self.gain_in(press, |_| true, change)
    }

    /// The same over a part of the pixels.
    pub(super) fn gain_in(
        &self,
        press: usize,
        within: impl Fn(usize) -> bool,
        change: impl Fn(usize, usize) -> f64,
    ) -> [f64; 3] {
        let Some(levels) = self.gains.as_ref().map(|levels| &levels[press]) else { return [0.0; 3] };
        let (mut products, mut squares) = ([0.0; 3], [0.0; 3]);
        let away = |k: usize| away(self.pixels[press].zones[k]) && within(k);
        for (k, level) in levels.iter().enumerate().filter(|(k, _)| away(*k)) {
            for c in 0..3 {
                let level = f64::from(level[c]);
                products[c] += level * change(k, c);
                squares[c] += level * level;
            }
        }
        [0, 1, 2].map(|c| if squares[c] > 0.0 { products[c] / squares[c] } else { 0.0 })
    }

    /// The part of a change at a pixel that is a gain of its press.
    pub(super) fn gained(&self, press: usize, pixel: usize, gain: [f64; 3]) -> [f64; 3] {
        match &self.gains {
            Some(levels) => [0, 1, 2].map(|c| gain[c] * f64::from(levels[press][pixel][c])),
            None => [0.0; 3],
        }
    }

    /// Weights of the three gains of a press; `None` where presses have none of their own.
    pub(super) fn gain_weights(&self, press: usize) -> Option<[f64; 3]> {
        self.gains.as_ref()?;
        Some(self.gain_scale.map(|scale| 1.0 / (self.zones_there(press) * 3.0 * scale)))
    }

    /// Zones that a press has.
    fn zones_there(&self, press: usize) -> f64 {
        let mut there = [false; PRESS_ZONES];
        self.pixels[press].zones.iter().for_each(|z| there[place(*z)] = true);
        let gains = usize::from(self.gains.is_some());
        (there.iter().filter(|t| **t).count() + gains) as f64
    }

    /// How many presses there are.
    pub(super) fn count(&self) -> usize {
        self.pixels.len()
    }

    /// On which presses an effect acts that begins with one; `None` for any other.
    pub(super) fn acts(&self, acting: &ActingEffect) -> Option<Vec<bool>> {
        let first = *acting.values.get(tried(acting.spec)?)?;
        let all = self.predictor.circumstances();
        Some(all.iter().map(|press| press.pull_index as f64 >= first).collect())
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
        let median = |of: &dyn Fn(&PressSquares) -> f64| {
            median(squares.iter().map(of).filter(|s| s.is_finite()).collect()).unwrap_or(1.0)
        };
        let noise = self.predictor.noise_mse();
        self.zone_scale = std::array::from_fn(|z| median(&|(zones, _)| zones[z]).max(noise.max(0.02)));
        let most = self.gain_sd.map_or([f64::INFINITY; 3], |sd| sd.map(|sd| (WIDE * sd).powi(2)));
        self.gain_scale =
            std::array::from_fn(|c| median(&|(_, gains)| gains[c]).min(most[c]).max(MIN_GAIN * MIN_GAIN));
    }

    /// Mean squared residual in each zone and channel of a press without its gain, NaN where a zone is empty, and its gain.
    pub(super) fn squares(
        &self,
        press: usize,
        model: &[ActingEffect],
    ) -> ([[f64; 3]; PRESS_ZONES], [f64; 3]) {
        let levels = self.levels(press, model);
        let pixels = &self.pixels[press];
        let off = |k: usize, c: usize| f64::from(levels[k][c] - pixels.measured[k][c]);
        let gain = self.gain_of(press, off);
        let (mut sums, mut counts) = ([[0.0; 3]; PRESS_ZONES], [0.0; PRESS_ZONES]);
        for (k, zone) in pixels.zones.iter().enumerate() {
            let gained = self.gained(press, k, gain);
            (0..3).for_each(|c| sums[place(*zone)][c] += (off(k, c) - gained[c]).powi(2));
            counts[place(*zone)] += 1.0;
        }
        (std::array::from_fn(|z| sums[z].map(|sum| sum / counts[z])), gain)
    }

    /// Mean squared residual in each zone of each press, NaN where a zone is empty, and the squares of its gains.
    fn zone_squares(&self, model: &[ActingEffect]) -> Vec<PressSquares> {
        self.for_each(self.count(), |i| {
            let (zones, gain) = self.squares(i, model);
            (zones.map(|channels| channels.iter().sum::<f64>() / 3.0), gain.map(|g| g * g))
        })
    }

    /// Cost of the pixels of each press under a model, all zones alike.
    pub(super) fn pixel_costs(&self, model: &[ActingEffect]) -> Vec<f64> {
        let of_press = |(squares, _): PressSquares| {
            let there = squares.iter().zip(&self.zone_scale).filter(|(s, _)| s.is_finite());
            let (n, sum) = there.fold((0.0, 0.0), |(n, sum), (s, scale)| (n + 1.0, sum + s / scale));
            sum / f64::max(n, 1.0)
        };
        self.zone_squares(model).into_iter().map(of_press).collect()
    }

    /// Mean squared residual in each zone over the presses that have it; 0 where none has.
    pub(super) fn zone_mse(&self, model: &[ActingEffect]) -> [f64; PRESS_ZONES] {
        let squares = self.zone_squares(model);
        std::array::from_fn(|z| {
            let there: Vec<f64> = squares.iter().map(|(s, _)| s[z]).filter(|s| s.is_finite()).collect();
            there.iter().sum::<f64>() / there.len().max(1) as f64
        })
    }

    /// Weight of each pixel of a press: zones count alike.
    pub(super) fn pixel_weights(&self, press: usize) -> Vec<f64> {
        let zones = &self.pixels[press].zones;
        let mut counts = [0.0; PRESS_ZONES];
        zones.iter().for_each(|z| counts[place(*z)] += 3.0);
        let there = self.zones_there(press);
        let weight = |z: &u8| 1.0 / (there * counts[place(*z)] * self.zone_scale[place(*z)]);
        zones.iter().map(weight).collect()
    }
}

/// Whether a zone lies away from the contact: the last one.
fn away(zone: u8) -> bool {
    place(zone) == PRESS_ZONES - 1
}

/// Position of a zone in lists of them.
fn place(zone: u8) -> usize {
    usize::from(zone).min(PRESS_ZONES - 1)
}
