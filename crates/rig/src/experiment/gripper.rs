//! The gripper in an experiment: commands with their ends, and the release, which waits for a robot that stands.

use super::fault::Fault;
use super::rest::Rest;
use super::run::{Experiment, SLACK};
use crate::gcl::{GclCommand, GclEvent, GripState, Query, status_meaning};
use std::time::{Duration, Instant};

/// How long a motion of the gripper may take, and how often it is asked meanwhile whether it still moves.
const GRIPPER: Duration = Duration::from_secs(30);
const ASK: Duration = Duration::from_millis(250);
/// What is waited for after a question.
const ANSWER: &str = "an answer of the gripper";
/// So many answers that it stands, and no word that it has finished: the word is lost.
const STANDS: u32 = 3;

impl Experiment<'_> {
    /// Opens the jaws. Only a robot that stands, and on which no program runs, is let go of a part.
    pub(super) fn release(&mut self) -> Result<(), Fault> {
        let (mut rest, mut seen) = (Rest::default(), self.rows.len());
        self.wait("the standstill before the release", SLACK, |x| {
            let mut stands = false;
            for row in x.rows.iter().skip(seen) {
                stands = rest.take(row);
            }
            seen = x.rows.len();
            Ok(stands)
        })?;
        self.gripper(&GclCommand::Release { pull_back_mm: self.config.gripper.open_mm })?;
        Ok(())
    }

    /// Sends a command to the gripper.
    pub(super) fn tell_gripper(&mut self, command: &GclCommand) -> Result<(), Fault> {
        self.gripper_events.clear();
        self.send_gripper(command)
    }

    fn send_gripper(&self, command: &GclCommand) -> Result<(), Fault> {
        match &self.devices.gripper {
            Some(gripper) => Ok(gripper.send(command)?),
            None => Ok(()),
        }
    }

    /// Lets the gripper do something and waits for its end. `Ok(false)`: it found nothing.
    pub(super) fn gripper(&mut self, command: &GclCommand) -> Result<bool, Fault> {
        let name = command.name();
        self.tell_gripper(command)?;
        let mut found = true;
        let (mut asked, mut answered, mut stands) = (Instant::now(), true, 0);
        self.wait("the gripper", GRIPPER, |x| {
            for event in std::mem::take(&mut x.gripper_events) {
                match event {
                    GclEvent::Value { name: of, number } if of == Query::GripState.name() => {
                        answered = true;
                        let moves = GripState::from_number(number).is_some_and(GripState::moves);
                        stands = if moves { 0 } else { stands + 1 };
                        if stands >= STANDS {
                            return Err(Fault::Unfinished { command: name, state: number });
                        }
                    }
                    GclEvent::Finished(done) if done == name && command.moves() => return Ok(true),
                    GclEvent::Acknowledged(done) if done == name && !command.moves() => return Ok(true),
                    // 18: no part at the width.
                    GclEvent::Failed { status: Some(18), .. } => {
                        found = false;
                        return Ok(true);
                    }
                    GclEvent::Failed { status, line, .. } => {
                        let meaning = status.map_or("no status", status_meaning);
                        return Err(Fault::GripperFailed { line, meaning });
                    }
                    _ => {}
                }
            }
            let waited = asked.elapsed();
            if answered && waited > ASK {
                (asked, answered) = (Instant::now(), false);
                x.send_gripper(&GclCommand::Ask(Query::GripState))?;
            } else if !answered && waited > x.config.patient(SLACK) {
                let limit_s = x.config.patient(SLACK).as_secs_f64();
                let waited_s = waited.as_secs_f64();
                let late = Fault::Late { what: ANSWER, waited_s, limit_s };
                return Err(x.unread(Query::GripState).unwrap_or(late));
            }
            Ok(false)
        })?;
        Ok(found)
    }

    /// Asks the gripper for a value.
    pub(super) fn ask_gripper(&mut self, query: Query) -> Result<f64, Fault> {
        self.tell_gripper(&GclCommand::Ask(query))?;
        let mut value = None;
        let waited = self.wait(ANSWER, SLACK, |x| {
            for event in std::mem::take(&mut x.gripper_events) {
                match event {
                    GclEvent::Value { name, number } if name == query.name() => value = Some(number),
                    GclEvent::Failed { status, line, .. } => {
                        let meaning = status.map_or("no status", status_meaning);
                        return Err(Fault::GripperFailed { line, meaning });
                    }
                    _ => {}
                }
            }
            Ok(value.is_some())
        });
        match waited {
            Ok(()) => Ok(value.unwrap_or(f64::NAN)),
            Err(late @ Fault::Late { .. }) => Err(self.unread(query).unwrap_or(late)),
            Err(other) => Err(other),
        }
    }

    /// What came instead of an answer, as a fault.
    fn unread(&self, query: Query) -> Option<Fault> {
        let line = self.devices.gripper.as_ref()?.unread(&GclCommand::Ask(query))?;
        Some(Fault::GripperUnread { asked: query.name(), line })
    }
}
