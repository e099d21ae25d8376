//! What is counted over the pulls of a campaign: from the last rest, and from the last zeroing of the sensor.

use crate::Covariates;
use crate::draw::Drawn;

/// Pulls since the last rest, a covariate that [`MeasuredPulls::count`](crate::MeasuredPulls::count) adds.
pub const PULLS_SINCE_REST: &str = "pulls_since_rest";
/// Time since the sensor was zeroed, a covariate that [`MeasuredPulls::count`](crate::MeasuredPulls::count) adds.
pub const SINCE_ZERO: &str = "since_zero_s";

/// The column that says whether the sensor was zeroed before a pull (1) or not (0).
pub const ZEROED: &str = "zeroed";

/// A pause as long as this is a rest: polymers forget most of their first cycles in a quarter of an hour.
const REST_S: f64 = 900.0;

/// Counts pulls from the last rest, where the session or the gel changes, or the clock stands still for a quarter of an hour; and time
/// from the last zeroing, where the session changes or [`ZEROED`] is not 0.
#[derive(Debug, Clone, Default)]
pub struct PullCount {
    /// Rests and zeroings so far, without the first pull.
    pub(crate) rests: usize,
    pub(crate) zeroings: usize,
    last: Option<Last>,
}

/// The pull before, the index of the first pull after the last rest, and when the zero was set.
#[derive(Debug, Clone)]
struct Last {
    pull: Covariates,
    first: u64,
    zero_s: f64,
}

impl PullCount {
    /// Takes the next pull: pulls since the last rest, seconds since the last zeroing.
    pub fn next(&mut self, next: &Covariates) -> (u64, f64) {
        let mut now = Last { pull: next.clone(), first: next.pull_index, zero_s: next.time_s };
        if let Some(last) = &self.last {
            let session = last.pull.session != next.session;
            let paused = next.time_s - next.dwell_s - last.pull.time_s > REST_S;
            let rested = session || last.pull.gel_id != next.gel_id || paused;
            let zeroed = session || matches!(next.extra.get(ZEROED), Some(Drawn::Number(x)) if *x != 0.0);
            self.rests += usize::from(rested);
            self.zeroings += usize::from(zeroed);
            if !rested {
                now.first = last.first;
            }
            if !zeroed {
                now.zero_s = last.zero_s;
            }
        }
        let counted = (next.pull_index.saturating_sub(now.first), next.time_s - now.zero_s);
        self.last = Some(now);
        counted
    }

    /// Takes the next pull and writes both into it.
    pub fn mark(&mut self, next: &mut Covariates) {
        let (pulls, seconds) = self.next(next);
        next.extra.insert(PULLS_SINCE_REST.into(), Drawn::Number(pulls as f64));
        next.extra.insert(SINCE_ZERO.into(), Drawn::Number(seconds));
    }
}
