//! Stage `indent`: how deep the part sinks into the gel, and the pressure that follows.

use crate::grid::{Grid, Plane};
use crate::patch::aggregate;
use crate::raster::{ClusteredMesh, HeightMap};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::ContactPatch;

/// The part pressed into the gel.
#[derive(Debug, Clone, PartialEq)]
pub struct Imprint {
    /// Depth of each pixel of the part's surface below the unloaded gel surface, in pixels; 0 without contact.
    pub depth_px: Plane,
    /// Largest depth.
    pub press_depth_m: f64,
    /// The pressure field as a few cells.
    pub patch: ContactPatch,
}

/// The gel of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressedGel {
    /// Thickness, the deepest press there can be.
    pub thickness_m: f64,
    /// Imprint constant c of `V = c F`.
    pub imprint_m3_per_n: f64,
}

/// Why a part could not be pressed into the gel.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IndentError {
    /// No surface lies in front of the camera.
    #[error(
        "no surface of the part lies in front of the {width_mm:.1} x {height_mm:.1} mm of gel that the camera sees"
    )]
    NothingInFront {
        /// Width of the window.
        width_mm: f64,
        /// Height of the window.
        height_mm: f64,
    },
    /// The imprint does not fit into the gel.
    #[error(
        "the press is deeper than the gel: {force_n} N need an imprint of {wanted_mm3:.2} mm3, pressed through the \
         whole {thickness_mm:.2} mm of gel it has {available_mm3:.2} mm3"
    )]
    ThroughTheGel {
        /// Normal force.
        force_n: f64,
        /// Volume that the force needs.
        wanted_mm3: f64,
        /// Thickness of the gel.
        thickness_mm: f64,
        /// Volume at a press as deep as the gel.
        available_mm3: f64,
    },
}

/// Presses the surface `heights` (in pixels above the gel at rest, towards it) in with `force_n`.
///
/// The imprint volume is proportional to the force, `V = c F` (taxim_robot; Wucherer et al. 2023), and pressure is
/// that of a Winkler bed, `p = depth / c`, so that the pressure integrates to the force. The depth d solves
///
/// ```text
/// a^3 sum max(0, h_i + d) = c F          (a: side of a pixel)
/// ```
///
/// by Newton's method on a convex, piecewise linear function, from the deep side: it converges monotonically and
/// ends exactly, when the set of pixels in contact no longer changes. The result is a function of that set alone.
///
/// For a gel that is not flat at rest, `heights` are those above the gel plane plus the rest surface
/// ([`crate::GelShape::rest_px`]); [`crate::Renderer::press`] adds it.
pub fn indent(heights: &Plane, grid: &Grid, gel: &PressedGel, force_n: f64) -> Result<Imprint, IndentError> {
    let level = SimdLevel::best();
    let map = HeightMap::of(heights);
    let top = map.top(None, level);
    finish_press(
        &map,
        None,
        top,
        gel.thickness_m / grid.metres_per_px,
        grid,
        gel,
        force_n,
        level,
        &mut vec![],
    )
}

/// Draws a part only as deep as a press reaches, and presses it in.
///
/// The press is as deep as the map had been drawn through the whole gel: a piece of it is drawn, and deepened until
/// the volume above its lower end is that of the force.
#[expect(clippy::too_many_arguments, reason = "what a press is made of, and memory")]
pub(crate) fn press(
    map: &mut HeightMap,
    mesh: &ClusteredMesh,
    rest: Option<&Plane>,
    grid: &Grid,
    gel: &PressedGel,
    force_n: f64,
    level: SimdLevel,
    below: &mut Vec<f64>,
) -> Result<Imprint, IndentError> {
    let a = grid.metres_per_px;
    let thickness_px = gel.thickness_m / a;
    let wanted = gel.imprint_m3_per_n * force_n / (a * a * a);
    let mut depth_px = FIRST_DEPTH * thickness_px;
    loop {
        let top = map.draw_down(mesh, depth_px, rest, level);
        if top == f32::NEG_INFINITY || depth_px >= thickness_px {
            return finish_press(map, rest, top, thickness_px, grid, gel, force_n, level, below);
        }
        let (volume, count) = map.volume(rest, depth_px - f64::from(top), level);
        if volume >= wanted {
            return finish_press(map, rest, top, depth_px, grid, gel, force_n, level, below);
        }
        // Deeper than this it cannot be: more pixels only make it shallower.
        let enough = depth_px + (wanted - volume) / count + 1e-6;
        depth_px = enough.min(2.0 * depth_px).min(thickness_px);
    }
}

/// The first piece drawn, as a share of the gel.
const FIRST_DEPTH: f64 = 0.125;

/// Solves for the press, which is at most `limit_px`, on a map that is complete as deep as that.
#[expect(clippy::too_many_arguments, reason = "the tail of two functions")]
fn finish_press(
    map: &HeightMap,
    rest: Option<&Plane>,
    top: f32,
    limit_px: f64,
    grid: &Grid,
    gel: &PressedGel,
    force_n: f64,
    level: SimdLevel,
    below: &mut Vec<f64>,
) -> Result<Imprint, IndentError> {
    let a = grid.metres_per_px;
    if top == f32::NEG_INFINITY {
        let size = |n: usize| n as f64 * a * 1e3;
        return Err(IndentError::NothingInFront {
            width_mm: size(grid.width_px),
            height_mm: size(grid.height_px),
        });
    }
    let top = f64::from(top);
    let wanted = gel.imprint_m3_per_n * force_n / (a * a * a);
    // Only what a press as deep as the limit would reach can come into contact.
    level.run(Reachable { map, rest, top, limit_px, below });
    let available = level.run(Sum { values: below }) + below.len() as f64 * limit_px;
    if available < wanted && limit_px >= gel.thickness_m / a {
        return Err(IndentError::ThroughTheGel {
            force_n,
            wanted_mm3: gel.imprint_m3_per_n * force_n * 1e9,
            thickness_mm: gel.thickness_m * 1e3,
            available_mm3: available * a * a * a * 1e9,
        });
    }
    let press_px = solve_press(below, wanted, limit_px, level);
    let mut depth_px = Plane::filled(map.width, map.height, 0.0);
    level.run(Depths { map, rest, lift: press_px - top, depth_px: &mut depth_px });
    let patch = aggregate(&depth_px, grid, force_n, level);
    Ok(Imprint { depth_px, press_depth_m: press_px * a, patch })
}

/// The press at which `sum max(0, below_i + press) = wanted`. Leaves the values that are in contact.
fn solve_press(below: &mut Vec<f64>, wanted: f64, limit: f64, level: SimdLevel) -> f64 {
    let mut press = limit;
    loop {
        let before = below.len();
        let next = (wanted - level.run(Sum { values: below })) / before as f64;
        press = next.min(press);
        level.run(Keep { values: below, above: -press });
        if below.len() == before || below.is_empty() {
            return press;
        }
    }
}

/// Collects `height + rest - top` of the pixels less than `limit_px` below the top, row by row.
struct Reachable<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
    top: f64,
    limit_px: f64,
    below: &'a mut Vec<f64>,
}

impl Kernel for Reachable<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let area = self.map.area;
        let most = (area.y.1 - area.y.0) * (area.x.1 - area.x.0) + 1;
        if self.below.len() < most {
            self.below.resize(most, 0.0);
        }
        let mut count = 0;
        for y in area.y.0..area.y.1 {
            for h in self.map.above_gel(self.rest, y) {
                let below = f64::from(h) - self.top;
                self.below[count] = below;
                count += usize::from(below > -self.limit_px);
            }
        }
        self.below.truncate(count);
    }
}

/// Keeps the values above a bound, in their order.
struct Keep<'a> {
    values: &'a mut Vec<f64>,
    above: f64,
}

impl Kernel for Keep<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let mut count = 0;
        for i in 0..self.values.len() {
            let value = self.values[i];
            self.values[count] = value;
            count += usize::from(value > self.above);
        }
        self.values.truncate(count);
    }
}

/// The sum in eight parts, value i into part i % 8.
struct Sum<'a> {
    values: &'a [f64],
}

impl Kernel for Sum<'_> {
    type Output = f64;
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f64 {
        let mut parts = [0.0; 8];
        let chunks = self.values.chunks_exact(8);
        let rest = chunks.remainder();
        for chunk in chunks {
            for (part, value) in parts.iter_mut().zip(chunk) {
                *part += value;
            }
        }
        for (part, value) in parts.iter_mut().zip(rest) {
            *part += value;
        }
        parts.iter().sum()
    }
}

/// Writes `height + rest + lift` where that is above 0.
struct Depths<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
    lift: f64,
    depth_px: &'a mut Plane,
}

impl Kernel for Depths<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let area = self.map.area;
        for y in area.y.0..area.y.1 {
            let row = &mut self.depth_px.values[y * self.map.width..][area.x.0..area.x.1];
            for (depth, h) in row.iter_mut().zip(self.map.above_gel(self.rest, y)) {
                let d = f64::from(h) + self.lift;
                *depth = if d > 0.0 { d as f32 } else { 0.0 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width_px: 200, height_px: 160, metres_per_px: 5e-5 };
    const GEL: PressedGel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };

    fn heights(f: impl Fn(f64, f64) -> f64) -> Plane {
        let mut plane = Plane::filled(GRID.width_px, GRID.height_px, 0.0);
        for row in 0..GRID.height_px {
            for column in 0..GRID.width_px {
                let (x, y) = GRID.centre_m(column, row);
                plane.values[row * GRID.width_px + column] = (f(x, y) / GRID.metres_per_px) as f32;
            }
        }
        plane
    }

    /// The volume of a spherical cap is `pi d^2 (R - d / 3)`.
    #[test]
    fn a_ball_sinks_in_by_its_cap() {
        let radius = 4e-3_f64;
        let ball = heights(|x, y| (radius * radius - x * x - y * y).max(0.0).sqrt() - 7e-3);
        for force in [0.5, 5.0, 15.0] {
            let imprint = indent(&ball, &GRID, &GEL, force).unwrap();
            let d = imprint.press_depth_m;
            let volume = std::f64::consts::PI * d * d * (radius - d / 3.0);
            assert!((volume / (1e-9 * force) - 1.0).abs() < 5e-3, "{force} N: {d} m");
            assert!(
                (imprint.patch.normal_force_n() / force - 1.0).abs() < 1e-12,
                "pressure integrates to force"
            );
        }
    }

    /// A flat stamp of area A: `p = F / A`, `d = c F / A`.
    #[test]
    fn a_flat_stamp_presses_evenly() {
        let stamp = heights(|x, y| if x.abs() < 2e-3 && y.abs() < 1e-3 { -1e-3 } else { f64::NEG_INFINITY });
        let imprint = indent(&stamp, &GRID, &GEL, 10.0).unwrap();
        let area = 8e-6;
        assert!((imprint.press_depth_m - 1e-9 * 10.0 / area).abs() < 1e-9);
        for cell in &imprint.patch.cells {
            assert!((cell.pressure_pa() / (10.0 / area) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn pressing_harder_never_makes_the_imprint_smaller() {
        let rough = heights(|x, y| 2e-4 * ((x * 4e3).sin() * (y * 5e3).cos()) - 0.1 * x.abs());
        let mut last = 0.0;
        for i in 1..60 {
            let depth = indent(&rough, &GRID, &GEL, f64::from(i) * 0.5).unwrap().press_depth_m;
            assert!(depth > last);
            last = depth;
        }
    }

    #[test]
    fn a_press_through_the_gel_and_an_empty_window_are_errors() {
        let pin = heights(|x, y| if x * x + y * y < 1e-6 { 0.0 } else { f64::NEG_INFINITY });
        let error = indent(&pin, &GRID, &GEL, 80.0).unwrap_err().to_string();
        assert!(error.contains("80 N need an imprint of 80.00 mm3"), "{error}");
        assert!(error.contains("4.00 mm of gel it has 12."), "{error}");
        let empty = Plane::filled(GRID.width_px, GRID.height_px, f32::NEG_INFINITY);
        let error = indent(&empty, &GRID, &GEL, 1.0).unwrap_err().to_string();
        assert!(error.contains("10.0 x 8.0 mm"), "{error}");
    }
}
