//! Stage `indent`: how deep the part sinks into the gel, and the pressure that follows.

use crate::grid::{Grid, Plane};
use crate::patch::aggregate;
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

/// Presses the surface `heights` (in pixels, towards the gel) in with `force_n`.
///
/// The imprint volume is proportional to the force, `V = c F` (taxim_robot; Wucherer et al. 2023), and pressure is
/// that of a Winkler bed, `p = depth / c`, so that the pressure integrates to the force. The depth d solves
///
/// ```text
/// a^3 sum max(0, h_i + d) = c F          (a: side of a pixel)
/// ```
///
/// by Newton's method on a convex, piecewise linear function, from the deep side: it converges monotonically and
/// ends exactly, when the set of pixels in contact no longer changes.
pub fn indent(heights: &Plane, grid: &Grid, gel: &PressedGel, force_n: f64) -> Result<Imprint, IndentError> {
    let a = grid.metres_per_px;
    let thickness_px = gel.thickness_m / a;
    let top = heights.values.iter().fold(f32::NEG_INFINITY, |m, &h| m.max(h));
    if top == f32::NEG_INFINITY {
        let size = |n: usize| n as f64 * a * 1e3;
        return Err(IndentError::NothingInFront {
            width_mm: size(grid.width_px),
            height_mm: size(grid.height_px),
        });
    }
    let top = f64::from(top);
    // Only what a press through the whole gel would reach can come into contact.
    let reachable: Vec<f64> =
        heights.values.iter().map(|&h| f64::from(h) - top).filter(|&below| below > -thickness_px).collect();
    let wanted = gel.imprint_m3_per_n * force_n / (a * a * a);
    let Some(press_px) = solve_press(&reachable, wanted, thickness_px) else {
        let available: f64 = reachable.iter().map(|below| below + thickness_px).sum();
        return Err(IndentError::ThroughTheGel {
            force_n,
            wanted_mm3: gel.imprint_m3_per_n * force_n * 1e9,
            thickness_mm: gel.thickness_m * 1e3,
            available_mm3: available * a * a * a * 1e9,
        });
    };
    let shift = press_px - top;
    let depth = heights.values.iter().map(|&h| (f64::from(h) + shift).max(0.0) as f32).collect();
    let depth_px = Plane { width: heights.width, height: heights.height, values: depth };
    let patch = aggregate(&depth_px, grid, force_n);
    Ok(Imprint { depth_px, press_depth_m: press_px * a, patch })
}

/// The press at which `sum max(0, below_i + press) = wanted`; `None` if it exceeds `limit`.
fn solve_press(below: &[f64], wanted: f64, limit: f64) -> Option<f64> {
    let mut press = limit;
    let mut touching = usize::MAX;
    loop {
        let (mut volume, mut count) = (0.0, 0);
        for b in below {
            let depth = b + press;
            if depth > 0.0 {
                volume += depth;
                count += 1;
            }
        }
        if touching == usize::MAX && volume < wanted {
            return None;
        }
        if count == touching || count == 0 {
            return Some(press);
        }
        touching = count;
        press -= (volume - wanted) / count as f64;
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
