//! An experiment under way: everything that comes is kept, everything that is wrong ends the waiting.

use super::clock::HostClock;
use super::config::RigConfig;
use super::devices::Devices;
use super::event::{LogLine, RigEvent};
use super::fault::Fault;
use super::film::Recorder;
use super::plan::{motion_program, outside_workspace};
use super::robot::RobotRow;
use crate::gcl::GclEvent;
use crate::link::Stamped;
use crate::primary::PrimaryMessage;
use crate::program::{Phase, StopReason, TcpPose};
use crate::rtde::Event;
use gripgen_twin::Jaw;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// How long one look at the devices waits for news.
const LOOK: Duration = Duration::from_millis(5);
/// How long a program may take to begin, or to end when its work is done.
pub(super) const PROGRAM: Duration = Duration::from_secs(3);
/// Slack on the times that the devices themselves keep.
pub(super) const SLACK: Duration = Duration::from_secs(3);
/// Largest number of a run.
const MAX_RUN: i32 = 1_000_000_000;
/// Time between two frames that are told of.
const FRAMES_EVERY: Duration = Duration::from_millis(200);
/// A tool that is closer to a pose than this is there.
const THERE_M: f64 = 1e-4;

/// An experiment: the devices, and what came from them since the last pull began.
pub struct Experiment<'a> {
    pub(super) config: &'a RigConfig,
    pub(super) devices: Devices,
    pub(super) clock: HostClock,
    pub(super) rows: Vec<RobotRow>,
    pub(super) log: Vec<LogLine>,
    /// What the gripper said and nobody has looked at.
    pub(super) gripper_events: Vec<GclEvent>,
    stop: &'a AtomicBool,
    emit: &'a mut dyn FnMut(RigEvent),
    newest: Option<RobotRow>,
    heard: Instant,
    /// When the robot's clock last went on.
    went_on: Instant,
    run: i32,
    /// What must go on while it is waited: a program of this number.
    watched: Option<(i32, &'static str)>,
    pub(super) last_said: Option<String>,
    /// How far a reading is known to trail, s.
    pub(super) trails_s: f64,
    /// When frames were last told of; `None` where nobody looks.
    frames_told: Option<Instant>,
    /// The film of the pull under way.
    pub(super) film: Option<Recorder>,
}

impl<'a> Experiment<'a> {
    /// Begins with devices that are connected. `stop` is Ctrl-C.
    pub fn new(
        config: &'a RigConfig,
        devices: Devices,
        stop: &'a AtomicBool,
        emit: &'a mut dyn FnMut(RigEvent),
    ) -> Self {
        // Numbers of runs differ between experiments: an old program's registers are not taken for the new one's. No run is as
        // short as a millisecond, so they count up more slowly than the clock that they begin at.
        let clock = HostClock::start();
        let run = ((clock.unix_s(Instant::now()) * 1e3) as i64 % i64::from(MAX_RUN)) as i32;
        Self {
            config,
            devices,
            clock,
            rows: Vec::new(),
            log: Vec::new(),
            gripper_events: Vec::new(),
            stop,
            emit,
            newest: None,
            heard: Instant::now(),
            went_on: Instant::now(),
            run,
            watched: None,
            last_said: None,
            trails_s: 0.0,
            frames_told: None,
            film: None,
        }
    }

    /// A reading trails by so much, as a rehearsal found it: what is read without a load after a pull waits for it.
    pub fn trails(&mut self, trails_s: f64) {
        self.trails_s = trails_s;
    }

    /// Says goodbye.
    pub fn close(self) {
        self.devices.close();
    }

    /// Tells of the newest frames of both cameras, a few each second.
    pub fn show_frames(&mut self) {
        self.frames_told = Some(Instant::now());
    }

    fn tell_frames(&mut self) {
        let Some(told) = self.frames_told.filter(|told| told.elapsed() >= FRAMES_EVERY) else { return };
        self.frames_told = Some(Instant::now());
        for jaw in Jaw::BOTH {
            let newest = self.devices.cameras[jaw].newest().filter(|frame| frame.at > told);
            if let Some(frame) = newest {
                self.tell(RigEvent::Frame { jaw, frame: frame.event });
            }
        }
    }

    pub(super) fn tell(&mut self, event: RigEvent) {
        (self.emit)(event);
    }

    pub(super) fn next_run(&mut self) -> i32 {
        self.run = if self.run >= MAX_RUN { 1 } else { self.run + 1 };
        self.run
    }

    /// What the robot last said.
    pub fn newest(&self) -> Option<&RobotRow> {
        self.newest.as_ref()
    }

    pub(super) fn note(&mut self, source: &'static str, text: String) {
        self.log.push(LogLine { at: Instant::now(), source, text });
    }

    /// Takes in what came, for at most one look. Gives how many readings there were.
    pub(super) fn look(&mut self) -> Result<usize, Fault> {
        self.devices.heart.alive();
        if self.stop.load(Ordering::SeqCst) {
            return Err(Fault::Interrupted);
        }
        let rows = self.take_robot(LOOK)?;
        self.take_others()?;
        if let Some(row) = &self.newest {
            row.check()?;
        }
        let (silent_s, limit_s) = (self.heard.elapsed().as_secs_f64(), self.silence_limit_s());
        if silent_s > limit_s {
            return Err(Fault::Silent { silent_s, limit_s });
        }
        let stood_s = self.heard.saturating_duration_since(self.went_on).as_secs_f64();
        if let Some(row) = self.newest.filter(|_| stood_s > limit_s) {
            return Err(Fault::ClockStands { time_s: row.timestamp_s, stood_s, limit_s });
        }
        self.check_program()?;
        self.tell_frames();
        self.film_on();
        Ok(rows)
    }

    fn silence_limit_s(&self) -> f64 {
        self.config.limits.robot_silence_s * self.config.limits.patience
    }

    /// The first reading that allows to move. What the dashboard has just switched on is a moment late in the readings.
    pub(super) fn ready(&mut self) -> Result<(), Fault> {
        let began = Instant::now();
        while began.elapsed() < self.config.patient(PROGRAM) {
            self.devices.heart.alive();
            self.take_robot(LOOK)?;
            let interrupted = self.stop.load(Ordering::SeqCst);
            if interrupted || self.newest.is_some_and(|row| row.at >= began && row.check().is_ok()) {
                break;
            }
        }
        self.look().map(|_| ())
    }

    /// Takes in what the robot said.
    pub(super) fn take_robot(&mut self, wait: Duration) -> Result<usize, Fault> {
        let mut rows = 0;
        let mut wait = wait;
        loop {
            let event = match self.devices.robot.events().recv_timeout(wait) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => return Ok(rows),
                Err(RecvTimeoutError::Disconnected) => {
                    let silent_s = self.heard.elapsed().as_secs_f64();
                    let silent = Fault::Silent { silent_s, limit_s: self.silence_limit_s() };
                    return Err(self.devices.robot.ended().map_or(silent, Fault::Robot));
                }
            };
            wait = Duration::ZERO;
            match event.event {
                Event::Data(values) => {
                    // The types were looked at when the connection was made.
                    if let Some(row) = RobotRow::from_values(event.at, &values) {
                        self.heard = event.at.max(self.heard);
                        if self.newest.is_none_or(|before| row.timestamp_s > before.timestamp_s) {
                            self.went_on = self.heard;
                        }
                        self.newest = Some(row);
                        self.rows.push(row);
                        rows += 1;
                    }
                }
                Event::Text { text, source, level } => {
                    let text = format!("{source}: {text} (level {level})");
                    self.log.push(LogLine { at: event.at, source: "robot", text: text.clone() });
                    self.tell(RigEvent::Said { source: "robot", text });
                }
                _ => {}
            }
        }
    }

    /// Takes in what the controller announces and what the gripper says.
    fn take_others(&mut self) -> Result<(), Fault> {
        while let Ok(Stamped { at, event }) = self.devices.primary.messages().try_recv() {
            if !matches!(event, PrimaryMessage::Version { .. }) {
                let text = event.to_string();
                self.log.push(LogLine { at, source: "controller", text: text.clone() });
                self.last_said = Some(text);
            }
        }
        // What the controller announces can be missed; a program that cannot be sent can not.
        if let Some(end) = self.devices.primary.ended() {
            return Err(end.into());
        }
        if let Some(gripper) = &self.devices.gripper {
            while let Ok(event) = gripper.events().try_recv() {
                self.gripper_events.push(event.event);
            }
            if let Some(end) = gripper.ended() {
                return Err(end.into());
            }
        }
        Ok(())
    }

    /// A program that is waited for must run until it has said why it stopped.
    fn check_program(&mut self) -> Result<(), Fault> {
        let Some((run, what)) = self.watched else { return Ok(()) };
        let Some(row) = &self.newest else { return Ok(()) };
        // It has begun: another number is that of another program in its place.
        if row.phase_of(run) != Some(Phase::Stopped) && (row.run != run || !row.program_runs()) {
            self.watched = None;
            return Err(Fault::Ended { what, said: self.last_said.take() });
        }
        Ok(())
    }

    /// Waits until something is so.
    pub(super) fn wait(
        &mut self,
        what: &'static str,
        limit: Duration,
        mut is: impl FnMut(&mut Self) -> Result<bool, Fault>,
    ) -> Result<(), Fault> {
        let (began, limit) = (Instant::now(), self.config.patient(limit));
        loop {
            self.look()?;
            if is(self)? {
                return Ok(());
            }
            if began.elapsed() > limit {
                let (waited_s, limit_s) = (began.elapsed().as_secs_f64(), limit.as_secs_f64());
                return Err(Fault::Late { what, waited_s, limit_s });
            }
        }
    }

    /// The robot's clock now.
    pub(super) fn robot_time_s(&mut self) -> Result<f64, Fault> {
        self.reading().map(|row| row.timestamp_s)
    }

    /// The newest reading; waits for the first.
    pub(super) fn reading(&mut self) -> Result<RobotRow, Fault> {
        if self.newest.is_none() {
            self.wait("the first reading of the robot", PROGRAM, |x| Ok(x.newest.is_some()))?;
        }
        self.newest.ok_or(Fault::Late { what: "the first reading of the robot", waited_s: 0.0, limit_s: 0.0 })
    }

    /// Waits until the robot's clock says so.
    pub(super) fn wait_until(&mut self, what: &'static str, time_s: f64) -> Result<(), Fault> {
        let left_s = (time_s - self.robot_time_s()?).max(0.0);
        self.wait(what, Duration::from_secs_f64(left_s) + SLACK, |x| {
            Ok(x.newest.is_some_and(|row| row.timestamp_s >= time_s))
        })
    }

    /// Starts a program and waits until it has begun.
    pub(super) fn start_program(&mut self, what: &'static str, run: i32, script: &str) -> Result<(), Fault> {
        self.last_said = None;
        self.note("program", format!("{what}, run {run}"));
        self.devices.primary.send_script(script)?;
        let began = |x: &mut Self| {
            // A program that cannot be run is announced, and begins nothing.
            if let Some(said) = x.last_said.take_if(|said| said.starts_with('C') || said.starts_with("line"))
            {
                return Err(Fault::Ended { what, said: Some(said) });
            }
            Ok(x.newest.is_some_and(|row| row.run == run && row.phase_of(run).is_some()))
        };
        self.wait("the start of a program", PROGRAM, began)?;
        self.watched = Some((run, what));
        Ok(())
    }

    /// Waits for the end of a program and gives its reason.
    pub(super) fn end_of_program(
        &mut self,
        what: &'static str,
        run: i32,
        limit: Duration,
    ) -> Result<StopReason, Fault> {
        self.wait(what, limit, |x| Ok(x.newest.is_some_and(|r| r.phase_of(run) == Some(Phase::Stopped))))?;
        self.watched = None;
        let number = self.newest.map_or(0, |row| row.reason);
        let reason =
            StopReason::from_number(number).ok_or(Fault::Unknown { what: "a stop reason", number })?;
        // The program waits until its go is taken back.
        self.devices.heart.set_go(0);
        self.wait("the end of a program", PROGRAM, |x| Ok(x.newest.is_some_and(|r| !r.program_runs())))?;
        Ok(reason)
    }

    /// Moves the tool in a straight line.
    pub(super) fn move_to(
        &mut self,
        what: &'static str,
        target: TcpPose,
        speed_mm_s: f64,
    ) -> Result<(), Fault> {
        if let Some((axis, value_mm, low_mm, high_mm)) = outside_workspace(self.config, &target) {
            return Err(Fault::Workspace { axis, value_mm, low_mm, high_mm });
        }
        let here = self.reading()?.tcp;
        let way_m = here.distance_m(&target);
        let turned =
            (0..3).map(|i| (here.rotation_rad[i] - target.rotation_rad[i]).abs()).fold(0.0, f64::max);
        if way_m < THERE_M && turned < 1e-4 {
            return Ok(());
        }
        self.tell(RigEvent::Step(what));
        let run = self.next_run();
        let program = motion_program(self.config, target, speed_mm_s, way_m.max(0.05), run);
        let script = program.script()?;
        self.devices.heart.set_go(run);
        self.start_program(what, run, &script)?;
        let limit = Duration::from_secs_f64(program.max_time_s) + PROGRAM;
        match self.end_of_program(what, run, limit)? {
            StopReason::Arrived => Ok(()),
            reason => Err(Fault::BrokenOff { what, reason }),
        }
    }
}
