//! Why the virtual rig is not served.

use std::net::SocketAddr;

/// Why the rig is not served.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// Another machine could reach it.
    #[error("{what}: {address} is not on loopback; the virtual rig is for this machine alone")]
    NotLoopback {
        /// Which port.
        what: &'static str,
        /// Its address.
        address: SocketAddr,
    },
    /// A clock that nothing can keep up with, or none.
    #[error("the clock would run {rate} times faster than real time, it can run from 0.01 to {most} times")]
    Rate {
        /// What was asked.
        rate: f64,
        /// Largest.
        most: f64,
    },
    /// A port that cannot be had.
    #[error("{what}: {address}: {source}")]
    Port {
        /// Which port.
        what: &'static str,
        /// Its address.
        address: SocketAddr,
        /// What the system says.
        source: std::io::Error,
    },
}
