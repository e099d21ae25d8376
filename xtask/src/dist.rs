//! What is handed out: a wheel with everything in it and a static binary with all but the gpu backend, both tried where there is no Rust.

use crate::{cargo, is_root, python, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Builds the wheel.
const MATURIN: &str = "maturin==1.16.0";

/// Where the static binary is built for: named, so that its flags are not those of build scripts and macros.
const TARGET: &str = "x86_64-unknown-linux-gnu";

/// Samples that are made to try what was built.
const TRIED: [&str; 6] =
    ["sweep", "asset:configs/quickstart.toml", "--set", "mechanics=reduced", "--quiet", "--out"];

/// Builds both into `target/dist` and tries them: installed, and to the first samples, which must be the same bytes.
pub fn dist() -> Result<(), String> {
    let target = std::path::absolute(python::target(&root())).map_err(|e| e.to_string())?;
    let folder = target.join("dist");
    remade(&folder)?;
    let wheel = build_wheel(&target, &folder)?;
    let binary = build_binary(&target, &folder)?;
    let shards = [try_wheel(&wheel, &remade(&target.join("try-wheel"))?)?, try_binary(&binary, &target)?];
    if shards[0] != shards[1] {
        return Err("the wheel and the binary make different shards".into());
    }
    eprintln!("\n{}\n{}", wheel.display(), binary.display());
    Ok(())
}

fn build_wheel(target: &Path, folder: &Path) -> Result<PathBuf, String> {
    let venv = target.join("maturin");
    python::make(&venv)?;
    run("maturin", Command::new(venv.join("bin/pip")).args(["install", "--quiet", MATURIN]))?;
    let mut maturin = Command::new(venv.join("bin/maturin"));
    run("wheel", maturin.args(["build", "--release", "--locked", "--out"]).arg(folder))?;
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let wheel = entries.flatten().map(|e| e.path()).find(|p| p.extension().is_some_and(|x| x == "whl"));
    wheel.ok_or_else(|| format!("{}: no wheel", folder.display()))
}

fn build_binary(target: &Path, folder: &Path) -> Result<PathBuf, String> {
    // Without the feature `gpu`: a static program cannot load the system's Vulkan driver.
    let selection = ["--release", "--locked", "--package", "gripgen-cli", "--target", TARGET];
    let mut build = cargo(&["build"]);
    build.args(selection).env("RUSTFLAGS", "-C target-feature=+crt-static");
    run("static binary", &mut build)?;
    let binary = folder.join("gripgen");
    let built = target.join(TARGET).join("release/gripgen");
    std::fs::copy(&built, &binary).map_err(|e| format!("{}: {e}", built.display()))?;
    Ok(binary)
}

/// Installs the wheel into a fresh environment; the shard of its first samples.
fn try_wheel(wheel: &Path, folder: &Path) -> Result<Vec<u8>, String> {
    let start = Instant::now();
    let venv = folder.join("venv");
    python::make(&venv)?;
    run("install of the wheel", Command::new(venv.join("bin/pip")).args(["install", "--quiet"]).arg(wheel))?;
    // The environment's own programs and no others.
    let mut first = Command::new(venv.join("bin/gripgen"));
    first.args(TRIED).env_clear().env("PATH", venv.join("bin"));
    run("first samples of the wheel", first.arg(folder.join("run")))?;
    eprintln!("wheel: {:.0} s from nothing to the first samples", start.elapsed().as_secs_f64());
    first_shard(folder)
}

/// Runs the binary in a folder that holds nothing else, as root one without any way out of it.
fn try_binary(binary: &Path, target: &Path) -> Result<Vec<u8>, String> {
    let folder = remade(&target.join("try-binary"))?;
    let start = Instant::now();
    let copy = folder.join("gripgen");
    std::fs::copy(binary, &copy).map_err(|e| format!("{}: {e}", copy.display()))?;
    let mut first = Command::new(&copy);
    first.args(TRIED).arg(folder.join("run"));
    if is_root() {
        first = Command::new("/usr/sbin/chroot");
        first.arg(&folder).arg("/gripgen").args(TRIED).arg("/run");
    }
    run("first samples of the binary", first.env_clear())?;
    eprintln!("binary: {:.0} s from nothing to the first samples", start.elapsed().as_secs_f64());
    first_shard(&folder)
}

fn first_shard(folder: &Path) -> Result<Vec<u8>, String> {
    let shard = folder.join("run/shard-00000.mcap");
    std::fs::read(&shard).map_err(|e| format!("{}: {e}", shard.display()))
}

/// An empty folder.
fn remade(folder: &Path) -> Result<PathBuf, String> {
    let fault = |e: std::io::Error| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(fault)?;
    }
    std::fs::create_dir_all(folder).map_err(fault)?;
    Ok(folder.to_path_buf())
}
