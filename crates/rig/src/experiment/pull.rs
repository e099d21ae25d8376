//! One pull, from the way to the part to the way back.

use super::event::RigEvent;
pub use super::event::{ExecutedPull, FrameStamp, LogLine, PullOutcome};
use super::executed::Parts;
use super::fault::Fault;
use super::film;
use super::plan::{GripPoses, grip_command, grip_poses, pull_program};
use super::robot::RobotRow;
use super::run::{Experiment, PROGRAM};
use crate::gcl::{GclCommand, GripState, Query};
use crate::program::{PRELOAD_S, Phase, SETTLE_S, StopReason};
use gripgen_twin::{Campaign, PlannedPull};
use std::time::{Duration, Instant};

/// How long the sensor is read without a load before the grip, by the robot's clock.
const NO_LOAD_S: f64 = 0.5;
/// How long it is read without a load after the pull, jaws open.
const NO_LOAD_AFTER_S: f64 = 0.25;
/// Time constants after which a reading has left the load: of 40 N 0.1 N are left.
const SETTLED_LAGS: f64 = 6.0;
/// Slack of this machine on what the robot times.
const SLACK: Duration = Duration::from_secs(3);
/// Height from which the way back is fast.
const CLEAR_M: f64 = 0.02;

impl Experiment<'_> {
    /// Makes a pull. Whatever goes wrong ends in a safe stop; then no further pull may follow on this experiment.
    pub fn pull(&mut self, campaign: &Campaign, planned: &PlannedPull) -> ExecutedPull {
        let mut parts = Parts::default();
        let made = self.make(campaign, planned, &mut parts);
        let stopped = made.as_ref().err().map(|fault| self.safe_stop(fault));
        self.measured(planned, parts, stopped)
    }

    /// A pull that cannot be made because of what came before it: everything is stopped.
    pub fn give_up(&mut self, planned: &PlannedPull, fault: &Fault) -> ExecutedPull {
        let stopped = self.safe_stop(fault);
        self.measured(planned, Parts::default(), Some(stopped))
    }

    /// The robot answers, may move, and runs nobody's program; the gripper takes commands, and the jaws are open.
    ///
    /// # Errors
    ///
    /// Whatever keeps robot or gripper from being ready.
    pub fn begin(&mut self) -> Result<(), Fault> {
        self.ready()?;
        let began = Instant::now();
        let idle = self.wait("the end of a program", PROGRAM, |x| {
            Ok(x.newest().is_some_and(|row| row.at >= began && !row.program_runs()))
        });
        idle.map_err(|fault| match fault {
            Fault::Late { waited_s, .. } => Fault::Busy { waited_s },
            other => other,
        })?;
        // A connection that was cut, whoever had it, is an emergency to a gripper; it keeps what it holds.
        self.gripper(&GclCommand::AcknowledgeFastStop)?;
        self.clear()?;
        // A release opens by so much: how wide the jaws are is decided here.
        let width_mm = self.config.gripper.start_mm;
        if self.ask_gripper(Query::Position)? < width_mm - 1.0 {
            self.tell(RigEvent::Step("opening the jaws"));
            self.gripper(&GclCommand::Move { width_mm })?;
        }
        Ok(())
    }

    /// Reads the sensor without a load for so long; nothing moves.
    ///
    /// # Errors
    ///
    /// What ends a pull: see [`Fault`].
    pub fn read_no_load(&mut self, seconds: f64) -> Result<(), Fault> {
        self.tell(RigEvent::Step("reading the sensor without a load"));
        let until_s = self.robot_time_s()? + seconds;
        self.wait_until("the reading without a load", until_s)
    }

    /// Waits by the robot's clock.
    ///
    /// # Errors
    ///
    /// What ends a pull: see [`Fault`].
    pub fn pause(&mut self, seconds: f64) -> Result<(), Fault> {
        if seconds > 0.0 {
            self.tell(RigEvent::Step("pause"));
            let until_s = self.robot_time_s()? + seconds;
            self.wait("the pause", Duration::from_secs_f64(seconds) + SLACK, |x| {
                // Half an hour of readings that nobody records would fill the memory.
                x.rows.clear();
                Ok(x.newest().is_some_and(|row| row.timestamp_s >= until_s))
            })?;
        }
        Ok(())
    }

    /// Opens jaws that an experiment before this one left closed, and goes up.
    fn clear(&mut self) -> Result<(), Fault> {
        let state = self.ask_gripper(Query::GripState)?;
        let holds = [GripState::Holding, GripState::PartLost, GripState::NoPart];
        if !holds.into_iter().any(|held| GripState::from_number(state) == Some(held)) {
            return Ok(());
        }
        self.tell(RigEvent::Step("opening jaws that were left closed"));
        self.release()?;
        let here = self.reading()?.tcp;
        let highest_m = 1e-3 * self.config.limits.workspace_high_mm[2];
        let up_m = (1e-3 * self.config.motion.approach_mm).min(highest_m - here.position_m[2]);
        if up_m > 0.0 {
            self.move_to("the way up", here.raised(up_m), self.config.motion.approach_speed_mm_s)?;
        }
        Ok(())
    }

    fn make(&mut self, campaign: &Campaign, planned: &PlannedPull, parts: &mut Parts) -> Result<(), Fault> {
        let Some(poses) = grip_poses(self.config, planned) else {
            let reason = format!("nobody taught where `{}` is", planned.part);
            parts.outcome = Some(PullOutcome::Failed { reason });
            return Ok(());
        };
        self.approach(&poses)?;
        self.tell(RigEvent::Step("rest images"));
        let rest = self.look_at_gels("rest", &[])?;
        parts.rest = Some(rest.images);
        parts.frames.extend(rest.stamps);
        self.move_to("the way down", poses.grip, self.config.motion.approach_speed_mm_s)?;
        let run = self.next_run();
        let program = pull_program(self.config, campaign, planned, run);
        let script = program.script()?;
        self.devices.heart.set_go(0);
        self.tell(RigEvent::Step("zeroing the force sensor"));
        self.start_program("the pull", run, &script)?;
        self.wait("zeroing", SLACK, |x| {
            Ok(x.newest().is_some_and(|r| r.phase_of(run) == Some(Phase::Zeroed)))
        })?;
        let from_s = self.robot_time_s()?;
        self.wait_until("the reading without a load", from_s + NO_LOAD_S)?;
        parts.no_load_s = Some((from_s, self.robot_time_s()?));
        self.tell(RigEvent::Step("gripping"));
        self.start_film();
        let command = grip_command(planned.grip_force_n);
        self.gripper(&command)?;
        parts.held_s = Some(self.robot_time_s()?);
        let state = self.ask_gripper(Query::GripState)?;
        let width_mm = self.ask_gripper(Query::Position)?;
        // Without a width to look for, the gripper says that it holds whatever it closed on.
        match GripState::from_number(state) {
            Some(GripState::Holding) if width_mm >= self.config.gripper.empty_below_mm => {}
            Some(GripState::Holding | GripState::NoPart) => {
                parts.outcome = Some(PullOutcome::NoContact);
                return self.leave(run, &poses);
            }
            _ => return Err(Fault::NotHolding { state }),
        }
        // The device clamps a force beyond its own settings without a word: what it reports goes into the record.
        parts.reported_force_n = Some(0.5 * self.ask_gripper(Query::Force)?);
        let held_s = parts.held_s.unwrap_or_default();
        self.wait_until("settling", held_s + self.config.images.settle_s)?;
        self.tell(RigEvent::Step("grip images"));
        let grip = self.look_at_gels("grip", &parts.frames)?;
        parts.images = Some(grip.images);
        parts.frames.extend(grip.stamps);
        // The program needs its own time between the go and the first step.
        self.wait_until("the dwell", held_s + planned.dwell_s - PRELOAD_S - SETTLE_S)?;
        parts.run = Some(run);
        let (reason, fault) = match self.staircase(run, planned, program.max_time_s) {
            Ok(reason) => (reason, None),
            // The program had ended by itself: what failed after it takes nothing from the label.
            Err(fault) => match self.own_end(run) {
                Some(reason) => (reason, Some(fault)),
                None => return Err(fault),
            },
        };
        parts.preload_n = self.preload_n(planned);
        parts.film = self.end_film();
        parts.doubts = self.silent_cameras();
        film::exposure(&parts.film).into_iter().for_each(|words| self.note("camera", words));
        parts.doubts.extend(film::doubts(&parts.film, self.frame_limit_s()));
        let checked =
            self.check_gaps(run).and_then(|()| self.check_force(campaign, planned, run, parts.preload_n));
        if checked.is_ok() {
            parts.outcome = self.label(campaign, planned, parts, reason);
        }
        fault.map_or(checked, Err)?;
        // A part that was lost in the pull has no label. A gripper that does not answer takes none away.
        let state = self.ask_gripper(Query::GripState)?;
        if GripState::from_number(state) != Some(GripState::Holding) {
            parts.outcome = None;
            return Err(Fault::NotHolding { state });
        }
        self.tell(RigEvent::Step("releasing"));
        self.release()?;
        // The next program zeroes the sensor.
        let from_s = self.robot_time_s()? + SETTLED_LAGS * self.trails_s;
        self.wait_until("the reading without a load after the pull", from_s + NO_LOAD_AFTER_S)?;
        parts.no_load_after_s = Some((from_s, self.robot_time_s()?));
        self.go_up(&poses)
    }

    /// Up to a safe height, over the part, ready to go down.
    pub(super) fn approach(&mut self, poses: &GripPoses) -> Result<(), Fault> {
        let (motion, here) = (&self.config.motion, self.reading()?.tcp);
        let (speed, height_m) = (motion.speed_mm_s, here.position_m[2].max(poses.approach.position_m[2]));
        let mut up = here;
        up.position_m[2] = height_m;
        let mut over = poses.approach;
        over.position_m[2] = height_m;
        self.move_to("the way up", up, speed)?;
        self.move_to("the way over the part", over, speed)?;
        self.move_to("the way to the part", poses.approach, speed)
    }

    /// Says go and watches until the program has stopped.
    pub(super) fn staircase(
        &mut self,
        run: i32,
        planned: &PlannedPull,
        max_s: f64,
    ) -> Result<StopReason, Fault> {
        self.tell(RigEvent::Step("pulling"));
        self.devices.heart.set_go(run);
        let is_pulling = |x: &mut Self| {
            let phase = x.newest().and_then(|row| row.phase_of(run));
            Ok(matches!(phase, Some(Phase::Pulling | Phase::Braking | Phase::Stopped)))
        };
        self.wait("the start of the pull", SLACK, is_pulling)?;
        let preload_n = self.preload_n(planned);
        let max_n = self.config.limits.preload_n;
        if preload_n.abs() > max_n {
            return Err(Fault::Preload { preload_n, max_n });
        }
        let began = Instant::now();
        let limit = Duration::from_secs_f64(max_s) + SLACK;
        let (mut shown, mut start_s) = (0, None);
        self.wait("the pull", limit, |x| {
            for i in shown..x.rows.len() {
                let row = x.rows[i];
                if row.phase_of(run) == Some(Phase::Pulling) {
                    let from_s = *start_s.get_or_insert(row.timestamp_s);
                    let measured_n = x.signed(planned, row.force[2]);
                    x.tell(RigEvent::Reading {
                        time_s: row.timestamp_s - from_s,
                        desired_n: row.desired_n,
                        measured_n,
                        displacement_mm: 1e3 * row.displacement_m,
                    });
                }
            }
            shown = x.rows.len();
            Ok(x.newest().is_some_and(|r| r.phase_of(run) == Some(Phase::Stopped)))
        })?;
        self.end_of_program("the pull", run, limit.saturating_sub(began.elapsed()) + SLACK)
    }

    /// Why a pull's program stopped by itself, where the newest reading says that it did.
    fn own_end(&self, run: i32) -> Option<StopReason> {
        let row = self.newest().filter(|row| row.phase_of(run) == Some(Phase::Stopped))?;
        StopReason::from_number(row.reason)
    }

    /// What the program measured before the first step, along the pull.
    pub(super) fn preload_n(&self, planned: &PlannedPull) -> f64 {
        self.signed(planned, self.newest().map_or(0.0, |row| row.preload_n * planned.pull_direction))
    }

    /// The force along the pull that a reading along z means.
    pub(super) fn signed(&self, planned: &PlannedPull, force_z: f64) -> f64 {
        self.config.robot.force_sign * self.config.robot.force_gain * planned.pull_direction * force_z
    }

    /// A pull with missing readings is none.
    fn check_gaps(&self, run: i32) -> Result<(), Fault> {
        let limit_s = self.config.limits.robot_gap_s;
        // The readings before the first and after the last one count: there its beginning or its end would be missing.
        for pair in self.rows.windows(2) {
            let pulls = pair.iter().any(|row| row.phase_of(run) == Some(Phase::Pulling));
            let gap_s = pair[1].timestamp_s - pair[0].timestamp_s;
            if pulls && gap_s > limit_s {
                return Err(Fault::Gap { gap_s, limit_s });
            }
        }
        Ok(())
    }

    /// A pull in which a hand, a cable or a collision took part is none. Only what is far from any slip, and from any sensor
    /// that reads up to twice too much, is told from it.
    fn check_force(
        &self,
        campaign: &Campaign,
        planned: &PlannedPull,
        run: i32,
        preload_n: f64,
    ) -> Result<(), Fault> {
        let pulling = || self.rows.iter().filter(move |row| row.phase_of(run) == Some(Phase::Pulling));
        let forces = |row: &RobotRow| (row.desired_n, self.signed(planned, row.force[2]));
        let held = pulling().take_while(|row| row.displacement_m.abs() < HELD * campaign.stop_m);
        if let Some(gain) = mirrored(&held.map(forces).collect::<Vec<_>>(), preload_n) {
            let sign = self.config.robot.force_sign;
            return Err(Fault::ForceSign { sign, fits: -sign, gain });
        }
        let slack_n = 2.0 * campaign.label_tolerance_n;
        let low_n = preload_n.min(0.0) - slack_n;
        for (desired_n, measured_n) in pulling().map(forces) {
            let high_n = 2.0 * desired_n + preload_n.max(0.0) + slack_n;
            if !(low_n..=high_n).contains(&measured_n) {
                return Err(Fault::Disturbed { measured_n, desired_n, low_n, high_n });
            }
        }
        Ok(())
    }

    /// Lets a program go that was not needed, and the way back.
    fn leave(&mut self, run: i32, poses: &GripPoses) -> Result<(), Fault> {
        self.devices.heart.set_go(crate::program::registers::STOP);
        self.end_of_program("the pull", run, SLACK)?;
        self.retract(poses)
    }

    fn retract(&mut self, poses: &GripPoses) -> Result<(), Fault> {
        self.tell(RigEvent::Step("releasing"));
        self.release()?;
        self.go_up(poses)
    }

    pub(super) fn go_up(&mut self, poses: &GripPoses) -> Result<(), Fault> {
        let here = self.reading()?.tcp;
        self.move_to("the way up", here.raised(CLEAR_M), self.config.motion.approach_speed_mm_s)?;
        self.move_to("the way back", poses.approach, self.config.motion.speed_mm_s)
    }
}

/// A newton of command that reads as less than this is a reading of the other sign: with the right one it reads as 1, and as less
/// once the jaws slip.
pub(super) const MIRRORED_GAIN: f64 = -0.5;
/// Share of the way to the stop before which the jaws have not slipped for good: the reading follows the command there.
const HELD: f64 = 0.1;
/// Share of the readings' squares that has to follow the command: a hand that pushes does not.
const FOLLOWS: f64 = 0.5;

/// What a newton of command reads as, if the readings are the mirror image of the commands; both are (command, reading).
fn mirrored(pulled: &[(f64, f64)], preload_n: f64) -> Option<f64> {
    let (mut together, mut of_command, mut of_reading) = (0.0, 0.0, 0.0);
    for (desired_n, measured_n) in pulled {
        let more_n = measured_n - preload_n;
        together += desired_n * more_n;
        of_command += desired_n * desired_n;
        of_reading += more_n * more_n;
    }
    let gain = together / of_command;
    (gain < MIRRORED_GAIN && together * together > FOLLOWS * of_command * of_reading).then_some(gain)
}

#[cfg(test)]
mod tests {
    use super::mirrored;

    #[test]
    fn readings_of_the_other_sign_are_told_from_a_hand() {
        // 1 N every 50 readings, a slip at 6 N.
        let pull = |sign: f64, zero_n: f64| -> Vec<(f64, f64)> {
            let step = |i: u32| f64::from(i / 50 + 1);
            (0..400).map(|i| (step(i), zero_n + sign * if i < 300 { step(i) } else { 4.0 })).collect()
        };
        assert_eq!(mirrored(&pull(1.0, 0.0), 0.0), None);
        assert_eq!(mirrored(&pull(1.0, -2.0), -2.0), None);
        let gain = mirrored(&pull(-1.0, 0.3), 0.3).unwrap();
        assert!((-1.0..-0.6).contains(&gain), "{gain}");
        let mut pushed = pull(1.0, 0.0);
        pushed[250..300].iter_mut().for_each(|(_, measured_n)| *measured_n = -60.0);
        assert_eq!(mirrored(&pushed, 0.0), None);
        assert_eq!(mirrored(&[], 0.0), None);
    }
}
