//! A sensor from presses of a ball: rest frame, noise, gel and colours, with the error on presses held out.

mod moments;
mod rest;
mod ridge;
mod samples;
#[cfg(test)]
mod tests;

pub use ridge::Smoothness;

use super::circle::{Seen, look, reference_frame};
use super::compare::{CompareError, PressComparison, PressScore, predict_ball, score_press};
use super::mark::{self, MarkError};
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
pub const MIN_PRESSES: usize = 4;

/// With fewer presses the error is that of leaving out one at a time, and is not to be relied on.
pub const FEW_PRESSES: usize = 12;

/// Sizes of the blurs of the deformation, in millimetres.
const KERNELS_MM: [f64; 3] = [2.1, 1.0, 0.5];

/// Share of the press below which the gel follows the ball.
const RESTORE_DEPTH_FRACTION: f64 = 0.4;

/// Radii of curvature that are tried for a domed gel: that of Taxim's gel map (1.4 mm of sag on a half diagonal of 11.8 mm),
/// and twice it.
const DOME_RADII_M: [f64; 2] = [0.1, 0.05];

/// A dome has to be better than a flat gel by this factor.
const DOME_GAIN: f64 = 0.98;

/// Height of a gel pressed flat as a whole, see `Samples::flat`.
const FLAT_HEIGHT_MM: f32 = 1.0;

/// Features of the surroundings may exceed those of the presses by this factor, since they are sampled on cells.
const AROUND_MARGIN: f32 = 1.1;

/// Limit of what is not limited.
const NO_LIMIT: f32 = 1e6;

/// How to calibrate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrateOptions {
    /// Folds of the cross-validation; press i is held out in fold `i % folds`. At least 2. `None`: 4, and one for each
    /// press where there are fewer than [`FEW_PRESSES`].
    pub folds: Option<usize>,
    /// The gel at rest; `None`: flat or dome, by the error on held-out presses.
    pub gel_shape: Option<GelShape>,
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
    /// Folds of the cross-validation.
    pub folds: usize,
    /// What the last fit, to all presses, chose.
    pub smoothness: Smoothness,
    /// Where each press was taken to touch: as marked, or as found where nobody marked it.
    pub circles: Vec<Circle>,
    /// Presses whose mark shows no contact although the image does: scored, but not fitted to.
    pub doubtful: Vec<String>,
    /// Marks that show no contact where they are so many that the search is doubted instead: all were fitted to.
    pub distrusted: usize,
}

/// Why presses cannot be calibrated with.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Too few presses.
    #[error("{found} presses, a calibration needs at least {MIN_PRESSES}")]
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
    /// Images too small or too large.
    #[error("{what} is {found} pixels, it must be from 16 to 4096")]
    Pixels {
        /// Which side.
        what: &'static str,
        /// Its length.
        found: u32,
    },
    /// A mark that cannot be.
    #[error(transparent)]
    Mark(#[from] MarkError),
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
    let marked = set
        .presses
        .iter()
        .map(|p| Ok((p, mark::checked(p, set.ball_m, grid.metres_per_px)?)))
        .collect::<Result<Vec<Marked<'_>>, MarkError>>()?;
    let (trusted, distrusted) = trusted(set, &marked)?;
    let shapes = match &options.gel_shape {
        Some(shape) => vec![shape.clone()],
        None => std::iter::once(GelShape::Flat).chain(domes(&grid)).collect(),
    };
    let candidates: Vec<Candidate> =
        shapes.into_iter().map(|shape| Candidate::new(shape, &marked, set.ball_m, &grid)).collect();
    let flat = Moments::of_inputs(&Samples::flat(FLAT_HEIGHT_MM, &grid));
    let fit = Fit { set, grid, marked: &marked, candidates: &candidates, flat };

    let usual = if marked.len() < FEW_PRESSES { marked.len() } else { 4 };
    let folds = options.folds.unwrap_or(usual).clamp(2, marked.len());
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
    Ok(Calibration { sensor, held_out, predicted, folds, smoothness, circles, doubtful, distrusted })
}

/// Which presses are marked where something is to be seen. Should that leave too few of them, it is the search that
/// fails on this sensor, and all are trusted; the number of marks that it doubts comes beside.
fn trusted(set: &PressSet, marked: &[Marked<'_>]) -> Result<(Vec<bool>, usize), CalibrateError> {
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    let Some(rest) = reference_frame(set) else { return Ok((vec![true; marked.len()], 0)) };
    let seen: Vec<Seen> =
        marked.iter().map(|(press, circle)| look(&press.image, &rest, circle, ball_radius_px)).collect();
    if seen.iter().all(|s| *s == Seen::Nothing) {
        return Err(CalibrateError::Nothing);
    }
    let trusted: Vec<bool> = seen.iter().map(|s| *s == Seen::Here).collect();
    let count = trusted.iter().filter(|&&t| t).count();
    if count < MIN_PRESSES || 4 * count < 3 * marked.len() {
        return Ok((vec![true; marked.len()], marked.len() - count));
    }
    Ok((trusted, 0))
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
        let mut slope_limit = 0.0f32;
        let mut around_limit = vec![0.0f32; candidate.samples[seen[0]].largest.1.len()];
        for (slope, features) in largest {
            slope_limit = slope_limit.max(*slope);
            around_limit.iter_mut().zip(features).for_each(|(l, f)| *l = l.max(AROUND_MARGIN * f));
        }
        // Heights alone may grow: over a wide flat contact they cancel, see `Samples::flat`.
        AROUND_HEIGHTS.iter().for_each(|&level| around_limit[level] = NO_LIMIT);
        Ok(ColourModel::Regressor(Box::new(Regressor {
            mm_per_px: self.grid.metres_per_px * 1e3,
            near,
            around,
            slope_limit,
            height_limit_mm: NO_LIMIT,
            around_limit,
        })))
    }
}

/// Domes to try on a window of this size.
fn domes(grid: &Grid) -> [GelShape; 2] {
    let (x, y) = grid.centre_m(grid.width_px - 1, grid.height_px - 1);
    DOME_RADII_M.map(|radius_m| GelShape::Dome { sag_m: (x * x + y * y) / (2.0 * radius_m) })
}

/// The grid of a set whose numbers make sense.
fn check(set: &PressSet) -> Result<Grid, CalibrateError> {
    if set.presses.len() < MIN_PRESSES {
        return Err(CalibrateError::TooFew { found: set.presses.len() });
    }
    let lengths =
        [("the side of a pixel", set.metres_per_px, 1e-7..=1e-3), ("the ball", set.ball_m, 1e-4..=0.1)];
    for ((what, value, range), text) in lengths.into_iter().zip(["from 0.0001 to 1 mm", "from 0.1 to 100 mm"])
    {
        if !range.contains(&value) {
            return Err(CalibrateError::Value { what, value_mm: (value * 1e9).round() * 1e-6, range: text });
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
    for (what, n) in [("an image's width", wanted.0), ("an image's height", wanted.1)] {
        if !(16..=4096).contains(&n) {
            return Err(CalibrateError::Pixels { what, found: n });
        }
    }
    Ok(Grid { width_px: wanted.0 as usize, height_px: wanted.1 as usize, metres_per_px: set.metres_per_px })
}
