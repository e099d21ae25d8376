//! Stages `gradient` and `shade` in one walk over the part of the surface that is not flat.

use crate::colour::regressor::{DrawScratch, Terrain};
use crate::colour::{LambertRow, LocalColours};
use crate::convolve::{Area, Sheet};
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use std::ops::Range;

/// Colour change of a surface that is 0 beyond `area` and within its outermost two pixels, with the bits of
/// [`crate::gradient`] and [`crate::shade`].
pub(crate) fn change(model: LocalColours<'_>, sheet: &Sheet, area: Area, level: SimdLevel) -> [Plane; 3] {
    let mut change = [0, 1, 2].map(|_| Plane::filled(sheet.width, sheet.height, 0.0));
    if let Some(slopes) = Slopes::of(sheet, area) {
        draw(model, slopes, &mut change, &mut DrawScratch::default(), level);
    }
    change
}

/// Draws into planes, which are 0 for lights.
fn draw(
    model: LocalColours<'_>,
    slopes: Slopes<'_>,
    change: &mut [Plane; 3],
    scratch: &mut DrawScratch,
    level: SimdLevel,
) {
    match model {
        LocalColours::Lambert(lambert) => {
            let row = lambert.row(slopes.sheet.width, slopes.sheet.height);
            level.run(ShadeRows { slopes, row, change });
        }
        LocalColours::Regressor(model) => model.shade(&slopes, change, scratch, level),
    }
}

/// Memory for the change of colour of one image.
#[derive(Debug, Default)]
pub(crate) struct ChangeScratch {
    planes: Option<[Plane; 3]>,
    /// What may not be 0.
    written: Area,
    draw: DrawScratch,
}

impl ChangeScratch {
    /// As [`change`] without new memory; `f` gets the planes.
    pub(crate) fn with<T>(
        &mut self,
        model: LocalColours<'_>,
        (sheet, area): (&Sheet, Area),
        level: SimdLevel,
        f: impl FnOnce(&[Plane; 3]) -> T,
    ) -> T {
        let zeros = || Plane::filled(sheet.width, sheet.height, 0.0);
        let size = |planes: &[Plane; 3]| (planes[0].width, planes[0].height);
        let planes = match self.planes.take().filter(|planes| size(planes) == (sheet.width, sheet.height)) {
            Some(planes) => self.planes.insert(planes),
            None => {
                self.written = Area::EMPTY;
                self.planes.insert([zeros(), zeros(), zeros()])
            }
        };
        let slopes = Slopes::of(sheet, area);
        let all = matches!(model, LocalColours::Regressor(_)) && slopes.is_some();
        if !all {
            for plane in planes.iter_mut() {
                for y in self.written.y.0..self.written.y.1 {
                    plane.values[y * sheet.width..][self.written.x.0..self.written.x.1].fill(0.0);
                }
            }
        }
        self.written = if all { Area::whole(sheet.width, sheet.height) } else { area };
        if let Some(slopes) = slopes {
            draw(model, slopes, planes, &mut self.draw, level);
        }
        f(planes)
    }
}

/// Where slopes are needed.
struct Slopes<'a> {
    sheet: &'a Sheet,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl<'a> Slopes<'a> {
    /// Where the slope of a surface that is 0 beyond the inner pixels of an area is not; `None` if nowhere.
    fn of(sheet: &'a Sheet, area: Area) -> Option<Self> {
        let (w, h) = (sheet.width, sheet.height);
        if area.is_empty() || w < 3 || h < 3 {
            return None;
        }
        let inner = |(start, end): (usize, usize), n: usize| {
            (if start == 0 { 0 } else { start + 1 })..(if end == n { n } else { end - 1 })
        };
        Some(Self { sheet, columns: inner(area.x, w), rows: inner(area.y, h) })
    }

    /// The slopes of a row: those of the nearest pixel that has all its neighbours.
    #[inline(always)]
    fn row(&self, y: usize, gx: &mut [f32], gy: &mut [f32]) {
        let (w, h) = (self.sheet.width, self.sheet.height);
        let inner = y.clamp(1, h - 2);
        let (here, above, below) =
            (self.sheet.row(inner), self.sheet.row(inner - 1), self.sheet.row(inner + 1));
        let (start, end) = (self.columns.start.max(1), self.columns.end.min(w - 1));
        let n = end - start;
        let (left, right) = (&here[start - 1..][..n], &here[start + 1..][..n]);
        let (above, below) = (&above[start..][..n], &below[start..][..n]);
        let (gx_inner, gy_inner) = (&mut gx[start..][..n], &mut gy[start..][..n]);
        for i in 0..n {
            gx_inner[i] = (right[i] - left[i]) * 0.5;
            gy_inner[i] = (below[i] - above[i]) * 0.5;
        }
        if self.columns.start == 0 {
            (gx[0], gy[0]) = (gx[1], gy[1]);
        }
        if self.columns.end == w {
            (gx[w - 1], gy[w - 1]) = (gx[w - 2], gy[w - 2]);
        }
    }
}

impl Terrain for Slopes<'_> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.sheet.width, self.sheet.height)
    }
    #[inline(always)]
    fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }
    #[inline(always)]
    fn columns(&self) -> Range<usize> {
        self.columns.clone()
    }
    #[inline(always)]
    fn heights(&self, y: usize) -> &[f32] {
        self.sheet.row(y)
    }
    #[inline(always)]
    fn slopes(&self, y: usize, along_x: &mut [f32], along_y: &mut [f32]) {
        self.row(y, along_x, along_y);
    }
}

/// Slopes and colours row by row.
struct ShadeRows<'a> {
    slopes: Slopes<'a>,
    row: LambertRow<'a>,
    change: &'a mut [Plane; 3],
}

impl Kernel for ShadeRows<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(mut self) {
        let (w, columns) = (self.slopes.sheet.width, self.slopes.columns.clone());
        let (mut gx, mut gy) = (vec![0.0; w], vec![0.0; w]);
        for y in self.slopes.rows.clone() {
            self.slopes.row(y, &mut gx, &mut gy);
            let out = self.change.each_mut().map(|plane| &mut plane.values[y * w..(y + 1) * w]);
            self.row.shade(y, columns.clone(), &gx, &gy, out);
        }
    }
}
