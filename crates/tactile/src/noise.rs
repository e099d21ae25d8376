//! Stage `noise`: sensor noise, and rounding to 8 bits.

use crate::grid::Plane;
use crate::sensor::Sensor;
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::TactileImage;
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
fn normal_of_sum(sum: u32) -> f32 {
    let x = (sum as i32 - 510) as f32 * (1.0 / SUM_DEVIATION);
    let square = x * x;
    let [a, b, c, d] = TO_NORMAL;
    x * square.mul_add(square.mul_add(square.mul_add(d, c), b), a)
}

/// The values of all sums of four bytes, for the twin on a graphics processor.
pub(crate) fn levels() -> &'static [f32; LEVELS] {
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
fn words(key: u64) -> [u32; 2] {
    let (low, high) = (key as u32, (key >> 32) as u32);
    let first = mix(low ^ mix(high));
    [first, mix(high ^ mix(low.wrapping_add(first)))]
}

/// The sum of four random bytes of value `index` of an image: those of an integer hash of (key, index), so it depends
/// neither on order nor on threads.
#[inline(always)]
fn sum_of(words: [u32; 2], index: u32) -> u32 {
    let hash = mix(mix(index ^ words[0]).wrapping_add(words[1]));
    let pairs = (hash & 0x00ff_00ff) + ((hash >> 8) & 0x00ff_00ff);
    (pairs & 0xffff) + (pairs >> 16)
}

/// Adds the change of colour to the rest frame, and noise where there is a key, and rounds to 8 bits.
pub fn finish(sensor: &Sensor, change: Option<&[Plane; 3]>, noise_key: Option<u64>) -> TactileImage {
    finish_on(sensor, change, noise_key, SimdLevel::best())
}

/// [`finish`] on a vector unit.
pub(crate) fn finish_on(
    sensor: &Sensor,
    change: Option<&[Plane; 3]>,
    noise_key: Option<u64>,
    level: SimdLevel,
) -> TactileImage {
    let mut rgb = vec![0u8; 3 * sensor.grid.len()];
    level.run(Finish { sensor, change, noise_key, rgb: &mut rgb });
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
        let words = self.noise_key.map(words);
        let mut noise_row = vec![0.0f32; w];
        let mut bytes = [0, 1, 2].map(|_| vec![0u8; w]);
        for (y, rgb) in self.rgb.chunks_exact_mut(3 * w).enumerate() {
            let row = y * w..(y + 1) * w;
            for channel in 0..3 {
                let rest = &self.sensor.rest[channel][row.clone()];
                let change = self.change.map(|planes| &planes[channel].values[row.clone()]);
                let sigma = self.sensor.noise_rgb[channel];
                if let Some(words) = words.filter(|_| sigma > 0.0) {
                    let first = (3 * y * w + channel) as u32;
                    for (i, noise) in noise_row.iter_mut().enumerate() {
                        *noise = normal_of_sum(sum_of(words, first.wrapping_add(3 * i as u32)));
                    }
                }
                // Without noise the row holds zeros.
                write_row(&mut bytes[channel], rest, change, sigma, &noise_row);
            }
            let [red, green, blue] = &bytes;
            for (pixel, ((r, g), b)) in
                rgb.as_chunks_mut::<3>().0.iter_mut().zip(red.iter().zip(green).zip(blue))
            {
                *pixel = [*r, *g, *b];
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
    fn vector_units_give_the_same_image() {
        let grid = crate::grid::Grid { width_px: 53, height_px: 7, metres_per_px: 1e-4 };
        let light = crate::colour::Lambert::from_lights(&[]);
        let sensor = Sensor {
            grid,
            rest: [90.3, 120.5, 250.0].map(|level| vec![level; grid.len()]),
            noise_rgb: [1.5, 0.0, 4.0],
            colour: crate::colour::ColourModel::Lambert(Box::new(light)),
            gel_shape: crate::sensor::GelShape::Flat,
            markers: None,
            shadow: None,
            pyramid: None,
            ball_m: None,
            press_gain_sd: None,
        };
        let change = [0, 1, 2].map(|c| Plane::filled(53, 7, 0.3 + c as f32));
        for key in [None, Some(5)] {
            let portable = finish_on(&sensor, Some(&change), key, SimdLevel::Portable);
            for level in SimdLevel::available() {
                assert_eq!(finish_on(&sensor, Some(&change), key, level), portable, "{level:?}");
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
