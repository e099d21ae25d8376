//! GCL, the text interface of the Weiss WSG 50 gripper (TCP port 1000, "text based interface" in its web page): commands, answers,
//! the session of a client, and the client on a socket.
//!
//! Source: Weiss Robotics, "GCL Reference Manual", version 4.0. Lines end in `\n`; a motion answers twice, `ACK NAME` when it
//! begins and `FIN NAME` when it is done; errors begin with `ERR`.

mod command;
mod session;
mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
mod tests;

pub use command::{GclCommand, GclLimits, GripState, LimitError, Query, SHIPPED_LIMITS};
pub use session::{GclEvent, GclLink, GclSessionError, SendError, status_meaning};
pub use socket::{GclClient, GclLinkError, GclLogLine, GclRunError, GclSendError};
