//! Where a pull stands in its campaign: how many came before it, and what time it is.

use super::record::{START, Standing};
use crate::failure::Failure;
use gripgen::record::{RunFolder, ShardReader, missing_pulls};
use gripgen_rig::experiment::pull::ExecutedPull;

/// The clock of a campaign: the robot's while it runs on, this machine's over its restarts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CampaignClock {
    /// Time of the campaign, robot's clock, and seconds since 1970 of the pull before.
    last: Option<(f64, f64, f64)>,
    made: u64,
}

impl CampaignClock {
    /// The clock of a campaign that may have begun before.
    pub fn of(folder: &RunFolder) -> Result<Self, Failure> {
        let missing = missing_pulls(folder)?;
        let mut clock = Self::default();
        for pull in (0..folder.info().shards).filter(|pull| missing.binary_search(pull).is_err()) {
            let reader = ShardReader::open(&folder.shard_path(pull))?;
            let (sample, _) = reader.pull(pull)?;
            clock.made = clock.made.max(sample.pull_index + 1);
            let log = reader.rig_log(pull)?;
            let start = log.events.iter().find(|event| event.source == START);
            let Some((event, robot_s)) = start.and_then(|event| Some((event, event.device_time_s?))) else {
                continue;
            };
            if clock.last.is_none_or(|(_, _, unix_s)| event.host_time_s > unix_s) {
                clock.last = Some((sample.time_s, robot_s, event.host_time_s));
            }
        }
        Ok(clock)
    }

    /// Whether nothing was measured yet.
    pub fn is_new(&self) -> bool {
        self.last.is_none()
    }

    /// Where this pull stands.
    pub fn standing(&mut self, index: u64, measured: &ExecutedPull) -> Standing {
        let (robot_s, unix_s) = (measured.robot_time_s, measured.unix_s);
        let time_s = match self.last {
            None => 0.0,
            Some((time_s, last_robot_s, _)) if robot_s >= last_robot_s => time_s + robot_s - last_robot_s,
            // The controller was restarted in between.
            Some((time_s, _, last_unix_s)) => time_s + (unix_s - last_unix_s).max(0.0),
        };
        let made = self.made;
        self.last = Some((time_s, robot_s, unix_s));
        // A pull that was stopped before it began wears nothing.
        self.made += u64::from(measured.trace.is_some());
        Standing { index, made, time_s }
    }
}
