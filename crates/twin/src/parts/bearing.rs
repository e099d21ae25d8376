//! Rolling bearings: two rings and the balls or rollers between them, without cage or shields.

use super::{Builder, sin_cos_turn};
use crate::TriMesh;

/// What both bearings share. The axis is the x axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rings {
    bore_mm: f64,
    outer_mm: f64,
    width_mm: f64,
    inner_shoulder_mm: f64,
    outer_shoulder_mm: f64,
    chamfer_mm: f64,
}

impl Rings {
    fn add(&self, b: &mut Builder) {
        let (h, c) = (self.width_mm / 2.0, self.chamfer_mm);
        for (inside, outside, chamfer_outside) in [
            (self.outer_shoulder_mm / 2.0, self.outer_mm / 2.0, true),
            (self.bore_mm / 2.0, self.inner_shoulder_mm / 2.0, false),
        ] {
            let outline = if chamfer_outside {
                [
                    (-h, inside),
                    (h, inside),
                    (h, outside - c),
                    (h - c, outside),
                    (c - h, outside),
                    (-h, outside - c),
                ]
            } else {
                [
                    (c - h, inside),
                    (h - c, inside),
                    (h, inside + c),
                    (h, outside),
                    (-h, outside),
                    (-h, inside + c),
                ]
            };
            b.revolve(&outline.map(|(x, radius)| (x * 1e-3, radius * 1e-3)), 240);
        }
    }
}

/// A deep groove ball bearing. The default has the boundary dimensions of a 608 (ISO 15: 8 x 22 x 7 mm).
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallBearing {
    /// Bore diameter.
    pub bore_mm: f64,
    /// Outer diameter.
    pub outer_mm: f64,
    /// Width along the axis.
    pub width_mm: f64,
    /// Number of balls.
    pub balls: usize,
    /// Ball diameter.
    pub ball_mm: f64,
    /// Outer diameter of the inner ring's shoulder.
    pub inner_shoulder_mm: f64,
    /// Inner diameter of the outer ring's shoulder.
    pub outer_shoulder_mm: f64,
    /// Chamfer of the rings.
    pub chamfer_mm: f64,
}

impl Default for BallBearing {
    fn default() -> Self {
        Self {
            bore_mm: 8.0,
            outer_mm: 22.0,
            width_mm: 7.0,
            balls: 7,
            ball_mm: 3.969,
            inner_shoulder_mm: 12.1,
            outer_shoulder_mm: 17.9,
            chamfer_mm: 0.3,
        }
    }
}

impl BallBearing {
    /// The mesh, in metres.
    pub fn mesh(&self) -> TriMesh {
        let mut b = Builder::default();
        self.add(&mut b);
        b.finish()
    }

    pub(super) fn add(&self, b: &mut Builder) {
        let Self { bore_mm, outer_mm, width_mm, inner_shoulder_mm, outer_shoulder_mm, chamfer_mm, .. } =
            *self;
        Rings { bore_mm, outer_mm, width_mm, inner_shoulder_mm, outer_shoulder_mm, chamfer_mm }.add(b);
        let pitch = (inner_shoulder_mm + outer_shoulder_mm) / 4.0 * 1e-3;
        let radius = self.ball_mm / 2.0 * 1e-3;
        // Half circle from pole to pole, revolved about the ball's own axis parallel to x.
        let arc: Vec<(f64, f64)> = (0..=16)
            .map(|i| {
                let (s, c) = sin_cos_turn(i, 32);
                (radius * c, if i == 0 || i == 16 { 0.0 } else { radius * s })
            })
            .collect();
        add_rolling(b, &arc, 32, pitch, self.balls);
    }
}

/// A cylindrical roller bearing. The default has the boundary dimensions of ISO 15 series 02 with a 15 mm
/// bore (15 x 35 x 11 mm).
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RollerBearing {
    /// Bore diameter.
    pub bore_mm: f64,
    /// Outer diameter.
    pub outer_mm: f64,
    /// Width along the axis.
    pub width_mm: f64,
    /// Number of rollers.
    pub rollers: usize,
    /// Roller diameter.
    pub roller_mm: f64,
    /// Roller length.
    pub roller_length_mm: f64,
    /// Outer diameter of the inner ring.
    pub inner_shoulder_mm: f64,
    /// Inner diameter of the outer ring.
    pub outer_shoulder_mm: f64,
    /// Chamfer of the rings.
    pub chamfer_mm: f64,
}

impl Default for RollerBearing {
    fn default() -> Self {
        Self {
            bore_mm: 15.0,
            outer_mm: 35.0,
            width_mm: 11.0,
            rollers: 11,
            roller_mm: 5.5,
            roller_length_mm: 10.4,
            inner_shoulder_mm: 19.3,
            outer_shoulder_mm: 30.3,
            chamfer_mm: 0.6,
        }
    }
}

impl RollerBearing {
    /// The mesh, in metres.
    pub fn mesh(&self) -> TriMesh {
        let mut b = Builder::default();
        self.add(&mut b);
        b.finish()
    }

    pub(super) fn add(&self, b: &mut Builder) {
        let Self { bore_mm, outer_mm, width_mm, inner_shoulder_mm, outer_shoulder_mm, chamfer_mm, .. } =
            *self;
        Rings { bore_mm, outer_mm, width_mm, inner_shoulder_mm, outer_shoulder_mm, chamfer_mm }.add(b);
        let pitch = (inner_shoulder_mm + outer_shoulder_mm) / 4.0 * 1e-3;
        let (h, r, c) = (self.roller_length_mm / 2.0 * 1e-3, self.roller_mm / 2.0 * 1e-3, 0.2e-3);
        let roller = [(h, 0.0), (h, r - c), (h - c, r), (c - h, r), (-h, r - c), (-h, 0.0)];
        add_rolling(b, &roller, 48, pitch, self.rollers);
    }
}

/// Adds `count` copies of a revolved profile whose axes stand on the pitch circle, the first at +z.
fn add_rolling(b: &mut Builder, profile: &[(f64, f64)], segments: usize, pitch_m: f64, count: usize) {
    for k in 0..count {
        let (s, c) = sin_cos_turn(k, count);
        let first = b.vertices_m.len();
        b.revolve(profile, segments);
        for v in &mut b.vertices_m[first..] {
            v.y -= pitch_m * s;
            v.z += pitch_m * c;
        }
    }
}
