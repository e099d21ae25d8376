//! The innermost loop of the blur: a few output rows of one vector of columns.

use crate::simd::Lanes;

/// What a block of output rows is made of.
pub(super) struct Block<'a> {
    /// First vector of the first row, in the input.
    pub(super) at: *const f32,
    /// Distance of rows.
    pub(super) stride: usize,
    /// The middle one first.
    pub(super) weights: &'a [f32],
    /// The k that count, the end not included.
    pub(super) range: (usize, usize),
}

impl Block<'_> {
    /// `ROWS` sums. The rows above and below are kept in registers while k grows, so that each k loads two new ones (three
    /// sets of `ROWS` registers).
    ///
    /// # Safety
    /// The processor must have the instructions of `L`; rows as far away as the range reaches must be valid.
    #[inline(always)]
    pub(super) unsafe fn sums<L: Lanes, const ROWS: usize>(&self) -> [L::Vector; ROWS] {
        // SAFETY: see above.
        unsafe {
            let zero = L::splat(0.0);
            let mut sums = [zero; ROWS];
            let (mut k, end) = self.range;
            if k >= end {
                return sums;
            }
            if k == 0 {
                let weight = L::splat(*self.weights.get_unchecked(0));
                for (r, sum) in sums.iter_mut().enumerate() {
                    *sum = L::fused(weight, L::load(self.at.add(r * self.stride)), zero);
                }
                k = 1;
            }
            // Rows k above and k below the first one.
            let mut walk = Walk {
                above: self.at.wrapping_sub(k * self.stride),
                below: self.at.wrapping_add(k * self.stride),
                stride: self.stride,
                weight: self.weights.as_ptr().wrapping_add(k),
                up: [zero; ROWS],
                down: [zero; ROWS],
            };
            if k >= end {
                return sums;
            }
            for r in 0..ROWS {
                walk.up[r] = L::load(walk.above.add(r * self.stride));
                walk.down[r] = L::load(walk.below.add(r * self.stride));
            }
            let mut left = end - k;
            loop {
                // Registers keep their places for `ROWS` steps; a step that is not there is skipped for good.
                walk.phase::<L, 0>(&mut sums, &mut left);
                walk.phase::<L, 1>(&mut sums, &mut left);
                walk.phase::<L, 2>(&mut sums, &mut left);
                walk.phase::<L, 3>(&mut sums, &mut left);
                walk.phase::<L, 4>(&mut sums, &mut left);
                walk.phase::<L, 5>(&mut sums, &mut left);
                walk.phase::<L, 6>(&mut sums, &mut left);
                walk.phase::<L, 7>(&mut sums, &mut left);
                if left == 0 {
                    return sums;
                }
            }
        }
    }
}

/// Where a block is as k grows.
struct Walk<V, const ROWS: usize> {
    above: *const f32,
    below: *const f32,
    stride: usize,
    weight: *const f32,
    /// The rows above; which one is in which place changes with the phase.
    up: [V; ROWS],
    down: [V; ROWS],
}

impl<V: Copy, const ROWS: usize> Walk<V, ROWS> {
    /// One k. `PHASE` counts them modulo `ROWS`: the registers stay where they are and their roles move on.
    ///
    /// # Safety
    /// As for [`Block::sums`].
    #[inline(always)]
    unsafe fn phase<L: Lanes<Vector = V>, const PHASE: usize>(
        &mut self,
        sums: &mut [V; ROWS],
        left: &mut usize,
    ) {
        if PHASE >= ROWS || *left == 0 {
            return;
        }
        *left -= 1;
        // SAFETY: see above; the rows loaded ahead are within the spare rows.
        unsafe {
            let weight = L::splat(*self.weight);
            for r in 0..ROWS {
                let pair = L::add(self.up[(r + ROWS - PHASE) % ROWS], self.down[(r + PHASE) % ROWS]);
                sums[r] = L::fused(weight, pair, sums[r]);
            }
            self.weight = self.weight.wrapping_add(1);
            self.above = self.above.wrapping_sub(self.stride);
            self.up[ROWS - 1 - PHASE] = L::load(self.above);
            self.down[PHASE] = L::load(self.below.add(ROWS * self.stride));
            self.below = self.below.wrapping_add(self.stride);
        }
    }
}
