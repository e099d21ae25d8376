//! The session on a socket: a thread of its own reads, so that no answer waits for anybody.

use super::command::{GclCommand, GclLimits, Query};
use super::session::{GclEvent, GclLink, GclSessionError, SendError, event_of, status_meaning};
use crate::link::{Connection, LinkError, Reading, Shared, Socket, Stamped};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

/// How long a goodbye is waited for.
const BYE: Duration = Duration::from_millis(500);
/// Events that wait to be read; later ones are left out of the channel, and stand in the log alone.
const MAX_EVENTS: usize = 4096;
/// Answers that nobody has waited for yet.
const MAX_ANSWERS: usize = 256;
/// Lines in the log; the oldest make room.
const MAX_LOG_LINES: usize = 65_536;
/// How far a setting that is repeated may be off: devices print two decimals.
const ECHO_TOLERANCE: f64 = 0.01;

const READING: Reading = Reading { thread: "gcl", silence: None, cut_at_end: true };

/// Why a connection to a gripper was not made, or ended.
pub type GclLinkError = LinkError<GclSessionError>;

/// Why a command was not sent.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum GclSendError {
    /// It is not allowed now, or never.
    #[error(transparent)]
    Refused(#[from] SendError),
    /// The connection.
    #[error(transparent)]
    Link(#[from] GclLinkError),
}

/// Why a command did not come to its end.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum GclRunError {
    /// It was not sent.
    #[error(transparent)]
    Send(#[from] GclSendError),
    /// The connection ended before the answer.
    #[error(transparent)]
    Link(#[from] GclLinkError),
    /// The gripper refuses or fails.
    #[error("the gripper answers `{line}` to {command}: {meaning}")]
    Failed {
        /// What was asked.
        command: &'static str,
        /// Its status, where it says one.
        status: Option<u32>,
        /// What the status means.
        meaning: &'static str,
        /// The whole answer.
        line: String,
    },
    /// The gripper takes another value than it was given.
    #[error("{command} was set to {asked}, the gripper takes {taken}")]
    Echo {
        /// What was set.
        command: &'static str,
        /// To which value.
        asked: f64,
        /// What the gripper made of it.
        taken: f64,
    },
    /// An answer that is none.
    #[error("the gripper answers `{line}` to {asked}, which cannot be read")]
    Unread {
        /// What was asked.
        asked: String,
        /// The whole answer.
        line: String,
    },
    /// The answer did not come in time. When it comes later, it is not lost: [`GclClient::wait_for`] finds it.
    #[error("no `{awaited}` came for {waited_s:.3} s, {limit_s:.3} s are allowed")]
    Timeout {
        /// What was waited for.
        awaited: String,
        /// For how long.
        waited_s: f64,
        /// The longest that was allowed.
        limit_s: f64,
    },
}

/// A line that was sent or received.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GclLogLine {
    /// When: just before it was sent, just after its last byte was read.
    pub at: Instant,
    /// Sent to the gripper; else received from it.
    pub sent: bool,
    /// Without its end.
    pub line: String,
}

/// A connected client. A gripper may be silent for ever, only requests have deadlines. [`close`](Self::close) says goodbye;
/// dropping the client cuts the connection, which a gripper takes for a fast stop.
pub struct GclClient {
    connection: Connection<State, GclSessionError>,
    events: Receiver<Stamped<GclEvent>>,
}

struct State {
    session: GclLink,
    /// What came of a line that has no end yet.
    line: Vec<u8>,
    log: VecDeque<GclLogLine>,
    answers: VecDeque<GclEvent>,
}

impl GclClient {
    /// Connects to a gripper of these limits. Nothing is sent yet.
    ///
    /// # Errors
    ///
    /// No connection.
    pub fn connect(address: SocketAddr, limits: GclLimits, timeout: Duration) -> Result<Self, GclLinkError> {
        let socket = Socket::connect(address, timeout, "the connection to the gripper is closed")?;
        let state = State {
            session: GclLink::new(limits),
            line: Vec::new(),
            log: VecDeque::new(),
            answers: VecDeque::new(),
        };
        let (tell, events) = sync_channel(MAX_EVENTS);
        let connection = Connection::start(socket, READING, state, move |shared, bytes, at| {
            for piece in bytes.split_inclusive(|&b| b == b'\n') {
                let events = shared.known().state.receive(piece, at)?;
                shared.notify();
                // A full channel is one that nobody reads.
                events.into_iter().for_each(|event| drop(tell.try_send(Stamped { at, event })));
            }
            Ok(())
        })?;
        Ok(Self { connection, events })
    }

    /// What the gripper said, in its order; the end of the channel is the end of the connection.
    pub fn events(&self) -> &Receiver<Stamped<GclEvent>> {
        &self.events
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<GclLinkError> {
        self.connection.shared.known().ended.clone()
    }

    /// All lines since the last call, both ways, in their order.
    pub fn take_log(&self) -> Vec<GclLogLine> {
        std::mem::take(&mut self.connection.shared.known().state.log).into()
    }

    /// The line that came instead of an answer since `command` was sent, if one did: `POS=110,0`.
    pub fn unread(&self, command: &GclCommand) -> Option<String> {
        self.connection.shared.known().state.unread(command)
    }

    /// Sends a command and waits for nothing.
    ///
    /// # Errors
    ///
    /// As [`GclLink::send`], or a connection that ended.
    pub fn send(&self, command: &GclCommand) -> Result<(), GclSendError> {
        self.connection.shared.send(command)
    }

    /// Waits for the end of a command that was sent: the FIN of a motion, the value of a question or a setting, the ACK of
    /// the others. The protocol numbers nothing: an answer that comes after its time counts for the next command of its name.
    ///
    /// # Errors
    ///
    /// An answer that says no, a fast stop, a connection that ended, or none within the timeout.
    pub fn wait_for(&mut self, command: &GclCommand, timeout: Duration) -> Result<(), GclRunError> {
        let taken = self.connection.shared.wait_for(command, timeout, |event| Some(number_of(event)))?;
        match (setting_of(command), taken) {
            (Some(asked), Some(taken)) if (asked - taken).abs() > ECHO_TOLERANCE => {
                Err(GclRunError::Echo { command: command.name(), asked, taken })
            }
            _ => Ok(()),
        }
    }

    /// Sends a command and waits for its end.
    ///
    /// # Errors
    ///
    /// As [`Self::send`] and [`Self::wait_for`].
    pub fn run(&mut self, command: &GclCommand, timeout: Duration) -> Result<(), GclRunError> {
        self.send(command)?;
        self.wait_for(command, timeout)
    }

    /// Asks for a value, in the unit of the query; also while the jaws move.
    ///
    /// # Errors
    ///
    /// As [`Self::run`].
    pub fn ask(&mut self, query: Query, timeout: Duration) -> Result<f64, GclRunError> {
        let command = GclCommand::Ask(query);
        self.send(&command)?;
        self.connection.shared.wait_for(&command, timeout, number_of)
    }

    /// Says goodbye, so that the gripper keeps what it holds, and closes the connection. The answer is waited for half a second;
    /// the connection is closed in any case.
    ///
    /// # Errors
    ///
    /// As [`Self::run`].
    pub fn close(mut self) -> Result<(), GclRunError> {
        self.run(&GclCommand::Bye, BYE)
    }
}

impl Shared<State, GclSessionError> {
    fn send(&self, command: &GclCommand) -> Result<(), GclSendError> {
        let mut known = self.known();
        if let Some(ended) = &known.ended {
            return Err(ended.clone().into());
        }
        let state = &mut known.state;
        state.session.send(command)?;
        // What is left of an earlier command of this name is no answer to this one.
        state.answers.retain(|event| !is_answer(event, command));
        // One line, one write: the lock keeps the log in the order of the wire.
        let bytes = state.session.take_outgoing();
        state.log(Instant::now(), true, &bytes);
        let written = self.socket.write(&bytes);
        if let Err(end) = &written {
            known.ended.get_or_insert_with(|| end.clone());
            self.socket.cut();
        }
        drop(known);
        self.notify();
        Ok(written?)
    }

    /// Waits for the answer that ends a command, and takes what `read` finds in it.
    fn wait_for<T>(
        &self,
        command: &GclCommand,
        timeout: Duration,
        read: impl Fn(&GclEvent) -> Option<T>,
    ) -> Result<T, GclRunError> {
        let name = command.name();
        let look = |state: &mut State| {
            let answer = state.answers.iter().position(|event| is_answer(event, command));
            let Some(answer) = answer.and_then(|at| state.answers.remove(at)) else {
                let line = state.misspelt(command)?;
                return Some(Err(GclRunError::Unread { asked: asked(command), line }));
            };
            match answer {
                GclEvent::Failed { status, line, .. } => {
                    let meaning = status.map_or("it gives no status", status_meaning);
                    Some(Err(GclRunError::Failed { command: name, status, meaning, line }))
                }
                answer => read(&answer).map(Ok),
            }
        };
        self.wait(timeout, look, |state, waited| {
            let (waited_s, limit_s) = (waited.as_secs_f64(), timeout.as_secs_f64());
            match state.unread(command) {
                Some(line) => GclRunError::Unread { asked: asked(command), line },
                None => GclRunError::Timeout { awaited: awaited(command), waited_s, limit_s },
            }
        })
    }
}

impl State {
    fn log(&mut self, at: Instant, sent: bool, bytes: &[u8]) {
        if self.log.len() == MAX_LOG_LINES {
            self.log.pop_front();
        }
        let line = String::from_utf8_lossy(bytes).trim().to_string();
        self.log.push_back(GclLogLine { at, sent, line });
    }

    /// Lines that came since `command` was sent, the newest first.
    fn came_since(&self, command: &GclCommand) -> impl Iterator<Item = &String> {
        let name = command.name();
        let sent = self.log.iter().rposition(|line| line.sent && line.line.starts_with(name));
        let from = sent.map_or(self.log.len(), |sent| sent + 1);
        self.log.range(from..).rev().filter(|line| !line.sent).map(|line| &line.line)
    }

    /// A line that says the name of `command` and is no answer to it: `POS=110,0`, `pos=110`.
    fn misspelt(&self, command: &GclCommand) -> Option<String> {
        let name = command.name();
        let is_named = |line: &&String| {
            let own = line.get(..name.len()).is_some_and(|start| start.eq_ignore_ascii_case(name));
            own && line[name.len()..].trim_start().starts_with('=')
        };
        let is_read = |line: &String| event_of(line.clone()).is_some_and(|event| is_answer(&event, command));
        self.came_since(command).find(is_named).filter(|line| !is_read(line)).cloned()
    }

    /// The line that came instead of an answer since `command` was sent, if one did.
    fn unread(&self, command: &GclCommand) -> Option<String> {
        let says_nothing = |line: &&String| event_of(line.to_string()).is_none();
        self.misspelt(command).or_else(|| self.came_since(command).find(says_nothing).cloned())
    }

    /// Takes in a piece of a line, or its end.
    fn receive(&mut self, piece: &[u8], at: Instant) -> Result<Vec<GclEvent>, GclSessionError> {
        let events = self.session.receive(piece)?;
        self.line.extend_from_slice(piece);
        if piece.ends_with(b"\n") {
            let line = std::mem::take(&mut self.line);
            self.log(at, false, &line);
        }
        for event in &events {
            if !matches!(event, GclEvent::Streamed { .. } | GclEvent::Other(_)) {
                if self.answers.len() == MAX_ANSWERS {
                    self.answers.pop_front();
                }
                self.answers.push_back(event.clone());
            }
        }
        Ok(events)
    }
}

/// Whether `event` ends `command`.
fn is_answer(event: &GclEvent, command: &GclCommand) -> bool {
    let own = command.name();
    let has_value = matches!(command, GclCommand::Ask(_)) || setting_of(command).is_some();
    match event {
        GclEvent::Finished(name) => command.moves() && name == own,
        GclEvent::Acknowledged(name) => !command.moves() && !has_value && name == own,
        GclEvent::Value { name, .. } => has_value && name == own,
        GclEvent::Failed { command: name, .. } => {
            // `ERR POS? 14` names the command as it was written, `ERR 14` none.
            name.is_empty() || name.split(['?', '=', '(']).next() == Some(own)
        }
        _ => false,
    }
}

fn number_of(event: &GclEvent) -> Option<f64> {
    if let GclEvent::Value { number, .. } = event { Some(*number) } else { None }
}

/// The value that a setting is repeated with.
fn setting_of(command: &GclCommand) -> Option<f64> {
    match *command {
        GclCommand::Verbose(on) => Some(f64::from(u8::from(on))),
        GclCommand::PartWidthTolerance { tolerance_mm } => Some(tolerance_mm),
        _ => None,
    }
}

/// A command as people know it.
pub(super) fn asked(command: &GclCommand) -> String {
    let question = if matches!(command, GclCommand::Ask(_)) { "?" } else { "" };
    format!("{}{question}", command.name())
}

/// How the line begins that ends `command`.
fn awaited(command: &GclCommand) -> String {
    let name = command.name();
    match command {
        command if command.moves() => format!("FIN {name}"),
        GclCommand::Ask(_) => format!("{name}="),
        command if setting_of(command).is_some() => format!("{name}="),
        _ => format!("ACK {name}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::SHIPPED_LIMITS;
    use super::*;

    #[test]
    fn a_line_that_says_nothing_is_shown_when_the_time_is_over() {
        let unread = |lines: &[&str]| {
            let (session, line) = (GclLink::new(SHIPPED_LIMITS), Vec::new());
            let mut state = State { session, line, log: VecDeque::new(), answers: VecDeque::new() };
            state.log(Instant::now(), false, b"Hello");
            state.log(Instant::now(), true, b"SPEED?");
            for line in lines {
                state.receive(format!("{line}\n").as_bytes(), Instant::now()).unwrap();
            }
            state.unread(&GclCommand::Ask(Query::Speed))
        };
        assert_eq!(unread(&["Welcome", "?"]).unwrap(), "?");
        assert_eq!(unread(&["SPEED=fast", "?"]).unwrap(), "SPEED=fast");
        // Answers to something else, and nothing at all.
        assert_eq!(unread(&["POS=110", "@SPEED=3", "FIN MOVE"]), None);
        assert_eq!(unread(&[]), None);
    }
}
