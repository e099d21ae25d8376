//! What the clients on sockets share: the connection with the thread that reads it, why it ends, and what arrived with the
//! moment of its arrival.

mod socket;
#[cfg(test)]
mod socket_tests;

pub(crate) use socket::{Connection, LOOK, Reading, Shared, Socket, lock, time_left};
pub use socket::{LinkError, Stamped};
