//! `gripgen schema`: for editors that complete and check TOML.

use crate::args::{SchemaArgs, SchemaKind};
use crate::failure::Failure;
use crate::output::print;
use gripgen::{sweep_schema, twin_schema};

/// Runs the verb.
pub fn run(args: &SchemaArgs) -> Result<u8, Failure> {
    let schema = match args.kind {
        SchemaKind::Sweep => sweep_schema(),
        SchemaKind::Twin => twin_schema(),
    };
    print(&format!("{schema:#}\n"))?;
    Ok(0)
}
