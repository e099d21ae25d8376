//! A calibration again, with a ball of another size.

use super::gel::{Candidate, Gels};
use super::rest::rest_frame;
use super::samples::GelModel;
use super::{
    Calibration, Circle, Fit, MIN_PRESSES, Marked, Smoothness, check, checked, gains, reference_frame,
    without_gains,
};
use crate::grid::Grid;
use crate::presses::{Press, PressSet, find_circle};
use crate::sensor::Sensor;

/// The balls of a calibration, without the gains of their presses, and the gel that they show.
pub(in crate::presses) struct Resized {
    set: PressSet,
    grid: Grid,
    gel: GelModel,
    smoothness: Smoothness,
    press_gain_sd: Option<[f32; 3]>,
}

impl Resized {
    /// The gel is that of the balls alone, and of their rims: bodies and depths draw it to where a wrong diameter looks right.
    ///
    /// `None` where the set has too few balls that show a contact.
    pub(in crate::presses) fn new(set: &PressSet, calibration: &Calibration) -> Option<Self> {
        let grid = check(set).ok()?;
        let rest = reference_frame(set)?;
        let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
        let ball = |(press, circle): (&Press, &Circle)| {
            let fitted = press.indenter.is_none() && !calibration.doubtful.contains(&press.name);
            // A circle that stands beside a depth may have been taken from it, with the diameter that is to be checked.
            let seen = match press.travel_m {
                Some(_) => find_circle(&press.image, &rest, ball_radius_px),
                None => Some(*circle),
            };
            seen.filter(|_| fitted).map(|circle| Press {
                circle: Some(circle),
                travel_m: None,
                ..press.clone()
            })
        };
        let presses: Vec<Press> = set.presses.iter().zip(&calibration.circles).filter_map(ball).collect();
        if presses.len() < MIN_PRESSES {
            return None;
        }
        let mut set = PressSet { presses, rest: set.rest.clone(), ..*set };
        let press_gain_sd = calibration.sensor.press_gain_sd;
        if press_gain_sd.is_some() {
            let found = gains(&marked(&set)?, set.rest.as_ref(), &grid);
            set = found.map_or(set.clone(), |gains| without_gains(&set, &gains));
        }
        let (gel, smoothness) = {
            let marked = marked(&set)?;
            let gels = Gels::new(Some(&calibration.sensor.gel_shape), &marked, set.ball_m, grid);
            let all: Vec<usize> = (0..marked.len()).collect();
            let rest = rest_frame(&marked, |_| None, set.rest.as_ref(), &grid);
            let (candidate, smoothness) = gels.choose(&all, &rest);
            (candidate.gel.clone(), smoothness)
        };
        Some(Self { set, grid, gel, smoothness, press_gain_sd })
    }

    /// The share of a press by which the gel gives way at the rim of a ball.
    pub(in crate::presses) fn sink_in_fraction(&self) -> f64 {
        self.gel.pyramid.sink_in_fraction
    }

    /// The sensor that follows if the ball is `factor` times as large; `None` where such a ball shows no such contacts.
    pub(in crate::presses) fn sensor(&self, factor: f64) -> Option<Sensor> {
        let set = PressSet { ball_m: factor * self.set.ball_m, ..self.set.clone() };
        let marked = marked(&set)?;
        let candidate = Candidate::new(self.gel.clone(), &marked, set.ball_m, &self.grid);
        let fit = Fit {
            set: &set,
            grid: self.grid,
            marked: &marked,
            press_gain_sd: self.press_gain_sd,
            dotted: false,
        };
        let all: Vec<usize> = (0..marked.len()).collect();
        fit.fit_on(&candidate, self.smoothness, &all).ok()
    }
}

fn marked(set: &PressSet) -> Option<Vec<Marked<'_>>> {
    let contact = |press| Some((press, checked(press, set.ball_m, set.metres_per_px).ok()?));
    set.presses.iter().map(contact).collect()
}
