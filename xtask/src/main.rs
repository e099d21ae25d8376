//! Tasks of gripgen's developers. No dependencies, so that it is built in a second.
//!
//! `cargo xtask test` sets up what the tests need and runs what a change can break; `cargo xtask test --all` adds campaigns, fuzzing
//! at length, lints and the slow checks of Python, once for each change that is handed in;
//! `cargo xtask research NAME` runs a study of `research/`; without a name it lists them;
//! `cargo xtask count` prints Rust lines by place, crowded folders and the numeric constants of `identify`;
//! `cargo xtask dist` builds the wheel and a static binary and tries both where there is no Rust;
//! `cargo xtask bench record [--profile NAME] [FILTER]` runs the benchmarks and writes their numbers down as those of this machine,
//! which `cargo bench` compares with;
//! `cargo xtask assets [--check]` makes the shipped meshes and the shipped sensor from the numbers beside them.

mod count;
mod dist;
mod python;
mod research;
mod test;
mod times;
mod vulkan;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_path_buf()
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words[..] {
        ["test"] => test::test(false),
        ["test", "--all"] => test::test(true),
        // What cargo starts test programs with.
        ["timed", ref words @ ..] => return times::timed(words),
        ["research"] => research::research(None, &[]),
        ["research", name, ref rest @ ..] => research::research(Some(name), rest),
        ["count"] => count::count(),
        ["dist"] => dist::dist(),
        ["bench", "record", ref rest @ ..] => record_benches(rest),
        ["assets"] => assets(false),
        ["assets", "--check"] => assets(true),
        _ => Err("usage: cargo xtask test [--all] | research [NAME [ARGUMENTS]] | count | dist | \
                  bench record [--profile NAME] [FILTER] | assets [--check]"
            .into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("xtask: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a command in the root folder and shows what it is; fails if it fails.
fn run(what: &str, command: &mut Command) -> Result<(), String> {
    eprintln!("\n== {what}");
    let start = Instant::now();
    let status = command.current_dir(root()).status().map_err(|e| format!("{what}: {e}"))?;
    let seconds = start.elapsed().as_secs_f64();
    if status.success() {
        eprintln!("== {what}: {seconds:.0} s");
        return Ok(());
    }
    Err(format!("{what}: {status} after {seconds:.0} s"))
}

fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    command
}

/// The benchmarks write the file themselves (`benches/guard/`): only they know what they measured.
fn record_benches(words: &[&str]) -> Result<(), String> {
    let (profile, rest) = match words {
        ["--profile", name, rest @ ..] => (vec!["--profile", *name], rest),
        rest => (vec![], rest),
    };
    // The same selection as in `cargo bench`, so that the same build is measured.
    let mut benches = cargo(&["bench"]);
    benches.args(profile).arg("--").args(rest).env("GRIPGEN_BENCH", "record");
    run("benchmarks", &mut benches)
}

/// The test that compares the assets writes them on request.
fn assets(check: bool) -> Result<(), String> {
    let mut test = test::cargo_selected("test", &["--test", "tests"]);
    test.args(["--quiet", "--", "shipped_assets"]);
    if !check {
        test.env("GRIPGEN_UPDATE", "1");
    }
    run("assets", &mut test)
}

/// Whether this process may install packages with apt-get.
fn can_install() -> bool {
    let apt = Command::new("apt-get").arg("--version").output().is_ok_and(|o| o.status.success());
    is_root() && apt
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.starts_with(b"0\n"))
}

/// Installs a Debian package, saying so.
fn apt_install(package: &str, why: &str) -> Result<(), String> {
    eprintln!("installing the Debian package {package}: {why}");
    for arguments in [&["update", "-qq"][..], &["install", "-y", "-qq", "--no-install-recommends", package]] {
        let status = Command::new("apt-get")
            .args(arguments)
            .env("DEBIAN_FRONTEND", "noninteractive")
            .stdout(std::process::Stdio::null())
            .status()
            .map_err(|e| format!("apt-get: {e}"))?;
        if !status.success() {
            return Err(format!("apt-get {}: {status}", arguments[0]));
        }
    }
    Ok(())
}
