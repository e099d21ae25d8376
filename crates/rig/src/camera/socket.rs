//! A camera on a socket: a thread of its own reads, so that the newest frame is never one that waited in a buffer.

use super::stream::{CameraFrame, CameraStream, CameraStreamError, stream_request};
use crate::link::{Connection, LinkError, Reading, Socket, Stamped};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

const READING: Reading = Reading { thread: "camera", silence: None, cut_at_end: true };

/// Why a connection to a camera was not made, or ended.
pub type CameraLinkError = LinkError<CameraStreamError>;

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
    connection: Connection<State, CameraStreamError>,
    connected: Instant,
}

#[derive(Default)]
struct State {
    newest: Option<Stamped<Arc<CameraFrame>>>,
    frames: u64,
}

impl CameraClient {
    /// Connects and asks for the stream; `host_header` is the camera's name as HTTP wants it (`gsr15001.local:8080`). What the
    /// camera answers is known with the first frame, or from [`ended`](Self::ended).
    ///
    /// # Errors
    ///
    /// No connection, or an answer that is no stream of frames.
    pub fn connect(
        address: SocketAddr,
        host_header: &str,
        timeout: Duration,
    ) -> Result<Self, CameraLinkError> {
        let socket = Socket::connect(address, timeout, "the connection to the camera is closed")?;
        socket.write(&stream_request(host_header))?;
        let mut camera = CameraStream::default();
        let connection = Connection::start(socket, READING, State::default(), move |shared, bytes, at| {
            let frames = camera.receive(bytes)?;
            if !frames.is_empty() {
                let mut known = shared.known();
                frames.into_iter().for_each(|frame| known.state.take(frame, at));
                drop(known);
                shared.notify();
            }
            Ok(())
        })?;
        Ok(Self { connection, connected: Instant::now() })
    }

    /// The newest frame, with its arrival.
    pub fn newest(&self) -> Option<Stamped<Arc<CameraFrame>>> {
        self.connection.shared.known().state.newest.clone()
    }

    /// The first frame that arrives after `at`; where several have by now, the newest of them. An `at` that lies ahead is
    /// waited for.
    ///
    /// # Errors
    ///
    /// No frame after that time came within the timeout, or the connection ended.
    pub fn frame_after(
        &self,
        at: Instant,
        timeout: Duration,
    ) -> Result<Stamped<Arc<CameraFrame>>, CameraWaitError> {
        let limit_s = timeout.as_secs_f64();
        self.connection.shared.wait(
            timeout,
            |state| state.newest.clone().filter(|frame| frame.at > at).map(Ok),
            |state, _| match &state.newest {
                Some(frame) => CameraWaitError::Old { age_s: frame.at.elapsed().as_secs_f64(), limit_s },
                None => {
                    CameraWaitError::None { connected_s: self.connected.elapsed().as_secs_f64(), limit_s }
                }
            },
        )
    }

    /// Frames that have arrived.
    pub fn frames_seen(&self) -> u64 {
        self.connection.shared.known().state.frames
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<CameraLinkError> {
        self.connection.shared.known().ended.clone()
    }
}

impl State {
    fn take(&mut self, frame: CameraFrame, at: Instant) {
        self.frames += 1;
        self.newest = Some(Stamped { at, event: Arc::new(frame) });
    }
}
