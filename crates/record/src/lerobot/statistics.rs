//! What policies are normalised with: least, most, mean, deviation and quantiles.

use super::{Frame, IMAGES, STATE};
use crate::decode_picture;
use serde_json::{Map, Value, json};

/// Images that are looked at: the first 64, then every second, fourth, ... one, so that they are spread over the frames.
const LOOKED_AT: usize = 64;

/// The quantiles that `lerobot` 0.4 normalises with (`DEFAULT_QUANTILES` of `datasets/compute_stats.py`), by their names there.
const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];

/// How often each of the 256 levels stands in a channel of an image.
type Levels = [u64; 256];

/// What was seen of the frames.
#[derive(Default)]
pub(super) struct Statistics {
    frames: usize,
    /// Values of each number of the state.
    state: Vec<Vec<f32>>,
    /// Channels of the images that were looked at.
    images: [Vec<[Levels; 3]>; 2],
    every: usize,
}

impl Statistics {
    pub(super) fn take(&mut self, state: &[f32], frame: &Frame) {
        self.state.resize(state.len(), Vec::new());
        self.state.iter_mut().zip(state).for_each(|(seen, x)| seen.push(*x));
        let every = self.every.max(1);
        if self.frames.is_multiple_of(every) {
            for (all, png) in self.images.iter_mut().zip(&frame.images) {
                let Ok(image) = decode_picture(png) else { continue };
                let mut of_image = [[0; 256]; 3];
                for pixel in image.rgb.chunks_exact(3) {
                    (0..3).for_each(|c| of_image[c][usize::from(pixel[c])] += 1);
                }
                all.push(of_image);
            }
            // Evenly spread, whatever their number will be.
            if self.images[0].len() >= LOOKED_AT {
                for all in &mut self.images {
                    let mut place = 0;
                    all.retain(|_| {
                        place += 1;
                        place % 2 == 1
                    });
                }
                self.every = 2 * every;
            }
        }
        self.frames += 1;
    }

    pub(super) fn json(&self, state: &[String], images: bool) -> Value {
        let mut all = Map::new();
        if !state.is_empty() {
            let numbers = self.state.iter().map(|seen| {
                let mut seen: Vec<(f64, u64)> = seen.iter().map(|x| (f64::from(*x), 1)).collect();
                seen.sort_by(|a, b| a.0.total_cmp(&b.0));
                Counted(seen)
            });
            all.insert(STATE.into(), described(&numbers.collect::<Vec<_>>(), self.frames, |x| json!(x)));
        }
        for (name, looked) in IMAGES.iter().zip(&self.images).filter(|_| images) {
            let channels = (0..3).map(|c| {
                let times = |level: usize| looked.iter().map(|one| one[c][level]).sum::<u64>();
                Counted((0..256).map(|level| (level as f64 / 255.0, times(level))).collect())
            });
            // (channel, 1, 1)
            let described = described(&channels.collect::<Vec<_>>(), looked.len(), |x| json!([[x]]));
            all.insert((*name).into(), described);
        }
        Value::Object(all)
    }
}

/// Numbers in ascending order, each with how often it occurs.
struct Counted(Vec<(f64, u64)>);

impl Counted {
    fn n(&self) -> u64 {
        self.0.iter().map(|(_, times)| times).sum()
    }

    fn mean_of(&self, of: impl Fn(f64) -> f64) -> f64 {
        self.0.iter().map(|(x, times)| of(*x) * *times as f64).sum::<f64>() / self.n().max(1) as f64
    }

    fn deviation(&self) -> f64 {
        let mean = self.mean_of(|x| x);
        self.mean_of(|x| (x - mean) * (x - mean)).sqrt()
    }

    /// The number at a place of all, counted from 0.
    fn at(&self, place: u64) -> f64 {
        let mut passed = 0;
        let reached = self.0.iter().find(|(_, times)| {
            passed += times;
            passed > place
        });
        reached.map_or(0.0, |(x, _)| *x)
    }

    /// Between the two numbers at the place of a share, in proportion, as numpy does.
    fn quantile(&self, share: f64) -> f64 {
        let place = share * self.n().saturating_sub(1) as f64;
        let (low, high) = (self.at(place.floor() as u64), self.at(place.ceil() as u64));
        low + (high - low) * place.fract()
    }
}

/// The keys of one feature; `each` makes the entry of a number of it.
fn described(numbers: &[Counted], count: usize, each: fn(f64) -> Value) -> Value {
    let of = |value: &dyn Fn(&Counted) -> f64| numbers.iter().map(|x| each(value(x))).collect::<Vec<_>>();
    let mut keys = Map::new();
    keys.insert("min".into(), of(&|x| x.at(0)).into());
    keys.insert("max".into(), of(&|x| x.at(x.n().saturating_sub(1))).into());
    keys.insert("mean".into(), of(&|x| x.mean_of(|x| x)).into());
    keys.insert("std".into(), of(&|x| x.deviation()).into());
    for (name, share) in QUANTILES {
        keys.insert(name.into(), of(&|x| x.quantile(share)).into());
    }
    keys.insert("count".into(), json!([count]));
    keys.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against `numpy.quantile([1, 2, 2, 5, 9], q)`.
    #[test]
    fn quantiles_lie_between_neighbours_as_in_numpy() {
        let counted = Counted(vec![(1.0, 1), (2.0, 2), (5.0, 1), (9.0, 1)]);
        for (share, wanted) in [(0.01, 1.04), (0.1, 1.4), (0.5, 2.0), (0.9, 7.4), (0.99, 8.84)] {
            assert!((counted.quantile(share) - wanted).abs() < 1e-12, "{share}");
        }
        assert_eq!((counted.at(0), counted.at(4), counted.mean_of(|x| x)), (1.0, 9.0, 3.8));
        assert!((counted.deviation() - 2.925_747_767).abs() < 1e-8);
        assert_eq!(Counted(vec![]).quantile(0.5), 0.0);
    }
}
