//! Configuration: TOML text in, checked configuration out.
//!
//! Two stages. A [`Document`] is the text, its values and where each value stands; it is read into plain
//! structs that mirror the file ([`TwinFile`], [`SweepFile`]). Those are checked once and become [`crate::Twin`]
//! and [`crate::Sweep`], which cannot be invalid and hold SI units. Every complaint names a key; the document
//! turns the key into a place.

mod document;
mod draw_file;
mod images_file;
mod keys;
mod prior_file;
mod sweep_file;
mod twin_file;

pub(crate) use document::read_twin_table;
pub use document::{Document, Place};
pub(crate) use draw_file::read as read_vary;
pub use images_file::{Compression, DuringPullFile, ImageStorage, ImagesFile};
pub use keys::{DEFAULTED_SECTIONS, is_twin_key};
pub(crate) use keys::{assign, check_part, get, of_part, segments};
pub use prior_file::{PriorFile, missing_effects};
pub use sweep_file::{
    Backend, DesignFile, GroupsFile, JitteredStep, Mechanics, PullFile, StepFile, SweepFile, TraceStorage,
};
pub use twin_file::{
    ArmFile, CalibrationFile, EffectFile, Feedback, ForceConvention, GelFile, GelModel, GripFile,
    GripperFile, ImageNoise, OpticsFile, PartFile, PerJawFile, RobotFile, RobotModel, TableChannels,
    TwinFile, Twist, WristFile,
};

use std::ops::RangeBounds;

/// A fault in a configuration: which key, what is wrong, where it stands and what to do.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigError {
    /// Dotted key, empty for the file as a whole.
    pub key: String,
    /// What is wrong, with the numbers that disagree.
    pub problem: String,
    /// What to do about it.
    pub hint: Option<String>,
    /// Where it stands.
    pub place: Option<Box<Place>>,
}

impl ConfigError {
    /// A complaint about `key`, not yet placed.
    pub fn new(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { key: key.into(), problem: problem.into(), hint: None, place: None }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds the one of some known names that `typed` was probably meant to be as a hint; another hint where there is none.
    pub(crate) fn suggest<'a>(
        self,
        typed: &str,
        known: impl IntoIterator<Item = &'a str>,
        otherwise: impl FnOnce() -> String,
    ) -> Self {
        self.hint(match suggestion(typed, known) {
            Some(name) => format!("did you mean `{name}`?"),
            None => otherwise(),
        })
    }

    /// A part that the twin does not have.
    pub(crate) fn unknown_part<'a>(
        key: impl Into<String>,
        part: &str,
        parts: impl Iterator<Item = &'a String>,
    ) -> Self {
        let parts: Vec<&str> = parts.map(String::as_str).collect();
        let error = Self::new(key, format!("the twin has no part `{part}`"));
        error.suggest(part, parts.iter().copied(), || format!("its parts: {}", parts.join(", ")))
    }
}

impl std::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{}", place.file)?;
            if let Some((line, column)) = place.line_and_column() {
                write!(f, ":{line}:{column}")?;
            }
            f.write_str(": ")?;
        }
        if self.key.is_empty() {
            f.write_str(&self.problem)
        } else {
            write!(f, "{}: {}", self.key, self.problem)
        }
    }
}

impl std::error::Error for ConfigError {}

/// The name among `known` that `typed` was probably meant to be: one that begins like it, or is a few letters off.
pub fn suggestion<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| {
            let begins = !typed.is_empty() && name.starts_with(typed);
            (!begins, strsim::damerau_levenshtein(typed, name), name)
        })
        .filter(|(other, distance, name)| !other || *distance <= 1 + name.len().min(typed.len()) / 3)
        .min()
        .map(|(_, _, name)| name)
}

/// Whether two words differ by one letter: left out, put in, exchanged for another or with its neighbour.
pub fn one_slip_apart(a: &str, b: &str) -> bool {
    strsim::damerau_levenshtein(a, b) == 1
}

/// Checks that a number is finite and inside `range`.
pub(crate) fn in_range(
    key: &str,
    value: f64,
    range: impl RangeBounds<f64>,
    unit: &str,
) -> Result<f64, ConfigError> {
    use std::ops::Bound;
    if value.is_finite() && range.contains(&value) {
        return Ok(value);
    }
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    let low = match range.start_bound() {
        Bound::Included(x) => format!("at least {x}{unit}"),
        Bound::Excluded(x) => format!("more than {x}{unit}"),
        Bound::Unbounded => String::new(),
    };
    let high = match range.end_bound() {
        Bound::Included(x) => format!("at most {x}{unit}"),
        Bound::Excluded(x) => format!("less than {x}{unit}"),
        Bound::Unbounded => String::new(),
    };
    let joined = if low.is_empty() || high.is_empty() { low + &high } else { format!("{low} and {high}") };
    Err(ConfigError::new(key, format!("{value}{unit} is out of range, it must be {joined}")))
}
