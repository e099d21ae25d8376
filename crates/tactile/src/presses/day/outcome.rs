//! What a change costs in grey levels, what it leaves, and where on the gel.

use super::changed::{changed, seen_before};
use super::spots::{Residuals, spots};
use super::tried::Day;
use super::{Change, GreyCost, GreyRms, Spot, Tried};
use crate::presses::compare::predict_taken;
use crate::presses::{Contact, Press, Zone};
use crate::sensor::Sensor;
use gripgen_twin::TactileImage;

/// A sensor explains contacts where it leaves less than this share of what they change.
const UNEXPLAINED: f64 = 0.5;

/// The frame at rest is explained where presses differ from it by less than this multiple of what they differ by among themselves, in
/// squares.
const FRAME_TIMES: f64 = 4.0;

/// The chosen change with the level of the session: of all presses, and without each.
pub(super) struct Settled {
    pub(super) change: Change,
    pub(super) folds: Vec<Change>,
    levels: Vec<[f64; 3]>,
}

impl Settled {
    pub(super) fn new(day: &Day, best: Option<Tried>) -> Self {
        let n = day.taken.len();
        let (change, folds) =
            best.map_or_else(|| (Change::Nothing, vec![Change::Nothing; n]), |b| (b.change, b.folds));
        let levels = day.levels(&change);
        Self { change, folds, levels }
    }

    /// Mean level of the presses without one.
    fn level(&self, left_out: Option<usize>) -> [f64; 3] {
        let kept: Vec<&[f64; 3]> =
            self.levels.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, l)| l).collect();
        [0, 1, 2].map(|c| kept.iter().map(|l| l[c]).sum::<f64>() / kept.len().max(1) as f64)
    }

    /// The sensor file for the day.
    pub(super) fn sensor(&self, sensor: &Sensor) -> Sensor {
        levelled(changed(sensor, &self.change), self.level(None))
    }

    /// What is drawn of a press by a fit that has not seen it.
    fn unseen(
        &self,
        i: usize,
        press: &Press,
        contact: &Contact,
        ball_m: f64,
        sensor: &Sensor,
    ) -> TactileImage {
        let today = levelled(changed(sensor, &self.folds[i]), self.level(Some(i)));
        let (contact, ball_m) = self.folds[i].contact(contact, ball_m);
        predict_taken(press, &contact.within(ball_m, &today.grid), ball_m, &today)
    }
}

fn levelled(mut sensor: Sensor, level: [f64; 3]) -> Sensor {
    for (plane, level) in sensor.rest.iter_mut().zip(level) {
        // A 64th of a grey level is far below the noise, and packs well.
        plane
            .iter_mut()
            .for_each(|v| *v = ((*v + level as f32) * 64.0).round().clamp(0.0, 255.0 * 64.0) / 64.0);
    }
    sensor
}

/// What the presses look like, and what is drawn of them.
pub(super) struct Outcome {
    pub(super) cost: GreyCost,
    pub(super) drawn: Vec<TactileImage>,
    pub(super) map: TactileImage,
    pub(super) spots: Vec<Spot>,
    /// Whether the residual is small enough for a sensor file.
    pub(super) explained: bool,
}

/// Draws each press by the old file and by a fit that has not seen it.
pub(super) fn outcome(
    settled: &Settled,
    balls: &[&Press],
    contacts: &[Contact],
    ball_m: f64,
    sensor: &Sensor,
    level: f64,
) -> Outcome {
    let grid = sensor.grid;
    let (mut before, mut after) = (Squares::default(), Squares::default());
    let mut drawn = Vec::with_capacity(balls.len());
    let mut residuals = Vec::with_capacity(balls.len());
    // What contacts change, and the residual.
    let (mut shown, mut left) = (0.0, 0.0);
    for (i, (press, contact)) in balls.iter().zip(contacts).enumerate() {
        let old = predict_taken(press, &contact.within(ball_m, &grid), ball_m, sensor);
        let new = settled.unseen(i, press, contact, ball_m, sensor);
        let zone =
            |p: usize| Zone::at(contact.beyond_rim_px(p, grid.width_px) / contact.circle.radius_px.max(1.0));
        let zones: Vec<Zone> = (0..grid.len()).map(zone).collect();
        before.add(&press.image, &old, &zones);
        after.add(&press.image, &new, &zones);
        let today = settled.sensor(sensor);
        for (p, _) in zones.iter().enumerate().filter(|(_, zone)| **zone <= Zone::Rim) {
            for c in 0..3 {
                let level = f64::from(press.image.rgb[3 * p + c]);
                shown += (level - f64::from(today.rest[c][p])).powi(2);
                left += (level - f64::from(new.rgb[3 * p + c])).powi(2);
            }
        }
        residuals.push(Residuals::of(&press.image, &new, zones));
        drawn.push(new);
    }
    // What a camera that looks further sees beyond the old frame is not known.
    let known = match &settled.change {
        Change::Scale { zoom, shift } => seen_before(&grid, *zoom, *shift),
        _ => vec![true; grid.len()],
    };
    let (shared, own) = far_field(&residuals, &known);
    let frame_explained = shared < FRAME_TIMES * own || shared < level * level;
    Outcome {
        cost: GreyCost { before: before.rms(), after: after.rms() },
        drawn,
        map: super::spots::map(&residuals, grid.width_px),
        spots: spots(&residuals, &known, grid.width_px),
        explained: left < UNEXPLAINED * shown && frame_explained,
    }
}

/// Mean square of the residual far from contacts, and of what the presses differ by among themselves there.
fn far_field(residuals: &[Residuals], known: &[bool]) -> (f64, f64) {
    let (mut all, mut own, mut count) = (0.0, 0.0, 0usize);
    for p in (0..known.len()).filter(|&p| known[p]) {
        let far: Vec<[f32; 3]> =
            residuals.iter().filter(|r| r.zones[p] == Zone::Far).map(|r| r.grey[p]).collect();
        if far.len() < 2 {
            continue;
        }
        let n = far.len() as f64;
        for c in 0..3 {
            let mean = far.iter().map(|r| f64::from(r[c])).sum::<f64>() / n;
            all += far.iter().map(|r| f64::from(r[c]).powi(2)).sum::<f64>() / n;
            own += far.iter().map(|r| (f64::from(r[c]) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        }
        count += 3;
    }
    let n = count.max(1) as f64;
    (all / n, own / n)
}

/// Squares by zone.
#[derive(Default)]
struct Squares {
    contact: (f64, usize),
    frame: (f64, usize),
}

impl Squares {
    fn add(&mut self, real: &TactileImage, drawn: &TactileImage, zones: &[Zone]) {
        for (p, zone) in zones.iter().enumerate() {
            let square =
                |c: usize| (f64::from(real.rgb[3 * p + c]) - f64::from(drawn.rgb[3 * p + c])).powi(2);
            let squares: f64 = (0..3).map(square).sum();
            self.frame = (self.frame.0 + squares, self.frame.1 + 3);
            if *zone <= Zone::Rim {
                self.contact = (self.contact.0 + squares, self.contact.1 + 3);
            }
        }
    }

    fn rms(&self) -> GreyRms {
        let rms = |(sum, n): (f64, usize)| (sum / n.max(1) as f64).sqrt();
        GreyRms { contact: rms(self.contact), frame: rms(self.frame) }
    }
}
