//! Reading and writing sensor files.
//!
//! | key | shape | what |
//! |---|---|---|
//! | `gripgen_sensor` | scalar | version of the format |
//! | `mm_per_px` | scalar | side of a pixel on the gel |
//! | `rest_rgb` | (H, W, 3) | denoised frame without contact, grey levels |
//! | `noise_rgb` | (3,) | standard deviation of the noise of a pixel, grey levels |
//! | `lambert` | (3, 3, 6) | colours as lights: channel, component of the normal, term of the field |
//! | `regressor_near` | (3, 20, 10) | instead of `lambert`: channel, term of a displaced pixel, term of the field |
//! | `regressor_around` | (3, 40, 6) | with it: channel, feature of the surroundings, term of the field |
//! | `regressor_limits` | (42,) | with it: largest sine of the slope, height in mm, each feature |
//! | `regressor_mm_per_px` | scalar | with it: side of a pixel on the gel in the calibration |
//! | `dome_sag_mm` | scalar, optional | a domed gel: how much its corners lie below its apex |
//! | `gel_height_px` | (H, W), optional | a gel of any shape: height at rest, relative to its highest point |
//! | `kernels_px`, `restore_depth_fraction` | (K,), scalar, optional | the deformation that the colours were calibrated with |
//! | `sink_in_fraction` | scalar, optional | share of the press by which the gel gives way at the rim of a contact; 0 without it |
//! | `core_at_least` | scalar, optional | 1: in the core of a contact the gel lies at least as deep as the part; exactly as deep without it |
//! | `shadow_values`, `shadow_heights_mm`, `shadow_step_mm` | (N, H, L, 3), (2,), scalar, optional | shadows: change of grey level by direction, height of the gel beside the contact (first, step) and distance; NaN after the end of a ray |
//! | `marker_px`, `marker_radius_px`, `marker_darkness_rgb` | (N, 2), scalar, (3,), optional | dots on the gel: column and row at rest, radius, share of light that a dot takes |
//! | `ball_mm` | scalar, optional | diameter of the ball of the calibration |
//! | `unverified` | scalar, optional | 1: it stands for a real sensor, and no press of that sensor was compared with it |
//! | `press_gain_sd_rgb` | (3,), optional | how much the gain of each colour differs from press to press: standard deviation of its logarithm |

use super::{GelShape, Pyramid, SENSOR_VERSION, Sensor, SensorError};
use crate::colour::regressor::{AROUND_FIELD, NEAR, NEAR_FIELD, SURROUNDINGS};
use crate::colour::{ColourModel, Lambert, Regressor, TableReading, TaximTable};
use crate::convolve::Follow;
use crate::deform::gaussian;
use crate::grid::{Grid, levels_of};
use crate::markers::Markers;
use crate::npz::{Array, ElementType, Npz, NpzError, parse_npy, write_npz};
use crate::shadow::{Shadow, ShadowKind, ShadowTable};
use gripgen_twin::TactileImage;

/// A sensor file and what a twin may name beside it.
#[derive(Debug, Clone, Copy)]
pub struct SensorFiles<'a> {
    /// The bytes of the sensor file: gripgen's own, or Taxim's `polycalib.npz`.
    pub sensor: &'a [u8],
    /// Replaces the file's pixel size.
    pub metres_per_px: Option<f64>,
    /// The frame without contact.
    pub background: Option<&'a TactileImage>,
    /// The bytes of Taxim's gel map: an `.npy` array (H, W) of heights of the gel at rest in pixels.
    pub gel_map: Option<&'a [u8]>,
    /// The bytes of a shadow table of Taxim as plain arrays.
    pub shadow_table: Option<&'a [u8]>,
    /// How Taxim's `polycalib.npz` is read.
    pub table: TableReading,
}

impl Sensor {
    /// Reads a sensor file: gripgen's own, or Taxim's `polycalib.npz`.
    ///
    /// `metres_per_px` replaces the file's pixel size, `background` is the frame without contact; a Taxim
    /// calibration needs both, since it holds neither.
    ///
    /// # Errors
    ///
    /// As [`Self::from_files`].
    pub fn from_npz(
        bytes: &[u8],
        metres_per_px: Option<f64>,
        background: Option<&TactileImage>,
    ) -> Result<Self, SensorError> {
        let (gel_map, shadow_table) = (None, None);
        let table = TableReading::default();
        Self::from_files(&SensorFiles {
            sensor: bytes,
            metres_per_px,
            background,
            gel_map,
            shadow_table,
            table,
        })
    }

    /// Reads a sensor file and what is named beside it. A gel map and a shadow table replace those of the file.
    ///
    /// # Errors
    ///
    /// A file that is no sensor, is of another version or lacks an array; arrays of another size than the rest frame;
    /// numbers that are not finite or out of range.
    pub fn from_files(files: &SensorFiles<'_>) -> Result<Self, SensorError> {
        let mut npz = Npz::open(files.sensor)?;
        let mut sensor = if npz.has("gripgen_sensor") {
            Self::own(&mut npz, files.metres_per_px, files.background)?
        } else if npz.has("grad_r") {
            Self::taxim(&mut npz, files)?
        } else {
            return Err(SensorError::Unknown { present: npz.keys().join(", ") });
        };
        if let Some(bytes) = files.gel_map {
            sensor.gel_shape = taxim_gel_map(bytes, &sensor.grid)?;
        }
        let mut sensor = sensor.checked(files.background)?;
        let table = match files.shadow_table {
            Some(bytes) => Some(ShadowTable::from_npz(bytes).map_err(SensorError::ShadowTable)?),
            None => ShadowTable::of_sensor(&mut npz)?,
        };
        sensor.shadow = table.map(|table| {
            let grid = &sensor.grid;
            Box::new(Shadow::new(table, grid.metres_per_px, grid.width_px, &sensor.colour))
        });
        Ok(sensor)
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
        let colour = own_colour(npz)?;
        let gel_shape = gel_shape(npz, height_px, width_px)?;
        let pyramid = pyramid(npz)?;
        let ball_m = scalar(npz, "ball_mm")?.map(|mm| mm * 1e-3);
        let press_gain_sd = triple(npz, "press_gain_sd_rgb")?;
        let unverified = scalar(npz, "unverified")?.is_some_and(|one| one != 0.0);
        let grid = Grid { width_px, height_px, metres_per_px: metres_per_px.unwrap_or(mm_per_px * 1e-3) };
        let rest = background.map_or_else(|| planes(&rest.values), levels_of);
        let noise_rgb = [noise[0] as f32, noise[1] as f32, noise[2] as f32];
        let markers = Markers::read(npz)?;
        let plain = Self::new(grid, rest, noise_rgb, colour);
        Ok(Self { gel_shape, markers, pyramid, ball_m, press_gain_sd, unverified, ..plain })
    }

    fn taxim(npz: &mut Npz<'_>, files: &SensorFiles<'_>) -> Result<Self, SensorError> {
        let background = files.background.ok_or(SensorError::Incomplete { missing: "background" })?;
        let metres_per_px = files.metres_per_px.ok_or(SensorError::Incomplete { missing: "mm_per_px" })?;
        let table = TaximTable::read(npz, background, files.table)?;
        table.check_scale(files.table.width_px, background)?;
        let (width_px, height_px) = (background.width_px as usize, background.height_px as usize);
        let grid = Grid { width_px, height_px, metres_per_px };
        let colour = ColourModel::Taxim(Box::new(table));
        Ok(Self::new(grid, levels_of(background), [0.0; 3], colour))
    }

    /// The bytes of a sensor file; `None` for a colour model that is only read, Taxim's table.
    pub fn to_npz(&self) -> Option<Result<Vec<u8>, NpzError>> {
        let mut colour = colour_arrays(&self.colour)?;
        let scalar = |x: f64| Array { shape: vec![], values: vec![x] };
        let list = |values: Vec<f64>| Array { shape: vec![values.len()], values };
        let (rows, columns) = (self.grid.height_px, self.grid.width_px);
        let rest: Vec<f64> =
            (0..self.grid.len()).flat_map(|i| [0, 1, 2].map(|c| f64::from(self.rest[c][i]))).collect();
        // Whole grey levels take a quarter of the space.
        let whole = rest.iter().all(|x| x.fract() == 0.0);
        let rest_type = if whole { ElementType::U8 } else { ElementType::F32 };
        let noise = self.noise_rgb.iter().map(|&x| f64::from(x)).collect();
        let mut arrays = vec![
            ("gripgen_sensor", scalar(SENSOR_VERSION), ElementType::F64),
            ("mm_per_px", scalar(self.grid.metres_per_px * 1e3), ElementType::F64),
            ("rest_rgb", Array { shape: vec![rows, columns, 3], values: rest }, rest_type),
            ("noise_rgb", list(noise), ElementType::F64),
        ];
        arrays.append(&mut colour);
        match &self.gel_shape {
            GelShape::Flat => {}
            GelShape::Dome { sag_m } => arrays.push(("dome_sag_mm", scalar(sag_m * 1e3), ElementType::F64)),
            GelShape::Map(heights_px) => {
                let values = heights_px.iter().map(|&h| f64::from(h)).collect();
                arrays.push((
                    "gel_height_px",
                    Array { shape: vec![rows, columns], values },
                    ElementType::F32,
                ));
            }
        }
        if let Some(pyramid) = &self.pyramid {
            let kernels = pyramid.kernels_px.iter().map(|&k| f64::from(k)).collect();
            arrays.push(("kernels_px", list(kernels), ElementType::F64));
            let share = pyramid.restore_depth_fraction;
            arrays.push(("restore_depth_fraction", scalar(share), ElementType::F64));
            if pyramid.follow == Follow::AtLeast {
                arrays.push(("core_at_least", scalar(1.0), ElementType::F64));
            }
            if pyramid.sink_in_fraction > 0.0 {
                arrays.push(("sink_in_fraction", scalar(pyramid.sink_in_fraction), ElementType::F64));
            }
        }
        if let Some(shadow) = self.shadow.as_ref().filter(|s| s.table().kind == ShadowKind::Darkening) {
            arrays.extend(shadow.table().arrays());
        }
        arrays.extend(self.markers.iter().flat_map(Markers::arrays));
        if let Some(ball_m) = self.ball_m {
            arrays.push(("ball_mm", scalar(ball_m * 1e3), ElementType::F64));
        }
        if let Some(sd) = self.press_gain_sd {
            arrays.push(("press_gain_sd_rgb", list(sd.map(f64::from).to_vec()), ElementType::F64));
        }
        if self.unverified {
            arrays.push(("unverified", scalar(1.0), ElementType::F64));
        }
        Some(write_npz(&arrays))
    }
}

/// The arrays of a colour model; `None` for Taxim's.
fn colour_arrays(colour: &ColourModel) -> Option<Vec<(&'static str, Array, ElementType)>> {
    let array = |shape: &[usize], values: &[f32]| Array {
        shape: shape.to_vec(),
        values: values.iter().map(|&x| f64::from(x)).collect(),
    };
    match colour {
        ColourModel::Taxim(_) => None,
        ColourModel::Lambert(lambert) => {
            let lambert = Array { shape: vec![3, 3, 6], values: lambert.coefficients() };
            Some(vec![("lambert", lambert, ElementType::F64)])
        }
        ColourModel::Regressor(model) => {
            let mut limits = vec![model.slope_limit, model.height_limit_mm];
            limits.extend(&model.around_limit);
            let mm = Array { shape: vec![], values: vec![model.mm_per_px] };
            Some(vec![
                ("regressor_near", array(&[3, NEAR, NEAR_FIELD], &model.near), ElementType::F32),
                (
                    "regressor_around",
                    array(&[3, SURROUNDINGS, AROUND_FIELD], &model.around),
                    ElementType::F32,
                ),
                ("regressor_limits", array(&[2 + SURROUNDINGS], &limits), ElementType::F32),
                ("regressor_mm_per_px", mm, ElementType::F64),
            ])
        }
    }
}

/// gripgen's own colour model of a file.
fn own_colour(npz: &mut Npz<'_>) -> Result<ColourModel, NpzError> {
    if npz.has("regressor_near") {
        let mut list = |key: &str, shape: &[usize]| -> Result<Vec<f32>, NpzError> {
            let wanted: Vec<Option<usize>> = shape.iter().map(|&n| Some(n)).collect();
            Ok(npz.array_of_shape(key, &wanted)?.values.iter().map(|&x| x as f32).collect())
        };
        let near = list("regressor_near", &[3, NEAR, NEAR_FIELD])?;
        let around = list("regressor_around", &[3, SURROUNDINGS, AROUND_FIELD])?;
        let limits = list("regressor_limits", &[2 + SURROUNDINGS])?;
        let mm_per_px = npz.array_of_shape("regressor_mm_per_px", &[])?.values[0];
        return Ok(ColourModel::Regressor(Box::new(Regressor {
            mm_per_px,
            near,
            around,
            slope_limit: limits[0],
            height_limit_mm: limits[1],
            around_limit: limits[2..].to_vec(),
        })));
    }
    let lambert = npz.array_of_shape("lambert", &[Some(3), Some(3), Some(6)])?;
    Ok(ColourModel::Lambert(Box::new(Lambert::new(&lambert.values))))
}

fn scalar(npz: &mut Npz<'_>, key: &str) -> Result<Option<f64>, NpzError> {
    Ok(npz.optional(key, &[])?.map(|array| array.values[0]))
}

fn triple(npz: &mut Npz<'_>, key: &str) -> Result<Option<[f32; 3]>, NpzError> {
    let of = |Array { values, .. }| [0, 1, 2].map(|c: usize| values[c] as f32);
    Ok(npz.optional(key, &[Some(3)])?.map(of))
}

fn gel_shape(npz: &mut Npz<'_>, rows: usize, columns: usize) -> Result<GelShape, NpzError> {
    if let Some(heights) = npz.optional("gel_height_px", &[Some(rows), Some(columns)])? {
        return Ok(GelShape::Map(heights.values.iter().map(|&h| h as f32).collect()));
    }
    Ok(match scalar(npz, "dome_sag_mm")? {
        Some(mm) => GelShape::Dome { sag_m: mm * 1e-3 },
        None => GelShape::Flat,
    })
}

/// Taxim's gel map, smoothed as Taxim does it (a 5 x 5 Gaussian), relative to its highest point.
fn taxim_gel_map(bytes: &[u8], grid: &Grid) -> Result<GelShape, SensorError> {
    let map = parse_npy(bytes).map_err(|problem| SensorError::GelMap { problem })?;
    let [rows, columns] = map.shape[..] else {
        let problem = format!("its shape is {:?}, it must be (height, width)", map.shape);
        return Err(SensorError::GelMap { problem });
    };
    let (found, wanted) = ((columns, rows), (grid.width_px, grid.height_px));
    if found != wanted {
        return Err(SensorError::GelMapSize { found, wanted });
    }
    if map.values.iter().any(|h| !h.is_finite()) {
        return Err(SensorError::GelMap { problem: "it holds a number that is not finite".into() });
    }
    let mut heights: Vec<f32> = map.values.iter().map(|&h| h as f32).collect();
    crate::shadow::blur_once(&mut heights, columns, &gaussian(5));
    let highest = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    Ok(GelShape::Map(heights.iter().map(|h| h - highest).collect()))
}

fn pyramid(npz: &mut Npz<'_>) -> Result<Option<Pyramid>, NpzError> {
    let Some(kernels) = npz.optional("kernels_px", &[None])? else { return Ok(None) };
    let kernels_px = kernels.values.iter().map(|&k| k as u32).collect();
    let restore_depth_fraction = npz.array_of_shape("restore_depth_fraction", &[])?.values[0];
    let sink_in_fraction = scalar(npz, "sink_in_fraction")?.unwrap_or(0.0);
    let at_least = scalar(npz, "core_at_least")?.is_some_and(|one| one != 0.0);
    let follow = if at_least { Follow::AtLeast } else { Follow::Exactly };
    Ok(Some(Pyramid { kernels_px, restore_depth_fraction, sink_in_fraction, follow }))
}

fn planes(interleaved: &[f64]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| interleaved.iter().skip(c).step_by(3).map(|&x| x as f32).collect())
}
