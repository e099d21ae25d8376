//! Taxim's `dataPack.npz`.
//!
//! | key | shape | what |
//! |---|---|---|
//! | `imgs` | (N, H, W, 3), grey levels | the presses, blue first |
//! | `touch_center` | (N, 2), optional | centre of each contact (x, y) in pixels |
//! | `touch_radius` | (N,), optional | its radius in pixels |
//! | `f0` | (H, W, 3), grey levels, optional | a frame without contact, blue first |
//!
//! Centres and radii may be numbers of any type, NaN or a radius of 0 stand for "not known". `names` is not read:
//! it is text or a pickle.

use super::{Circle, Press, PressSet};
use crate::npz::{Npz, NpzError};
use gripgen_twin::TactileImage;

/// Diameter of the ball of Taxim's own data.
pub const DATA_PACK_BALL_M: f64 = 4.0e-3;

/// Side of a pixel of Taxim's own data.
pub const DATA_PACK_METRES_PER_PX: f64 = 0.0295e-3;

/// Why a `dataPack.npz` could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DataPackError {
    /// The archive or one of its arrays.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// Arrays that do not fit together.
    #[error("`{key}` has shape {found:?}, `imgs` has {images:?}")]
    Shape {
        /// The array.
        key: &'static str,
        /// Its shape.
        found: Vec<usize>,
        /// Shape of `imgs`.
        images: Vec<usize>,
    },
}

impl PressSet {
    /// Reads the bytes of a `dataPack.npz`. The file says neither what ball was used nor how large a pixel is.
    ///
    /// # Errors
    ///
    /// No archive, a missing array, or arrays whose shapes do not go together.
    pub fn from_data_pack(bytes: &[u8], ball_m: f64, metres_per_px: f64) -> Result<Self, DataPackError> {
        let mut npz = Npz::open(bytes)?;
        let (shape, mut images) = pixels(&mut npz, "imgs")?;
        let &[count, height, width, 3] = &shape[..] else {
            let problem = format!("its shape is {shape:?}, it must be (any, any, any, 3)");
            return Err(NpzError::Array { key: "imgs".into(), problem }.into());
        };
        let fits = |key: &'static str, found: &[usize], wanted: &[usize]| {
            let [_, columns @ ..] = wanted else { return Ok(()) };
            // A column of numbers is a list too.
            if found == wanted || (columns.is_empty() && found == [wanted[0], 1]) {
                return Ok(());
            }
            Err(DataPackError::Shape { key, found: found.to_vec(), images: vec![count, height, width, 3] })
        };
        let mut numbers = |key: &'static str, wanted: &[usize]| -> Result<Option<Vec<f64>>, DataPackError> {
            if !npz.has(key) {
                return Ok(None);
            }
            let array = npz.array(key)?;
            fits(key, &array.shape, wanted)?;
            Ok(Some(array.values))
        };
        let centres = numbers("touch_center", &[count, 2])?;
        let radii = numbers("touch_radius", &[count])?;
        let rest = if npz.has("f0") {
            let (found, mut values) = pixels(&mut npz, "f0")?;
            fits("f0", &found, &[height, width, 3])?;
            red_first(&mut values);
            Some(TactileImage { width_px: width as u32, height_px: height as u32, rgb: values })
        } else {
            None
        };
        red_first(&mut images);
        let presses = images
            .chunks_exact(width.saturating_mul(height).saturating_mul(3).max(1))
            .enumerate()
            .map(|(i, rgb)| {
                let image =
                    TactileImage { width_px: width as u32, height_px: height as u32, rgb: rgb.to_vec() };
                Press::of_ball(i.to_string(), image, circle(i, centres.as_deref(), radii.as_deref()))
            })
            .collect();
        Ok(Self { metres_per_px, ball_m, rest, presses })
    }
}

fn circle(i: usize, centres: Option<&[f64]>, radii: Option<&[f64]>) -> Option<Circle> {
    let (centres, radius_px) = (centres?, radii?[i]);
    let (x_px, y_px) = (centres[2 * i], centres[2 * i + 1]);
    let known = [x_px, y_px, radius_px].iter().all(|v| v.is_finite()) && radius_px > 0.0;
    known.then_some(Circle { x_px, y_px, radius_px })
}

/// Grey levels of an array: bytes as they stand, other numbers where they are from 0 to 255.
fn pixels(npz: &mut Npz<'_>, key: &str) -> Result<(Vec<usize>, Vec<u8>), NpzError> {
    if let Ok(bytes) = npz.bytes(key) {
        return Ok(bytes);
    }
    let array = npz.array(key)?;
    // An averaged frame is rounded; numbers from 0 to 1 are no grey levels.
    let largest = array.values.iter().fold(0.0f64, |m, &v| m.max(v));
    let level = |&v: &f64| (largest > 1.0 && (0.0..=255.0).contains(&v)).then(|| v.round() as u8);
    match array.values.iter().map(level).collect() {
        Some(levels) => Ok((array.shape, levels)),
        None => {
            let problem = format!("it holds numbers up to {largest}, they must be grey levels from 0 to 255");
            Err(NpzError::Array { key: key.into(), problem })
        }
    }
}

fn red_first(bgr: &mut [u8]) {
    bgr.chunks_exact_mut(3).for_each(|pixel| pixel.swap(0, 2));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::{Array, ElementType, write_npz};

    type Entry = (&'static str, Array, ElementType);

    fn entry(key: &'static str, shape: &[usize], value: impl Fn(usize) -> f64, kind: ElementType) -> Entry {
        let values = (0..shape.iter().product()).map(value).collect();
        (key, Array { shape: shape.to_vec(), values }, kind)
    }

    fn images() -> Entry {
        entry("imgs", &[2, 4, 5, 3], |i| i as f64, ElementType::U8)
    }

    fn read(entries: &[Entry]) -> Result<PressSet, DataPackError> {
        PressSet::from_data_pack(&write_npz(entries).unwrap(), 4e-3, 1e-4)
    }

    #[test]
    fn blue_comes_first_in_the_file_and_last_here() {
        let centres = entry("touch_center", &[2, 2], |i| 1.5 * i as f64, ElementType::F64);
        let radii = entry("touch_radius", &[2], |i| 3.0 * i as f64, ElementType::U8);
        let rest = entry("f0", &[4, 5, 3], |i| 100.0 + i as f64, ElementType::U8);
        let set = read(&[images(), centres, radii, rest]).unwrap();
        assert_eq!(set.presses.len(), 2);
        assert_eq!(set.presses[1].image.pixel(0, 0), [62, 61, 60]);
        assert_eq!(set.rest.unwrap().pixel(1, 0), [105, 104, 103]);
        assert_eq!(set.presses[0].circle, None, "a radius of 0 is none");
        assert_eq!(set.presses[1].circle, Some(Circle { x_px: 3.0, y_px: 4.5, radius_px: 3.0 }));
    }

    #[test]
    fn only_the_images_are_needed() {
        let set = read(&[images()]).unwrap();
        assert!(set.rest.is_none() && set.presses.iter().all(|p| p.circle.is_none()));
    }

    #[test]
    fn arrays_that_do_not_fit_are_named() {
        let centres = entry("touch_center", &[3, 2], |i| i as f64, ElementType::F64);
        let error = read(&[images(), centres]).unwrap_err().to_string();
        assert_eq!(error, "`touch_center` has shape [3, 2], `imgs` has [2, 4, 5, 3]");
        let grey = entry("imgs", &[2, 4, 5], |i| i as f64, ElementType::U8);
        assert!(read(&[grey]).unwrap_err().to_string().contains("(any, any, any, 3)"));
        let wide = |scale: f64| entry("imgs", &[2, 4, 5, 3], move |i| scale * i as f64, ElementType::F64);
        assert_eq!(read(&[wide(1.0)]), read(&[images()]), "whole grey levels may be numbers of any type");
        assert!(
            read(&[wide(1.0 / 119.0)]).unwrap_err().to_string().contains("must be grey levels from 0 to 255")
        );
        assert!(read(&[]).unwrap_err().to_string().contains("no array `imgs`"));
    }
}
