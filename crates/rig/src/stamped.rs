//! What arrived, with the moment of its arrival; and what all clients on sockets share.

mod socket;

pub use socket::Stamped;
pub(crate) use socket::{ReadEnd, connect, lock, read_until_end};
