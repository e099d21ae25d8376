//! Stage `noise`: sensor noise, and rounding to 8 bits.

use crate::grid::Plane;
use crate::sensor::Sensor;
use gripgen_twin::TactileImage;
use gripgen_twin::random::normal_quantile;
use std::sync::OnceLock;

/// Number of levels of the noise; a power of two.
const LEVELS: usize = 4096;

/// Standard normal values, equally likely: the quantiles of the middle of each level, scaled to variance 1.
fn levels() -> &'static [f32; LEVELS] {
    static TABLE: OnceLock<[f32; LEVELS]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let raw: Vec<f64> = (0..LEVELS).map(|i| normal_quantile((i as f64 + 0.5) / LEVELS as f64)).collect();
        let variance = raw.iter().map(|z| z * z).sum::<f64>() / LEVELS as f64;
        std::array::from_fn(|i| (raw[i] / variance.sqrt()) as f32)
    })
}

/// The finaliser of MurmurHash3 (Appleby, public domain): every bit of the input reaches every bit of the output.
#[inline]
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

/// A standard normal number for value `index` of an image: an integer hash of (key, index) chooses a level, so it
/// depends neither on order nor on threads.
#[inline]
fn normal(table: &[f32; LEVELS], words: [u32; 2], index: u32) -> f32 {
    let hash = mix(mix(index ^ words[0]).wrapping_add(words[1]));
    table[(hash >> 20) as usize]
}

/// Adds the change of colour to the rest frame, and noise where there is a key, and rounds to 8 bits.
pub fn finish(sensor: &Sensor, change: Option<&[Plane; 3]>, noise_key: Option<u64>) -> TactileImage {
    let mut rgb = vec![0u8; 3 * sensor.grid.len()];
    for channel in 0..3 {
        let rest = &sensor.rest[channel];
        let change = change.map(|planes| &planes[channel].values);
        let noise = noise_key
            .filter(|_| sensor.noise_rgb[channel] > 0.0)
            .map(|key| (levels(), words(key), sensor.noise_rgb[channel]));
        for (i, out) in rgb.iter_mut().skip(channel).step_by(3).enumerate() {
            let mut value = rest[i];
            if let Some(change) = change {
                value += change[i];
            }
            if let Some((table, words, sigma)) = noise {
                value += sigma * normal(table, words, (3 * i + channel) as u32);
            }
            *out = rounded(value);
        }
    }
    TactileImage { width_px: sensor.grid.width_px as u32, height_px: sensor.grid.height_px as u32, rgb }
}

#[inline]
fn rounded(value: f32) -> u8 {
    (value.clamp(0.0, 255.0) + 0.5).floor() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

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
