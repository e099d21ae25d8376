//! Proof that the robot stands.

use super::robot::RobotRow;
use std::time::{Duration, Instant};

/// A tool that is slower than this stands.
const STILL_M_S: f64 = 1e-3;
/// For how long.
const STILL_FOR: Duration = Duration::from_millis(200);

/// Readings of a tool that stands, and that no program moves: one that pulls at a part that holds stands, too.
#[derive(Default)]
pub(super) struct Rest {
    since: Option<(f64, Instant)>,
}

impl Rest {
    /// Takes in the next reading. Whether the tool has stood long enough, by the robot's clock and by this machine's: readings
    /// that waited on their way come all at once, and tell of the past.
    pub(super) fn take(&mut self, row: &RobotRow) -> bool {
        // A speed that is no number is no rest.
        let stands = row.speed_m_s() <= STILL_M_S && !row.program_runs();
        if !stands {
            self.since = None;
            return false;
        }
        let (from_s, from) = *self.since.get_or_insert((row.timestamp_s, row.at));
        let still_for = row.at.saturating_duration_since(from);
        row.timestamp_s - from_s >= STILL_FOR.as_secs_f64() && still_for >= STILL_FOR
    }
}
