//! The columns of a pull: what each is called, holds, may be, and where in a pull it stands.
//!
//! One entry of [`COLUMNS`] serves all that reads, writes or names a column: tables of measured pulls, keys of `[vary]`,
//! `index.csv`, datasets, tables of a twin, campaigns of a rig. Outside, a value stands in the unit of its column, inside a
//! pull in SI units.

mod list;
mod pull;
#[cfg(test)]
mod tests;

pub use list::COLUMNS;
pub use pull::{PullEdit, PullView};

use crate::config::{ConfigError, in_range};
use crate::draw::Drawn;
use std::borrow::Cow;

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

impl Range {
    /// Whether a number is one of them.
    pub fn contains(self, x: f64) -> bool {
        x.is_finite()
            && match self {
                Range::Any => true,
                Range::AboveZero => x > 0.0,
                Range::FromZero => x >= 0.0,
                Range::Between(low, high) => (low..=high).contains(&x),
            }
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

    fn number_by(&self, pull: PullView<'_>, from_si: fn(Scale, f64) -> f64) -> Option<f64> {
        match self.held {
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

    /// Whether a number is what the column holds, within a range.
    fn takes(&self, range: Range, x: f64) -> bool {
        let of_kind = match self.kind {
            Kind::Whole => x >= 0.0 && x.fract() == 0.0,
            Kind::Direction => x.abs() == 1.0,
            _ => true,
        };
        of_kind && range.contains(x)
    }

    /// What a cell of a table must be: "a number above 0".
    pub fn wanted(&self) -> Cow<'static, str> {
        match (self.kind, self.table_range) {
            (Kind::Name | Kind::Word, _) => "a name".into(),
            (Kind::Direction, _) => "1 (up) or -1 (down)".into(),
            (Kind::Whole, _) => "a whole number of at least 0".into(),
            (Kind::Number, Range::Any) => "a number".into(),
            (Kind::Number, Range::AboveZero) => "a number above 0".into(),
            (Kind::Number, Range::FromZero) => "a number of at least 0".into(),
            (Kind::Number, Range::Between(low, high)) => format!("a number from {low} to {high}").into(),
        }
    }

    /// Checks a number that stands in a table, in the unit of the column.
    ///
    /// # Errors
    /// What it must be, if it is not that.
    pub fn check_measured(&self, x: f64) -> Result<f64, Cow<'static, str>> {
        if self.takes(self.table_range, x) { Ok(x) } else { Err(self.wanted()) }
    }

    /// Puts a cell of a table into a pull.
    ///
    /// # Errors
    /// What the cell must be, if it is not that; the pull is as it was.
    pub fn read_cell(&self, cell: &str, pull: &mut PullEdit<'_>) -> Result<(), Cow<'static, str>> {
        if self.holds_words() {
            if cell.is_empty() {
                return Err(self.wanted());
            }
            self.set_word(pull, cell);
            return Ok(());
        }
        let x = cell.parse::<f64>().map_err(|_| self.wanted())?;
        self.set_number(pull, self.check_measured(x)?);
        Ok(())
    }

    /// Checks a number that a sweep draws for `key`, in the unit of the column.
    ///
    /// # Errors
    /// The number and what it must be.
    pub(crate) fn check_drawn(&self, key: &str, x: f64) -> Result<f64, ConfigError> {
        if self.kind == Kind::Direction && x.abs() != 1.0 {
            return Err(ConfigError::new(key, format!("{x} is neither 1 (up) nor -1 (down)")));
        }
        match self.sweep_range {
            Range::Any if x.is_finite() => x,
            Range::Any => return Err(ConfigError::new(key, format!("{x} is not a finite number"))),
            Range::AboveZero => in_range(key, x, f64::MIN_POSITIVE.., self.unit)?,
            Range::FromZero => in_range(key, x, 0.0.., self.unit)?,
            Range::Between(low, high) => in_range(key, x, low..=high, self.unit)?,
        };
        if self.kind == Kind::Whole && x.fract() != 0.0 {
            return Err(ConfigError::new(key, format!("{x} is not a whole number")));
        }
        Ok(x)
    }

    /// Puts what a sweep drew for `key` into a pull. A number out of range is put in too, so that the record of a failed sample
    /// says what was drawn; one that is no whole number is not, nor is it where a column of names is meant.
    ///
    /// # Errors
    /// The value is not of the kind of the column; its range is for [`Self::check_drawn`].
    pub(crate) fn set_drawn(
        &self,
        pull: &mut PullEdit<'_>,
        key: &str,
        value: &Drawn,
    ) -> Result<(), ConfigError> {
        match (self.kind, value) {
            (Kind::Name, Drawn::Number(x)) => {
                Err(ConfigError::new(key, format!("a name is needed, found the number {x}")))
            }
            (Kind::Name | Kind::Word, value) => {
                self.set_word(pull, &value.to_string());
                Ok(())
            }
            (_, Drawn::Text(text)) => {
                Err(ConfigError::new(key, format!("a number is needed, found `{text}`")))
            }
            (Kind::Whole, Drawn::Number(x)) => {
                self.set_number(pull, self.check_drawn(key, *x)?);
                Ok(())
            }
            (_, Drawn::Number(x)) => {
                self.set_number(pull, *x);
                Ok(())
            }
        }
    }
}
