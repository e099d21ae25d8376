//! A sensor file against presses: predicted and real image of each.

use super::mark::{self, MarkError};
use super::{Circle, Press, PressSet};
use crate::grid::{Grid, Plane};
use crate::indent::Imprint;
use crate::metrics::{MetricError, Score, score};
use crate::render::Renderer;
use crate::sensor::{GelShape, Pyramid, Sensor};
use crate::simd::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{ContactPatch, Gel, TactileImage};

/// Sides of the crops around the contact, at the resolution of the calibration.
pub const CROPS_PX: [u32; 2] = [400, 200];

/// Why presses and a sensor cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Nothing to compare.
    #[error("the set holds no press")]
    Empty,
    /// Images of another size than the sensor's.
    #[error("press `{press}` is {}x{} pixels, the sensor has {}x{}", .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// The press.
        press: String,
        /// Width and height of its image.
        found: (u32, u32),
        /// Width and height of the sensor.
        wanted: (u32, u32),
    },
    /// A mark that cannot be.
    #[error(transparent)]
    Mark(#[from] MarkError),
    /// The images are too small to compare.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// The scores of one press: the whole frame, and the crops of [`CROPS_PX`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scores {
    /// The whole frame.
    pub full: Score,
    /// 400 x 400 pixels.
    pub crop400: Score,
    /// 200 x 200 pixels.
    pub crop200: Score,
}

/// One press.
#[derive(Debug, Clone, PartialEq)]
pub struct PressScore {
    /// Its name.
    pub name: String,
    /// How its prediction differs from it.
    pub scores: Scores,
}

/// All presses.
#[derive(Debug, Clone, PartialEq)]
pub struct PressComparison {
    /// Means over the presses.
    pub mean: Scores,
    /// Each press, in the order of the set.
    pub each: Vec<PressScore>,
}

impl PressComparison {
    /// From the scores of each press; `None` without any.
    pub fn from_each(each: Vec<PressScore>) -> Option<Self> {
        let n = each.len() as f64;
        if each.is_empty() {
            return None;
        }
        let mean = |of: fn(&Scores) -> Score| {
            let sum = |value: fn(&Score) -> f64| each.iter().map(|p| value(&of(&p.scores))).sum::<f64>() / n;
            Score {
                mse: sum(|s| s.mse),
                psnr_db: sum(|s| s.psnr_db),
                ssim: sum(|s| s.ssim),
                l1: sum(|s| s.l1),
            }
        };
        let mean =
            Scores { full: mean(|s| s.full), crop400: mean(|s| s.crop400), crop200: mean(|s| s.crop200) };
        Some(Self { mean, each })
    }
}

/// Compares the images that `sensor` predicts for the contacts with the real ones. Contacts that nobody marked are
/// looked for.
///
/// # Errors
///
/// A set without presses, images of another size than those of the sensor, or a press without a valid mark.
pub fn compare_presses(set: &PressSet, sensor: &Sensor) -> Result<PressComparison, CompareError> {
    let mut completed = None;
    if set.presses.iter().any(|press| press.circle.is_none()) {
        completed.insert(set.clone()).mark_missing();
    }
    let set = completed.as_ref().unwrap_or(set);
    let mut each = Vec::with_capacity(set.presses.len());
    for press in &set.presses {
        let predicted = predict_press(press, set.ball_m, sensor)?;
        let scores = score_press(press, &predicted)?;
        each.push(PressScore { name: press.name.clone(), scores });
    }
    PressComparison::from_each(each).ok_or(CompareError::Empty)
}

/// The image that `sensor` predicts for a press, without noise.
///
/// # Errors
///
/// A press without a valid mark, or an image of another size than those of the sensor.
pub fn predict_press(press: &Press, ball_m: f64, sensor: &Sensor) -> Result<TactileImage, CompareError> {
    let found = (press.image.width_px, press.image.height_px);
    let wanted = (sensor.grid.width_px as u32, sensor.grid.height_px as u32);
    if found != wanted {
        return Err(CompareError::Size { press: press.name.clone(), found, wanted });
    }
    let circle = mark::checked(press, ball_m, sensor.grid.metres_per_px)?;
    Ok(predict_ball(&circle, ball_m, sensor))
}

/// The image of a ball whose rim of contact is `circle`, without noise.
pub(crate) fn predict_ball(circle: &Circle, ball_m: f64, sensor: &Sensor) -> TactileImage {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let imprint = ball_imprint(circle, ball_m, &sensor.grid, &sensor.gel_shape);
    renderer.image(Some(&imprint), None)
}

/// The imprint of a ball whose rim of contact is `circle`, relative to the gel at rest.
///
/// On a flat gel that is the cap of the ball below the plane of the circle. On a curved one the circle lies on the
/// slope of the gel under it: the ball's centre stands off the circle's by `sqrt(R^2 - a^2)` along the gel's normal.
pub(crate) fn ball_imprint(circle: &Circle, ball_m: f64, grid: &Grid, shape: &GelShape) -> Imprint {
    let press_depth_m = circle.depth_m(ball_m, grid.metres_per_px);
    let radius_px = ball_m / 2.0 / grid.metres_per_px;
    let sunk_px = radius_px - press_depth_m / grid.metres_per_px;
    let (w, h) = (grid.width_px, grid.height_px);
    let rest = shape.rest_px(grid);
    let rest_at = |x: f64, y: f64| {
        let inside = |v: f64, n: usize| v.round().clamp(0.0, (n - 1) as f64) as usize;
        rest.as_ref().map_or(0.0, |rest| f64::from(rest.at(inside(x, w), inside(y, h))))
    };
    let (cx, cy, a) = (circle.x_px, circle.y_px, circle.radius_px);
    let slope = [
        (rest_at(cx + a, cy) - rest_at(cx - a, cy)) / (2.0 * a),
        (rest_at(cx, cy + a) - rest_at(cx, cy - a)) / (2.0 * a),
    ];
    let ball = [cx - sunk_px * slope[0], cy - sunk_px * slope[1]];
    let rim = [(a, 0.0), (-a, 0.0), (0.0, a), (0.0, -a)];
    let above_rim = |x: f64, y: f64| {
        let (dx, dy) = (x - ball[0], y - ball[1]);
        (radius_px * radius_px - dx * dx - dy * dy).max(0.0).sqrt() - rest_at(x, y)
    };
    let level = match &rest {
        None => sunk_px,
        Some(_) => rim.iter().map(|(dx, dy)| above_rim(cx + dx, cy + dy)).sum::<f64>() / 4.0,
    };
    let mut depth_px = Plane::filled(w, h, 0.0);
    for (i, depth) in depth_px.values.iter_mut().enumerate() {
        let (x, y) = ((i % w) as f64, (i / w) as f64);
        // Far from the ball the gel itself falls away; only the ball's own cap counts.
        let (dx, dy) = (x - ball[0], y - ball[1]);
        if dx * dx + dy * dy < radius_px * radius_px {
            *depth = (above_rim(x, y) - level).max(0.0) as f32;
        }
    }
    let deepest = depth_px.values.iter().fold(0.0f32, |m, &d| m.max(d));
    let press_depth_m = if rest.is_some() { f64::from(deepest) * grid.metres_per_px } else { press_depth_m };
    Imprint { depth_px, press_depth_m, patch: ContactPatch { cells: Vec::new() }, elastic: None }
}

/// What the renderer needs of a gel: the deformation of the calibration, or that of Wucherer et al. 2023.
pub(super) fn gel_of(sensor: &Sensor) -> Gel {
    let usual = || Pyramid { kernels_px: vec![71, 51, 21, 11, 5], restore_depth_fraction: 0.4 };
    let pyramid = sensor.pyramid.clone().unwrap_or_else(usual);
    Gel {
        model: GelModel::Pyramid,
        elastic: None,
        thickness_m: f64::INFINITY,
        width_m: sensor.grid.width_px as f64 * sensor.grid.metres_per_px,
        height_m: sensor.grid.height_px as f64 * sensor.grid.metres_per_px,
        shear_stiffness_n_per_m: 0.0,
        shear_by_area: 1.0,
        kernels_px: pyramid.kernels_px,
        restore_depth_fraction: pyramid.restore_depth_fraction,
    }
}

/// How a predicted image differs from the real one.
///
/// # Errors
///
/// Images of two sizes, or too small for the structural similarity.
pub fn score_press(press: &Press, predicted: &TactileImage) -> Result<Scores, MetricError> {
    let centre = press
        .circle
        .map_or((f64::from(predicted.width_px) / 2.0, f64::from(predicted.height_px) / 2.0), |c| {
            (c.x_px, c.y_px)
        });
    let cropped = |side_px| score(&crop(predicted, centre, side_px), &crop(&press.image, centre, side_px));
    Ok(Scores {
        full: score(predicted, &press.image)?,
        crop400: cropped(CROPS_PX[0])?,
        crop200: cropped(CROPS_PX[1])?,
    })
}

/// A square around `centre`, shifted inside the frame; a frame smaller than the square is taken whole.
pub fn crop(image: &TactileImage, centre: (f64, f64), side_px: u32) -> TactileImage {
    let range = |centre: f64, n: u32| {
        let side = side_px.min(n);
        let first = (centre.round() - f64::from(side / 2)).clamp(0.0, f64::from(n - side)) as u32;
        (first, side)
    };
    let (x0, width_px) = range(centre.0, image.width_px);
    let (y0, height_px) = range(centre.1, image.height_px);
    let mut rgb = Vec::with_capacity(3 * (width_px * height_px) as usize);
    for y in y0..y0 + height_px {
        let from = 3 * (y * image.width_px + x0) as usize;
        rgb.extend_from_slice(&image.rgb[from..from + 3 * width_px as usize]);
    }
    TactileImage { width_px, height_px, rgb }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_stay_inside_the_frame() {
        let rgb = (0..3 * 12 * 10).map(|i| (i / 3) as u8).collect();
        let image = TactileImage { width_px: 12, height_px: 10, rgb };
        let first = |centre, side| crop(&image, centre, side).rgb[0];
        assert_eq!(first((6.0, 5.0), 4), 3 * 12 + 4, "centred");
        assert_eq!(first((0.0, 0.0), 4), 0);
        assert_eq!(first((11.0, 9.0), 4), 6 * 12 + 8);
        let whole = crop(&image, (3.0, 3.0), 400);
        assert_eq!(whole, image);
    }

    #[test]
    fn a_ball_is_as_deep_as_its_circle_says() {
        let grid = Grid { width_px: 101, height_px: 81, metres_per_px: 1e-4 };
        let circle = Circle { x_px: 50.0, y_px: 40.0, radius_px: 17.320_508 };
        let imprint = ball_imprint(&circle, 4e-3, &grid, &GelShape::Flat);
        // A circle of sqrt(3) mm is a cap of 1 mm.
        assert!((imprint.press_depth_m - 1e-3).abs() < 1e-9);
        assert!((imprint.depth_px.at(50, 40) - 10.0).abs() < 1e-4);
        assert_eq!(imprint.depth_px.at(50, 40 + 18), 0.0);
        assert!(imprint.depth_px.at(50 + 17, 40) > 0.0);
    }
}
