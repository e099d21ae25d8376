//! `gripgen completions`: for the shell.

use crate::args::{Cli, CompletionsArgs};
use crate::failure::Failure;
use crate::output::print;
use clap::CommandFactory;

/// Runs the verb.
pub fn run(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "gripgen", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(0)
}
