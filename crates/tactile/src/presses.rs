//! Presses of a ball or of other bodies into a sensor, and how well a sensor file predicts their images.

mod ball_size;
mod calibrate;
mod circle;
mod compare;
mod contact;
mod coverage;
mod data_pack;
mod day;
mod dots;
mod gain;
mod indenter;
mod render;
mod rest_doubt;
mod seen;

pub use ball_size::{BallSize, BallSizeBy, check_ball_size};
pub use calibrate::{
    CalibrateError, CalibrateOptions, Calibration, FEW_PRESSES, MIN_PRESSES, Smoothness, calibrate_presses,
};
pub use circle::{find_circle, reference_frame};
pub use compare::{
    CROPS_PX, CompareError, DotPlace, PressComparison, PressScore, Scores, WINDOW_PX, compare_presses, crop,
    predict_press, score_press,
};
pub use coverage::{PARTS, PressCoverage, RIM_M, SEEN_SHARE, press_coverage};
pub use data_pack::{DATA_PACK_BALL_M, DATA_PACK_METRES_PER_PX, DataPackError};
pub use day::{
    BeyondBall, Cause, Change, DayCheck, DayError, DayNumber, Explanation, GreyCost, GreyRms, Light, Spot,
    beyond_ball, check_day,
};

use gripgen_twin::TactileImage;
use gripgen_twin::random::splitmix64;
use std::sync::Arc;

pub(crate) use compare::gel_of;
pub(crate) use contact::Contact;
pub use contact::{MarkError, ZONES, Zone};
pub use indenter::{
    Indenter, IndenterError, IndenterPose, MAX_EDGE_RADIUS_M, USUAL_EDGE_RADIUS_M, USUAL_SINK_IN,
};
pub use render::{HeightsError, RenderedBody, render_body, render_heights};
pub use rest_doubt::{RestDoubt, rest_doubt};
pub use seen::{PressContact, PressScene, PressView, frame_mse, surface_part};

/// Images of one sensor into which a ball or other bodies were pressed, in the order in which they were taken.
#[derive(Debug, Clone, PartialEq)]
pub struct PressSet {
    /// Side of a pixel on the gel.
    pub metres_per_px: f64,
    /// Diameter of the ball.
    pub ball_m: f64,
    /// A frame without contact, where one was taken.
    pub rest: Option<TactileImage>,
    /// The presses; all images have one size.
    pub presses: Vec<Press>,
}

/// One press.
#[derive(Debug, Clone, PartialEq)]
pub struct Press {
    /// What it is called in a report.
    pub name: String,
    /// The image.
    pub image: TactileImage,
    /// Where the ball touches, where somebody marked it. Of another body: a circle as large as its contact around its origin.
    pub circle: Option<Circle>,
    /// How far the ball travelled after first contact, where that was measured.
    pub travel_m: Option<f64>,
    /// The body, where it is no ball.
    pub indenter: Option<Arc<Indenter>>,
    /// Which pixels dots of the gel hide, row by row; see [`PressSet::mark_dots`].
    pub hidden: Option<Arc<[bool]>>,
}

impl Press {
    /// A press of a ball; `circle` where somebody marked it.
    pub fn of_ball(name: impl Into<String>, image: TactileImage, circle: Option<Circle>) -> Self {
        Self { name: name.into(), image, circle, travel_m: None, indenter: None, hidden: None }
    }

    /// A press of another body.
    pub fn of_body(name: impl Into<String>, image: TactileImage, indenter: Arc<Indenter>) -> Self {
        let circle = Some(indenter.circle());
        Self {
            name: name.into(),
            image,
            circle,
            travel_m: Some(indenter.travel_m),
            indenter: Some(indenter),
            hidden: None,
        }
    }

    /// What was pressed in, as reports call it.
    pub fn shape(&self) -> &str {
        self.indenter.as_ref().map_or("ball", |indenter| &indenter.shape)
    }
}

/// Some of the pixels of a list, at most `most`, in rising order; a function of the list and the state.
pub(crate) fn drawn(mut pixels: Vec<usize>, most: usize, state: &mut u64) -> Vec<usize> {
    let n = most.min(pixels.len());
    for i in 0..n {
        let j = i + (splitmix64(state) % (pixels.len() - i) as u64) as usize;
        pixels.swap(i, j);
    }
    pixels.truncate(n);
    pixels.sort_unstable();
    pixels
}

/// The rim of the contact of a ball, in pixels from the centre of the image's first pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, along the columns.
    pub x_px: f64,
    /// Centre, down the rows.
    pub y_px: f64,
    /// Radius.
    pub radius_px: f64,
}

impl Circle {
    /// Radius of the circle in which a ball that sinks in by `depth_m` cuts the plane of the gel:
    /// `sqrt(2 R d - d^2)`, R up to the equator.
    pub fn radius_px_at_depth(ball_m: f64, depth_m: f64, metres_per_px: f64) -> f64 {
        let depth_m = depth_m.clamp(0.0, ball_m / 2.0);
        (depth_m * (ball_m - depth_m)).max(0.0).sqrt() / metres_per_px
    }

    /// How deep the ball sinks in: `R - sqrt(R^2 - a^2)`; a circle wider than the ball is one of its equator.
    pub fn depth_m(&self, ball_m: f64, metres_per_px: f64) -> f64 {
        let (ball_radius, radius) = (ball_m / 2.0, self.radius_px * metres_per_px);
        ball_radius - (ball_radius * ball_radius - radius * radius).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_and_radius_are_one_another() {
        for depth_m in [0.1e-3, 1.0e-3, 1.7e-3, 2.0e-3] {
            let radius_px = Circle::radius_px_at_depth(4e-3, depth_m, 29.5e-6);
            let circle = Circle { x_px: 0.0, y_px: 0.0, radius_px };
            assert!((circle.depth_m(4e-3, 29.5e-6) - depth_m).abs() < 1e-12);
        }
        // 1 mm of a 4 mm ball: sqrt(3) mm.
        assert!((Circle::radius_px_at_depth(4e-3, 1e-3, 1e-3) - 3.0_f64.sqrt()).abs() < 1e-12);
    }
}
