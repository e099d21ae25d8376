//! A rehearsal: what the rig is like today, found by the rig itself before labels depend on it.
//!
//! In air the sensor is zeroed and read for a while, and the tool is let go against nothing. Then a part is gripped and pulled with
//! a few newtons in slow steps that hold. What comes out is compared by `check` and used by `pull`: a staircase is slowed down until
//! force mode and sensor can follow.

use super::check::CheckLine;
use super::config::RigConfig;
use super::devices::Devices;
use super::event::{RigEvent, Stopped};
use super::fault::Fault;
use super::plan::{grip_command, grip_poses, pull_program};
use super::prepare::{Permit, PrepareError};
use super::pull::MIRRORED_GAIN;
use super::response::{Response, StepRow, response};
use super::robot::RobotRow;
use super::run::{Experiment, SLACK};
use crate::gcl::{GripState, Query};
use crate::program::{Phase, StopReason};
use gripgen_twin::{Campaign, Jaw, PerJaw, PlannedPull};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

/// Largest command of the rehearsed pull, and its steps.
pub const REHEARSED_N: f64 = 5.0;
const STEP_N: f64 = 1.0;
const STEP_S: f64 = 1.0;
/// Rest after the grip.
const SETTLE_S: f64 = 0.5;
/// Readings with a stamp of their own that a clock is compared by.
const FRAMES: usize = 8;

/// The sensor without a load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorAtRest {
    /// Standard deviation of a reading along x, y and z, its drift taken out.
    pub noise_n: [f64; 3],
    /// Mean of the first quarter of the readings after the zero, along z: how well it was zeroed.
    pub zero_error_n: f64,
    /// How far the reading along z has gone from there at the end.
    pub drift_n: f64,
    /// Over so long.
    pub dwell_s: f64,
    /// The raw reading along z: what was zeroed away.
    pub raw_z_n: f64,
}

/// A clock beside this machine's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClockFound {
    /// Seconds of the device for a second here.
    pub rate: f64,
    /// Largest lateness of a reading beside the earliest.
    pub late_s: f64,
    /// Over so long, by this machine's clock.
    pub over_s: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rehearsal {
    /// Part that was pulled.
    pub part: String,
    /// Grip force of a jaw.
    pub grip_force_n: f64,
    /// The same as the gripper reported it.
    pub reported_force_n: f64,
    /// Zeroed, jaws open.
    pub rest: SensorAtRest,
    /// Fastest speed in air, where the program allows `pull_speed_mm_s`.
    pub air_speed_mm_s: f64,
    /// How far the tool went beyond the stop in air.
    pub air_overshoot_mm: f64,
    /// Force along the pull after the jaws have closed.
    pub preload_n: f64,
    /// Force across it.
    pub lateral_n: f64,
    /// The pull that holds.
    pub response: Option<Response>,
    /// The robot's clock.
    pub robot_clock: Option<ClockFound>,
    /// The cameras' clocks; none where they send no stamps.
    pub camera_clock: PerJaw<Option<ClockFound>>,
}

/// Name and version of the file.
pub const SCHEMA: &str = "gripgen.rigrehearsal/1";

/// The file of a rehearsal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredRehearsal {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of gripgen that rehearsed.
    pub gripgen_version: String,
    /// When, in seconds since 1970.
    pub unix_s: f64,
    /// What was found without moving, by what was looked at.
    pub checks: Vec<(String, String)>,
    /// What the rehearsal found.
    pub rehearsal: Rehearsal,
    /// What is not as a pull needs it.
    pub doubts: Vec<String>,
}

/// Lines of a check that stay the same while a rig stays the same.
const CONSTANT: [&str; 5] = ["dashboard", "controller", "primary interface", "tool offset", "payload"];

impl StoredRehearsal {
    /// The file of what was just found. `checks` is what [`check`](super::check::check) found before it.
    pub fn new(
        gripgen_version: &str,
        config: &RigConfig,
        checks: Vec<CheckLine>,
        rehearsal: Rehearsal,
    ) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        Self {
            schema: SCHEMA.into(),
            gripgen_version: gripgen_version.into(),
            unix_s: since.map_or(0.0, |since| since.as_secs_f64()),
            checks: checks.into_iter().map(|line| (line.what.to_string(), line.found)).collect(),
            doubts: rehearsal.doubts(config),
            rehearsal,
        }
    }

    /// Whether the rig of these lines is the one that rehearsed.
    pub fn compare(&self, lines: &[CheckLine]) -> CheckLine {
        let mut changed = Vec::new();
        for (what, then) in self.checks.iter().filter(|(what, _)| CONSTANT.contains(&what.as_str())) {
            let now = lines.iter().find(|line| line.what == what).map_or("nothing", |line| &line.found);
            if now != then {
                changed.push(format!("{what}: {now}, it was {then}"));
            }
        }
        let found = match changed.is_empty() {
            true => "the rig is the one that rehearsed".to_string(),
            false => format!("rehearse again, the rig has changed: {}", changed.join("; ")),
        };
        CheckLine { what: "rehearsal", ok: changed.is_empty(), found }
    }
}

/// What is rehearsed.
#[derive(Debug, Clone, PartialEq)]
pub struct RehearsalPlan {
    /// The part that is pulled.
    pub part: String,
    /// Grip force of a jaw. It has to hold [`REHEARSED_N`].
    pub grip_force_n: f64,
    /// How long the zeroed sensor is read.
    pub dwell_s: f64,
}

/// Why nothing is known after a rehearsal.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RehearseError {
    /// The robot is not ready.
    #[error("{0}")]
    Prepare(#[from] PrepareError),
    /// Everything was stopped.
    #[error("{0}")]
    Stopped(Stopped),
}

/// Rehearses on devices that are connected, and lets them go. Whatever goes wrong ends in a safe stop.
///
/// # Errors
///
/// A robot that is not ready, or what ends a pull.
pub fn rehearse(
    config: &RigConfig,
    mut devices: Devices,
    plan: &RehearsalPlan,
    stop: &AtomicBool,
    emit: &mut dyn FnMut(RigEvent),
) -> Result<Rehearsal, RehearseError> {
    if let Err(e) = devices.prepare(Permit::default()) {
        devices.close();
        return Err(e.into());
    }
    let mut experiment = Experiment::new(config, devices, stop, emit);
    let found = experiment.begin().and_then(|()| experiment.rehearse(plan));
    match found {
        Ok(rehearsal) => {
            experiment.close();
            Ok(rehearsal)
        }
        Err(fault) => Err(RehearseError::Stopped(experiment.safe_stop(&fault))),
    }
}

impl Rehearsal {
    /// How far a reading trails an evenly rising command, s; `None` if it was not found.
    pub fn trails_s(&self) -> Option<f64> {
        self.response.map(|response| response.force.trails_s())
    }

    /// What is not as a pull needs it, in words.
    pub fn doubts(&self, config: &RigConfig) -> Vec<String> {
        let mut doubts = Vec::new();
        let mut doubt = |is: bool, words: String| {
            if is {
                doubts.push(words);
            }
        };
        let noise_n = self.rest.noise_n[2];
        doubt(noise_n > 0.5, format!("a reading has {noise_n:.2} N of noise, 0.5 N are allowed"));
        let zero_n = self.rest.zero_error_n.abs();
        doubt(zero_n > 0.3, format!("zeroed, the sensor reads {zero_n:.2} N, 0.3 N are allowed"));
        let drift_n = self.rest.drift_n.abs();
        let dwell_s = self.rest.dwell_s;
        doubt(
            drift_n > 0.3,
            format!(
                "the zero went by {drift_n:.2} N in {dwell_s:.0} s, 0.3 N are allowed: warm up, shorter dwells"
            ),
        );
        let wanted = config.limits.pull_speed_mm_s;
        let air = self.air_speed_mm_s;
        doubt(
            air > 1.05 * wanted,
            format!("in air the tool became {air:.1} mm/s fast, {wanted} mm/s are allowed"),
        );
        let over = self.air_overshoot_mm;
        doubt(over > 1.0, format!("the tool went {over:.2} mm beyond its stop, 1 mm is allowed"));
        let (preload_n, lateral_n) = (self.preload_n.abs(), self.lateral_n);
        doubt(
            preload_n > 2.0,
            format!("the jaws press {preload_n:.1} N along the pull, 2 N are allowed: pose or fixture"),
        );
        doubt(
            lateral_n > 4.0,
            format!("the jaws press {lateral_n:.1} N across the pull, 4 N are allowed: pose or fixture"),
        );
        match self.response {
            None => doubts.push("the pull that should hold has too few readings".into()),
            Some(r) => {
                if r.force.gain < MIRRORED_GAIN {
                    let sign = config.robot.force_sign;
                    doubts.push(format!(
                        "the force reads the wrong way: a newton of command reads {:.2} N with `robot.force_sign` = {sign:?}, {:?} fits",
                        r.force.gain, -sign
                    ));
                } else if (r.force.gain - 1.0).abs() > 0.1 {
                    doubts.push(format!(
                        "a newton of command reads {:.2} N, 0.9 to 1.1 N are allowed",
                        r.force.gain
                    ));
                }
                if r.overshoot_n > 1.0 {
                    doubts.push(format!("force mode goes {:.2} N beyond a step of 1 N", r.overshoot_n));
                }
            }
        }
        doubts
    }
}

impl Experiment<'_> {
    /// Rehearses on a part. Whatever goes wrong has to be followed by a safe stop.
    fn rehearse(&mut self, plan: &RehearsalPlan) -> Result<Rehearsal, Fault> {
        let RehearsalPlan { part, grip_force_n, dwell_s } = plan.clone();
        let planned = PlannedPull {
            part: part.clone(),
            grip_force_n,
            force_increment_n: STEP_N,
            force_start_n: None,
            step_time_s: STEP_S,
            ..PlannedPull::default()
        };
        let campaign =
            Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: vec![planned.clone()] };
        let unready = |problem: String| Fault::Rehearsal { problem };
        let poses = grip_poses(self.config, &planned)
            .ok_or_else(|| unready(format!("nobody taught where `{part}` is")))?;
        self.approach(&poses)?;
        // In air.
        self.rows.clear();
        let mut stamps = self.look_at_gels("rest", &[])?.stamps;
        let run = self.zeroed(&campaign, &planned, dwell_s)?;
        let (from_s, raw_z_n) = (self.robot_time_s()?, self.newest().map_or(0.0, |row| row.raw_force[2]));
        self.tell(RigEvent::Step("reading the sensor without a load"));
        self.wait_until("the reading without a load", from_s + dwell_s)?;
        let unloaded: Vec<RobotRow> =
            self.rows.iter().filter(|row| row.timestamp_s >= from_s).copied().collect();
        let rest = at_rest(&unloaded, raw_z_n);
        self.tell(RigEvent::Step("pulling air"));
        let reason = self.staircase(run, &planned, 20.0)?;
        if reason != StopReason::Displacement {
            return Err(unready(format!("in air the pull ended otherwise: {}", reason.meaning())));
        }
        let pulled = self.pulled(run);
        let fastest = pulled.iter().map(RobotRow::speed_m_s).fold(0.0, f64::max);
        let farthest_m = self.newest().map_or(0.0, |row| row.displacement_m.abs());
        self.move_to("the way back", poses.approach, self.config.motion.approach_speed_mm_s)?;
        // On a part.
        self.move_to("the way down", poses.grip, self.config.motion.approach_speed_mm_s)?;
        let run = self.zeroed(&campaign, &planned, dwell_s)?;
        self.tell(RigEvent::Step("gripping"));
        self.gripper(&grip_command(grip_force_n))?;
        let state = self.ask_gripper(Query::GripState)?;
        if GripState::from_number(state) != Some(GripState::Holding) {
            return Err(Fault::NotHolding { state });
        }
        let reported_force_n = 0.5 * self.ask_gripper(Query::Force)?;
        let held_s = self.robot_time_s()?;
        self.wait_until("settling", held_s + SETTLE_S)?;
        stamps.extend(self.look_at_gels("grip", &stamps)?.stamps);
        let pressed: Vec<RobotRow> =
            self.rows.iter().filter(|row| row.timestamp_s >= held_s + 0.5 * SETTLE_S).copied().collect();
        let mean = |axis: usize| mean(pressed.iter().map(|row| row.force[axis]));
        let lateral_n = mean(0).hypot(mean(1)) * self.config.robot.force_gain;
        let reason = self.staircase(run, &planned, 20.0)?;
        if reason != StopReason::LargestCommand {
            return Err(unready(format!(
                "the part should hold {REHEARSED_N} N, but: {}; more grip force, or another part",
                reason.meaning()
            )));
        }
        let preload_n = self.preload_n(&planned);
        let rows: Vec<StepRow> = self
            .pulled(run)
            .iter()
            .map(|row| StepRow {
                time_s: row.timestamp_s,
                desired_n: row.desired_n,
                measured_n: self.signed(&planned, row.force[2]) - preload_n,
                displacement_m: row.displacement_m,
            })
            .collect();
        self.release()?;
        self.go_up(&poses)?;
        for _ in 0..FRAMES {
            stamps.extend(self.look_at_gels("clock", &[])?.stamps);
        }
        let origin = stamps.first().map(|stamp| stamp.at);
        let clock = |jaw: Jaw| {
            let of_jaw = stamps.iter().filter(|stamp| stamp.jaw == jaw);
            let pairs =
                of_jaw.filter_map(|s| Some((s.device_time_s?, s.at.duration_since(origin?).as_secs_f64())));
            clock_of(&pairs.collect::<Vec<_>>())
        };
        let robot = self.rows.first().map(|first| {
            let pair = |row: &RobotRow| (row.timestamp_s, row.at.duration_since(first.at).as_secs_f64());
            self.rows.iter().step_by(10).map(pair).collect::<Vec<_>>()
        });
        Ok(Rehearsal {
            part,
            grip_force_n,
            reported_force_n,
            rest,
            air_speed_mm_s: 1e3 * fastest,
            air_overshoot_mm: 1e3 * (farthest_m - campaign.stop_m),
            preload_n,
            lateral_n,
            response: response(&rows, rest.noise_n[2]),
            robot_clock: robot.and_then(|pairs| clock_of(&pairs)),
            camera_clock: PerJaw { left: clock(Jaw::Left), right: clock(Jaw::Right) },
        })
    }

    /// Sends the program of a rehearsed pull and waits for its zero.
    fn zeroed(&mut self, campaign: &Campaign, planned: &PlannedPull, dwell_s: f64) -> Result<i32, Fault> {
        let run = self.next_run();
        let mut program = pull_program(self.config, campaign, planned, run);
        program.max_force_n = REHEARSED_N;
        program.abort_force_n = program.abort_force_n.min(4.0 * REHEARSED_N);
        program.wait_s += dwell_s;
        let script = program.script()?;
        self.devices.heart.set_go(0);
        self.tell(RigEvent::Step("zeroing the force sensor"));
        self.start_program("the rehearsed pull", run, &script)?;
        self.wait("zeroing", SLACK, |x| {
            Ok(x.newest().is_some_and(|r| r.phase_of(run) == Some(Phase::Zeroed)))
        })?;
        Ok(run)
    }

    fn pulled(&self, run: i32) -> Vec<RobotRow> {
        self.rows.iter().filter(|row| row.phase_of(run) == Some(Phase::Pulling)).copied().collect()
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len().max(1) as f64;
    values.sum::<f64>() / n
}

fn at_rest(rows: &[RobotRow], raw_z_n: f64) -> SensorAtRest {
    let quarter = (rows.len() / 4).max(1).min(rows.len());
    let part = |rows: &[RobotRow], axis: usize| mean(rows.iter().map(|row| row.force[axis]));
    let (first, last) = (&rows[..quarter], &rows[rows.len() - quarter..]);
    // Differences of neighbours know no drift.
    let noise = |axis: usize| {
        let squares = rows.windows(2).map(|w| (w[1].force[axis] - w[0].force[axis]).powi(2));
        (mean(squares) / 2.0).sqrt()
    };
    SensorAtRest {
        noise_n: [noise(0), noise(1), noise(2)],
        zero_error_n: part(first, 2),
        drift_n: part(last, 2) - part(first, 2),
        dwell_s: rows
            .last()
            .zip(rows.first())
            .map_or(0.0, |(last, first)| last.timestamp_s - first.timestamp_s),
        raw_z_n,
    }
}

/// A line through device's and this machine's times, by least squares; the latest over it.
fn clock_of(pairs: &[(f64, f64)]) -> Option<ClockFound> {
    if pairs.len() < FRAMES {
        return None;
    }
    let (device, here) = (mean(pairs.iter().map(|p| p.0)), mean(pairs.iter().map(|p| p.1)));
    let varies: f64 = pairs.iter().map(|p| (p.1 - here).powi(2)).sum();
    let together: f64 = pairs.iter().map(|p| (p.1 - here) * (p.0 - device)).sum();
    let rate = together / varies;
    if !(rate.is_finite() && rate > 0.0) {
        return None;
    }
    let late = pairs.iter().map(|p| (p.1 - here) - (p.0 - device) / rate);
    let (least, most) = late.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let over_s = pairs.iter().map(|p| p.1).fold(0.0, f64::max)
        - pairs.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    Some(ClockFound { rate, late_s: most - least, over_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_have_a_rate_and_a_lateness() {
        let pairs: Vec<(f64, f64)> = (0..20)
            .map(|i| (100.0 + 1.01 * f64::from(i), f64::from(i) + if i == 7 { 0.05 } else { 0.0 }))
            .collect();
        let found = clock_of(&pairs).unwrap();
        assert!((found.rate - 1.01).abs() < 1e-3 && (found.late_s - 0.05).abs() < 0.01, "{found:?}");
        assert_eq!(clock_of(&pairs[..5]), None);
    }
}
