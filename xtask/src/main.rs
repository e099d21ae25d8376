//! Tasks of gripgen's developers. No dependencies, so that it is built in a second.
//!
//! `cargo xtask test` sets up what the tests need and runs all of them; `cargo xtask test --all` adds the slow ones;
//! `cargo xtask blind` runs the whole blind benchmark of the diagnosis (hours) and writes docs/loop/blind.md;
//! `cargo xtask dist` builds the wheel and a static binary and tries both where there is no Rust;
//! `cargo xtask bench record [--profile NAME] [FILTER]` runs the benchmarks and writes their numbers down as those of this machine,
//! which `cargo bench` compares with;
//! `cargo xtask assets [--check]` makes the shipped meshes and the shipped sensor from the numbers beside them.

mod dist;
mod python;
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
        ["test"] => test(false),
        ["test", "--all"] => test(true),
        ["blind"] => blind(),
        ["dist"] => dist::dist(),
        ["bench", "record", ref rest @ ..] => record_benches(rest),
        ["assets"] => assets(false),
        ["assets", "--check"] => assets(true),
        _ => Err("usage: cargo xtask test [--all] | blind | dist | bench record [--profile NAME] [FILTER] | assets [--check]".into()),
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

fn test(all: bool) -> Result<(), String> {
    let start = Instant::now();
    let vulkan = vulkan::set_up();
    let python = python::set_up(&root(), all)?;
    run("format", &mut cargo(&["fmt", "--all", "--check"]))?;
    run("format of the effects", &mut rustfmt_effects()?)?;
    let clippy = ["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"];
    run("clippy", &mut cargo(&clippy))?;
    let mut rust = cargo(&["test", "--workspace", "--no-fail-fast"]);
    // Tests that need a GPU are ignored, with this reason, where there is no driver.
    if let Err(reason) = &vulkan {
        eprintln!("\nno Vulkan driver ({reason}): GPU tests will read ignored");
    } else {
        rust.env("GRIPGEN_VULKAN", "1");
        // The driver complains about every device it opens without one.
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            rust.env("XDG_RUNTIME_DIR", std::env::temp_dir());
        }
    }
    run("Rust tests", &mut rust)?;
    assets(true)?;
    python::stage_package(&root())?;
    let mut checks = python::pytest(&python, &root());
    if all {
        checks.env("GRIPGEN_SLOW_TESTS", "1");
    }
    run("Python checks", &mut checks)?;
    eprintln!("\nall tests passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
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

fn blind() -> Result<(), String> {
    let python = python::set_up(&root(), false)?;
    run("release build", &mut cargo(&["build", "--release", "--quiet"]))?;
    let mut all = Command::new(&python);
    all.args(["-m", "tests.blind.all", "--out"]).arg(python::target(&root()).join("blind"));
    all.args(["--doc", "docs/loop/blind.md"]);
    all.env("GRIPGEN_BIN", python::target(&root()).join("release/gripgen"));
    run("blind benchmark", &mut all)
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

fn assets(check: bool) -> Result<(), String> {
    // The same selection as in `cargo test --workspace`, so that nothing is built twice.
    let selection = ["build", "--quiet", "--workspace", "--lib", "--bins", "--examples"];
    run("build of the asset maker and the Python module", &mut cargo(&selection))?;
    let mut maker = Command::new(python::target(&root()).join("debug/examples/make_assets"));
    run("assets", maker.args(check.then_some("--check")))
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
