//! The noise of a tactile image's pixels: what is added to a frame of 8 bits, as a function of a key.
//!
//! A clean frame is rounded to 8 bits; noise is added to that, the sum is rounded and clamped. So a frame that is stored without
//! its noise gives the same bytes when the noise is added later, by whoever reads it. Rounding twice adds 1/12 of a level squared
//! to the variance.
//!
//! Value `i` of an image (row by row, pixel by pixel, red, green, blue) gets `sd z`, with `z` from the sum of four random bytes of an
//! integer hash of (key, i): neither order nor threads matter.

use crate::Jaw;
use crate::random::{Purpose, Stream};
use std::sync::OnceLock;

/// Values that the noise takes: one for each sum of four bytes.
const LEVELS: usize = 4 * 255 + 1;

/// Standard deviation of the sum of four bytes: sqrt(4 (256^2 - 1) / 12).
const SUM_DEVIATION: f32 = 147.800_54;

/// Coefficients of x, x^3, x^5 and x^7 that make the scaled sum x of four bytes normal: least squares against the
/// quantiles of the normal distribution, weighted by how likely each sum is, scaled to variance 1. Moments 4, 6 and 8
/// are 2.9995, 14.97 and 103.9 instead of 3, 15 and 105; the largest value is 4.85.
const TO_NORMAL: [f32; 4] = [0.958_845_2, 0.016_671_193, -0.002_032_010_7, 0.000_317_702_5];

/// The value of a sum of four bytes.
#[inline(always)]
pub fn normal_of_sum(sum: u32) -> f32 {
    let x = (sum as i32 - 510) as f32 * (1.0 / SUM_DEVIATION);
    let square = x * x;
    let [a, b, c, d] = TO_NORMAL;
    x * square.mul_add(square.mul_add(square.mul_add(d, c), b), a)
}

/// The values of all sums of four bytes.
pub fn levels() -> &'static [f32; LEVELS] {
    static TABLE: OnceLock<[f32; LEVELS]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|sum| normal_of_sum(sum as u32)))
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
pub fn words(key: u64) -> [u32; 2] {
    let (low, high) = (key as u32, (key >> 32) as u32);
    let first = mix(low ^ mix(high));
    [first, mix(high ^ mix(low.wrapping_add(first)))]
}

/// The sum of four random bytes of value `index` of an image: those of an integer hash of (key, index), so it depends
/// neither on order nor on threads.
#[inline(always)]
pub fn sum_of(words: [u32; 2], index: u32) -> u32 {
    let hash = mix(mix(index ^ words[0]).wrapping_add(words[1]));
    let pairs = (hash & 0x00ff_00ff) + ((hash >> 8) & 0x00ff_00ff);
    (pairs & 0xffff) + (pairs >> 16)
}

/// To the nearest of 0 to 255; 0 for what is not a number.
#[inline(always)]
pub fn rounded(value: f32) -> u8 {
    let value = if value > 0.0 { value } else { 0.0 };
    let value = if value < 255.0 { value } else { 255.0 };
    (value + 0.5) as u8
}

/// The noise of one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelNoise {
    /// What its random numbers are made of.
    pub key: u64,
    /// Standard deviation of each channel, in levels of 0 to 255.
    pub sd_rgb: [f32; 3],
}

impl PixelNoise {
    /// The key of a sample's image.
    pub fn key_of(seed: u64, index: u64, jaw: Jaw) -> u64 {
        let purpose = match jaw {
            Jaw::Left => Purpose::ImageNoiseLeft,
            Jaw::Right => Purpose::ImageNoiseRight,
        };
        Stream::new(seed, index, purpose).bits()
    }

    /// Other noise of the same size: that of a pass over the data, the same for the same number.
    #[must_use]
    pub fn drawn_again(self, pass: u64) -> Self {
        Self { key: Stream::new(self.key, pass, Purpose::ImageNoiseAgain).bits(), ..self }
    }

    /// Adds it to a frame without noise: `[height, width, 3]` bytes.
    pub fn add(&self, rgb: &mut [u8]) {
        let (words, levels) = (words(self.key), levels());
        for (pixel, values) in rgb.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            for (channel, value) in values.iter_mut().enumerate() {
                let sd = self.sd_rgb[channel];
                if sd > 0.0 {
                    let noise = levels[sum_of(words, (3 * pixel + channel) as u32) as usize];
                    *value = rounded(f32::from(*value) + sd * noise);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(table: &[f32; LEVELS], words: [u32; 2], index: u32) -> f32 {
        table[sum_of(words, index) as usize]
    }

    /// The moments of the distribution itself: how often each sum of four bytes appears is counted.
    #[test]
    fn the_values_of_the_noise_have_the_moments_of_the_normal_distribution() {
        let mut counts = vec![1.0f64];
        for _ in 0..4 {
            let mut more = vec![0.0; counts.len() + 255];
            for (i, count) in counts.iter().enumerate() {
                more[i..i + 256].iter_mut().for_each(|m| *m += count / 256.0);
            }
            counts = more;
        }
        assert_eq!(counts.len(), LEVELS);
        let moment = |power| {
            let of = |(z, share): (&f32, &f64)| share * f64::from(*z).powi(power);
            levels().iter().zip(&counts).map(of).sum::<f64>()
        };
        for (power, exact, tolerance) in
            [(0, 1.0, 1e-9), (1, 0.0, 1e-9), (2, 1.0, 1e-5), (3, 0.0, 1e-9), (4, 3.0, 2e-3), (6, 15.0, 0.05)]
        {
            assert!((moment(power) - exact).abs() < tolerance, "{power}: {}", moment(power));
        }
        assert!(levels().is_sorted_by(|a, b| a < b));
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

    /// The variance of a noisy frame is that of the noise and of rounding, which is the same whether the frame was rounded before or not.
    #[test]
    fn rounding_adds_a_twelfth_to_the_variance() {
        let noise = PixelNoise { key: 77, sd_rgb: [0.0, 1.5, 4.0] };
        let mut rgb = vec![100_u8; 3 * 200_000];
        noise.add(&mut rgb);
        for (channel, sd) in noise.sd_rgb.into_iter().enumerate() {
            let values = || rgb.iter().skip(channel).step_by(3).map(|&v| f64::from(v) - 100.0);
            let variance = values().map(|v| v * v).sum::<f64>() / 200_000.0;
            let wanted = if sd == 0.0 { 0.0 } else { f64::from(sd * sd) + 1.0 / 12.0 };
            assert!((variance - wanted).abs() < 0.02 * wanted + 1e-12, "{variance}, {wanted}");
        }
        assert_ne!(noise.drawn_again(0).key, noise.drawn_again(1).key);
        assert_eq!(noise.drawn_again(3), noise.drawn_again(3));
    }
}
