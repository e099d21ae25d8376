//! The gel surface at rest: flat, domed, or measured.

use super::{SensorError, check_range};
use crate::grid::{Grid, Plane};

/// Deepest rest surface below its highest point.
const LARGEST_SAG_M: f64 = 20e-3;

/// Shape of the gel without contact. Heights are towards the part, relative to the highest point, so none is above 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum GelShape {
    /// A plane.
    #[default]
    Flat,
    /// A paraboloid with its apex in the middle of the image.
    Dome {
        /// How much the corners of the image lie below the apex.
        sag_m: f64,
    },
    /// Any shape: one height a pixel, in pixels, row by row.
    Map(Vec<f32>),
}

impl GelShape {
    /// Whether it is a plane.
    pub fn is_flat(&self) -> bool {
        match self {
            GelShape::Flat => true,
            GelShape::Dome { sag_m } => *sag_m == 0.0,
            GelShape::Map(_) => false,
        }
    }

    /// Heights at rest in pixels, at most 0; `None` for a flat gel.
    ///
    /// A dome is `-sag r^2 / r_corner^2`: the paraboloid that a spherical cap is to within `sag / (4 R)` of its sag
    /// (2 % for Taxim's 1.4 mm on a half diagonal of 11.8 mm).
    pub fn rest_px(&self, grid: &Grid) -> Option<Plane> {
        self.rest_over(grid, grid)
    }

    /// The same on another grid than that of the image, `view`; a map has that of the image alone.
    pub(crate) fn rest_over(&self, grid: &Grid, view: &Grid) -> Option<Plane> {
        match self {
            GelShape::Flat => None,
            GelShape::Dome { sag_m } if *sag_m == 0.0 => None,
            GelShape::Dome { sag_m } => {
                let corner = view.centre_m(view.width_px - 1, view.height_px - 1);
                let scale = -sag_m / grid.metres_per_px / (corner.0 * corner.0 + corner.1 * corner.1);
                Some(grid.plane(|x, y| scale * (x * x + y * y)))
            }
            GelShape::Map(heights) => {
                Some(Plane { width: grid.width_px, height: grid.height_px, values: heights.clone() })
            }
        }
    }

    pub(super) fn check(&self, grid: &Grid) -> Result<(), SensorError> {
        let largest_px = LARGEST_SAG_M / grid.metres_per_px;
        match self {
            GelShape::Flat => Ok(()),
            GelShape::Dome { sag_m } => {
                let deepest_mm = LARGEST_SAG_M * 1e3;
                check_range("dome_sag_mm", [sag_m * 1e3], 0.0..=deepest_mm, "from 0 to 20 mm")
            }
            GelShape::Map(heights) => {
                let heights = heights.iter().map(|&h| f64::from(h));
                let text = "from -20 mm in pixels to 0, relative to the highest point";
                check_range("gel_height_px", heights, -largest_px..=0.0, text)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dome_sags_at_its_corners_and_not_in_the_middle() {
        let grid = Grid { width_px: 41, height_px: 31, metres_per_px: 1e-4 };
        let rest = GelShape::Dome { sag_m: 0.5e-3 }.rest_px(&grid).unwrap();
        assert_eq!(rest.at(20, 15), 0.0);
        for (x, y) in [(0, 0), (40, 0), (0, 30), (40, 30)] {
            assert!((rest.at(x, y) + 5.0).abs() < 1e-5);
        }
        assert_eq!(GelShape::Dome { sag_m: 0.0 }.rest_px(&grid), None, "no sag is flat");
    }
}
