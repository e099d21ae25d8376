//! The contact shape of a part: a convex hull, plates in front of the pads or a primitive, never a triangle mesh.
//!
//! Triangle meshes cost four times as much, creep in f64 and tilt contact normals; the true mesh is used where it
//! matters: in the imprint, and to say where the jaws stop ([`Surface`]).

use crate::surface::Surface;
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;
use nalgebra::{Point3, Vector3};
use rapier3d_f64::parry::transformation::try_convex_hull;
use rapier3d_f64::prelude as rapier;
use rapier3d_f64::prelude::SharedShape;
use std::sync::Arc;

/// Directions in which the outermost vertex of a mesh is kept for its hull.
const HULL_DIRECTIONS: usize = 200;

/// Vertices within this distance of the outermost one lie on one face or edge with it.
const LEVEL_M: f64 = 1e-9;

/// A part's contact shape in its part frame. Cheap to clone.
#[derive(Clone)]
pub struct PartShape {
    shape: SharedShape,
    /// The true surface, and `part_from_mesh`; a primitive is its own surface.
    surface: Option<(Arc<Surface>, Pose)>,
}

/// A mesh that encloses no volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the convex hull of {vertices} vertices could not be built: {problem}")]
pub struct ShapeError {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// What the hull algorithm says.
    pub problem: String,
}

impl PartShape {
    /// The convex hull of a mesh, of its vertices that are outermost in about 200 evenly spread directions.
    ///
    /// Fewer vertices make contact search fast; flat faces stay flat because all kept points are vertices.
    ///
    /// # Errors
    ///
    /// Vertices of which no convex hull can be built.
    pub fn hull(mesh: &TriMesh, part_from_mesh: &Pose) -> Result<Self, ShapeError> {
        let points: Vec<Point3<f64>> = mesh.vertices_m().iter().map(|v| part_from_mesh * v).collect();
        let mut kept: Vec<usize> = directions().flat_map(|d| outermost(&points, d)).collect();
        kept.sort_unstable();
        kept.dedup();
        let corners: Vec<rapier::Vector> =
            kept.iter().map(|&i| rapier::Vector::new(points[i].x, points[i].y, points[i].z)).collect();
        let error = |problem: String| ShapeError { vertices: points.len(), problem };
        let (vertices, faces) = try_convex_hull(&corners).map_err(|e| error(e.to_string()))?;
        let shape = SharedShape::convex_mesh(vertices, &faces)
            .ok_or_else(|| error("its faces do not close to a solid".into()))?;
        Ok(Self { shape, surface: None })
    }

    /// The convex hull of a mesh that knows the mesh's surface: where the hull is not what a pad meets, the jaws stop at the
    /// surface and touch a plate in its place.
    ///
    /// # Errors
    ///
    /// As [`Self::hull`].
    pub fn of_surface(surface: Arc<Surface>, part_from_mesh: &Pose) -> Result<Self, ShapeError> {
        let hull = Self::hull(surface.mesh(), part_from_mesh)?;
        Ok(Self { surface: Some((surface, *part_from_mesh)), ..hull })
    }

    /// A box of the given side lengths, centred on the part frame's origin.
    pub fn cuboid(sides_m: [f64; 3]) -> Self {
        Self::primitive(SharedShape::cuboid(sides_m[0] / 2.0, sides_m[1] / 2.0, sides_m[2] / 2.0))
    }

    /// A ball centred on the part frame's origin.
    pub fn ball(radius_m: f64) -> Self {
        Self::primitive(SharedShape::ball(radius_m))
    }

    /// A cylinder centred on the part frame's origin, its axis along x, y or z (0, 1, 2).
    pub fn cylinder(radius_m: f64, length_m: f64, axis: usize) -> Self {
        let quarter = std::f64::consts::FRAC_PI_2;
        let cylinder = SharedShape::cylinder(length_m / 2.0, radius_m);
        let about = match axis {
            0 => rapier::Vector::Z,
            2 => rapier::Vector::X,
            _ => return Self::primitive(cylinder),
        };
        let turned =
            rapier::Pose::from_parts(rapier::Vector::ZERO, rapier::Rotation::from_axis_angle(about, quarter));
        Self::primitive(SharedShape::compound(vec![(turned, cylinder)]))
    }

    fn primitive(shape: SharedShape) -> Self {
        Self { shape, surface: None }
    }

    pub(crate) fn shared(&self) -> &SharedShape {
        &self.shape
    }

    /// The true surface and `part_from_mesh`.
    pub(crate) fn surface(&self) -> Option<(&Surface, &Pose)> {
        self.surface.as_ref().map(|(surface, pose)| (&**surface, pose))
    }
}

/// The vertices that reach farthest along `d`. A whole face or edge of them is thinned to its corners: those that
/// reach farthest in 16 directions across.
fn outermost(points: &[Point3<f64>], d: Vector3<f64>) -> Vec<usize> {
    let reach: Vec<f64> = points.iter().map(|p| p.coords.dot(&d)).collect();
    let far = reach.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
    let tied: Vec<usize> = (0..points.len()).filter(|&i| reach[i] >= far - LEVEL_M).collect();
    if tied.len() < 3 {
        return tied;
    }
    let across = if d.x.abs() < 0.5 { d.cross(&Vector3::x()) } else { d.cross(&Vector3::z()) }.normalize();
    let other = d.cross(&across);
    (0..16)
        .filter_map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 16.0;
            let e = across * libm::cos(angle) + other * libm::sin(angle);
            let along = |i: &usize| points[*i].coords.dot(&e);
            tied.iter().copied().reduce(|best, i| if along(&i) > along(&best) { i } else { best })
        })
        .collect()
}

/// The six axes and a Fibonacci spiral on the sphere.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let axes = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
    axes.into_iter().chain((0..HULL_DIRECTIONS).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / HULL_DIRECTIONS as f64;
        let r = (1.0 - z * z).sqrt();
        let angle = golden * i as f64;
        Vector3::new(r * libm::cos(angle), r * libm::sin(angle), z)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::parts::{BallBearing, InvoluteGear, RollerBearing, SteppedShaft};

    #[test]
    fn hulls_of_the_parts_keep_their_size() {
        for (name, mesh) in [
            ("shaft", SteppedShaft::default().mesh()),
            ("gear", InvoluteGear::default().mesh()),
            ("ball bearing", BallBearing::default().mesh()),
            ("roller bearing", RollerBearing::default().mesh()),
        ] {
            let hull = PartShape::hull(&mesh, &Pose::identity()).unwrap();
            let aabb = hull.shared().compute_local_aabb();
            let (low, high) = mesh.bounds_m();
            for (axis, (l, h)) in
                [(aabb.mins.x, aabb.maxs.x), (aabb.mins.y, aabb.maxs.y), (aabb.mins.z, aabb.maxs.z)]
                    .into_iter()
                    .enumerate()
            {
                assert!(
                    (l - low[axis]).abs() < 1e-12 && (h - high[axis]).abs() < 1e-12,
                    "{name}, axis {axis}"
                );
            }
        }
    }

    #[test]
    fn contact_shapes_are_never_triangle_meshes() {
        let hull = PartShape::hull(&InvoluteGear::default().mesh(), &Pose::identity()).unwrap();
        assert!(hull.shared().as_convex_polyhedron().is_some());
    }
}
