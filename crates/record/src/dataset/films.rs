//! Films of a row's pull.

use super::{Dataset, DatasetError, Source};
use crate::film::Film;

impl Dataset {
    /// Whether pulls of its rows are filmed.
    ///
    /// # Errors
    ///
    /// A shard that cannot be read.
    pub fn has_films(&self) -> Result<bool, DatasetError> {
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => Ok(self.shard_of(0)?.0.has_film()),
            Source::Measured(_) => Ok(false),
        }
    }

    /// The film of a row's pull, where there is one.
    ///
    /// # Errors
    ///
    /// A row that is not there, or a shard that cannot be read.
    pub fn film(&self, row: usize) -> Result<Option<Film>, DatasetError> {
        self.check_row(row)?;
        if matches!(self.source, Source::Measured(_)) {
            return Ok(None);
        }
        let (reader, index) = self.shard_of(row)?;
        Ok(reader.film(index)?)
    }
}
