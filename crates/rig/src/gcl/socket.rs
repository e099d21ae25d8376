//! The session on a socket: a thread of its own reads, so that no answer waits for anybody, and a fast stop can be sent from any
//! thread at any moment.

use super::command::{GclCommand, GclLimits, Query};
use super::session::{GclEvent, GclLink, GclSessionError, SendError, status_meaning};
use crate::stamped::{ReadEnd, Stamped, connect, lock, read_until_end};
use std::collections::VecDeque;
use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a goodbye is waited for.
const BYE: Duration = Duration::from_millis(500);
/// Events that wait to be read; later ones are left out of the channel, and stand in the log alone.
const MOST_EVENTS: usize = 4096;
/// Answers that nobody has waited for yet.
const MOST_ANSWERS: usize = 256;
/// Lines in the log; the oldest make room.
const MOST_LOG_LINES: usize = 65_536;
/// How far a setting that is repeated may be off: devices print two decimals.
const ECHO_TOLERANCE: f64 = 0.01;

/// Why a connection was not made, or ended.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum GclLinkError {
    /// The network.
    #[error("{address}: {source}")]
    Io {
        /// Where to.
        address: SocketAddr,
        /// What the system says.
        source: Arc<std::io::Error>,
    },
    /// The protocol.
    #[error("{address}: {source}")]
    Session {
        /// Where to.
        address: SocketAddr,
        /// What is wrong.
        source: GclSessionError,
    },
    /// The connection is closed.
    #[error("{address}: the connection to the gripper is closed")]
    Closed {
        /// Where to.
        address: SocketAddr,
    },
}

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
    /// A fast stop was sent: the motion never finishes.
    #[error("{command} was ended by a fast stop")]
    Stopped {
        /// What moved.
        command: &'static str,
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
    shared: Arc<Shared>,
    events: Receiver<Stamped<GclEvent>>,
    reader: Option<JoinHandle<()>>,
}

/// Sends a fast stop from any thread, also while the client waits.
#[derive(Clone)]
pub struct GclStopper {
    shared: Arc<Shared>,
}

struct Shared {
    address: SocketAddr,
    stream: TcpStream,
    state: Mutex<State>,
    /// An answer, a fast stop, or the end.
    changed: Condvar,
}

struct State {
    session: GclLink,
    /// What came of a line that has no end yet.
    line: Vec<u8>,
    log: VecDeque<GclLogLine>,
    answers: VecDeque<GclEvent>,
    /// A fast stop was sent after the last motion.
    stopped: bool,
    ended: Option<GclLinkError>,
}

impl GclClient {
    /// Connects to a gripper of these limits. Nothing is sent yet.
    pub fn connect(address: SocketAddr, limits: GclLimits, timeout: Duration) -> Result<Self, GclLinkError> {
        let io = |source| GclLinkError::Io { address, source: Arc::new(source) };
        let stream = connect(address, timeout).map_err(io)?;
        let state = State {
            session: GclLink::new(limits),
            line: Vec::new(),
            log: VecDeque::new(),
            answers: VecDeque::new(),
            stopped: false,
            ended: None,
        };
        let shared = Arc::new(Shared { address, stream, state: Mutex::new(state), changed: Condvar::new() });
        let (tell, events) = sync_channel(MOST_EVENTS);
        let reading = shared.clone();
        let reader = std::thread::Builder::new().name("gcl".into());
        let reader = reader.spawn(move || read_on(&reading, &tell)).map_err(io)?;
        Ok(Self { shared, events, reader: Some(reader) })
    }

    /// What the gripper said, in its order; the end of the channel is the end of the connection.
    pub fn events(&self) -> &Receiver<Stamped<GclEvent>> {
        &self.events
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<GclLinkError> {
        lock(&self.shared.state).ended.clone()
    }

    /// All lines since the last call, both ways, in their order.
    pub fn take_log(&self) -> Vec<GclLogLine> {
        std::mem::take(&mut lock(&self.shared.state).log).into()
    }

    /// A handle that can stop the gripper from another thread.
    pub fn stopper(&self) -> GclStopper {
        GclStopper { shared: self.shared.clone() }
    }

    /// Sends a command and waits for nothing.
    pub fn send(&self, command: &GclCommand) -> Result<(), GclSendError> {
        self.shared.send(command)
    }

    /// Waits for the end of a command that was sent: the FIN of a motion, the value of a question or a setting, the ACK of
    /// the others. The protocol numbers nothing: an answer that comes after its time counts for the next command of its name.
    pub fn wait_for(&mut self, command: &GclCommand, timeout: Duration) -> Result<(), GclRunError> {
        let taken = self.shared.wait(command, timeout, |event| Some(number_of(event)))?;
        match (setting_of(command), taken) {
            (Some(asked), Some(taken)) if (asked - taken).abs() > ECHO_TOLERANCE => {
                Err(GclRunError::Echo { command: command.name(), asked, taken })
            }
            _ => Ok(()),
        }
    }

    /// Sends a command and waits for its end.
    pub fn run(&mut self, command: &GclCommand, timeout: Duration) -> Result<(), GclRunError> {
        self.send(command)?;
        self.wait_for(command, timeout)
    }

    /// Asks for a value, in the unit of the query; also while the jaws move.
    pub fn ask(&mut self, query: Query, timeout: Duration) -> Result<f64, GclRunError> {
        let command = GclCommand::Ask(query);
        self.send(&command)?;
        self.shared.wait(&command, timeout, number_of)
    }

    /// Says goodbye, so that the gripper keeps what it holds, and closes the connection. The answer is waited for half a second;
    /// the connection is closed in any case.
    pub fn close(mut self) -> Result<(), GclRunError> {
        self.run(&GclCommand::Bye, BYE)
    }
}

impl Drop for GclClient {
    fn drop(&mut self) {
        // Wakes the reader; a connection that is gone already is closed all the same.
        let _ = self.shared.stream.shutdown(Shutdown::Both);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

impl GclStopper {
    /// Stops the jaws at once. Whoever waits for a motion is told; before the next one the stop is acknowledged.
    pub fn fast_stop(&self) -> Result<(), GclSendError> {
        self.shared.send(&GclCommand::FastStop)
    }
}

impl Shared {
    fn send(&self, command: &GclCommand) -> Result<(), GclSendError> {
        let mut state = lock(&self.state);
        if let Some(ended) = &state.ended {
            return Err(ended.clone().into());
        }
        state.session.send(command)?;
        // What is left of an earlier command of this name is no answer to this one.
        state.answers.retain(|event| !is_answer(event, command));
        match command {
            GclCommand::FastStop => state.stopped = true,
            command if command.moves() => state.stopped = false,
            _ => {}
        }
        // One line, one write: the lock keeps lines of two threads apart and the log in the order of the wire.
        let bytes = state.session.take_outgoing();
        let at = Instant::now();
        state.log(at, true, &bytes);
        let written = (&self.stream).write_all(&bytes);
        if let Err(e) = &written {
            let source = Arc::new(std::io::Error::from(e.kind()));
            state.ended.get_or_insert(GclLinkError::Io { address: self.address, source });
            let _ = self.stream.shutdown(Shutdown::Both);
        }
        drop(state);
        self.changed.notify_all();
        written.map_err(|e| GclLinkError::Io { address: self.address, source: Arc::new(e) }.into())
    }

    /// Waits for the answer that ends a command, and takes what `read` finds in it.
    fn wait<T>(
        &self,
        command: &GclCommand,
        timeout: Duration,
        read: impl Fn(&GclEvent) -> Option<T>,
    ) -> Result<T, GclRunError> {
        let (started, name) = (Instant::now(), command.name());
        let mut state = lock(&self.state);
        loop {
            let answer = state.answers.iter().position(|event| is_answer(event, command));
            if let Some(answer) = answer.and_then(|at| state.answers.remove(at)) {
                if let GclEvent::Failed { status, line, .. } = answer {
                    let meaning = status.map_or("it gives no status", status_meaning);
                    return Err(GclRunError::Failed { command: name, status, meaning, line });
                }
                if let Some(found) = read(&answer) {
                    return Ok(found);
                }
            }
            if state.stopped && command.moves() {
                return Err(GclRunError::Stopped { command: name });
            }
            if let Some(ended) = &state.ended {
                return Err(ended.clone().into());
            }
            let waited = started.elapsed();
            let Some(left) = timeout.checked_sub(waited).filter(|left| !left.is_zero()) else {
                let (waited_s, limit_s) = (waited.as_secs_f64(), timeout.as_secs_f64());
                return Err(GclRunError::Timeout { awaited: awaited(command), waited_s, limit_s });
            };
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl State {
    fn log(&mut self, at: Instant, sent: bool, bytes: &[u8]) {
        if self.log.len() == MOST_LOG_LINES {
            self.log.pop_front();
        }
        let line = String::from_utf8_lossy(bytes).trim().to_string();
        self.log.push_back(GclLogLine { at, sent, line });
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
                if self.answers.len() == MOST_ANSWERS {
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

/// The reader's loop, until the connection ends.
fn read_on(shared: &Shared, tell: &SyncSender<Stamped<GclEvent>>) {
    let end = read_until_end(&shared.stream, |bytes, at| {
        for piece in bytes.split_inclusive(|&b| b == b'\n') {
            let events = lock(&shared.state).receive(piece, at)?;
            shared.changed.notify_all();
            // A full channel is one that nobody reads.
            events.into_iter().for_each(|event| drop(tell.try_send(Stamped { at, event })));
        }
        Ok(())
    });
    let address = shared.address;
    let error = match end {
        ReadEnd::Closed => GclLinkError::Closed { address },
        ReadEnd::Io(source) => GclLinkError::Io { address, source: Arc::new(source) },
        ReadEnd::Refused(source) => GclLinkError::Session { address, source },
    };
    lock(&shared.state).ended.get_or_insert(error);
    let _ = shared.stream.shutdown(Shutdown::Both);
    shared.changed.notify_all();
}
