//! The cells of both contact patches as bristles: springs that stand on the part and are dragged along at their limits.

use crate::jaw_friction::JawFriction;
use gripgen_twin::{Gel, PerJaw};

/// Cells are padded to a multiple of this, so that sums have one fixed order whatever the vector unit.
const LANES: usize = 8;

/// Force along the pull above which the first cell of the contact slides, N: all cells are sheared alike until then.
pub fn slip_onset_force_n(gel: &PerJaw<Gel>, friction: &PerJaw<JawFriction>) -> f64 {
    let (bristles, _) = Bristles::new(gel, friction);
    let columns = bristles.reach_m.iter().zip(&bristles.stiffness_n_per_m);
    let reach_m =
        columns.filter(|(_, k)| **k > 0.0).fold(f64::INFINITY, |least, (reach, _)| least.min(*reach));
    bristles.total_n_per_m * reach_m
}

/// The bristles of both jaws, one column each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bristles {
    pub(crate) stiffness_n_per_m: Vec<f64>,
    pub(crate) limit_n: Vec<f64>,
    /// Stretch at which a bristle is at its limit; 0 for padded cells.
    pub(crate) reach_m: Vec<f64>,
    pub(crate) foot_m: Vec<f64>,
    /// Stiffness of all of them.
    pub(crate) total_n_per_m: f64,
}

impl Bristles {
    /// The bristles of both jaws, and where those of the right one begin.
    pub(crate) fn new(gel: &PerJaw<Gel>, friction: &PerJaw<JawFriction>) -> (Self, usize) {
        let mut bristles = Self::default();
        let mut boundary = 0;
        for (jaw, friction) in friction.iter() {
            boundary = bristles.limit_n.len().max(boundary);
            for (cell, share) in friction.cells.iter().zip(friction.stiffness_shares()) {
                bristles.stiffness_n_per_m.push(gel[jaw].shear_stiffness_n_per_m * share);
                bristles.limit_n.push(cell.limit_n);
            }
            // Cells that carry nothing.
            let padded = bristles.limit_n.len().next_multiple_of(LANES);
            bristles.stiffness_n_per_m.resize(padded, 0.0);
            bristles.limit_n.resize(padded, 0.0);
        }
        bristles.foot_m = vec![0.0; bristles.limit_n.len()];
        bristles.total_n_per_m = bristles.force(0.0).1;
        bristles.measure();
        (bristles, boundary)
    }

    /// Force of all bristles at a tool position, and its slope: the stiffness of those that hold.
    #[inline]
    pub(crate) fn force(&self, position_m: f64) -> (f64, f64) {
        let (mut force, mut slope) = ([0.0; LANES], [0.0; LANES]);
        let columns = self
            .stiffness_n_per_m
            .as_chunks::<LANES>()
            .0
            .iter()
            .zip(self.limit_n.as_chunks::<LANES>().0)
            .zip(self.foot_m.as_chunks::<LANES>().0);
        for ((stiffness, limit), foot) in columns {
            for i in 0..LANES {
                let elastic = stiffness[i] * (position_m - foot[i]);
                // Two comparisons, without the care for NaN of `clamp`: two instructions for all lanes.
                let below = if elastic > limit[i] { limit[i] } else { elastic };
                let held = if below < -limit[i] { -limit[i] } else { below };
                force[i] += held;
                slope[i] += if held == elastic { stiffness[i] } else { 0.0 };
            }
        }
        (total(&force), total(&slope))
    }

    /// Finds the reach of every bristle.
    pub(crate) fn measure(&mut self) {
        let reach = |(limit, stiffness): (&f64, &f64)| if *stiffness > 0.0 { limit / stiffness } else { 0.0 };
        self.reach_m = self.limit_n.iter().zip(&self.stiffness_n_per_m).map(reach).collect();
    }

    /// Moves the feet of bristles at their limits.
    #[inline]
    pub(crate) fn drag(&mut self, position_m: f64) {
        for (foot, reach) in self.foot_m.iter_mut().zip(&self.reach_m) {
            let (low, high) = (position_m - reach, position_m + reach);
            let above = if *foot < low { low } else { *foot };
            *foot = if above > high { high } else { above };
        }
    }
}

fn total(lanes: &[f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}
