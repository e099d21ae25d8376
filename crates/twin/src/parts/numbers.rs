//! Random sizes of generated parts.

use super::outline::Edge;
use crate::random::{Purpose, Stream};

/// A stream of sizes: the same seed gives the same part.
pub(super) struct Numbers(Stream);

impl Numbers {
    /// For variant `index` of family number `family` of a seed.
    pub(super) fn new(seed: u64, family: u64, index: u64) -> Self {
        Self(Stream::with_lane(seed, index, Purpose::Draw, family))
    }

    /// A length between two, in tenths of a millimetre.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        ((low + (high - low) * self.0.uniform()) * 10.0).round() / 10.0
    }

    /// A number from 0 to 1.
    pub(super) fn share(&mut self) -> f64 {
        self.0.uniform()
    }

    /// A whole number from `low` to `high`.
    pub(super) fn whole(&mut self, low: usize, high: usize) -> usize {
        low + ((high + 1 - low) as f64 * self.0.uniform()) as usize
    }

    /// One of a few.
    pub(super) fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.whole(0, all.len() - 1)]
    }

    /// True in this share of cases.
    pub(super) fn chance(&mut self, share: f64) -> bool {
        self.0.uniform() < share
    }

    /// A finish: a chamfer or a rounding of a size between two.
    pub(super) fn edge(&mut self, low: f64, high: f64) -> Edge {
        let size = self.between(low, high);
        if self.chance(0.5) { Edge::Chamfer(size) } else { Edge::Round(size) }
    }
}
