//! Where the closing jaws meet the part, and what they touch there.
//!
//! The surface in front of each pad decides. The convex hull of the whole part is the contact shape of the engine as long as both
//! pads meet the surface where they meet the hull, and meet it flat: at its highest point. A pad that meets a lower point meets a slope
//! with its edge. Its normal force would lean to the side, push an arm along the pull while the jaws close without friction, and
//! add to the friction force. Else the engine gets a plate in front of each pad.

use crate::convert::rapier_pose;
use crate::scene::pad_shape;
use crate::setup::GripError;
use crate::setup::GripSetup;
use crate::surface::Window;
use gripgen_twin::frames::{Pose, world_from_gel};
use gripgen_twin::{Gel, Jaw, PerJaw};
use nalgebra::Point3;
use rapier3d_f64::parry::query::{ShapeCastOptions, cast_shapes};
use rapier3d_f64::prelude as rapier;
use rapier3d_f64::prelude::SharedShape;

/// A hull that a pad meets this close to the surface stands for it. A hull of few vertices cuts the facets of a round part by less;
/// no force or image depends on it, only where the jaws are said to stand.
const HULL_FITS_M: f64 = 0.1e-3;

/// A hull that rises no higher than this above the place where a pad meets it is met flat. Much more than rounding, much less than what
/// a slope rises beside a pad.
const FLAT_M: f64 = 1e-7;

/// Corners of a plate at most, and the smallest width it has.
const PLATE_CORNERS: usize = 32;
const PLATE_WIDTH_M: f64 = 0.5e-3;

/// Thinnest plate: that of a part without thickness.
const PLATE_THICKNESS_M: f64 = 0.05e-3;

/// Jaws that meet the part.
pub(crate) struct Touch {
    /// Distance of each gel from the grip centre.
    pub(crate) distance_m: PerJaw<f64>,
    /// What the engine lets the pads touch.
    pub(crate) shape: TouchedShape,
}

/// Which contact shape stands for the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TouchedShape {
    /// The hull or the primitive.
    Whole,
    /// Plates in front of the pads.
    Plates,
}

/// Where both jaws meet the part; `None` if one of them never does.
pub(crate) fn touch(setup: &GripSetup<'_>) -> Result<Option<Touch>, GripError> {
    let mut distance_m = PerJaw { left: 0.0, right: 0.0 };
    let mut shape = TouchedShape::Whole;
    for jaw in Jaw::BOTH {
        let whole = first_touch(setup, jaw);
        let Some(gel_from_mesh) = gel_from_mesh(setup, jaw) else {
            match whole? {
                Some(distance) => distance_m[jaw] = distance,
                None => return Ok(None),
            }
            continue;
        };
        let surface =
            setup.shape.surface().and_then(|(s, _)| s.height_m(&gel_from_mesh, window(&setup.gel[jaw])));
        let Some(height_m) = surface.filter(|&h| h >= 0.0) else { return Ok(None) };
        if height_m >= setup.gripper.opening_m / 2.0 {
            return Err(GripError::TooWide { jaw, opening_mm: setup.gripper.opening_m * 1e3 });
        }
        distance_m[jaw] = match whole {
            Ok(Some(hull)) if (hull - height_m).abs() <= HULL_FITS_M && meets_flat(setup, jaw, hull) => hull,
            Err(e @ GripError::Shape(_)) => return Err(e),
            _ => {
                shape = TouchedShape::Plates;
                height_m
            }
        };
    }
    Ok(Some(Touch { distance_m, shape }))
}

impl TouchedShape {
    /// The contact shape, in the part frame, of jaws that meet the part at these distances.
    pub(crate) fn contact_shape(self, setup: &GripSetup<'_>, distance_m: &PerJaw<f64>) -> SharedShape {
        let plates = || {
            let between_m = distance_m.left + distance_m.right;
            let plate = |jaw: Jaw| plate(setup, jaw, distance_m[jaw], between_m);
            let both = [plate(Jaw::Left)?, plate(Jaw::Right)?];
            Some(SharedShape::compound(both.map(|p| (rapier::Pose::IDENTITY, p)).to_vec()))
        };
        match self {
            TouchedShape::Whole => None,
            TouchedShape::Plates => plates(),
        }
        .unwrap_or_else(|| setup.shape.shared().clone())
    }
}

/// Whether a pad at this distance meets the hull at its highest point, seen from the jaw, so that the normal force acts along the jaw axis.
fn meets_flat(setup: &GripSetup<'_>, jaw: Jaw, distance_m: f64) -> bool {
    let Some(hull) = setup.shape.shared().as_convex_polyhedron() else { return false };
    let world_from_part = rapier_pose(&setup.world_from_part);
    let reach = hull.points().iter().map(|p| jaw.side() * (world_from_part * *p).y);
    reach.fold(f64::NEG_INFINITY, f64::max) - distance_m <= FLAT_M
}

/// `gel_from_mesh` of a gel whose surface stands at the grip centre; `None` for primitives.
fn gel_from_mesh(setup: &GripSetup<'_>, jaw: Jaw) -> Option<Pose> {
    let (_, part_from_mesh) = setup.shape.surface()?;
    Some(world_from_gel(jaw, 0.0).inverse() * setup.world_from_part * part_from_mesh)
}

/// What a pad covers.
fn window(gel: &Gel) -> Window {
    Window { half_width_m: gel.width_m / 2.0, half_height_m: gel.height_m / 2.0 }
}

/// A plate across the jaw axis in place of the surface that lies in front of a pad within the depth of its gel: its outline is the
/// convex outline of that surface, its face lies where the pad first meets the surface.
///
/// A flat face carries the jaw's force along the jaw axis, as a gel does that follows the surface: on slopes too the normal forces
/// add up to the grip force. Neighbouring plates meet in the middle of the part.
fn plate(setup: &GripSetup<'_>, jaw: Jaw, distance_m: f64, between_m: f64) -> Option<SharedShape> {
    let (surface, _) = setup.shape.surface()?;
    let gel = &setup.gel[jaw];
    let points = surface.points_above(&gel_from_mesh(setup, jaw)?, window(gel), distance_m - gel.thickness_m);
    let outline = outline(&points);
    let thickness_m = gel.thickness_m.min(between_m / 2.0).max(PLATE_THICKNESS_M);
    let part_from_gel = setup.world_from_part.inverse() * world_from_gel(jaw, 0.0);
    let corners: Vec<rapier::Vector> = outline
        .iter()
        .flat_map(|&[x, y]| [-distance_m, thickness_m - distance_m].map(|z| Point3::new(x, y, z)))
        .map(|p| part_from_gel * p)
        .map(|p| rapier::Vector::new(p.x, p.y, p.z))
        .collect();
    SharedShape::convex_hull(&corners)
}

/// The points that reach farthest in evenly spread directions; widened where they lie on a line or are one.
fn outline(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let farthest = |points: &[[f64; 2]]| {
        let mut kept: Vec<[f64; 2]> = (0..PLATE_CORNERS)
            .filter_map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / PLATE_CORNERS as f64;
                let (c, s) = (libm::cos(angle), libm::sin(angle));
                let reach = |p: &[f64; 2]| p[0] * c + p[1] * s;
                points.iter().copied().reduce(|best, p| if reach(&p) > reach(&best) { p } else { best })
            })
            .collect();
        kept.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        kept.dedup();
        kept
    };
    let width = |points: &[[f64; 2]]| {
        (0..PLATE_CORNERS / 2)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / PLATE_CORNERS as f64;
                let (c, s) = (libm::cos(angle), libm::sin(angle));
                let reach = points.iter().map(|p| p[0] * c + p[1] * s);
                let (low, high) =
                    reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                high - low
            })
            .fold(f64::INFINITY, f64::min)
    };
    let kept = farthest(points);
    if width(&kept) >= PLATE_WIDTH_M {
        return kept;
    }
    let half = PLATE_WIDTH_M / 2.0;
    let around = |&[x, y]: &[f64; 2]| {
        [[x - half, y - half], [x - half, y + half], [x + half, y - half], [x + half, y + half]]
    };
    farthest(&kept.iter().flat_map(around).collect::<Vec<_>>())
}

/// Distance from the grip centre at which the jaw's gel first touches hull or primitive; `None` if it never does.
fn first_touch(setup: &GripSetup<'_>, jaw: Jaw) -> Result<Option<f64>, GripError> {
    let gel = &setup.gel[jaw];
    let open = setup.gripper.opening_m / 2.0;
    let start = open + gel.thickness_m / 2.0;
    let pad = rapier::Pose::from_translation(rapier::Vector::new(0.0, jaw.side() * start, 0.0));
    let towards = rapier::Vector::new(0.0, -jaw.side(), 0.0);
    let hit = cast_shapes(
        &pad,
        towards,
        &pad_shape(gel),
        &rapier_pose(&setup.world_from_part),
        rapier::Vector::ZERO,
        &**setup.shape.shared(),
        ShapeCastOptions::with_max_time_of_impact(open),
    )
    .map_err(|e| GripError::Shape(e.to_string()))?;
    match hit {
        None => Ok(None),
        Some(hit) if hit.time_of_impact <= 0.0 => {
            Err(GripError::TooWide { jaw, opening_mm: setup.gripper.opening_m * 1e3 })
        }
        Some(hit) => Ok(Some(open - hit.time_of_impact)),
    }
}

#[cfg(test)]
mod tests;
