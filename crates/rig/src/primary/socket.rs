//! The primary interface on a socket: a thread of its own reads.

use super::packet::{PrimaryMessage, PrimaryStream, PrimaryStreamError};
use crate::link::{Connection, LinkError, Reading, Socket, Stamped};
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

/// Messages that wait to be read; later ones are lost.
const MAX_MESSAGES: usize = 4096;

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
    connection: Connection<(), PrimaryStreamError>,
    messages: Receiver<Stamped<PrimaryMessage>>,
}

impl PrimaryClient {
    /// Connects. The first message is the version of the controller.
    ///
    /// # Errors
    ///
    /// No connection, or nothing within the timeout.
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, PrimaryLinkError> {
        let socket = Socket::connect(address, timeout, "the connection to the primary interface is closed")?;
        let (tell, messages) = sync_channel(MAX_MESSAGES);
        let mut primary = PrimaryStream::default();
        let connection = Connection::start(socket, READING, (), move |_, bytes, at| {
            primary.push(bytes);
            while let Some(event) = primary.next_message()? {
                let _ = tell.try_send(Stamped { at, event });
            }
            Ok(())
        })?;
        Ok(Self { connection, messages })
    }

    /// What the controller said, in its order. The end of the channel is the end of the connection.
    pub fn messages(&self) -> &Receiver<Stamped<PrimaryMessage>> {
        &self.messages
    }

    /// Why the connection ended, once it has.
    pub fn ended(&self) -> Option<PrimaryLinkError> {
        self.connection.shared.known().ended.clone()
    }

    /// Sends a program; a last line without an end gets one. It replaces the program that runs, unless it is a `sec`. Whether
    /// the controller takes it, the messages tell: see the [module](super).
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
