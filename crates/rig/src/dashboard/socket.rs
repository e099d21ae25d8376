//! The session on a socket: the caller waits for each answer, a controller gives them at once.

use super::command::{DashboardCommand, DashboardReply, DashboardReplyError};
use super::session::{DashboardEvent, DashboardLink, DashboardSendError, DashboardSessionError};
use crate::stamped::connect;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Why a connection was not made, or ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DashboardLinkError {
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
        source: DashboardSessionError,
    },
    /// The connection is closed.
    #[error("{address}: the connection to the dashboard is closed")]
    Closed {
        /// Where to.
        address: SocketAddr,
    },
    /// The controller says nothing.
    #[error("{address}: no answer to `{awaited}` came for {waited_s:.3} s, {limit_s:.3} s are allowed")]
    Timeout {
        /// Where to.
        address: SocketAddr,
        /// What was to be answered.
        awaited: &'static str,
        /// For how long.
        waited_s: f64,
        /// The longest that was allowed.
        limit_s: f64,
    },
}

/// Why a command was not done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DashboardError {
    /// It was not sent.
    #[error(transparent)]
    Send(#[from] DashboardSendError),
    /// The connection.
    #[error(transparent)]
    Link(#[from] DashboardLinkError),
    /// The controller refuses.
    #[error(transparent)]
    Reply(#[from] DashboardReplyError),
}

/// A connected client. Dropping it closes the connection.
pub struct DashboardClient {
    address: SocketAddr,
    stream: TcpStream,
    link: DashboardLink,
    greeting: String,
}

impl DashboardClient {
    /// Connects and waits for the greeting, each for at most `timeout`.
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, DashboardLinkError> {
        let stream =
            connect(address, timeout).map_err(|source| DashboardLinkError::Io { address, source })?;
        let mut client = Self { address, stream, link: DashboardLink::default(), greeting: String::new() };
        client.greeting = client.wait("the connection", timeout, |event| match event {
            DashboardEvent::Greeting(line) => Some(line),
            _ => None,
        })?;
        Ok(client)
    }

    /// The first line of the controller.
    pub fn greeting(&self) -> &str {
        &self.greeting
    }

    /// Sends a command and reads its answer.
    pub fn command(
        &mut self,
        command: DashboardCommand,
        timeout: Duration,
    ) -> Result<DashboardReply, DashboardError> {
        let line = self.command_line(command, timeout)?;
        Ok(command.reply(&line)?)
    }

    /// Sends a command and gives its answer as it came. An answer that comes after its time is known for what it is: it is
    /// never taken for that of a later command.
    pub fn command_line(
        &mut self,
        command: DashboardCommand,
        timeout: Duration,
    ) -> Result<String, DashboardError> {
        let address = self.address;
        let sent = self.link.send(command)?;
        let outgoing = self.link.take_outgoing();
        self.stream.write_all(&outgoing).map_err(|source| DashboardLinkError::Io { address, source })?;
        let line = self.wait(command.line(), timeout, |event| match event {
            DashboardEvent::Reply { number, line, .. } if number == sent => Some(line),
            _ => None,
        })?;
        Ok(line)
    }

    /// Reads until `wanted` finds what it looks for.
    fn wait(
        &mut self,
        awaited: &'static str,
        timeout: Duration,
        wanted: impl Fn(DashboardEvent) -> Option<String>,
    ) -> Result<String, DashboardLinkError> {
        let (address, started) = (self.address, Instant::now());
        let io = |source| DashboardLinkError::Io { address, source };
        let mut buffer = [0; 4096];
        loop {
            let session = |source| DashboardLinkError::Session { address, source };
            while let Some(event) = self.link.next_event().map_err(session)? {
                if let Some(found) = wanted(event) {
                    return Ok(found);
                }
            }
            let waited = started.elapsed();
            let Some(left) = timeout.checked_sub(waited).filter(|left| !left.is_zero()) else {
                let (waited_s, limit_s) = (waited.as_secs_f64(), timeout.as_secs_f64());
                return Err(DashboardLinkError::Timeout { address, awaited, waited_s, limit_s });
            };
            self.stream.set_read_timeout(Some(left)).map_err(io)?;
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(DashboardLinkError::Closed { address }),
                Ok(n) => self.link.push(&buffer[..n]),
                // The time is looked at above.
                Err(e) if is_pause(&e) => {}
                Err(e) => return Err(io(e)),
            }
        }
    }
}

fn is_pause(e: &std::io::Error) -> bool {
    matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
