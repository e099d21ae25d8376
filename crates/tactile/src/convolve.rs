//! Separable convolution with symmetric kernels and mirrored borders, on the part of an image that is not zero.
//!
//! Only columns are ever convolved; between the two axes the image is transposed. For every output row the sum is
//! `w_0 x_0 + sum_k w_k (x_-k + x_k)` with k growing and a fused multiply-add for each k. Terms whose two rows are
//! zero are left out, which changes no bit. That is the definition on every vector unit.

mod block;
mod sheet;

pub(crate) use sheet::{Area, Sheet, raise};

use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use block::Block;
use sheet::{GROUP, SPARE_ROWS};

/// What a blur leaves of the core of a contact, where the gel follows the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Follow {
    /// The height of the part (Taxim). Where the core ends on a slanted wall, that lies below the blurred gel around it: a moat
    /// around the contact. Sensor files that do not say how the gel follows mean this.
    Exactly,
    /// The height of the part or of the blurred gel, whichever is deeper: the gel cannot lie inside the part, and where it is
    /// deeper it has left it.
    AtLeast,
}

/// What is put back after a blur: `core` plus `lift` where there is one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Restore<'a> {
    /// Values to put back, valid in the whole groups around `area`; without `share` NaN for none.
    pub(crate) core: &'a Sheet,
    /// How much of each pixel belongs to the core: what is blurred moves towards the core by this share of the way. Without it the
    /// core takes the place of what is blurred.
    pub(crate) share: Option<&'a Sheet>,
    /// Whether a share also lowers what is blurred.
    pub(crate) follow: Follow,
    /// Where they are.
    pub(crate) area: Area,
    /// Added to the core.
    pub(crate) lift: Option<&'a Sheet>,
}

/// A surface that lies upright or transposed, and the memory to blur it in.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surface {
    pub(crate) sheet: Sheet,
    other: Sheet,
    pub(crate) transposed: bool,
    /// Beyond it the surface is 0.
    pub(crate) area: Area,
    live: Vec<(isize, isize)>,
    ranges: Vec<(usize, usize)>,
}

impl Surface {
    /// Makes room for kernels of up to `2 half + 1` and takes `plane`, which is 0 beyond `area`.
    pub(crate) fn start(&mut self, plane: &Plane, area: Area, half: usize) {
        self.sheet.reshape(plane.width, plane.height, half);
        self.sheet.copy_area(plane, area, 0.0, |v| v);
        self.transposed = false;
        self.area = area;
    }

    /// Blurs along both axes with `weights` (the middle one first), then puts back what `restore` has for this
    /// orientation. The area grows by half the kernel and `beyond` on every side.
    pub(crate) fn blur(
        &mut self,
        weights: &[f32],
        restore: Option<&[Restore<'_>; 2]>,
        beyond: usize,
        level: SimdLevel,
    ) {
        if self.area.is_empty() {
            return;
        }
        self.columns(weights, None, beyond, level);
        self.transpose(level);
        let restore = restore.map(|both| both[usize::from(self.transposed)]);
        self.columns(weights, restore, beyond, level);
    }

    /// Makes the whole image its area.
    pub(crate) fn widen(&mut self) {
        let (area, whole) = (self.area, Area::whole(self.sheet.width, self.sheet.height));
        for y in 0..self.sheet.height {
            let row = self.sheet.row_mut(y);
            if (area.y.0..area.y.1).contains(&y) {
                row[..area.x.0].fill(0.0);
                row[area.x.1..].fill(0.0);
            } else {
                row.fill(0.0);
            }
        }
        self.area = whole;
    }

    /// Turns the surface upright.
    pub(crate) fn upright(&mut self, level: SimdLevel) {
        if self.transposed {
            self.transpose(level);
        }
    }

    fn transpose(&mut self, level: SimdLevel) {
        let half = self.sheet.margin - SPARE_ROWS;
        self.other.reshape(self.sheet.height, self.sheet.width, half);
        self.other.copy_transposed(&self.sheet, self.area, level);
        std::mem::swap(&mut self.sheet, &mut self.other);
        self.area = self.area.transposed();
        self.transposed = !self.transposed;
    }

    fn columns(&mut self, weights: &[f32], restore: Option<Restore<'_>>, beyond: usize, level: SimdLevel) {
        let half = weights.len() - 1;
        let height = self.sheet.height;
        self.other.reshape(self.sheet.width, height, self.sheet.margin - SPARE_ROWS);
        let grown = half + beyond;
        let out = Area {
            x: self.area.x,
            y: (self.area.y.0.saturating_sub(grown), (self.area.y.1 + grown).min(height)),
        };
        let groups = out.in_groups();
        let rows = (groups.y.0, groups.y.1.min(height));
        self.prepare_rows(rows, half);
        level.run(Columns {
            input: &self.sheet,
            output: &mut self.other,
            columns: groups.x,
            rows,
            live: &self.live,
            ranges: &mut self.ranges,
            weights,
            restore,
        });
        std::mem::swap(&mut self.sheet, &mut self.other);
        self.area = out;
    }

    /// Makes every row valid that the output `rows` reach, and notes which of them are not zero.
    fn prepare_rows(&mut self, rows: (usize, usize), half: usize) {
        let area = self.area;
        let columns = area.in_groups().x;
        let sheet = &mut self.sheet;
        self.live.clear();
        let first = rows.0 as isize - half as isize;
        let end = (rows.1 + GROUP + half) as isize;
        for row in first..end {
            let source = mirrored(row, sheet.height);
            let is_live = (area.y.0..area.y.1).contains(&source);
            if is_live {
                match self.live.last_mut() {
                    Some((_, end)) if *end == row => *end += 1,
                    _ => self.live.push((row, row + 1)),
                }
            }
            let to = sheet.offset(row);
            if !is_live {
                sheet.values_mut()[to + columns.0..to + columns.1].fill(0.0);
            } else if source as isize != row {
                let from = sheet.offset(source as isize);
                sheet.values_mut().copy_within(from + columns.0..from + columns.1, to + columns.0);
            }
        }
    }
}

/// Row `i` of an image continued by mirroring at its first and last row, which are not repeated.
pub(crate) fn mirrored(i: isize, n: usize) -> usize {
    let n = n as isize;
    if (0..n).contains(&i) {
        return i as usize;
    }
    if n == 1 {
        return 0;
    }
    let i = i.rem_euclid(2 * (n - 1));
    (if i < n { i } else { 2 * (n - 1) - i }) as usize
}

/// One pass over the columns of an area.
struct Columns<'a> {
    input: &'a Sheet,
    output: &'a mut Sheet,
    columns: (usize, usize),
    rows: (usize, usize),
    /// Rows that are not zero, counting mirrored ones.
    live: &'a [(isize, isize)],
    /// Memory for the range of k of each block of rows.
    ranges: &'a mut Vec<(usize, usize)>,
    /// The middle one first.
    weights: &'a [f32],
    restore: Option<Restore<'a>>,
}

impl Columns<'_> {
    /// The k for which rows `k` before or after some of the rows from `first` on are not zero; empty if none are.
    fn range(&self, first: usize, rows: usize) -> (usize, usize) {
        let (first, last) = (first as isize, (first + rows - 1) as isize);
        let half = self.weights.len() as isize - 1;
        let (mut low, mut high) = (half + 1, 0);
        for &(from, end) in self.live {
            let nearest = 0.max(from - last).max(first - (end - 1));
            if nearest <= half {
                low = low.min(nearest);
                high = high.max((last - from).max(end - 1 - first).min(half) + 1);
            }
        }
        (low as usize, high as usize)
    }

    #[inline(always)]
    unsafe fn blocks<L: Lanes, const ROWS: usize>(self) {
        let blocks = (self.rows.0..self.rows.1).step_by(ROWS);
        let mut ranges = std::mem::take(self.ranges);
        ranges.clear();
        ranges.extend(blocks.clone().map(|first| self.range(first, ROWS)));
        let input = self.input.values().as_ptr();
        let output = self.output.values_mut().as_mut_ptr();
        for x in (self.columns.0..self.columns.1).step_by(L::COUNT) {
            for (first, &range) in blocks.clone().zip(&ranges) {
                // SAFETY: the rows within reach of the block lie in the sheet, margins included, and columns in
                // groups lie within its stride.
                unsafe {
                    let block = Block {
                        at: input.add(self.input.offset(first as isize) + x),
                        stride: self.input.stride,
                        weights: self.weights,
                        range,
                    };
                    let sums = block.sums::<L, ROWS>();
                    let rows = ROWS.min(self.rows.1 - first);
                    for (i, &sum) in sums.iter().enumerate().take(rows) {
                        let y = first + i;
                        let value = self.restored::<L>(x, y, sum);
                        L::store(output.add(self.output.offset(y as isize) + x), value);
                    }
                }
            }
        }
        *self.ranges = ranges;
    }

    #[inline(always)]
    unsafe fn restored<L: Lanes>(&self, x: usize, y: usize, sum: L::Vector) -> L::Vector {
        let Some(restore) = self.restore else { return sum };
        let area = restore.area;
        if y < area.y.0 || y >= area.y.1 || x + L::COUNT <= area.x.0 || x >= area.x.1 {
            return sum;
        }
        // SAFETY: the sheets of `restore` have the size of this one and are valid in groups.
        unsafe {
            let at = restore.core.offset(y as isize) + x;
            let mut core = L::load(restore.core.values().as_ptr().add(at));
            if let Some(lift) = restore.lift {
                core = L::add(core, L::load(lift.values().as_ptr().add(lift.offset(y as isize) + x)));
            }
            let Some(share) = restore.share else { return L::first_unless_nan(core, sum) };
            let share = L::load(share.values().as_ptr().add(at));
            let goal = match restore.follow {
                Follow::Exactly => core,
                Follow::AtLeast => L::larger_unless_nan(core, sum),
            };
            L::fused(share, L::fused(L::splat(-1.0), sum, goal), sum)
        }
    }
}

impl Kernel for Columns<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        // SAFETY: forwarded.
        unsafe {
            if L::MANY_REGISTERS {
                self.blocks::<L, 8>();
            } else {
                self.blocks::<L, 4>();
            }
        }
    }
}
