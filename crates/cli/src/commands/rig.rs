//! `gripgen rig`: one file a verb.

pub mod check;
mod live;
pub mod pull;
pub mod rehearse;
pub mod serve;
pub mod teach;

pub use crate::rig::load_rig;
