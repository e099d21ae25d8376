//! What a column of a dataset is to somebody who trains on it.

use super::{Dataset, Source};
use crate::shard::RIG_SOURCE;
use gripgen_twin::columns::{Role, role_of};

impl Dataset {
    /// What a column is to somebody who trains on it.
    pub fn role(&self, name: &str) -> Role {
        let is_simulated = match &self.source {
            Source::Run { folder, .. } => folder.info().source != RIG_SOURCE,
            Source::Shard(reader) => !reader.is_rig(),
            Source::Measured(_) => false,
        };
        role_of(name, is_simulated)
    }

    /// What a column is called in an export: answers are marked.
    pub(crate) fn exported_name(&self, name: &str) -> String {
        if self.role(name) == Role::Answer { format!("answer.{name}") } else { name.into() }
    }
}
