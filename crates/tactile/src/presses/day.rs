//! A sensor file against a few presses of another day: what changed, if anything did, and the file for that day.
//!
//! Each of a few explanations is fitted to all presses but one and draws that one: nothing, another light, another gel, another scale
//! of the camera, a ball or a press that is not as stated. Each may shift all levels of a colour a little, as any session does, and a
//! mark by a pixel or two. What it leaves in a zone around a contact counts by its logarithm, so that all zones and all sensors count
//! alike.

mod changed;
mod light;
mod numbers;
mod outcome;
mod polynomial;
mod spots;
mod taken;
#[cfg(test)]
mod tests;
mod tried;
mod verdict;

pub use light::Light;

use super::calibrate::MIN_PRESSES;
use super::contact::{MarkError, WIDEST, Zone, checked};
use super::gain::{MAX_DEVIATIONS, away, gain_of, with_gain};
use super::{Circle, Contact, Press, PressScene, PressSet, ZONES};
use crate::grid::levels_of;
use crate::sensor::Sensor;
use gripgen_twin::TactileImage;
use numbers::{numbers, radius};
use outcome::{Outcome, Settled, outcome};
use taken::{Allowed, Taken};
use tried::{Day, draw};
use verdict::{decide, mean_and_se};

/// Zones around a contact.
const ZONE_COUNT: usize = ZONES.len();

/// Narrowest image that is fitted to.
const FIT_WIDTH_PX: usize = 120;

/// An even shift of a colour that a session may have, grey levels: twice the 1.3 that real ones have.
const LEVEL: f64 = 2.6;

/// Error of marks that people make, pixels.
const MARK_PX: f64 = 2.0;

/// Marks are taken at their word within this, as the logarithm of a factor that all radii share: hand-drawn circles are unsure by five
/// per cent.
const RADIUS: f64 = 0.05;

/// Logarithm of the radius of one contact over the marked one.
const LN_RADIUS: f64 = 0.2;

/// What may have changed.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Nothing.
    Nothing,
    /// The light.
    Light(Box<Light>),
    /// How the gel gives way.
    Gel {
        /// Share of a press by which it does so at the rim.
        sink_in_fraction: f64,
        /// How much further around a contact.
        width: f64,
    },
    /// The scale of the camera.
    Scale {
        /// Today's pixels on a length of the gel over those of the sensor file.
        zoom: f64,
        /// Where the camera looks, in half widths of the frame.
        shift: [f64; 2],
    },
    /// The ball.
    Ball {
        /// True over stated diameter.
        factor: f64,
    },
    /// How far the ball was pressed in.
    Force {
        /// True over stated radius of the contacts.
        factor: f64,
    },
}

/// An explanation that was tried.
#[derive(Debug, Clone, PartialEq)]
struct Tried {
    /// Fitted to all presses.
    change: Change,
    /// Fitted without each press.
    folds: Vec<Change>,
    /// What it gains on the press that it was fitted without.
    gains: Vec<f64>,
}

/// Why presses cannot be checked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DayError {
    /// Too few presses.
    #[error("{found} presses of a ball, a check needs at least {MIN_PRESSES}")]
    TooFew {
        /// Presses found.
        found: usize,
    },
    /// An image of another size.
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
}

/// What may have changed, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Nothing.
    Nothing,
    /// The light.
    Light,
    /// The gel.
    Gel,
    /// The scale of the camera.
    Scale,
    /// The ball.
    Ball,
    /// How far the ball was pressed in.
    Force,
}

impl Cause {
    /// Name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Nothing => "nothing",
            Cause::Light => "light",
            Cause::Gel => "gel",
            Cause::Scale => "scale",
            Cause::Ball => "ball",
            Cause::Force => "force",
        }
    }
}

impl Change {
    /// Its name.
    pub fn cause(&self) -> Cause {
        match self {
            Change::Nothing => Cause::Nothing,
            Change::Light(_) => Cause::Light,
            Change::Gel { .. } => Cause::Gel,
            Change::Scale { .. } => Cause::Scale,
            Change::Ball { .. } => Cause::Ball,
            Change::Force { .. } => Cause::Force,
        }
    }
}

/// How well an explanation does on presses that it has not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explanation {
    /// What it says changed.
    pub cause: Cause,
    /// Mean over the presses of the sum over the zones of the logarithm of the error that it takes off.
    pub gain: f64,
    /// Standard error of that over the presses.
    pub gain_se: f64,
    /// From 0 to 1, all explanations together 1.
    pub weight: f64,
    /// Whether it does as well as the one that was chosen.
    pub ties: bool,
}

/// Root of the mean squared difference, grey levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreyRms {
    /// In contacts and at their rims.
    pub contact: f64,
    /// Over the whole frame.
    pub frame: f64,
}

/// What images of the old file differ from those of the day by, and those of the file for the day on presses that it was not fitted to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreyCost {
    /// The file as it is.
    pub before: GreyRms,
    /// The file for the day.
    pub after: GreyRms,
}

impl GreyCost {
    /// Whether the file for the day is closer where a cause acts: over the frame, or in contacts.
    fn is_lower(&self, cause: Cause) -> bool {
        match cause {
            Cause::Nothing => true,
            Cause::Light | Cause::Scale => self.after.frame < self.before.frame,
            Cause::Gel | Cause::Ball | Cause::Force => self.after.contact < self.before.contact,
        }
    }
}

/// A number of a change with its 90 % interval, by leaving out one press at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DayNumber {
    /// Name in JSON.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Lower end.
    pub low90: f64,
    /// Upper end.
    pub high90: f64,
}

/// A place that differs from what is drawn in several presses: a scratch, say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Its middle, columns from the first.
    pub x_px: f64,
    /// Its middle, rows from the first.
    pub y_px: f64,
    /// How many pixels.
    pub pixels: usize,
    /// In how many presses.
    pub presses: usize,
    /// Mean difference over all presses, grey levels; below 0 it is darker than drawn.
    pub grey: f64,
}

/// Marks that are larger than the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeyondBall {
    /// In how many presses.
    pub presses: usize,
    /// The smallest ball that shows all marks.
    pub smallest_ball_m: f64,
}

/// A sensor file against the presses of a day.
#[derive(Debug, Clone, PartialEq)]
pub struct DayCheck {
    /// What changed; `None` where no explanation holds that was tried.
    pub cause: Option<Cause>,
    /// The best explanation, fitted to all presses.
    pub change: Change,
    /// Its numbers.
    pub numbers: Vec<DayNumber>,
    /// All explanations.
    pub explanations: Vec<Explanation>,
    /// The sensor file for the day; `None` where nothing holds.
    pub today: Option<Sensor>,
    /// Errors in grey levels.
    pub cost: GreyCost,
    /// Names of the presses that were used: those of a ball.
    pub names: Vec<String>,
    /// What is drawn of each by a fit that has not seen it.
    pub drawn: Vec<TactileImage>,
    /// Mean residual over the presses, eight times enlarged around a middle grey.
    pub map: TactileImage,
    /// Places with the same residual in several presses.
    pub spots: Vec<Spot>,
    /// True over stated radius of the contacts, with its 90 % interval.
    pub radius: DayNumber,
    /// Marks that are larger than the ball.
    pub beyond_ball: Option<BeyondBall>,
}

/// Says what changed between the day of a sensor file and that of a few presses.
///
/// # Errors
///
/// Fewer than [`MIN_PRESSES`] presses of a ball, images of another size, a contact that is not marked.
pub fn check_day(set: &PressSet, sensor: &Sensor) -> Result<DayCheck, DayError> {
    let balls: Vec<&Press> = set.presses.iter().filter(|press| press.indenter.is_none()).collect();
    let contacts = contacts(&balls, set.ball_m, sensor)?;
    let day = day(&balls, &contacts, set.ball_m, sensor);
    let mut tried = vec![day.light()];
    tried.extend(day.gel());
    tried.extend([day.scale(), day.ball(), day.force()]);
    let depths = balls.iter().all(|press| press.travel_m.is_some());
    let sink_in = sensor.pyramid.as_ref().map_or(0.0, |pyramid| pyramid.sink_in_fraction);
    let seen = &day.ln_radii;
    // What a depth says of a radius, where there is one.
    let stated = |(i, press): (usize, &&Press)| {
        let by_depth = press.travel_m.map(|travel_m| {
            Circle::radius_px_at_depth(set.ball_m, (1.0 - sink_in) * travel_m, sensor.grid.metres_per_px)
        });
        let marked = contacts[i].circle.radius_px;
        seen[i] + by_depth.filter(|px| *px > 0.0).map_or(0.0, |px| libm::log(marked / px))
    };
    let ln_radii: Vec<f64> = balls.iter().enumerate().map(stated).collect();
    let (best, mut explanations) = decide(tried, &ln_radii, depths);
    let best = best.map(|best| match best.change {
        Change::Force { .. } => of_radii(seen),
        _ => best,
    });
    let judge = |best: Option<Tried>| {
        let settled = Settled::new(&day, best);
        let outcome = outcome(&settled, &balls, &contacts, set.ball_m, sensor, LEVEL);
        (settled, outcome)
    };
    let chosen = best.as_ref().map_or(Cause::Nothing, |best| best.change.cause());
    let sized = chosen == Cause::Gel && explanations.iter().any(|e| e.cause == Cause::Force && e.ties);
    let (mut settled, mut found) = judge(best);
    // A change that makes the images of presses worse that it was not fitted to is none.
    if sized && !found.cost.is_lower(Cause::Gel) {
        (settled, found) = judge(Some(of_radii(seen)));
    }
    if !found.cost.is_lower(settled.change.cause()) {
        (settled, found) = judge(None);
    }
    let cause = settled.change.cause();
    if cause != chosen {
        for e in &mut explanations {
            (e.weight, e.ties) = (if e.cause == cause { 1.0 } else { 0.0 }, false);
        }
    }
    let Outcome { cost, drawn, map, spots, explained } = found;
    let cause = explained.then(|| settled.change.cause());
    Ok(DayCheck {
        cause,
        numbers: numbers(&settled.change, &settled.folds, sensor, set.ball_m),
        explanations,
        today: cause.map(|_| settled.sensor(sensor)),
        cost,
        names: balls.iter().map(|press| press.name.clone()).collect(),
        drawn,
        map,
        spots,
        radius: radius(&ln_radii),
        beyond_ball: beyond_ball(set, sensor.grid.metres_per_px),
        change: settled.change,
    })
}

/// Contacts that are larger than their marks by the mean of some logarithms.
fn of_radii(ln_radii: &[f64]) -> Tried {
    let factor = |left_out: Option<usize>| {
        let kept: Vec<f64> =
            ln_radii.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, l)| *l).collect();
        Change::Force { factor: libm::exp(mean_and_se(&kept).0) }
    };
    let n = ln_radii.len();
    Tried { change: factor(None), folds: (0..n).map(|i| factor(Some(i))).collect(), gains: vec![0.0; n] }
}

/// Marks that are wider than the ball, beyond what marks are unsure by; `None` without any.
pub fn beyond_ball(set: &PressSet, metres_per_px: f64) -> Option<BeyondBall> {
    let balls = set.presses.iter().filter(|press| press.indenter.is_none());
    let radii: Vec<f64> = balls.filter_map(|press| Some(press.circle?.radius_px * metres_per_px)).collect();
    let presses = radii.iter().filter(|radius| **radius > WIDEST * set.ball_m / 2.0).count();
    let widest = radii.iter().fold(0.0, |m: f64, radius| m.max(*radius));
    (presses > 0).then_some(BeyondBall { presses, smallest_ball_m: 2.0 * widest / WIDEST })
}

/// The checked contacts of balls. A mark that is wider than the ball stays: it may be the ball, or the scale, that is wrong.
fn contacts(balls: &[&Press], ball_m: f64, sensor: &Sensor) -> Result<Vec<Contact>, DayError> {
    if balls.len() < MIN_PRESSES {
        return Err(DayError::TooFew { found: balls.len() });
    }
    let wanted = (sensor.grid.width_px as u32, sensor.grid.height_px as u32);
    let contact = |press: &&Press| {
        let found = (press.image.width_px, press.image.height_px);
        if found != wanted {
            return Err(DayError::Size { press: press.name.clone(), found, wanted });
        }
        let known = match (checked(press, ball_m, sensor.grid.metres_per_px), press.circle) {
            (Err(MarkError::Radius { .. }), Some(circle)) if circle.radius_px > 0.0 => {
                Contact::of_circle(circle)
            }
            (other, _) => other?,
        };
        // A depth says how deep a ball went, and what is asked is whether it did.
        Ok(Contact { travel_m: None, ..known })
    };
    balls.iter().map(contact).collect()
}

/// The presses at the resolution of a fit.
fn day(balls: &[&Press], contacts: &[Contact], ball_m: f64, sensor: &Sensor) -> Day {
    let scene = PressScene::at_least(FIT_WIDTH_PX, sensor, ball_m);
    let factor = scene.factor();
    let reduced = scene.sensor().clone();
    let (gains, shared) = session_gains(balls, contacts, sensor);
    let width = reduced.grid.width_px;
    let taken = balls.iter().zip(contacts).zip(&gains).map(|((press, contact), gain)| {
        let image = match sensor.press_gain_sd {
            Some(_) => with_gain(&press.image, gain.map(|g| 1.0 / g)),
            None => press.image.clone(),
        };
        let full_width = sensor.grid.width_px;
        let mut measured = levels_of(&image).map(|plane| means(&plane, full_width, factor));
        let here = contact.in_wider_pixels(factor);
        if factor > 1 {
            // What the full resolution draws beyond the fit's is not a change of the day.
            let (fine, coarse) = (draw(sensor, contact, ball_m), draw(&reduced, &here, ball_m));
            for c in 0..3 {
                let fine = means(&fine[c].values, full_width, factor);
                let beyond = fine.iter().zip(&coarse[c].values).map(|(fine, coarse)| fine - coarse);
                measured[c].iter_mut().zip(beyond).for_each(|(level, beyond)| *level -= beyond);
            }
        }
        let contact = here;
        let zone = |p: usize| Zone::at(contact.beyond_rim_px(p, width) / contact.circle.radius_px.max(1.0));
        let zones = (0..reduced.grid.len()).map(zone).collect();
        Taken { width, measured, zones, contact }
    });
    let taken = taken.collect();
    let allowed = Allowed {
        level: LEVEL,
        mark_px: MARK_PX / factor as f64,
        ln_radius: LN_RADIUS,
        gain: shared.map(|g| g as f32),
    };
    Day::new(reduced, ball_m, taken, allowed)
}

/// Gains of the presses of a camera that balances its colours: of each relative to all, and of all as far as they may have it.
fn session_gains(balls: &[&Press], contacts: &[Contact], sensor: &Sensor) -> (Vec<[f64; 3]>, [f64; 3]) {
    let Some(sd) = sensor.press_gain_sd else { return (vec![[1.0; 3]; balls.len()], [1.0; 3]) };
    let logs: Vec<[f64; 3]> = balls
        .iter()
        .zip(contacts)
        .map(|(press, contact)| {
            let expected = |pixel: usize, c: usize| f64::from(sensor.rest[c][pixel]);
            gain_of(&press.image, expected, away(contact, &sensor.grid).into_iter()).map(libm::log)
        })
        .collect();
    let n = logs.len() as f64;
    let means = [0, 1, 2].map(|c| logs.iter().map(|log| log[c]).sum::<f64>() / n);
    let own = logs.iter().map(|log| [0, 1, 2].map(|c| libm::exp(log[c] - means[c]))).collect();
    let most = sd.map(|sd| MAX_DEVIATIONS * f64::from(sd) / n.sqrt());
    (own, [0, 1, 2].map(|c| libm::exp(means[c].clamp(-most[c], most[c]))))
}

/// Means over squares of `factor` x `factor` pixels.
fn means(plane: &[f32], width: usize, factor: usize) -> Vec<f32> {
    super::seen::means(plane, width, plane.len() / width, factor)
}
