//! `gripgen rig`: one file a verb.

pub mod plant;
pub mod serve;
