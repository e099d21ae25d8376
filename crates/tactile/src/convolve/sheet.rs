//! Images in memory that the blur is fast on, and the part of them that is not zero.

use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use bytemuck::{Pod, Zeroable};

/// Columns and rows are handled in groups of this, the widest vector.
pub(super) const GROUP: usize = 16;

/// Rows of an image that lie before its first and after its last, in addition to half the largest kernel: a block of
/// output rows and a group of rows that only pads.
pub(super) const SPARE_ROWS: usize = 2 * GROUP;

/// A rectangle of pixels; ends are not part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) x: (usize, usize),
    pub(crate) y: (usize, usize),
}

impl Area {
    pub(crate) const EMPTY: Self = Self { x: (0, 0), y: (0, 0) };

    /// The bounding box of the values above 0.
    pub(crate) fn of_positive(plane: &Plane, level: SimdLevel) -> Self {
        level.run(Positive { plane })
    }

    pub(crate) fn whole(width: usize, height: usize) -> Self {
        Self { x: (0, width), y: (0, height) }
    }

    /// Makes it hold another area.
    pub(crate) fn join(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
        } else if !other.is_empty() {
            let around = |a: (usize, usize), b: (usize, usize)| (a.0.min(b.0), a.1.max(b.1));
            *self = Self { x: around(self.x, other.x), y: around(self.y, other.y) };
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.x.0 >= self.x.1 || self.y.0 >= self.y.1
    }

    pub(crate) fn transposed(self) -> Self {
        Self { x: self.y, y: self.x }
    }

    /// Whole groups of columns and rows around it.
    pub(crate) fn in_groups(self) -> Self {
        let groups = |(a, b): (usize, usize)| (a / GROUP * GROUP, b.next_multiple_of(GROUP));
        Self { x: groups(self.x), y: groups(self.y) }
    }
}

struct Positive<'a> {
    plane: &'a Plane,
}

impl Kernel for Positive<'_> {
    type Output = Area;
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> Area {
        let mut area = Area::EMPTY;
        let mut columns = vec![0.0f32; self.plane.width];
        for y in 0..self.plane.height {
            let row = self.plane.row(y);
            let mut lanes = [0.0f32; 32];
            let (chunks, rest) = row.as_chunks::<32>();
            for chunk in chunks {
                raise(&mut lanes, chunk);
            }
            raise(&mut lanes, rest);
            if lanes.iter().any(|&v| v > 0.0) {
                area.y = (if area.y.1 == 0 { y } else { area.y.0 }, y + 1);
                raise(&mut columns, row);
            }
        }
        if let (Some(first), Some(last)) =
            (columns.iter().position(|&v| v > 0.0), columns.iter().rposition(|&v| v > 0.0))
        {
            area.x = (first, last + 1);
        }
        area
    }
}

impl Default for Area {
    fn default() -> Self {
        Self::EMPTY
    }
}

/// Replaces values by larger ones.
#[inline(always)]
pub(crate) fn raise(most: &mut [f32], values: &[f32]) {
    for (m, &v) in most.iter_mut().zip(values) {
        *m = if v > *m { v } else { *m };
    }
}

/// A cache line of values, which is the widest vector. Where vectors lie across two lines the blur takes a third longer.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f32; GROUP]);

/// An image with spare rows before and after, and rows that are whole vectors.
///
/// It is memory to be used again: what it holds outside the area that was last written has no meaning.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sheet {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(super) stride: usize,
    pub(super) margin: usize,
    lines: Vec<Line>,
}

impl Sheet {
    /// Makes room for an image; its content is left undefined. `half` is half of the largest kernel it will meet.
    pub(crate) fn reshape(&mut self, width: usize, height: usize, half: usize) {
        self.width = width;
        self.height = height;
        // An odd number of cache lines, so that the rows of a column are spread over the whole cache.
        self.stride = (width.div_ceil(GROUP) | 1) * GROUP;
        self.margin = half + SPARE_ROWS;
        let rows = height.next_multiple_of(GROUP) + 2 * self.margin;
        let lines = self.stride / GROUP * rows;
        if self.lines.len() < lines {
            self.lines.resize(lines, Line::default());
        }
    }

    pub(super) fn values(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }

    pub(super) fn values_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }

    /// Offset of pixel 0 of row `y`, which may lie in the margin.
    pub(super) fn offset(&self, y: isize) -> usize {
        (y + self.margin as isize) as usize * self.stride
    }

    /// Row `y` with what pads it.
    pub(crate) fn row(&self, y: usize) -> &[f32] {
        &self.values()[self.offset(y as isize)..][..self.stride]
    }

    /// Row `y` with what pads it.
    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [f32] {
        let (at, stride) = (self.offset(y as isize), self.stride);
        &mut self.values_mut()[at..][..stride]
    }

    /// The values of an area, 0 around it.
    pub(crate) fn plane(&self, area: Area) -> Plane {
        let mut plane = Plane::filled(self.width, self.height, 0.0);
        for y in area.y.0..area.y.1 {
            let to = &mut plane.values[y * self.width..][area.x.0..area.x.1];
            to.copy_from_slice(&self.row(y)[area.x.0..area.x.1]);
        }
        plane
    }

    /// Writes `f` of a plane's values into whole groups around an area, and `outside` around it.
    pub(crate) fn copy_area(&mut self, plane: &Plane, area: Area, outside: f32, f: impl Fn(f32) -> f32) {
        let groups = area.in_groups();
        for y in groups.y.0..groups.y.1 {
            let row = self.row_mut(y);
            row[groups.x.0..groups.x.1].fill(outside);
            if (area.y.0..area.y.1).contains(&y) {
                let from = &plane.row(y)[area.x.0..area.x.1];
                for (to, &value) in row[area.x.0..area.x.1].iter_mut().zip(from) {
                    *to = f(value);
                }
            }
        }
    }

    /// Copies an area of `from`, in whole groups, with x and y exchanged.
    pub(crate) fn copy_transposed(&mut self, from: &Sheet, area: Area, level: SimdLevel) {
        debug_assert_eq!((self.width, self.height), (from.height, from.width));
        level.run(Transpose { from, to: self, area: area.in_groups() });
    }
}

struct Transpose<'a> {
    from: &'a Sheet,
    to: &'a mut Sheet,
    area: Area,
}

impl Kernel for Transpose<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let (from, to, area) = (self.from, self.to, self.area);
        let (input, output) = (from.values().as_ptr(), to.values_mut().as_mut_ptr());
        for x in (area.x.0..area.x.1).step_by(8) {
            for y in (area.y.0..area.y.1).step_by(8) {
                let (source, target) = (from.offset(y as isize) + x, to.offset(x as isize) + y);
                // SAFETY: areas in groups lie within stride and spare rows of both sheets.
                unsafe {
                    L::transpose8(input.add(source), from.stride, output.add(target), to.stride);
                }
            }
        }
    }
}
