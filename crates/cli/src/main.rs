//! The binary `gripgen`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(gripgen_cli::run(std::env::args_os()))
}
