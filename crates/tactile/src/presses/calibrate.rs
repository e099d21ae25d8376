//! A sensor from presses of a ball: rest frame, noise, gel and colours, with the error on presses held out.

mod gel;
mod moments;
mod resized;
mod rest;
mod ridge;
mod samples;
#[cfg(test)]
mod tests;

pub(super) use gel::MAX_KERNEL_PX;
pub(super) use resized::Resized;
pub use ridge::Smoothness;

use super::circle::{Seen, look, reference_frame};
use super::compare::{CompareError, PressComparison, predict_taken, score_press};
use super::contact::{MarkError, Marked, checked};
use super::gain::{gains, without_gains};
use super::{Circle, PressSet};
use crate::colour::regressor::{AROUND_FITTED, AROUND_HEIGHTS, SURROUNDINGS};
use crate::colour::{ColourModel, Regressor, shade};
use crate::gradient::gradient;
use crate::grid::Grid;
use crate::markers::Markers;
use crate::metrics::MetricError;
use crate::sensor::{GelShape, Sensor};
use gel::{Candidate, Gels};
use gripgen_twin::TactileImage;
use moments::Moments;
use rest::{noise_rgb, rest_frame};
use ridge::solve;

/// Fewest presses that can be calibrated with: less do not cover the frame, and leave none to hold out.
pub const MIN_PRESSES: usize = 4;

/// With fewer presses the error is that of leaving out one at a time, and is not to be relied on.
pub const FEW_PRESSES: usize = 12;

/// Radii of curvature that are tried for a domed gel: that of Taxim's gel map (1.4 mm of sag on a half diagonal of 11.8 mm),
/// and twice it.
const DOME_RADII_M: [f64; 2] = [0.1, 0.05];

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

/// Calibrates a sensor, and says how well it predicts presses that it has not seen.
///
/// Where each press has a gain of its own (an automatic white balance), it is taken from the pixels away from the contact and
/// divided out; of a press held out too, of which nothing else is looked at.
///
/// Contacts that nobody marked are looked for, and so are dots on the gel, which no fit looks at.
pub fn calibrate_presses(set: &PressSet, options: &CalibrateOptions) -> Result<Calibration, CalibrateError> {
    let grid = check(set)?;
    let mut marked = set.clone();
    marked.mark_missing();
    let dotted = marked.mark_dots().is_some();
    calibrate_marked(&marked, options, grid, dotted)
}

fn calibrate_marked(
    set: &PressSet,
    options: &CalibrateOptions,
    grid: Grid,
    dotted: bool,
) -> Result<Calibration, CalibrateError> {
    let marked = set
        .presses
        .iter()
        .map(|p| Ok((p, checked(p, set.ball_m, grid.metres_per_px)?)))
        .collect::<Result<Vec<Marked<'_>>, MarkError>>()?;
    let gains = gains(&marked, set.rest.as_ref(), &grid);
    let balanced = gains.as_ref().map(|gains| without_gains(set, gains));
    let (as_taken, set) = (set, balanced.as_ref().unwrap_or(set));
    let marked: Vec<Marked<'_>> =
        set.presses.iter().zip(marked).map(|(press, (_, contact))| (press, contact)).collect();
    let (trusted, distrusted) = trusted(set, &marked)?;
    let gels = Gels::new(options.gel_shape.as_ref(), &marked, set.ball_m, grid);
    let press_gain_sd = gains.as_ref().map(|gains| gains.sd);
    let fit = Fit { set, grid, marked: &marked, press_gain_sd, dotted };

    let usual = if marked.len() < FEW_PRESSES { marked.len() } else { 4 };
    let folds = options.folds.unwrap_or(usual).clamp(2, marked.len());
    let mut predicted = vec![None; marked.len()];
    for fold in 0..folds {
        let (unseen, mut seen): (Vec<usize>, Vec<usize>) = (0..marked.len()).partition(|i| i % folds == fold);
        seen.retain(|&i| trusted[i]);
        let (sensor, _) = fit.fit(&gels, &seen)?;
        for i in unseen {
            predicted[i] = Some(predict_taken(&as_taken.presses[i], &marked[i].1, set.ball_m, &sensor));
        }
    }
    let predicted: Vec<TactileImage> = predicted.into_iter().flatten().collect();
    let scored = as_taken.presses.iter().zip(&predicted).map(|(press, image)| score_press(press, image));
    let each = scored.collect::<Result<Vec<_>, MetricError>>()?;
    let held_out = PressComparison::from_each(each).ok_or(CompareError::Empty)?;
    let everything: Vec<usize> = (0..marked.len()).filter(|&i| trusted[i]).collect();
    let (sensor, smoothness) = fit.fit(&gels, &everything)?;
    let circles = marked.iter().map(|(_, contact)| contact.circle).collect();
    let doubtful = (0..marked.len()).filter(|&i| !trusted[i]).map(|i| marked[i].0.name.clone()).collect();
    Ok(Calibration { sensor, held_out, predicted, folds, smoothness, circles, doubtful, distrusted })
}

/// Which presses are marked where something is to be seen. Should that leave too few of them, it is the search that
/// fails on this sensor, and all are trusted; the number of marks that it doubts comes beside.
fn trusted(set: &PressSet, marked: &[Marked<'_>]) -> Result<(Vec<bool>, usize), CalibrateError> {
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    let Some(rest) = reference_frame(set) else { return Ok((vec![true; marked.len()], 0)) };
    // Who gives a body its place has seen it.
    let seen = |(press, contact): &Marked<'_>| match &contact.indenter {
        Some(_) => Seen::Here,
        None => look(&press.image, &rest, &contact.circle, ball_radius_px),
    };
    let seen: Vec<Seen> = marked.iter().map(seen).collect();
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

/// All that a fit to some of the presses needs.
struct Fit<'a> {
    set: &'a PressSet,
    grid: Grid,
    marked: &'a [Marked<'a>],
    press_gain_sd: Option<[f32; 3]>,
    /// Whether the gel has dots.
    dotted: bool,
}

impl Fit<'_> {
    /// Fits to the presses `seen` and to nothing else.
    fn fit(&self, gels: &Gels<'_>, seen: &[usize]) -> Result<(Sensor, Smoothness), CalibrateError> {
        let presses: Vec<Marked<'_>> = seen.iter().map(|&i| self.marked[i].clone()).collect();
        let rest = rest_frame(&presses, |_| None, self.set.rest.as_ref(), &self.grid);
        let (candidate, smoothness) = gels.choose(seen, &rest);
        Ok((self.fit_on(candidate, smoothness, seen)?, smoothness))
    }

    /// The same on a gel that is known.
    fn fit_on(
        &self,
        candidate: &Candidate,
        smoothness: Smoothness,
        seen: &[usize],
    ) -> Result<Sensor, CalibrateError> {
        let presses: Vec<Marked<'_>> = seen.iter().map(|&i| self.marked[i].clone()).collect();
        let raw = self.set.rest.as_ref();
        let mut rest = rest_frame(&presses, |_| None, raw, &self.grid);
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
        let noise_rgb = noise_rgb(&presses, &rest, &self.grid);
        let markers = Markers::of_rest(&rest, &self.grid).filter(|_| self.dotted);
        Ok(Sensor {
            markers,
            gel_shape: candidate.gel.shape.clone(),
            pyramid: Some(candidate.gel.pyramid.clone()),
            ball_m: Some(self.set.ball_m),
            press_gain_sd: self.press_gain_sd,
            ..Sensor::new(self.grid, rest, noise_rgb, colour)
        })
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
        let solution = solve(&sums, smoothness).ok_or(CalibrateError::Nothing)?;
        let (near, around) = solution.near_and_around();
        // Heights may grow, over a wide flat contact they cancel; derivatives are held at the largest that were seen.
        let mut around_limit = vec![NO_LIMIT; SURROUNDINGS];
        for (i, &feature) in AROUND_FITTED.iter().enumerate().filter(|(_, f)| !AROUND_HEIGHTS.contains(f)) {
            let seen = seen.iter().map(|&press| candidate.samples[press].largest[i]);
            around_limit[feature] = AROUND_MARGIN * seen.fold(0.0, f32::max);
        }
        let steepest = seen.iter().map(|&i| candidate.samples[i].steepest);
        Ok(ColourModel::Regressor(Box::new(Regressor {
            mm_per_px: self.grid.metres_per_px * 1e3,
            near,
            around,
            slope_limit: steepest.fold(0.0, f32::max),
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
