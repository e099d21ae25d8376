//! Taxim's colour table, as stored in its `polycalib.npz`.

use crate::grid::Plane;
use crate::npz::{Npz, NpzError};
use std::f64::consts::{FRAC_PI_2, PI};

/// Width in pixels of the images on which Taxim's tables are calibrated; the polynomials use their coordinates.
const CALIBRATION_WIDTH_PX: f64 = 640.0;

/// For every bin of slope and direction a polynomial of second degree in the pixel position, for each channel
/// (Si & Yuan 2022). Channel 0 of the file is blue: its images are in OpenCV's order.
#[derive(Debug, Clone, PartialEq)]
pub struct TaximTable {
    bins: usize,
    /// Coefficients of `x^2, y^2, x y, x, y, 1` by (slope bin, direction bin), for red, green, blue.
    rgb: [Vec<[f64; 6]>; 3],
}

impl TaximTable {
    /// Reads `grad_b`, `grad_g`, `grad_r`; their first axis tells the number of bins.
    pub(crate) fn read(npz: &mut Npz<'_>) -> Result<Self, NpzError> {
        let mut bins = 0;
        let mut channel = |key: &str| -> Result<Vec<[f64; 6]>, NpzError> {
            let array = npz.array_of_shape(key, &[None, None, Some(6)])?;
            let n = array.shape[0];
            let square = array.shape[1] == n && n >= 2 && (bins == 0 || bins == n);
            if !square {
                let problem =
                    format!("its shape is {:?}, it must be (n, n, 6) with one n of at least 2", array.shape);
                return Err(NpzError::Array { key: key.into(), problem });
            }
            bins = n;
            Ok(array.values.chunks_exact(6).map(|c| [c[0], c[1], c[2], c[3], c[4], c[5]]).collect())
        };
        let (blue, green, red) = (channel("grad_r")?, channel("grad_g")?, channel("grad_b")?);
        Ok(Self { bins, rgb: [red, green, blue] })
    }

    /// Whether all coefficients are.
    pub(crate) fn is_finite(&self) -> bool {
        self.rgb.iter().flatten().flatten().all(|c| c.is_finite())
    }

    /// Bin of a slope: `floor(atan(|g|) / (pi/2 / (B-1)))`, `floor((atan2(gy, gx) + pi) / (2 pi / (B-1)))`.
    fn bin(&self, gx: f64, gy: f64) -> usize {
        let steps = (self.bins - 1) as f64;
        let magnitude = libm::atan((gx * gx + gy * gy).sqrt());
        let direction = if gx == 0.0 && gy == 0.0 { 0.0 } else { libm::atan2(gy, gx) };
        let i = (magnitude / (FRAC_PI_2 / steps)).floor().min(steps) as usize;
        let j = ((direction + PI) / (2.0 * PI / steps)).floor().min(steps) as usize;
        i * self.bins + j
    }

    /// Writes the table's value minus its value on a flat gel, so that no slope gives no change.
    pub(super) fn shade(&self, along_x: &Plane, along_y: &Plane, change: &mut [Plane; 3]) {
        let scale = CALIBRATION_WIDTH_PX / along_x.width as f64;
        let flat = self.bin(0.0, 0.0);
        for y in 0..along_x.height {
            for x in 0..along_x.width {
                let at = y * along_x.width + x;
                let (gx, gy) = (along_x.values[at], along_y.values[at]);
                if gx == 0.0 && gy == 0.0 {
                    continue;
                }
                let bin = self.bin(f64::from(gx), f64::from(gy));
                let (px, py) = (x as f64 * scale, y as f64 * scale);
                let terms = [px * px, py * py, px * py, px, py, 1.0];
                for (channel, plane) in change.iter_mut().enumerate() {
                    let (c, c0) = (&self.rgb[channel][bin], &self.rgb[channel][flat]);
                    let value: f64 = (0..6).map(|i| (c[i] - c0[i]) * terms[i]).sum();
                    plane.values[at] = value as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::{Array, ElementType, write_npz};

    /// A table whose constant term names its bin and channel.
    fn table(bins: usize) -> TaximTable {
        let channel = |offset: f64| {
            let values =
                (0..bins * bins).flat_map(|k| [0.0, 0.0, 0.0, 0.0, 0.0, offset + k as f64]).collect();
            Array { shape: vec![bins, bins, 6], values }
        };
        let bytes = write_npz(&[
            ("bins", Array { shape: vec![], values: vec![bins as f64] }, ElementType::F64),
            ("grad_r", channel(1e6), ElementType::F64),
            ("grad_g", channel(2e6), ElementType::F64),
            ("grad_b", channel(3e6), ElementType::F64),
        ])
        .unwrap();
        TaximTable::read(&mut Npz::open(&bytes).unwrap()).unwrap()
    }

    #[test]
    fn channel_0_of_the_file_is_blue() {
        let t = table(5);
        assert_eq!([0, 1, 2].map(|c| t.rgb[c][0][5]), [3e6, 2e6, 1e6]);
    }

    #[test]
    fn slopes_fall_into_taxims_bins() {
        let t = table(125);
        let steps = 124.0;
        for (gx, gy) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (-0.2, -0.1), (30.0, -40.0)] {
            let magnitude = f64::atan(f64::hypot(gx, gy));
            let direction = if gx == 0.0 && gy == 0.0 { 0.0 } else { f64::atan2(gy, gx) };
            let i = (magnitude / (FRAC_PI_2 / steps)).floor() as usize;
            let j = ((direction + PI) / (2.0 * PI / steps)).floor() as usize;
            assert_eq!(t.bin(gx, gy), i * 125 + j, "({gx}, {gy})");
        }
    }
}
