//! Tables of shadows: how dark the gel is beside a contact, by direction, height and distance.

use crate::npz::{Array, ElementType, Npz, NpzError};

/// Side of a pixel of the sensor on which Taxim's shadows were measured (`pixmm` of its source).
const TAXIM_MM_PER_PX: f64 = 0.0295;
/// Distance of two values along a ray (`shadow_step` of Taxim's source).
const TAXIM_STEP_PX: f64 = 1.25;
/// Press depth of the first row of Taxim's table, and the distance of two rows.
const TAXIM_DEPTHS_MM: (f64, f64) = (0.4, 0.1);
/// How many rows Taxim adds to the row of the gel's height beside the contact.
const TAXIM_ADDED_ROWS: f64 = 6.0;

/// What the values of a table are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadowKind {
    /// Colours against the background below which the image falls in the shadow: the smaller one counts (Taxim).
    Ceiling,
    /// Changes at most 0 that are added to what the colour model gives.
    Darkening,
}

/// Rays of shadow that go out from the rim of a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowTable {
    /// What the values are.
    pub kind: ShadowKind,
    /// Directions of the rays, in the image, 0 = right, a quarter turn = down: `n` times one step.
    pub directions_rad: Vec<f64>,
    /// Height of the gel over its rest surface, at the origin of a ray, at which the first row begins.
    pub first_height_m: f64,
    /// Distance of two rows.
    pub height_step_m: f64,
    /// Number of rows.
    pub heights: usize,
    /// Distance of two values along a ray on the gel.
    pub step_m: f64,
    /// For direction `n` and row `h`, at `n * heights + h`, the values of red, green and blue in grey levels. The first
    /// value of a ray belongs to its origin and is not drawn. A row without data is empty.
    pub rays: Vec<[Vec<f32>; 3]>,
}

impl ShadowTable {
    /// Reads Taxim's table as plain arrays: `directions` (n,) in rad, `lengths` (3, n, h), `values` (3, n, h, l) of
    /// which the first `lengths` count; channel 0 is blue. Its own `shadowTable.npz` holds the same as Python lists.
    ///
    /// # Errors
    ///
    /// No archive, a missing array, or one of another shape.
    pub fn from_npz(bytes: &[u8]) -> Result<Self, NpzError> {
        let mut npz = Npz::open(bytes)?;
        if npz.has("shadowTable") && !npz.has("values") {
            let problem = "it holds lists of Python objects (a pickle), which are never loaded; \
                           write it as the plain arrays `directions`, `lengths` and `values` first";
            return Err(NpzError::Array { key: "shadowTable".into(), problem: problem.into() });
        }
        let directions_rad = npz.array_of_shape("directions", &[None])?.values;
        let n = directions_rad.len();
        let lengths = npz.array_of_shape("lengths", &[Some(3), Some(n), None])?;
        let heights = lengths.shape[2];
        let values = npz.array_of_shape("values", &[Some(3), Some(n), Some(heights), None])?;
        let rays = rays(&lengths.values, &values, [2, 1, 0])?;
        let (first, step) = TAXIM_DEPTHS_MM;
        let table = Self {
            kind: ShadowKind::Ceiling,
            directions_rad,
            first_height_m: (first - TAXIM_ADDED_ROWS * step) * 1e-3,
            height_step_m: step * 1e-3,
            heights,
            step_m: TAXIM_STEP_PX * TAXIM_MM_PER_PX * 1e-3,
            rays,
        };
        table.checked()
    }

    /// Reads the keys `shadow_*` of a sensor file; `None` if it has no shadows.
    pub(crate) fn of_sensor(npz: &mut Npz<'_>) -> Result<Option<Self>, NpzError> {
        let shape = [None, None, None, Some(3)];
        let Some(values) = npz.optional("shadow_values", &shape)? else { return Ok(None) };
        let [n, heights, steps] = [0, 1, 2].map(|axis| values.shape[axis]);
        let heights_mm = npz.array_of_shape("shadow_heights_mm", &[Some(2)])?.values;
        let step_mm = npz.array_of_shape("shadow_step_mm", &[])?.values[0];
        // Channel by channel, and the length of a ray is what comes before its first NaN.
        let mut planar: Vec<f64> = Vec::with_capacity(values.values.len());
        for channel in 0..3 {
            planar.extend(values.values.iter().skip(channel).step_by(3));
        }
        let lengths: Vec<f64> = planar
            .chunks_exact(steps.max(1))
            .map(|ray| ray.iter().position(|v| v.is_nan()).unwrap_or(steps) as f64)
            .collect();
        let planar = Array { shape: vec![3, n, heights, steps], values: planar };
        let table = Self {
            kind: ShadowKind::Darkening,
            directions_rad: (0..n).map(|i| i as f64 * std::f64::consts::TAU / n as f64).collect(),
            first_height_m: heights_mm[0] * 1e-3,
            height_step_m: heights_mm[1] * 1e-3,
            heights,
            step_m: step_mm * 1e-3,
            rays: rays(&lengths, &planar, [0, 1, 2])?,
        };
        table.checked().map(Some)
    }

    /// The arrays of a sensor file. Only [`ShadowKind::Darkening`] over a full circle is stored.
    pub(crate) fn arrays(&self) -> Vec<(&'static str, Array, ElementType)> {
        let steps = self.rays.iter().flatten().map(Vec::len).max().unwrap_or(0);
        let mut values = Vec::with_capacity(3 * steps * self.rays.len());
        for ray in &self.rays {
            for s in 0..steps {
                values.extend(ray.iter().map(|channel| channel.get(s).map_or(f64::NAN, |&v| f64::from(v))));
            }
        }
        let shape = vec![self.directions_rad.len(), self.heights, steps, 3];
        let heights = vec![self.first_height_m * 1e3, self.height_step_m * 1e3];
        let step = Array { shape: vec![], values: vec![self.step_m * 1e3] };
        vec![
            ("shadow_values", Array { shape, values }, ElementType::F32),
            ("shadow_heights_mm", Array { shape: vec![2], values: heights }, ElementType::F64),
            ("shadow_step_mm", step, ElementType::F64),
        ]
    }

    /// Angle between two directions.
    pub(crate) fn direction_step_rad(&self) -> f64 {
        self.directions_rad[1] - self.directions_rad[0]
    }

    fn checked(self) -> Result<Self, NpzError> {
        let bad = |key: &str, problem: String| NpzError::Array { key: key.into(), problem };
        let n = self.directions_rad.len();
        if !(4..=4096).contains(&n) || self.heights == 0 || self.heights > 4096 {
            let problem =
                format!("{n} directions and {} rows, there must be 4 to 4096 and 1 to 4096", self.heights);
            return Err(bad("shadow table", problem));
        }
        let step = self.direction_step_rad();
        let even = |(i, d): (usize, &f64)| (d - i as f64 * step).abs() < 1e-6;
        let circle = (n as f64 * step - std::f64::consts::TAU).abs() < step;
        if self.directions_rad[0] != 0.0 || !circle || !self.directions_rad.iter().enumerate().all(even) {
            let problem =
                format!("{n} directions must go around from 0 in even steps, the first step is {step} rad");
            return Err(bad("directions", problem));
        }
        let lengths = [("shadow_step_mm", self.step_m), ("shadow_heights_mm", self.height_step_m)];
        if let Some((key, value)) = lengths.into_iter().find(|(_, v)| !(1e-6..=0.01).contains(v)) {
            return Err(bad(key, format!("{} mm, it must be from 0.001 to 10", value * 1e3)));
        }
        if !self.first_height_m.is_finite() || self.rays.iter().flatten().flatten().any(|v| !v.is_finite()) {
            return Err(bad("shadow table", "it holds a number that is not finite".into()));
        }
        Ok(self)
    }
}

/// Rays of red, green and blue from arrays (3, n, heights) and (3, n, heights, steps).
fn rays(lengths: &[f64], values: &Array, channels: [usize; 3]) -> Result<Vec<[Vec<f32>; 3]>, NpzError> {
    let steps = values.shape[3];
    let count = values.shape[1] * values.shape[2];
    if let Some(&length) = lengths.iter().find(|&&l| !(0.0..=steps as f64).contains(&l)) {
        let problem = format!("{length} values of a ray, the array `values` holds {steps}");
        return Err(NpzError::Array { key: "lengths".into(), problem });
    }
    let ray = |i: usize, channel: usize| {
        let at = channel * count + i;
        values.values[at * steps..][..lengths[at] as usize].iter().map(|&v| v as f32).collect()
    };
    Ok((0..count).map(|i| channels.map(|channel| ray(i, channel))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::write_npz;

    fn dense(n: usize, edit: impl Fn(&str, &mut Array)) -> Result<ShadowTable, NpzError> {
        let mut arrays = vec![
            ("directions", vec![n], (0..n).map(|i| i as f64 * 0.1).collect::<Vec<f64>>()),
            ("lengths", vec![3, n, 2], vec![2.0; 6 * n]),
            ("values", vec![3, n, 2, 4], (0..24 * n).map(|i| -(i as f64)).collect()),
        ];
        let arrays: Vec<_> = arrays
            .drain(..)
            .map(|(key, shape, values)| {
                let mut array = Array { shape, values };
                edit(key, &mut array);
                (key, array, ElementType::F64)
            })
            .collect();
        ShadowTable::from_npz(&write_npz(&arrays).unwrap())
    }

    #[test]
    fn taxims_plain_table_is_read_and_channel_0_is_blue() {
        let table = dense(63, |_, _| {}).unwrap();
        assert_eq!(table.rays.len(), 63 * 2);
        let blue_first = -((3.0 * 2.0 + 1.0) * 4.0);
        assert_eq!(table.rays[3 * 2 + 1][2], [blue_first, blue_first - 1.0], "two values count");
        assert_eq!(table.rays[3 * 2 + 1][0][0], blue_first - 2.0 * 63.0 * 2.0 * 4.0);
        assert!((table.step_m * 1e3 - 0.036875).abs() < 1e-12);
        assert!((table.first_height_m * 1e3 + 0.2).abs() < 1e-12);
    }

    #[test]
    fn broken_tables_are_refused_with_the_numbers() {
        for (n, key, value, part) in [
            (63, "lengths", 5.0, "5 values of a ray, the array `values` holds 4"),
            (63, "directions", 1.0, "from 0 in even steps"),
            (40, "", 0.0, "40 directions must go around"),
            (63, "values", f64::NAN, "not finite"),
        ] {
            let error = dense(n, |k, array| {
                if k == key {
                    array.values[0] = value;
                }
            });
            let error = error.map(|_| String::new()).unwrap_or_else(|e| e.to_string());
            assert!(error.contains(part), "{key} = {value}: `{error}`");
        }
        let array = Array { shape: vec![1], values: vec![0.0] };
        let bytes = write_npz(&[("shadowTable", array, ElementType::F64)]).unwrap();
        let error = ShadowTable::from_npz(&bytes).unwrap_err().to_string();
        assert!(error.contains("pickle") && error.contains("`lengths`"), "{error}");
    }
}
