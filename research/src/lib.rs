//! What several studies share. The studies are the programs in `src/bin/`; `cargo xtask research` lists and runs them.

#![expect(missing_docs, reason = "fields are named after what they hold, with their units")]

pub mod lab;
pub mod truth;
