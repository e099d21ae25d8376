//! The pixels beside a step.

use super::steps::{COARSE, SLOPE_PX, STEP_PX, Steps};
use crate::convolve::Area;
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes};

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

pub(super) struct Find<'a> {
    pub(super) steps: &'a mut Steps,
    pub(super) depth_px: &'a Plane,
    /// Around what is not 0.
    pub(super) area: Area,
}

impl Kernel for Find<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { steps, depth_px, area } = self;
        let (w, h) = (depth_px.width, depth_px.height);
        // One more on each side; what lies beyond is 0.
        let (x0, x1) = (area.x.0.max(1) - 1, (area.x.1 + 1).min(w));
        let n = x1 - x0;
        let mut memory = std::mem::take(&mut steps.largest);
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
                        steps.bits[y * steps.words + x / 64] |= 1 << (x % 64);
                        steps.coarse[y / COARSE * steps.words + x / 64] |= 1 << (x % 64);
                        steps.pixels.push((y * w + x) as u32);
                        steps.weights.push(((e - SLOPE_PX) / (STEP_PX - SLOPE_PX)).min(1.0));
                    }
                }
            }
        }
        steps.largest = memory;
    }
}
