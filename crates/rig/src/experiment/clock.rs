//! The clock of a campaign.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// This machine's clocks, put together once: stamps never jump, and say what time it was.
#[derive(Debug, Clone, Copy)]
pub(super) struct HostClock {
    origin: Instant,
    unix_s: f64,
}

impl HostClock {
    pub(super) fn start() -> Self {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        Self { origin: Instant::now(), unix_s: unix.as_secs_f64() }
    }

    /// Seconds since 1970 of a moment.
    pub(super) fn unix_s(&self, at: Instant) -> f64 {
        match at.checked_duration_since(self.origin) {
            Some(after) => self.unix_s + after.as_secs_f64(),
            None => self.unix_s - self.origin.duration_since(at).as_secs_f64(),
        }
    }
}
