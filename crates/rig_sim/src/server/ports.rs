//! The ports, one kind a function.

pub(super) mod socket;
