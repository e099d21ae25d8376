//! Data to standard output or a file.

use crate::failure::Failure;
use crate::outputs::Outputs;
use serde_json::Value;
use std::cell::Cell;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::OnceLock;

/// Where JSON goes.
pub enum JsonSink {
    /// Nowhere: it was not asked for.
    None,
    /// Standard output.
    Stdout,
    /// A file.
    File(JsonFile),
}

/// JSON on its way into a file.
pub struct JsonFile {
    outputs: Outputs,
    path: PathBuf,
    /// Open where lines are written as things happen.
    lines: Option<File>,
}

impl JsonSink {
    /// The sink that `--json [FILE]` asks for. A file is not touched before there is something to write.
    pub fn open(asked: Option<&str>, outputs: &mut Outputs) -> Result<Self, Failure> {
        match asked {
            None => Ok(JsonSink::None),
            Some("-") => Ok(JsonSink::Stdout),
            Some(path) => {
                let path = PathBuf::from(path);
                outputs.allow(&path)?;
                Ok(JsonSink::File(JsonFile { outputs: outputs.clone(), path, lines: None }))
            }
        }
    }

    /// Whether JSON was asked for.
    pub fn wanted(&self) -> bool {
        !matches!(self, JsonSink::None)
    }

    /// Whether standard output belongs to JSON.
    pub fn on_stdout(&self) -> bool {
        matches!(self, JsonSink::Stdout)
    }

    /// Ends a verb: its document where JSON was asked for, its text for people unless standard output is taken or `quiet`.
    pub fn finish(
        mut self,
        quiet: bool,
        document: impl FnOnce() -> Value,
        text: impl FnOnce() -> String,
    ) -> Result<u8, Failure> {
        if self.wanted() {
            self.document(&document())?;
        }
        if !self.on_stdout() && !quiet {
            print(&text())?;
        }
        Ok(0)
    }

    /// Writes a value on one line, one of many.
    pub fn line(&mut self, value: &Value) -> Result<(), Failure> {
        match self {
            JsonSink::None => Ok(()),
            JsonSink::Stdout => print(&format!("{value}\n")),
            JsonSink::File(file) => file.line(value),
        }
    }

    /// Writes a value for people to read.
    pub fn document(&mut self, value: &Value) -> Result<(), Failure> {
        match self {
            JsonSink::None => Ok(()),
            JsonSink::Stdout => print(&format!("{value:#}\n")),
            JsonSink::File(JsonFile { outputs, path, .. }) => {
                outputs.write(path, format!("{value:#}\n").as_bytes())
            }
        }
    }
}

impl JsonFile {
    fn line(&mut self, value: &Value) -> Result<(), Failure> {
        let line = format!("{value}\n");
        let failed = |e: io::Error| Failure::new(format!("writing JSON: {e}"));
        if let Some(file) = &mut self.lines {
            return file.write_all(line.as_bytes()).map_err(failed);
        }
        let mut pending = self.outputs.begin(&self.path)?;
        pending.file.write_all(line.as_bytes()).map_err(failed)?;
        self.lines = Some(pending.publish()?);
        Ok(())
    }
}

static PROGRAM: OnceLock<String> = OnceLock::new();

/// Keeps how gripgen was called, for commands that it proposes.
pub fn remember_program(name: Option<&OsString>) {
    if let Some(name) = name {
        let _ = PROGRAM.set(name.to_string_lossy().into_owned());
    }
}

/// How gripgen was called: `gripgen`, or the path of a binary that is not installed.
pub fn program() -> &'static str {
    PROGRAM.get().map_or("gripgen", String::as_str)
}

thread_local! {
    static SILENT: Cell<bool> = const { Cell::new(false) };
}

/// Does `work` without a word on standard output: its caller is a program that asked for files.
pub fn silently<T>(work: impl FnOnce() -> T) -> T {
    let before = SILENT.replace(true);
    let done = work();
    SILENT.set(before);
    done
}

/// Writes to standard output. A reader that hung up (`| head`) is no failure.
pub fn print(text: &str) -> Result<(), Failure> {
    if SILENT.get() {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.map_err(|e| Failure::new(format!("standard output: {e}"))),
    }
}

/// So many of something: `1 shard`, `2 shards`.
pub fn count(n: u64, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// A size for people.
pub fn size(bytes: u64) -> String {
    let (mut x, mut unit) = (bytes as f64, "B");
    for next in ["kB", "MB", "GB", "TB", "PB"] {
        if x < 999.5 {
            break;
        }
        (x, unit) = (x / 1000.0, next);
    }
    if unit == "B" || x >= 99.5 { format!("{x:.0} {unit}") } else { format!("{x:.1} {unit}") }
}

/// A duration for people.
pub fn duration(seconds: f64) -> String {
    if seconds < 60.0 {
        return if seconds < 9.95 { format!("{seconds:.1} s") } else { format!("{seconds:.0} s") };
    }
    let s = seconds.round() as u64;
    match s {
        0..3600 => format!("{} min {:02} s", s / 60, s % 60),
        3600..172_800 => format!("{} h {:02} min", s / 3600, s / 60 % 60),
        _ => format!("{:.1} days", seconds / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_durations_read_well() {
        assert_eq!([0, 1, 2].map(|n| count(n, "shard")), ["0 shards", "1 shard", "2 shards"]);
        for (bytes, text) in
            [(0, "0 B"), (999, "999 B"), (1000, "1.0 kB"), (123_456, "123 kB"), (2_500_000, "2.5 MB")]
        {
            assert_eq!(size(bytes), text);
        }
        for (s, text) in [
            (0.04, "0.0 s"),
            (12.3, "12 s"),
            (65.0, "1 min 05 s"),
            (7260.0, "2 h 01 min"),
            (864_000.0, "10.0 days"),
        ] {
            assert_eq!(duration(s), text);
        }
    }
}
