//! Where a part might be gripped: lines through it whose ends face each other, and lines along its axes.

use super::pose::snapped;
use gripgen_physics::Surface;
use gripgen_twin::TriMesh;
use gripgen_twin::random::{Purpose, Stream};
use nalgebra::{Matrix3, Point3, Vector3};

/// Points sampled on the surface, evenly by area.
const SAMPLES: usize = 1500;
/// Largest angle between a surface and the jaw axis: about the friction cone of mu = 0.17.
pub(super) const OPPOSITE_RAD: f64 = 0.17;
/// Lines along each axis, in each of the two directions across it.
const LINES: usize = 7;
/// Thinnest place to grip.
const THINNEST_M: f64 = 1e-4;

/// A line through a part, from its first to its last surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) middle: Point3<f64>,
    pub(super) axis: Vector3<f64>,
}

/// Lines through a part, and what was seen of those that are no place for a grip.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    pub(super) places: Vec<Place>,
    /// Smallest distance between surfaces that a line meets.
    pub(super) narrowest_m: Option<f64>,
    /// Lines between surfaces that face each other and are farther apart than the jaws open, and the shortest of them.
    pub(super) too_wide: usize,
    pub(super) narrowest_too_wide_m: Option<f64>,
    /// The smallest angle at which any line met both its surfaces.
    pub(super) steepest_rad: f64,
}

/// Mass, middle of mass and main axes of a part, of its surface where the mesh is open.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    pub(super) middle: Point3<f64>,
    pub(super) axes: Matrix3<f64>,
    pub(super) size_m: f64,
}

impl Body {
    pub(super) fn of(mesh: &TriMesh, closed: bool) -> Self {
        let (low, high) = mesh.bounds_m();
        let centre = Point3::from([0, 1, 2].map(|i| (low[i] + high[i]) / 2.0));
        let (mut weight, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        let mut area = (0.0, Vector3::zeros());
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t).map(|p| p - centre);
            let twice = (b - a).cross(&(c - a)).norm();
            let third = (a + b + c) / 3.0;
            area = (area.0 + twice, area.1 + third * twice);
            second += third * third.transpose() * twice;
            let volume = a.dot(&b.cross(&c)) / 6.0;
            weight += volume;
            first += (a + b + c) / 4.0 * volume;
        }
        let of_surface = area.1 / area.0.max(f64::MIN_POSITIVE);
        let size = mesh.extent_m();
        let enough = weight.abs() > 1e-6 * size.iter().product::<f64>();
        let middle = if closed && enough { first / weight } else { of_surface };
        let inside = (0..3).all(|i| middle[i].abs() <= size[i]);
        Self {
            middle: centre + if inside { middle } else { of_surface },
            axes: second.symmetric_eigen().eigenvectors,
            size_m: size.iter().fold(0.0_f64, |a, &b| a.max(b)),
        }
    }
}

/// Looks for places. The same mesh gives the same ones.
pub(super) fn places(surface: &Surface, body: &Body, widest_m: f64) -> Places {
    let mut found = Places { steepest_rad: std::f64::consts::FRAC_PI_2, ..Places::default() };
    for (point, normal) in points(surface.mesh()) {
        found.add(surface, point, normal, (OPPOSITE_RAD, widest_m));
    }
    let [x, y, z] = [0, 1, 2].map(|i| body.axes.column(i).into_owned());
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), x, y, z] {
        let across = if axis.x.abs() < 0.5 { axis.cross(&Vector3::x()) } else { axis.cross(&Vector3::z()) };
        let across = across.normalize();
        let other = axis.cross(&across);
        let steps = || (0..LINES).map(|i| ((i as f64 + 0.5) / LINES as f64 - 0.5) * body.size_m);
        for (u, v) in steps().flat_map(|u| steps().map(move |v| (u, v))) {
            // A pad also rests on tips and edges, which a single line does not tell.
            let through = body.middle + across * u + other * v;
            found.add(surface, through, axis, (std::f64::consts::FRAC_PI_2, widest_m));
        }
    }
    found
}

impl Places {
    fn add(&mut self, surface: &Surface, through: Point3<f64>, axis: Vector3<f64>, most: (f64, f64)) {
        let (steepest_rad, widest_m) = most;
        let Some((first, last)) = surface.ends_of_line(through, axis) else { return };
        let width_m = last.at_m - first.at_m;
        if width_m < THINNEST_M {
            return;
        }
        let least = first.normal.dot(&axis).abs().min(last.normal.dot(&axis).abs());
        let steep_rad = libm::acos(least.min(1.0));
        self.steepest_rad = self.steepest_rad.min(steep_rad);
        if steep_rad > steepest_rad {
            return;
        }
        self.narrowest_m = Some(self.narrowest_m.map_or(width_m, |narrowest| narrowest.min(width_m)));
        if width_m <= widest_m {
            let middle = through + axis * ((first.at_m + last.at_m) / 2.0);
            self.places.push(Place { middle, axis: snapped(axis) });
        } else if steep_rad <= OPPOSITE_RAD {
            self.too_wide += 1;
            let narrowest = self.narrowest_too_wide_m.map_or(width_m, |narrowest| narrowest.min(width_m));
            self.narrowest_too_wide_m = Some(narrowest);
        }
    }
}

/// Points evenly spread along the cumulated area, a little shaken, and the normals there.
fn points(mesh: &TriMesh) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let normal = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(&(c - a))
    };
    let total: f64 = (0..mesh.triangles().len()).map(|t| normal(t).norm()).sum();
    let mut stream = Stream::new(0, 0, Purpose::Draw);
    let (mut t, mut passed, mut here) = (0, 0.0, normal(0));
    let mut found = Vec::new();
    for i in 0..SAMPLES {
        let at = (i as f64 + stream.uniform()) / SAMPLES as f64 * total;
        while t + 1 < mesh.triangles().len() && passed + here.norm() < at {
            passed += here.norm();
            t += 1;
            here = normal(t);
        }
        let (mut u, mut v) = (stream.uniform(), stream.uniform());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        if here.norm() > 0.0 {
            let [a, b, c] = mesh.corners(t);
            found.push((a + (b - a) * u + (c - a) * v, here.normalize()));
        }
    }
    found
}

/// At most `wanted` places, each as different as possible from those before it: place in part sizes, axis in radians.
pub(super) fn spread(places: &[Place], wanted: usize, size_m: f64) -> Vec<Place> {
    let mut nearest = vec![f64::INFINITY; places.len()];
    let mut chosen: Vec<Place> = Vec::new();
    while chosen.len() < wanted.min(places.len()) {
        let best = (0..places.len()).fold(0, |best, i| if nearest[i] > nearest[best] { i } else { best });
        if nearest[best] <= 0.0 {
            break;
        }
        let latest = places[best];
        chosen.push(latest);
        for (near, place) in nearest.iter_mut().zip(places) {
            let angle = libm::acos(latest.axis.dot(&place.axis).abs().min(1.0));
            *near = near.min((latest.middle - place.middle).norm() / size_m + angle);
        }
    }
    chosen
}
