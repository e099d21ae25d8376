//! The session on a socket: a thread of its own reads, so that nobody else ever waits for the robot.

use super::session::{Event, Link, SessionError, SessionPlan, WriteInputError};
use super::value::Value;
use super::{Recipe, RecipeError};
use crate::link::{Connection, Reading, Shared, Socket, Stamped, lock, time_left};
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A controller that says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(1);
/// Attempts to get inputs that an old connection may still have, and the pause between them.
const IN_USE_ATTEMPTS: usize = 4;
const IN_USE_PAUSE: Duration = Duration::from_millis(500);
/// A robot that is not heard any more may still hear that it has to stop: the end of reading leaves the way out open.
const READING: Reading = Reading { thread: "rtde", silence: Some(SILENCE), cut_at_end: false };

/// Why a connection to a controller was not made, or ended.
pub type LinkError = crate::link::LinkError<SessionError>;

/// A connected client. Events come in their order through [`events`](Self::events), the newest values also through
/// [`newest`](Self::newest). Dropping it closes the connection.
pub struct RtdeClient {
    connection: Connection<Newest, SessionError>,
    session: Arc<Mutex<Link>>,
    recipe: Recipe,
    events: Receiver<Stamped<Event>>,
}

/// The newest values, apart from the session: whoever asks for them never waits for a write.
type Newest = Option<Vec<Value>>;

impl RtdeClient {
    /// Connects, sets up all recipes and starts. Inputs that another connection has are tried a few times: an old
    /// connection of a client that died lingers.
    ///
    /// # Errors
    ///
    /// No connection, no answer within the timeout, or what [`Link::receive`] refuses.
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
        let began = Instant::now();
        let socket = Socket::connect(address, timeout, "the controller closed the connection")?;
        let mut session = Link::new(plan.clone()).map_err(|e| socket.refused(e))?;
        let (tell, events) = channel();
        let mut newest = None;
        let mut buffer = [0; 8192];
        let mut is_silent = true;
        while !session.is_running() {
            socket.write(&session.take_outgoing())?;
            // By the clock: data may flow while an answer is missing.
            let Some(left) = time_left(began, timeout) else {
                return Err(match is_silent {
                    true => socket.silent(began, timeout),
                    false => socket.no_answer(session.asked(), began, timeout),
                });
            };
            socket.limit_read(left)?;
            let Some(n) = socket.read(&mut buffer)? else { continue };
            is_silent = false;
            for event in session.receive(&buffer[..n]).map_err(|e| socket.refused(e))? {
                keep_newest(&event, &mut newest);
                let _ = tell.send(Stamped { at: Instant::now(), event });
            }
        }
        let recipe = session.output().cloned().expect("a session that runs has its outputs");
        let session = Arc::new(Mutex::new(session));
        let reading = session.clone();
        let connection = Connection::start(socket, READING, newest, move |shared, bytes, at| {
            let events = lock(&reading).receive(bytes)?;
            for event in events {
                keep_newest(&event, &mut shared.known().state);
                // Nobody reads the log: the newest values are still there.
                let _ = tell.send(Stamped { at, event });
            }
            Ok(())
        })?;
        Ok(Self { connection, session, recipe, events })
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
        self.connection.shared.known().state.clone()
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<LinkError> {
        self.connection.shared.known().ended.clone()
    }

    /// Writes the values of an input recipe at once.
    ///
    /// # Errors
    ///
    /// As [`Link::write_input`], or a connection that ended.
    pub fn write_input(&self, recipe: usize, values: &[Value]) -> Result<(), WriteError> {
        self.writer().write_input(recipe, values)
    }

    /// A second hand that writes inputs: for a heartbeat, in a thread of its own.
    pub fn writer(&self) -> RtdeWriter {
        RtdeWriter { shared: self.connection.shared.clone(), session: self.session.clone() }
    }
}

/// Writes inputs of a client's connection. It does not keep the connection open.
pub struct RtdeWriter {
    shared: Arc<Shared<Newest, SessionError>>,
    session: Arc<Mutex<Link>>,
}

impl RtdeWriter {
    /// Writes the values of an input recipe at once.
    ///
    /// # Errors
    ///
    /// As [`RtdeClient::write_input`].
    pub fn write_input(&self, recipe: usize, values: &[Value]) -> Result<(), WriteError> {
        // The lock is kept over the write: two hands never mix their frames.
        let mut session = lock(&self.session);
        session.write_input(recipe, values)?;
        self.shared.socket.write(&session.take_outgoing())?;
        Ok(())
    }
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

fn keep_newest(event: &Event, newest: &mut Option<Vec<Value>>) {
    if let Event::Data(values) = event {
        *newest = Some(values.clone());
    }
}
