//! Runs the studies of `research/`.

use crate::{cargo, python, root, run};
use std::process::Command;

/// The names of all studies: `blind`, and a Rust file each.
fn names() -> Result<Vec<String>, String> {
    let folder = root().join("research/src/studies");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let stems = entries
        .flatten()
        .filter(|entry| entry.path().is_file())
        .filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(".rs")?.replace('_', "-")));
    let mut names: Vec<String> = stems.chain(["blind".to_string()]).collect();
    names.sort();
    Ok(names)
}

pub fn research(name: Option<&str>, arguments: &[&str]) -> Result<(), String> {
    let names = names()?;
    let usage = || format!("usage: cargo xtask research NAME [ARGUMENTS], NAME one of {}", names.join(", "));
    let name = name.filter(|name| names.iter().any(|known| known == name)).ok_or_else(usage)?;
    if name == "blind" {
        return blind(arguments);
    }
    let mut study = cargo(&["run", "--release", "--quiet", "--package", "gripgen-research", "--", name]);
    run(name, study.args(arguments))
}

/// The whole blind benchmark of the diagnosis (hours); writes research/loop/blind.md.
fn blind(arguments: &[&str]) -> Result<(), String> {
    let python = python::set_up(&root(), false)?;
    run("release build", &mut cargo(&["build", "--release", "--quiet"]))?;
    let mut all = Command::new(&python);
    all.args(["-m", "research.blind.all", "--out"]).arg(python::target(&root()).join("blind"));
    all.args(["--doc", "research/loop/blind.md"]).args(arguments);
    all.env("GRIPGEN_BIN", python::target(&root()).join("release/gripgen"));
    run("blind benchmark", &mut all)
}
