//! The session on a socket: the caller waits for each answer, a controller gives them at once. No thread reads: what
//! comes unasked matters to nobody, and a stop must not depend on one.

use super::command::{DashboardCommand, DashboardReply, DashboardReplyError};
use super::session::{DashboardEvent, DashboardLink, DashboardSendError, DashboardSessionError};
use crate::link::{LinkError, Socket, time_left};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

/// Why a connection to a dashboard was not made, or ended.
pub type DashboardLinkError = LinkError<DashboardSessionError>;

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
    socket: Socket<DashboardSessionError>,
    link: DashboardLink,
    greeting: String,
}

impl DashboardClient {
    /// Connects and waits for the greeting, each for at most `timeout`.
    ///
    /// # Errors
    ///
    /// No connection, or no greeting of a dashboard server.
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, DashboardLinkError> {
        let socket = Socket::connect(address, timeout, "the connection to the dashboard is closed")?;
        let mut client = Self { socket, link: DashboardLink::default(), greeting: String::new() };
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
    ///
    /// # Errors
    ///
    /// As [`Self::command_line`], or an answer that is none to this command.
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
    ///
    /// # Errors
    ///
    /// A command that may not be sent, a connection that ended, or no answer within the timeout.
    pub fn command_line(
        &mut self,
        command: DashboardCommand,
        timeout: Duration,
    ) -> Result<String, DashboardError> {
        let sent = self.link.send(command)?;
        self.socket.write(&self.link.take_outgoing())?;
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
        let started = Instant::now();
        let mut buffer = [0; 4096];
        loop {
            while let Some(event) = self.link.next_event().map_err(|e| self.socket.refused(e))? {
                if let Some(found) = wanted(event) {
                    return Ok(found);
                }
            }
            let Some(left) = time_left(started, timeout) else {
                return Err(self.socket.no_answer(awaited, started, timeout));
            };
            self.socket.limit_read(left)?;
            if let Some(n) = self.socket.read(&mut buffer)? {
                self.link.push(&buffer[..n]);
            }
        }
    }
}
