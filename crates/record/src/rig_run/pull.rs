//! A measured pull, and the messages that it is stored as.

use super::film::RigFilm;
use crate::encode::{
    EncodedRig, EncodedSample, VIEW_RATE_HZ, image_message, scenario_message, set_forces, set_label,
    set_suspect, state_messages, timestamp, trace_message,
};
use crate::index::index_row;
use crate::proto::gripgen_v1::{PullTrace as PullTraceMessage, Status};
use crate::rig_log::RigLog;
use gripgen_twin::config::ImageStorage;
use gripgen_twin::label::forces::PullForces;
use gripgen_twin::{PerJaw, PullTrace, Scenario, SlipLabel, TactileImage};
use prost::Message;

/// How a measured pull ended.
#[derive(Debug, Clone, PartialEq)]
pub enum RigResult {
    /// The jaws slid: the label is exact.
    Slipped {
        /// The label; it is not censored.
        label: SlipLabel,
    },
    /// The pull ended before they slid: the label is a lower bound.
    Censored {
        /// The label.
        label: SlipLabel,
    },
    /// There is a label, and evidence that contradicts it.
    Suspect {
        /// The label.
        label: SlipLabel,
        /// What contradicts it, with the numbers.
        reason: String,
    },
    /// The jaws closed without touching the part: the label is 0.
    NoContact,
    /// Something went wrong; there is no label.
    Failed {
        /// Why, with the numbers.
        reason: String,
    },
}

/// One measured pull, or one that failed.
#[derive(Debug, Clone, PartialEq)]
pub struct RigPull {
    /// What was asked: `index` is the place in the campaign, `seed` is 0. `drawn` holds what was measured beside the
    /// known covariates.
    pub scenario: Scenario,
    /// How it ended.
    pub result: RigResult,
    /// Images while the part was gripped, before the pull.
    pub images: Option<PerJaw<TactileImage>>,
    /// Images before the grip, the jaws open.
    pub rest: Option<PerJaw<TactileImage>>,
    /// The force over time; rows before time 0 are the reading without a load and the preload.
    pub trace: Option<PullTrace>,
    /// The film of both cameras, where the rig films.
    pub film: Option<RigFilm>,
    /// Everything that was received.
    pub log: RigLog,
}

impl RigPull {
    /// The messages of its shard, or what is wrong with it.
    pub(super) fn encode(&self, extra_columns: &[String]) -> Result<EncodedSample, String> {
        self.check()?;
        let start = Some(timestamp(0));
        let mut message = scenario_message(&self.scenario, start);
        match &self.result {
            RigResult::Slipped { label } => set_label(&mut message, &SlipLabel { censored: false, ..*label }),
            RigResult::Censored { label } => set_label(&mut message, &SlipLabel { censored: true, ..*label }),
            RigResult::Suspect { label, reason } => {
                set_label(&mut message, label);
                set_suspect(&mut message, Some(reason));
            }
            RigResult::NoContact => {
                message.set_status(Status::NoContact);
                message.max_pull_force_n = Some(0.0);
            }
            RigResult::Failed { reason } => {
                message.set_status(Status::Failed);
                message.failure.clone_from(reason);
            }
        }
        if let (Some(trace), Some(_)) = (&self.trace, message.slip_time_s) {
            set_forces(&mut message, &PullForces::of(trace));
        }
        let coded = |both: &Option<PerJaw<TactileImage>>| {
            let png = |both: &PerJaw<TactileImage>| {
                PerJaw::try_from_fn(|jaw| image_message(&both[jaw], jaw, ImageStorage::Png, start))
            };
            both.as_ref().map(png).transpose().map_err(|e| e.to_string())
        };
        let trace = self.trace.as_ref();
        let (streams, events) = self.log.encode(start);
        Ok(EncodedSample {
            start_ns: 0,
            sample: message.encode_to_vec(),
            images: coded(&self.images)?,
            // The times are measurements too: none of them is rounded to a rate.
            trace: trace.map(|t| {
                let columns = trace_message(t, start);
                PullTraceMessage { rate_hz: 0.0, time_s: t.time_s.clone(), ..columns }.encode_to_vec()
            }),
            states: trace.map(|t| state_messages(t, 0, Some(VIEW_RATE_HZ))).unwrap_or_default(),
            film: self.film.as_ref().map(|film| film.encode(trace)).unwrap_or_default(),
            rig: Some(EncodedRig { rest: coded(&self.rest)?, streams, events }),
            row: index_row(&message, extra_columns),
            status: message.status(),
        })
    }

    /// Longer than the pull, in whole seconds.
    pub(super) fn slot_ns(&self) -> u64 {
        let ends = self.trace.as_ref().and_then(|t| t.time_s.first().zip(t.time_s.last()));
        let length_s = ends.map_or(0.0, |(first, last)| last - first.min(0.0));
        (length_s.max(0.0).ceil() as u64 + 1).saturating_mul(1_000_000_000)
    }

    fn check(&self) -> Result<(), String> {
        if let RigResult::Slipped { label }
        | RigResult::Censored { label }
        | RigResult::Suspect { label, .. } = &self.result
        {
            let SlipLabel { max_pull_force_n, slip_time_s, .. } = *label;
            if !(max_pull_force_n.is_finite() && slip_time_s.is_finite()) {
                return Err(format!(
                    "its label is {max_pull_force_n} N at {slip_time_s} s, both must be numbers"
                ));
            }
        }
        for (what, images) in [("while gripped", &self.images), ("at rest", &self.rest)] {
            for (jaw, image) in images.iter().flat_map(PerJaw::iter) {
                let TactileImage { width_px, height_px, ref rgb } = *image;
                let wanted = u64::from(width_px) * u64::from(height_px) * 3;
                if rgb.len() as u64 != wanted {
                    return Err(format!(
                        "the image {what} of the {jaw} jaw is {width_px}x{height_px} pixels and has {} bytes",
                        rgb.len()
                    ));
                }
            }
        }
        for (frame, both) in self.film.iter().flat_map(|film| film.frames.iter().enumerate()) {
            if let Some((_, bad)) = both.iter().find(|(_, one)| !one.received_s.is_finite()) {
                return Err(format!("frame {frame} of its film came at {} s", bad.received_s));
            }
        }
        self.trace.as_ref().map_or(Ok(()), check_trace)?;
        self.log.check()
    }
}

fn check_trace(t: &PullTrace) -> Result<(), String> {
    let columns = [&t.time_s, &t.desired_force_n, &t.measured_force_n, &t.displacement_m];
    let rows = columns.map(Vec::len);
    if rows.iter().any(|&n| n != rows[0]) {
        return Err(format!(
            "its trace has columns of {rows:?} rows (time, desired force, measured force, displacement)"
        ));
    }
    let mut before_s = f64::NEG_INFINITY;
    for (row, &time_s) in t.time_s.iter().enumerate() {
        if !(time_s.is_finite() && time_s > before_s) {
            return Err(format!("row {row} of its trace is at {time_s} s, the row before at {before_s} s"));
        }
        before_s = time_s;
    }
    Ok(())
}
