//! Tests of several files at once.

mod bytes;
mod shards;
