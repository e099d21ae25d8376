//! The file of a machine's numbers.

use super::machine::Machine;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const SCHEMA: &str = "gripgen.bench/1";

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Time of one call.
    #[serde(rename = "ns")]
    Nanoseconds,
    /// Time of one call.
    #[serde(rename = "s")]
    Seconds,
    /// Largest resident size.
    #[serde(rename = "MB")]
    Megabytes,
    /// Instructions of one call, outside the kernel of the system.
    #[serde(rename = "instructions")]
    Instructions,
}

impl Unit {
    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Nanoseconds => "ns",
            Unit::Seconds => "s",
            Unit::Megabytes => "MB",
            Unit::Instructions => "instructions",
        }
    }
}

/// The numbers of one benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The benchmark binary that measured it.
    pub target: String,
    /// What the numbers are.
    pub unit: Unit,
    /// One number per sample, in the order in which they were taken.
    pub samples: Vec<f64>,
}

impl Entry {
    /// With six digits a number: more is noise.
    pub fn new(target: &str, unit: Unit, samples: Vec<f64>) -> Self {
        Self { target: target.into(), unit, samples: samples.into_iter().map(six_digits).collect() }
    }

    /// The smallest sample. What disturbs a run (other programs, interrupts, a cold cache) only makes it longer, so that the
    /// smallest is the one that says most about the code; means and medians of a shared machine move by half with its load.
    pub fn least(&self) -> f64 {
        self.samples.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// A machine and what it measured.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Baseline {
    /// Where it was measured.
    pub machine: Machine,
    /// By name.
    pub benches: BTreeMap<String, Entry>,
}

#[derive(Deserialize)]
struct Document {
    schema: String,
    machine: Machine,
    benches: BTreeMap<String, Entry>,
}

impl Baseline {
    /// Reads a file; `None` where there is none.
    pub fn read(path: &Path) -> Result<Option<Self>, String> {
        match std::fs::read_to_string(path) {
            Ok(text) => Self::parse(&text).map(Some),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e.to_string()),
        }
    }

    /// Reads a text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Document { schema, machine, benches } = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if schema != SCHEMA {
            return Err(format!("its schema is `{schema}`, not `{SCHEMA}`"));
        }
        Ok(Self { machine, benches })
    }

    /// As text, a benchmark a line.
    pub fn text(&self) -> Result<String, String> {
        let json = |value: serde_json::Result<String>| value.map_err(|e| e.to_string());
        let machine = json(serde_json::to_string_pretty(&self.machine))?.replace('\n', "\n  ");
        let lines: Result<Vec<String>, String> = self
            .benches
            .iter()
            .map(|(name, entry)| {
                Ok(format!(
                    "    {}: {}",
                    json(serde_json::to_string(name))?,
                    json(serde_json::to_string(entry))?
                ))
            })
            .collect();
        let lines = lines?.join(",\n");
        Ok(format!(
            "{{\n  \"schema\": \"{SCHEMA}\",\n  \"machine\": {machine},\n  \"benches\": {{\n{lines}\n  }}\n}}\n"
        ))
    }

    /// Writes a file.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
        }
        std::fs::write(path, self.text()?).map_err(|e| e.to_string())
    }
}
