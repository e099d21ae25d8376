//! The core of a contact: where the gel follows the part, and how much of each pixel that is.
//!
//! A core of whole pixels moves by whole pixels, which draws stripes along every slanted edge. So a pixel belongs to the core by
//! the share of it that is deep enough. Beside a step of the part the share is that of nine points; elsewhere it follows from the
//! distance to the border of the core, `1/2 + (d - d_core) / |grad d|`.

use crate::convolve::{Area, Sheet};
use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};

/// Points of a pixel, three along each side.
pub(crate) const POINTS: usize = 9;

/// A slope, in pixels of depth per pixel, that is flat: the border of a core there lies in no pixel.
const FLAT: f32 = 1e-6;

/// Depths within the pixels of a contact that lie beside a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    pixels: Vec<EdgePixel>,
}

/// A pixel beside a step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EdgePixel {
    /// Its place in the image, row by row.
    pixel: u32,
    /// How much its points count, 0 to 1; the rest is its centre.
    weight: f32,
    /// Depth below the gel at rest at its points, in pixels; at most 0 where nothing touches.
    depths_px: [f32; POINTS],
}

impl Edges {
    /// None yet, with memory for this many pixels.
    pub(crate) fn with_room_for(pixels: usize) -> Self {
        Self { pixels: Vec::with_capacity(pixels) }
    }

    /// Adds a pixel: its place in the image, how much its points count, and the depth at each.
    pub(crate) fn push(&mut self, pixel: u32, weight: f32, depths_px: [f32; POINTS]) {
        self.pixels.push(EdgePixel { pixel, weight, depths_px });
    }
}

impl EdgePixel {
    /// The share of it that is deeper than `core_px`, and the mean depth there.
    fn core(&self, core_px: f32) -> (f32, f32) {
        let (mut count, mut sum) = (0.0, 0.0);
        for depth in self.depths_px {
            if depth > core_px {
                count += 1.0;
                sum += depth;
            }
        }
        (count / POINTS as f32, if count > 0.0 { sum / count } else { 0.0 })
    }
}

/// Writes the share of each pixel that belongs to the core, 0 outside it, and the depth there, in whole groups around `area`, which
/// holds the contact.
pub(super) fn write_core(
    depth_px: &Plane,
    edges: &Edges,
    core_px: f32,
    area: Area,
    (depths, shares): (&mut Sheet, &mut Sheet),
    level: SimdLevel,
) {
    depths.copy_area(depth_px, area, 0.0, |d| d);
    shares.copy_area(depth_px, area, 0.0, |_| 0.0);
    level.run(Smooth { depth_px, core_px, area, shares });
    for edge in &edges.pixels {
        let (x, y) = (edge.pixel as usize % depth_px.width, edge.pixel as usize / depth_px.width);
        // Where nothing touches.
        if !(area.x.0..area.x.1).contains(&x) || !(area.y.0..area.y.1).contains(&y) {
            continue;
        }
        let (by_points, depth) = edge.core(core_px);
        let (share, at) = (&mut shares.row_mut(y)[x], &mut depths.row_mut(y)[x]);
        let by_slope = (1.0 - edge.weight) * *share;
        *share = by_slope + edge.weight * by_points;
        if *share > 0.0 {
            *at = (by_slope * *at + edge.weight * by_points * depth) / *share;
        }
    }
}

/// Shares that follow from depth and slope.
struct Smooth<'a> {
    depth_px: &'a Plane,
    core_px: f32,
    area: Area,
    shares: &'a mut Sheet,
}

impl Kernel for Smooth<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { depth_px, core_px, area, shares } = self;
        let (from, to) = area.x;
        let last = depth_px.width - 1;
        for y in area.y.0..area.y.1 {
            let (above, here) = (depth_px.row(y.saturating_sub(1)), depth_px.row(y));
            let below = depth_px.row((y + 1).min(depth_px.height - 1));
            let row = shares.row_mut(y);
            // Columns that have a neighbour on each side, then those at the border of the image.
            let (first, end) = (from.max(1), to.min(last));
            if first < end {
                let (left, right) = (&here[first - 1..end - 1], &here[first + 1..end + 1]);
                let (middle, up, down) = (&here[first..end], &above[first..end], &below[first..end]);
                let inner = &mut row[first..end];
                for i in 0..inner.len() {
                    inner[i] = share(middle[i] - core_px, right[i] - left[i], down[i] - up[i]);
                }
            }
            for x in [0, last] {
                if (from..to).contains(&x) {
                    let (left, right) = (here[x.saturating_sub(1)], here[(x + 1).min(last)]);
                    row[x] = share(here[x] - core_px, right - left, below[x] - above[x]);
                }
            }
        }
    }
}

/// The share of a pixel that lies on the deep side of a line, from the depth beyond it and twice the slope along both axes.
#[inline(always)]
fn share(beyond_px: f32, across: f32, down: f32) -> f32 {
    let slope = 0.5 * (across * across + down * down).sqrt();
    let slope = if slope > FLAT { slope } else { FLAT };
    let share = 0.5 + beyond_px / slope;
    let share = if share > 0.0 { share } else { 0.0 };
    if share < 1.0 { share } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares and depths of a core.
    fn core(depth_px: &Plane, edges: &Edges, core_px: f32) -> [Plane; 2] {
        let level = SimdLevel::best();
        let whole = Area::whole(depth_px.width, depth_px.height);
        let [mut depths, mut shares] = [Sheet::default(), Sheet::default()];
        for sheet in [&mut depths, &mut shares] {
            sheet.reshape(depth_px.width, depth_px.height, 0);
        }
        write_core(depth_px, edges, core_px, whole, (&mut depths, &mut shares), level);
        [shares.plane(whole), depths.plane(whole)]
    }

    /// The core of a ball is a disc: its area is that of the circle to a thousandth; whole pixels miss it by three times as much or more.
    #[test]
    fn the_core_of_a_ball_has_the_area_of_its_circle() {
        let (radius, press, core_px) = (40.0f64, 8.0, 3.2);
        let exact = std::f64::consts::PI * (radius * radius - (radius - press + core_px).powi(2));
        let (mut by_share, mut by_pixels) = (0.0f64, 0.0f64);
        for i in 0..20 {
            let (cx, cy) = (40.0 + 0.05 * f64::from(i), 40.0 + 0.31 * f64::from(i % 3));
            let ball = Plane::from_fn(81, 81, |x, y| {
                let squared = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
                ((radius * radius - squared).max(0.0).sqrt() - radius + press).max(0.0) as f32
            });
            let [shares, _] = core(&ball, &Edges::default(), core_px as f32);
            let area: f64 = shares.values.iter().map(|&s| f64::from(s)).sum();
            let pixels = ball.values.iter().filter(|&&d| f64::from(d) > core_px).count() as f64;
            by_share += (area - exact).powi(2) / 20.0;
            by_pixels += (pixels - exact).powi(2) / 20.0;
        }
        let (by_share, by_pixels) = (by_share.sqrt() / exact, by_pixels.sqrt() / exact);
        assert!(
            by_share < 1e-3 && by_pixels > 3.0 * by_share,
            "{by_share:.1e}, whole pixels {by_pixels:.1e}"
        );
    }

    #[test]
    fn beside_a_step_points_say_how_much_of_a_pixel_is_core() {
        let depth = Plane::from_fn(9, 9, |x, _| {
            if x < 4 {
                6.0
            } else if x == 4 {
                2.0
            } else {
                0.0
            }
        });
        let mut edges = Edges::default();
        // A third of column 4 lies 6 px deep, the rest next to the part.
        (0..9).for_each(|y| edges.push(9 * y + 4, 1.0, [6.0, 0.0, 0.0, 6.0, 0.0, 0.0, 6.0, 0.0, 0.0]));
        let [shares, depths] = core(&depth, &edges, 2.4);
        assert_eq!((shares.at(3, 4), depths.at(3, 4)), (1.0, 6.0));
        assert!((shares.at(4, 4) - 1.0 / 3.0).abs() < 1e-6);
        assert_eq!((depths.at(4, 4), shares.at(5, 4)), (6.0, 0.0));
    }
}
