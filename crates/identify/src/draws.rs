//! Random numbers of permutation tests and of simulated data.

use gripgen_twin::random::{normal_quantile, splitmix64};

/// SplitMix64 (Steele, Lea, Flood 2014): every number is a function of the seed and of how many were drawn before it.
#[derive(Debug, Clone)]
pub struct Draws {
    state: u64,
}

impl Draws {
    /// The numbers of a seed; `lane` keeps the uses of one seed apart.
    pub fn new(seed: u64, lane: u64) -> Self {
        let mut start = Self { state: seed ^ lane.wrapping_mul(0xD134_2543_DE82_EF95) };
        let state = start.bits();
        Self { state }
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        splitmix64(&mut self.state)
    }

    /// Uniform in the open interval (0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        normal_quantile(self.uniform())
    }

    /// One of `0..n`; `n` is at least 1. The bias against equal chances is below n / 2^64.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// Puts a slice into random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First output of the reference implementation for state 0 (Vigna, splitmix64.c).
    #[test]
    fn bits_are_those_of_splitmix64() {
        let mut draws = Draws { state: 0 };
        assert_eq!(draws.bits(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(draws.bits(), 0x6E78_9E6A_A1B9_65F4);
    }

    #[test]
    fn every_order_of_three_is_as_frequent() {
        let mut counts = std::collections::BTreeMap::new();
        let mut draws = Draws::new(3, 1);
        for _ in 0..6000 {
            let mut items = [0, 1, 2];
            draws.shuffle(&mut items);
            *counts.entry(items).or_insert(0_u32) += 1;
        }
        assert_eq!(counts.len(), 6);
        // Standard deviation of a count is 29.
        assert!(counts.values().all(|&n| n.abs_diff(1000) < 120), "{counts:?}");
    }
}
