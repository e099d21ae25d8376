//! A sensor from presses of a ball: rest frame, noise, gel and colours, with the error on presses held out.

mod moments;
mod rest;
mod ridge;
mod samples;
#[cfg(test)]
mod tests;

pub use ridge::Smoothness;

use super::circle::{is_doubtful, reference_frame};
use super::compare::{CompareError, PressComparison, PressScore, predict_ball, score_press};
use super::{Circle, Press, PressSet};
use crate::colour::regressor::AROUND_HEIGHTS;
use crate::colour::{ColourModel, Regressor, shade};
use crate::gradient::gradient;
use crate::grid::Grid;
use crate::metrics::MetricError;
use crate::sensor::{GelShape, Pyramid, Sensor};
use gripgen_twin::TactileImage;
use moments::Moments;
use rest::{noise_rgb, rest_frame};
use ridge::{Folds, solve};
use samples::{GelModel, Samples};

/// Fewest presses that can be calibrated with: less do not cover the frame, and leave none to hold out.
pub const FEWEST_PRESSES: usize = 4;

/// Sizes of the blurs of the deformation, in millimetres.
const KERNELS_MM: [f64; 3] = [2.1, 1.0, 0.5];

/// Share of the press below which the gel follows the ball.
const RESTORE_DEPTH_FRACTION: f64 = 0.4;

/// Sags at the corners that are tried for a domed gel.
const DOME_SAGS_M: [f64; 2] = [0.7e-3, 1.4e-3];

/// A dome has to be better than a flat gel by this factor.
const DOME_GAIN: f64 = 0.98;

/// Height of a gel pressed flat as a whole, see `Samples::flat`.
const FLAT_HEIGHT_MM: f32 = 1.0;

/// Features of the surroundings may exceed those of the presses by this factor, since they are sampled on cells.
const AROUND_MARGIN: f32 = 1.1;

/// Limit of what is not limited.
const NO_LIMIT: f32 = 1e6;

/// How to calibrate.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrateOptions {
    /// Folds of the cross-validation; press i is held out in fold `i % folds`. At least 2.
    pub folds: usize,
    /// The gel at rest; `None`: flat or dome, by the error on held-out presses.
    pub gel_shape: Option<GelShape>,
}

impl Default for CalibrateOptions {
    fn default() -> Self {
        Self { folds: 4, gel_shape: None }
    }
}

/// A calibrated sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Fitted to all presses.
    pub sensor: Sensor,
    /// Scores of each press by a sensor that was fitted without its fold: rest frame, gel, smoothness and colours.
    pub held_out: PressComparison,
    /// The predictions that were scored.
    pub predicted: Vec<TactileImage>,
    /// What the last fit, to all presses, chose.
    pub smoothness: Smoothness,
    /// Where each press was taken to touch: as marked, or as found where nobody marked it.
    pub circles: Vec<Circle>,
    /// Presses whose mark shows no contact although the image does: scored, but not fitted to.
    pub doubtful: Vec<String>,
}

/// Why presses cannot be calibrated with.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Too few presses.
    #[error("{found} presses, a calibration needs at least {FEWEST_PRESSES}")]
    TooFew {
        /// Presses found.
        found: usize,
    },
    /// Images of several sizes.
    #[error("press `{press}` is {}x{} pixels, the first one {}x{}", .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// The press, or the rest frame.
        press: String,
        /// Width and height of its image.
        found: (u32, u32),
        /// Width and height of the first.
        wanted: (u32, u32),
    },
    /// A contact whose centre lies beside the image.
    #[error(
        "press `{press}`: the centre ({x_px:.1}, {y_px:.1}) lies outside the {width_px}x{height_px} image"
    )]
    Outside {
        /// The press.
        press: String,
        /// Centre, along the columns.
        x_px: f64,
        /// Centre, down the rows.
        y_px: f64,
        /// Width of the image.
        width_px: u32,
        /// Height of the image.
        height_px: u32,
    },
    /// A contact wider than the ball, or without width.
    #[error("press `{press}`: the radius is {radius_mm:.3} mm, the ball's {ball_mm:.3} mm")]
    Radius {
        /// The press.
        press: String,
        /// Radius of the contact.
        radius_mm: f64,
        /// Radius of the ball.
        ball_mm: f64,
    },
    /// Nobody marked the contact, and none is to be seen.
    #[error("press `{press}` has no centre and radius, and no contact is to be seen in it")]
    NoCircle {
        /// The press.
        press: String,
    },
    /// A size that cannot be.
    #[error("{what} is {value_mm} mm, it must be {range}")]
    Value {
        /// What.
        what: &'static str,
        /// Its value.
        value_mm: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// The presses show no contact to learn from.
    #[error("the presses show no change of colour that a fit could use")]
    Nothing,
    /// Comparing the held-out presses.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Images too small to compare.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// A press with its checked circle.
type Marked<'a> = (&'a Press, Circle);

/// Calibrates a sensor, and says how well it predicts presses that it has not seen.
///
/// Contacts that nobody marked are looked for.
pub fn calibrate_presses(set: &PressSet, options: &CalibrateOptions) -> Result<Calibration, CalibrateError> {
    let grid = check(set)?;
    if set.presses.iter().any(|press| press.circle.is_none()) {
        let mut marked = set.clone();
        marked.mark_missing();
        return calibrate_marked(&marked, options, grid);
    }
    calibrate_marked(set, options, grid)
}

fn calibrate_marked(
    set: &PressSet,
    options: &CalibrateOptions,
    grid: Grid,
) -> Result<Calibration, CalibrateError> {
    let marked = set.presses.iter().map(|p| marked(p, set, &grid)).collect::<Result<Vec<_>, _>>()?;
    let trusted = trusted(set, &marked);
    let shapes = match &options.gel_shape {
        Some(shape) => vec![shape.clone()],
        None => {
            std::iter::once(GelShape::Flat).chain(DOME_SAGS_M.map(|sag_m| GelShape::Dome { sag_m })).collect()
        }
    };
    let candidates: Vec<Candidate> =
        shapes.into_iter().map(|shape| Candidate::new(shape, &marked, set.ball_m, &grid)).collect();
    let flat = Moments::of_inputs(&Samples::flat(FLAT_HEIGHT_MM));
    let fit = Fit { set, grid, marked: &marked, candidates: &candidates, flat };

    let folds = options.folds.clamp(2, marked.len());
    let mut predicted = vec![None; marked.len()];
    for fold in 0..folds {
        let (unseen, mut seen): (Vec<usize>, Vec<usize>) = (0..marked.len()).partition(|i| i % folds == fold);
        seen.retain(|&i| trusted[i]);
        let (sensor, _) = fit.fit(&seen)?;
        for i in unseen {
            predicted[i] = Some(predict_ball(&marked[i].1, set.ball_m, &sensor));
        }
    }
    let predicted: Vec<TactileImage> = predicted.into_iter().flatten().collect();
    let scored = set.presses.iter().zip(&predicted).map(|(press, image)| {
        let scores = score_press(press, image)?;
        Ok(PressScore { name: press.name.clone(), scores })
    });
    let each = scored.collect::<Result<Vec<_>, MetricError>>()?;
    let held_out = PressComparison::from_each(each).ok_or(CompareError::Empty)?;
    let everything: Vec<usize> = (0..marked.len()).filter(|&i| trusted[i]).collect();
    let (sensor, smoothness) = fit.fit(&everything)?;
    let circles = marked.iter().map(|(_, circle)| *circle).collect();
    let doubtful = (0..marked.len()).filter(|&i| !trusted[i]).map(|i| marked[i].0.name.clone()).collect();
    Ok(Calibration { sensor, held_out, predicted, smoothness, circles, doubtful })
}

/// Which presses are marked where something is to be seen. Should that leave too few of them, it is the search that
/// fails on this sensor, and all are trusted.
fn trusted(set: &PressSet, marked: &[Marked<'_>]) -> Vec<bool> {
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    let Some(rest) = reference_frame(set) else { return vec![true; marked.len()] };
    let trusted: Vec<bool> = marked
        .iter()
        .map(|(press, circle)| !is_doubtful(&press.image, &rest, circle, ball_radius_px))
        .collect();
    let count = trusted.iter().filter(|&&t| t).count();
    if count < FEWEST_PRESSES || 4 * count < 3 * marked.len() { vec![true; marked.len()] } else { trusted }
}

/// One gel to try, with what the presses look like on it.
struct Candidate {
    gel: GelModel,
    samples: Vec<Samples>,
    moments: Vec<Moments>,
}

impl Candidate {
    fn new(shape: GelShape, marked: &[Marked<'_>], ball_m: f64, grid: &Grid) -> Self {
        let gel = GelModel { shape, pyramid: pyramid(grid) };
        let samples: Vec<Samples> = marked
            .iter()
            .enumerate()
            .map(|(i, (_, circle))| Samples::draw(i, circle, ball_m, grid, &gel))
            .collect();
        let moments = samples.iter().map(Moments::of_inputs).collect();
        Self { gel, samples, moments }
    }

    /// The sums of some presses with their colours against a rest frame.
    fn coloured(&self, marked: &[Marked<'_>], which: &[usize], rest: &[Vec<f32>; 3]) -> Vec<Moments> {
        which
            .iter()
            .map(|&i| {
                let mut moments = self.moments[i].clone();
                moments.set_targets(&self.samples[i], &self.samples[i].targets(marked[i].0, rest));
                moments
            })
            .collect()
    }
}

/// The deformation at this resolution: kernels of fixed size on the gel.
fn pyramid(grid: &Grid) -> Pyramid {
    let mm_per_px = grid.metres_per_px * 1e3;
    let mut kernels_px: Vec<u32> =
        KERNELS_MM.iter().map(|mm| 2 * (mm / mm_per_px / 2.0).floor() as u32 + 1).collect();
    kernels_px.retain(|&k| k >= 3);
    kernels_px.iter_mut().for_each(|k| *k = (*k).min(255));
    Pyramid { kernels_px, restore_depth_fraction: RESTORE_DEPTH_FRACTION }
}

/// All that a fit to some of the presses needs.
struct Fit<'a> {
    set: &'a PressSet,
    grid: Grid,
    marked: &'a [Marked<'a>],
    candidates: &'a [Candidate],
    flat: Moments,
}

impl Fit<'_> {
    /// Fits to the presses `seen` and to nothing else.
    fn fit(&self, seen: &[usize]) -> Result<(Sensor, Smoothness), CalibrateError> {
        let presses: Vec<Marked<'_>> = seen.iter().map(|&i| self.marked[i]).collect();
        let raw = self.set.rest.as_ref();
        let mut rest = rest_frame(&presses, |_| None, raw, &self.grid);
        let (candidate, smoothness) = self.choose(seen, &rest);
        let mut colour = self.colours(candidate, &smoothness, seen, &rest)?;
        // Once more, now that the change of each press is known.
        let change = |i: usize| {
            let surface = candidate.gel.surface(&presses[i].1, self.set.ball_m, &self.grid);
            let (along_x, along_y) = gradient(&surface);
            Some(shade(&colour, &surface, &along_x, &along_y, None))
        };
        rest = rest_frame(&presses, change, raw, &self.grid);
        colour = self.colours(candidate, &smoothness, seen, &rest)?;
        // A 64th of a grey level is far below the noise, and packs well.
        rest.iter_mut().flatten().for_each(|v| *v = (*v * 64.0).round() / 64.0);
        let sensor = Sensor {
            markers: None,
            shadow: None,
            grid: self.grid,
            noise_rgb: noise_rgb(&presses, &rest, &self.grid),
            rest,
            colour,
            gel_shape: candidate.gel.shape.clone(),
            pyramid: Some(candidate.gel.pyramid.clone()),
            ball_m: Some(self.set.ball_m),
        };
        Ok((sensor, smoothness))
    }

    /// The gel and the smoothness with the least error on presses of `seen` that are held out in turn.
    fn choose(&self, seen: &[usize], rest: &[Vec<f32>; 3]) -> (&Candidate, Smoothness) {
        let mut best: Option<(&Candidate, Folds<'_>, f64)> = None;
        for candidate in self.candidates {
            let moments = candidate.coloured(self.marked, seen, rest);
            let folds = Folds::split(&moments, &self.flat, 4);
            let error = folds.error(&Smoothness::USUAL);
            if best.as_ref().is_none_or(|(_, _, least)| error < DOME_GAIN * least) {
                best = Some((candidate, folds, error));
            }
        }
        let (candidate, folds, _) = best.expect("there is at least one candidate");
        (candidate, folds.choose())
    }

    fn colours(
        &self,
        candidate: &Candidate,
        smoothness: &Smoothness,
        seen: &[usize],
        rest: &[Vec<f32>; 3],
    ) -> Result<ColourModel, CalibrateError> {
        let mut sums = Moments::zero();
        for moments in candidate.coloured(self.marked, seen, rest) {
            sums.add(&moments);
        }
        let solution = solve(&sums, &self.flat, smoothness).ok_or(CalibrateError::Nothing)?;
        let (near, around) = solution.near_and_around();
        let largest = seen.iter().map(|&i| &candidate.samples[i].largest);
        let (mut slope_limit, mut height_limit_mm) = (0.0f32, 0.0f32);
        let mut around_limit = vec![0.0f32; candidate.samples[seen[0]].largest.2.len()];
        for (slope, height, features) in largest {
            slope_limit = slope_limit.max(*slope);
            height_limit_mm = height_limit_mm.max(*height);
            around_limit.iter_mut().zip(features).for_each(|(l, f)| *l = l.max(AROUND_MARGIN * f));
        }
        // Heights alone may grow: over a wide flat contact they cancel, see `Samples::flat`.
        height_limit_mm = NO_LIMIT;
        AROUND_HEIGHTS.iter().for_each(|&level| around_limit[level] = NO_LIMIT);
        Ok(ColourModel::Regressor(Box::new(Regressor {
            mm_per_px: self.grid.metres_per_px * 1e3,
            near,
            around,
            slope_limit,
            height_limit_mm,
            around_limit,
        })))
    }
}

/// The grid of a set whose numbers make sense.
fn check(set: &PressSet) -> Result<Grid, CalibrateError> {
    if set.presses.len() < FEWEST_PRESSES {
        return Err(CalibrateError::TooFew { found: set.presses.len() });
    }
    let lengths =
        [("the side of a pixel", set.metres_per_px, 1e-6..=1e-3), ("the ball", set.ball_m, 1e-4..=0.1)];
    for ((what, value, range), text) in lengths.into_iter().zip(["from 0.001 to 1 mm", "from 0.1 to 100 mm"])
    {
        if !range.contains(&value) {
            return Err(CalibrateError::Value { what, value_mm: value * 1e3, range: text });
        }
    }
    let size = |image: &TactileImage| (image.width_px, image.height_px);
    let wanted = size(&set.presses[0].image);
    let images = set.presses.iter().map(|p| (p.name.as_str(), &p.image));
    for (name, image) in images.chain(set.rest.as_ref().map(|image| ("rest frame", image))) {
        if size(image) != wanted {
            return Err(CalibrateError::Size { press: name.into(), found: size(image), wanted });
        }
    }
    Ok(Grid { width_px: wanted.0 as usize, height_px: wanted.1 as usize, metres_per_px: set.metres_per_px })
}

/// A press with a circle that can be. One up to 5 % wider than the ball is taken for its equator: hand-drawn circles
/// are that unsure.
fn marked<'a>(press: &'a Press, set: &PressSet, grid: &Grid) -> Result<Marked<'a>, CalibrateError> {
    let name = || press.name.clone();
    let circle = press.circle.ok_or_else(|| CalibrateError::NoCircle { press: name() })?;
    let (width_px, height_px) = (press.image.width_px, press.image.height_px);
    let inside = |v: f64, n: u32| (-0.5..=f64::from(n) - 0.5).contains(&v);
    if !inside(circle.x_px, width_px) || !inside(circle.y_px, height_px) {
        let (x_px, y_px) = (circle.x_px, circle.y_px);
        return Err(CalibrateError::Outside { press: name(), x_px, y_px, width_px, height_px });
    }
    let ball_px = set.ball_m / 2.0 / grid.metres_per_px;
    if !(circle.radius_px > 0.0 && circle.radius_px <= 1.05 * ball_px) {
        let radius_mm = circle.radius_px * grid.metres_per_px * 1e3;
        return Err(CalibrateError::Radius { press: name(), radius_mm, ball_mm: set.ball_m / 2.0 * 1e3 });
    }
    Ok((press, Circle { radius_px: circle.radius_px.min(0.999 * ball_px), ..circle }))
}
