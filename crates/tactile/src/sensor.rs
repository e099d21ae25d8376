//! A tactile sensor: its pixels, its frame at rest, its colours and its noise.

mod error;
mod file;
mod gel_shape;

pub(crate) use error::check_range;
pub use error::{SENSOR_VERSION, SensorError};
pub use file::SensorFiles;
pub use gel_shape::GelShape;

use crate::colour::ColourModel;
use crate::convolve::Follow;
use crate::grid::Grid;
use crate::markers::Markers;
use crate::shadow::Shadow;
use gripgen_twin::TactileImage;

/// Largest share of a press by which a gel may give way.
pub(crate) const MAX_SINK_IN: f64 = 0.9;

/// A tactile sensor, as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Its pixels.
    pub grid: Grid,
    /// The frame without contact, denoised: three planes (red, green, blue) of grey levels.
    pub rest: [Vec<f32>; 3],
    /// Standard deviation of the noise of red, green and blue, in grey levels.
    pub noise_rgb: [f32; 3],
    /// From the slope of the gel to colour.
    pub colour: ColourModel,
    /// The gel surface at rest.
    pub gel_shape: GelShape,
    /// Dots on the gel, which the rest frame shows.
    pub markers: Option<Markers>,
    /// The shadows beside a contact, where the sensor has any.
    pub shadow: Option<Box<Shadow>>,
    /// The deformation that the colours were calibrated with, where they were calibrated.
    pub pyramid: Option<Pyramid>,
    /// Diameter of the ball of the calibration, where there was one.
    pub ball_m: Option<f64>,
    /// Standard deviation of the logarithm of the gain of red, green and blue from one press to the next, where the camera of the
    /// calibration had an automatic white balance. Images are compared and fitted without it, and drawn without it.
    pub press_gain_sd: Option<[f32; 3]>,
    /// Whether it stands for a real sensor and no press of that sensor was compared with it.
    pub unverified: bool,
}

/// The blurs that stand for the deformation of the gel.
#[derive(Debug, Clone, PartialEq)]
pub struct Pyramid {
    /// Sizes of the kernels in pixels of this sensor, odd.
    pub kernels_px: Vec<u32>,
    /// Share of the press below which the gel follows the part.
    pub restore_depth_fraction: f64,
    /// Share of the press by which the gel gives way around a contact: where the rim of the contact is seen, the part's
    /// own surface lies this share of the press below the gel at rest. 0: the rim is where the part cuts the gel at rest;
    /// 0.5: an elastic half-space under a ball (Hertz: `a^2 = R d`).
    pub sink_in_fraction: f64,
    /// How the gel follows the part there. Taxim's colours know the first way alone.
    pub follow: Follow,
}

impl Sensor {
    /// A sensor with a flat gel, without markers, shadows and calibration.
    pub fn new(grid: Grid, rest: [Vec<f32>; 3], noise_rgb: [f32; 3], colour: ColourModel) -> Self {
        Self {
            grid,
            rest,
            noise_rgb,
            colour,
            gel_shape: GelShape::Flat,
            markers: None,
            shadow: None,
            pyramid: None,
            ball_m: None,
            press_gain_sd: None,
            unverified: false,
        }
    }

    fn checked(self, background: Option<&TactileImage>) -> Result<Self, SensorError> {
        let Grid { width_px, height_px, metres_per_px } = self.grid;
        check_range("mm_per_px", [metres_per_px * 1e3], 1e-4..=1.0, "from 0.0001 to 1")?;
        for (key, n) in [("width", width_px), ("height", height_px)] {
            check_range(key, [n as f64], 16.0..=4096.0, "from 16 to 4096 pixels")?;
        }
        if let Some(image) = background {
            let (w, h) = (image.width_px as usize, image.height_px as usize);
            let wanted = (width_px, height_px);
            if (w, h) != wanted {
                return Err(SensorError::BackgroundSize { found: (w, h), wanted });
            }
        }
        if let Some(key) = self.colour.unusable_arrays() {
            return Err(SensorError::NotFinite { key });
        }
        let noise = self.noise_rgb.map(f64::from);
        check_range("noise_rgb", noise, 0.0..=64.0, "from 0 to 64 grey levels")?;
        let rest = self.rest.iter().flatten().map(|&level| f64::from(level));
        check_range("rest_rgb", rest, 0.0..=255.0, "from 0 to 255 grey levels")?;
        let gains = self.press_gain_sd.into_iter().flatten().map(f64::from);
        check_range("press_gain_sd_rgb", gains, 0.0..=1.0, "from 0 to 1")?;
        self.gel_shape.check(&self.grid)?;
        check_range("ball_mm", self.ball_m.map(|d| d * 1e3), 0.1..=100.0, "from 0.1 to 100 mm")?;
        if let Some(pyramid) = &self.pyramid {
            if let Some(&k) = pyramid.kernels_px.iter().find(|&&k| k % 2 == 0 || !(3..=255).contains(&k)) {
                let range = "odd and from 3 to 255 pixels";
                return Err(SensorError::Value { key: "kernels_px", value: f64::from(k), range });
            }
            let (restored, sunk) = (pyramid.restore_depth_fraction, pyramid.sink_in_fraction);
            check_range("restore_depth_fraction", [restored], 0.0..=1.0, "from 0 to 1")?;
            check_range("sink_in_fraction", [sunk], 0.0..=MAX_SINK_IN, "from 0 to 0.9")?;
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::{Array, ElementType, write_npz};

    fn sensor(edit: impl Fn(&str, &mut Vec<f64>)) -> Result<Sensor, SensorError> {
        let array = |key: &str, shape: &[usize], value: f64| {
            let mut values = vec![value; shape.iter().product()];
            edit(key, &mut values);
            Array { shape: shape.to_vec(), values }
        };
        let bytes = write_npz(&[
            ("gripgen_sensor", array("gripgen_sensor", &[], 1.0), ElementType::F64),
            ("mm_per_px", array("mm_per_px", &[], 0.1), ElementType::F64),
            ("rest_rgb", array("rest_rgb", &[16, 20, 3], 90.0), ElementType::F64),
            ("noise_rgb", array("noise_rgb", &[3], 1.0), ElementType::F64),
            ("lambert", array("lambert", &[3, 3, 6], 2.0), ElementType::F64),
            ("ball_mm", array("ball_mm", &[], 4.0), ElementType::F64),
            ("dome_sag_mm", array("dome_sag_mm", &[], 0.5), ElementType::F64),
            ("press_gain_sd_rgb", array("press_gain_sd_rgb", &[3], 0.05), ElementType::F64),
            ("kernels_px", array("kernels_px", &[2], 21.0), ElementType::F64),
            ("restore_depth_fraction", array("restore_depth_fraction", &[], 0.4), ElementType::F64),
        ]);
        Sensor::from_npz(&bytes.unwrap(), None, None)
    }

    #[test]
    fn numbers_that_cannot_be_are_refused_by_name() {
        assert!(sensor(|_, _| {}).is_ok());
        for (key, value, part) in [
            ("gripgen_sensor", 2.0, "version 2"),
            ("mm_per_px", 0.0, "from 0.0001 to 1"),
            ("rest_rgb", 256.0, "from 0 to 255"),
            ("rest_rgb", f64::NAN, "from 0 to 255"),
            ("noise_rgb", -1.0, "from 0 to 64"),
            ("ball_mm", 0.01, "from 0.1 to 100 mm"),
            ("press_gain_sd_rgb", -0.1, "from 0 to 1"),
            ("dome_sag_mm", -1.0, "from 0 to 20 mm"),
            ("kernels_px", 70.0, "odd and from 3 to 255"),
            ("restore_depth_fraction", 1.5, "from 0 to 1"),
            ("lambert", f64::NAN, "`lambert` holds a number that is not finite"),
            ("lambert", f64::INFINITY, "not finite"),
        ] {
            let error = sensor(|k, values| {
                if k == key {
                    values[0] = value;
                }
            });
            let error = error.err().map(|e| e.to_string()).unwrap_or_default();
            assert!(error.contains(part), "{key} = {value}: `{error}`");
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let good = sensor(|_, _| {}).unwrap();
        assert_eq!(good.gel_shape, GelShape::Dome { sag_m: 0.5e-3 });
        let bytes = good.to_npz().unwrap().unwrap();
        assert_eq!(Sensor::from_npz(&bytes, None, None).unwrap(), good);
    }

    #[test]
    fn a_sensor_keeps_its_shadows() {
        use crate::shadow::{ShadowKind, ShadowTable};
        let mut good = sensor(|_, _| {}).unwrap();
        let table = ShadowTable {
            kind: ShadowKind::Darkening,
            directions_rad: (0..8).map(|i| f64::from(i) * std::f64::consts::TAU / 8.0).collect(),
            first_height_m: 0.1e-3,
            height_step_m: 0.05e-3,
            heights: 2,
            step_m: 0.04e-3,
            rays: (0..16).map(|i| [vec![-1.5; i % 5], vec![-2.0; i % 3], vec![]]).collect(),
        };
        good.shadow = Some(Box::new(Shadow::new(table.clone(), 1e-4, 20, &good.colour)));
        let bytes = good.to_npz().unwrap().unwrap();
        let read = Sensor::from_npz(&bytes, None, None).unwrap();
        let found = read.shadow.unwrap().table().clone();
        assert_eq!(found.rays, table.rays);
        assert!((found.step_m - table.step_m).abs() < 1e-12 && found.heights == 2);
        assert!((found.first_height_m - table.first_height_m).abs() < 1e-12);
    }

    #[test]
    fn a_background_of_another_size_is_refused_with_both_sizes() {
        let good = sensor(|_, _| {}).unwrap();
        let bytes = good.to_npz().unwrap().unwrap();
        let image = TactileImage { width_px: 20, height_px: 17, rgb: vec![80; 20 * 17 * 3] };
        let error = Sensor::from_npz(&bytes, None, Some(&image)).unwrap_err().to_string();
        assert_eq!(error, "the background is (20, 17) pixels, the sensor's rest frame (20, 16)");
    }
}
