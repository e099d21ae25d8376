//! Studies of gripgen: how good its answers are, and the reports made from them. `cargo xtask research NAME [ARGUMENTS]`.

mod lab;
mod studies;
mod truth;

use std::error::Error;
use std::process::ExitCode;

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    let Some((_, study)) = studies::ALL.iter().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = studies::ALL.iter().map(|(name, _)| *name).collect();
        eprintln!("usage: gripgen-research NAME [ARGUMENTS], NAME one of {}", names.join(", "));
        return ExitCode::from(2);
    };
    match study() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{name}: {e}");
            ExitCode::FAILURE
        }
    }
}

/// What follows the name of the study.
fn arguments() -> impl Iterator<Item = String> {
    std::env::args().skip(2)
}

type StudyResult = Result<(), Box<dyn Error>>;
