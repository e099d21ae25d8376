//! The session of a client, without a socket: a greeting, then one line for each command, in their order.

use super::command::DashboardCommand;
use std::collections::VecDeque;

/// How the first line begins.
pub const GREETING: &str = "Connected: Universal Robots Dashboard Server";
/// Longest line of a controller; a path of a program is the longest thing it says.
const MAX_LINE: usize = 4096;
/// Commands that wait for their answers.
const MAX_OUTSTANDING: usize = 16;

/// What the controller said.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum DashboardEvent {
    /// The first line: commands are heard.
    Greeting(String),
    /// The answer to a command.
    Reply {
        /// The number that [`DashboardLink::send`] gave.
        number: u64,
        /// The command.
        command: DashboardCommand,
        /// The answer: [`DashboardCommand::reply`] reads it.
        line: String,
    },
    /// A line that answers nothing.
    Unasked(String),
}

/// Why a session ended. The connection has to be made anew.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DashboardSessionError {
    /// Another server.
    #[error("the first line is `{line}`, a dashboard server says `{GREETING}`")]
    Greeting {
        /// What it says.
        line: String,
    },
    /// A line without an end.
    #[error("a line of {bytes} bytes, at most {MAX_LINE} are read")]
    Line {
        /// Its bytes so far.
        bytes: usize,
    },
}

/// Why a command was not sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DashboardSendError {
    /// Too many wait for their answers.
    #[error(
        "`{asked}` has to wait: {outstanding} commands have no answer yet, at most {MAX_OUTSTANDING} may"
    )]
    Outstanding {
        /// What was asked.
        asked: &'static str,
        /// How many wait.
        outstanding: usize,
    },
}

/// A session under way.
#[derive(Debug, Clone, Default)]
pub struct DashboardLink {
    incoming: Vec<u8>,
    outgoing: Vec<u8>,
    greeted: bool,
    /// Commands without an answer, the oldest first.
    outstanding: VecDeque<(u64, DashboardCommand)>,
    sent: u64,
}

impl DashboardLink {
    /// Sends a command and gives its number: the first is 0. Commands may be sent before the greeting.
    ///
    /// # Errors
    ///
    /// Too many commands without an answer.
    pub fn send(&mut self, command: DashboardCommand) -> Result<u64, DashboardSendError> {
        let asked = command.line();
        let outstanding = self.outstanding.len();
        if outstanding == MAX_OUTSTANDING {
            return Err(DashboardSendError::Outstanding { asked, outstanding });
        }
        self.outgoing.extend(asked.bytes());
        self.outgoing.push(b'\n');
        let number = self.sent;
        self.outstanding.push_back((number, command));
        self.sent += 1;
        Ok(number)
    }

    /// Bytes to send; nothing the second time.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    /// Commands that have no answer yet.
    pub fn outstanding(&self) -> usize {
        self.outstanding.len()
    }

    /// Takes in what came from the wire; [`next_event`](Self::next_event) reads it.
    pub fn push(&mut self, bytes: &[u8]) {
        self.incoming.extend_from_slice(bytes);
    }

    /// The next event, if its line is whole. After an error nothing else comes.
    ///
    /// # Errors
    ///
    /// A greeting of something else, or a line that is too long.
    pub fn next_event(&mut self) -> Result<Option<DashboardEvent>, DashboardSessionError> {
        loop {
            let end = self.incoming.iter().take(MAX_LINE + 1).position(|&b| b == b'\n');
            let Some(end) = end else {
                let bytes = self.incoming.len().min(MAX_LINE + 1);
                return if bytes > MAX_LINE { Err(DashboardSessionError::Line { bytes }) } else { Ok(None) };
            };
            let line = String::from_utf8_lossy(&self.incoming[..end]).trim().to_string();
            if !line.is_empty() && !self.greeted && !line.starts_with(GREETING) {
                return Err(DashboardSessionError::Greeting { line });
            }
            self.incoming.drain(..=end);
            if !line.is_empty() {
                return Ok(Some(self.event_of(line)));
            }
        }
    }

    fn event_of(&mut self, line: String) -> DashboardEvent {
        if !self.greeted {
            self.greeted = true;
            return DashboardEvent::Greeting(line);
        }
        match self.outstanding.pop_front() {
            Some((number, command)) => DashboardEvent::Reply { number, command, line },
            None => DashboardEvent::Unasked(line),
        }
    }
}
