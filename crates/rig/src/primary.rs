//! The primary interface of Universal Robots controllers (TCP port 30001): messages of the controller, and the way in for programs as
//! text. The states that a controller sends there are skipped: RTDE has them.
//!
//! A controller acknowledges no program on this connection. That one has started is a key message ([`PROGRAM_STARTED`]), that it
//! is wrong a runtime exception with line and column.
//!
//! The layouts are published in Universal Robots' "Client Interface" documents for e-Series. Here they are taken from the packets
//! that the Universal Robots Client Library reads and from the byte sequences in its unit tests; a genuine controller was not
//! read yet.

mod packet;
mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
mod tests;

pub use packet::{
    MAX_PACKET, PROGRAM_STARTED, PROGRAM_STOPPED, PrimaryMessage, PrimaryStream, PrimaryStreamError,
};
pub use socket::{PrimaryClient, PrimaryLinkError, ScriptError};
