//! The pull of a held part without an engine: a mass on bristles.
//!
//! ```text
//! m dv/dt = F_applied - F_c,    F_c = sum_i clamp(k_i (x - s_i), -L_i, L_i)
//! ```
//!
//! Each cell i of the contact patches is a bristle: its share k_i of the gel's shear stiffness, which is that of its area,
//! its friction limit L_i, and the place s_i on the part where it stands. A bristle at its limit drags its foot along. Cells with little pressure
//! reach their limit first, so slip begins at the rim of the contact and runs inwards (incipient slip) until the last
//! cell slips and the force has reached `sum L_i` (parallel Jenkin elements: Iwan 1966).
//!
//! On the pressure of a Hertz contact such bristles start and end as Cattaneo's and Mindlin's solution for a half-space
//! does, with whole slip at 1.5 times the mean shear, and hold up to 4.5 % of the limit more in between (6 % on 64 cells; 16 %
//! with three quarters of the stiffness shared by force). A layer much thinner than the contact is wide shears as bristles do.
//!
//! A time step is implicit in the velocity. The force is a non-decreasing, piecewise linear function of it, so Newton's
//! method inside a bracket finds the one solution, for any stiffness, and momentum balances to rounding.

use crate::bristles::Bristles;
use crate::force_loop::Motion;
use crate::jaw_friction::JawFriction;
use crate::world::NotFinite;
use gripgen_twin::{Gel, PerJaw};

/// Newton steps of a time step at most; a staircase takes one or two.
const MAX_ITERATIONS: usize = 100;

/// Part of the forces by which they may fail to balance.
const ROUNDING: f64 = 1e-13;

/// A pull without an engine.
#[derive(Debug, Clone)]
pub(crate) struct ReducedPull {
    mass_kg: f64,
    position_m: f64,
    speed_m_per_s: f64,
    /// Static limits; those of a sliding jaw are multiplied by its kinetic ratio.
    static_limit_n: Vec<f64>,
    bristles: Bristles,
    /// Where the cells of the left jaw end and those of the right one begin.
    boundary: usize,
    friction: PerJaw<JawFriction>,
    /// Time since the jaws began to slide; `None` while they hold.
    slid_s: Option<f64>,
}

impl ReducedPull {
    pub(crate) fn new(mass_kg: f64, gel: &PerJaw<Gel>, friction: &PerJaw<JawFriction>) -> Self {
        let (bristles, boundary) = Bristles::new(gel, friction);
        Self {
            mass_kg,
            position_m: 0.0,
            speed_m_per_s: 0.0,
            static_limit_n: bristles.limit_n.clone(),
            bristles,
            boundary,
            friction: friction.map(|_, f| JawFriction { cells: vec![], ..*f }),
            slid_s: None,
        }
    }

    pub(crate) fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    pub(crate) fn position_m(&self) -> f64 {
        self.position_m
    }

    /// Applies a force to the arm for one time step.
    pub(crate) fn advance(&mut self, applied_n: f64, step_s: f64) -> Result<Motion, NotFinite> {
        let inertia = self.mass_kg / step_s;
        let mut speed = self.speed_m_per_s;
        let (mut force, mut slope) = self.bristles.force(self.position_m + speed * step_s);
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let gained = inertia * (speed - self.speed_m_per_s);
            let residual = gained - applied_n + force;
            if residual.abs() <= ROUNDING * (gained.abs() + applied_n.abs() + force.abs()) {
                break;
            }
            if residual < 0.0 {
                low = speed;
            } else {
                high = speed;
            }
            let newton = speed - residual / (inertia + slope * step_s);
            if newton == speed {
                // The forces balance as far as numbers can tell speeds apart.
                break;
            }
            // Between two kinks Newton may jump to and fro; the bracket then halves.
            speed = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            (force, slope) = self.bristles.force(self.position_m + speed * step_s);
        }
        if !speed.is_finite() {
            return Err(NotFinite { bodies: 1 });
        }
        self.position_m += speed * step_s;
        self.speed_m_per_s = speed;
        if slope != self.bristles.total_n_per_m {
            self.bristles.drag(self.position_m);
        }
        // The jaws slide when no bristle holds any more, and stick again when one does.
        let sliding = slope == 0.0 && speed != 0.0;
        let falls = self.friction.iter().any(|(_, f)| f.kinetic_fall_s > 0.0);
        if sliding != self.slid_s.is_some() || (sliding && falls) {
            self.slid_s = sliding.then(|| self.slid_s.unwrap_or(0.0) + step_s);
            self.set_limits();
        }
        Ok(Motion { contact_force_n: force, displacement_m: self.position_m, speed_m_per_s: speed, sliding })
    }

    /// Static limits, or kinetic ones while the jaws slide.
    fn set_limits(&mut self) {
        if self.friction.iter().all(|(_, f)| f.kinetic_ratio == 1.0) {
            return;
        }
        let share = self.friction.map(|_, f| self.slid_s.map_or(1.0, |s| f.sliding_share(s)));
        let limits = self.bristles.limit_n.iter_mut().zip(&self.static_limit_n).enumerate();
        for (i, (limit, &held)) in limits {
            *limit = held * if i < self.boundary { share.left } else { share.right };
        }
        self.bristles.measure();
    }
}
