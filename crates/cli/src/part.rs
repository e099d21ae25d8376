//! A part of a user: grips that work, and the configuration that uses them.

mod init;
mod try_part;

pub use init::{
    BenchmarkStarter, InitError, NoGrip, PartGrips, PartOptions, PartStarter, StarterFile, Varied,
    benchmark_starter, part_starter, rasterise, starter,
};
pub use try_part::{TryOptions, TryPartError, try_part};
