//! Runs the studies of `research/`.

use crate::{cargo, python, root, run};
use std::process::Command;

/// Studies in Python.
const PYTHON: [&str; 2] = ["blind", "reliability"];

/// The names of all studies; those in Rust are files.
fn names() -> Result<Vec<String>, String> {
    let folder = root().join("research/src/studies");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let stems = entries
        .flatten()
        .filter(|entry| entry.path().is_file())
        .filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(".rs")?.replace('_', "-")));
    let mut names: Vec<String> = stems.chain(PYTHON.map(String::from)).collect();
    names.sort();
    Ok(names)
}

pub fn research(name: Option<&str>, arguments: &[&str]) -> Result<(), String> {
    let names = names()?;
    let usage = || format!("usage: cargo xtask research NAME [ARGUMENTS], NAME one of {}", names.join(", "));
    let name = name.filter(|name| names.iter().any(|known| known == name)).ok_or_else(usage)?;
    if PYTHON.contains(&name) {
        return in_python(name, arguments);
    }
    let mut study = cargo(&["run", "--release", "--quiet", "--package", "gripgen-research", "--", name]);
    run(name, study.args(arguments))
}

/// Runs a study in Python with the release build. The blind benchmark takes hours and writes research/loop/blind.md.
fn in_python(name: &str, arguments: &[&str]) -> Result<(), String> {
    let python = python::set_up(&root(), false)?;
    let build = ["build", "--release", "--quiet", "--package", "gripgen-cli", "--package", "gripgen-py"];
    run("release build", &mut cargo(&build))?;
    let package = python::stage_package(&root(), "release")?;
    let mut study = Command::new(&python);
    if name == "blind" {
        study.args(["-m", "research.blind.all", "--doc", "research/loop/blind.md", "--out"]);
        study.arg(python::target(&root()).join("blind"));
    } else {
        study.arg(format!("research/{name}.py"));
    }
    study
        .args(arguments)
        .env("PYTHONPATH", package)
        .env("GRIPGEN_BIN", python::target(&root()).join("release/gripgen"));
    run(name, &mut study)
}
