//! One press of today at the resolution of a fit, and what a drawing leaves in its zones.

use super::ZONE_COUNT;
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::presses::{Contact, Zone};
use nalgebra::{Cholesky, Matrix3, Vector3};

/// Squared error that rounding to whole grey levels makes: no model leaves less.
pub(super) const ROUNDING: f64 = 1.0 / 12.0;

/// Fewest pixels by which a zone counts.
const MIN_PIXELS: usize = 30;

/// A press as it was taken.
pub(super) struct Taken {
    pub(super) width: usize,
    /// Grey levels of red, green and blue.
    pub(super) measured: [Vec<f32>; 3],
    pub(super) zones: Vec<Zone>,
    pub(super) contact: Contact,
}

/// What every explanation may do without being a change.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowed {
    /// Even shift of a colour, grey levels.
    pub(super) level: f64,
    /// Shift of the mark along columns and rows, pixels.
    pub(super) mark_px: f64,
    /// Logarithm of the radius over the marked one.
    pub(super) ln_radius: f64,
    /// Gain of each colour.
    pub(super) gain: [f32; 3],
}

/// The residual of a drawing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left {
    /// Mean square of each zone that is there, grey levels squared.
    pub(super) squares: [Option<f64>; ZONE_COUNT],
    /// Even shift of each colour.
    pub(super) level: [f64; 3],
    /// Logarithm of the radius of the contact over the marked one.
    pub(super) ln_radius: f64,
}

impl Left {
    /// Sum over the zones of the logarithm of the residual, against another drawing of the same pixels.
    pub(super) fn against(&self, other: &Self) -> f64 {
        let zones = self.squares.iter().zip(&other.squares);
        zones.filter_map(|(a, b)| Some(libm::log((*a)? / (*b)?))).sum()
    }
}

impl Taken {
    /// What `rest` with `change` leaves at the pixels of `within`, where the camera may have shifted all levels a little, and whoever
    /// marked the contact its place.
    pub(super) fn left(
        &self,
        rest: &[Vec<f32>; 3],
        change: &[Plane; 3],
        wider: &[Plane; 3],
        within: Option<&[bool]>,
        allowed: &Allowed,
        ln_radius: Option<f64>,
    ) -> Left {
        let inside = |p: usize| within.is_none_or(|within| within[p]);
        let mut residual = [0, 1, 2].map(|c| {
            let level = |(p, &m): (usize, &f32)| {
                m - (allowed.gain[c] * (rest[c][p] + change[c].values[p])).clamp(0.0, 255.0)
            };
            self.measured[c].iter().enumerate().map(level).collect::<Vec<f32>>()
        });
        let level = self.level(&residual, &inside, allowed.level);
        for (plane, level) in residual.iter_mut().zip(level) {
            plane.iter_mut().for_each(|r| *r -= level as f32);
        }
        let ln_radius = self.straighten(&mut residual, change, wider, &inside, allowed, ln_radius);
        let (mut sums, mut counts) = ([0.0f64; ZONE_COUNT], [0usize; ZONE_COUNT]);
        for (p, zone) in self.zones.iter().enumerate().filter(|(p, _)| inside(*p)) {
            counts[*zone as usize] += 1;
            sums[*zone as usize] += residual.iter().map(|plane| f64::from(plane[p]).powi(2)).sum::<f64>();
        }
        let squares = [0, 1, 2, 3]
            .map(|z| (counts[z] >= MIN_PIXELS).then(|| sums[z] / (3 * counts[z]) as f64 + ROUNDING));
        Left { squares, level, ln_radius }
    }

    /// Mean of the farthest zone that is there.
    fn level(&self, residual: &[Vec<f32>; 3], inside: &impl Fn(usize) -> bool, most: f64) -> [f64; 3] {
        let (mut sums, mut counts) = ([[0.0f64; 3]; ZONE_COUNT], [0usize; ZONE_COUNT]);
        for (p, zone) in self.zones.iter().enumerate().filter(|(p, _)| inside(*p)) {
            counts[*zone as usize] += 1;
            for c in 0..3 {
                sums[*zone as usize][c] += f64::from(residual[c][p]);
            }
        }
        let farthest = (0..ZONE_COUNT).rev().find(|&z| counts[z] >= MIN_PIXELS);
        farthest.map_or([0.0; 3], |z| sums[z].map(|sum| (sum / counts[z] as f64).clamp(-most, most)))
    }

    /// Moves the change of the contact to where it leaves least, and makes it as wide, to first order and within what is allowed.
    /// Returns the logarithm of its radius over the marked one, which `ln_radius` may say.
    fn straighten(
        &self,
        residual: &mut [Vec<f32>; 3],
        change: &[Plane; 3],
        wider: &[Plane; 3],
        inside: &impl Fn(usize) -> bool,
        allowed: &Allowed,
        ln_radius: Option<f64>,
    ) -> f64 {
        if let Some(ln_radius) = ln_radius {
            for (plane, wider) in residual.iter_mut().zip(wider) {
                plane.iter_mut().zip(&wider.values).for_each(|(r, w)| *r -= ln_radius as f32 * w);
            }
        }
        let slopes = [0, 1, 2].map(|c| gradient(&change[c]));
        let along = |c: usize, p: usize| {
            [-slopes[c].0.values[p], -slopes[c].1.values[p], wider[c].values[p]].map(f64::from)
        };
        let mut products = Matrix3::<f64>::zeros();
        let mut targets = Vector3::<f64>::zeros();
        for (p, _) in self.zones.iter().enumerate().filter(|(p, z)| **z != Zone::Far && inside(*p)) {
            for (c, plane) in residual.iter().enumerate() {
                let (row, r) = (along(c, p), f64::from(plane[p]));
                for i in 0..3 {
                    targets[i] += row[i] * r;
                    for j in 0..3 {
                        products[(i, j)] += row[i] * row[j];
                    }
                }
            }
        }
        if ln_radius.is_some() {
            // The radius is known: only the place is open.
            for i in 0..3 {
                products[(i, 2)] = 0.0;
                products[(2, i)] = 0.0;
            }
            (products[(2, 2)], targets[2]) = (1.0, 0.0);
        }
        let most = [allowed.mark_px, allowed.mark_px, allowed.ln_radius];
        let Some(moved) = Cholesky::new(products).map(|cholesky| cholesky.solve(&targets)) else {
            return 0.0;
        };
        let moved = [0, 1, 2].map(|i| moved[i].clamp(-most[i], most[i]));
        for (c, plane) in residual.iter_mut().enumerate() {
            for (p, r) in plane.iter_mut().enumerate() {
                let shown: f64 = along(c, p).iter().zip(moved).map(|(a, m)| a * m).sum();
                *r -= shown as f32;
            }
        }
        ln_radius.unwrap_or(moved[2])
    }
}
