//! The session of a client: lines in any pieces, answers routed to what was asked.

use super::command::{GclCommand, GclLimits, LimitError};

/// Longest line of a device; its own are below a hundred bytes.
const MAX_LINE: usize = 1024;

/// What the gripper said.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum GclEvent {
    /// A command was taken.
    Acknowledged(String),
    /// A motion is done.
    Finished(String),
    /// A value that was asked for or set.
    Value {
        /// Its name.
        name: String,
        /// Its number; forces are sums of both jaws.
        number: f64,
    },
    /// A value that the device sends by itself (`@`).
    Streamed {
        /// Its name.
        name: String,
        /// Its number.
        number: f64,
    },
    /// A command failed.
    Failed {
        /// Which, where the device says so.
        command: String,
        /// The status: [`status_meaning`].
        status: Option<u32>,
        /// The whole line.
        line: String,
    },
    /// Something else.
    Other(String),
}

/// Why a session ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a line of more than {MAX_LINE} bytes without an end: this is no gripper")]
pub struct GclSessionError;

/// Why a command was not sent.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// Beyond the limits.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The jaws still move.
    #[error("{asked} has to wait: {moving} is not finished")]
    Moving {
        /// What was asked.
        asked: &'static str,
        /// What moves.
        moving: &'static str,
    },
    /// A part is held: it has to be released before the next grip.
    #[error("the gripper holds: RELEASE comes before the next GRIP")]
    Holding,
    /// Nothing is sent after the goodbye.
    #[error("{asked} after BYE")]
    Closed {
        /// What was asked.
        asked: &'static str,
    },
}

/// A session under way.
#[derive(Debug, Clone)]
pub struct GclLink {
    limits: GclLimits,
    incoming: Vec<u8>,
    outgoing: Vec<u8>,
    moving: Option<&'static str>,
    holding: bool,
    closed: bool,
}

impl GclLink {
    /// A session with a device of these limits.
    pub fn new(limits: GclLimits) -> Self {
        let (incoming, outgoing) = (Vec::new(), Vec::new());
        Self { limits, incoming, outgoing, moving: None, holding: false, closed: false }
    }

    /// Bytes to send; nothing the second time.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    /// The motion under way.
    pub fn moving(&self) -> Option<&'static str> {
        self.moving
    }

    /// Sends a command, if it is allowed now. A fast stop always is.
    ///
    /// # Errors
    ///
    /// A command beyond the limits, one before the last has ended, a grip of jaws that hold, or one after `BYE`.
    pub fn send(&mut self, command: &GclCommand) -> Result<(), SendError> {
        let asked = command.name();
        if self.closed {
            return Err(SendError::Closed { asked });
        }
        if command.moves() {
            if let Some(moving) = self.moving {
                return Err(SendError::Moving { asked, moving });
            }
            if self.holding && matches!(command, GclCommand::Grip { .. }) {
                return Err(SendError::Holding);
            }
        }
        let line = command.line(&self.limits)?;
        self.outgoing.extend(line.bytes());
        if command.moves() {
            self.moving = Some(asked);
        }
        match command {
            // What was under way never finishes.
            GclCommand::FastStop => (self.moving, self.holding) = (None, false),
            GclCommand::Bye => self.closed = true,
            _ => {}
        }
        Ok(())
    }

    /// Takes in what came from the wire.
    ///
    /// # Errors
    ///
    /// A line without an end.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<GclEvent>, GclSessionError> {
        self.incoming.extend_from_slice(bytes);
        let mut events = Vec::new();
        let mut start = 0;
        while let Some(end) = self.incoming[start..].iter().position(|&b| b == b'\n') {
            if end > MAX_LINE {
                return Err(GclSessionError);
            }
            let line = String::from_utf8_lossy(&self.incoming[start..start + end]).trim().to_string();
            start += end + 1;
            if !line.is_empty() {
                let event = event_of(line.clone()).unwrap_or(GclEvent::Other(line));
                self.follow(&event);
                events.push(event);
            }
        }
        self.incoming.drain(..start);
        if self.incoming.len() > MAX_LINE {
            return Err(GclSessionError);
        }
        Ok(events)
    }

    /// Keeps track of what moves and what is held.
    fn follow(&mut self, event: &GclEvent) {
        match event {
            GclEvent::Finished(name) if self.moving == Some(name.as_str()) => {
                self.moving = None;
                self.holding = name == "GRIP";
            }
            GclEvent::Failed { command, .. }
                if self.moving.is_some_and(|m| command.is_empty() || m == command) =>
            {
                // A failed grip has closed on something or nothing: it is released like one that holds.
                self.holding = self.moving == Some("GRIP");
                self.moving = None;
            }
            _ => {}
        }
    }
}

/// What a line says; `None` where it is nothing that a gripper says.
pub(super) fn event_of(line: String) -> Option<GclEvent> {
    let mut words = line.split_whitespace();
    match words.next() {
        Some("ACK") => Some(GclEvent::Acknowledged(words.next().unwrap_or_default().into())),
        Some("FIN") => Some(GclEvent::Finished(words.next().unwrap_or_default().into())),
        Some("ERR") => {
            let rest: Vec<&str> = words.collect();
            let status = rest.iter().find_map(|w| w.parse().ok());
            let command = rest.first().filter(|w| w.parse::<u32>().is_err()).map_or("", |w| *w);
            Some(GclEvent::Failed { command: command.into(), status, line })
        }
        _ => value_of(&line),
    }
}

fn value_of(line: &str) -> Option<GclEvent> {
    let (streamed, rest) = match line.strip_prefix('@') {
        Some(rest) => (true, rest),
        None => (false, line),
    };
    let (name, number) = rest.split_once('=')?;
    let number: f64 = number.trim().parse().ok().filter(|x: &f64| x.is_finite())?;
    let name = name.trim().to_string();
    Some(if streamed { GclEvent::Streamed { name, number } } else { GclEvent::Value { name, number } })
}

/// What a status of the device means.
pub fn status_meaning(status: u32) -> &'static str {
    const MEANINGS: [&str; 31] = [
        "success",
        "not available",
        "no sensor",
        "not initialised: HOME first",
        "already running",
        "not supported",
        "inconsistent data",
        "time-out",
        "read error",
        "write error",
        "not enough resources",
        "wrong checksum",
        "no parameter expected",
        "not enough parameters",
        "unknown command",
        "wrong format",
        "access denied: a fast stop is active, FSACK leaves it",
        "already open",
        "the command failed: no part at this width",
        "aborted",
        "invalid handle",
        "not found",
        "not open",
        "input or output error",
        "invalid parameter",
        "index out of bounds",
        "pending",
        "overrun",
        "out of range",
        "axis blocked: contact before the expected width",
        "file exists",
    ];
    MEANINGS.get(status as usize).copied().unwrap_or("unknown status")
}
