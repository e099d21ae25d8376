//! Stepped shaft.

use super::Builder;
use crate::TriMesh;

/// A shaft with a thick middle, thinner ends, chamfers, and a retaining-ring groove beside its centre.
/// Its axis is the x axis.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteppedShaft {
    /// Diameter of the middle.
    pub diameter_mm: f64,
    /// Length of the middle.
    pub middle_mm: f64,
    /// Diameter of both ends.
    pub end_diameter_mm: f64,
    /// Length of each end.
    pub end_mm: f64,
    /// Chamfer at the shoulders and ends.
    pub chamfer_mm: f64,
    /// Distance of the groove's centre from the middle.
    pub groove_at_mm: f64,
    /// Width of the groove.
    pub groove_width_mm: f64,
    /// Depth of the groove.
    pub groove_depth_mm: f64,
    /// Facets around the axis.
    pub segments: usize,
}

impl Default for SteppedShaft {
    fn default() -> Self {
        Self {
            diameter_mm: 20.0,
            middle_mm: 90.0,
            end_diameter_mm: 15.0,
            end_mm: 25.0,
            chamfer_mm: 1.0,
            groove_at_mm: 8.0,
            groove_width_mm: 1.3,
            groove_depth_mm: 0.5,
            segments: 360,
        }
    }
}

impl SteppedShaft {
    /// The mesh, in metres.
    pub fn mesh(&self) -> TriMesh {
        let (r, e) = (self.diameter_mm / 2.0, self.end_diameter_mm / 2.0);
        let (m, l) = (self.middle_mm / 2.0, self.middle_mm / 2.0 + self.end_mm);
        let c = self.chamfer_mm;
        let (g0, g1) =
            (self.groove_at_mm - self.groove_width_mm / 2.0, self.groove_at_mm + self.groove_width_mm / 2.0);
        let floor = r - self.groove_depth_mm;
        // From the right end to the left one: the solid lies below, so the radius falls on the way back.
        let outline = [
            (l, 0.0),
            (l, e - c),
            (l - c, e),
            (m, e),
            (m, r - c),
            (m - c, r),
            (g1, r),
            (g1, floor),
            (g0, floor),
            (g0, r),
            (c - m, r),
            (-m, r - c),
            (-m, e),
            (c - l, e),
            (-l, e - c),
            (-l, 0.0),
        ];
        let mut b = Builder::default();
        b.revolve(&outline.map(|(x, radius)| (x * 1e-3, radius * 1e-3)), self.segments);
        b.finish()
    }
}
