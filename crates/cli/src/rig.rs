//! What the verbs of a rig do, without arguments and words: for the command line and for Python.

mod load;
pub mod programs;
pub mod record;
pub mod rehearsal;
pub mod standing;

pub use load::{SHIPPED_RIG, load_rig};
