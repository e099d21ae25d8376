//! A part of a user: grips that work, and the configuration that uses them.

mod init;
mod try_part;

pub use init::{
    BenchmarkStarter, InitError, NoGrip, PartOptions, PartStarter, Proposal, StarterFile, Varied,
    benchmark_starter, part_starter, starter,
};
pub use try_part::{
    FrictionRange, GripTried, Holding, TriedPart, TryOptions, TryPartError, WorksAt, try_part,
};
