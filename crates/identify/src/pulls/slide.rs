//! How a tool falls away from jaws that slide: damping and mass of the arm, from displacement against the force that nobody
//! holds.
//!
//! ```text
//! m x'' + d x' = F - F_c,   so   x = x_0 + y / d,   tau y'' + y' = F - F_c,   tau = m / d
//! ```
//!
//! with the force F of the loop and the reading F_c while the jaws slide. A controller that imposes an admittance answers
//! with its own mass, not with that of the arm's links: a twin that moves the links' mass with so little damping rings, and
//! ends its pulls later than the rig does.

use super::context::Context;
use super::observe::{TraceObservation, median};
use gripgen_twin::predict::PullModel;

/// Fewest rows of a slide, and fewest slides.
const MIN_ROWS: usize = 5;
const MIN_SLIDES: usize = 3;

/// Displacement that a slide has to reach.
const MIN_M: f64 = 5e-4;

/// Masses over dampings that are tried. A loop of 500 Hz answers no faster than the first.
const TAU_S: [f64; 11] = [0.004, 0.006, 0.009, 0.013, 0.02, 0.03, 0.045, 0.065, 0.1, 0.15, 0.22];

/// Squares that the rig's own mass may leave more than the best one does, of theirs.
const KEPT: f64 = 1.2;

/// A slide: times, displacements and forces that nobody holds.
struct Slide {
    time_s: Vec<f64>,
    way_m: Vec<f64>,
    free_n: Vec<f64>,
}

impl Context<'_> {
    /// Learns damping and, where that of the rig contradicts the slides, the mass.
    pub(super) fn read_slides(&mut self, raw: &[TraceObservation]) {
        // How fast jaws slide says nothing about the damping of a loop that winds up.
        if self.predictor.winds_up() {
            return;
        }
        let slides: Vec<Slide> = raw.iter().filter_map(|t| self.slide(t)).collect();
        if slides.len() < MIN_SLIDES {
            return;
        }
        let own_kg = self.predictor.mass_kg();
        let mut own_s = TAU_S[0];
        for _ in 0..8 {
            own_s = (own_kg / damping(&slides, own_s).0).clamp(TAU_S[0], 1.0);
        }
        let each = TAU_S.map(|tau_s| (tau_s, damping(&slides, tau_s)));
        let best = each.iter().fold(each[0], |best, one| if one.1.1 < best.1.1 { *one } else { best });
        let own = damping(&slides, own_s);
        let kept = own.1 <= KEPT * best.1.1;
        self.base.damping_n_s_per_m = if kept { own.0 } else { best.1.0 };
        self.base.apparent_mass_kg = (!kept).then_some(best.0 * best.1.0);
    }

    fn slide(&self, trace: &TraceObservation) -> Option<Slide> {
        let rows = &trace.slid_rows;
        let travel = rows.last()?.2 - rows[0].2;
        if rows.len() < MIN_ROWS || travel <= MIN_M {
            return None;
        }
        let time_s: Vec<f64> = rows.iter().map(|r| r.0).collect();
        // The force of the loop itself: that on a tool of a contact that does not yield.
        let rigid = PullModel { stiffness_n_per_m: 1e9, ..self.base.clone() };
        let loop_n = self.predictor.trace(&rigid, trace.row, &time_s).stuck_n;
        let held_n = trace.slid_n?.0;
        let free_n: Vec<f64> = loop_n.iter().map(|f| (f - held_n).max(0.0)).collect();
        (free_n.len() == time_s.len() && free_n.iter().any(|f| *f > 0.0)).then(|| Slide {
            time_s,
            way_m: rows.iter().map(|r| r.2).collect(),
            free_n,
        })
    }
}

/// Damping with which the slides fit a mass over damping best, and the squares that are left: medians over the slides.
fn damping(slides: &[Slide], tau_s: f64) -> (f64, f64) {
    let (mut dampings, mut squares): (Vec<f64>, Vec<f64>) = slides.iter().map(|s| s.fitted(tau_s)).unzip();
    (median(&mut dampings).clamp(10.0, 2e4), median(&mut squares))
}

impl Slide {
    /// Damping for a mass over damping, and the squares that are left.
    fn fitted(&self, tau_s: f64) -> (f64, f64) {
        let n = self.time_s.len();
        let (mut speed, mut y) = (0.0, vec![0.0; n]);
        for k in 1..n {
            let step_s = self.time_s[k] - self.time_s[k - 1];
            let free_n = 0.5 * (self.free_n[k] + self.free_n[k - 1]);
            // Exact for a force that is constant between rows.
            let left = libm::exp(-step_s / tau_s);
            y[k] = y[k - 1] + free_n * step_s + (speed - free_n) * tau_s * (1.0 - left);
            speed = free_n + (speed - free_n) * left;
        }
        let mean = |x: &[f64]| x.iter().sum::<f64>() / n as f64;
        let (my, mx) = (mean(&y), mean(&self.way_m));
        let (mut yy, mut xy, mut xx) = (0.0, 0.0, 0.0);
        for (y, x) in y.iter().zip(&self.way_m) {
            let (y, x) = (y - my, x - mx);
            (yy, xy, xx) = (yy + y * y, xy + x * y, xx + x * x);
        }
        let square = if yy > 0.0 { xx - xy * xy / yy } else { xx };
        (if xy > 0.0 { yy / xy } else { 2e4 }, square.max(0.0) / n as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    /// A tool of `mass_kg` that leaves jaws at a force that grows by 8 N/s: m x'' + d x' = F, in steps of 0.1 ms, read at
    /// 100 Hz with noise of 5 um.
    fn slide(mass_kg: f64, damping: f64, draws: &mut Draws) -> Slide {
        let (mut x, mut v) = (0.0, 0.0);
        let mut slide = Slide { time_s: vec![], way_m: vec![], free_n: vec![] };
        for step in 0..5000 {
            let t = 1e-4 * f64::from(step);
            if step % 100 == 0 {
                slide.time_s.push(t);
                slide.way_m.push(x + 5e-6 * draws.normal());
                slide.free_n.push(8.0 * t);
            }
            v += 1e-4 * (8.0 * t - damping * v) / mass_kg;
            x += 1e-4 * v;
        }
        slide
    }

    #[test]
    fn damping_and_mass_come_back() {
        let mut draws = Draws::new(1, 0);
        for (mass_kg, d) in [(1.3, 100.0), (10.0, 100.0), (8.0, 400.0)] {
            let slides: Vec<Slide> = (0..9).map(|_| slide(mass_kg, d, &mut draws)).collect();
            let each = TAU_S.map(|tau_s| (tau_s, damping(&slides, tau_s)));
            let best = each.iter().fold(each[0], |b, one| if one.1.1 < b.1.1 { *one } else { b });
            assert!((best.1.0 / d - 1.0).abs() < 0.05, "{mass_kg} kg {d}: {best:?}");
            assert!((best.0 * best.1.0 / mass_kg - 1.0).abs() < 0.25, "{mass_kg} kg {d}: {best:?}");
        }
    }
}
