//! What may have changed, each fitted to the same pixels and scored on a press that its fit has not seen.

use super::changed::{changed, seen_before, zoomed_plane};
use super::light::{PressSums, fit};
use super::taken::{Allowed, Left, Taken};
use super::{Change, Light, RADIUS, Tried};
use crate::grid::Plane;
use crate::presses::compare::{gel_of, sink_in_fraction};
use crate::presses::{Circle, Contact, Zone};
use crate::render::Renderer;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use std::collections::BTreeMap;

/// Steps an octave and steps to either side of the zooms, diameters and radii that are tried.
const ZOOMS: (f64, i32) = (24.0, 7);
const BALLS: (f64, i32) = (6.0, 4);
const RADII: (f64, i32) = (16.0, 6);

/// Sink-ins that are tried are this far apart, widths of kernels an octave's half.
pub(super) const SINK_IN_STEP: f64 = 0.05;
const SINK_INS: std::ops::RangeInclusive<f64> = 0.0..=0.8;
const WIDTHS: (f64, i32) = (2.0, 3);

/// Half the step of a difference between two radii, of its logarithm.
const WIDER: f64 = 0.03;

/// Rounds of a search for the place about which the frame is zoomed.
const ROUNDS: usize = 5;

/// Distance of the pixels, along rows and columns, at which a move of the frame is looked for.
const STRIDE: usize = 2;

/// Presses of a day, and what a sensor file says of them.
pub(super) struct Day {
    pub(super) sensor: Sensor,
    pub(super) ball_m: f64,
    pub(super) taken: Vec<Taken>,
    /// What the sensor file draws of each contact.
    drawn: Vec<[Plane; 3]>,
    /// What a contact changes more where its radius is larger, by the logarithm of the radius.
    wider: Vec<[Plane; 3]>,
    /// What it leaves.
    same: Vec<Left>,
    /// Logarithms of the radii over the marked ones, without any change.
    pub(super) ln_radii: Vec<f64>,
    allowed: Allowed,
}

impl Day {
    pub(super) fn new(sensor: Sensor, ball_m: f64, taken: Vec<Taken>, allowed: Allowed) -> Self {
        let drawn: Vec<[Plane; 3]> =
            taken.iter().map(|taken| draw(&sensor, &taken.contact, ball_m)).collect();
        let wider: Vec<[Plane; 3]> = taken
            .iter()
            .map(|taken| {
                let at = |sign: f64| {
                    let factor = libm::exp(sign * WIDER);
                    let (contact, ball_m) = Change::Force { factor }.contact(&taken.contact, ball_m);
                    draw(&sensor, &contact, ball_m)
                };
                let (more, less) = (at(1.0), at(-1.0));
                [0, 1, 2].map(|c| more[c].zip(&less[c], |a, b| (a - b) / (2.0 * WIDER as f32)))
            })
            .collect();
        let of = |i: usize, ln_radius: Option<f64>| {
            taken[i].left(&sensor.rest, &drawn[i], &wider[i], None, &allowed, ln_radius)
        };
        let (same, ln_radii) = centred(taken.len(), of);
        Self { sensor, ball_m, taken, drawn, wider, same, ln_radii, allowed }
    }

    /// By how much all levels of a press are shifted under a change.
    pub(super) fn levels(&self, change: &Change) -> Vec<[f64; 3]> {
        let sensor = changed(&self.sensor, change);
        let gain = if matches!(change, Change::Light(_)) { [1.0; 3] } else { self.allowed.gain };
        let allowed = Allowed { gain, ..self.allowed };
        let level = |(taken, wider): (&Taken, &[Plane; 3])| {
            let (contact, ball_m) = change.contact(&taken.contact, self.ball_m);
            taken.left(&sensor.rest, &draw(&sensor, &contact, ball_m), wider, None, &allowed, None).level
        };
        self.taken.iter().zip(&self.wider).map(level).collect()
    }

    /// What a change of the sensor costs in each press, against none: the sum over the zones of the logarithm of the residual.
    fn costs(&self, change: &Change) -> Vec<f64> {
        let sensor = changed(&self.sensor, change);
        let grid = &self.sensor.grid;
        let within = match change {
            Change::Scale { zoom, shift } => Some(seen_before(grid, *zoom, *shift)),
            _ => None,
        };
        let within = within.as_deref();
        let drawn: Vec<[Plane; 3]> = self
            .taken
            .iter()
            .map(|taken| {
                let (contact, ball_m) = change.contact(&taken.contact, self.ball_m);
                draw(&sensor, &contact, ball_m)
            })
            .collect();
        let n = self.taken.len();
        let of = |rest: &[Vec<f32>; 3], drawn: &[[Plane; 3]], i: usize, ln_radius: Option<f64>| {
            self.taken[i].left(rest, &drawn[i], &self.wider[i], within, &self.allowed, ln_radius)
        };
        let (left, _) = centred(n, |i, ln_radius| of(&sensor.rest, &drawn, i, ln_radius));
        let masked =
            within.map(|_| centred(n, |i, ln_radius| of(&self.sensor.rest, &self.drawn, i, ln_radius)).0);
        let same = masked.as_ref().unwrap_or(&self.same);
        left.iter().zip(same).map(|(left, same)| left.against(same)).collect()
    }

    pub(super) fn light(&self) -> Tried {
        let sums: Vec<PressSums> = self
            .taken
            .iter()
            .zip(&self.drawn)
            .map(|(taken, change)| PressSums::of(taken, &self.sensor.rest, change))
            .collect();
        // The gain of a press is the light's here.
        let allowed = Allowed { gain: [1.0; 3], ..self.allowed };
        let without = |left_out: Option<usize>| {
            fit(sums.iter().enumerate().filter(move |(i, _)| Some(*i) != left_out).map(|(_, sums)| sums))
        };
        let width = self.sensor.grid.width_px;
        let plane = |values: Vec<f32>| Plane { width, height: values.len() / width, values };
        let lights: Vec<Light> = (0..self.taken.len()).map(|i| without(Some(i))).collect();
        let drawn: Vec<[[Plane; 3]; 2]> = lights
            .iter()
            .enumerate()
            .map(|(i, light)| {
                let on = |planes: &[Plane; 3]| {
                    light.on([0, 1, 2].map(|c| &planes[c].values[..]), width).map(plane)
                };
                [on(&self.drawn[i]), on(&self.wider[i])]
            })
            .collect();
        let rests: Vec<[Vec<f32>; 3]> =
            lights.iter().map(|light| light.on([0, 1, 2].map(|c| &self.sensor.rest[c][..]), width)).collect();
        let (left, _) = centred(self.taken.len(), |i, ln_radius| {
            let [change, wider] = &drawn[i];
            self.taken[i].left(&rests[i], change, wider, None, &allowed, ln_radius)
        });
        let gains = left.iter().zip(&self.same).map(|(left, same)| -left.against(same)).collect();
        let folds = lights.into_iter().map(|light| Change::Light(Box::new(light))).collect();
        Tried { change: Change::Light(Box::new(without(None))), folds, gains }
    }

    /// Diameters of the ball around the stated one.
    pub(super) fn ball(&self) -> Tried {
        self.along(BALLS, |factor| Change::Ball { factor })
    }

    /// Radii around the marked ones.
    pub(super) fn force(&self) -> Tried {
        self.along(RADII, |factor| Change::Force { factor })
    }

    pub(super) fn scale(&self) -> Tried {
        let today = self.frame();
        self.along(ZOOMS, |zoom| Change::Scale { zoom, shift: self.shift(&today, zoom) })
    }

    /// How the gel gives way, uphill in share and width by turns. `None` where the sensor file has no say in it.
    pub(super) fn gel(&self) -> Option<Tried> {
        let pyramid = self.sensor.pyramid.as_ref()?;
        let start = pyramid.sink_in_fraction;
        let of = |(share, width): (i32, i32)| Change::Gel {
            sink_in_fraction: start + SINK_IN_STEP * f64::from(share),
            width: libm::exp2(f64::from(width) / WIDTHS.0),
        };
        let exists = |(share, width): (i32, i32)| {
            let value = start + SINK_IN_STEP * f64::from(share);
            SINK_INS.contains(&(value * 1e9).round().mul_add(1e-9, 0.0)) && width.abs() <= WIDTHS.1
        };
        let mut known: BTreeMap<(i32, i32), Vec<f64>> = BTreeMap::new();
        let mut least = |left_out: Option<usize>| {
            let mut cost = |at: (i32, i32)| {
                let costs = known.entry(at).or_insert_with(|| self.costs(&of(at)));
                sum(costs, left_out)
            };
            let (mut best, mut value) = ((0, 0), 0.0);
            loop {
                let before = best;
                for step in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                    loop {
                        let next = (best.0 + step.0, best.1 + step.1);
                        if !exists(next) || cost(next) >= value {
                            break;
                        }
                        (best, value) = (next, cost(next));
                    }
                }
                if best == before {
                    return best;
                }
            }
        };
        let all = least(None);
        let folds: Vec<(i32, i32)> = (0..self.taken.len()).map(|i| least(Some(i))).collect();
        let gain = |(i, at): (usize, &(i32, i32))| known.get(at).map_or(0.0, |costs| -costs[i]);
        Some(Tried {
            change: of(all),
            gains: folds.iter().enumerate().map(gain).collect(),
            folds: folds.iter().map(|at| of(*at)).collect(),
        })
    }

    /// Factors around 1 along one line, `steps` of them an octave.
    fn along(&self, (steps, reach): (f64, i32), of: impl Fn(f64) -> Change) -> Tried {
        let ln = |step: f64| step / steps * std::f64::consts::LN_2;
        let all: Vec<Vec<f64>> = (-reach..=reach)
            .map(|step| match step {
                0 => vec![0.0; self.taken.len()],
                _ => self.costs(&of(libm::exp(ln(f64::from(step))))),
            })
            .collect();
        let least = |left_out: Option<usize>| {
            let sums: Vec<f64> = all.iter().map(|costs| sum(costs, left_out)).collect();
            (0..sums.len()).min_by(|&a, &b| sums[a].total_cmp(&sums[b])).map_or((0, 0.0), |at| {
                let step = at as i32 - reach;
                (at, f64::from(step) + between(&sums, at))
            })
        };
        let change = |step: f64| of(libm::exp(ln(step)));
        let folds: Vec<(usize, f64)> = (0..self.taken.len()).map(|i| least(Some(i))).collect();
        Tried {
            change: change(least(None).1),
            gains: folds.iter().enumerate().map(|(i, (at, _))| -all[*at][i]).collect(),
            folds: folds.iter().map(|(_, step)| change(*step)).collect(),
        }
    }

    /// The frame without contact as the presses show it, less what the sensor file draws; not a number where none does.
    fn frame(&self) -> [Vec<f32>; 3] {
        let n = self.sensor.grid.len();
        let mut counts = vec![0u32; n];
        let mut sums = [vec![0.0f32; n], vec![0.0; n], vec![0.0; n]];
        for (taken, change) in self.taken.iter().zip(&self.drawn) {
            for (p, _) in taken.zones.iter().enumerate().filter(|(_, zone)| **zone >= Zone::Shadow) {
                counts[p] += 1;
                for c in 0..3 {
                    sums[c][p] += taken.measured[c][p] / self.allowed.gain[c] - change[c].values[p];
                }
            }
        }
        sums.map(|sum| sum.iter().zip(&counts).map(|(s, &n)| s / n as f32).collect())
    }

    /// The place about which the frame is zoomed: Gauss and Newton's steps on the frame at rest, whose levels may all shift.
    fn shift(&self, today: &[Vec<f32>; 3], zoom: f64) -> [f64; 2] {
        let grid = &self.sensor.grid;
        let (w, h) = (grid.width_px, grid.height_px);
        let mut shift = [0.0; 2];
        let unit_px = w as f64 / 2.0;
        for _ in 0..ROUNDS {
            let seen = seen_before(grid, zoom, shift);
            let planes = [0, 1, 2].map(|c| zoomed_plane(&self.sensor.rest[c], grid, zoom, shift));
            let (mut products, mut targets) = ([[0.0f64; 2]; 2], [0.0f64; 2]);
            for c in 0..3 {
                let plane = Plane { width: w, height: h, values: planes[c].clone() };
                let (along_x, along_y) = crate::gradient::gradient(&plane);
                let used = |p: &usize| {
                    let (x, y) = (p % w, p / w);
                    x.is_multiple_of(STRIDE)
                        && y.is_multiple_of(STRIDE)
                        && seen[*p]
                        && today[c][*p].is_finite()
                };
                let list: Vec<usize> = (0..grid.len()).filter(used).collect();
                // What a pixel changes by where the old frame is read half a frame further.
                let row = |p: usize| {
                    let scale = zoom * unit_px;
                    [f64::from(along_x.values[p]) * scale, f64::from(along_y.values[p]) * scale]
                };
                let off = |p: usize| f64::from(today[c][p] - planes[c][p]);
                let n = list.len().max(1) as f64;
                let mut means = [0.0f64; 3];
                for &p in &list {
                    let [x, y] = row(p);
                    means[0] += x / n;
                    means[1] += y / n;
                    means[2] += off(p) / n;
                }
                for &p in &list {
                    let r = row(p);
                    let r = [r[0] - means[0], r[1] - means[1]];
                    let o = off(p) - means[2];
                    for i in 0..2 {
                        targets[i] += r[i] * o;
                        for j in 0..2 {
                            products[i][j] += r[i] * r[j];
                        }
                    }
                }
            }
            let determinant = products[0][0] * products[1][1] - products[0][1] * products[1][0];
            if determinant <= 1e-9 * products[0][0] * products[1][1] {
                return shift;
            }
            // A frame of the same window: within what its zoom moves its corners by.
            let most = (1.0 - 1.0 / zoom).abs();
            let step = [
                (products[1][1] * targets[0] - products[0][1] * targets[1]) / determinant,
                (products[0][0] * targets[1] - products[0][1] * targets[0]) / determinant,
            ];
            shift = [0, 1].map(|i| (shift[i] + step[i]).clamp(-most, most));
        }
        shift
    }
}

/// Sum without one.
fn sum(costs: &[f64], left_out: Option<usize>) -> f64 {
    costs.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, cost)| cost).sum()
}

/// How far from the lowest of some values, which are a step apart, the parabola through it and its neighbours has its lowest point.
fn between(values: &[f64], at: usize) -> f64 {
    let (Some(before), Some(after)) = (at.checked_sub(1).map(|i| values[i]), values.get(at + 1)) else {
        return 0.0;
    };
    let curvature = before - 2.0 * values[at] + after;
    if curvature > 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Residuals of presses whose marks scatter, but together are as wide as they ought to be within what marks are unsure by: a
/// factor beyond that, which all share, is a change. Returns the logarithms of the radii too.
fn centred(n: usize, left: impl Fn(usize, Option<f64>) -> Left) -> (Vec<Left>, Vec<f64>) {
    let ln_radii: Vec<f64> = (0..n).map(|i| left(i, None).ln_radius).collect();
    let mean = ln_radii.iter().sum::<f64>() / n.max(1) as f64;
    let beyond = mean - mean.clamp(-RADIUS, RADIUS);
    let each = ln_radii.iter().enumerate().map(|(i, ln_radius)| left(i, Some(ln_radius - beyond)));
    (each.collect(), ln_radii)
}

/// What a sensor draws of a contact.
pub(super) fn draw(sensor: &Sensor, contact: &Contact, ball_m: f64) -> [Plane; 3] {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let contact = contact.within(ball_m, &sensor.grid);
    renderer.change(&contact.imprint(ball_m, &sensor.grid, &sensor.gel_shape, sink_in_fraction(sensor)))
}

impl Change {
    /// A contact and its ball as the change has them.
    pub(super) fn contact(&self, contact: &Contact, ball_m: f64) -> (Contact, f64) {
        match self {
            Change::Ball { factor } => (contact.clone(), (factor * ball_m)),
            Change::Force { factor } => {
                let circle = Circle { radius_px: contact.circle.radius_px * factor, ..contact.circle };
                (Contact { circle, ..contact.clone() }, ball_m)
            }
            _ => (contact.clone(), ball_m),
        }
    }
}
