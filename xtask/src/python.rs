//! A virtual environment with pinned packages for the checks by independent programs.

use crate::times::Times;
use crate::{apt_install, can_install};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is installed.
const STAMP: &str = "gripgen-requirements.txt";

/// Makes `target/venv` with the packages of `tests/python/requirements.txt`, and with those of `requirements-all.txt` if
/// `all`; returns its Python.
pub fn set_up(root: &Path, all: bool) -> Result<PathBuf, String> {
    let venv = target(root).join("venv");
    let python = venv.join("bin/python");
    let read = |name: &str| {
        let path = root.join("tests/python").join(name);
        std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    };
    let few = read("requirements.txt")?;
    let many = format!("{few}{}", read("requirements-all.txt")?);
    let have = std::fs::read_to_string(venv.join(STAMP)).unwrap_or_default();
    // What has more than is wanted will do.
    if python.exists() && (have == many || (have == few && !all)) {
        return Ok(python);
    }
    let wanted = if all { many } else { few };
    let stamp = venv.join(STAMP);
    eprintln!("making a Python environment in {}", venv.display());
    make(&venv)?;
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.args(["-r", "tests/python/requirements.txt"]).current_dir(root);
    if all {
        pip.args(["-r", "tests/python/requirements-all.txt"]);
    }
    let status = pip.status().map_err(|e| format!("pip: {e}"))?;
    if !status.success() {
        return Err(format!("pip install of the packages in tests/python/requirements*.txt: {status}"));
    }
    std::fs::write(&stamp, wanted).map_err(|e| format!("{}: {e}", stamp.display()))?;
    Ok(python)
}

/// Makes an empty virtual environment in a folder.
pub fn make(venv: &Path) -> Result<(), String> {
    let system = system_python()?;
    if make_venv(&system, venv) {
        return Ok(());
    }
    if !can_install() {
        return Err("python3 cannot make virtual environments; install its venv module (python3-venv)".into());
    }
    apt_install("python3-venv", "python3 cannot make virtual environments")?;
    if make_venv(&system, venv) {
        return Ok(());
    }
    Err("python3 cannot make virtual environments, even with python3-venv".into())
}

/// Where cargo builds.
pub fn target(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from)
}

fn system_python() -> Result<String, String> {
    let works = |name: &str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    if works("python3") {
        return Ok("python3".into());
    }
    if can_install() {
        apt_install("python3", "no python3 was found")?;
        return Ok("python3".into());
    }
    Err("python3 is needed for the checks by independent programs (3.11 or later)".into())
}

fn make_venv(python: &str, venv: &Path) -> bool {
    let mut command = Command::new(python);
    command.args(["-m", "venv", "--clear"]).arg(venv);
    command.stderr(std::process::Stdio::null()).stdout(std::process::Stdio::null());
    command.status().is_ok_and(|s| s.success())
}

/// Puts the Python package together in `target/python` from its sources and the module that cargo has built in a profile.
pub fn stage_package(root: &Path, profile: &str) -> Result<PathBuf, String> {
    let stage = target(root).join("python");
    let package = stage.join("gripgen");
    let at = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    std::fs::create_dir_all(&package).map_err(|e| at(&package, e))?;
    for entry in std::fs::read_dir(&package).map_err(|e| at(&package, e))?.flatten() {
        // Files that are gone from the sources; what Python compiled goes with the folder of its own.
        if entry.path().is_file() {
            std::fs::remove_file(entry.path()).map_err(|e| at(&entry.path(), e))?;
        }
    }
    let sources = root.join("crates/py/python/gripgen");
    for entry in std::fs::read_dir(&sources).map_err(|e| at(&sources, e))?.flatten() {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), package.join(entry.file_name())).map_err(|e| at(&entry.path(), e))?;
        }
    }
    let names =
        ["lib_core.so", "lib_core.dylib", "_core.dll"].map(|name| target(root).join(profile).join(name));
    let built = names.iter().find(|path| path.exists()).ok_or("cargo has not built the Python module")?;
    let name = if cfg!(windows) { "_core.pyd" } else { "_core.abi3.so" };
    std::fs::copy(built, package.join(name)).map_err(|e| at(built, e))?;
    Ok(stage)
}

/// The command that runs the Python checks against the binary that was built for the tests.
pub fn pytest(python: &Path, root: &Path, all: bool) -> Result<Command, String> {
    let mut command = Times::command()?;
    command.arg(python).args([
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--durations=0",
        "--durations-min=1",
    ]);
    command.args(["tests/python", "tests/gripgen_py"]);
    // Clients that others wrote, on the clock of the wall; and the tests of the blind benchmark.
    if all {
        command.args(["tests/rig_py", "research/blind"]);
    }
    command.env("PYTHONPATH", target(root).join("python"));
    command.env("GRIPGEN_BIN", target(root).join("debug/gripgen")).env("PYTHONDONTWRITEBYTECODE", "1");
    Ok(command)
}
