//! A sensor file against presses: predicted and real image of each.

use super::contact::{MarkError, ZONES, Zone, checked};
use super::dots::{followed, press_shear};
use super::gain::within_gain;
use super::{Contact, Press, PressSet};
use crate::convolve::Follow;
use crate::markers::{Markers, marker_displacements_by_surface};
use crate::metrics::{MetricError, Score, mean_score, score, score_where};
use crate::noise::finish;
use crate::render::Renderer;
use crate::sensor::{Pyramid, Sensor};
use crate::simd::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{Gel, TactileImage};

/// Sides of the crops around the contact, at the resolution of the calibration.
pub const CROPS_PX: [u32; 2] = [400, 200];

/// Side of the window around the place of a body, in which shapes are compared.
pub const WINDOW_PX: u32 = 160;

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

/// The scores of one press: the whole frame, the crops of [`CROPS_PX`], the window of [`WINDOW_PX`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scores {
    /// The whole frame.
    pub full: Score,
    /// 400 x 400 pixels.
    pub crop400: Score,
    /// 200 x 200 pixels.
    pub crop200: Score,
    /// 160 x 160 pixels around the ball, or the origin of another body.
    pub window: Score,
}

/// One press.
#[derive(Debug, Clone, PartialEq)]
pub struct PressScore {
    /// Its name.
    pub name: String,
    /// What was pressed in.
    pub shape: String,
    /// How its prediction differs from it.
    pub scores: Scores,
    /// The same by zone around the contact, of those that the image has.
    pub zones: Vec<(Zone, Score)>,
    /// The same by [`DotPlace`], of those that the image has; empty of a gel without dots.
    pub dots: Vec<(DotPlace, Score)>,
}

/// A part of an image of a gel with dots. Pixels that a dot hides at rest or in the press lie in dots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DotPlace {
    /// Inside the rim of the contact, or in the whole frame.
    pub in_contact: bool,
    /// In dots, or outside of them.
    pub in_dots: bool,
}

/// All places, the whole frame first.
const DOT_PLACES: [DotPlace; 4] = [
    DotPlace { in_contact: false, in_dots: false },
    DotPlace { in_contact: false, in_dots: true },
    DotPlace { in_contact: true, in_dots: false },
    DotPlace { in_contact: true, in_dots: true },
];

impl DotPlace {
    /// Name for people and for `--json`.
    pub fn name(self) -> &'static str {
        match (self.in_contact, self.in_dots) {
            (false, false) => "frame, outside dots",
            (false, true) => "frame, in dots",
            (true, false) => "contact, outside dots",
            (true, true) => "contact, in dots",
        }
    }
}

/// All presses.
#[derive(Debug, Clone, PartialEq)]
pub struct PressComparison {
    /// Means over the presses.
    pub mean: Scores,
    /// Each press, in the order of the set.
    pub each: Vec<PressScore>,
    /// By what was pressed in, in the order in which it first comes: how many, and the mean over their windows.
    pub by_shape: Vec<(String, usize, Score)>,
    /// By zone around the contact: how many presses have it, and the mean over them.
    pub by_zone: Vec<(Zone, usize, Score)>,
    /// The same by where dots are; empty of a gel without dots.
    pub by_dots: Vec<(DotPlace, usize, Score)>,
}

impl PressComparison {
    /// From the scores of each press; `None` without any.
    pub fn from_each(each: Vec<PressScore>) -> Option<Self> {
        if each.is_empty() {
            return None;
        }
        let over = |of: fn(&Scores) -> Score| {
            mean_score(&each.iter().map(|press| of(&press.scores)).collect::<Vec<_>>())
        };
        let mean = Scores {
            full: over(|s| s.full),
            crop400: over(|s| s.crop400),
            crop200: over(|s| s.crop200),
            window: over(|s| s.window),
        };
        let mut shapes: Vec<&str> = Vec::new();
        for press in &each {
            if !shapes.contains(&press.shape.as_str()) {
                shapes.push(&press.shape);
            }
        }
        let of_shape = |shape: &str| {
            let windows: Vec<Score> =
                each.iter().filter(|p| p.shape == shape).map(|p| p.scores.window).collect();
            (shape.to_string(), windows.len(), mean_score(&windows))
        };
        let by_shape = shapes.into_iter().map(of_shape).collect();
        let of_zone = |zone: Zone| {
            let there = each.iter().flat_map(|press| &press.zones).filter(|(z, _)| *z == zone);
            let scores: Vec<Score> = there.map(|(_, score)| *score).collect();
            (zone, scores.len(), mean_score(&scores))
        };
        let by_zone = ZONES.into_iter().map(of_zone).filter(|(_, n, _)| *n > 0).collect();
        let of_place = |place: DotPlace| {
            let there = each.iter().flat_map(|press| &press.dots).filter(|(p, _)| *p == place);
            let scores: Vec<Score> = there.map(|(_, score)| *score).collect();
            (place, scores.len(), mean_score(&scores))
        };
        let by_dots = DOT_PLACES.into_iter().map(of_place).filter(|(_, n, _)| *n > 0).collect();
        Some(Self { mean, each, by_shape, by_zone, by_dots })
    }
}

/// Compares the images that `sensor` predicts for the contacts with the real ones. Contacts that nobody marked are
/// looked for.
///
/// # Errors
///
/// A set without presses, images of another size than those of the sensor, or a press without a valid mark.
pub fn compare_presses(set: &PressSet, sensor: &Sensor) -> Result<PressComparison, CompareError> {
    let mut set = set.clone();
    set.mark_missing();
    if let Some(markers) = &sensor.markers {
        set.hide_dots(markers);
    }
    let mut each = Vec::with_capacity(set.presses.len());
    for press in &set.presses {
        let predicted = predict_press(press, set.ball_m, sensor)?;
        each.push(score_press(press, &predicted)?);
    }
    PressComparison::from_each(each).ok_or(CompareError::Empty)
}

/// The image that `sensor` predicts for a press, without noise; in the white balance of that press, taken from its pixels away
/// from the contact, where the sensor's camera has an automatic one.
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
    let contact = checked(press, ball_m, sensor.grid.metres_per_px)?;
    Ok(predict_taken(press, &contact, ball_m, sensor))
}

/// The image of a contact in the gain with which a press was taken, where the camera's gain wanders.
pub(super) fn predict_taken(press: &Press, contact: &Contact, ball_m: f64, sensor: &Sensor) -> TactileImage {
    let image = match &sensor.markers {
        Some(markers) => predict_dotted(&press.image, contact, ball_m, sensor, markers),
        None => predict_contact(contact, ball_m, sensor),
    };
    match sensor.press_gain_sd {
        Some(sd) => within_gain(&press.image, &image, contact, &sensor.grid, sd.map(f64::from)),
        None => image,
    }
}

/// The image that a sensor with dots predicts for a contact. How far the press drags the gel sideways is not a property of the sensor: it is taken
/// from the dots of the real image, by least squares.
fn predict_dotted(
    image: &TactileImage,
    contact: &Contact,
    ball_m: f64,
    sensor: &Sensor,
    markers: &Markers,
) -> TactileImage {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let imprint = contact.imprint(ball_m, &sensor.grid, &sensor.gel_shape, sink_in_fraction(sensor));
    let surface = renderer.surface(&imprint);
    let shear = press_shear(&surface, &sensor.grid, markers, &followed(image, markers));
    let moved = marker_displacements_by_surface(&surface, sensor.grid.metres_per_px, shear, &markers.rest_px);
    let mut change = renderer.unmarked_change(&imprint);
    renderer.draw_moved(&moved, &mut change);
    finish(sensor, Some(&change), None)
}

/// The image of a contact, without noise.
pub(crate) fn predict_contact(contact: &Contact, ball_m: f64, sensor: &Sensor) -> TactileImage {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let imprint = contact.imprint(ball_m, &sensor.grid, &sensor.gel_shape, sink_in_fraction(sensor));
    renderer.image(Some(&imprint), None)
}

/// The sink-in that a sensor file knows.
pub(super) fn sink_in_fraction(sensor: &Sensor) -> f64 {
    sensor.pyramid.as_ref().map_or(0.0, |pyramid| pyramid.sink_in_fraction)
}

/// What the renderer needs of a gel: the deformation of the calibration, or that of Wucherer et al. 2023.
pub(crate) fn gel_of(sensor: &Sensor) -> Gel {
    let usual = || Pyramid {
        kernels_px: vec![71, 51, 21, 11, 5],
        restore_depth_fraction: 0.4,
        sink_in_fraction: 0.0,
        follow: Follow::AtLeast,
    };
    let pyramid = sensor.pyramid.clone().unwrap_or_else(usual);
    Gel {
        model: GelModel::Pyramid,
        elastic: None,
        thickness_m: f64::INFINITY,
        width_m: sensor.grid.width_px as f64 * sensor.grid.metres_per_px,
        height_m: sensor.grid.height_px as f64 * sensor.grid.metres_per_px,
        contact_m_per_px: sensor.grid.metres_per_px,
        shear_stiffness_n_per_m: 0.0,
        shear_by_area: 1.0,
        kernels_px: pyramid.kernels_px,
        restore_depth_fraction: pyramid.restore_depth_fraction,
        compliance: 1.0,
        stiffens: false,
        interlock: 0.0,
        interlock_smoothing_m: 3e-4,
    }
}

/// How a predicted image differs from the real one.
///
/// # Errors
///
/// Images of two sizes, or too small for the structural similarity.
pub fn score_press(press: &Press, predicted: &TactileImage) -> Result<PressScore, MetricError> {
    let centre = press
        .circle
        .map_or((f64::from(predicted.width_px) / 2.0, f64::from(predicted.height_px) / 2.0), |c| {
            (c.x_px, c.y_px)
        });
    let cropped = |side_px| score(&crop(predicted, centre, side_px), &crop(&press.image, centre, side_px));
    let scores = Scores {
        full: score(predicted, &press.image)?,
        crop400: cropped(CROPS_PX[0])?,
        crop200: cropped(CROPS_PX[1])?,
        window: cropped(WINDOW_PX)?,
    };
    let (mut zones, mut dots) = (Vec::new(), Vec::new());
    if let Some(circle) = press.circle {
        let contact = Contact::of_press(press, circle);
        let width_px = predicted.width_px as usize;
        let zone_of =
            |pixel: usize| Zone::at(contact.beyond_rim_px(pixel, width_px) / circle.radius_px.max(1.0));
        let of_pixel: Vec<Zone> = (0..width_px * predicted.height_px as usize).map(zone_of).collect();
        for zone in ZONES {
            let found = score_where(predicted, &press.image, |pixel| of_pixel[pixel] == zone)?;
            zones.extend(found.map(|(_, score)| (zone, score)));
        }
        for place in DOT_PLACES.into_iter().filter(|_| press.hidden.is_some()) {
            let inside = |pixel: usize| !place.in_contact || of_pixel[pixel] == Zone::Contact;
            let there = |pixel: usize| inside(pixel) && press.hides(pixel) == place.in_dots;
            dots.extend(score_where(predicted, &press.image, there)?.map(|(_, score)| (place, score)));
        }
    }
    Ok(PressScore { name: press.name.clone(), shape: press.shape().into(), scores, zones, dots })
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
}
