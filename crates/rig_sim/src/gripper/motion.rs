//! A motion of the jaws, and where it ends.

use super::line::status;
use gripgen_rig::gcl::{GclLimits, GripState};

/// Jaws of the gripper.
const JAWS: f64 = 2.0;

/// What jaws end on that close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closed {
    /// Opening width there, mm.
    pub width_mm: f64,
    /// Whether a part is between them, not only the other jaw.
    pub part: bool,
}

/// What the jaws meet. The world is asked when a motion begins, because its answer says how long the motion takes.
pub trait Jaws {
    /// The jaws close with this force each, N; what they end on. A move that only looks for an obstacle asks with the least
    /// force, and opens at once.
    fn close(&mut self, force_per_jaw_n: f64) -> Closed;
    /// They open. May come when they are open already.
    fn open(&mut self);
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub kind: Kind,
    pub since_s: f64,
    pub from_mm: f64,
    pub speed_mm_s: f64,
    /// Where it ends, once the world was asked.
    pub end: Option<End>,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Home { to_mm: f64 },
    Move { to_mm: f64 },
    Grip { force_sum_n: f64, part_width_mm: Option<f64> },
    Release { to_mm: f64 },
}

#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub until_s: f64,
    pub at: Stop,
}

/// Where and how a motion stops.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    pub width_mm: f64,
    pub result: Result<(), u32>,
    pub state: GripState,
    pub force_sum_n: f64,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Kind::Home { .. } => "HOME",
            Kind::Move { .. } => "MOVE",
            Kind::Grip { .. } => "GRIP",
            Kind::Release { .. } => "RELEASE",
        }
    }
}

impl Motion {
    /// The force of each jaw with which the world is asked, if the jaws close: a move looks for an obstacle with the least one.
    pub fn closing_force_per_jaw_n(&self, limits: &GclLimits) -> Option<f64> {
        match self.kind {
            Kind::Grip { force_sum_n, .. } => Some(force_sum_n / JAWS),
            Kind::Home { to_mm } | Kind::Move { to_mm } => {
                (to_mm < self.from_mm).then_some(limits.force_sum_n.0 / JAWS)
            }
            Kind::Release { .. } => None,
        }
    }
}

/// Asks the world where a motion ends.
pub(super) fn stop_of(motion: &Motion, limits: &GclLimits, tolerance_mm: f64, jaws: &mut dyn Jaws) -> Stop {
    let free = |width_mm, state| Stop { width_mm, result: Ok(()), state, force_sum_n: 0.0 };
    let failed = |width_mm, status, state| Stop { width_mm, result: Err(status), state, force_sum_n: 0.0 };
    match motion.kind {
        Kind::Release { to_mm } => free(to_mm, GripState::Idle),
        Kind::Home { to_mm } | Kind::Move { to_mm } => {
            let Some(force_n) = motion.closing_force_per_jaw_n(limits) else {
                return free(to_mm, GripState::Idle);
            };
            let met = jaws.close(force_n);
            jaws.open();
            if met.part && met.width_mm > to_mm {
                failed(met.width_mm, status::AXIS_BLOCKED, GripState::Error)
            } else {
                free(to_mm, GripState::Idle)
            }
        }
        Kind::Grip { force_sum_n, part_width_mm } => {
            let met = jaws.close(force_sum_n / JAWS);
            let holds =
                Stop { width_mm: met.width_mm, result: Ok(()), state: GripState::Holding, force_sum_n };
            // Without a width nothing tells a part from the other jaw.
            let Some(part_width_mm) = part_width_mm else { return holds };
            let narrowest_mm = part_width_mm - tolerance_mm;
            let widest_mm = part_width_mm + tolerance_mm;
            if met.part && met.width_mm >= narrowest_mm && met.width_mm <= widest_mm {
                return holds;
            }
            jaws.open();
            if met.part && met.width_mm > widest_mm {
                failed(met.width_mm, status::AXIS_BLOCKED, GripState::Error)
            } else {
                // The jaws give up where the part should have been.
                let stop_mm = narrowest_mm.max(met.width_mm).max(limits.width_mm.0);
                failed(stop_mm, status::COMMAND_FAILED, GripState::NoPart)
            }
        }
    }
}
