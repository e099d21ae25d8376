//! The primary interface on a socket: a thread of its own reads.

use super::message::{PrimaryEvent, RobotModeData};
use super::packet::{PrimaryStream, PrimaryStreamError};
use crate::link::{Connection, LinkError, Reading, Socket, Stamped};
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::time::{Duration, Instant};

/// Events that wait to be read; later ones are lost, and counted.
const MAX_EVENTS: usize = 4096;

const READING: Reading = Reading { thread: "primary", silence: None, cut_at_end: true };

/// Why a connection to the primary interface was not made, or ended.
pub type PrimaryLinkError = LinkError<PrimaryStreamError>;

/// Why a program was not sent.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// Nothing to run.
    #[error("the program is empty")]
    Empty,
    /// A zero, at which the controller would stop reading.
    #[error("the program has a zero byte at byte {at} of {bytes}")]
    Zero {
        /// Its place, from 0.
        at: usize,
        /// Length of the program.
        bytes: usize,
    },
    /// The connection.
    #[error(transparent)]
    Link(#[from] PrimaryLinkError),
}

/// A connected client. Dropping it closes the connection; a program that runs goes on.
pub struct PrimaryClient {
    connection: Connection<State, PrimaryStreamError>,
    events: Receiver<Stamped<PrimaryEvent>>,
}

#[derive(Default)]
struct State {
    mode: Option<Stamped<RobotModeData>>,
    skipped: u64,
    lost: u64,
}

impl PrimaryClient {
    /// Connects. The first event is the version of the controller.
    ///
    /// # Errors
    ///
    /// No connection, or nothing within the timeout.
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, PrimaryLinkError> {
        let socket = Socket::connect(address, timeout, "the connection to the primary interface is closed")?;
        let (tell, events) = sync_channel(MAX_EVENTS);
        let mut primary = PrimaryStream::default();
        let connection = Connection::start(socket, READING, State::default(), move |shared, bytes, at| {
            primary.push(bytes);
            loop {
                let next = primary.next_event();
                let state = &mut shared.known().state;
                state.skipped = primary.skipped();
                let Some(event) = next? else { return Ok(()) };
                if state.is_news(&event, at)
                    && let Err(TrySendError::Full(_)) = tell.try_send(Stamped { at, event })
                {
                    state.lost += 1;
                }
            }
        })?;
        Ok(Self { connection, events })
    }

    /// What the controller said, in its order; the mode of the robot only where it has changed. The end of the channel is the
    /// end of the connection.
    pub fn events(&self) -> &Receiver<Stamped<PrimaryEvent>> {
        &self.events
    }

    /// The newest state of the robot as a whole.
    pub fn newest_mode(&self) -> Option<Stamped<RobotModeData>> {
        self.connection.shared.known().state.mode
    }

    /// Packets that nothing was read from.
    pub fn skipped(&self) -> u64 {
        self.connection.shared.known().state.skipped
    }

    /// Events that nobody read in time.
    pub fn events_lost(&self) -> u64 {
        self.connection.shared.known().state.lost
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<PrimaryLinkError> {
        self.connection.shared.known().ended.clone()
    }

    /// Sends a program; a last line without an end gets one. It replaces the program that runs, unless it is a `sec`. Whether
    /// the controller takes it, the events tell: see the [module](super).
    ///
    /// # Errors
    ///
    /// A program that is empty or holds a zero byte, or a connection that ended.
    pub fn send_script(&mut self, text: &str) -> Result<(), ScriptError> {
        if text.trim().is_empty() {
            return Err(ScriptError::Empty);
        }
        if let Some(at) = text.bytes().position(|b| b == 0) {
            return Err(ScriptError::Zero { at, bytes: text.len() });
        }
        if let Some(ended) = self.ended() {
            return Err(ended.into());
        }
        let mut bytes = text.as_bytes().to_vec();
        if !text.ends_with('\n') {
            bytes.push(b'\n');
        }
        let socket = &self.connection.shared.socket;
        // Half a program may be on its way: nothing may follow it.
        socket.write(&bytes).inspect_err(|_| socket.cut())?;
        Ok(())
    }
}

impl State {
    /// Keeps the mode of the robot; its clock alone is no news.
    fn is_news(&mut self, event: &PrimaryEvent, at: Instant) -> bool {
        let PrimaryEvent::RobotMode(mode) = *event else { return true };
        let before = self.mode.replace(Stamped { at, event: mode });
        !before.is_some_and(|b| RobotModeData { device_ticks: mode.device_ticks, ..b.event } == mode)
    }
}
