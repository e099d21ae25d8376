//! What the clients on sockets share: the connection with the thread that reads it, why it ends, and what arrived with the
//! moment of its arrival.

mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
pub(crate) mod testing;

pub(crate) use socket::{Connection, Reading, Shared, Socket, time_left};
pub use socket::{Stamped, lock};

use std::net::SocketAddr;
use std::sync::Arc;

/// Why a connection was not made, or ended. `E` is the error of its session: what is wrong with the bytes that came.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError<E> {
    /// The network.
    #[error("{address}: {source}")]
    Io {
        /// Where to.
        address: SocketAddr,
        /// What the system says.
        source: Arc<std::io::Error>,
    },
    /// What the device sends is not its protocol, or is a refusal.
    #[error("{address}: {source}")]
    Session {
        /// Where to.
        address: SocketAddr,
        /// What is wrong.
        source: E,
    },
    /// The connection is closed.
    #[error("{address}: {what}")]
    Closed {
        /// Where to.
        address: SocketAddr,
        /// Which connection, and who closed it where that is known.
        what: &'static str,
    },
    /// A device that speaks all the time says nothing.
    #[error("{address}: nothing came for {silent_s:.3} s, {limit_s:.3} s are allowed")]
    Silent {
        /// Where to.
        address: SocketAddr,
        /// For how long.
        silent_s: f64,
        /// The longest that was allowed.
        limit_s: f64,
    },
    /// A device that was asked says nothing.
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
