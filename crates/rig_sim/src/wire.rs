//! Connections of the virtual rig: what is to be sent waits in a queue that nobody waits for, and faults act where it leaves.

mod socket;

pub(super) use socket::{DeviceFaults, Outbox, listen, read_on, spawn_writer};
