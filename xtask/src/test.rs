//! The two tiers of tests.
//!
//! The first holds what a change can break. `--all` adds what is ignored for a reason that begins with `slow`, the Python checks
//! that are marked so, the lints and the tests of `research/`.

use crate::times::Times;
use crate::{cargo, python, root, run, vulkan};
use std::process::Command;
use std::time::Instant;

/// Features that everything is built and tested with.
pub const FEATURES: &[&str] = &[];

/// The one selection of packages and targets that is built, so that each unit is compiled once. Studies are in none of it.
const PACKAGES: [&str; 3] = ["--workspace", "--exclude", "gripgen-research"];
const TARGETS: [&str; 3] = ["--lib", "--bins", "--tests"];

/// Set for the long versions of tests.
pub const SLOW: &str = "GRIPGEN_SLOW_TESTS";

/// Cargo with a command, all packages that are tested, these targets of them, and the features. Nothing is compiled incrementally: from
/// nothing that is faster, and so is what comes out.
pub fn cargo_selected(command: &str, targets: &[&str]) -> Command {
    let mut cargo = cargo(&[command]);
    cargo.args(PACKAGES).args(targets).args(FEATURES).env("CARGO_INCREMENTAL", "0");
    cargo
}

pub fn test(all: bool) -> Result<(), String> {
    let start = Instant::now();
    run("format", &mut cargo(&["fmt", "--all", "--check"]))?;
    run("format of the effects", &mut rustfmt_effects()?)?;
    let vulkan = vulkan::set_up();
    // Packages are fetched while the compiler works.
    let python = std::thread::spawn(move || python::set_up(&root(), all));
    let gpu = |command: &mut Command| {
        if vulkan.is_ok() {
            command.env("GRIPGEN_VULKAN", "1");
            // The driver complains about every device it opens without one.
            if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
                command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
            }
        }
    };
    // Tests that need a GPU are ignored, with this reason, where there is no driver.
    if let Err(reason) = &vulkan {
        eprintln!("\nno Vulkan driver ({reason}): GPU tests will read ignored");
    }
    let mut build = cargo_selected("build", &TARGETS);
    gpu(&mut build);
    run("build", &mut build)?;
    let python = python.join().map_err(|_| "the set-up of Python panicked")??;
    python::stage_package(&root(), "debug")?;
    let times = Times::new(python::target(&root()).join("test-times.tsv"))?;
    let mut failed = Vec::new();
    let mut step = |what: &str, command: &mut Command| {
        if all {
            command.env(SLOW, "1");
        }
        gpu(command);
        failed.extend(run(what, command).err());
    };
    let mut rust = cargo_selected("test", &TARGETS);
    rust.arg("--no-fail-fast").args(Times::runner()?);
    step("Rust tests", times.of(&mut rust));
    step("documented examples", &mut cargo_selected("test", &["--doc"]));
    step("Python checks", times.of(&mut python::pytest(&python, &root(), all)?));
    if all {
        let mut research = cargo(&["test", "--workspace", "--bin", "gripgen-research"]);
        research.args(FEATURES).args(Times::runner()?);
        step("tests of the studies", times.of(&mut research));
        let clippy = ["clippy", "--workspace", "--all-targets", "--quiet"];
        step("clippy", cargo(&clippy).args(FEATURES).args(["--", "-D", "warnings"]));
    }
    times.print()?;
    let seconds = start.elapsed().as_secs_f64();
    if failed.is_empty() {
        eprintln!("\nall tests passed in {seconds:.0} s");
        return Ok(());
    }
    Err(format!("after {seconds:.0} s:\n{}", failed.join("\n")))
}

/// The effects are modules of a macro, which `cargo fmt` does not look into.
fn rustfmt_effects() -> Result<Command, String> {
    let folder = root().join("crates/twin/src/effects");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut rustfmt = Command::new("rustfmt");
    rustfmt.args(["--check", "--edition", "2024"]);
    rustfmt.args(entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|x| x == "rs")));
    Ok(rustfmt)
}
