//! Points within pixels, where a surface has a step: the border of a contact there lies between pixel centres.

use super::edge::{Corner, Edge, TALL, bands, higher, lower};
use super::find::{Beside, COARSE};
use super::points::{Offsets, PLACES, POINTS, Side};
use crate::convolve::Area;
use crate::deform::Edges;
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use std::array::from_fn;

/// Pixels that are summed side by side, and the sums of which all are made: the pixels of a block go to them in turn. A block is so long that the
/// compiler takes it for a loop; it writes out shorter ones and leaves them to single numbers.
const SIDE: usize = 64;
const SUMS: usize = 8;

/// A triangle that is narrower than this, in pixels, has no points.
const WALL_PX: f64 = 1e-4;

/// The pixels of a map beside a step, and the height of the surface at the points of each. Memory to be used again.
#[derive(Debug, Clone, Default)]
pub(super) struct Steps {
    beside: Beside,
    /// Heights at the points of each, in the order of a map; `-inf` where there is nothing.
    heights: Vec<[f32; PLACES]>,
    /// The same above the gel, as they are summed.
    blocks: Vec<Block>,
}

/// Pixels side by side, heights above the gel at rest.
#[derive(Debug, Clone, Copy)]
struct Block {
    weights: [f32; SIDE],
    centres: [f32; SIDE],
    points: [[f32; SIDE]; POINTS],
}

const NOTHING: Block = Block {
    weights: [0.0; SIDE],
    centres: [f32::NEG_INFINITY; SIDE],
    points: [[f32::NEG_INFINITY; SIDE]; POINTS],
};

impl Steps {
    /// Finds the pixels beside a step of a contact that is so deep at the centres of pixels, 0 beyond `area`. Returns whether
    /// there are any.
    pub(super) fn find(&mut self, depth_px: &Plane, area: Area, level: SimdLevel) -> bool {
        self.beside.find(depth_px, area, level)
    }

    /// Forgets what was drawn at the points.
    pub(super) fn empty(&mut self) {
        self.heights.clear();
        self.heights.resize(self.beside.pixels.len(), [f32::NEG_INFINITY; PLACES]);
    }

    /// Puts what was drawn at the points beside the centres, whose heights are `centres`, for [`Steps::touched`] and
    /// [`Steps::write`].
    pub(super) fn collect(&mut self, centres: &[f32], rest: Option<&Plane>) {
        self.blocks.clear();
        self.blocks.resize(self.beside.pixels.len().div_ceil(SIDE), NOTHING);
        for (i, (&pixel, heights)) in self.beside.pixels.iter().zip(&self.heights).enumerate() {
            let (block, i) = (&mut self.blocks[i / SIDE], i % SIDE);
            let rest = rest.map_or(0.0, |rest| rest.values[pixel as usize]);
            block.centres[i] = centres[pixel as usize] + rest;
            for (points, height) in block.points.iter_mut().zip(heights) {
                points[i] = height + rest;
            }
        }
        for (block, weights) in self.blocks.iter_mut().zip(self.beside.weights.chunks(SIDE)) {
            block.weights[..weights.len()].copy_from_slice(weights);
        }
    }

    /// What a press touches (sum of `height + rest - top`, and number) by the centres, and by the points where they count.
    pub(super) fn touched(
        &self,
        by_centres: (f64, f64),
        top: f64,
        press_px: f64,
        level: SimdLevel,
    ) -> (f64, f64) {
        level.run(Touched { blocks: &self.blocks, by_centres, top, press_px })
    }

    /// Puts the mean depth at their points into these pixels; `lift` is what lies between heights and depths.
    pub(super) fn write(&self, lift: f64, depth_px: &mut Plane, level: SimdLevel) {
        level.run(Write { steps: self, lift, depth_px });
    }

    /// The depths at the points of each.
    pub(super) fn edges(&self, lift: f64) -> Edges {
        let mut edges = Edges::with_room_for(self.beside.pixels.len());
        for (block, pixels) in self.blocks.iter().zip(self.beside.pixels.chunks(SIDE)) {
            for (i, &pixel) in pixels.iter().enumerate() {
                let depths_px = from_fn(|point| (f64::from(block.points[point][i]) + lift) as f32);
                edges.push(pixel, block.weights[i], depths_px);
            }
        }
        edges
    }

    /// The weight of each.
    #[cfg(test)]
    pub(super) fn weights(&self) -> &[f32] {
        &self.beside.weights
    }

    /// Whether there may be some in a box; both ends count.
    #[inline(always)]
    pub(super) fn may_be_in(&self, rows: (usize, usize), columns: (usize, usize)) -> bool {
        self.beside.may_be_in(rows, columns)
    }

    /// One triangle at the points of the pixels that it reaches, which lie in `rows` and `columns`; both ends count.
    ///
    /// A point lies in a triangle if it is on no edge's far side. Two triangles compute the side of a common edge from the
    /// same end, so that no point falls between them.
    ///
    /// # Safety
    /// The processor must have the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn fill<L: Lanes>(
        &mut self,
        t: [Corner; 3],
        rows: (usize, usize),
        columns: (usize, usize),
    ) {
        let (ux, uy, uh) = (t[1].x_px - t[0].x_px, t[1].y_px - t[0].y_px, t[1].height_px - t[0].height_px);
        let (vx, vy, vh) = (t[2].x_px - t[0].x_px, t[2].y_px - t[0].y_px, t[2].height_px - t[0].height_px);
        let area = ux * vy - uy * vx;
        // Between the points of walls that are seen from their edge there is none; their rims are those of others, too.
        if area.abs() <= WALL_PX * (ux.abs() + uy.abs() + vx.abs() + vy.abs()) {
            return;
        }
        let (slope_x, slope_y) = ((uh * vy - vh * uy) / area, (vh * ux - uh * vx) / area);
        let top = higher(higher(t[0].height_px, t[1].height_px), t[2].height_px) as f32;
        let bottom = lower(lower(t[0].height_px, t[1].height_px), t[2].height_px) as f32;
        let turn = if area > 0.0 { 1.0 } else { -1.0 };
        let sides =
            [Side::new(&t[0], &t[1], turn), Side::new(&t[1], &t[2], turn), Side::new(&t[2], &t[0], turn)];
        // The three sides, and the surface, at the centre of a pixel, and from there to its points.
        let [first, second, third] = &sides;
        let from_x = [first.from.0, second.from.0, third.from.0, t[0].x_px];
        let per_column = [first.y, second.y, third.y, -slope_x];
        let across = [first.offsets(), second.offsets(), third.offsets(), Offsets::new(slope_x, slope_y)];
        let tall = rows.1 - rows.0 >= TALL;
        let edges = tall.then(|| [Edge::new(&t[0], &t[1]), Edge::new(&t[1], &t[2]), Edge::new(&t[2], &t[0])]);
        for block in rows.0 / COARSE..=rows.1 / COARSE {
            if !self.beside.any_near(block, columns) {
                continue;
            }
            // Of a long and thin triangle little lies in a row.
            let bands = edges.as_ref().map(|edges| bands(edges, (COARSE * block) as f64, columns));
            for row in rows.0.max(COARSE * block)..=rows.1.min(COARSE * block + COARSE - 1) {
                let columns = match &bands {
                    Some((from, to)) => (from[row % COARSE] as usize, (to[row % COARSE] + 1) as usize),
                    None => (columns.0, columns.1 + 1),
                };
                if columns.0 >= columns.1 {
                    continue;
                }
                let columns = (columns.0, columns.1 - 1);
                if !self.beside.any_in(row, columns) {
                    continue;
                }
                let y = row as f64;
                let in_row = [
                    first.x * (y - first.from.1),
                    second.x * (y - second.from.1),
                    third.x * (y - third.from.1),
                    t[0].height_px + slope_y * (y - t[0].y_px),
                ];
                for word in columns.0 / 64..=columns.1 / 64 {
                    let (bits, start) = self.beside.word(row, word);
                    let low = if word == columns.0 / 64 { u64::MAX << (columns.0 % 64) } else { u64::MAX };
                    let high =
                        if word == columns.1 / 64 { u64::MAX >> (63 - columns.1 % 64) } else { u64::MAX };
                    let mut left = bits & low & high;
                    while left != 0 {
                        let bit = left.trailing_zeros();
                        left &= left - 1;
                        let x = (64 * word + bit as usize) as f64;
                        let before = (bits & !(u64::MAX << bit)).count_ones();
                        let at = (start + before) as usize;
                        let mut centre = [0.0; 4];
                        for i in 0..4 {
                            centre[i] = (in_row[i] - per_column[i] * (x - from_x[i])) as f32;
                        }
                        let mut heights = [0.0; PLACES];
                        for i in 0..PLACES {
                            let height = centre[3] + across[3].0[i];
                            let height = if height > bottom { height } else { bottom };
                            let height = if height < top { height } else { top };
                            let within = (centre[0] + across[0].0[i] >= 0.0)
                                & (centre[1] + across[1].0[i] >= 0.0)
                                & (centre[2] + across[2].0[i] >= 0.0);
                            heights[i] = if within { height } else { f32::NEG_INFINITY };
                        }
                        // SAFETY: the caller has the instructions of `L`, and a pixel's heights are whole vectors.
                        unsafe { raise::<L>(&heights, &mut self.heights[at]) };
                    }
                }
            }
        }
    }
}

/// Heights of points where they are larger than before. Stored as a whole: writing some lanes alone is slow on many processors.
///
/// # Safety
/// The processor must have the instructions of `L`.
#[inline(always)]
unsafe fn raise<L: Lanes>(heights: &[f32; PLACES], to: &mut [f32; PLACES]) {
    for at in (0..PLACES).step_by(L::COUNT) {
        // SAFETY: forwarded; `PLACES` is a multiple of the lanes.
        unsafe {
            let (new, old) = (L::load(heights.as_ptr().add(at)), L::load(to.as_ptr().add(at)));
            L::store(to.as_mut_ptr().add(at), L::larger_unless_nan(new, old));
        }
    }
}

struct Touched<'a> {
    blocks: &'a [Block],
    by_centres: (f64, f64),
    top: f64,
    press_px: f64,
}

impl Kernel for Touched<'_> {
    type Output = (f64, f64);
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> (f64, f64) {
        let Self { blocks, by_centres, top, press_px } = self;
        let (mut sums, mut counts) = ([0.0; SUMS], [0.0; SUMS]);
        for block in blocks {
            let (mut sum, mut count) = ([0.0; SIDE], [0.0; SIDE]);
            for points in &block.points {
                for i in 0..SIDE {
                    let below = f64::from(points[i]) - top;
                    let touches = below + press_px > 0.0;
                    sum[i] += if touches { below } else { 0.0 };
                    count[i] += if touches { 1.0 } else { 0.0 };
                }
            }
            for i in 0..SIDE {
                let below = f64::from(block.centres[i]) - top;
                let touches = below + press_px > 0.0;
                let (centre, one) = if touches { (below, 1.0) } else { (0.0, 0.0) };
                let weight = f64::from(block.weights[i]);
                sum[i] = weight * (sum[i] / POINTS as f64 - centre);
                count[i] = weight * (count[i] / POINTS as f64 - one);
            }
            for (sum, count) in sum.as_chunks::<SUMS>().0.iter().zip(count.as_chunks::<SUMS>().0) {
                for i in 0..SUMS {
                    sums[i] += sum[i];
                    counts[i] += count[i];
                }
            }
        }
        // From left to right, whatever the vector unit.
        (by_centres.0 + sums.iter().sum::<f64>(), by_centres.1 + counts.iter().sum::<f64>())
    }
}

struct Write<'a> {
    steps: &'a Steps,
    lift: f64,
    depth_px: &'a mut Plane,
}

impl Kernel for Write<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { steps, lift, depth_px } = self;
        for (block, pixels) in steps.blocks.iter().zip(steps.beside.pixels.chunks(SIDE)) {
            let mut sum = [0.0; SIDE];
            for points in &block.points {
                for i in 0..SIDE {
                    sum[i] += higher(f64::from(points[i]) + lift, 0.0);
                }
            }
            for (i, &pixel) in pixels.iter().enumerate() {
                let at = &mut depth_px.values[pixel as usize];
                let (centre, weight) = (f64::from(*at), f64::from(block.weights[i]));
                *at = (centre + weight * (sum[i] / POINTS as f64 - centre)) as f32;
            }
        }
    }
}
