//! The volume of an imprint from its image: colour to slope, slope to height, height to volume.
//!
//! A sensor file says which colour a slope has. Its inverse is fitted: balls of several sizes are pressed into the sensor at several
//! places, and the slope of the gel is regressed on the change of colour (Johnson and Adelson 2009, with a polynomial in place of
//! their table). Slopes are integrated by Poisson's equation with no height at the rim of the frame. What light, blur and rim take
//! away is in one factor between the volume of the surface and that of the imprint, `V` of `V = c F`.

use crate::gradient::gradient;
use crate::grid::{Plane, added};
use crate::presses::gel_of;
use crate::render::Renderer;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{Gel, TactileImage};
use nalgebra::{DMatrix, DVector};

/// Cells along the width of an image, at least; colours are means over a cell.
const CELLS: usize = 80;
/// Change of colour that counts as one.
const GREY: f64 = 40.0;
/// Terms of a slope: of the colours alone up to third order, and of each colour times the place.
const TERMS: usize = 19 + 15;
/// Share of the mean square of the terms that keeps the regression stable.
const RIDGE: f64 = 1e-6;
/// Radii of the balls and of their contacts, as shares of the smaller side of the frame.
const BALLS: [f64; 3] = [0.3, 0.6, 1.2];
const CONTACTS: [f64; 3] = [0.10, 0.17, 0.24];
/// Where balls are pressed in, as shares of the frame from its centre.
const PLACES: [f64; 3] = [-0.22, 0.0, 0.22];
/// Rounds of the solver, each of two half sweeps.
const ROUNDS: usize = 400;

/// Reads volumes off the images of one sensor.
#[derive(Debug, Clone)]
pub struct VolumeReader {
    size_px: (usize, usize),
    cell_px: usize,
    metres_per_px: f64,
    rest: [Vec<f32>; 3],
    /// Coefficients of the slope along x and along y.
    slope: [Vec<f64>; 2],
    /// Volume of the imprint over that of the surface that is read.
    factor: f64,
    scatter: f64,
}

/// Why a volume could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The images of the sensor do not depend on slopes in a way that can be inverted.
    #[error("the colours of this sensor file do not tell slopes apart")]
    Colours,
    /// An image of another size.
    #[error("the image is {}x{} pixels, the sensor has {}x{}", .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// Width and height of the image.
        found: (usize, usize),
        /// Those of the sensor.
        wanted: (usize, usize),
    },
}

impl VolumeReader {
    /// Fits the inverse of a sensor. `gel` says how it deforms where the sensor file does not; its thickness is that of the gel.
    ///
    /// # Errors
    ///
    /// [`VolumeError::Colours`].
    pub fn new(sensor: &Sensor, gel: &Gel, level: SimdLevel) -> Result<Self, VolumeError> {
        let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
        let mut reader = Self {
            size_px: (w, h),
            cell_px: (w / CELLS).max(1),
            metres_per_px: sensor.grid.metres_per_px,
            rest: sensor.rest.clone(),
            slope: [vec![0.0; TERMS], vec![0.0; TERMS]],
            factor: 1.0,
            scatter: 0.0,
        };
        let soft = Gel { model: GelModel::Pyramid, ..gel.clone() };
        let presses = training(sensor, &soft, level, &reader);
        reader.slope = regression(&presses).ok_or(VolumeError::Colours)?;
        let both: Vec<(f64, f64)> =
            presses.iter().map(|p| (p.volume_m3, reader.surface_volume(&p.change))).collect();
        let (mut tr, mut rr) = (0.0, 0.0);
        for (truth, read) in &both {
            // Relative deviations count: r = read / truth.
            let ratio = read / truth;
            tr += ratio;
            rr += ratio * ratio;
        }
        if !(tr.is_finite() && tr > 0.0) {
            return Err(VolumeError::Colours);
        }
        reader.factor = tr / rr;
        let off = |(truth, read): &(f64, f64)| (reader.factor * read / truth - 1.0).powi(2);
        reader.scatter = (both.iter().map(off).sum::<f64>() / both.len() as f64).sqrt();
        Ok(reader)
    }

    /// The inverse of a sensor whose file says how its gel deforms; of another one the deformation of Wucherer et al. 2023.
    ///
    /// # Errors
    ///
    /// [`VolumeError::Colours`].
    pub fn of_sensor(sensor: &Sensor, level: SimdLevel) -> Result<Self, VolumeError> {
        Self::new(sensor, &gel_of(sensor), level)
    }

    /// Standard deviation of the relative error on the balls that it was fitted to: of sizes and places that differ.
    pub fn scatter(&self) -> f64 {
        self.scatter
    }

    /// Volume of the imprint in m^3. `rest` is the frame without contact, that of the sensor file where it is left out. A change that
    /// the whole frame shares is taken for one of the exposure.
    ///
    /// # Errors
    ///
    /// [`VolumeError::Size`].
    pub fn volume_m3(&self, image: &TactileImage, rest: Option<&TactileImage>) -> Result<f64, VolumeError> {
        for one in std::iter::once(image).chain(rest) {
            let found = (one.width_px as usize, one.height_px as usize);
            if found != self.size_px {
                return Err(VolumeError::Size { found, wanted: self.size_px });
            }
        }
        let n = self.size_px.0 * self.size_px.1;
        let change = [0, 1, 2].map(|c| {
            let at_rest = |i: usize| match rest {
                Some(rest) => f32::from(rest.rgb[3 * i + c]),
                None => self.rest[c][i],
            };
            (0..n).map(|i| f32::from(image.rgb[3 * i + c]) - at_rest(i)).collect::<Vec<f32>>()
        });
        let cells = self.cells(&change);
        Ok(self.factor * self.surface_volume(&cells))
    }

    /// Columns and rows of cells.
    fn grid(&self) -> (usize, usize) {
        (self.size_px.0 / self.cell_px, self.size_px.1 / self.cell_px)
    }

    fn means(&self, plane: &[f32]) -> Vec<f64> {
        let (columns, rows) = self.grid();
        let (k, w) = (self.cell_px, self.size_px.0);
        let mean = |x: usize, y: usize| {
            let mut sum = 0.0;
            for row in y * k..(y + 1) * k {
                sum +=
                    plane[row * w + x * k..row * w + (x + 1) * k].iter().map(|&v| f64::from(v)).sum::<f64>();
            }
            sum / (k * k) as f64
        };
        (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
    }

    /// Means over cells, less what the whole frame shares.
    fn cells(&self, change: &[Vec<f32>; 3]) -> [Vec<f64>; 3] {
        change.each_ref().map(|plane| {
            let mut cells = self.means(plane);
            let mut sorted = cells.clone();
            sorted.sort_by(f64::total_cmp);
            let middle = sorted[sorted.len() / 2];
            cells.iter_mut().for_each(|v| *v = (*v - middle) / GREY);
            cells
        })
    }

    fn terms(&self, cells: &[Vec<f64>; 3], at: usize) -> [f64; TERMS] {
        let (columns, rows) = self.grid();
        let (x, y) = (at % columns, at / columns);
        let place = |i: usize, n: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
        terms([cells[0][at], cells[1][at], cells[2][at]], place(x, columns), place(y, rows))
    }

    fn surface_volume(&self, cells: &[Vec<f64>; 3]) -> f64 {
        let (columns, rows) = self.grid();
        let slope = |direction: usize, at: usize| {
            let terms = self.terms(cells, at);
            terms.iter().zip(&self.slope[direction]).map(|(t, c)| t * c).sum::<f64>()
        };
        let all = [0, 1].map(|d| (0..columns * rows).map(|at| slope(d, at)).collect::<Vec<f64>>());
        let heights = integrate(&all[0], &all[1], columns, rows);
        // Heights are in cells.
        let side_m = self.cell_px as f64 * self.metres_per_px;
        heights.iter().sum::<f64>() * side_m * side_m * side_m
    }
}

/// A press of a ball: its change of colour by cells, the slopes of the gel there, and the volume of the imprint.
struct Press {
    change: [Vec<f64>; 3],
    terms: Vec<[f64; TERMS]>,
    slopes: [Vec<f64>; 2],
    volume_m3: f64,
}

fn training(sensor: &Sensor, gel: &Gel, level: SimdLevel, reader: &VolumeReader) -> Vec<Press> {
    let renderer = Renderer { sensor, gel, level };
    let grid = &sensor.grid;
    let (w, h) = (grid.width_px as f64, grid.height_px as f64);
    let side = w.min(h);
    let mut presses = Vec::new();
    for (k, ball) in BALLS.iter().enumerate() {
        for (j, contact) in CONTACTS.iter().enumerate() {
            for (i, v) in PLACES.iter().enumerate() {
                // Three of nine places for each ball and contact, all nine over them.
                let u = PLACES[(i + j + k) % PLACES.len()];
                let (radius, rim) = (ball * side, contact * side);
                let (x0, y0) = ((0.5 + u) * w, (0.5 + v) * h);
                let heights = Plane::from_fn(grid.width_px, grid.height_px, |x, y| {
                    let (x, y) = (x as f64 + 0.5 - x0, y as f64 + 0.5 - y0);
                    let up = radius * radius - x * x - y * y;
                    if up > 0.0 { (up.sqrt() - radius) as f32 } else { -radius as f32 }
                });
                let heights = added(heights, sensor.gel_shape.rest_px(grid).as_ref());
                let depth = radius - (radius * radius - rim * rim).sqrt();
                let cap_px3 = std::f64::consts::PI * depth * depth * (radius - depth / 3.0);
                let volume_m3 = cap_px3 * grid.metres_per_px.powi(3);
                // One newton, so that the constant is the volume.
                let Ok(imprint) = renderer.press_heights(&heights, volume_m3, 1.0) else { continue };
                let change = renderer.unmarked_change(&imprint).map(|plane| plane.values);
                let surface = renderer.surface(&imprint);
                let (along_x, along_y) = gradient(&surface);
                let change = reader.cells(&change);
                let cells = change[0].len();
                let terms = (0..cells).map(|at| reader.terms(&change, at)).collect();
                let slopes = [reader.means(&along_x.values), reader.means(&along_y.values)];
                presses.push(Press { change, terms, slopes, volume_m3 });
            }
        }
    }
    presses
}

/// Ridge regression of both slopes on the terms; `None` where the terms do not tell them.
fn regression(presses: &[Press]) -> Option<[Vec<f64>; 2]> {
    let mut normal = DMatrix::<f64>::zeros(TERMS, TERMS);
    let mut right = [DVector::<f64>::zeros(TERMS), DVector::<f64>::zeros(TERMS)];
    for press in presses {
        for (at, terms) in press.terms.iter().enumerate() {
            // Cells far from any contact say nothing.
            if terms[..3].iter().all(|d| d.abs() < 1e-3) {
                continue;
            }
            for i in 0..TERMS {
                for j in 0..=i {
                    normal[(i, j)] += terms[i] * terms[j];
                }
                right[0][i] += terms[i] * press.slopes[0][at];
                right[1][i] += terms[i] * press.slopes[1][at];
            }
        }
    }
    for i in 0..TERMS {
        for j in 0..i {
            normal[(j, i)] = normal[(i, j)];
        }
    }
    let ridge = RIDGE * normal.trace() / TERMS as f64;
    if !(ridge.is_finite() && ridge > 0.0) {
        return None;
    }
    (0..TERMS).for_each(|i| normal[(i, i)] += ridge);
    let factors = normal.cholesky()?;
    let solved = right.map(|b| factors.solve(&b).as_slice().to_vec());
    solved.iter().flatten().all(|c| c.is_finite()).then_some(solved)
}

fn terms(colour: [f64; 3], u: f64, v: f64) -> [f64; TERMS] {
    let mut all = [0.0; TERMS];
    let mut at = 0;
    let mut push = |value: f64| {
        all[at] = value;
        at += 1;
    };
    for i in 0..3 {
        push(colour[i]);
    }
    for i in 0..3 {
        for j in i..3 {
            push(colour[i] * colour[j]);
        }
    }
    for i in 0..3 {
        for j in i..3 {
            for k in j..3 {
                push(colour[i] * colour[j] * colour[k]);
            }
        }
    }
    for c in colour {
        for place in [u, v, u * u, u * v, v * v] {
            push(c * place);
        }
    }
    all
}

/// Heights with these slopes in the sense of least squares, 0 outside the frame: Poisson's equation by successive over-relaxation in
/// red and black order (Young 1954).
fn integrate(along_x: &[f64], along_y: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    let (w, h) = (columns + 2, rows + 2);
    let mut height = vec![0.0; w * h];
    let mut source = vec![0.0; w * h];
    // Slopes between two cells are means of theirs; there is none beyond the rim.
    let x_slope = |x: usize, y: usize| {
        let at = |x: usize| along_x[y * columns + x];
        if x == 0 || x == columns { 0.0 } else { 0.5 * (at(x - 1) + at(x)) }
    };
    let y_slope = |x: usize, y: usize| {
        let at = |y: usize| along_y[y * columns + x];
        if y == 0 || y == rows { 0.0 } else { 0.5 * (at(y - 1) + at(y)) }
    };
    for y in 0..rows {
        for x in 0..columns {
            source[(y + 1) * w + x + 1] =
                x_slope(x + 1, y) - x_slope(x, y) + y_slope(x, y + 1) - y_slope(x, y);
        }
    }
    let spectral =
        0.5 * (libm::cos(std::f64::consts::PI / w as f64) + libm::cos(std::f64::consts::PI / h as f64));
    let over = 2.0 / (1.0 + (1.0 - spectral * spectral).sqrt());
    for round in 0..2 * ROUNDS {
        for y in 1..=rows {
            let first = 1 + (y + round) % 2;
            for x in (first..=columns).step_by(2) {
                let at = y * w + x;
                let around = height[at - 1] + height[at + 1] + height[at - w] + height[at + w];
                height[at] += over * (0.25 * (around - source[at]) - height[at]);
            }
        }
    }
    (0..rows).flat_map(|y| height[(y + 1) * w + 1..(y + 1) * w + 1 + columns].to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A paraboloid that ends inside the frame comes back from its slopes.
    #[test]
    fn slopes_are_integrated_to_the_heights_that_they_are_of() {
        let (w, h) = (90, 70);
        let truth = |x: usize, y: usize| {
            let (dx, dy) = (x as f64 - 40.0, y as f64 - 33.0);
            (8.0 - 0.02 * (dx * dx + dy * dy)).max(0.0)
        };
        let at = |x: usize, y: usize| truth(x.min(w - 1), y.min(h - 1));
        let slope = |dx: usize, dy: usize| {
            (0..w * h)
                .map(|i| (i % w, i / w))
                .map(|(x, y)| 0.5 * (at(x + dx, y + dy) - at(x.saturating_sub(dx), y.saturating_sub(dy))))
                .collect::<Vec<f64>>()
        };
        let heights = integrate(&slope(1, 0), &slope(0, 1), w, h);
        let volume: f64 = heights.iter().sum();
        let expected: f64 = (0..w * h).map(|i| truth(i % w, i / w)).sum();
        assert!((volume / expected - 1.0).abs() < 0.01, "{volume} {expected}");
        assert!((heights[33 * w + 40] - 8.0).abs() < 0.1);
    }
}
