//! What each cell of the contact does while the part is pulled: how far it is sheared, whether it still holds.
//!
//! The bristles of the reduced mechanics, followed along the states of a pull of either mechanics. Nothing acts back: a pull
//! that nobody watches costs nothing.

use crate::bristles::Bristles;
use crate::jaw_friction::JawFriction;
use crate::session::PullState;
use gripgen_twin::config::Mechanics;
use gripgen_twin::{CellShear, Gel, Jaw, PerJaw};

/// Newton steps to the place of the tool at most; a staircase takes one or two.
const MAX_ITERATIONS: usize = 50;

/// Share of the limit from which on contacts of the engine count as slipping as a whole.
const WHOLE: f64 = 1.0 - 1e-9;

/// The cells of both contact patches along a pull.
#[derive(Debug, Clone)]
pub struct PullCells {
    mechanics: Mechanics,
    bristles: Bristles,
    static_limit_n: Vec<f64>,
    /// Where the cells of each jaw begin, and how many there are.
    range: PerJaw<(usize, usize)>,
    friction: PerJaw<JawFriction>,
    position_m: f64,
    last: Option<PullState>,
    slid_s: Option<f64>,
    /// A foot that has moved stays moved, wherever it goes.
    slipped: Vec<bool>,
}

impl PullCells {
    /// The cells of a grip, before its pull.
    pub fn new(mechanics: Mechanics, gel: &PerJaw<Gel>, friction: &PerJaw<JawFriction>) -> Self {
        let (bristles, boundary) = Bristles::new(gel, friction);
        let first = |jaw| if jaw == Jaw::Left { 0 } else { boundary };
        Self {
            mechanics,
            static_limit_n: bristles.limit_n.clone(),
            slipped: vec![false; bristles.limit_n.len()],
            bristles,
            range: friction.map(|jaw, f| (first(jaw), f.cells.len())),
            friction: friction.map(|_, f| JawFriction { cells: vec![], ..*f }),
            position_m: 0.0,
            last: None,
            slid_s: None,
        }
    }

    /// Follows the pull to its next state.
    ///
    /// In the reduced mechanics the place of the tool is the place of the bristles. In the engine the contact is rigid until it
    /// slips, so theirs is the one at which they carry its force.
    pub fn follow(&mut self, state: &PullState) {
        let before = self.last.unwrap_or(PullState { time_s: 0.0, displacement_m: 0.0, ..*state });
        self.position_m = match self.mechanics {
            Mechanics::Reduced => state.displacement_m,
            Mechanics::Rapier => {
                let limit_n: f64 = self.bristles.limit_n.iter().sum();
                if state.sliding || state.contact_force_n.abs() >= WHOLE * limit_n {
                    let way_m = (state.displacement_m - before.displacement_m).max(0.0);
                    (self.position_m + way_m).max(self.all_slip_at_m())
                } else {
                    self.place_of(state.contact_force_n)
                }
            }
        };
        let feet = self.bristles.foot_m.clone();
        self.bristles.drag(self.position_m);
        for (slipped, (now, before)) in self.slipped.iter_mut().zip(self.bristles.foot_m.iter().zip(&feet)) {
            *slipped |= now != before;
        }
        // As the reduced mechanics do: limits that fall act from the next step on.
        let falls = self.friction.iter().any(|(_, f)| f.kinetic_fall_s > 0.0);
        if state.sliding != self.slid_s.is_some() || (state.sliding && falls) {
            let step_s = state.time_s - before.time_s;
            self.slid_s = state.sliding.then(|| self.slid_s.unwrap_or(0.0) + step_s);
            self.set_limits();
        }
        self.last = Some(*state);
    }

    /// The cells of each jaw, in the order of its patch.
    pub fn cells(&self) -> PerJaw<Vec<CellShear>> {
        self.range.map(|_, &(first, count)| {
            let cell = |i: usize| {
                let (reach_m, foot_m) = (self.bristles.reach_m[i], self.bristles.foot_m[i]);
                let shear_m = (self.position_m - foot_m).clamp(-reach_m, reach_m);
                let force_n = self.bristles.stiffness_n_per_m[i] * shear_m;
                CellShear { shear_m, slip_m: foot_m, force_n, slipped: self.slipped[i] }
            };
            (first..first + count).map(cell).collect()
        })
    }

    /// How many cells have left their places, and how many there are.
    pub fn slipped(&self) -> (usize, usize) {
        let of = |&(first, count): &(usize, usize)| {
            self.slipped[first..first + count].iter().filter(|&&slipped| slipped).count()
        };
        (of(&self.range.left) + of(&self.range.right), self.range.left.1 + self.range.right.1)
    }

    /// The first place along the pull at which every cell has moved.
    fn all_slip_at_m(&self) -> f64 {
        let ends = self.bristles.foot_m.iter().zip(&self.bristles.reach_m).map(|(foot, reach)| foot + reach);
        // Beyond the last one by what moves its foot.
        ends.fold(0.0, f64::max) * (1.0 + 1e-9) + 1e-12
    }

    /// Where the bristles carry a force, from where they are.
    fn place_of(&self, force_n: f64) -> f64 {
        let mut at_m = self.position_m;
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let (carried_n, slope) = self.bristles.force(at_m);
            let missing_n = force_n - carried_n;
            if missing_n.abs() <= 1e-12 * (force_n.abs() + carried_n.abs()) {
                break;
            }
            if missing_n > 0.0 {
                low = at_m;
            } else {
                high = at_m;
            }
            let newton = at_m + missing_n / if slope > 0.0 { slope } else { self.bristles.total_n_per_m };
            at_m = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if !at_m.is_finite() {
                return self.position_m;
            }
        }
        at_m
    }

    fn set_limits(&mut self) {
        let share = self.friction.map(|_, f| self.slid_s.map_or(1.0, |s| f.sliding_share(s)));
        let boundary = self.range.right.0;
        let limits = self.bristles.limit_n.iter_mut().zip(&self.static_limit_n).enumerate();
        for (i, (limit, &held)) in limits {
            *limit = held * if i < boundary { share.left } else { share.right };
        }
        self.bristles.measure();
    }
}
