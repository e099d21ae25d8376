//! How much two gripping patches hold when arm, fingers and fixture yield in rotation, but not freely.
//!
//! The pull acts through the grip centre; a patch beside it also turns the grip, by t about the jaw axis, until a spring K
//! holds the moment. Every cell is a bristle with a place s_i on the part, a stiffness k_i and a limit L_i; with the tool
//! at x the grip is in equilibrium where
//!
//! ```text
//! K t + sum_i f_i . (a_i, -b_i) = 0,   f_i = k_i (u_i - s_i), at most L_i long,   u_i = (x + t a_i, -t b_i)
//! ```
//!
//! (a_i across, b_i along the pull, both from the pull line). A bristle at its limit drags its foot along. The pull force
//! is the sum of the f_i along the pull. It rises while the spring winds up: K = 0 leaves what the limit surface says
//! ([`crate::free_twist_capacity_n`]), a rigid K the sum of the limits, and the stiffer K the more is reached within a
//! given way of the tool.

/// A cell of a patch in the plane of the jaws, seen from the line of the pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwistCell {
    /// Across the pull.
    pub across_m: f64,
    /// Along the pull.
    pub along_m: f64,
    /// Largest tangential force.
    pub limit_n: f64,
    /// Tangential force per displacement before that.
    pub stiffness_n_per_m: f64,
}

/// Steps of the way, shorter at its beginning.
const STEPS: u32 = 120;

/// Share of the sum of the limits at which nothing is left to gain.
const ALL: f64 = 1.0 - 1e-6;

/// Newton steps at most.
const MAX_ITERATIONS: usize = 60;

/// Largest force along the pull while the tool moves by `way_m` after the last cell could have begun to slip.
///
/// Once all cells slip, their limits are `kinetic_ratio` times what they were.
pub fn compliant_twist_capacity_n(
    cells: &[TwistCell],
    stiffness_n_m_per_rad: f64,
    way_m: f64,
    kinetic_ratio: f64,
) -> f64 {
    let cells: Vec<TwistCell> =
        cells.iter().filter(|c| c.limit_n > 0.0 && c.stiffness_n_per_m > 0.0).copied().collect();
    let straight: f64 = cells.iter().map(|c| c.limit_n).sum();
    let reach_m = cells.iter().fold(0.0_f64, |m, c| m.max(c.limit_n / c.stiffness_n_per_m));
    let mut grip = Grip { feet: vec![[0.0; 2]; cells.len()], cells, ratio: 1.0, stiffness_n_m_per_rad };
    let (mut angle, mut most) = (0.0, 0.0_f64);
    for step in 1..=STEPS {
        let part = f64::from(step) / f64::from(STEPS);
        let x = part * part * (reach_m + way_m);
        angle = grip.settle(x, angle);
        let (force, all_slip) = grip.drag(x, angle);
        most = most.max(force);
        if most >= ALL * straight {
            return straight;
        }
        if all_slip {
            grip.ratio = kinetic_ratio;
        }
    }
    most
}

struct Grip {
    cells: Vec<TwistCell>,
    /// Where each bristle stands, along and across.
    feet: Vec<[f64; 2]>,
    /// What is left of the limits.
    ratio: f64,
    stiffness_n_m_per_rad: f64,
}

impl Grip {
    /// Stretch of bristle i, its length, and the length at which it slips.
    fn stretch(&self, i: usize, x: f64, angle: f64) -> ([f64; 2], f64, f64) {
        let (cell, foot) = (&self.cells[i], &self.feet[i]);
        let along = x + angle * cell.across_m - foot[0];
        let across = -angle * cell.along_m - foot[1];
        ([along, across], libm::hypot(along, across), self.ratio * cell.limit_n / cell.stiffness_n_per_m)
    }

    /// Moment that is missing for equilibrium, its slope over the angle, and its size.
    fn moment(&self, x: f64, angle: f64) -> (f64, f64, f64) {
        let k = self.stiffness_n_m_per_rad;
        let (mut moment, mut slope, mut size) = (k * angle, k, (k * angle).abs());
        for (i, c) in self.cells.iter().enumerate() {
            let ([along, across], length, reach) = self.stretch(i, x, angle);
            let arm = along * c.across_m - across * c.along_m;
            let square = c.across_m * c.across_m + c.along_m * c.along_m;
            let (per_stretch, per_angle) = if length <= reach {
                (c.stiffness_n_per_m, square)
            } else {
                (c.stiffness_n_per_m * reach / length, square - (arm / length) * (arm / length))
            };
            moment += per_stretch * arm;
            slope += per_stretch * per_angle.max(0.0);
            size += (per_stretch * arm).abs();
        }
        (moment, slope, size)
    }

    /// The angle of equilibrium at a place of the tool: the root of a function that never falls.
    fn settle(&self, x: f64, start: f64) -> f64 {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut angle = start;
        for _ in 0..MAX_ITERATIONS {
            let (moment, slope, size) = self.moment(x, angle);
            if moment.abs() <= 1e-12 * size {
                break;
            }
            if moment < 0.0 {
                low = angle;
            } else {
                high = angle;
            }
            let newton = angle - moment / slope;
            if newton == angle {
                break;
            }
            angle = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        }
        angle
    }

    /// Moves the feet of bristles at their limits; the force along the pull, and whether all slip.
    fn drag(&mut self, x: f64, angle: f64) -> (f64, bool) {
        let (mut force, mut all_slip) = (0.0, true);
        for i in 0..self.cells.len() {
            let ([along, across], length, reach) = self.stretch(i, x, angle);
            let share = if length > reach { reach / length } else { 1.0 };
            all_slip &= length > reach;
            force += self.cells[i].stiffness_n_per_m * share * along;
            self.feet[i][0] += (1.0 - share) * along;
            self.feet[i][1] += (1.0 - share) * across;
        }
        (force, all_slip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LimitCell, free_twist_capacity_n};
    use std::f64::consts::FRAC_1_SQRT_2;

    const WAY_M: f64 = 5e-3;

    /// Two cells at d = 2 mm on both sides of a centre that lies e across from the pull line.
    fn pair(lever_m: f64) -> [TwistCell; 2] {
        [2e-3, -2e-3].map(|d| TwistCell {
            across_m: d - lever_m,
            along_m: 0.0,
            limit_n: 3.0,
            stiffness_n_per_m: 2e4,
        })
    }

    /// By hand: once the nearer cell slips at L, the farther one holds f, and moments about the pull line and the spring
    /// give (L + f) (e + d) = 2 L d + K t with f = k (x - t (e + d)), until f is L too.
    #[test]
    fn two_cells_follow_their_closed_form_between_the_limits() {
        let (d, limit, k) = (2e-3, 3.0, 2e4);
        let x = limit / k + WAY_M;
        for e in [0.5e-3, 2e-3, 6e-3] {
            let (free, rigid) = (2.0 * limit * d / (e + d), 2.0 * limit);
            let mut last = 0.0;
            for stiffness in [1e-6, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 1e3, 1e6] {
                let angle =
                    ((limit + k * x) * (e + d) - 2.0 * limit * d) / (stiffness + k * (e + d) * (e + d));
                let by_hand = (limit + k * (x - angle * (e + d))).min(rigid);
                let force = compliant_twist_capacity_n(&pair(e), stiffness, WAY_M, 1.0);
                let off = force / by_hand - 1.0;
                assert!(off.abs() < 1e-6, "K {stiffness}, e {e}: {force} N, by hand {by_hand} N");
                assert!(force >= last && force >= free * (1.0 - 1e-9) && force <= rigid);
                last = force;
            }
            let soft = compliant_twist_capacity_n(&pair(e), 1e-6, WAY_M, 1.0);
            assert!((soft / free - 1.0).abs() < 1e-3 && last == rigid, "{soft} {free}");
        }
    }

    /// A round patch with a Hertz-like pressure, its centre beside the pull line.
    fn hertz(lever_m: [f64; 2]) -> Vec<TwistCell> {
        let mut cells = Vec::new();
        for i in 0..8 {
            for j in 0..8 {
                let at = |k: i32| (f64::from(k) + 0.5) / 8.0 * 2.0 - 1.0;
                let p = 1.0 - at(i).powi(2) - at(j).powi(2);
                if p > 0.0 {
                    cells.push(TwistCell {
                        across_m: 4e-3 * at(i) + lever_m[0],
                        along_m: 4e-3 * at(j) + lever_m[1],
                        limit_n: 0.2 * p.sqrt(),
                        stiffness_n_per_m: 800.0,
                    });
                }
            }
        }
        cells
    }

    /// A soft spring leaves the bound of the limit surface, another theory; a stiff one the sum; and between them more
    /// stiffness never holds less.
    #[test]
    fn a_patch_goes_from_the_limit_surface_to_the_sum_of_its_limits() {
        for lever_m in [[0.0, 0.0], [3e-3, 0.0], [-6e-3, 1e-3], [0.0, 6e-3]] {
            let cells = hertz(lever_m);
            let limits: Vec<LimitCell> = cells
                .iter()
                .map(|c| LimitCell { across_m: c.across_m, along_m: c.along_m, limit_n: c.limit_n })
                .collect();
            let free = free_twist_capacity_n(&limits, 0.0);
            let straight: f64 = cells.iter().map(|c| c.limit_n).sum();
            let held = |stiffness: f64| compliant_twist_capacity_n(&cells, stiffness, WAY_M, 1.0);
            assert!((held(1e-6) / free - 1.0).abs() < 5e-3, "{lever_m:?}: {} and {free} N", held(1e-6));
            assert_eq!(held(1e5), straight);
            let mut last = 0.0;
            for i in -30..30 {
                let force = held(10f64.powf(f64::from(i) / 6.0));
                assert!(force >= last * (1.0 - 1e-6), "{lever_m:?}: {force} N after {last} N");
                last = force;
            }
        }
    }

    /// The grip turns both ways alike, and a quarter turn of patch and pull changes nothing.
    #[test]
    fn the_side_of_the_lever_does_not_matter() {
        let held = |x: f64| compliant_twist_capacity_n(&hertz([x, 0.0]), 0.05, WAY_M, 1.0);
        assert!((held(3e-3) / held(-3e-3) - 1.0).abs() < 1e-9);
        let turned: Vec<TwistCell> = hertz([3e-3, 0.0])
            .iter()
            .map(|c| TwistCell {
                across_m: FRAC_1_SQRT_2 * (c.across_m + c.along_m) + (1.0 - FRAC_1_SQRT_2) * 3e-3,
                along_m: FRAC_1_SQRT_2 * (c.along_m - c.across_m) + FRAC_1_SQRT_2 * 3e-3,
                ..*c
            })
            .collect();
        let turned = compliant_twist_capacity_n(&turned, 0.05, WAY_M, 1.0);
        assert!((turned / held(3e-3) - 1.0).abs() < 5e-3, "{turned} {}", held(3e-3));
    }

    /// Sliding friction that is lower than static does not let the spring wind up after the slip.
    #[test]
    fn kinetic_friction_leaves_the_force_of_the_first_slip() {
        let cells = hertz([4e-3, 0.0]);
        let held = |ratio: f64| compliant_twist_capacity_n(&cells, 0.3, WAY_M, ratio);
        let (low, high, all) = (held(0.5), held(0.94), held(1.0));
        assert!(low == held(0.6) && low < 0.96 * all && low <= high && high < all, "{low} {high} {all}");
        assert_eq!(compliant_twist_capacity_n(&[], 1.0, WAY_M, 1.0), 0.0);
    }
}
