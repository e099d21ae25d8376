//! What lies in a map: its highest pixel, and what a press touches.

use super::draw::HeightMap;
use crate::convolve::{Area, raise};
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};

impl HeightMap {
    /// The highest pixel.
    pub(crate) fn top(&self, rest: Option<&Plane>, level: SimdLevel) -> f32 {
        level.run(Top { map: self, rest })
    }

    /// Sum of `height + rest - top`, and number, of the pixels that a press touches: those above `top - press_px`.
    ///
    /// Columns are summed first, then columns from left to right, so that the sum depends on these pixels alone.
    pub(crate) fn touched(
        &self,
        rest: Option<&Plane>,
        top: f64,
        press_px: f64,
        level: SimdLevel,
    ) -> (f64, f64) {
        level.run(Touched { map: self, rest, top, press_px })
    }

    /// The values of a row within the area, `rest` added in `sums`.
    #[inline(always)]
    pub(crate) fn above_gel<'a>(
        &'a self,
        rest: Option<&Plane>,
        y: usize,
        sums: &'a mut Vec<f32>,
    ) -> &'a [f32] {
        let range = y * self.width + self.area.x.0..y * self.width + self.area.x.1;
        let row = &self.values[range.clone()];
        let Some(rest) = rest else { return row };
        sums.resize(row.len(), 0.0);
        for ((sum, h), r) in sums.iter_mut().zip(row).zip(&rest.values[range]) {
            *sum = h + r;
        }
        sums
    }

    /// The values from a place on, `-inf` after the first `n`, `rest` added.
    #[inline(always)]
    fn some_above_gel(&self, rest: Option<&Plane>, at: usize, n: usize) -> [f32; SUMMED] {
        let some = |values: &[f32]| {
            let mut some = [f32::NEG_INFINITY; SUMMED];
            if n >= SUMMED {
                some.copy_from_slice(&values[at..at + SUMMED]);
            } else {
                some[..n].copy_from_slice(&values[at..at + n]);
            }
            some
        };
        let mut row = some(&self.values);
        if let Some(rest) = rest {
            let rest = some(&rest.values);
            for i in 0..SUMMED {
                row[i] += rest[i];
            }
        }
        row
    }
}

struct Top<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
}

impl Kernel for Top<'_> {
    type Output = f32;
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let mut lanes = [f32::NEG_INFINITY; 32];
        let mut sums = Vec::new();
        for y in self.map.area.y.0..self.map.area.y.1 {
            let row = self.map.above_gel(self.rest, y, &mut sums);
            let (chunks, rest) = row.as_chunks::<32>();
            raise(&mut lanes, rest);
            for chunk in chunks {
                raise(&mut lanes, chunk);
            }
        }
        lanes.iter().fold(f32::NEG_INFINITY, |m, &v| if v > m { v } else { m })
    }
}

struct Touched<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
    top: f64,
    press_px: f64,
}

/// Columns that are summed at once, their sums in registers.
const SUMMED: usize = 16;

impl Kernel for Touched<'_> {
    type Output = (f64, f64);
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> (f64, f64) {
        let Self { map, rest, top, press_px } = self;
        // Nothing so low touches, whatever the rounding: rows of a block without anything higher add nothing.
        let low = ((top - press_px) as f32).next_down();
        let Area { x: (from, to), y: rows } = map.area;
        let (mut all, mut number) = (0.0, 0.0);
        for x in (from..to).step_by(SUMMED) {
            let (mut sum, mut count) = ([0.0; SUMMED], [0.0; SUMMED]);
            for y in rows.0..rows.1 {
                let row = map.some_above_gel(rest, y * map.width + x, to - x);
                if !row.iter().fold(false, |some, &h| some | (h > low)) {
                    continue;
                }
                for i in 0..SUMMED {
                    let below = f64::from(row[i]) - top;
                    let touches = below + press_px > 0.0;
                    sum[i] += if touches { below } else { 0.0 };
                    count[i] += if touches { 1.0 } else { 0.0 };
                }
            }
            for i in 0..SUMMED {
                all += sum[i];
                number += count[i];
            }
        }
        (all, number)
    }
}
