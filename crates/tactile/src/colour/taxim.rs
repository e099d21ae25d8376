//! Taxim's colour table, as stored in its `polycalib.npz`, on its processed background.

mod background;
mod bins;

pub(crate) use bins::Sectors;

use crate::grid::Plane;
use crate::npz::{Npz, NpzError};
use crate::sensor::SensorError;
use bins::Steepness;
use gripgen_twin::TactileImage;
use gripgen_twin::config::TableChannels;
use std::f64::consts::PI;

/// Width in pixels of the images on which Taxim's tables are calibrated; the polynomials use their coordinates.
const CALIBRATION_WIDTH_PX: f64 = 640.0;

/// No camera gives a channel that leaves 0 to 255 by more grey levels than this.
const OUTSIDE_GREY_LEVELS: f32 = 10.0;
/// The largest share of such values in a table that is read in the positions in which it was made. Eight public tables have 0.0 to
/// 1.7 % there; the three made of narrower images have 12 to 62 % where they are read as 640 px wide.
const MOST_OUTSIDE: f64 = 0.05;
/// Places along each axis of the image at which that is counted.
const PLACES: [usize; 2] = [8, 6];

/// How a `polycalib.npz` is read: what its arrays do not say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableReading {
    /// Width of the images in whose positions its polynomials were fitted.
    pub width_px: u32,
    /// Order of its channels.
    pub channels: TableChannels,
}

impl Default for TableReading {
    /// As Taxim's own tables are.
    fn default() -> Self {
        Self { width_px: CALIBRATION_WIDTH_PX as u32, channels: TableChannels::Bgr }
    }
}

/// Middle of the calibration's images, from which the polynomials are evaluated so that single precision suffices.
const MIDDLE_PX: [f64; 2] = [320.0, 240.0];

/// For every bin of slope and direction a polynomial of second degree in the pixel position, for each channel
/// (Si & Yuan 2022). Channel 0 of the file is blue: its images are in OpenCV's order.
#[derive(Debug, Clone, PartialEq)]
pub struct TaximTable {
    bins: usize,
    /// Coefficients of `x^2, y^2, x y, x, y, 1` by (slope bin, direction bin), for red, green, blue.
    rgb: [Vec<[f64; 6]>; 3],
    /// The same about the middle of the image; red, green, blue and nothing side by side.
    packed: Vec<[[f32; 4]; 6]>,
    steepness: Steepness,
    sectors: Sectors,
    /// Taxim's processed background, in grey levels.
    background: [Vec<f32>; 3],
    /// The same minus the frame at rest.
    offset: [Vec<f32>; 3],
}

impl TaximTable {
    /// Reads `grad_b`, `grad_g`, `grad_r`; their first axis tells the number of bins. `frame` is the image without
    /// contact, of the size of the images to come. Positions of narrower or wider images become those of 640 px.
    pub(crate) fn read(
        npz: &mut Npz<'_>,
        frame: &TactileImage,
        reading: TableReading,
    ) -> Result<Self, NpzError> {
        let mut bins = 0;
        let s = f64::from(reading.width_px) / CALIBRATION_WIDTH_PX;
        let mut channel = |key: &str| -> Result<Vec<[f64; 6]>, NpzError> {
            let array = npz.array_of_shape(key, &[None, None, Some(6)])?;
            let n = array.shape[0];
            let square = array.shape[1] == n && (2..=4096).contains(&n) && (bins == 0 || bins == n);
            if !square {
                let problem =
                    format!("its shape is {:?}, it must be (n, n, 6) with one n from 2 to 4096", array.shape);
                return Err(NpzError::Array { key: key.into(), problem });
            }
            bins = n;
            let scaled = |c: &[f64]| [s * s * c[0], s * s * c[1], s * s * c[2], s * c[3], s * c[4], c[5]];
            Ok(array.values.chunks_exact(6).map(scaled).collect())
        };
        let (first, green, last) = (channel("grad_r")?, channel("grad_g")?, channel("grad_b")?);
        let rgb = match reading.channels {
            TableChannels::Bgr => [last, green, first],
            TableChannels::Rgb => [first, green, last],
        };
        let packed = (0..bins * bins).map(|bin| about_the_middle(&rgb, bin)).collect();
        let background = background::background(frame, CALIBRATION_WIDTH_PX);
        let offset = [0, 1, 2].map(|c| {
            let at_rest = frame.rgb.iter().skip(c).step_by(3);
            background[c].iter().zip(at_rest).map(|(b, &r)| b - f32::from(r)).collect()
        });
        Ok(Self {
            bins,
            rgb,
            packed,
            steepness: Steepness::new(bins),
            sectors: Sectors::new(2.0 * PI / (bins - 1) as f64, bins),
            background,
            offset,
        })
    }

    /// Refuses a table of which too many values lie outside 0 to 255 on the frame, read in positions of images `width_px` wide.
    pub(crate) fn check_scale(&self, width_px: u32, frame: &TactileImage) -> Result<(), SensorError> {
        let share = self.share_outside(frame, 1.0);
        if share <= MOST_OUTSIDE {
            return Ok(());
        }
        let mut sides_px = vec![frame.width_px, frame.height_px];
        sides_px.dedup();
        let read_as = |side_px: u32| f64::from(side_px) / f64::from(width_px);
        sides_px.retain(|&side_px| self.share_outside(frame, read_as(side_px)) <= MOST_OUTSIDE);
        Err(SensorError::TableScale {
            share_percent: 100.0 * share,
            most_percent: 100.0 * MOST_OUTSIDE,
            width_px,
            likely_px: sides_px,
        })
    }

    /// Share of the values of all bins and channels, at places spread over the frame, that no camera gives; `scale` multiplies the
    /// positions first.
    fn share_outside(&self, frame: &TactileImage, scale: f64) -> f64 {
        let (w, h) = (frame.width_px as usize, frame.height_px as usize);
        let allowed = -OUTSIDE_GREY_LEVELS..=255.0 + OUTSIDE_GREY_LEVELS;
        let mut outside = 0;
        for place in 0..PLACES[0] * PLACES[1] {
            let x = (2 * (place % PLACES[0]) + 1) * w / (2 * PLACES[0]);
            let y = (2 * (place / PLACES[0]) + 1) * h / (2 * PLACES[1]);
            let per_px = scale * CALIBRATION_WIDTH_PX / w as f64;
            let (px, py) = (x as f64 * per_px - MIDDLE_PX[0], y as f64 * per_px - MIDDLE_PX[1]);
            for bin in &self.packed {
                let values = polynomial(bin, px as f32, py as f32);
                let out = |&c: &usize| !allowed.contains(&(values[c] + self.background[c][y * w + x]));
                outside += (0..3).filter(out).count();
            }
        }
        outside as f64 / (3 * self.packed.len() * PLACES[0] * PLACES[1]) as f64
    }

    /// Whether all coefficients are.
    pub(crate) fn is_finite(&self) -> bool {
        self.rgb.iter().flatten().flatten().all(|c| c.is_finite())
    }

    /// The background that Taxim draws on (its `bg_proc`): planes of red, green and blue, in grey levels.
    pub fn background(&self) -> &[Vec<f32>; 3] {
        &self.background
    }

    /// The table with other planes: `of` makes each from the one that it replaces.
    pub(crate) fn with_planes(&self, of: impl Fn(&[f32]) -> Vec<f32>) -> Self {
        let planes = |old: &[Vec<f32>; 3]| [0, 1, 2].map(|c| of(&old[c]));
        Self { background: planes(&self.background), offset: planes(&self.offset), ..self.clone() }
    }

    /// [`TaximTable::background`] minus the frame at rest.
    pub(crate) fn offset(&self) -> &[Vec<f32>; 3] {
        &self.offset
    }

    /// Number of bins of slope, and of direction.
    #[cfg(feature = "gpu")]
    pub(crate) fn bins(&self) -> usize {
        self.bins
    }

    /// Smallest slope of each bin, and cosine and sine of the lower border of each bin of direction.
    #[cfg(feature = "gpu")]
    pub(crate) fn borders(&self) -> (&[f32], Vec<[f64; 2]>) {
        (self.steepness.first(), self.sectors.borders())
    }

    /// Coefficients of each bin for positions relative to [`MIDDLE_PX`]: terms `x^2, y^2, x y, x, y, 1`, each for red,
    /// green, blue and nothing.
    #[cfg(feature = "gpu")]
    pub(crate) fn packed(&self) -> &[[[f32; 4]; 6]] {
        &self.packed
    }

    /// Bin of a slope: `floor(atan(|g|) / (pi/2 / (B-1)))`, `floor((atan2(gy, gx) + pi) / (2 pi / (B-1)))`, direction 0
    /// where it is flat, angles in single precision.
    #[inline]
    fn bin(&self, slope: f32, unit_x: f32, unit_y: f32) -> usize {
        self.steepness.of(slope) * self.bins + self.sectors.of(unit_x, unit_y)
    }

    /// Writes the table's value plus the background minus the frame at rest: Taxim's image as a change of the rest
    /// frame. Slopes are those of the whole surface, the shape of the gel at rest included, as Taxim's are.
    pub(super) fn shade(&self, along_x: &Plane, along_y: &Plane, change: &mut [Plane; 3]) {
        let w = along_x.width;
        let scale = CALIBRATION_WIDTH_PX / w as f64;
        let (mut slope, mut unit_x, mut unit_y) = (vec![0.0; w], vec![1.0; w], vec![0.0; w]);
        let mut values = vec![[0.0; 4]; w];
        let px: Vec<f32> = (0..w).map(|x| (x as f64 * scale - MIDDLE_PX[0]) as f32).collect();
        let [red, green, blue] = change;
        for y in 0..along_x.height {
            let (gx, gy) = (along_x.row(y), along_y.row(y));
            for x in 0..w {
                let s = (gx[x] * gx[x] + gy[x] * gy[x]).sqrt();
                slope[x] = s;
                unit_x[x] = if s > 0.0 { gx[x] / s } else { 1.0 };
                unit_y[x] = if s > 0.0 { gy[x] / s } else { 0.0 };
            }
            let py = (y as f64 * scale - MIDDLE_PX[1]) as f32;
            let row = y * w..(y + 1) * w;
            let out =
                [&mut red.values[row.clone()], &mut green.values[row.clone()], &mut blue.values[row.clone()]];
            let offset = self.offset.each_ref().map(|plane| &plane[row.clone()]);
            for x in 0..w {
                let bin = self.bin(slope[x], unit_x[x], unit_y[x]);
                values[x] = polynomial(&self.packed[bin], px[x], py);
            }
            for c in 0..3 {
                for x in 0..w {
                    out[c][x] = values[x][c] + offset[c][x];
                }
            }
        }
    }
}

/// `c0 x^2 + c1 y^2 + c2 x y + c3 x + c4 y + c5`, four at a time.
#[inline]
fn polynomial(c: &[[f32; 4]; 6], x: f32, y: f32) -> [f32; 4] {
    std::array::from_fn(|k| {
        ((c[0][k] * x + c[2][k] * y + c[3][k]) * x) + ((c[1][k] * y + c[4][k]) * y + c[5][k])
    })
}

/// Coefficients of one bin for positions relative to the middle of the image.
fn about_the_middle(rgb: &[Vec<[f64; 6]>; 3], bin: usize) -> [[f32; 4]; 6] {
    let [mx, my] = MIDDLE_PX;
    let mut packed = [[0.0; 4]; 6];
    for (k, channel) in rgb.iter().enumerate() {
        let c = channel[bin];
        let moved = [
            c[0],
            c[1],
            c[2],
            2.0 * c[0] * mx + c[2] * my + c[3],
            2.0 * c[1] * my + c[2] * mx + c[4],
            c[0] * mx * mx + c[1] * my * my + c[2] * mx * my + c[3] * mx + c[4] * my + c[5],
        ];
        for (term, value) in packed.iter_mut().zip(moved) {
            term[k] = value as f32;
        }
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::taxim_table;

    fn frame() -> TactileImage {
        let rgb = (0..64 * 48).flat_map(|i| [100, 90, 80 + (i % 64) as u8]).collect();
        TactileImage { width_px: 64, height_px: 48, rgb }
    }

    fn shade(table: &TaximTable, gx: f32, gy: f32) -> [Plane; 3] {
        let mut change = [0, 1, 2].map(|_| Plane::filled(64, 48, 0.0));
        table.shade(&Plane::filled(64, 48, gx), &Plane::filled(64, 48, gy), &mut change);
        change
    }

    #[test]
    fn channel_0_of_the_file_is_blue() {
        let t = taxim_table(&frame(), 5, |c, _| [0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * (c + 1) as f64]);
        let change = shade(&t, 0.3, 0.1);
        let of_table = [0, 1, 2].map(|c| change[c].values[70] - t.offset[c][70]);
        assert_eq!(of_table, [30.0, 20.0, 10.0]);
    }

    /// Flat pixels get the polynomial of the bin that Taxim's published rule gives them, at their place in an image of 640 px,
    /// on a background whose dark pixels are blurred away.
    #[test]
    fn a_flat_gel_has_the_value_of_its_bin_on_the_processed_background() {
        let places = [(5_usize, 7_usize), (31, 24), (58, 40)];
        let even = [200, 180, 120];
        // A Gaussian of 5 px (50 px of 640) has 1 / (2 pi 25) of its weight in the middle: a dark pixel of an even frame lacks
        // that share, and a tenth of it more near a border, where it is mirrored. The rest is cut to whole levels.
        let blurred = [198.0, 178.0, 119.0];
        let level = |i: usize| if places.contains(&(i % 64, i / 64)) { [0, 0, 0] } else { even };
        let frame = TactileImage { width_px: 64, height_px: 48, rgb: (0..64 * 48).flat_map(level).collect() };
        // No two terms, channels of the file, slopes or directions share a coefficient.
        let coefficients = |c: usize, bin: usize| {
            let size = 1.0 + 0.2 * c as f64 + 0.5 * (bin / 125) as f64 + 0.001 * (bin % 125) as f64;
            [1e-4, -2e-4, 3e-4, 0.05, -0.07, 40.0].map(|term| term * size)
        };
        let change = shade(&taxim_table(&frame, 125, coefficients), 0.0, 0.0);
        // Slope bin floor(0 / ((pi / 2) / 124)), direction bin floor((0 + pi) / (2 pi / 124)).
        let (slope, direction) = (0, 62);
        for (x, y) in places {
            let (px, py) = (10.0 * x as f64, 10.0 * y as f64);
            for (channel, of_file) in [2, 1, 0].into_iter().enumerate() {
                let terms = [px * px, py * py, px * py, px, py, 1.0];
                let table: f64 = coefficients(of_file, slope * 125 + direction)
                    .iter()
                    .zip(terms)
                    .map(|(c, t)| c * t)
                    .sum();
                // The frame is 0 here, so that the change is the image.
                let image = f64::from(change[channel].values[y * 64 + x]);
                let exact = table + blurred[channel];
                assert!((image - exact).abs() < 2e-3, "({x}, {y}), {channel}: {image} and {exact}");
            }
        }
    }

    #[test]
    fn slopes_fall_into_taxims_bins() {
        let t = taxim_table(&frame(), 125, |_, k| [0.0, 0.0, 0.0, 0.0, 0.0, k as f64]);
        let steps = 124.0;
        for (gx, gy) in [(0.5, 0.02), (0.1, 0.5), (-0.2, -0.1), (0.3, -0.7), (30.0, -40.0)] {
            let magnitude = f32::hypot(gx, gy).atan();
            let direction = f32::atan2(gy, gx);
            let i = (f64::from(magnitude) / (std::f64::consts::FRAC_PI_2 / steps)).floor();
            let j = ((f64::from(direction) + PI) / (2.0 * PI / steps)).floor();
            let found = shade(&t, gx, gy)[0].values[0] - t.offset[0][0];
            assert!((f64::from(found) - (i * 125.0 + j)).abs() < 0.1, "({gx}, {gy}): {found}");
        }
    }
}
