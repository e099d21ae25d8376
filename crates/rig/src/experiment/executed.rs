//! What came of a pull: its trace, its label and all that was heard during it.

use super::event::{ExecutedPull, FrameStamp, LogLine, PullOutcome, Stopped};
use super::film::FilmedFrame;
use super::robot::thinned;
use super::run::Experiment;
use super::zero::{self, Unloaded};
use crate::program::{Phase, StopReason};
use gripgen_twin::{Campaign, PerJaw, PlannedPull, PullTrace, TactileImage, TraceRow, slip_label};
use std::time::Instant;

/// What is known of a pull under way.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) rest: Option<PerJaw<TactileImage>>,
    pub(super) images: Option<PerJaw<TactileImage>>,
    pub(super) frames: Vec<FrameStamp>,
    pub(super) film: Vec<PerJaw<FilmedFrame>>,
    /// Robot's clock: from and to when nothing loaded the sensor.
    pub(super) no_load_s: Option<(f64, f64)>,
    /// The same after the pull.
    pub(super) no_load_after_s: Option<(f64, f64)>,
    /// Of a jaw.
    pub(super) reported_force_n: Option<f64>,
    pub(super) held_s: Option<f64>,
    pub(super) run: Option<i32>,
    pub(super) preload_n: f64,
    pub(super) doubts: Vec<String>,
    pub(super) outcome: Option<PullOutcome>,
}

impl Experiment<'_> {
    /// The label of a pull that ended by itself.
    pub(super) fn label(
        &self,
        campaign: &Campaign,
        planned: &PlannedPull,
        parts: &Parts,
        reason: StopReason,
    ) -> Option<PullOutcome> {
        let slid = reason == StopReason::Displacement;
        if !slid && !matches!(reason, StopReason::LargestCommand | StopReason::Time) {
            let reason = format!("the pull was broken off: {}", reason.meaning());
            return Some(PullOutcome::Failed { reason });
        }
        let trace = self.trace(planned, parts)?;
        let pulled: PullTrace = trace.rows().filter(|row| row.time_s >= 0.0).collect();
        Some(
            match slip_label(&pulled.until_displacement(campaign.stop_m), campaign.label_tolerance_n, slid) {
                Ok(label) => PullOutcome::Labelled(label),
                Err(e) => PullOutcome::Failed { reason: e.to_string() },
            },
        )
    }

    /// The force over time: readings without a load before 0, then the staircase.
    fn trace(&self, planned: &PlannedPull, parts: &Parts) -> Option<PullTrace> {
        let run = parts.run?;
        let first = self.rows.iter().find(|r| r.phase_of(run) == Some(Phase::Pulling))?;
        let (start_s, unloaded) = (first.timestamp_s, parts.no_load_s.unwrap_or((0.0, 0.0)));
        let rows = self.rows.iter().filter_map(|row| {
            let pulling = row.phase_of(run) == Some(Phase::Pulling);
            let without = row.timestamp_s >= unloaded.0 && row.timestamp_s < unloaded.1;
            (pulling || without).then(|| TraceRow {
                time_s: ((row.timestamp_s - start_s) * 1e6).round() * 1e-6,
                desired_force_n: if pulling { row.desired_n } else { 0.0 },
                measured_force_n: self.signed(planned, row.force[2]),
                displacement_m: if pulling { row.displacement_m } else { 0.0 },
            })
        });
        Some(rows.collect())
    }

    /// Everything that is known of a pull, once it has ended.
    pub(super) fn measured(
        &mut self,
        planned: &PlannedPull,
        mut parts: Parts,
        stopped: Option<Stopped>,
    ) -> ExecutedPull {
        // Of a pull that was broken off it is still under way.
        parts.film.extend(self.end_film());
        let trace = self.trace(planned, &parts);
        let start = parts
            .run
            .and_then(|run| self.rows.iter().find(|row| row.phase_of(run) == Some(Phase::Pulling)).copied());
        let anchor = start.or(self.rows.last().copied());
        let robot_time_s = anchor.map_or(0.0, |row| row.timestamp_s);
        let unix_s = self.clock.unix_s(anchor.map_or_else(Instant::now, |row| row.at));
        let outcome = match (&stopped, parts.outcome) {
            // What went wrong after the pull takes nothing from a label that was complete.
            (Some(_), Some(labelled @ PullOutcome::Labelled(_))) => labelled,
            (Some(stopped), _) => PullOutcome::Failed { reason: stopped.reason.clone() },
            (None, Some(outcome)) => outcome,
            (None, None) => PullOutcome::Failed { reason: "the robot said nothing during the pull".into() },
        };
        if let Some(gripper) = &self.devices.gripper {
            let lines = gripper.take_log();
            self.log.extend(lines.into_iter().map(|line| {
                let text = format!("{} {}", if line.sent { ">" } else { "<" }, line.line);
                LogLine { at: line.at, source: "gripper", text }
            }));
        }
        let mut log = std::mem::take(&mut self.log);
        log.sort_by_key(|line| line.at);
        let unloaded = |within: Option<(f64, f64)>| {
            let (from_s, to_s) = within.unwrap_or((0.0, 0.0));
            self.rows
                .iter()
                .filter(move |row| row.timestamp_s >= from_s && row.timestamp_s < to_s)
                .map(|row| (row.timestamp_s, self.signed(planned, row.force[2])))
        };
        let zero_shift_n = match &outcome {
            PullOutcome::Labelled(label) => zero::shift_n(
                &Unloaded::of(unloaded(parts.no_load_s)),
                &Unloaded::of(unloaded(parts.no_load_after_s)),
                robot_time_s + label.slip_time_s,
            ),
            _ => None,
        };
        let no_load_after_n = unloaded(parts.no_load_after_s).map(|(_, force_n)| force_n).collect();
        let without = [parts.no_load_s, parts.no_load_after_s];
        let rows = thinned(std::mem::take(&mut self.rows), parts.run, without);
        ExecutedPull {
            planned: planned.clone(),
            outcome,
            stopped,
            trace,
            images: parts.images,
            rest: parts.rest,
            frames: parts.frames,
            film: parts.film,
            dwell_s: parts.held_s.zip(start).map_or(0.0, |(held_s, row)| row.timestamp_s - held_s),
            robot_time_s,
            unix_s,
            preload_n: parts.preload_n,
            no_load_after_n,
            zero_shift_n,
            reported_force_n: parts.reported_force_n,
            doubts: parts.doubts,
            rows_unix_s: rows.iter().map(|row| self.clock.unix_s(row.at)).collect(),
            rows,
            log: log.into_iter().map(|line| (self.clock.unix_s(line.at), line)).collect(),
        }
    }
}
