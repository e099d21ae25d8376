//! The pixels beside a step.

use super::edge::ROWS;
use crate::convolve::Area;
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};

/// Rows whose steps are looked for at once.
pub(super) const COARSE: usize = ROWS;

/// Where the depths of two neighbours differ by more than this, in pixels, points begin to count, and they alone count
/// from [`STEP_PX`] on. In between both do, so that no last bit of a depth decides what a pixel is.
const SLOPE_PX: f32 = 0.5;
const STEP_PX: f32 = 1.0;

/// The pixels of a map beside a step. Memory to be used again.
#[derive(Debug, Clone, Default)]
pub(super) struct Beside {
    /// One bit for each pixel, rows in whole words.
    bits: Vec<u64>,
    /// The bits of [`COARSE`] rows in one.
    coarse: Vec<u64>,
    words: usize,
    /// Where in `pixels` those of a word begin.
    starts: Vec<u32>,
    /// Their places in the image.
    pub(super) pixels: Vec<u32>,
    /// How much the points of each count; the rest is its centre.
    pub(super) weights: Vec<f32>,
    /// Memory for a row.
    largest: Vec<f32>,
}

impl Beside {
    /// Finds those of a contact that is so deep at the centres of pixels, 0 beyond `area`. Returns whether there are any.
    pub(super) fn find(&mut self, depth_px: &Plane, area: Area, level: SimdLevel) -> bool {
        let (width, height) = (depth_px.width, depth_px.height);
        self.words = width.div_ceil(64);
        for (bits, rows) in [(&mut self.bits, height), (&mut self.coarse, height.div_ceil(COARSE))] {
            bits.clear();
            bits.resize(self.words * rows, 0);
        }
        self.pixels.clear();
        self.weights.clear();
        if area.x.0 < area.x.1 && area.y.0 < area.y.1 {
            level.run(Find { beside: self, depth_px, area });
        }
        self.starts.clear();
        let mut count = 0;
        self.starts.extend(self.bits.iter().map(|bits| {
            count += bits.count_ones();
            count - bits.count_ones()
        }));
        !self.pixels.is_empty()
    }

    /// Whether there may be some in a box; both ends count.
    #[inline(always)]
    pub(super) fn may_be_in(&self, rows: (usize, usize), columns: (usize, usize)) -> bool {
        // A closure would not be compiled for the vector unit.
        for block in rows.0 / COARSE..=rows.1 / COARSE {
            if self.any_near(block, columns) {
                return true;
            }
        }
        false
    }

    /// Whether there are some in a block of [`COARSE`] rows, from one column up to another.
    #[inline(always)]
    pub(super) fn any_near(&self, block: usize, columns: (usize, usize)) -> bool {
        any(&self.coarse[block * self.words..][..self.words], columns)
    }

    /// Whether there are some in a row, from one column up to another.
    #[inline(always)]
    pub(super) fn any_in(&self, row: usize, columns: (usize, usize)) -> bool {
        any(&self.bits[row * self.words..][..self.words], columns)
    }

    /// A word of a row, and where in `pixels` its first one is.
    #[inline(always)]
    pub(super) fn word(&self, row: usize, word: usize) -> (u64, u32) {
        let at = row * self.words + word;
        (self.bits[at], self.starts[at])
    }
}

/// Whether a bit of a row is set, from one column up to another.
#[inline(always)]
fn any(words: &[u64], (first, last): (usize, usize)) -> bool {
    let (from, to) = (first / 64, last / 64);
    let (low, high) = (u64::MAX << (first % 64), u64::MAX >> (63 - last % 64));
    if from == to {
        return words[from] & low & high != 0;
    }
    let mut some = (words[from] & low) | (words[to] & high);
    for word in &words[from + 1..to] {
        some |= word;
    }
    some != 0
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

struct Find<'a> {
    beside: &'a mut Beside,
    depth_px: &'a Plane,
    /// Around what is not 0.
    area: Area,
}

impl Kernel for Find<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { beside, depth_px, area } = self;
        let (w, h) = (depth_px.width, depth_px.height);
        // One more on each side; what lies beyond is 0.
        let (x0, x1) = (area.x.0.max(1) - 1, (area.x.1 + 1).min(w));
        let n = x1 - x0;
        let mut memory = std::mem::take(&mut beside.largest);
        memory.resize(n, 0.0);
        let largest = &mut memory[..n];
        for y in area.y.0.max(1) - 1..(area.y.1 + 1).min(h) {
            let (above, below) = (depth_px.row(y.max(1) - 1), depth_px.row((y + 1).min(h - 1)));
            let (here, above, below) = (&depth_px.row(y)[x0..x1], &above[x0..x1], &below[x0..x1]);
            for x in 0..n {
                largest[x] = most((here[x] - above[x]).abs(), (here[x] - below[x]).abs());
            }
            for x in 1..n {
                largest[x] = most(largest[x], (here[x] - here[x - 1]).abs());
            }
            for x in 0..n - 1 {
                largest[x] = most(largest[x], (here[x] - here[x + 1]).abs());
            }
            for (c, chunk) in largest.chunks(16).enumerate() {
                if !chunk.iter().fold(false, |some, &e| some | (e > SLOPE_PX)) {
                    continue;
                }
                for (i, &e) in chunk.iter().enumerate() {
                    if e > SLOPE_PX {
                        let x = x0 + 16 * c + i;
                        beside.bits[y * beside.words + x / 64] |= 1 << (x % 64);
                        beside.coarse[y / COARSE * beside.words + x / 64] |= 1 << (x % 64);
                        beside.pixels.push((y * w + x) as u32);
                        beside.weights.push(((e - SLOPE_PX) / (STEP_PX - SLOPE_PX)).min(1.0));
                    }
                }
            }
        }
        beside.largest = memory;
    }
}
