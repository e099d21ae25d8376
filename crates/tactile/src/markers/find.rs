//! Dots in an image: the dark islands that a closing by a disc fills.

use super::Markers;
use crate::grid::{Grid, Plane, islands};

/// Width of the image that the three numbers below were measured on. With them all 63 dots of a GelSight Mini with dots are found in each of
/// 26 presses, 0.2 px (median) from the places that its owners state (yepengfei81-cpu/gelsight_gripper_controller, 2026).
const WIDTH_PX: f64 = 320.0;
/// Diameter of the disc that closes the dots; it has to be wider than a dot.
const CLOSING_PX: f64 = 19.0;
/// Share of the light around it that a dot takes, at least.
const DARKER: f32 = 0.22;
/// Pixels of a dot.
const AREA_PX: (f64, f64) = (20.0, 220.0);

/// Fewest dots of a gel with dots: a speck of dust, or a scratch, is one dark island.
const FEWEST: usize = 6;

/// A dot in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Dot {
    /// Centre of the light that it takes: column and row; pixel centres are whole numbers.
    pub centre_px: [f64; 2],
    /// Its pixels, by number from the top left.
    pub pixels: Vec<usize>,
}

/// The dots in an image of `grid`'s size, in the order of their first pixels, row by row. `levels` are the grey levels of red, green and blue.
pub fn find_dots(levels: &[Vec<f32>; 3], width_px: usize, height_px: usize) -> Vec<Dot> {
    let scale = width_px as f64 / WIDTH_PX;
    let light = Plane::from_fn(width_px, height_px, |x, y| {
        let i = y * width_px + x;
        levels[0][i].max(levels[1][i]).max(levels[2][i])
    });
    let negative = |plane: &Plane| plane.map(|v| -v);
    let radius_px = CLOSING_PX * scale / 2.0;
    let closed = negative(&widened(&negative(&widened(&light, radius_px)), radius_px));
    let taken = closed.zip(&light, |closed, light| (closed - light) / closed.max(1.0));
    let (least, most) = (AREA_PX.0 * scale * scale, AREA_PX.1 * scale * scale);
    let dark = taken.values.iter().map(|&share| share > DARKER).collect();
    let islands =
        islands(dark, width_px).into_iter().filter(|island| (least..=most).contains(&(island.len() as f64)));
    islands.map(|pixels| Dot { centre_px: centre(&taken, &pixels), pixels }).collect()
}

/// The dot that belongs to each place at rest: nearest pairs first, and at most half the distance of a place to the nearest other one.
pub fn follow_dots(found: &[Dot], rest_px: &[[f64; 2]]) -> Vec<Option<usize>> {
    let apart = |a: [f64; 2], b: [f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, &rest) in rest_px.iter().enumerate() {
        let others = rest_px.iter().enumerate().filter(|(j, _)| *j != i);
        let reach = others.map(|(_, &other)| apart(rest, other)).fold(f64::INFINITY, f64::min) / 2.0;
        pairs.extend(found.iter().enumerate().filter_map(|(j, dot)| {
            let far = apart(rest, dot.centre_px);
            (far <= reach).then_some((far, i, j))
        }));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let (mut of_rest, mut taken) = (vec![None; rest_px.len()], vec![false; found.len()]);
    for (_, i, j) in pairs {
        if of_rest[i].is_none() && !taken[j] {
            (of_rest[i], taken[j]) = (Some(j), true);
        }
    }
    of_rest
}

impl Markers {
    /// The dots of a frame at rest; `None` of a gel without dots.
    ///
    /// A dot is drawn as a disc: it takes as much light as the dots found take in the mean, in its middle and in all.
    pub fn of_rest(rest: &[Vec<f32>; 3], grid: &Grid) -> Option<Self> {
        let dots = find_dots(rest, grid.width_px, grid.height_px);
        if dots.len() < FEWEST {
            return None;
        }
        let n = dots.len() as f64;
        let wide =
            dots.iter().map(|dot| (dot.pixels.len() as f64 / std::f64::consts::PI).sqrt()).sum::<f64>() / n;
        let rest_px: Vec<[f64; 2]> = dots.iter().map(|dot| dot.centre_px).collect();
        // The threshold leaves some of a blurred rim out.
        let outline = Self { rest_px, radius_px: wide + 1.0, darkness_rgb: [1.0; 3] };
        let clean = super::without_markers(rest, grid, &outline);
        let (mut middle, mut all) = ([0.0; 3], [0.0; 3]);
        for &[x, y] in &outline.rest_px {
            let reach = outline.radius_px + 1.5;
            let [left, right, top, bottom] = super::window(reach, &[[x, y]], grid.width_px, grid.height_px);
            let (mut sums, mut counts) = ([0.0; 3], 0.0);
            for (column, row) in (top..bottom).flat_map(|row| (left..right).map(move |column| (column, row)))
            {
                let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                let i = row * grid.width_px + column;
                let inner = r2 <= (0.5 * wide).powi(2);
                counts += f64::from(u8::from(inner));
                for c in 0..3 {
                    let taken = f64::from(1.0 - rest[c][i] / clean[c][i].max(1.0));
                    all[c] += if r2 <= reach * reach { taken / n } else { 0.0 };
                    sums[c] += if inner { taken } else { 0.0 };
                }
            }
            (0..3).for_each(|c| middle[c] += sums[c] / f64::max(counts, 1.0) / n);
        }
        let (dark, area) = (middle.iter().sum::<f64>(), all.iter().sum::<f64>());
        let radius_px = (area / dark / std::f64::consts::PI).sqrt();
        let darkness_rgb = middle.map(|share| share.clamp(0.0, 1.0) as f32);
        Some(Self { radius_px: radius_px.clamp(0.5, 64.0), darkness_rgb, ..outline })
    }
}

/// The largest value within a disc; the border is continued.
fn widened(plane: &Plane, radius_px: f64) -> Plane {
    let Plane { width, height, .. } = *plane;
    let mut most = Plane::filled(width, height, f32::NEG_INFINITY);
    for dy in 0..=radius_px as usize {
        let half = (radius_px * radius_px - (dy * dy) as f64).max(0.0).sqrt() as usize;
        let along = along_rows(plane, half);
        for y in 0..height {
            for from in [y.saturating_sub(dy), (y + dy).min(height - 1)] {
                let (to, from) = (&mut most.values[y * width..(y + 1) * width], along.row(from));
                to.iter_mut().zip(from).for_each(|(to, &from)| *to = to.max(from));
            }
        }
    }
    most
}

/// The largest of `2 half + 1` neighbours along a row, by doubling.
fn along_rows(plane: &Plane, half: usize) -> Plane {
    let (width, wanted) = (plane.width, 2 * half + 1);
    let mut values = Vec::with_capacity(plane.values.len());
    for y in 0..plane.height {
        let row = plane.row(y);
        let padded = (0..width + 2 * half).map(|x| row[x.saturating_sub(half).min(width - 1)]);
        let (mut run, mut length): (Vec<f32>, usize) = (padded.collect(), 1);
        while length < wanted {
            let step = length.min(wanted - length);
            run = (0..run.len() - step).map(|x| run[x].max(run[x + step])).collect();
            length += step;
        }
        values.extend(run);
    }
    Plane { values, ..*plane }
}

fn centre(taken: &Plane, pixels: &[usize]) -> [f64; 2] {
    let (mut x, mut y, mut sum) = (0.0, 0.0, 0.0);
    for &pixel in pixels {
        let weight = f64::from(taken.values[pixel]);
        x += weight * (pixel % taken.width) as f64;
        y += weight * (pixel / taken.width) as f64;
        sum += weight;
    }
    [x / sum, y / sum]
}
