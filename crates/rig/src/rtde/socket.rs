//! The session on a socket: a thread of its own reads, so that nobody else ever waits for the robot.

use super::session::{Event, Link, SessionError, SessionPlan, WriteInputError};
use super::value::Value;
use super::{Recipe, RecipeError};
use crate::stamped::{Stamped, lock};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A controller that says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(1);
/// Attempts to get inputs that an old connection may still have, and the pause between them.
const IN_USE_ATTEMPTS: usize = 4;
const IN_USE_PAUSE: Duration = Duration::from_millis(500);
/// Time between two looks at whether the client is still wanted.
const LOOK: Duration = Duration::from_millis(50);

/// Why a connection was not made, or ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The network.
    #[error("{address}: {source}")]
    Io {
        /// Where to.
        address: SocketAddr,
        /// What the system says.
        source: std::io::Error,
    },
    /// The protocol.
    #[error("{address}: {source}")]
    Session {
        /// Where to.
        address: SocketAddr,
        /// What is wrong.
        source: SessionError,
    },
    /// The controller closed the connection.
    #[error("{address}: the controller closed the connection")]
    Closed {
        /// Where to.
        address: SocketAddr,
    },
    /// The controller says nothing.
    #[error("{address}: nothing came for {silent_s:.1} s")]
    Silent {
        /// Where to.
        address: SocketAddr,
        /// For how long.
        silent_s: f64,
    },
}

/// A connected client. Events come in their order through [`events`](Self::events), the newest values also through
/// [`newest`](Self::newest). Dropping it closes the connection.
pub struct RtdeClient {
    shared: Arc<Shared>,
    stream: TcpStream,
    address: SocketAddr,
    recipe: Recipe,
    events: Receiver<Stamped<Event>>,
    reader: Option<JoinHandle<()>>,
}

struct Shared {
    link: Mutex<Link>,
    newest: Mutex<Option<Vec<Value>>>,
    ended: Mutex<Option<LinkError>>,
    wanted: Mutex<bool>,
}

impl RtdeClient {
    /// Connects, sets up all recipes and starts. Inputs that another connection has are tried a few times: an old
    /// connection of a client that died lingers.
    pub fn connect(address: SocketAddr, plan: &SessionPlan, timeout: Duration) -> Result<Self, LinkError> {
        for attempt in 1.. {
            match Self::connect_once(address, plan, timeout) {
                Err(LinkError::Session {
                    source: SessionError::Recipe(RecipeError::InUse { .. }), ..
                }) if attempt < IN_USE_ATTEMPTS => {
                    std::thread::sleep(IN_USE_PAUSE);
                }
                other => return other,
            }
        }
        unreachable!("the last attempt returns")
    }

    fn connect_once(address: SocketAddr, plan: &SessionPlan, timeout: Duration) -> Result<Self, LinkError> {
        let io = |source| LinkError::Io { address, source };
        let session = |source| LinkError::Session { address, source };
        let deadline = Instant::now() + timeout;
        let mut stream = TcpStream::connect_timeout(&address, timeout).map_err(io)?;
        stream.set_nodelay(true).map_err(io)?;
        stream.set_read_timeout(Some(LOOK)).map_err(io)?;
        stream.set_write_timeout(Some(SILENCE)).map_err(io)?;
        let mut link = Link::new(plan.clone()).map_err(session)?;
        let (tell, events) = channel();
        let mut newest = None;
        let mut buffer = [0; 8192];
        while !link.is_running() {
            stream.write_all(&link.take_outgoing()).map_err(io)?;
            let n = match stream.read(&mut buffer) {
                Ok(0) => return Err(LinkError::Closed { address }),
                Ok(n) => n,
                Err(e) if would_block(&e) => {
                    if Instant::now() > deadline {
                        return Err(LinkError::Silent { address, silent_s: timeout.as_secs_f64() });
                    }
                    continue;
                }
                Err(e) => return Err(io(e)),
            };
            for event in link.receive(&buffer[..n]).map_err(session)? {
                keep_newest(&event, &mut newest);
                let _ = tell.send(Stamped { at: Instant::now(), event });
            }
        }
        let recipe = link.output().cloned().expect("a session that runs has its outputs");
        let shared = Arc::new(Shared {
            link: Mutex::new(link),
            newest: Mutex::new(newest),
            ended: Mutex::new(None),
            wanted: Mutex::new(true),
        });
        let (reading, own) = (shared.clone(), stream.try_clone().map_err(io)?);
        let reader = std::thread::Builder::new().name("rtde".into());
        let reader = reader.spawn(move || read_on(&reading, own, address, &tell)).map_err(io)?;
        Ok(Self { shared, stream, address, recipe, events, reader: Some(reader) })
    }

    /// Names and types of the values.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// What happened, in its order; the end of the channel is the end of the connection.
    pub fn events(&self) -> &Receiver<Stamped<Event>> {
        &self.events
    }

    /// The newest values, for control: never older than what has arrived.
    pub fn newest(&self) -> Option<Vec<Value>> {
        lock(&self.shared.newest).clone()
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<LinkError> {
        lock(&self.shared.ended).take()
    }

    /// Writes the values of an input recipe at once.
    pub fn write_input(&self, recipe: usize, values: &[Value]) -> Result<(), WriteError> {
        write_input(&self.shared, &self.stream, self.address, recipe, values)
    }

    /// A second hand that writes inputs: for a heartbeat, in a thread of its own.
    pub fn writer(&self) -> Result<RtdeWriter, LinkError> {
        let address = self.address;
        let stream = self.stream.try_clone().map_err(|source| LinkError::Io { address, source })?;
        Ok(RtdeWriter { shared: self.shared.clone(), stream, address })
    }
}

/// Writes inputs of a client's connection. It does not keep the connection open.
pub struct RtdeWriter {
    shared: Arc<Shared>,
    stream: TcpStream,
    address: SocketAddr,
}

impl RtdeWriter {
    /// Writes the values of an input recipe at once.
    pub fn write_input(&self, recipe: usize, values: &[Value]) -> Result<(), WriteError> {
        write_input(&self.shared, &self.stream, self.address, recipe, values)
    }
}

fn write_input(
    shared: &Shared,
    mut stream: &TcpStream,
    address: SocketAddr,
    recipe: usize,
    values: &[Value],
) -> Result<(), WriteError> {
    // The lock is kept over the write: two hands never mix their frames.
    let mut link = lock(&shared.link);
    link.write_input(recipe, values)?;
    let outgoing = link.take_outgoing();
    stream.write_all(&outgoing).map_err(|source| LinkError::Io { address, source })?;
    Ok(())
}

/// Why inputs were not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The values.
    #[error(transparent)]
    Values(#[from] WriteInputError),
    /// The connection.
    #[error(transparent)]
    Link(#[from] LinkError),
}

impl Drop for RtdeClient {
    fn drop(&mut self) {
        *lock(&self.shared.wanted) = false;
        // Wakes the reader; a connection that is gone already is closed all the same.
        let _ = self.stream.shutdown(std::net::Shutdown::Both);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

fn would_block(e: &std::io::Error) -> bool {
    matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

fn keep_newest(event: &Event, newest: &mut Option<Vec<Value>>) {
    if let Event::Data(values) = event {
        *newest = Some(values.clone());
    }
}

/// The reader's loop, until the connection ends or nobody wants it any more.
fn read_on(shared: &Shared, mut stream: TcpStream, address: SocketAddr, tell: &Sender<Stamped<Event>>) {
    let mut buffer = [0; 65_536];
    let mut heard = Instant::now();
    let end = loop {
        let read = stream.read(&mut buffer);
        if !*lock(&shared.wanted) {
            return;
        }
        match read {
            Ok(0) => break LinkError::Closed { address },
            Ok(n) => {
                heard = Instant::now();
                let events = match lock(&shared.link).receive(&buffer[..n]) {
                    Ok(events) => events,
                    Err(source) => break LinkError::Session { address, source },
                };
                for event in events {
                    keep_newest(&event, &mut lock(&shared.newest));
                    // Nobody reads the log: the newest values are still there.
                    let _ = tell.send(Stamped { at: heard, event });
                }
            }
            Err(e) if would_block(&e) => {
                if heard.elapsed() > SILENCE {
                    break LinkError::Silent { address, silent_s: heard.elapsed().as_secs_f64() };
                }
            }
            Err(source) => break LinkError::Io { address, source },
        }
    };
    *lock(&shared.ended) = Some(end);
}
