//! The columns of a pull: what each is called, holds, may be, and where in a pull it stands.
//!
//! One entry of [`COLUMNS`] serves all that reads, writes or names a column: tables of measured pulls, keys of `[vary]`,
//! `index.csv`, datasets, tables of a twin, campaigns of a rig. Outside, a value stands in the unit of its column, inside a
//! pull in SI units.

mod check;
mod list;
pub mod notes;
mod pull;
#[cfg(test)]
mod tests;

pub use list::COLUMNS;
pub use pull::{PullEdit, PullView};

use crate::draw::Drawn;
use crate::{MeasuredPull, Values};
use std::borrow::Cow;

/// Columns of `index.csv` that are none of a pull: where a sample stands.
pub const PLACE_OF_SAMPLE: [&str; 4] = ["index", "shard", "in_shard", "status"];

/// Columns of `index.csv` that are none of a pull: what came out of it.
pub const LABELS_OF_SAMPLE: [&str; 5] =
    ["max_pull_force_n", "slip_time_s", "peak_force_n", "kinetic_force_n", "label_branch"];

/// Columns of `index.csv` that are none of a pull: what only a simulation knows.
pub const ANSWERS_OF_SAMPLE: [&str; 5] =
    ["limit_force_n", "slip_onset_s", "slip_s", "mu_drawn", "mu_effective"];

/// Columns of `index.csv` that are none of a pull: the rest of how a sample ended.
pub const END_OF_SAMPLE: [&str; 3] = ["group", "repetition", "failure"];

/// What a column of a sample is to somebody who trains on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Which sample it is, and how it ended.
    Place,
    /// Known before the pull.
    Input,
    /// What came out of the pull.
    Label,
    /// What no robot knows before the pull: limits, coefficients, drawn keys of the twin.
    Answer,
}

impl Role {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Role::Place => "place",
            Role::Input => "input",
            Role::Label => "label",
            Role::Answer => "answer",
        }
    }
}

/// The role of a column of a sample. A key that is none of a pull is an answer in a sweep, where it was drawn, and an input in measured
/// pulls, where it was noted.
pub fn role_of(name: &str, is_simulated: bool) -> Role {
    let known = PLACE_OF_SAMPLE.contains(&name)
        || END_OF_SAMPLE.contains(&name)
        || ["pull_id", "status_reason"].contains(&name);
    if known {
        Role::Place
    } else if LABELS_OF_SAMPLE.contains(&name) {
        Role::Label
    } else if ANSWERS_OF_SAMPLE.contains(&name) {
        Role::Answer
    } else if find(name).is_some() || !is_simulated || is_pull_key(name) {
        Role::Input
    } else {
        Role::Answer
    }
}

/// Whether a column of `index.csv` is none of a pull.
pub fn is_of_sample(name: &str) -> bool {
    PLACE_OF_SAMPLE.contains(&name)
        || LABELS_OF_SAMPLE.contains(&name)
        || ANSWERS_OF_SAMPLE.contains(&name)
        || END_OF_SAMPLE.contains(&name)
}

/// Whether a key of `[vary]` sets the pull: what a robot is told.
fn is_pull_key(name: &str) -> bool {
    name.starts_with("pull.")
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A name; a number is none.
    Name,
    /// A word; a number stands for its digits.
    Word,
    /// A number.
    Number,
    /// A whole number from 0 on.
    Whole,
    /// 1 (up) or -1 (down).
    Direction,
}

/// The numbers that a column takes, in its unit. All are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Every number.
    Any,
    /// Above 0.
    AboveZero,
    /// 0 and above.
    FromZero,
    /// Between two numbers, both included.
    Between(f64, f64),
}

/// What a column is to a table of measured pulls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InTable {
    /// It has to be there, and is a covariate.
    Required,
    /// A covariate: what a label may depend on.
    Covariate,
    /// It is read and written, and no covariate.
    Setting,
    /// Tables do not have it; a column of this name is one of unknown meaning.
    Absent,
}

/// How a number of a column becomes one in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// It is one.
    Si,
    /// Thousandths: millimetres.
    Thousandth,
    /// Degrees of an angle.
    Degree,
}

/// Where a column stands in a pull. Numbers are in SI units.
#[derive(Debug, Clone, Copy)]
pub enum Held {
    /// A word in a field of its own.
    Word {
        /// Reads it.
        get: for<'a> fn(PullView<'a>) -> &'a str,
        /// Writes it.
        set: fn(&mut PullEdit<'_>, String),
    },
    /// A number in a field of its own.
    Number {
        /// Reads it; `None` where the pull has none.
        get: fn(PullView<'_>) -> Option<f64>,
        /// Writes it.
        set: fn(&mut PullEdit<'_>, f64),
    },
    /// Among [`crate::Covariates::extra`], under the name of the column and in its unit.
    Extra,
}

/// A column of a pull.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Its name in tables.
    pub name: &'static str,
    /// Unit of its numbers, `1` where they have none; empty for words.
    pub unit: &'static str,
    /// What it says of a pull.
    pub about: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// Other names of it, keys of sections of a sweep: `pull.increment_n`. The first one is its key in `[vary]`; where there
    /// is none its name is.
    pub aliases: &'static [&'static str],
    /// What it is to a table of measured pulls.
    pub in_table: InTable,
    /// Numbers that a cell of a table may be. People measured them: they may lie anywhere.
    pub table_range: Range,
    /// Numbers that a sweep may draw: those that can be simulated.
    pub sweep_range: Range,
    /// How its numbers become SI units.
    pub scale: Scale,
    /// Whether it is one of the fixed columns of `index.csv`.
    pub indexed: bool,
    /// Whether a rig knows it of the pulls that it makes.
    pub known_to_rig: bool,
    /// Where it stands in a pull.
    pub held: Held,
}

/// The column of a name or an alias.
pub fn find(name: &str) -> Option<&'static Column> {
    COLUMNS.iter().find(|c| c.name == name || c.aliases.contains(&name))
}

/// The columns of a table of measured pulls that are covariates, in the order in which they are written: those that every
/// table has come first.
pub fn covariates() -> impl Iterator<Item = &'static Column> + Clone {
    let of = |wanted: InTable| COLUMNS.iter().filter(move |c| c.in_table == wanted);
    of(InTable::Required).chain(of(InTable::Covariate))
}

/// The covariate of a name, without aliases.
pub fn covariate(name: &str) -> Option<&'static Column> {
    COLUMNS.iter().find(|c| c.name == name).filter(|c| c.is_covariate())
}

/// Names of the covariates that a table was written with: those that were recorded, and those that every table has.
pub fn recorded_covariates(recorded: &[String]) -> impl Iterator<Item = &'static Column> + Clone {
    covariates().filter(|c| c.in_table == InTable::Required || recorded.iter().any(|r| r == c.name))
}

/// A covariate of a pull by the name of its column, in the unit of that column, whether its meaning is known or not; `None`
/// if nobody wrote it down.
pub fn value(name: &str, pull: PullView<'_>) -> Option<Drawn> {
    match covariate(name) {
        Some(column) => column.value(pull),
        None => pull.covariates.extra.get(name).cloned(),
    }
}

impl Scale {
    /// A number in the unit of its column in SI units.
    pub fn to_si(self, x: f64) -> f64 {
        match self {
            Scale::Si => x,
            Scale::Thousandth => x * 1e-3,
            Scale::Degree => x.to_radians(),
        }
    }

    /// A number in SI units in the unit of its column.
    pub fn from_si(self, x: f64) -> f64 {
        match self {
            Scale::Si => x,
            Scale::Thousandth => x * 1e3,
            Scale::Degree => x.to_degrees(),
        }
    }

    /// The same without the last bits that the way to SI and back costs: 30 degrees, not 29.999999999999996. So that rows of
    /// one setting can be grouped by it.
    pub fn as_written(self, x: f64) -> f64 {
        match self {
            Scale::Si => x,
            Scale::Thousandth | Scale::Degree => (self.from_si(x) * 1e9).round() / 1e9,
        }
    }
}

impl Column {
    /// Its key in `[vary]`.
    pub fn sweep_key(&self) -> &'static str {
        self.aliases.first().copied().unwrap_or(self.name)
    }

    /// Whether it holds words.
    pub fn holds_words(&self) -> bool {
        matches!(self.kind, Kind::Name | Kind::Word)
    }

    /// Whether a sweep draws it from a list: a distribution hits no name and no whole number.
    pub fn is_listed(&self) -> bool {
        self.kind != Kind::Number
    }

    /// Whether it is a covariate of a table of measured pulls.
    pub fn is_covariate(&self) -> bool {
        matches!(self.in_table, InTable::Required | InTable::Covariate)
    }

    /// Its number in a pull, in its unit; `None` where there is none.
    pub fn number(&self, pull: PullView<'_>) -> Option<f64> {
        self.number_by(pull, Scale::from_si)
    }

    /// Its number in a pull, in its unit and without the last bits that the way to SI and back costs; `None` where there is
    /// none.
    pub fn written_number(&self, pull: PullView<'_>) -> Option<f64> {
        self.number_by(pull, Scale::as_written)
    }

    /// Whether the cell of this pull was empty where other pulls have a value.
    pub fn is_missing(&self, pull: PullView<'_>) -> bool {
        pull.covariates.missing.contains(self.name)
    }

    fn number_by(&self, pull: PullView<'_>, from_si: fn(Scale, f64) -> f64) -> Option<f64> {
        match self.held {
            _ if self.is_missing(pull) => None,
            Held::Number { get, .. } => get(pull).map(|x| from_si(self.scale, x)),
            Held::Word { .. } => None,
            Held::Extra => match pull.covariates.extra.get(self.name)? {
                Drawn::Number(x) => Some(*x),
                Drawn::Text(_) => None,
            },
        }
    }

    /// Its word in a pull; `None` where there is none.
    pub fn word<'a>(&self, pull: PullView<'a>) -> Option<&'a str> {
        match self.held {
            _ if self.is_missing(pull) => None,
            Held::Word { get, .. } => Some(get(pull)),
            Held::Number { .. } => None,
            Held::Extra => match pull.covariates.extra.get(self.name)? {
                Drawn::Text(word) => Some(word),
                Drawn::Number(_) => None,
            },
        }
    }

    /// Its value in a pull, in its unit; `None` where there is none.
    pub fn value(&self, pull: PullView<'_>) -> Option<Drawn> {
        match self.holds_words() {
            true => self.word(pull).map(|word| Drawn::Text(word.into())),
            false => self.number(pull).map(Drawn::Number),
        }
    }

    /// Its values in measured pulls, in its unit.
    pub fn values(&self, pulls: &[MeasuredPull]) -> Values {
        match self.holds_words() {
            true => {
                let word = |p: &MeasuredPull| self.word(p.view()).unwrap_or_default().into();
                Values::Words(pulls.iter().map(word).collect())
            }
            false => {
                let number = |p: &MeasuredPull| self.number(p.view()).unwrap_or(f64::NAN);
                Values::Numbers(pulls.iter().map(number).collect())
            }
        }
    }

    /// Its value in a pull as it stands in a file, without the last bits that the way to SI and back costs; empty where there
    /// is none.
    pub fn cell<'a>(&self, pull: PullView<'a>) -> Cow<'a, str> {
        if self.holds_words() {
            return self.word(pull).unwrap_or_default().into();
        }
        self.written_number(pull).map_or("".into(), |x| x.to_string().into())
    }

    /// Puts a number of its unit into a pull.
    pub fn set_number(&self, pull: &mut PullEdit<'_>, x: f64) {
        match self.held {
            Held::Number { set, .. } => set(pull, self.scale.to_si(x)),
            Held::Word { set, .. } => set(pull, x.to_string()),
            Held::Extra => drop(pull.covariates.extra.insert(self.name.into(), Drawn::Number(x))),
        }
    }

    /// Puts a word into a pull; a column of numbers takes none.
    pub fn set_word(&self, pull: &mut PullEdit<'_>, word: &str) {
        match self.held {
            Held::Word { set, .. } => set(pull, word.into()),
            Held::Number { .. } => {}
            Held::Extra => drop(pull.covariates.extra.insert(self.name.into(), Drawn::Text(word.into()))),
        }
    }
}
