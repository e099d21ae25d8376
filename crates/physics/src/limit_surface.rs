//! How much two gripping patches hold when nothing holds the grip's rotation.
//!
//! A pull beside the centre of a patch also turns it about the jaw axis. Sliding with speed v along the pull and turning
//! at rate w moves cell i, at a across and b along the pull, by (v + w a) along and -w b across. By the upper bound
//! theorem of plasticity (friction with given pressure is associative) the pull force F at the lever e satisfies
//!
//! ```text
//! F = min over (v, w) of  sum_i L_i sqrt((v + w a_i)^2 + (w b_i)^2) / (v + w e)
//! ```
//!
//! (Goyal, Ruina & Papadopoulos 1991 for the limit surface itself; kinematic bound: Chen & Han 1988). The quotient of
//! a convex and a linear function has one minimum, found by golden section over the ratio of w to v.

/// A cell of a patch in the plane of the jaws, seen from the middle between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitCell {
    /// Across the pull.
    pub across_m: f64,
    /// Along the pull.
    pub along_m: f64,
    /// Largest tangential force.
    pub limit_n: f64,
}

/// Golden section steps: the bracket of half a turn shrinks below 1e-12.
const STEPS: usize = 60;

/// Force along the pull, acting at `lever_m` across it, at which the patch slips and turns. Equals the sum of the
/// limits where the lever and the patch are centred; 0 for a patch without limits.
pub fn free_twist_capacity_n(cells: &[LimitCell], lever_m: f64) -> f64 {
    let straight: f64 = cells.iter().map(|c| c.limit_n).sum();
    if straight == 0.0 {
        return 0.0;
    }
    // A length that makes turning and sliding comparable.
    let size_m = cells.iter().fold(lever_m.abs(), |m, c| m.max(c.across_m.abs()).max(c.along_m.abs()));
    if size_m == 0.0 {
        return straight;
    }
    let force = |angle: f64| {
        let (v, w) = (libm::cos(angle), libm::sin(angle) / size_m);
        let power: f64 =
            cells.iter().map(|c| c.limit_n * libm::hypot(v + w * c.across_m, w * c.along_m)).sum();
        let travel = v + w * lever_m;
        // Outside the half plane in which the pull does work there is no bound.
        if travel > 1e-12 { power / travel } else { f64::INFINITY }
    };
    // The pull does work for angles within a quarter turn of this one.
    let middle = libm::atan2(lever_m / size_m, 1.0);
    let quarter = std::f64::consts::FRAC_PI_2;
    let (mut low, mut high) = (middle - quarter, middle + quarter);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut fa, mut fb) = (force(a), force(b));
    for _ in 0..STEPS {
        if fa <= fb {
            (high, b, fb) = (b, a, fa);
            a = high - golden * (high - low);
            fa = force(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + golden * (high - low);
            fb = force(b);
        }
    }
    // Sliding without turning is always possible.
    fa.min(fb).min(straight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An elliptic patch with a Hertz-like pressure on a grid.
    fn hertz(n: usize, size_m: [f64; 2], total_n: f64) -> Vec<LimitCell> {
        let mut cells = Vec::new();
        for i in 0..n {
            for j in 0..n {
                let at = |k: usize| (k as f64 + 0.5) / n as f64 * 2.0 - 1.0;
                let (u, v) = (at(i), at(j));
                let p = 1.0 - u * u - v * v;
                if p > 0.0 {
                    let limit_n = p.sqrt();
                    cells.push(LimitCell {
                        across_m: u * size_m[0] / 2.0,
                        along_m: v * size_m[1] / 2.0,
                        limit_n,
                    });
                }
            }
        }
        let sum: f64 = cells.iter().map(|c| c.limit_n).sum();
        cells.iter_mut().for_each(|c| c.limit_n *= total_n / sum);
        cells
    }

    #[test]
    fn a_centred_pull_holds_the_sum_of_the_limits() {
        let cells = hertz(40, [8e-3, 6e-3], 6.72);
        assert!((free_twist_capacity_n(&cells, 0.0) - 6.72).abs() < 1e-9);
        assert_eq!(free_twist_capacity_n(&[], 1e-3), 0.0);
    }

    /// Far away the pull only turns the patch: the capacity is the torsional limit over the lever.
    #[test]
    fn a_long_lever_leaves_the_torsional_limit() {
        let cells = hertz(60, [8e-3, 6e-3], 10.0);
        let torque: f64 = cells.iter().map(|c| c.limit_n * libm::hypot(c.across_m, c.along_m)).sum();
        for lever_m in [1.0, -1.0] {
            let force = free_twist_capacity_n(&cells, lever_m);
            assert!((force * lever_m.abs() / torque - 1.0).abs() < 1e-3, "{force}");
        }
    }

    /// Two equal points at distance d on both sides, lever e > 0: by hand, the far point does not slip, and moments about
    /// it give F (e + d) = 2 d L.
    #[test]
    fn two_points_follow_the_moment_balance() {
        let point = |across_m: f64| LimitCell { across_m, along_m: 0.0, limit_n: 1.0 };
        let cells = [point(-2e-3), point(2e-3)];
        for lever_m in [0.5e-3, 1e-3, 3e-3, 10e-3] {
            let by_hand = 2.0 * 2e-3 / (lever_m + 2e-3);
            let force = free_twist_capacity_n(&cells, lever_m);
            assert!((force / by_hand - 1.0).abs() < 1e-6, "{lever_m}: {force} N instead of {by_hand} N");
        }
    }

    /// Static equilibrium, an independent way: cells slide about a centre on the across axis; torque about the pull line
    /// vanishes there, and the force is that of the limit surface.
    #[test]
    fn the_bound_is_in_equilibrium() {
        let cells = hertz(200, [8e-3, 6e-3], 6.72);
        let lever_m = 4e-3;
        // Bisect for the centre of rotation (across = c) at which the friction has no moment about the pull line.
        let wrench = |c: f64| {
            cells.iter().fold((0.0, 0.0), |(f, m), cell| {
                let (a, b) = (cell.across_m - c, cell.along_m);
                let r = libm::hypot(a, b).max(1e-15);
                let (along, across) = (cell.limit_n * a / r, -cell.limit_n * b / r);
                (f + along, m + along * (cell.across_m - lever_m) - across * b)
            })
        };
        let (mut low, mut high) = (-50e-3, 0.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if (wrench(middle).1 > 0.0) == (wrench(low).1 > 0.0) { low = middle } else { high = middle }
        }
        let exact = wrench(0.5 * (low + high)).0;
        let bound = free_twist_capacity_n(&cells, lever_m);
        assert!((bound / exact - 1.0).abs() < 1e-4, "{bound} N, equilibrium {exact} N");
        let coarse = free_twist_capacity_n(&hertz(9, [8e-3, 6e-3], 6.72), lever_m);
        assert!((coarse / bound - 1.0).abs() < 0.02, "{coarse} N on 64 cells, {bound} N converged");
    }
}
