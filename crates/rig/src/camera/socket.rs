//! A camera on a socket: a thread of its own reads, so that the newest frame is never one that waited in a buffer.

use super::stream::{CameraFrame, CameraStream, CameraStreamError, stream_request};
use crate::stamped::{ReadEnd, Stamped, connect, lock, read_until_end};
use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Why a connection was not made, or ended.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum CameraLinkError {
    /// The network.
    #[error("{address}: {source}")]
    Io {
        /// Where to.
        address: SocketAddr,
        /// What the system says.
        source: Arc<std::io::Error>,
    },
    /// What the camera sends.
    #[error("{address}: {source}")]
    Stream {
        /// Where to.
        address: SocketAddr,
        /// What is wrong.
        source: CameraStreamError,
    },
    /// The connection is closed.
    #[error("{address}: the connection to the camera is closed")]
    Closed {
        /// Where to.
        address: SocketAddr,
    },
}

/// Why there is no frame.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum CameraWaitError {
    /// The camera has fallen silent.
    #[error("no new frame came within {limit_s:.3} s, the newest is {age_s:.3} s old")]
    Old {
        /// Time since the newest frame came.
        age_s: f64,
        /// The longest that was allowed for a new one.
        limit_s: f64,
    },
    /// The camera never sent a frame.
    #[error("no frame at all came within {limit_s:.3} s, {connected_s:.3} s after the connection was made")]
    None {
        /// Time since the connection was made.
        connected_s: f64,
        /// The longest that was allowed for a frame.
        limit_s: f64,
    },
    /// The connection ended.
    #[error(transparent)]
    Link(#[from] CameraLinkError),
}

/// A connected camera. One that falls silent stays connected. Dropping the client closes the connection.
pub struct CameraClient {
    shared: Arc<Shared>,
    connected: Instant,
    reader: Option<JoinHandle<()>>,
}

struct Shared {
    address: SocketAddr,
    stream: TcpStream,
    state: Mutex<State>,
    /// A frame, or the end.
    changed: Condvar,
}

#[derive(Default)]
struct State {
    newest: Option<Stamped<Arc<CameraFrame>>>,
    frames: u64,
    largest_gap: Duration,
    ended: Option<CameraLinkError>,
}

impl CameraClient {
    /// Connects and asks for the stream; `host_header` is the camera's name as HTTP wants it (`gsr15001.local:8080`). What the
    /// camera answers is known with the first frame, or from [`ended`](Self::ended).
    pub fn connect(
        address: SocketAddr,
        host_header: &str,
        timeout: Duration,
    ) -> Result<Self, CameraLinkError> {
        let io = |source| CameraLinkError::Io { address, source: Arc::new(source) };
        let stream = connect(address, timeout).map_err(io)?;
        (&stream).write_all(&stream_request(host_header)).map_err(io)?;
        let (state, changed) = (Mutex::default(), Condvar::new());
        let shared = Arc::new(Shared { address, stream, state, changed });
        let reading = shared.clone();
        let reader = std::thread::Builder::new().name("camera".into());
        let reader = reader.spawn(move || read_on(&reading)).map_err(io)?;
        Ok(Self { shared, connected: Instant::now(), reader: Some(reader) })
    }

    /// The newest frame, with its arrival.
    pub fn newest(&self) -> Option<Stamped<Arc<CameraFrame>>> {
        lock(&self.shared.state).newest.clone()
    }

    /// The first frame that arrives after `at`; where several have by now, the newest of them. An `at` that lies ahead is
    /// waited for.
    pub fn frame_after(
        &self,
        at: Instant,
        timeout: Duration,
    ) -> Result<Stamped<Arc<CameraFrame>>, CameraWaitError> {
        let started = Instant::now();
        let mut state = lock(&self.shared.state);
        loop {
            if let Some(frame) = state.newest.as_ref().filter(|frame| frame.at > at) {
                return Ok(frame.clone());
            }
            if let Some(ended) = &state.ended {
                return Err(ended.clone().into());
            }
            let left = timeout.checked_sub(started.elapsed()).filter(|left| !left.is_zero());
            let Some(left) = left else {
                let limit_s = timeout.as_secs_f64();
                let connected_s = self.connected.elapsed().as_secs_f64();
                return Err(match &state.newest {
                    Some(frame) => CameraWaitError::Old { age_s: frame.at.elapsed().as_secs_f64(), limit_s },
                    None => CameraWaitError::None { connected_s, limit_s },
                });
            };
            let changed = &self.shared.changed;
            state = changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Frames that have arrived.
    pub fn frames_seen(&self) -> u64 {
        lock(&self.shared.state).frames
    }

    /// The longest time between the arrivals of two frames, s; 0 before the second. The silence that lasts now is no gap yet:
    /// it is the age of the newest frame.
    pub fn largest_gap_s(&self) -> f64 {
        lock(&self.shared.state).largest_gap.as_secs_f64()
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<CameraLinkError> {
        lock(&self.shared.state).ended.clone()
    }
}

impl Drop for CameraClient {
    fn drop(&mut self) {
        // Wakes the reader; a connection that is gone already is closed all the same.
        let _ = self.shared.stream.shutdown(Shutdown::Both);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

impl State {
    fn take(&mut self, frame: CameraFrame, at: Instant) {
        if let Some(before) = &self.newest {
            self.largest_gap = self.largest_gap.max(at.duration_since(before.at));
        }
        self.frames += 1;
        self.newest = Some(Stamped { at, event: Arc::new(frame) });
    }
}

/// The reader's loop, until the connection ends.
fn read_on(shared: &Shared) {
    let mut camera = CameraStream::default();
    let end = read_until_end(&shared.stream, |bytes, at| {
        let frames = camera.receive(bytes)?;
        if !frames.is_empty() {
            let mut state = lock(&shared.state);
            frames.into_iter().for_each(|frame| state.take(frame, at));
            drop(state);
            shared.changed.notify_all();
        }
        Ok(())
    });
    let address = shared.address;
    lock(&shared.state).ended = Some(match end {
        ReadEnd::Closed => CameraLinkError::Closed { address },
        ReadEnd::Io(source) => CameraLinkError::Io { address, source: Arc::new(source) },
        ReadEnd::Refused(source) => CameraLinkError::Stream { address, source },
    });
    let _ = shared.stream.shutdown(Shutdown::Both);
    shared.changed.notify_all();
}
