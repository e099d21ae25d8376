//! Proposing grips: pairs of opposite surfaces that fit between the jaws.

use gripgen_tactile::{ClusteredMesh, Grid, PressedGel, indent};
use gripgen_twin::frames::{Pose, pose, rotation_from_fixed_xyz, world_from_gel};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Gel, Jaw, TriMesh, Twin};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

/// Points sampled on the surface.
const SAMPLES: usize = 600;
/// Largest angle between one surface and the opposite of the other: about the friction cone of mu = 0.17.
const OPPOSITE_RAD: f64 = 0.17;
/// A jaw axis this close to an axis of the mesh is meant to be that axis.
const SNAP_RAD: f64 = 0.05;
/// Candidates whose contact is computed.
const CANDIDATES: usize = 40;
/// Widest grip, as a share of the opening.
const LARGEST_WIDTH: f64 = 0.95;
/// Grips proposed.
const PROPOSALS: usize = 4;
/// Distance (part sizes plus radians) at which two grips count as different.
const UNLIKE: f64 = 0.6;
/// Force at which grips are compared, and the imprint constant of the templates.
const FORCE_N: f64 = 40.0;
const IMPRINT_M3_PER_N: f64 = 1.5e-9;

/// A grip proposed for a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// As in `[[parts.NAME.grips]]`.
    pub origin_mm: [f64; 3],
    /// As in `[[parts.NAME.grips]]`.
    pub orientation_deg: [f64; 3],
    /// Distance between the gels where they first touch.
    pub width_mm: f64,
    /// Contact area of the jaw that has less of it, at 40 N.
    pub contact_mm2: f64,
}

/// What a grip has to fit between: the left pad stands for both.
struct Jaws<'a> {
    opening_m: f64,
    gel: &'a Gel,
}

impl Proposal {
    pub(super) fn part_from_mesh(&self) -> Pose {
        let rotation = rotation_from_fixed_xyz(self.orientation_deg.map(f64::to_radians));
        let origin = Vector3::from(self.origin_mm.map(|x| x * 1e-3));
        pose(&rotation, -(rotation * origin))
    }
}

/// A pair of opposite surface points.
#[derive(Debug, Clone, Copy)]
struct Pair {
    middle: Point3<f64>,
    axis: Vector3<f64>,
    width_m: f64,
}

/// Grips of a mesh, the best first: a large contact, near the middle of the part, and unlike those before it. The same
/// mesh gives the same grips.
pub(super) fn propose(mesh: &TriMesh, twin: &Twin) -> Vec<Proposal> {
    let jaws = Jaws { opening_m: twin.gripper.opening_m, gel: &twin.gel.left };
    let size = mesh.extent_m().iter().fold(0.0_f64, |a, &b| a.max(b));
    let (low, high) = mesh.bounds_m();
    let middle = Point3::from([0, 1, 2].map(|i| (low[i] + high[i]) / 2.0));
    let clustered = ClusteredMesh::new(mesh);
    let mut rest: Vec<(f64, Pair, Proposal)> = spread(pairs(mesh, jaws.opening_m), CANDIDATES, size)
        .into_iter()
        .filter_map(|pair| {
            let proposal = evaluate(mesh, &clustered, &jaws, &pair)?;
            let off = 2.0 * (pair.middle - middle).norm() / size;
            Some((proposal.contact_mm2 / (1.0 + off * off), pair, proposal))
        })
        .collect();
    let mut chosen: Vec<(Pair, Proposal)> = Vec::new();
    while chosen.len() < PROPOSALS && !rest.is_empty() {
        let worth = |(score, pair, _): &(f64, Pair, Proposal)| {
            let nearest =
                chosen.iter().map(|(other, _)| distance(other, pair, size)).fold(f64::INFINITY, f64::min);
            score * -libm::expm1(-(nearest / UNLIKE).powi(2))
        };
        let best = (0..rest.len()).fold(0, |a, b| if worth(&rest[b]) > worth(&rest[a]) { b } else { a });
        if worth(&rest[best]) <= 0.0 {
            break;
        }
        let (_, pair, proposal) = rest.swap_remove(best);
        chosen.push((pair, proposal));
    }
    chosen.into_iter().map(|(_, proposal)| proposal).collect()
}

/// Antipodal pairs from points spread over the surface by area.
fn pairs(mesh: &TriMesh, opening_m: f64) -> Vec<Pair> {
    // A mesh that is inside out is turned over.
    let outwards = if mesh.signed_volume_m3() < 0.0 { -1.0 } else { 1.0 };
    let triangles: Vec<[Point3<f64>; 3]> = (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect();
    let areas: Vec<f64> = triangles.iter().map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).collect();
    let total: f64 = areas.iter().sum();
    let mut stream = Stream::new(0, 0, Purpose::Draw);
    let mut found = Vec::new();
    let (mut t, mut passed) = (0, 0.0);
    for i in 0..SAMPLES {
        // Evenly spread along the cumulated area, a little shaken.
        let at = (i as f64 + stream.uniform()) / SAMPLES as f64 * total;
        while t + 1 < triangles.len() && passed + areas[t] < at {
            passed += areas[t];
            t += 1;
        }
        let [a, b, c] = triangles[t];
        let normal = (b - a).cross(&(c - a)) * outwards;
        if normal.norm() == 0.0 {
            continue;
        }
        let (mut u, mut v) = (stream.uniform(), stream.uniform());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let from = a + (b - a) * u + (c - a) * v;
        let pair = opposite(&triangles, from, normal.normalize(), outwards);
        found.extend(pair.filter(|p| (1e-4..=LARGEST_WIDTH * opening_m).contains(&p.width_m)));
    }
    found
}

/// The surface on the other side of the part, if it faces the other way.
fn opposite(
    triangles: &[[Point3<f64>; 3]],
    from: Point3<f64>,
    normal: Vector3<f64>,
    outwards: f64,
) -> Option<Pair> {
    let (mut farthest, mut facing) = (0.0, Vector3::zeros());
    for corners in triangles {
        if let Some(distance) = hit(corners, from, -normal)
            && distance > farthest
        {
            let [a, b, c] = corners;
            (farthest, facing) = (distance, (b - a).cross(&(c - a)).normalize() * outwards);
        }
    }
    let opposed = facing.dot(&-normal) > libm::cos(OPPOSITE_RAD);
    let axis = snapped(normal);
    opposed.then(|| Pair { middle: from - normal * (farthest / 2.0), axis, width_m: farthest })
}

/// Distance along a ray to a triangle (Moller & Trumbore 1997).
fn hit([a, b, c]: &[Point3<f64>; 3], from: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(&e2);
    let determinant = e1.dot(&p);
    if determinant.abs() < 1e-18 {
        return None;
    }
    let s = from - a;
    let u = s.dot(&p) / determinant;
    let q = s.cross(&e1);
    let v = direction.dot(&q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    let distance = e2.dot(&q) / determinant;
    (inside && distance > 1e-6).then_some(distance)
}

/// An axis of the mesh, if the direction is nearly one. The sign does not matter to a gripper.
fn snapped(direction: Vector3<f64>) -> Vector3<f64> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    axes.into_iter().find(|a| a.dot(&direction).abs() > libm::cos(SNAP_RAD)).unwrap_or(direction)
}

/// How different two pairs are: place in part sizes, axis in radians.
fn distance(a: &Pair, b: &Pair, size: f64) -> f64 {
    let angle = libm::acos(a.axis.dot(&b.axis).abs().min(1.0));
    (a.middle - b.middle).norm() / size + angle
}

/// At most `wanted` pairs, each as different as possible from those before it.
fn spread(pairs: Vec<Pair>, wanted: usize, size: f64) -> Vec<Pair> {
    let mut rest = pairs;
    let mut chosen: Vec<Pair> = Vec::new();
    while chosen.len() < wanted && !rest.is_empty() {
        let far = |p: &Pair| chosen.iter().map(|c| distance(c, p, size)).fold(f64::INFINITY, f64::min);
        let best = (0..rest.len()).fold(0, |best, i| if far(&rest[i]) > far(&rest[best]) { i } else { best });
        chosen.push(rest.swap_remove(best));
    }
    chosen
}

/// The contact of both gels in this grip; `None` if one of them finds none or is pressed through.
fn evaluate(mesh: &TriMesh, clustered: &ClusteredMesh, jaws: &Jaws<'_>, pair: &Pair) -> Option<Proposal> {
    let rotation = orientation(mesh, pair.axis);
    let mut proposal = Proposal {
        origin_mm: [0, 1, 2].map(|i| hundredths(pair.middle[i] * 1e3)),
        orientation_deg: fixed_xyz_deg(&rotation).map(hundredths),
        width_mm: pair.width_m * 1e3,
        contact_mm2: 0.0,
    };
    // A coarse grid over the pad is enough to compare grips.
    let metres_per_px = 0.25e-3;
    let grid = Grid {
        width_px: (jaws.gel.width_m / metres_per_px) as usize,
        height_px: (jaws.gel.height_m / metres_per_px) as usize,
        metres_per_px,
    };
    let gel = PressedGel { thickness_m: jaws.gel.thickness_m, imprint_m3_per_n: IMPRINT_M3_PER_N };
    let mut areas = [0.0; 2];
    let mut width_m = jaws.opening_m;
    for (area, jaw) in areas.iter_mut().zip(Jaw::BOTH) {
        let gel_from_mesh = world_from_gel(jaw, jaws.opening_m / 2.0).inverse() * proposal.part_from_mesh();
        let heights = clustered.raster(&gel_from_mesh, &grid, jaws.gel.thickness_m / metres_per_px);
        *area = indent(&heights, &grid, &gel, FORCE_N).ok()?.patch.area_m2();
        // What the pad touches first need not be the surface of the pair.
        let nearest = heights.values.iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
        width_m += f64::from(nearest) * metres_per_px;
    }
    proposal.width_mm = width_m * 1e3;
    proposal.contact_mm2 = areas[0].min(areas[1]) * 1e6;
    (width_m > 0.0 && width_m < LARGEST_WIDTH * jaws.opening_m).then_some(proposal)
}

/// Rounded to hundredths, for files that people read; never -0.
fn hundredths(x: f64) -> f64 {
    (x * 100.0).round() / 100.0 + 0.0
}

/// `part_from_mesh` rotation: the jaw axis becomes y, the longest extent across it becomes x.
fn orientation(mesh: &TriMesh, jaw_axis: Vector3<f64>) -> Rotation3<f64> {
    let n = mesh.vertices_m().len() as f64;
    let mean = mesh.vertices_m().iter().fold(Vector3::zeros(), |s, v| s + v.coords) / n;
    let mut spread = Matrix3::zeros();
    for v in mesh.vertices_m() {
        let d = v.coords - mean;
        let across = d - jaw_axis * jaw_axis.dot(&d);
        spread += across * across.transpose();
    }
    let eigen = spread.symmetric_eigen();
    let long = (0..3).fold(0, |a, b| if eigen.eigenvalues[b] > eigen.eigenvalues[a] { b } else { a });
    let long = snapped(eigen.eigenvectors.column(long).into_owned());
    let x = (long - jaw_axis * jaw_axis.dot(&long)).normalize();
    let z = x.cross(&jaw_axis);
    Rotation3::from_matrix_unchecked(Matrix3::from_rows(&[
        x.transpose(),
        jaw_axis.transpose(),
        z.transpose(),
    ]))
}

/// Angles about the fixed x, y, z axes of a rotation `R_z R_y R_x`, in degrees.
fn fixed_xyz_deg(rotation: &Rotation3<f64>) -> [f64; 3] {
    let m = rotation.matrix();
    let y = libm::asin((-m[(2, 0)]).clamp(-1.0, 1.0));
    let (x, z) = if m[(2, 0)].abs() < 1.0 - 1e-9 {
        (libm::atan2(m[(2, 1)], m[(2, 2)]), libm::atan2(m[(1, 0)], m[(0, 0)]))
    } else {
        (0.0, libm::atan2(-m[(0, 1)], m[(1, 1)]))
    };
    [x, y, z].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::init::baseline;
    use gripgen_twin::parts::{InvoluteGear, SteppedShaft};

    #[test]
    fn a_mesh_that_is_inside_out_gets_the_same_kind_of_grips() {
        let mesh = SteppedShaft::default().mesh();
        let turned = mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
        let turned = TriMesh::new(mesh.vertices_m().to_vec(), turned).unwrap();
        assert!(turned.signed_volume_m3() < 0.0);
        let proposals = propose(&turned, &baseline());
        assert!(proposals.iter().any(|p| (p.width_mm - 20.0).abs() < 0.1), "{proposals:?}");
    }

    #[test]
    fn angles_give_back_their_rotation() {
        for angles in [[10.0, 20.0, 30.0], [0.0, 90.0, 45.0], [-170.0, -89.0, 5.0], [0.0, -90.0, 10.0]] {
            let rotation = rotation_from_fixed_xyz(angles.map(f64::to_radians));
            let again = rotation_from_fixed_xyz(fixed_xyz_deg(&rotation).map(f64::to_radians));
            assert!((rotation.matrix() - again.matrix()).norm() < 1e-9, "{angles:?}");
        }
    }

    #[test]
    fn a_shaft_is_gripped_across_its_axis() {
        let proposals = propose(&SteppedShaft::default().mesh(), &baseline());
        assert!(!proposals.is_empty());
        for p in &proposals {
            let axis = p.part_from_mesh() * Vector3::x();
            assert!(axis.y.abs() < 0.2, "the shaft's axis is not the jaw axis: {axis}");
            assert!(p.width_mm < 20.1 && p.contact_mm2 > 10.0, "{p:?}");
        }
    }

    #[test]
    fn a_gear_can_be_gripped_on_its_faces() {
        let proposals = propose(&InvoluteGear::default().mesh(), &baseline());
        assert!(proposals.iter().any(|p| (p.width_mm - 12.0).abs() < 0.1), "{proposals:?}");
    }

    #[test]
    fn proposals_are_repeatable() {
        let mesh = InvoluteGear::default().mesh();
        assert_eq!(propose(&mesh, &baseline()), propose(&mesh, &baseline()));
    }
}
