//! How far a contact bends before it slips, from traces: the displacement at which the force stops to follow, over that of
//! springs which let go together.
//!
//! A bed of springs (the default of a twin) moves by up to twice `limit / stiffness` before all of it slips, a contact whose
//! compliance lies behind it, in fingers or the backing of a gel, by hardly more than once. Labels know of it only through
//! the displacement at which a pull is stopped: a twin whose soft contacts bend too far ends there before it slips.

use super::context::Context;
use gripgen_twin::Backbone;

/// Fewest traces.
const MIN_TRACES: usize = 3;

/// Rows of a trace that are looked at.
const ROWS: usize = 60;

/// Steps between a contact that lets go together and a bed of springs.
const STEPS: usize = 20;

/// Share of the limit to which the curve of a contact is the one predicted.
const ALIKE: f64 = 0.02;

/// How well the twin that was given knows it.
const GIVEN: f64 = 0.5;

/// A trace up to its slip: readings and displacements, what it held, and the cells of its contact.
struct Bent {
    rows: Vec<(f64, f64)>,
    limit_n: f64,
    cells: Vec<(f64, f64)>,
}

impl Context<'_> {
    /// Learns by how much contacts bend, and the stiffness with which they begin to.
    pub(super) fn read_bend(&mut self) {
        let bent: Vec<Bent> =
            self.observations.iter().enumerate().filter_map(|(k, _)| self.bent(k)).collect();
        if bent.len() < MIN_TRACES {
            return;
        }
        let given = self.base.shear_by_area;
        let cost = |by_area: f64| {
            let off = (by_area - given) / GIVEN;
            0.5 * off * off + bent.iter().map(|b| b.best(by_area, self.base.noise_n).1).sum::<f64>()
        };
        let costs: Vec<f64> = (0..=STEPS).map(|i| cost(i as f64 / STEPS as f64)).collect();
        let Some(best) = (0..=STEPS).min_by(|&a, &b| costs[a].total_cmp(&costs[b])) else { return };
        // The lowest point of the parabola through the best and its neighbours.
        let mut at = best as f64;
        if (1..STEPS).contains(&best) {
            let (low, high) = (costs[best - 1] - costs[best], costs[best + 1] - costs[best]);
            at += if low + high > 0.0 { 0.5 * (low - high) / (low + high) } else { 0.0 };
        }
        self.base.shear_by_area = at / STEPS as f64;
        let mut each: Vec<f64> =
            bent.iter().map(|b| b.best(self.base.shear_by_area, self.base.noise_n).0).collect();
        each.sort_by(f64::total_cmp);
        self.base.stiffness_n_per_m = each[each.len() / 2].clamp(200.0, 2e6);
    }

    fn bent(&self, k: usize) -> Option<Bent> {
        let observation = &self.observations[k];
        let (slip_s, limit) = (observation.slip_s?, observation.limit_n?);
        let no_load_n = observation.no_load_n.map_or(0.0, |b| b.0);
        let pull = &self.data.measured.pulls[observation.row];
        let (trace, shift_n) = (pull.trace.as_ref()?, pull.zero_shift_n);
        let pulled: Vec<_> = trace.rows().filter(|r| r.time_s >= 0.0 && r.time_s < slip_s).collect();
        let start_m = pulled.first()?.displacement_m;
        let step = pulled.len().div_ceil(ROWS).max(1);
        let rows = pulled.iter().step_by(step);
        let rows: Vec<(f64, f64)> =
            rows.map(|r| (r.measured_force_n - no_load_n - shift_n, r.displacement_m - start_m)).collect();
        let cells = self.predictor.contact(&self.base, observation.row);
        let limit_n = limit.value_n - no_load_n;
        (rows.len() >= 8 && !cells.is_empty() && limit_n > 6.0 * self.base.noise_n).then_some(Bent {
            rows,
            limit_n,
            cells,
        })
    }
}

impl Bent {
    /// The stiffness with which this contact follows its trace best, and half the sum of squares that is left.
    fn best(&self, by_area: f64, noise_n: f64) -> (f64, f64) {
        let curve = Backbone::new(&self.cells, by_area);
        let variance = noise_n * noise_n + (ALIKE * self.limit_n).powi(2);
        let cost = |log_stiffness: f64| {
            let per_m = libm::exp(log_stiffness) / self.limit_n;
            let off = self.rows.iter().map(|(force_n, x_m)| force_n - self.limit_n * curve.at(per_m * x_m).0);
            0.5 * off.map(|r| r * r).sum::<f64>() / variance
        };
        let max_m = self.rows.iter().map(|r| r.1).fold(1e-6, f64::max);
        // Stiffnesses around the one with which springs reach the limit at the slip.
        let middle = libm::log(self.limit_n / max_m);
        let found = lowest(middle - 0.7, middle + 1.4, cost);
        (libm::exp(found), cost(found))
    }
}

/// Where a function with one valley is lowest, by golden sections.
fn lowest(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..24 {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - GOLDEN * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + GOLDEN * (high - low);
            fb = f(b);
        }
    }
    0.5 * (low + high)
}
