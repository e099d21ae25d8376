//! How long each test takes: a runner that cargo and pytest are started through, and the list at the end of a run.

use crate::test;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// Names the file that the runner appends to.
const FILE: &str = "GRIPGEN_TEST_TIMES";

/// Tests that take longer are listed, and the slowest.
const LONG_S: f64 = 10.0;
const SLOWEST: usize = 10;

/// The times of one run of the tests.
pub struct Times(PathBuf);

impl Times {
    /// Begins an empty list.
    pub fn new(file: PathBuf) -> Result<Self, String> {
        File::create(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        Ok(Self(file))
    }

    /// Arguments with which cargo starts test programs through [`timed`].
    pub fn runner() -> Result<[String; 2], String> {
        let own = own_program()?;
        Ok(["--config".into(), format!("target.'cfg(all())'.runner = ['{}', 'timed']", own.display())])
    }

    /// A command that starts another through [`timed`].
    pub fn command() -> Result<Command, String> {
        let mut command = Command::new(own_program()?);
        command.arg("timed");
        Ok(command)
    }

    /// Lets what the command starts write into this list.
    pub fn of<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env(FILE, &self.0)
    }

    /// Prints every test that took long, and the slowest ones.
    pub fn print(&self) -> Result<(), String> {
        let text = std::fs::read_to_string(&self.0).map_err(|e| format!("{}: {e}", self.0.display()))?;
        let mut times: Vec<(f64, &str)> = text
            .lines()
            .filter_map(|line| line.split_once('\t'))
            .filter_map(|(seconds, name)| Some((seconds.parse().ok()?, name)))
            .collect();
        times.sort_by(|a, b| b.0.total_cmp(&a.0));
        let long = times.iter().take_while(|(seconds, _)| *seconds > LONG_S).count();
        eprintln!("\n== {} tests, {long} of them over {LONG_S:.0} s; the slowest:", times.len());
        for (seconds, name) in &times[..times.len().min(long.max(SLOWEST))] {
            eprintln!("{seconds:>8.1} s  {name}");
        }
        Ok(())
    }
}

/// Where this program is. The build of the tests may have put a new one in its place: Linux then calls the old one deleted.
fn own_program() -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|e| format!("this program: {e}"))?;
    let text = own.to_string_lossy();
    Ok(text.strip_suffix(" (deleted)").map_or_else(|| own.clone(), PathBuf::from))
}

/// Runs a test program or pytest, shows what it prints, and appends the time of each test to the list. Where slow tests are
/// wanted, a second run holds those of a Rust program that are ignored as slow.
pub fn timed(words: &[&str]) -> ExitCode {
    let slow = std::env::var_os(test::SLOW).is_some();
    let run = |more: &[String]| {
        watched(words, more).unwrap_or_else(|e| {
            eprintln!("xtask timed {}: {e}", words.join(" "));
            (Vec::new(), false)
        })
    };
    let (ignored, passed) = run(&[]);
    if !slow || ignored.is_empty() {
        return if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    let more = [vec!["--ignored".to_string(), "--exact".to_string()], ignored].concat();
    let (_, slow_passed) = run(&more);
    if passed && slow_passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Names of the tests that were ignored as slow, and whether all others passed.
fn watched(words: &[&str], more: &[String]) -> std::io::Result<(Vec<String>, bool)> {
    let Some((program, arguments)) = words.split_first() else { return Ok((Vec::new(), false)) };
    let mut command = Command::new(program);
    command.args(arguments).args(more).stdout(Stdio::piped());
    if !arguments.contains(&"pytest") {
        // libtest tells times on request only, and the request is no stable option.
        command.args(["-Z", "unstable-options", "--report-time"]).env("RUSTC_BOOTSTRAP", "1");
    }
    let mut child = command.spawn()?;
    let stem = program.rsplit(['/', '\\']).next().unwrap_or(program);
    let stem = stem.rsplit_once('-').map_or(stem, |(name, _hash)| name);
    let mut list =
        std::env::var_os(FILE).map(|file| OpenOptions::new().append(true).open(file)).transpose()?;
    let mut ignored = Vec::new();
    let mut out = std::io::stdout();
    for line in BufReader::new(child.stdout.take().ok_or(std::io::ErrorKind::BrokenPipe)?).split(b'\n') {
        let line = line?;
        out.write_all(&line)?;
        out.write_all(b"\n")?;
        out.flush()?;
        let line = String::from_utf8_lossy(&line);
        if let Some((name, "slow")) = rust_ignored(&line) {
            ignored.push(name.to_string());
        }
        let timed =
            rust_time(&line).map(|(name, s)| (format!("{stem}::{name}"), s)).or_else(|| python_time(&line));
        if let (Some((name, seconds)), Some(list)) = (timed, &mut list) {
            writeln!(list, "{seconds}\t{name}")?;
        }
    }
    Ok((ignored, child.wait()?.success()))
}

/// `test NAME ... ignored, REASON: more`.
fn rust_ignored(line: &str) -> Option<(&str, &str)> {
    let (name, reason) = line.strip_prefix("test ")?.split_once(" ... ignored, ")?;
    let name = name.strip_suffix(" - should panic").unwrap_or(name);
    Some((name, reason.split(':').next().unwrap_or(reason)))
}

/// `test NAME ... ok <1.234s>`.
fn rust_time(line: &str) -> Option<(&str, f64)> {
    let (name, end) = line.strip_prefix("test ")?.split_once(" ... ")?;
    let seconds = end.rsplit_once(" <")?.1.strip_suffix("s>")?;
    Some((name, seconds.parse().ok()?))
}

/// `1.23s call     tests/python/test_x.py::test_y`, as `pytest --durations` prints it; set-up counts, too.
fn python_time(line: &str) -> Option<(String, f64)> {
    let mut words = line.split_whitespace();
    let seconds = words.next()?.strip_suffix('s')?.parse().ok()?;
    let stage = words.next().filter(|stage| ["call", "setup", "teardown"].contains(stage))?;
    let name = words.next().filter(|name| name.contains("::"))?;
    Some((if stage == "call" { name.to_string() } else { format!("{name} ({stage})") }, seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_test_programs_are_read() {
        assert_eq!(rust_time("test a::b ... ok <1.250s>"), Some(("a::b", 1.25)));
        assert_eq!(
            rust_time("test a::b - should panic ... FAILED <0.5s>"),
            Some(("a::b - should panic", 0.5))
        );
        assert_eq!(rust_time("test a::b ... ok"), None);
        assert_eq!(rust_ignored("test a::b ... ignored, slow: a minute"), Some(("a::b", "slow")));
        assert_eq!(
            python_time("12.50s call     tests/x.py::test_y[1]"),
            Some(("tests/x.py::test_y[1]".into(), 12.5))
        );
        assert_eq!(python_time("0.50s setup    x.py::y"), Some(("x.py::y (setup)".into(), 0.5)));
        assert_eq!(python_time("35 passed in 12.50s"), None);
    }
}
