//! `gripgen rig`: one file a verb.

pub mod check;
mod live;
mod load;
pub mod pull;
mod record;
pub mod serve;
mod standing;
pub mod teach;

pub use load::load_rig;
