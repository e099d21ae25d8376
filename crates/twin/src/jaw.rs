//! The two jaws of the gripper.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// One jaw. The left jaw stands at +y of `world` and closes along -y, the right jaw mirrors it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Jaw {
    /// The jaw at +y.
    Left,
    /// The jaw at -y.
    Right,
}

impl Jaw {
    /// Both jaws, in the order in which every per-jaw quantity is stored.
    pub const BOTH: [Jaw; 2] = [Jaw::Left, Jaw::Right];

    /// +1 for the left jaw, -1 for the right one: the sign of its place on the jaw axis.
    pub fn side(self) -> f64 {
        match self {
            Jaw::Left => 1.0,
            Jaw::Right => -1.0,
        }
    }
}

impl fmt::Display for Jaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Jaw::Left => "left",
            Jaw::Right => "right",
        })
    }
}

/// A value for each jaw.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerJaw<T> {
    /// Value of the left jaw.
    pub left: T,
    /// Value of the right jaw.
    pub right: T,
}

impl<T> PerJaw<T> {
    /// Calls `f` for the left, then for the right jaw.
    pub fn from_fn(mut f: impl FnMut(Jaw) -> T) -> Self {
        let left = f(Jaw::Left);
        let right = f(Jaw::Right);
        Self { left, right }
    }

    /// Like [`PerJaw::from_fn`] for a function that can fail.
    ///
    /// # Errors
    ///
    /// The first error of `f`, of the left jaw before the right one.
    pub fn try_from_fn<E>(mut f: impl FnMut(Jaw) -> Result<T, E>) -> Result<Self, E> {
        let left = f(Jaw::Left)?;
        let right = f(Jaw::Right)?;
        Ok(Self { left, right })
    }

    /// A value of the same shape, left first.
    pub fn map<U>(&self, mut f: impl FnMut(Jaw, &T) -> U) -> PerJaw<U> {
        PerJaw::from_fn(|jaw| f(jaw, &self[jaw]))
    }

    /// Left, then right.
    pub fn iter(&self) -> impl Iterator<Item = (Jaw, &T)> {
        Jaw::BOTH.into_iter().map(|jaw| (jaw, &self[jaw]))
    }
}

impl<T> std::ops::Index<Jaw> for PerJaw<T> {
    type Output = T;
    fn index(&self, jaw: Jaw) -> &T {
        match jaw {
            Jaw::Left => &self.left,
            Jaw::Right => &self.right,
        }
    }
}

impl<T> std::ops::IndexMut<Jaw> for PerJaw<T> {
    fn index_mut(&mut self, jaw: Jaw) -> &mut T {
        match jaw {
            Jaw::Left => &mut self.left,
            Jaw::Right => &mut self.right,
        }
    }
}
