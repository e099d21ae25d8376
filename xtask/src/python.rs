//! A virtual environment with pinned packages for the checks by independent programs.

use crate::{apt_install, can_install};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Makes `target/venv` with the packages of `tests/python/requirements.txt`; returns its Python.
pub fn set_up(root: &Path) -> Result<PathBuf, String> {
    let venv = target(root).join("venv");
    let python = venv.join("bin/python");
    let requirements = root.join("tests/python/requirements.txt");
    let wanted =
        std::fs::read_to_string(&requirements).map_err(|e| format!("{}: {e}", requirements.display()))?;
    let stamp = venv.join("gripgen-requirements.txt");
    if python.exists() && std::fs::read_to_string(&stamp).is_ok_and(|have| have == wanted) {
        return Ok(python);
    }
    eprintln!("making a Python environment in {}", venv.display());
    let system = system_python()?;
    if !make_venv(&system, &venv) {
        if !can_install() {
            return Err(
                "python3 cannot make virtual environments; install its venv module (python3-venv)".into()
            );
        }
        apt_install("python3-venv", "python3 cannot make virtual environments")?;
        if !make_venv(&system, &venv) {
            return Err("python3 cannot make virtual environments, even with python3-venv".into());
        }
    }
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"]).arg(&requirements);
    let status = pip.status().map_err(|e| format!("pip: {e}"))?;
    if !status.success() {
        return Err(format!("pip install -r tests/python/requirements.txt: {status}"));
    }
    std::fs::write(&stamp, wanted).map_err(|e| format!("{}: {e}", stamp.display()))?;
    Ok(python)
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

/// The command that runs the Python checks against the binary that the Rust tests have built.
pub fn pytest(python: &Path, root: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/python", "tests/blind"]);
    command.env("GRIPGEN_BIN", target(root).join("debug/gripgen")).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}
