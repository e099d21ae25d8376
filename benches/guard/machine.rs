//! What a baseline was measured on. No name of the host, no date: two machines alike share a baseline.

use serde::{Deserialize, Serialize};
use std::process::Command;

/// A machine, its system and what built the benchmarks.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Machine {
    /// The name of its baseline: processor and cores, and the profile unless it is that of a release.
    pub id: String,
    /// Model of the processor.
    pub cpu: String,
    /// Cores that this process may use.
    pub cores: usize,
    /// Main memory, whole GiB; 0 where the system does not say.
    pub memory_gib: u64,
    /// Operating system and architecture.
    pub os: String,
    /// `rustc --version`.
    pub rustc: String,
    /// Profile of the build.
    pub profile: String,
    /// Flags for the compiler from the environment.
    pub rustflags: String,
}

/// This one.
pub fn this() -> Machine {
    let cpu = cpu();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let flags = ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"].map(|name| std::env::var(name).unwrap_or_default());
    Machine {
        id: id(&cpu, cores, profile),
        cores,
        memory_gib: memory_gib(),
        os: format!("{}, {}", os(), std::env::consts::ARCH),
        rustc: output("rustc", &["--version"]).unwrap_or_else(|| "unknown".into()),
        profile: profile.into(),
        rustflags: flags.join(" ").replace('\u{1f}', " ").trim().into(),
        cpu,
    }
}

/// `AMD EPYC 9R14`, 2 cores: `amd-epyc-9r14-2-cores`.
pub fn id(cpu: &str, cores: usize, profile: &str) -> String {
    let words = format!("{cpu} {cores} cores {}", if profile == "release" { "" } else { profile });
    let words: String =
        words.to_lowercase().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { ' ' }).collect();
    words.split_whitespace().collect::<Vec<_>>().join("-")
}

fn cpu() -> String {
    let linux = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let of = |key: &str| {
            let value = text.lines().filter_map(|l| l.split_once(':')).find(|(k, _)| k.trim() == key)?.1;
            Some(value.trim().to_string())
        };
        // Virtual machines leave the number of the model out of its name.
        Some(match (of("cpu family"), of("model")) {
            (Some(family), Some(model)) => format!("{} family {family} model {model}", of("model name")?),
            _ => of("model name")?,
        })
    });
    let mac = || output("sysctl", &["-n", "machdep.cpu.brand_string"]);
    let windows = || std::env::var("PROCESSOR_IDENTIFIER").ok();
    linux.or_else(mac).or_else(windows).unwrap_or_else(|| format!("unknown {}", std::env::consts::ARCH))
}

/// Programs that want to run, by core, over the last minute, where the system says.
pub fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    let load: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(load / std::thread::available_parallelism().map_or(1, usize::from) as f64)
}

fn memory_gib() -> u64 {
    let linux = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("MemTotal:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
    });
    let mac = || output("sysctl", &["-n", "hw.memsize"])?.parse().ok();
    (linux.or_else(mac).unwrap_or(0) as f64 / 1024_f64.powi(3)).round() as u64
}

fn os() -> String {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = release.lines().find_map(|l| l.strip_prefix("PRETTY_NAME="));
    name.map_or_else(|| std::env::consts::OS.into(), |name| name.trim_matches('"').to_string())
}

fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|o| o.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_string();
    (!text.is_empty()).then_some(text)
}
