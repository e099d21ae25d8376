//! Stage `noise`: sensor noise, and rounding to 8 bits.

use crate::grid::Plane;
use crate::sensor::Sensor;
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::TactileImage;
use gripgen_twin::image::pixel_noise::{normal_of_sum, sum_of, words};

/// Adds the change of colour to the rest frame and rounds to 8 bits; where there is a key, adds noise to that and rounds again
/// (`gripgen_twin::image::pixel_noise`).
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

/// `rest + change`, rounded, and that with `sigma noise`, rounded.
#[inline(always)]
fn write_row(bytes: &mut [u8], rest: &[f32], change: Option<&[f32]>, sigma: f32, noise: &[f32]) {
    let n = bytes.len();
    let (rest, noise) = (&rest[..n], &noise[..n]);
    match change.map(|change| &change[..n]) {
        Some(change) => {
            for i in 0..n {
                bytes[i] = rounded(f32::from(rounded(rest[i] + change[i])) + sigma * noise[i]);
            }
        }
        None => {
            for i in 0..n {
                bytes[i] = rounded(f32::from(rounded(rest[i])) + sigma * noise[i]);
            }
        }
    }
}

/// To the nearest of 0 to 255; 0 for what is not a number. `image::pixel_noise::rounded` in the form that vector units are fast with.
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
    use crate::testing::assert_same_on_every_unit;
    use gripgen_twin::image::pixel_noise::PixelNoise;

    #[test]
    fn vector_units_give_the_same_image() {
        let grid = crate::grid::Grid { width_px: 53, height_px: 7, metres_per_px: 1e-4 };
        let light = crate::colour::Lambert::from_lights(&[]);
        let rest = [90.3, 120.5, 250.0].map(|level| vec![level; grid.len()]);
        let colour = crate::colour::ColourModel::Lambert(Box::new(light));
        let sensor = Sensor::new(grid, rest, [1.5, 0.0, 4.0], colour);
        let change = [0, 1, 2].map(|c| Plane::filled(53, 7, 0.3 + c as f32));
        let clean = finish(&sensor, Some(&change), None);
        for key in [None, Some(5), Some(99 << 40)] {
            let run = |level| finish_on(&sensor, Some(&change), key, level);
            assert_same_on_every_unit("finish", run);
            // What is added to a stored frame is what would have been added before.
            let mut added = clean.clone();
            if let Some(key) = key {
                PixelNoise { key, sd_rgb: sensor.noise_rgb }.add(&mut added.rgb);
                assert_ne!(added, clean);
            }
            assert_eq!(added, run(SimdLevel::Portable));
        }
    }

    #[test]
    fn rounding_is_that_of_the_noise() {
        for level in -40..1400 {
            let value = level as f32 / 5.0;
            assert_eq!(rounded(value), gripgen_twin::image::pixel_noise::rounded(value), "{value}");
        }
        assert_eq!(rounded(f32::NAN), gripgen_twin::image::pixel_noise::rounded(f32::NAN));
    }
}
