//! Points within pixels, where a surface has a step: the border of a contact there lies between pixel centres.

use super::edge::{Corner, Edge, higher, lower};
use crate::convolve::Area;
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};

/// Points along a side of a pixel; the middle one is its centre.
pub(super) const FINE: usize = 3;

/// Points of a pixel.
pub(super) const POINTS: usize = FINE * FINE;

/// Where the depths of two neighbours differ by more than this, in pixels, points begin to count, and they alone count
/// from [`STEP_PX`] on. In between both do, so that no last bit of a depth decides what a pixel is.
const SLOPE_PX: f32 = 0.5;
const STEP_PX: f32 = 1.0;

/// The pixels of a map beside a step, and the height of the surface at the points of each. Memory to be used again.
#[derive(Debug, Clone, Default)]
pub(super) struct Steps {
    width: usize,
    height: usize,
    /// One bit for each pixel, rows in whole words.
    bits: Vec<u64>,
    words: usize,
    /// Where in `pixels` those of a word begin.
    starts: Vec<u32>,
    /// First and last column with one in each row; the first is larger where there is none.
    spans: Vec<(u32, u32)>,
    pixels: Vec<SteppedPixel>,
    /// Memory for a row.
    largest: Vec<f32>,
}

/// A pixel beside a step.
#[derive(Debug, Clone, Copy)]
struct SteppedPixel {
    /// Its place in the image.
    pixel: usize,
    /// How much its points count; the rest is its centre.
    weight: f32,
    /// Heights at its points, in the order of a map; `-inf` where there is nothing.
    heights: [f32; POINTS],
}

impl Steps {
    /// Finds the pixels beside a step of a contact that is so deep at the centres of pixels, 0 beyond `area`. Returns whether
    /// there are any.
    pub(super) fn find(&mut self, depth_px: &Plane, area: Area, level: SimdLevel) -> bool {
        (self.width, self.height) = (depth_px.width, depth_px.height);
        self.words = self.width.div_ceil(64);
        self.bits.clear();
        self.bits.resize(self.words * self.height, 0);
        self.starts.clear();
        self.starts.resize(self.words * self.height, 0);
        self.spans.clear();
        self.spans.resize(self.height, (u32::MAX, 0));
        self.pixels.clear();
        if area.x.0 < area.x.1 && area.y.0 < area.y.1 {
            level.run(Find { steps: self, depth_px, area });
        }
        !self.pixels.is_empty()
    }

    /// Forgets what was drawn at the points.
    pub(super) fn empty(&mut self) {
        self.pixels.iter_mut().for_each(|p| p.heights = [f32::NEG_INFINITY; POINTS]);
    }

    /// What a press touches (sum of `height + rest - top`, and number) by the centres, whose heights are `centres`, and by the
    /// points where they count.
    pub(super) fn touched(
        &self,
        (mut sum, mut count): (f64, f64),
        centres: &[f32],
        rest: Option<&Plane>,
        top: f64,
        press_px: f64,
    ) -> (f64, f64) {
        for p in &self.pixels {
            let rest = rest.map_or(0.0, |rest| rest.values[p.pixel]);
            let weight = f64::from(p.weight);
            let (mut heights, mut weights) = ([centres[p.pixel]; POINTS + 1], [-weight; POINTS + 1]);
            heights[1..].copy_from_slice(&p.heights);
            weights[1..].fill(weight / POINTS as f64);
            // Without branches: which of them touch cannot be foreseen.
            for (height, weight) in heights.iter().zip(weights) {
                let below = f64::from(height + rest) - top;
                let touches = below + press_px > 0.0;
                sum += if touches { weight * below } else { 0.0 };
                count += if touches { weight } else { 0.0 };
            }
        }
        (sum, count)
    }

    /// Puts the mean depth at their points into these pixels; `lift` is what lies between heights and depths.
    pub(super) fn write(&self, rest: Option<&Plane>, lift: f64, depth_px: &mut Plane) {
        for p in &self.pixels {
            let rest = rest.map_or(0.0, |rest| rest.values[p.pixel]);
            let depth = |h: &f32| (f64::from(h + rest) + lift).max(0.0);
            let mean = p.heights.iter().map(depth).sum::<f64>() / POINTS as f64;
            let at = &mut depth_px.values[p.pixel];
            let (centre, weight) = (f64::from(*at), f64::from(p.weight));
            *at = (centre + weight * (mean - centre)) as f32;
        }
    }

    /// The weight of each.
    #[cfg(test)]
    pub(super) fn weights(&self) -> Vec<f32> {
        self.pixels.iter().map(|p| p.weight).collect()
    }

    /// Whether there are some in a box; both ends count.
    #[inline(always)]
    pub(super) fn any_in(&self, rows: (usize, usize), columns: (usize, usize)) -> bool {
        // A closure would not be compiled for the vector unit.
        for row in rows.0..=rows.1 {
            if self.any(row, columns) {
                return true;
            }
        }
        false
    }

    /// Whether there are some in a row, from one column up to another.
    #[inline(always)]
    fn any(&self, row: usize, (first, last): (usize, usize)) -> bool {
        let (span_first, span_last) = self.spans[row];
        let (first, last) = (first.max(span_first as usize), last.min(span_last as usize));
        if first > last {
            return false;
        }
        let words = &self.bits[row * self.words..][..self.words];
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

    /// The pixels of a row, which has some, from one column up to another.
    #[inline(always)]
    fn in_row(&mut self, row: usize, (first, last): (usize, usize)) -> &mut [SteppedPixel] {
        let count = |column: usize, mask: u64| {
            let word = row * self.words + column / 64;
            (self.starts[word] + (self.bits[word] & mask).count_ones()) as usize
        };
        let before = count(first, !(u64::MAX << (first % 64)));
        let up_to = count(last, u64::MAX >> (63 - last % 64));
        &mut self.pixels[before..up_to]
    }

    /// One triangle at the points of the pixels that it reaches.
    #[inline(always)]
    pub(super) fn fill(&mut self, t: [Corner; 3]) {
        // Coordinates whose integers are points.
        let fine = |px: f64| FINE as f64 * px + (FINE / 2) as f64;
        let span = |a: f64, b: f64, c: f64, n: usize| {
            let first = fine(lower(lower(a, b), c)).ceil().max(0.0);
            let last = fine(higher(higher(a, b), c)).floor().min((FINE * n - 1) as f64);
            (first <= last).then_some((first as usize, last as usize))
        };
        let columns = span(t[0].x_px, t[1].x_px, t[2].x_px, self.width);
        let rows = span(t[0].y_px, t[1].y_px, t[2].y_px, self.height);
        let (Some(columns), Some(rows)) = (columns, rows) else { return };
        let reached = (columns.0 / FINE, columns.1 / FINE);
        if !self.any_in((rows.0 / FINE, rows.1 / FINE), reached) {
            return;
        }
        let t = t.map(|c| Corner { x_px: fine(c.x_px), y_px: fine(c.y_px), ..c });
        let (ux, uy, uh) = (t[1].x_px - t[0].x_px, t[1].y_px - t[0].y_px, t[1].height_px - t[0].height_px);
        let (vx, vy, vh) = (t[2].x_px - t[0].x_px, t[2].y_px - t[0].y_px, t[2].height_px - t[0].height_px);
        let area = ux * vy - uy * vx;
        if area == 0.0 {
            return;
        }
        let (slope_x, slope_y) = ((uh * vy - vh * uy) / area, (vh * ux - uh * vx) / area);
        let top = higher(higher(t[0].height_px, t[1].height_px), t[2].height_px);
        let bottom = lower(lower(t[0].height_px, t[1].height_px), t[2].height_px);
        let edges = [Edge::new(&t[0], &t[1]), Edge::new(&t[1], &t[2]), Edge::new(&t[2], &t[0])];
        for pixel_row in rows.0 / FINE..=rows.1 / FINE {
            if !self.any(pixel_row, reached) {
                continue;
            }
            let first = FINE * pixel_row;
            for row in first.max(rows.0)..=(first + FINE - 1).min(rows.1) {
                let y = row as f64;
                let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
                for edge in &edges {
                    if let Some(x) = edge.crossing(y) {
                        (from, to) = (lower(x, from), higher(x, to));
                    }
                }
                let (from, to) = (higher(from.ceil(), columns.0 as f64), lower(to.floor(), columns.1 as f64));
                if from > to {
                    continue;
                }
                // SAFETY: both lie between 0 and the last point of a row.
                let (from, to) = unsafe { (from.to_int_unchecked::<i32>(), to.to_int_unchecked::<i32>()) };
                let (from, to) = (from as usize, to as usize);
                let along_row = t[0].height_px + slope_y * (y - t[0].y_px);
                let start = pixel_row * self.width;
                for p in self.in_row(pixel_row, (from / FINE, to / FINE)) {
                    let first = FINE * (p.pixel - start);
                    let points = &mut p.heights[row % FINE * FINE..][..FINE];
                    for (i, at) in points.iter_mut().enumerate() {
                        let column = first + i;
                        let height = along_row + slope_x * (f64::from(column as i32) - t[0].x_px);
                        let height = lower(top, higher(bottom, height)) as f32;
                        let drawn = (column >= from) & (column <= to) & (height > *at);
                        *at = if drawn { height } else { *at };
                    }
                }
            }
        }
    }
}

struct Find<'a> {
    steps: &'a mut Steps,
    depth_px: &'a Plane,
    /// Around what is not 0.
    area: Area,
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
            let most = |a: f32, b: f32| if a > b { a } else { b };
            for x in 0..n {
                largest[x] = most((here[x] - above[x]).abs(), (here[x] - below[x]).abs());
            }
            for x in 1..n {
                largest[x] = most(largest[x], (here[x] - here[x - 1]).abs());
            }
            for x in 0..n - 1 {
                largest[x] = most(largest[x], (here[x] - here[x + 1]).abs());
            }
            if !largest.iter().fold(false, |some, &l| some | (l > SLOPE_PX)) {
                continue;
            }
            for (i, &l) in largest.iter().enumerate() {
                if l > SLOPE_PX {
                    let x = x0 + i;
                    steps.bits[y * steps.words + x / 64] |= 1 << (x % 64);
                    let span = &mut steps.spans[y];
                    *span = (span.0.min(x as u32), x as u32);
                    let weight = ((l - SLOPE_PX) / (STEP_PX - SLOPE_PX)).min(1.0);
                    let heights = [f32::NEG_INFINITY; POINTS];
                    steps.pixels.push(SteppedPixel { pixel: y * w + x, weight, heights });
                }
            }
        }
        steps.largest = memory;
        let mut count = 0;
        for (start, bits) in steps.starts.iter_mut().zip(&steps.bits) {
            *start = count;
            count += bits.count_ones();
        }
    }
}
