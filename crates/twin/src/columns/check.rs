//! What a column takes: one check for cells of tables, one for what a sweep draws, in one place.

use super::{Column, Kind, PullEdit, Range};
use crate::config::{ConfigError, in_range};
use crate::draw::Drawn;
use std::borrow::Cow;

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

impl Column {
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
