//! Least, most, mean and deviation of what policies are normalised with.

use super::{Frame, IMAGES, STATE};
use crate::decode_picture;
use serde_json::{Map, Value, json};

/// Images that are looked at: the first so many of every so manieth, twice as far apart each time there are twice as many.
const LOOKED_AT: usize = 64;

/// Sums over frames.
#[derive(Default)]
pub(super) struct Statistics {
    frames: usize,
    state: Vec<Sums>,
    images: [Vec<[Sums; 3]>; 2],
    every: usize,
}

/// Of one number.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: f64,
    sum: f64,
    squares: f64,
    low: f64,
    high: f64,
}

impl Sums {
    fn add(&mut self, x: f64) {
        (self.low, self.high) = if self.n == 0.0 { (x, x) } else { (self.low.min(x), self.high.max(x)) };
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    fn join(&mut self, other: &Self) {
        if self.n == 0.0 {
            *self = *other;
        } else if other.n > 0.0 {
            self.n += other.n;
            self.sum += other.sum;
            self.squares += other.squares;
            (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.n.max(1.0)
    }

    fn deviation(&self) -> f64 {
        (self.squares / self.n.max(1.0) - self.mean() * self.mean()).max(0.0).sqrt()
    }
}

impl Statistics {
    pub(super) fn take(&mut self, state: &[f32], frame: &Frame) {
        self.state.resize(state.len(), Sums::default());
        self.state.iter_mut().zip(state).for_each(|(sums, x)| sums.add(f64::from(*x)));
        let every = self.every.max(1);
        if self.frames.is_multiple_of(every) {
            for (all, png) in self.images.iter_mut().zip(&frame.images) {
                let Ok(image) = decode_picture(png) else { continue };
                let mut of_image = [Sums::default(); 3];
                for pixel in image.rgb.chunks_exact(3) {
                    (0..3).for_each(|c| of_image[c].add(f64::from(pixel[c]) / 255.0));
                }
                all.push(of_image);
            }
            // Evenly spread, however many there will be.
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
        let numbers = |of: fn(&Sums) -> f64| self.state.iter().map(of).collect::<Vec<_>>();
        if !state.is_empty() {
            let value = json!({
                "min": numbers(|s| s.low), "max": numbers(|s| s.high), "mean": numbers(Sums::mean),
                "std": numbers(Sums::deviation), "count": [self.frames],
            });
            all.insert(STATE.into(), value);
        }
        for (name, looked) in IMAGES.iter().zip(&self.images).filter(|_| images) {
            let mut sums = [Sums::default(); 3];
            looked.iter().for_each(|one| (0..3).for_each(|c| sums[c].join(&one[c])));
            // (channel, 1, 1)
            let numbers = |of: fn(&Sums) -> f64| sums.iter().map(|s| [[of(s)]]).collect::<Vec<_>>();
            let value = json!({
                "min": numbers(|s| s.low), "max": numbers(|s| s.high), "mean": numbers(Sums::mean),
                "std": numbers(Sums::deviation), "count": [looked.len()],
            });
            all.insert((*name).into(), value);
        }
        Value::Object(all)
    }
}
