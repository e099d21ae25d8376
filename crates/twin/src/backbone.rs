//! The force of a contact over its shear, up to its slip: what Iwan (1966) calls the backbone of a contact.

/// Points of the curve.
const POINTS: usize = 129;

/// Share of its limit that a contact holds over its shear, displacement times stiffness over limit. Cells slip one after the
/// other where they are stiffer than what they hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbone {
    /// Share, its rise up to the next point and the slope there: evenly spaced up to [`Self::slips_at`].
    points: Vec<[f64; 3]>,
    slips_at: f64,
    /// Points of the curve to a unit of shear.
    per_shear: f64,
}

impl Backbone {
    /// A contact that lets go at once: a straight line.
    pub fn straight() -> Self {
        Self::through(&[0.0, 1.0], 1.0)
    }

    /// Of cells with their areas and limits, in any unit; `by_area` is the share of the stiffness that they have by
    /// their area, the rest is by their limit.
    pub fn new(cells: &[(f64, f64)], by_area: f64) -> Self {
        let total = cells.iter().fold((0.0, 0.0), |t, c| (t.0 + c.0, t.1 + c.1));
        let mut each: Vec<(f64, f64, f64)> = cells
            .iter()
            .map(|(area, limit)| (area / total.0, limit / total.1))
            .map(|(area, limit)| (by_area * area + (1.0 - by_area) * limit, limit))
            .filter(|(stiffness, _)| *stiffness > 0.0)
            .map(|(stiffness, limit)| (limit / stiffness, limit, stiffness))
            .collect();
        each.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(slips_at, ..)) = each.last().filter(|c| c.0 > 0.0) else { return Self::straight() };
        // What slipped cells hold, and the stiffness of the others, cell by cell.
        let (mut held, mut stiffness) = (0.0, each.iter().map(|c| c.2).sum::<f64>());
        let mut next = 0;
        let share = (0..POINTS).map(|i| {
            let shear = slips_at * i as f64 / (POINTS - 1) as f64;
            while next < each.len() && each[next].0 <= shear {
                held += each[next].1;
                stiffness -= each[next].2;
                next += 1;
            }
            if next == each.len() { held } else { held + stiffness * shear }
        });
        Self::through(&share.collect::<Vec<f64>>(), slips_at)
    }

    fn through(share: &[f64], slips_at: f64) -> Self {
        let per_shear = (share.len() - 1) as f64 / slips_at;
        let point = |i: usize| {
            let rise = share.get(i + 1).map_or(0.0, |next| next - share[i]);
            [share[i], rise, rise * per_shear]
        };
        Self { points: (0..share.len()).map(point).collect(), slips_at, per_shear }
    }

    /// The shear at which all of it has slipped.
    #[inline]
    pub fn slips_at(&self) -> f64 {
        self.slips_at
    }

    /// Whether part of it slips long before the rest: by a tenth of the shear of springs.
    pub fn bends(&self) -> bool {
        self.slips_at > 1.1
    }

    /// Share of its limit that it holds at a shear, and the slope there.
    #[inline]
    pub fn at(&self, shear: f64) -> (f64, f64) {
        let last = self.points.len() - 1;
        let x = if shear > 0.0 { shear * self.per_shear } else { 0.0 };
        let x = if x < last as f64 { x } else { last as f64 };
        // Points are few: a conversion of 32 bits is the quicker one.
        let i = x as i32;
        let [share, rise, slope] = self.points[i as usize];
        (share + (x - f64::from(i)) * rise, slope)
    }

    /// The shear at which it holds a share of its limit.
    pub fn shear_of(&self, share: f64) -> f64 {
        let last = self.points.len() - 1;
        let after = self.points.partition_point(|p| p[0] < share).clamp(1, last);
        let (low, high) = (self.points[after - 1][0], self.points[after][0]);
        let w = if high > low { ((share - low) / (high - low)).clamp(0.0, 1.0) } else { 1.0 };
        self.slips_at * (after as f64 - 1.0 + w) / last as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A paraboloid of pressure on a bed of springs: 1 - (1 - s / 2)^2 of its limit at the shear s, closed form; cells that are
    /// stiff by their load follow a straight line.
    #[test]
    fn a_bed_of_springs_bends_as_a_paraboloid_does() {
        let n = 4000;
        // Rings of equal area, pressure from the middle out.
        let cells: Vec<(f64, f64)> = (0..n)
            .map(|i| (1.0 / f64::from(n), 2.0 / f64::from(n) * (1.0 - (f64::from(i) + 0.5) / f64::from(n))))
            .collect();
        let (area, load) = (Backbone::new(&cells, 1.0), Backbone::new(&cells, 0.0));
        assert!(area.bends() && !load.bends());
        for s in [0.1, 0.5, 1.0, 1.5, 1.9, 2.5] {
            let closed = 1.0 - (1.0 - 0.5_f64 * s).max(0.0).powi(2);
            assert!((area.at(s).0 - closed).abs() < 1e-3, "{s}: {:?} for {closed}", area.at(s));
            assert!((load.at(s).0 - s.min(1.0)).abs() < 1e-9, "{s}");
            if s < 1.8 {
                assert!((area.at(s).1 - (1.0 - 0.5 * s)).abs() < 0.02, "{s}: {:?}", area.at(s));
                assert!((area.shear_of(closed) - s).abs() < 2e-3, "{s}");
            }
        }
    }
}
