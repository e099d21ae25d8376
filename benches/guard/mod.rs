//! Has it become slower? What a benchmark measured beside what this machine measured before (docs/benchmarks.md).
//!
//! Each benchmark hands its numbers to [`Run::finish`]. With `GRIPGEN_BENCH=record` (`cargo xtask bench record`) they are
//! written to `benches/baselines/<machine>.json`, otherwise they are compared with what stands there.

#![allow(dead_code, reason = "each benchmark uses a part of it")]

pub mod baseline;
pub mod compare;
pub mod criterion_samples;
pub mod machine;

use baseline::{Baseline, Entry, Unit};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::SystemTime;

/// What makes a run write the baseline.
const MODE: &str = "GRIPGEN_BENCH";

/// What was asked of a benchmark, and what it measured so far.
pub struct Run {
    target: &'static str,
    /// What names have to contain.
    filter: Option<String>,
    /// A file for the numbers, for the benchmarks that write one.
    file: Option<PathBuf>,
    /// Whether every benchmark whose name passes the filter is measured: no flag says otherwise.
    whole: bool,
    started: SystemTime,
    measured: BTreeMap<String, Entry>,
    skipped: Vec<String>,
}

impl Run {
    /// From the arguments of this process; `None` where `cargo test` only asks whether the benchmark starts. `target` is the
    /// benchmark's own name.
    pub fn from_args(target: &'static str) -> Option<Self> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let asked = arguments.iter().any(|a| a == "--bench") && !arguments.iter().any(|a| a == "--test");
        asked.then(|| Self::of(target, &arguments, SystemTime::now()))
    }

    /// From arguments: a word is a filter, or a file if it ends with `.json`.
    pub fn of(target: &'static str, arguments: &[String], started: SystemTime) -> Self {
        let (mut words, mut flags) = (vec![], 0);
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            match argument.as_str() {
                "--bench" | "--noplot" | "--verbose" | "-v" | "--quiet" => {}
                // Numbers of criterion's own that leave the names alone.
                "--sample-size" | "--warm-up-time" | "--measurement-time" | "--nresamples" => {
                    rest.next();
                }
                flag if flag.starts_with('-') => flags += 1,
                word => words.push(word.to_string()),
            }
        }
        let file = words.iter().position(|w| w.ends_with(".json")).map(|i| words.remove(i).into());
        let filter = words.into_iter().next();
        let whole = flags == 0 && filter.as_deref().is_none_or(is_plain);
        Self { target, filter, file, whole, started, measured: BTreeMap::new(), skipped: vec![] }
    }

    /// Whether a benchmark of this name is asked for.
    pub fn wants(&self, name: &str) -> bool {
        self.filter.as_ref().is_none_or(|filter| name.contains(filter.as_str()))
    }

    /// Whether a benchmark whose name begins with `prefix` may be asked for.
    pub fn wants_some_of(&self, prefix: &str) -> bool {
        self.wants(prefix) || self.filter.as_ref().is_some_and(|filter| filter.starts_with(prefix))
    }

    /// Where the numbers are to be written, in place of the comparison.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Takes the numbers of one benchmark, if it is asked for.
    pub fn measured(&mut self, name: &str, unit: Unit, samples: Vec<f64>) {
        if self.wants(name) && !samples.is_empty() {
            let entry = Entry::new(self.target, unit, samples);
            self.measured.insert(name.into(), entry);
        }
    }

    /// Says why benchmarks whose names begin with `prefix` cannot be measured here.
    pub fn skip(&mut self, prefix: &str, why: &str) {
        println!("{prefix}: skipped, {why}");
        self.skipped.push(prefix.into());
    }

    /// Takes what criterion wrote since the run began.
    pub fn take_criterion(&mut self, folder: &Path) {
        for (name, samples) in criterion_samples::since(folder, self.started) {
            let entry = Entry::new(self.target, Unit::Nanoseconds, samples);
            self.measured.insert(name, entry);
        }
    }

    /// Compares with the baseline of this machine, or writes it. Fails if something is past its tolerance, by name.
    pub fn finish(self) -> ExitCode {
        if self.measured.is_empty() || self.file.is_some() {
            return ExitCode::SUCCESS;
        }
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/baselines");
        let machine = machine::this();
        let path = folder.join(format!("{}.json", machine.id));
        let record = std::env::var(MODE).is_ok_and(|mode| mode == "record");
        let result = if record { self.record(&path, machine) } else { self.compare(&path, &machine) };
        match result {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::FAILURE,
            Err(e) => {
                eprintln!("{}: {e}", path.display());
                ExitCode::FAILURE
            }
        }
    }

    fn record(self, path: &Path, machine: machine::Machine) -> Result<bool, String> {
        let mut baseline = Baseline::read(path)?.unwrap_or_default();
        let n = self.measured.len();
        baseline.benches.retain(|name, entry| !self.expects(name, &entry.target));
        baseline.machine = machine;
        baseline.benches.extend(self.measured.clone());
        baseline.write(path)?;
        println!("\n{}: {n} benchmarks of {} recorded", path.display(), self.target);
        Ok(true)
    }

    fn compare(self, path: &Path, machine: &machine::Machine) -> Result<bool, String> {
        let Some(baseline) = Baseline::read(path)? else {
            println!("\n{}", compare::no_baseline(&machine.id));
            return Ok(true);
        };
        if baseline.machine.rustc != machine.rustc {
            println!("\nthe baseline was made by {}, this is {}", baseline.machine.rustc, machine.rustc);
        }
        let expected = |name: &str, entry: &Entry| self.expects(name, &entry.target);
        let rows = compare::compare(&baseline.benches, &self.measured, expected);
        let (text, passed) = compare::report(&rows, self.target);
        print!("\n{text}");
        if let Some(load) = machine::load().filter(|load| !passed && *load > 1.5) {
            println!(
                "{load:.1} programs wait for each core: times of a busy machine say little, instructions do"
            );
        }
        Ok(passed)
    }

    /// Whether this run measures that benchmark of that target, unless it is gone.
    pub fn expects(&self, name: &str, target: &str) -> bool {
        self.whole && target == self.target && self.wants(name) && !self.is_skipped(name)
    }

    fn is_skipped(&self, name: &str) -> bool {
        self.skipped.iter().any(|prefix| name.starts_with(prefix.as_str()))
    }
}

/// Criterion's folder of this build: beside the profile's.
pub fn criterion_folder() -> PathBuf {
    let executable = std::env::current_exe().unwrap_or_default();
    executable.ancestors().nth(3).unwrap_or(Path::new("target")).join("criterion")
}

/// Whether a filter is the same as a regular expression and as a text.
fn is_plain(filter: &str) -> bool {
    !filter.contains(['.', '*', '+', '?', '^', '$', '(', ')', '[', ']', '{', '}', '|', '\\'])
}
