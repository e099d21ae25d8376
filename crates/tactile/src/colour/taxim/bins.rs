//! Taxim's bins of slope and direction, without an arc tangent for every pixel.
//!
//! Taxim computes `atan` and `atan2` in single precision. A slope along an image axis lies on the border of two bins,
//! so that this rounding decides about whole regions (8 % of the pixels under a shaft). Both are therefore found by
//! comparing with borders that are worked out once, for angles rounded to f32: the result is that of the formula.

use std::f64::consts::{FRAC_PI_2, PI};

/// Cells of the first guess: octant and sine of the angle to the nearer axis.
const CELLS: usize = 128;
/// Cells per unit of that sine, which is at most sqrt(1/2).
const CELLS_PER_UNIT: f32 = 180.0;

/// Marks a guess that the borders have to decide.
const UNSURE: u16 = 1 << 15;

/// Sectors `floor((angle + pi) / step)` of the full circle, angles rounded to f32. What rounds to below -pi belongs to
/// the last sector, as an index of -1 does in numpy.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sectors {
    step_rad: f64,
    count: usize,
    /// Cosine and sine of the lower border of each sector. Empty for sectors too wide to be told apart by a side.
    borders: Vec<[f64; 2]>,
    guesses: Option<Box<[u16; 8 * CELLS]>>,
}

impl Sectors {
    pub(crate) fn new(step_rad: f64, count: usize) -> Self {
        let mut sectors = Self { step_rad, count, borders: vec![], guesses: None };
        if step_rad > 0.7 {
            return sectors;
        }
        sectors.borders = (0..count)
            .map(|sector| {
                let reaches = |angle: f32| ((f64::from(angle) + PI) / step_rad).floor() >= sector as f64;
                let first = smallest(-3.2, 3.3, reaches);
                let border = (f64::from(first.next_down()) + f64::from(first)) / 2.0;
                [libm::cos(border), libm::sin(border)]
            })
            .collect();
        let guesses = std::array::from_fn(|cell| {
            let sector = |small: f32| {
                let small = small.clamp(0.0, 0.7072);
                let large = (1.0 - small * small).sqrt();
                let (x, y) = if cell & CELLS == 0 { (large, small) } else { (small, large) };
                let x = if cell & (2 * CELLS) == 0 { x } else { -x };
                let y = if cell & (4 * CELLS) == 0 { y } else { -y };
                sectors.by_formula(x, y)
            };
            let middle = (cell % CELLS) as f32;
            let end = |side: f32| sector((middle + side) / CELLS_PER_UNIT);
            let (low, high) = (end(-0.501), end(0.501));
            if low == high { low as u16 } else { low as u16 | UNSURE }
        });
        sectors.guesses = Some(Box::new(guesses));
        sectors
    }

    /// Cosine and sine of the lower border of each sector.
    #[cfg(feature = "gpu")]
    pub(crate) fn borders(&self) -> Vec<[f64; 2]> {
        if !self.borders.is_empty() {
            return self.borders.clone();
        }
        let angle = |sector: usize| sector as f64 * self.step_rad - PI;
        (0..self.count).map(|sector| [libm::cos(angle(sector)), libm::sin(angle(sector))]).collect()
    }

    /// Direction of (x, y) by its definition.
    fn by_formula(&self, x: f32, y: f32) -> usize {
        let angle = libm::atan2(f64::from(y), f64::from(x)) as f32;
        let sector = ((f64::from(angle) + PI) / self.step_rad).floor();
        if sector < 0.0 { self.count - 1 } else { (sector as usize).min(self.count - 1) }
    }

    /// The sector of a unit vector.
    #[inline]
    pub(crate) fn of(&self, x: f32, y: f32) -> usize {
        let Some(guesses) = &self.guesses else { return self.by_formula(x, y) };
        let (ax, ay) = (x.abs(), y.abs());
        let (steep, small) = if ay > ax { (CELLS, ax) } else { (0, ay) };
        let quadrant = if x < 0.0 { 2 * CELLS } else { 0 } + if y < 0.0 { 4 * CELLS } else { 0 };
        // 2^23 leaves the nearest whole number in the last bits.
        let along = (small * CELLS_PER_UNIT + 8_388_608.0).to_bits() as usize % CELLS;
        let guess = guesses[steep + quadrant + along];
        if guess & UNSURE == 0 {
            return usize::from(guess);
        }
        let mut sector = usize::from(guess & !UNSURE);
        let (x, y) = (f64::from(x), f64::from(y));
        let beyond = |border: usize| {
            let [cos, sin] = self.borders[border];
            y * cos - x * sin >= 0.0
        };
        // At most once around, also for numbers that are none.
        for _ in 0..self.count {
            let next = if sector + 1 == self.count { 0 } else { sector + 1 };
            if !beyond(sector) {
                sector = if sector == 0 { self.count - 1 } else { sector - 1 };
            } else if beyond(next) {
                sector = next;
            } else {
                break;
            }
        }
        sector
    }
}

/// Steepness `floor(atan(slope) / (pi/2 / (bins - 1)))` in single precision.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Steepness {
    /// Smallest slope of each bin; the last is followed by infinity.
    first: Vec<f32>,
    /// Bin of the first slope of each range of numbers that agree in their upper 16 bits, from `base` on.
    guesses: Vec<u16>,
    base: u32,
}

impl Steepness {
    pub(crate) fn new(bins: usize) -> Self {
        let step = (FRAC_PI_2 / (bins - 1) as f64) as f32;
        let formula = |slope: f32| (libm::atan(f64::from(slope)) as f32 / step).floor();
        let mut first: Vec<f32> =
            (0..bins).map(|bin| smallest(0.0, f32::MAX, |slope| formula(slope) >= bin as f32)).collect();
        // One below, so that every smaller slope gets the guess 0.
        let base = (first[1].to_bits() >> 16) - 1;
        let last = (first[bins - 1].min(1e6).to_bits() >> 16).max(base);
        let guesses = (base..=last)
            .map(|upper| {
                let slope = f32::from_bits(upper << 16);
                (first.partition_point(|&f| f <= slope).max(1) - 1) as u16
            })
            .collect();
        first.push(f32::INFINITY);
        Self { first, guesses, base }
    }

    /// Smallest slope of each bin.
    #[cfg(feature = "gpu")]
    pub(crate) fn first(&self) -> &[f32] {
        &self.first[..self.first.len() - 1]
    }

    /// The bin of a slope.
    #[inline]
    pub(crate) fn of(&self, slope: f32) -> usize {
        let upper = (slope.to_bits() >> 16).saturating_sub(self.base) as usize;
        let mut bin = usize::from(self.guesses[upper.min(self.guesses.len() - 1)]);
        while bin + 2 < self.first.len() && slope >= self.first[bin + 1] {
            bin += 1;
        }
        bin
    }
}

/// The smallest number from `low` to `high` for which a monotone condition holds; `high` if there is none.
fn smallest(low: f32, high: f32, holds: impl Fn(f32) -> bool) -> f32 {
    // Bits of f32 in the order of the numbers.
    let order = |x: f32| if x < 0.0 { -i64::from((-x).to_bits()) } else { i64::from(x.to_bits()) };
    let number = |i: i64| if i < 0 { -f32::from_bits((-i) as u32) } else { f32::from_bits(i as u32) };
    let (mut low, mut high) = (order(low), order(high));
    while low < high {
        let middle = (low + high).div_euclid(2);
        if holds(number(middle)) { high = middle } else { low = middle + 1 }
    }
    number(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_are_those_of_the_formula() {
        for (step, count) in
            [(2.0 * PI / 124.0, 125), (2.0 * PI / 119.0, 120), (0.1, 63), (2.0 * PI / 8.0, 9), (PI, 3)]
        {
            let sectors = Sectors::new(step, count);
            let mut seen = vec![false; count];
            let mut check = |x: f32, y: f32| {
                let length = (x * x + y * y).sqrt();
                let (x, y) = (x / length, y / length);
                seen[sectors.of(x, y)] = true;
                assert_eq!(sectors.of(x, y), sectors.by_formula(x, y), "({x}, {y}), step {step}");
            };
            for i in 0..400_000 {
                let angle = f64::from(i) * 1.618_034;
                check(angle.cos() as f32, angle.sin() as f32);
            }
            // Around the axes and the borders, to the last bit.
            for tiny in [0.0, 1e-30, 1e-9, 2e-8, 3e-8, 4e-8, 6e-8, 1e-7, 3e-7, 1e-5] {
                for (x, y) in [(1.0, tiny), (1.0, -tiny), (-1.0, tiny), (-1.0, -tiny)] {
                    check(x, y);
                    check(y, x);
                }
            }
            for border in 0..=count {
                let angle = border as f64 * step - PI;
                let (x, y) = (angle.cos() as f32, angle.sin() as f32);
                for _ in 0..2 {
                    for (x, y) in [(x, y), (x.next_up(), y), (x, y.next_up()), (x, y.next_down())] {
                        check(x, y);
                    }
                }
            }
            assert!(seen.iter().filter(|s| !**s).count() <= 1, "{seen:?}");
        }
    }

    #[test]
    fn steepness_is_that_of_the_formula() {
        for bins in [2, 3, 80, 120, 125, 2000] {
            let steepness = Steepness::new(bins);
            let step = (FRAC_PI_2 / (bins - 1) as f64) as f32;
            let formula = |s: f32| ((libm::atan(f64::from(s)) as f32 / step).floor() as usize).min(bins - 1);
            for &first in &steepness.first[..bins] {
                for s in [first.next_down().max(0.0), first, first.next_up().min(f32::MAX)] {
                    assert_eq!(steepness.of(s), formula(s), "{s}, {bins} bins");
                }
            }
            let mut s = 1e-12_f32;
            while s < 1e12 {
                assert_eq!(steepness.of(s), formula(s), "{s}, {bins} bins");
                s *= 1.0003;
            }
            assert_eq!(steepness.of(0.0), 0);
        }
    }
}
