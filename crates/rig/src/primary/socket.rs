//! The primary interface on a socket: a thread of its own reads.

use super::message::{PrimaryEvent, RobotModeData};
use super::packet::{PrimaryStream, PrimaryStreamError};
use crate::stamped::{ReadEnd, Stamped, connect, lock, read_until_end};
use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// Events that wait to be read; later ones are lost, and counted.
const MOST_EVENTS: usize = 4096;

/// Why a connection was not made, or ended.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum PrimaryLinkError {
    /// The network.
    #[error("{address}: {source}")]
    Io {
        /// Where to.
        address: SocketAddr,
        /// What the system says.
        source: Arc<std::io::Error>,
    },
    /// What the controller sends.
    #[error("{address}: {source}")]
    Stream {
        /// Where to.
        address: SocketAddr,
        /// What is wrong.
        source: PrimaryStreamError,
    },
    /// The connection is closed.
    #[error("{address}: the connection to the primary interface is closed")]
    Closed {
        /// Where to.
        address: SocketAddr,
    },
}

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
    shared: Arc<Shared>,
    events: Receiver<Stamped<PrimaryEvent>>,
    reader: Option<JoinHandle<()>>,
}

struct Shared {
    address: SocketAddr,
    stream: TcpStream,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    mode: Option<Stamped<RobotModeData>>,
    skipped: u64,
    lost: u64,
    ended: Option<PrimaryLinkError>,
}

impl PrimaryClient {
    /// Connects. The first event is the version of the controller.
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, PrimaryLinkError> {
        let io = |source| PrimaryLinkError::Io { address, source: Arc::new(source) };
        let stream = connect(address, timeout).map_err(io)?;
        let shared = Arc::new(Shared { address, stream, state: Mutex::default() });
        let (tell, events) = sync_channel(MOST_EVENTS);
        let reading = shared.clone();
        let reader = std::thread::Builder::new().name("primary".into());
        let reader = reader.spawn(move || read_on(&reading, &tell)).map_err(io)?;
        Ok(Self { shared, events, reader: Some(reader) })
    }

    /// What the controller said, in its order; the mode of the robot only where it has changed. The end of the channel is the
    /// end of the connection.
    pub fn events(&self) -> &Receiver<Stamped<PrimaryEvent>> {
        &self.events
    }

    /// The newest state of the robot as a whole.
    pub fn newest_mode(&self) -> Option<Stamped<RobotModeData>> {
        lock(&self.shared.state).mode
    }

    /// Packets that nothing was read from.
    pub fn skipped(&self) -> u64 {
        lock(&self.shared.state).skipped
    }

    /// Events that nobody read in time.
    pub fn events_lost(&self) -> u64 {
        lock(&self.shared.state).lost
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<PrimaryLinkError> {
        lock(&self.shared.state).ended.clone()
    }

    /// Sends a program; a last line without an end gets one. It replaces the program that runs, unless it is a `sec`. Whether
    /// the controller takes it, the events tell: see the [module](super).
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
        (&self.shared.stream).write_all(&bytes).map_err(|source| {
            // Half a program is on its way: nothing may follow it.
            let _ = self.shared.stream.shutdown(Shutdown::Both);
            PrimaryLinkError::Io { address: self.shared.address, source: Arc::new(source) }.into()
        })
    }
}

impl Drop for PrimaryClient {
    fn drop(&mut self) {
        // Wakes the reader; a connection that is gone already is closed all the same.
        let _ = self.shared.stream.shutdown(Shutdown::Both);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

/// The reader's loop, until the connection ends.
fn read_on(shared: &Shared, tell: &SyncSender<Stamped<PrimaryEvent>>) {
    let mut primary = PrimaryStream::default();
    let end = read_until_end(&shared.stream, |bytes, at| {
        primary.push(bytes);
        loop {
            let next = primary.next_event();
            let mut state = lock(&shared.state);
            state.skipped = primary.skipped();
            let Some(event) = next? else { return Ok(()) };
            if let PrimaryEvent::RobotMode(mode) = event {
                let before = state.mode.replace(Stamped { at, event: mode });
                // The clock alone is no news.
                if before
                    .is_some_and(|b| RobotModeData { device_ticks: mode.device_ticks, ..b.event } == mode)
                {
                    continue;
                }
            }
            if let Err(TrySendError::Full(_)) = tell.try_send(Stamped { at, event }) {
                state.lost += 1;
            }
        }
    });
    let address = shared.address;
    lock(&shared.state).ended = Some(match end {
        ReadEnd::Closed => PrimaryLinkError::Closed { address },
        ReadEnd::Io(source) => PrimaryLinkError::Io { address, source: Arc::new(source) },
        ReadEnd::Refused(source) => PrimaryLinkError::Stream { address, source },
    });
    let _ = shared.stream.shutdown(Shutdown::Both);
}
