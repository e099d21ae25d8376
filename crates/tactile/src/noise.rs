//! Stage `noise`: sensor noise, and rounding to 8 bits.

use crate::grid::Plane;
use crate::sensor::Sensor;
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::TactileImage;
use gripgen_twin::random::normal_quantile;
use std::sync::OnceLock;

/// Number of levels of the noise; a power of two.
const LEVELS: usize = 4096;

/// Standard normal values, equally likely: the quantiles of the middle of each level, scaled to variance 1.
pub(crate) fn levels() -> &'static [f32; LEVELS] {
    static TABLE: OnceLock<[f32; LEVELS]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let raw: Vec<f64> = (0..LEVELS).map(|i| normal_quantile((i as f64 + 0.5) / LEVELS as f64)).collect();
        let variance = raw.iter().map(|z| z * z).sum::<f64>() / LEVELS as f64;
        std::array::from_fn(|i| (raw[i] / variance.sqrt()) as f32)
    })
}

/// The finaliser of MurmurHash3 (Appleby, public domain): every bit of the input reaches every bit of the output.
#[inline(always)]
fn mix(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// The two words that an image's key becomes. Both depend on all of the key, so that keys that are alike do not give
/// the same noise at other pixels.
fn words(key: u64) -> [u32; 2] {
    let (low, high) = (key as u32, (key >> 32) as u32);
    let first = mix(low ^ mix(high));
    [first, mix(high ^ mix(low.wrapping_add(first)))]
}

/// The level of the noise of value `index` of an image: an integer hash of (key, index) chooses it, so it depends
/// neither on order nor on threads.
#[inline(always)]
fn level_of(words: [u32; 2], index: u32) -> u32 {
    mix(mix(index ^ words[0]).wrapping_add(words[1])) >> 20
}

/// Adds the change of colour to the rest frame, and noise where there is a key, and rounds to 8 bits.
pub fn finish(sensor: &Sensor, change: Option<&[Plane; 3]>, noise_key: Option<u64>) -> TactileImage {
    let mut rgb = vec![0u8; 3 * sensor.grid.len()];
    SimdLevel::best().run(Finish { sensor, change, noise_key, rgb: &mut rgb });
    TactileImage { width_px: sensor.grid.width_px as u32, height_px: sensor.grid.height_px as u32, rgb }
}

struct Finish<'a> {
    sensor: &'a Sensor,
    change: Option<&'a [Plane; 3]>,
    noise_key: Option<u64>,
    rgb: &'a mut [u8],
}

impl Kernel for Finish<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let w = self.sensor.grid.width_px;
        let noise = self.noise_key.map(|key| (levels(), words(key)));
        let (mut hash, mut noise_row) = (vec![0u32; w], vec![0.0f32; w]);
        let mut bytes = [0, 1, 2].map(|_| vec![0u8; w]);
        for (y, rgb) in self.rgb.chunks_exact_mut(3 * w).enumerate() {
            let row = y * w..(y + 1) * w;
            for channel in 0..3 {
                let rest = &self.sensor.rest[channel][row.clone()];
                let change = self.change.map(|planes| &planes[channel].values[row.clone()]);
                let sigma = self.sensor.noise_rgb[channel];
                if let Some((table, words)) = noise.filter(|_| sigma > 0.0) {
                    let first = (3 * y * w + channel) as u32;
                    for (i, h) in hash.iter_mut().enumerate() {
                        *h = level_of(words, first.wrapping_add(3 * i as u32));
                    }
                    for (n, &h) in noise_row.iter_mut().zip(&hash) {
                        *n = table[h as usize % LEVELS];
                    }
                }
                // Without noise the row holds zeros.
                write_row(&mut bytes[channel], rest, change, sigma, &noise_row);
            }
            let [red, green, blue] = &bytes;
            for (i, pixel) in rgb.chunks_exact_mut(3).enumerate() {
                pixel.copy_from_slice(&[red[i], green[i], blue[i]]);
            }
        }
    }
}

/// `rest + change + sigma noise`, rounded.
#[inline(always)]
fn write_row(bytes: &mut [u8], rest: &[f32], change: Option<&[f32]>, sigma: f32, noise: &[f32]) {
    let n = bytes.len();
    let (rest, noise) = (&rest[..n], &noise[..n]);
    match change.map(|change| &change[..n]) {
        Some(change) => {
            for i in 0..n {
                bytes[i] = rounded(rest[i] + change[i] + sigma * noise[i]);
            }
        }
        None => {
            for i in 0..n {
                bytes[i] = rounded(rest[i] + sigma * noise[i]);
            }
        }
    }
}

/// To the nearest of 0 to 255; 0 for what is not a number.
#[inline(always)]
fn rounded(value: f32) -> u8 {
    let value = if value > 0.0 { value } else { 0.0 };
    let value = if value < 255.0 { value } else { 255.0 };
    // SAFETY: from 0.5 to 255.5.
    unsafe { (value + 0.5).to_int_unchecked::<i32>() as u8 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(table: &[f32; LEVELS], words: [u32; 2], index: u32) -> f32 {
        table[level_of(words, index) as usize]
    }

    #[test]
    fn noise_is_standard_normal_and_uncorrelated() {
        let table = levels();
        let n = 300_000u32;
        let z: Vec<f64> = (0..n).map(|i| f64::from(normal(table, words(99 << 32 | 17), i))).collect();
        let count = f64::from(n);
        let mean = z.iter().sum::<f64>() / count;
        let variance = z.iter().map(|x| x * x).sum::<f64>() / count;
        let fourth = z.iter().map(|x| x.powi(4)).sum::<f64>() / count;
        assert!(mean.abs() < 4.0 / count.sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / count).sqrt(), "variance {variance}");
        assert!((fourth - 3.0).abs() < 0.1, "kurtosis {fourth}");
        // Neighbours: the next channel, the next pixel, the next row of a 320 pixel wide image.
        for lag in [1, 3, 960] {
            let r = z.iter().zip(&z[lag..]).map(|(a, b)| a * b).sum::<f64>() / count;
            assert!(r.abs() < 4.0 / count.sqrt(), "lag {lag}: {r}");
        }
        for key in [99 << 32 | 18, 100 << 32 | 17, 98 << 32 | 18] {
            let other: Vec<f64> = (0..n).map(|i| f64::from(normal(table, words(key), i))).collect();
            for lag in [0, 1] {
                let r = z[lag..].iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / count;
                assert!(r.abs() < 4.0 / count.sqrt(), "key {key:x}, lag {lag}: {r}");
            }
        }
    }

    #[test]
    fn rounding_is_to_the_nearest_level() {
        for (value, level) in [(-3.0, 0), (0.49, 0), (0.5, 1), (127.4, 127), (254.6, 255), (400.0, 255)] {
            assert_eq!(rounded(value), level);
        }
    }
}
