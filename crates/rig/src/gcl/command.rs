//! Commands and what the device allows.

use std::fmt::Write;

/// Jaws of the gripper; its own force is the sum over them (WSG 50 manual, grasping force limit).
const JAWS: f64 = 2.0;

/// What may be asked while anything else goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// Opening width, mm.
    Position,
    /// Speed of the jaws relative to each other, mm/s.
    Speed,
    /// Sum of the forces of both jaws, N.
    Force,
    /// What the gripper is doing: [`GripState`].
    GripState,
}

impl Query {
    /// Its name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Query::Position => "POS",
            Query::Speed => "SPEED",
            Query::Force => "FORCE",
            Query::GripState => "GRIPSTATE",
        }
    }
}

/// What the gripper is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GripState {
    /// Nothing.
    Idle,
    /// The jaws close.
    Gripping,
    /// They closed on nothing.
    NoPart,
    /// The part slipped out.
    PartLost,
    /// A part is held.
    Holding,
    /// The jaws open.
    Releasing,
    /// The jaws move to a width.
    Positioning,
    /// Something is wrong.
    Error,
}

impl GripState {
    /// The state with this number, if there is one.
    pub fn from_number(number: f64) -> Option<Self> {
        let all = [
            GripState::Idle,
            GripState::Gripping,
            GripState::NoPart,
            GripState::PartLost,
            GripState::Holding,
            GripState::Releasing,
            GripState::Positioning,
            GripState::Error,
        ];
        (0..all.len()).find(|&i| i as f64 == number).map(|i| all[i])
    }

    /// Whether the jaws move.
    pub fn moves(self) -> bool {
        matches!(self, GripState::Gripping | GripState::Releasing | GripState::Positioning)
    }
}

/// A command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GclCommand {
    /// Find the reference; once after power-up.
    Home,
    /// Grip with a force of each jaw. With the width of the part the gripper tells whether it holds one.
    Grip {
        /// Force of one jaw, N.
        force_per_jaw_n: f64,
        /// Width of the part, mm.
        part_width_mm: Option<f64>,
        /// Speed of the jaws, mm/s; only with a width.
        speed_mm_s: Option<f64>,
    },
    /// Open to a width. Not for gripping.
    Move {
        /// The width, mm.
        width_mm: f64,
    },
    /// Let go, and open by so much.
    Release {
        /// How far the jaws open, mm.
        pull_back_mm: f64,
    },
    /// Leave the state of a fast stop.
    AcknowledgeFastStop,
    /// Stop at once; has to be acknowledged before anything else.
    FastStop,
    /// Say goodbye: a connection that is cut without it is a fast stop.
    Bye,
    /// Ask for a value.
    Ask(Query),
    /// Errors with words.
    Verbose(bool),
    /// How far the width of a part may be off, mm; holds for this connection.
    PartWidthTolerance {
        /// The tolerance, mm.
        tolerance_mm: f64,
    },
}

/// What a device allows, in its own convention: forces are sums over both jaws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GclLimits {
    /// Smallest and largest grip force, sum of both jaws, N.
    pub force_sum_n: (f64, f64),
    /// Smallest and largest width, mm.
    pub width_mm: (f64, f64),
    /// Smallest and largest speed, mm/s.
    pub speed_mm_s: (f64, f64),
}

/// Those of a WSG 50-110 (data sheet): the device may have smaller ones set.
pub const SHIPPED_LIMITS: GclLimits =
    GclLimits { force_sum_n: (5.0, 80.0), width_mm: (0.0, 110.0), speed_mm_s: (5.0, 420.0) };

/// A command beyond what the device allows: nothing was sent.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LimitError {
    /// A force.
    #[error(
        "{force_per_jaw_n} N per jaw are {sum_n} N for the gripper, which allows {min_n} to {max_n} N (sum of both jaws)"
    )]
    Force {
        /// What was asked of each jaw.
        force_per_jaw_n: f64,
        /// The sum.
        sum_n: f64,
        /// Smallest sum.
        min_n: f64,
        /// Largest sum.
        max_n: f64,
    },
    /// A width.
    #[error("a width of {width_mm} mm is outside {min_mm} to {max_mm} mm")]
    Width {
        /// What was asked.
        width_mm: f64,
        /// Smallest.
        min_mm: f64,
        /// Largest.
        max_mm: f64,
    },
    /// A speed.
    #[error("a speed of {speed_mm_s} mm/s is outside {min_mm_s} to {max_mm_s} mm/s")]
    Speed {
        /// What was asked.
        speed_mm_s: f64,
        /// Smallest.
        min_mm_s: f64,
        /// Largest.
        max_mm_s: f64,
    },
}

impl GclCommand {
    /// Its name in answers.
    pub fn name(&self) -> &'static str {
        match self {
            GclCommand::Home => "HOME",
            GclCommand::Move { .. } => "MOVE",
            GclCommand::Grip { .. } => "GRIP",
            GclCommand::Release { .. } => "RELEASE",
            GclCommand::AcknowledgeFastStop => "FSACK",
            GclCommand::FastStop => "FASTSTOP",
            GclCommand::Bye => "BYE",
            GclCommand::Ask(query) => query.name(),
            GclCommand::Verbose(_) => "VERBOSE",
            GclCommand::PartWidthTolerance { .. } => "PWT",
        }
    }

    /// Whether the jaws move, which only one command at a time may do.
    pub fn moves(&self) -> bool {
        matches!(
            self,
            GclCommand::Home | GclCommand::Move { .. } | GclCommand::Grip { .. } | GclCommand::Release { .. }
        )
    }

    /// The line on the wire. Numbers beyond `limits`, and those that are none, are refused.
    ///
    /// # Errors
    ///
    /// A force, a width or a speed beyond `limits`.
    pub fn line(&self, limits: &GclLimits) -> Result<String, LimitError> {
        let width = |width_mm: f64| {
            let (min_mm, max_mm) = limits.width_mm;
            let inside = width_mm >= min_mm && width_mm <= max_mm;
            if inside { Ok(width_mm) } else { Err(LimitError::Width { width_mm, min_mm, max_mm }) }
        };
        let mut line = String::new();
        let _ = match *self {
            GclCommand::Ask(query) => write!(line, "{}?", query.name()),
            GclCommand::Verbose(on) => write!(line, "VERBOSE={}", u8::from(on)),
            GclCommand::PartWidthTolerance { tolerance_mm } => write!(line, "PWT={}", width(tolerance_mm)?),
            GclCommand::Move { width_mm } => write!(line, "MOVE({})", width(width_mm)?),
            GclCommand::Release { pull_back_mm } => write!(line, "RELEASE({})", width(pull_back_mm)?),
            GclCommand::Grip { force_per_jaw_n, part_width_mm, speed_mm_s } => {
                let sum_n = JAWS * force_per_jaw_n;
                let (min_n, max_n) = limits.force_sum_n;
                if !(sum_n >= min_n && sum_n <= max_n) {
                    return Err(LimitError::Force { force_per_jaw_n, sum_n, min_n, max_n });
                }
                let _ = write!(line, "GRIP({sum_n}");
                if let Some(part_width_mm) = part_width_mm {
                    let _ = write!(line, ", {}", width(part_width_mm)?);
                    if let Some(speed_mm_s) = speed_mm_s {
                        let (min_mm_s, max_mm_s) = limits.speed_mm_s;
                        if !(speed_mm_s >= min_mm_s && speed_mm_s <= max_mm_s) {
                            return Err(LimitError::Speed { speed_mm_s, min_mm_s, max_mm_s });
                        }
                        let _ = write!(line, ", {speed_mm_s}");
                    }
                }
                write!(line, ")")
            }
            _ => write!(line, "{}()", self.name()),
        };
        line.push('\n');
        Ok(line)
    }
}
