//! The surroundings of a pixel: the height of the gel, smoothed at four scales, and its derivatives.
//!
//! Cells of about a quarter of a millimetre hold the mean height of their pixels. Each level of the pyramid is
//! smoothed by the binomial kernel of length 9 twice (a standard deviation of 2 cells) and halved for the next one,
//! so that the levels see 0.5, 1, 2 and 4 mm around them. All values are linear in the height and exactly 0 where
//! there is no contact anywhere.

use super::{BLOCK, Terrain};
use crate::convolve::mirrored;
use crate::grid::Plane;

/// Levels of the pyramid.
const LEVELS: usize = 4;

/// Derivatives of a level: `1, x, y, xx, xy, yy, xxx, xxy, xyy, yyy`.
pub(super) const DERIVATIVES: usize = 10;

/// Features of the surroundings.
pub(crate) const SURROUNDINGS: usize = LEVELS * DERIVATIVES;

/// The features that are the height itself, one per level.
pub(crate) const AROUND_HEIGHTS: [usize; LEVELS] = [0, DERIVATIVES, 2 * DERIVATIVES, 3 * DERIVATIVES];

/// The features that calibrations fit: the heights of all levels, the slopes of the two coarsest, the curvatures of the
/// coarsest. Chosen by leaving out shapes: fitted to balls and drawn for a ball and a flat prism of 5 x 7 mm on a real sensor
/// at four depths, slopes of finer levels and higher derivatives bleed into the flat contact (mean squared error of the prism
/// 210 with the slopes of the second level, 138 without), while these bring balls to the error that all forty give.
pub(crate) const AROUND_FITTED: [usize; 11] = [
    0,
    DERIVATIVES,
    2 * DERIVATIVES,
    3 * DERIVATIVES,
    2 * DERIVATIVES + 1,
    2 * DERIVATIVES + 2,
    3 * DERIVATIVES + 1,
    3 * DERIVATIVES + 2,
    3 * DERIVATIVES + 3,
    3 * DERIVATIVES + 4,
    3 * DERIVATIVES + 5,
];

/// Side of a cell that is aimed at, in millimetres.
const CELL_MM: f64 = 0.24;

/// Binomial coefficients of length 9 over 256: variance 2.
const SMOOTH: [f32; 9] = [
    1.0 / 256.0,
    8.0 / 256.0,
    28.0 / 256.0,
    56.0 / 256.0,
    70.0 / 256.0,
    56.0 / 256.0,
    28.0 / 256.0,
    8.0 / 256.0,
    1.0 / 256.0,
];

/// Pixels along the side of a cell for a pixel of this size.
pub(crate) fn cell_px(mm_per_px: f64) -> usize {
    ((CELL_MM / mm_per_px).round() as usize).max(1)
}

/// Which of the features are looked at.
pub(super) type Wanted = [bool; SURROUNDINGS];

/// Features of a surface: the finest level on its own cells, the others on cells of twice that size.
pub(super) struct Surroundings {
    pub(super) fine: Features,
    pub(super) coarse: Features,
}

/// Features on cells of one size.
pub(super) struct Features {
    /// Cells along a row and a column.
    pub(super) size: (usize, usize),
    /// Each with its number among all.
    pub(super) planes: Vec<(usize, Plane)>,
}

/// The wanted features of a surface, whose heights are in pixels, in the order of their numbers.
#[inline(always)]
pub(super) fn surroundings(
    terrain: &impl Terrain,
    cell_px: usize,
    mm_per_px: f64,
    wanted: &Wanted,
) -> Surroundings {
    let mut level = smooth(&smooth(&cells(terrain, cell_px, mm_per_px)));
    let fine = Features { size: (level.width, level.height), planes: derivatives(&level, 0, wanted) };
    let coarse_size = (level.width.div_ceil(2), level.height.div_ceil(2));
    let mut coarse = Features { size: coarse_size, planes: Vec::new() };
    let mut sizes: Vec<(usize, usize)> = Vec::new();
    for first in (DERIVATIVES..SURROUNDINGS).step_by(DERIVATIVES) {
        if !wanted[first..].contains(&true) {
            break;
        }
        level = smooth(&smooth(&halve(&level)));
        sizes.push((level.width, level.height));
        for (feature, mut plane) in derivatives(&level, first, wanted) {
            for &(width, height) in sizes[..sizes.len() - 1].iter().rev() {
                plane = double(&plane, width, height);
            }
            coarse.planes.push((feature, plane));
        }
    }
    Surroundings { fine, coarse }
}

/// Mean height of each cell in millimetres; cells at the right and lower border may hold fewer pixels.
#[inline(always)]
fn cells(terrain: &impl Terrain, cell_px: usize, mm_per_px: f64) -> Plane {
    let ((width_px, height_px), columns) = (terrain.size(), terrain.columns());
    let (w, h) = (width_px.div_ceil(cell_px), height_px.div_ceil(cell_px));
    let mut out = Plane::filled(w, h, 0.0);
    if terrain.rows().is_empty() || columns.is_empty() {
        return out;
    }
    let mut sums = vec![0.0f32; width_px];
    let first = columns.start / cell_px;
    for cy in terrain.rows().start / cell_px..terrain.rows().end.div_ceil(cell_px) {
        let rows = cy * cell_px..((cy + 1) * cell_px).min(height_px);
        let count = rows.len();
        sums.fill(0.0);
        for y in rows.start.max(terrain.rows().start)..rows.end.min(terrain.rows().end) {
            let heights = &terrain.heights(y)[columns.clone()];
            for (sum, z) in sums[columns.clone()].iter_mut().zip(heights) {
                *sum += z;
            }
        }
        for (cx, chunk) in sums[..columns.end].chunks(cell_px).enumerate().skip(first) {
            let pixels = cell_px.min(width_px - cx * cell_px);
            let scale = mm_per_px as f32 / (count * pixels) as f32;
            let sum = match chunk {
                // The usual size, without a loop.
                [a, b, c, d] => a + b + c + d,
                _ => chunk.iter().sum(),
            };
            out.values[cy * w + cx] = sum * scale;
        }
    }
    out
}

/// The binomial kernel along both axes, borders mirrored.
#[inline(always)]
fn smooth(plane: &Plane) -> Plane {
    let (w, h, half) = (plane.width, plane.height, SMOOTH.len() / 2);
    // Rows in whole blocks; between the axes with mirrored rows before the first and after the last.
    let stride = w.next_multiple_of(BLOCK);
    let mut across = vec![0.0f32; stride * (h + 2 * half)];
    let mut padded = vec![0.0f32; stride + 2 * half];
    for (y, to) in across.chunks_exact_mut(stride).enumerate() {
        let row = plane.row(mirrored(y as isize - half as isize, h));
        padded[half..half + w].copy_from_slice(row);
        for i in 0..half {
            padded[half - 1 - i] = row[mirrored(-1 - i as isize, w)];
            padded[half + w + i] = row[mirrored((w + i) as isize, w)];
        }
        weigh(&padded, 1, to);
    }
    let mut down = Plane::filled(w, h, 0.0);
    for (y, to) in down.values.chunks_exact_mut(w).enumerate() {
        // The padding is not needed any more.
        let row = &mut padded[..stride];
        weigh(&across[y * stride..], stride, row);
        to.copy_from_slice(&row[..w]);
    }
    down
}

/// Sums of values `step` apart, times the binomial kernel.
#[inline(always)]
fn weigh(from: &[f32], step: usize, to: &mut [f32]) {
    for (i, to) in to.as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
        let mut sum = [0.0f32; BLOCK];
        for (k, weight) in SMOOTH.iter().enumerate() {
            let Some(values) = from[i * BLOCK + k * step..].first_chunk::<BLOCK>() else { continue };
            for j in 0..BLOCK {
                sum[j] = weight.mul_add(values[j], sum[j]);
            }
        }
        *to = sum;
    }
}

/// Means of two by two cells; an odd last column or row counts twice.
#[inline(always)]
fn halve(plane: &Plane) -> Plane {
    let (w, h) = (plane.width.div_ceil(2), plane.height.div_ceil(2));
    let mut out = Plane::filled(w, h, 0.0);
    for y in 0..h {
        let (a, b) = (plane.row(2 * y), plane.row((2 * y + 1).min(plane.height - 1)));
        for x in 0..w {
            let (left, right) = (2 * x, (2 * x + 1).min(plane.width - 1));
            out.values[y * w + x] = 0.25 * ((a[left] + a[right]) + (b[left] + b[right]));
        }
    }
    out
}

/// The inverse of [`halve`] for smooth planes: each cell is three quarters its parent and a quarter the next one.
#[inline(always)]
pub(super) fn double(plane: &Plane, width: usize, height: usize) -> Plane {
    let n = plane.width;
    let mut out = Plane::filled(width, height, 0.0);
    // A row of parents with the first and the last one twice.
    let mut padded = vec![0.0f32; n + 2];
    for (y, to) in out.values.chunks_exact_mut(width).enumerate() {
        let near = y / 2;
        let far = if y % 2 == 0 { near.saturating_sub(1) } else { (near + 1).min(plane.height - 1) };
        let (near, far) = (plane.row(near), plane.row(far));
        for (value, (near, far)) in padded[1..=n].iter_mut().zip(near.iter().zip(far)) {
            *value = 0.75 * near + 0.25 * far;
        }
        (padded[0], padded[n + 1]) = (padded[1], padded[n]);
        let (pairs, last) = to.as_chunks_mut::<2>();
        let (left, right) = (&padded[..pairs.len()], &padded[2..2 + pairs.len()]);
        let parents = &padded[1..1 + pairs.len()];
        for (pair, (parent, (left, right))) in
            pairs.iter_mut().zip(parents.iter().zip(left.iter().zip(right)))
        {
            *pair = [0.75 * parent + 0.25 * left, 0.75 * parent + 0.25 * right];
        }
        if let [last] = last {
            *last = 0.75 * padded[width / 2 + 1] + 0.25 * padded[width / 2];
        }
    }
    out
}

/// Of which derivative each one is the difference along x (`false`) or y, behind the plane itself.
const MADE_OF: [(usize, bool); DERIVATIVES - 1] =
    [(0, false), (0, true), (1, false), (1, true), (2, true), (3, false), (3, true), (5, false), (5, true)];

/// The plane of a level and its central differences up to third order, per cell: those that are wanted, the first of which has
/// the number `first`.
#[inline(always)]
fn derivatives(z: &Plane, first: usize, wanted: &Wanted) -> Vec<(usize, Plane)> {
    let mut needed = [false; DERIVATIVES];
    needed.copy_from_slice(&wanted[first..first + DERIVATIVES]);
    for (i, &(from, _)) in MADE_OF.iter().enumerate().rev() {
        needed[from] |= needed[i + 1];
    }
    let mut planes: [Option<Plane>; DERIVATIVES] = [const { None }; DERIVATIVES];
    for (i, &(from, is_along_y)) in MADE_OF.iter().enumerate() {
        if needed[i + 1] {
            let from = planes[from].as_ref().unwrap_or(z);
            planes[i + 1] = Some(if is_along_y { along_y(from) } else { along_x(from) });
        }
    }
    if needed[0] {
        planes[0] = Some(z.clone());
    }
    let numbered = planes.into_iter().enumerate().filter_map(|(i, plane)| Some((first + i, plane?)));
    numbered.filter(|(feature, _)| wanted[*feature]).collect()
}

#[inline(always)]
fn along_x(z: &Plane) -> Plane {
    let mut out = Plane::filled(z.width, z.height, 0.0);
    for (from, to) in z.values.chunks_exact(z.width).zip(out.values.chunks_exact_mut(z.width)) {
        if z.width > 2 {
            let inner = to[1..z.width - 1].iter_mut().zip(from[2..].iter().zip(from));
            for (to, (right, left)) in inner {
                *to = 0.5 * (right - left);
            }
        }
    }
    out
}

#[inline(always)]
fn along_y(z: &Plane) -> Plane {
    let mut out = Plane::filled(z.width, z.height, 0.0);
    for y in 1..z.height.saturating_sub(1) {
        let (above, below) = (z.row(y - 1), z.row(y + 1));
        let to = &mut out.values[y * z.width..(y + 1) * z.width];
        let inner = to.iter_mut().zip(below.iter().zip(above));
        for (to, (below, above)) in inner {
            *to = 0.5 * (below - above);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::Planes;
    use super::*;

    #[test]
    fn the_levels_see_gaussians_of_half_a_millimetre_and_doubles() {
        // A pin at a cell's centre: the variance of the smoothed height is that of the kernels.
        let pin = 252..260;
        let surface =
            Plane::from_fn(512, 512, |x, y| f32::from(u8::from(pin.contains(&x) && pin.contains(&y))));
        let found = surroundings(&Planes::of_heights(&surface), 8, 0.03, &[true; SURROUNDINGS]);
        let variance = |plane: &Plane| {
            let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
            for (i, &z) in plane.values.iter().enumerate() {
                let x = (i % plane.width) as f64;
                sum += f64::from(z);
                first += f64::from(z) * x;
                second += f64::from(z) * x * x;
            }
            second / sum - (first / sum) * (first / sum)
        };
        // Smoothed twice by variance 2; the pin itself straddles two cells and adds 1/4.
        assert!((variance(&found.fine.planes[0].1) - 4.25).abs() < 1e-3);
        // A quarter of that in cells of twice the size, plus the pair's own spread, plus 4.
        assert!((variance(&found.coarse.planes[0].1) - (4.25 / 4.0 + 0.0625 + 4.0)).abs() < 1e-2);
        assert_eq!(
            (found.fine.planes.len(), found.coarse.planes.len()),
            (DERIVATIVES, SURROUNDINGS - DERIVATIVES)
        );
    }

    #[test]
    fn a_slanted_plane_has_its_slope_on_every_level() {
        let surface = Plane::from_fn(330, 250, |x, y| 0.1 * x as f32 - 0.2 * y as f32);
        let found = surroundings(&Planes::of_heights(&surface), 4, 0.06, &[true; SURROUNDINGS]);
        let middle = |plane: &Plane| plane.at(plane.width / 2, plane.height / 2);
        // Millimetres per cell: slope times the cell's side, doubled from level to level.
        let close = |value: f32, exact: f32| assert!((value - exact).abs() < 2e-3, "{value} {exact}");
        close(middle(&found.fine.planes[1].1), 0.1 * 0.24);
        close(middle(&found.fine.planes[2].1), -0.2 * 0.24);
        close(middle(&found.coarse.planes[1].1), 0.2 * 0.24);
        close(middle(&found.fine.planes[3].1), 0.0);
    }

    /// Each feature is the same whatever else is looked at.
    #[test]
    fn a_feature_alone_is_that_of_all() {
        let surface = Plane::from_fn(83, 61, |x, y| {
            let (x, y) = (x as f32 - 50.0, y as f32 - 27.0);
            (6.0 - 0.03 * (x * x + 0.6 * y * y + 0.3 * x * y)).max(0.0)
        });
        let of = |wanted: &Wanted| {
            let found = surroundings(&Planes::of_heights(&surface), 2, 0.1, wanted);
            [found.fine.planes, found.coarse.planes].concat()
        };
        let all = of(&[true; SURROUNDINGS]);
        assert_eq!(
            all.iter().map(|(feature, _)| *feature).collect::<Vec<_>>(),
            Vec::from_iter(0..SURROUNDINGS)
        );
        for feature in 0..SURROUNDINGS {
            let mut wanted = [false; SURROUNDINGS];
            wanted[feature] = true;
            assert_eq!(of(&wanted), [all[feature].clone()], "feature {feature}");
        }
        assert!(of(&[false; SURROUNDINGS]).is_empty());
    }
}
