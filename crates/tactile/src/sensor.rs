//! A tactile sensor: its pixels, its frame at rest, its colours and its noise.

use crate::colour::{ColourModel, Lambert, TaximTable};
use crate::grid::Grid;
use crate::npz::{Array, ElementType, Npz, NpzError, write_npz};
use gripgen_twin::TactileImage;

/// Version of the sensor file format, stored under the key `gripgen_sensor`.
pub const SENSOR_VERSION: f64 = 1.0;

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
}

/// Why a sensor file could not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// The archive or one of its arrays.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// Made by a later gripgen.
    #[error("the sensor file has version {found}, this gripgen reads version {SENSOR_VERSION}")]
    Version {
        /// Version in the file.
        found: f64,
    },
    /// An archive with neither set of keys.
    #[error(
        "neither a gripgen sensor (key `gripgen_sensor`) nor a Taxim calibration (key `grad_r`); found: {present}"
    )]
    Unknown {
        /// Keys found.
        present: String,
    },
    /// A Taxim calibration lacks what its file does not hold.
    #[error("a Taxim calibration holds no {missing}")]
    Incomplete {
        /// `background` or `mm_per_px`.
        missing: &'static str,
    },
    /// The background has not the size of the rest frame that it replaces.
    #[error("the background is {found:?} pixels, the sensor's rest frame {wanted:?}")]
    BackgroundSize {
        /// Width and height of the background.
        found: (usize, usize),
        /// Width and height of the rest frame.
        wanted: (usize, usize),
    },
    /// A colour model with an infinite or undefined coefficient.
    #[error("`{key}` holds a number that is not finite")]
    NotFinite {
        /// Key in the file.
        key: &'static str,
    },
    /// A value is out of range.
    #[error("`{key}` is {value}, it must be {range}")]
    Value {
        /// Key in the file.
        key: &'static str,
        /// Value found.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
}

impl Sensor {
    /// Reads a sensor file: gripgen's own, or Taxim's `polycalib.npz`.
    ///
    /// `metres_per_px` replaces the file's pixel size, `background` is the frame without contact; a Taxim
    /// calibration needs both, since it holds neither.
    pub fn from_npz(
        bytes: &[u8],
        metres_per_px: Option<f64>,
        background: Option<&TactileImage>,
    ) -> Result<Self, SensorError> {
        let mut npz = Npz::open(bytes)?;
        if npz.has("gripgen_sensor") {
            return Self::own(&mut npz, metres_per_px, background);
        }
        if npz.has("grad_r") {
            return Self::taxim(&mut npz, metres_per_px, background);
        }
        Err(SensorError::Unknown { present: npz.keys().join(", ") })
    }

    fn own(
        npz: &mut Npz<'_>,
        metres_per_px: Option<f64>,
        background: Option<&TactileImage>,
    ) -> Result<Self, SensorError> {
        let version = npz.array_of_shape("gripgen_sensor", &[])?.values[0];
        if version != SENSOR_VERSION {
            return Err(SensorError::Version { found: version });
        }
        let rest = npz.array_of_shape("rest_rgb", &[None, None, Some(3)])?;
        let (height_px, width_px) = (rest.shape[0], rest.shape[1]);
        let mm_per_px = npz.array_of_shape("mm_per_px", &[])?.values[0];
        let noise = npz.array_of_shape("noise_rgb", &[Some(3)])?.values;
        let lambert = npz.array_of_shape("lambert", &[Some(3), Some(3), Some(6)])?;
        let grid = Grid { width_px, height_px, metres_per_px: metres_per_px.unwrap_or(mm_per_px * 1e-3) };
        let sensor = Self {
            grid,
            rest: background.map_or_else(|| planes(&rest.values), planes_of_image),
            noise_rgb: [noise[0] as f32, noise[1] as f32, noise[2] as f32],
            colour: ColourModel::Lambert(Box::new(Lambert::new(&lambert.values))),
        };
        sensor.checked(background)
    }

    fn taxim(
        npz: &mut Npz<'_>,
        metres_per_px: Option<f64>,
        background: Option<&TactileImage>,
    ) -> Result<Self, SensorError> {
        let background = background.ok_or(SensorError::Incomplete { missing: "background" })?;
        let metres_per_px = metres_per_px.ok_or(SensorError::Incomplete { missing: "mm_per_px" })?;
        let table = TaximTable::read(npz)?;
        let sensor = Self {
            grid: Grid {
                width_px: background.width_px as usize,
                height_px: background.height_px as usize,
                metres_per_px,
            },
            rest: planes_of_image(background),
            noise_rgb: [0.0; 3],
            colour: ColourModel::Taxim(Box::new(table)),
        };
        sensor.checked(Some(background))
    }

    fn checked(self, background: Option<&TactileImage>) -> Result<Self, SensorError> {
        let mm = self.grid.metres_per_px * 1e3;
        if !(mm.is_finite() && (1e-4..=1.0).contains(&mm)) {
            return Err(SensorError::Value { key: "mm_per_px", value: mm, range: "from 0.0001 to 1" });
        }
        for (key, n) in [("width", self.grid.width_px), ("height", self.grid.height_px)] {
            if !(16..=4096).contains(&n) {
                return Err(SensorError::Value { key, value: n as f64, range: "from 16 to 4096 pixels" });
            }
        }
        if let Some(image) = background {
            let (w, h) = (image.width_px as usize, image.height_px as usize);
            let wanted = (self.grid.width_px, self.grid.height_px);
            if (w, h) != wanted {
                return Err(SensorError::BackgroundSize { found: (w, h), wanted });
            }
        }
        match &self.colour {
            ColourModel::Lambert(lambert) if !lambert.is_finite() => {
                return Err(SensorError::NotFinite { key: "lambert" });
            }
            ColourModel::Taxim(table) if !table.is_finite() => {
                return Err(SensorError::NotFinite { key: "grad_r, grad_g, grad_b" });
            }
            _ => {}
        }
        if let Some(&sigma) = self.noise_rgb.iter().find(|s| !(0.0..=64.0).contains(*s)) {
            let value = f64::from(sigma);
            return Err(SensorError::Value { key: "noise_rgb", value, range: "from 0 to 64 grey levels" });
        }
        let bad = self.rest.iter().flatten().find(|v| !(0.0..=255.0).contains(*v));
        if let Some(&value) = bad {
            let range = "from 0 to 255 grey levels";
            return Err(SensorError::Value { key: "rest_rgb", value: f64::from(value), range });
        }
        Ok(self)
    }

    /// The bytes of a sensor file; only for sensors with gripgen's own colour model.
    ///
    /// The rest frame is stored in whole grey levels.
    pub fn to_npz(&self) -> Option<Result<Vec<u8>, NpzError>> {
        let ColourModel::Lambert(lambert) = &self.colour else { return None };
        let scalar = |x: f64| Array { shape: vec![], values: vec![x] };
        let rest = (0..self.grid.len()).flat_map(|i| [0, 1, 2].map(|c| f64::from(self.rest[c][i]))).collect();
        let shape = vec![self.grid.height_px, self.grid.width_px, 3];
        let noise = self.noise_rgb.iter().map(|&x| f64::from(x)).collect();
        Some(write_npz(&[
            ("gripgen_sensor", scalar(SENSOR_VERSION), ElementType::F64),
            ("mm_per_px", scalar(self.grid.metres_per_px * 1e3), ElementType::F64),
            ("rest_rgb", Array { shape, values: rest }, ElementType::U8),
            ("noise_rgb", Array { shape: vec![3], values: noise }, ElementType::F64),
            ("lambert", Array { shape: vec![3, 3, 6], values: lambert.coefficients() }, ElementType::F64),
        ]))
    }
}

fn planes(interleaved: &[f64]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| interleaved.iter().skip(c).step_by(3).map(|&x| x as f32).collect())
}

fn planes_of_image(image: &TactileImage) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| image.rgb.iter().skip(c).step_by(3).map(|&x| f32::from(x)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_background_of_another_size_is_refused_with_both_sizes() {
        let good = sensor(|_, _| {}).unwrap();
        let bytes = good.to_npz().unwrap().unwrap();
        let image = TactileImage { width_px: 20, height_px: 17, rgb: vec![80; 20 * 17 * 3] };
        let error = Sensor::from_npz(&bytes, None, Some(&image)).unwrap_err().to_string();
        assert_eq!(error, "the background is (20, 17) pixels, the sensor's rest frame (20, 16)");
    }
}
