//! `gripgen rig`: one file a verb.

pub mod check;
mod live;
mod load;
mod programs;
pub mod pull;
mod record;
mod rehearsal;
pub mod rehearse;
pub mod serve;
mod standing;
pub mod teach;

pub use load::load_rig;
