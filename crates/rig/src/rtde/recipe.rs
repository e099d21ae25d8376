//! Recipes: which fields a data frame holds, in which order.

use super::value::{FieldType, Value, ValueError};

/// Fields of a data frame that the controller has accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recipe {
    /// Its number on the wire.
    pub id: u8,
    /// Name and type of each field.
    pub fields: Vec<(String, FieldType)>,
}

/// A recipe that the controller does not accept, or a reply that does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecipeError {
    /// The controller does not know fields.
    #[error("the controller does not know {}", .names.join(", "))]
    NotFound {
        /// Their names.
        names: Vec<String>,
    },
    /// Another client has the fields.
    #[error("another client, or a fieldbus, has {}", .names.join(", "))]
    InUse {
        /// Their names.
        names: Vec<String>,
    },
    /// More or fewer types than names.
    #[error("the controller answers with {found} types to {wanted} names")]
    Count {
        /// Types in the answer.
        found: usize,
        /// Names asked for.
        wanted: usize,
    },
    /// A type that the guide does not list.
    #[error("`{name}` has the unknown type `{found}`")]
    Type {
        /// The field.
        name: String,
        /// Its type.
        found: String,
    },
    /// An answer without a number of the recipe, or that is no text.
    #[error("the answer to a recipe, {bytes} bytes long, cannot be read")]
    Answer {
        /// Its length.
        bytes: usize,
    },
}

impl Recipe {
    /// Reads the controller's answer to `names`.
    pub(super) fn from_answer(names: &[String], answer: &[u8]) -> Result<Self, RecipeError> {
        let unreadable = || RecipeError::Answer { bytes: answer.len() };
        let (&id, types) = answer.split_first().ok_or_else(unreadable)?;
        let types = std::str::from_utf8(types).map_err(|_| unreadable())?;
        let types: Vec<&str> = types.split(',').collect();
        if types.len() != names.len() {
            return Err(RecipeError::Count { found: types.len(), wanted: names.len() });
        }
        let with = |word: &str| -> Vec<String> {
            names.iter().zip(&types).filter(|(_, t)| **t == word).map(|(n, _)| n.clone()).collect()
        };
        let (unknown, taken) = (with("NOT_FOUND"), with("IN_USE"));
        if !unknown.is_empty() {
            return Err(RecipeError::NotFound { names: unknown });
        }
        if !taken.is_empty() {
            return Err(RecipeError::InUse { names: taken });
        }
        let fields = names.iter().zip(&types).map(|(name, found)| {
            let unknown = || RecipeError::Type { name: name.clone(), found: found.to_string() };
            Ok((name.clone(), FieldType::from_name(found).ok_or_else(unknown)?))
        });
        Ok(Self { id, fields: fields.collect::<Result<_, _>>()? })
    }

    /// Bytes of its values, without its number.
    pub fn size(&self) -> usize {
        self.fields.iter().map(|(_, kind)| kind.size()).sum()
    }

    /// The place of a field.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.fields.iter().position(|(n, _)| n == name)
    }

    /// Reads the values of a data frame; `None` if it has another number or length.
    pub(super) fn read(&self, payload: &[u8]) -> Option<Vec<Value>> {
        let (found, mut rest) = payload.split_first()?;
        if *found != self.id || rest.len() != self.size() {
            return None;
        }
        let mut values = Vec::with_capacity(self.fields.len());
        for (_, kind) in &self.fields {
            let (bytes, after) = rest.split_at_checked(kind.size())?;
            values.push(kind.read(bytes)?);
            rest = after;
        }
        Some(values)
    }

    /// The payload of a data frame with these values.
    pub(super) fn write(&self, values: &[Value]) -> Result<Vec<u8>, ValueError> {
        let mut payload = Vec::with_capacity(1 + self.size());
        payload.push(self.id);
        for (index, ((_, wanted), value)) in self.fields.iter().zip(values).enumerate() {
            let (found, wanted) = (value.field_type(), *wanted);
            if found != wanted {
                return Err(ValueError { index, found, wanted });
            }
            value.write(&mut payload);
        }
        Ok(payload)
    }
}
