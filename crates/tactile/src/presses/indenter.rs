//! A body of any shape that is pressed in: where its surface is, and how far each pixel lies from its contact.

use crate::deform::{Edges, POINTS};
use crate::grid::{Grid, Plane};
use crate::optics::rounded;
use crate::raster::ClusteredMesh;
use gripgen_twin::TriMesh;
use gripgen_twin::frames::pose;
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::PI;

/// Points along the side of a pixel at which the surface is sampled, so that edges of a body are not steps of pixels.
const FINE: usize = 3;
const _: () = assert!(FINE * FINE == POINTS);

/// The part of the travel by which a gel gives way around a contact, where nothing is known of it: that of the contact
/// radius of balls in real gels, `a^2 = 1.2 R d`.
pub const USUAL_SINK_IN: f64 = 0.4;

/// Where a body is pressed in. Its tip points along its +z into the gel; its +x is the image's right and its +y the image's
/// top before it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndenterPose {
    /// Place of the body's origin, columns from the centre of the first pixel.
    pub x_px: f64,
    /// Place of the body's origin, rows from the centre of the first pixel.
    pub y_px: f64,
    /// Turn about its own z, counter-clockwise as seen in the image.
    pub rotation_rad: f64,
}

impl IndenterPose {
    /// In the middle of an image, not turned.
    pub fn middle_of(grid: &Grid) -> Self {
        let middle = |n: usize| (n as f64 - 1.0) / 2.0;
        Self { x_px: middle(grid.width_px), y_px: middle(grid.height_px), rotation_rad: 0.0 }
    }
}

/// A body in front of a gel, and how far it travels after first contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Indenter {
    /// What its shape is called in reports.
    pub shape: String,
    /// Where it is.
    pub pose: IndenterPose,
    /// Travel after first contact.
    pub travel_m: f64,
    /// Height of its surface above its tip (so at most 0) in pixels of the image, on a grid [`FINE`] times as fine; `-inf`
    /// where there is none.
    heights_px: Plane,
    /// Distance of each pixel of the image from the contact, 0 inside, in pixels.
    distance_px: Vec<f32>,
}

/// Why a body cannot be pressed in.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IndenterError {
    /// The body is not in the image.
    #[error(
        "nothing of `{shape}` lies over the {width_px}x{height_px} image with its origin at ({x_px}, {y_px})"
    )]
    Outside {
        /// Its name.
        shape: String,
        /// Width of the image.
        width_px: usize,
        /// Height of the image.
        height_px: usize,
        /// Its place, along the columns.
        x_px: f64,
        /// Its place, down the rows.
        y_px: f64,
    },
    /// A travel that cannot be.
    #[error("`{shape}` travels {travel_mm} mm, it must be above 0 and at most {most_mm} mm")]
    Travel {
        /// Its name.
        shape: String,
        /// Its travel.
        travel_mm: f64,
        /// The largest there can be.
        most_mm: f64,
    },
}

/// Radius of the convex edges of a body of which nothing is known. Printed edges have it: drawn so, a printed prism is off by 55, 75,
/// 95 and 199 (mean squared grey levels, 0.25 to 1 mm deep), with sharp edges by 85, 170, 165 and 227. Machined ones are sharper.
pub const USUAL_EDGE_RADIUS_M: f64 = 0.2e-3;

/// The largest radius of an edge.
pub const MAX_EDGE_RADIUS_M: f64 = 1e-3;

/// Longest travel, far beyond the thickness of any gel.
pub(super) const MAX_TRAVEL_M: f64 = 0.01;

impl Indenter {
    /// A mesh at its place in an image of `grid`, `travel_m` after its highest vertex touched the gel.
    ///
    /// # Errors
    /// A travel of nothing or of more than 10 mm, and a mesh that the image does not show.
    pub fn of_mesh(
        shape: &str,
        mesh: &TriMesh,
        at: IndenterPose,
        travel_m: f64,
        grid: &Grid,
    ) -> Result<Self, IndenterError> {
        if !(travel_m > 0.0 && travel_m <= MAX_TRAVEL_M) {
            let (travel_mm, most_mm) = (travel_m * 1e3, MAX_TRAVEL_M * 1e3);
            return Err(IndenterError::Travel { shape: shape.into(), travel_mm, most_mm });
        }
        let fine = Grid {
            width_px: FINE * grid.width_px,
            height_px: FINE * grid.height_px,
            metres_per_px: grid.metres_per_px / FINE as f64,
        };
        let tip_m = mesh.bounds_m().1[2];
        let place = |px: f64, n: usize| (px + 0.5 - n as f64 / 2.0) * grid.metres_per_px;
        // The gel's z points out of the gel and its y down the image: half a turn about x.
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), PI)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), at.rotation_rad);
        let (x_m, y_m) = (place(at.x_px, grid.width_px), place(at.y_px, grid.height_px));
        let gel_from_mesh = pose(&turn, Vector3::new(x_m, y_m, tip_m));
        let mut heights_px = ClusteredMesh::new(mesh).raster(&gel_from_mesh, &fine, f64::INFINITY);
        let to_coarse = 1.0 / FINE as f32;
        heights_px.values.iter_mut().for_each(|h| *h *= to_coarse);
        Self::of_heights(shape, heights_px, at, travel_m, grid).ok_or_else(|| IndenterError::Outside {
            shape: shape.into(),
            width_px: grid.width_px,
            height_px: grid.height_px,
            x_px: at.x_px,
            y_px: at.y_px,
        })
    }

    /// From heights on the fine grid; `None` where nothing of it touches the gel.
    fn of_heights(
        shape: &str,
        heights_px: Plane,
        at: IndenterPose,
        travel_m: f64,
        grid: &Grid,
    ) -> Option<Self> {
        let mut indenter = Self { shape: shape.into(), pose: at, travel_m, heights_px, distance_px: vec![] };
        let press_px = travel_m / grid.metres_per_px;
        let (depth, _) = indenter.depth_px(press_px, None);
        let rim = (USUAL_SINK_IN * press_px) as f32;
        if depth.values.iter().all(|&d| d <= 0.0) {
            return None;
        }
        indenter.distance_px = distances(&depth, |d| d > rim);
        Some(indenter)
    }

    /// How deep the undeformed body lies below the gel at rest, in pixels, when it has travelled `press_px` since it first
    /// touched, and the depths within the pixels beside its steps. `rest_px`: the gel at rest, `None` if it is flat.
    pub(crate) fn depth_px(&self, press_px: f64, rest_px: Option<&Plane>) -> (Plane, Edges) {
        let (w, h) = (self.heights_px.width / FINE, self.heights_px.height / FINE);
        let row_of = |y: usize| self.heights_px.row(y);
        let rest = |x: usize, y: usize| rest_px.map_or(0.0, |rest| rest.at(x, y));
        let first = match rest_px {
            None => 0.0,
            Some(_) => (0..h * FINE)
                .flat_map(|y| row_of(y).iter().enumerate().map(move |(x, z)| (x, y, *z)))
                .fold(f32::NEG_INFINITY, |m, (x, y, z)| m.max(z + rest(x / FINE, y / FINE))),
        };
        let lift = press_px as f32 - first;
        let mut edges = Edges::default();
        let depth_px = Plane::from_fn(w, h, |x, y| {
            let at = rest(x, y) + lift;
            let depths: [f32; POINTS] =
                std::array::from_fn(|i| row_of(y * FINE + i / FINE)[x * FINE + i % FINE] + at);
            let (least, most, sum) = depths.iter().fold((f32::INFINITY, 0.0f32, 0.0), |(a, b, sum), &d| {
                (a.min(d.max(0.0)), b.max(d), sum + d.max(0.0))
            });
            // Points of a pixel lie up to two thirds of it apart. From a slope of 1/2 on they begin to count, and from 1 on they
            // alone do, as in a grip.
            let weight = (3.0 * (most - least) - 1.0).clamp(0.0, 1.0);
            if weight > 0.0 {
                edges.push((y * w + x) as u32, weight, depths);
            }
            sum / POINTS as f32
        });
        (depth_px, edges)
    }

    /// A circle around its origin with the area of its contact.
    pub fn circle(&self) -> super::Circle {
        let inside = self.distance_px.iter().filter(|&&d| d == 0.0).count().max(1);
        let IndenterPose { x_px, y_px, .. } = self.pose;
        super::Circle { x_px, y_px, radius_px: (inside as f64 / PI).sqrt() }
    }

    /// The body with its convex edges rounded by a radius, 0 for none, in an image of this grid. Its place and its travel stay, and
    /// what counts as its contact.
    pub fn with_edge_radius(self, radius_m: f64, grid: &Grid) -> Self {
        if radius_m > 0.0 { self.rounded(radius_m / grid.metres_per_px) } else { self }
    }

    pub(crate) fn rounded(&self, radius_px: f64) -> Self {
        Self {
            heights_px: self.scaled(FINE as f32, |fine| rounded(fine, radius_px * FINE as f64)),
            ..self.clone()
        }
    }

    /// `of` the heights in units of `1 / units` pixels.
    fn scaled(&self, units: f32, of: impl Fn(&Plane) -> Plane) -> Plane {
        of(&self.heights_px.map(|h| h * units)).map(|h| h * (1.0 / units))
    }

    /// The body in an image whose pixels are `factor` times as wide: the middle one of each square of points.
    pub(crate) fn in_wider_pixels(&self, factor: usize) -> Self {
        let by = 1.0 / factor as f32;
        let every = |values: &[f32], width: usize, (w, h): (usize, usize)| -> Vec<f32> {
            let middle = |i: usize| i * factor + factor / 2;
            (0..w * h).map(|i| values[middle(i / w) * width + middle(i % w)] * by).collect()
        };
        let (width, height) = (self.heights_px.width / FINE, self.heights_px.height / FINE);
        let (w, h) = (width / factor, height / factor);
        let fine = every(&self.heights_px.values, self.heights_px.width, (w * FINE, h * FINE));
        let heights_px = Plane { width: w * FINE, height: h * FINE, values: fine };
        let distance_px = every(&self.distance_px, width, (w, h));
        let f = factor as f64;
        let pose = IndenterPose {
            x_px: (self.pose.x_px + 0.5) / f - 0.5,
            y_px: (self.pose.y_px + 0.5) / f - 0.5,
            ..self.pose
        };
        Self { shape: self.shape.clone(), pose, travel_m: self.travel_m, heights_px, distance_px }
    }

    /// Distance of a pixel from the contact, 0 inside.
    pub(crate) fn distance_px(&self, pixel: usize) -> f64 {
        f64::from(self.distance_px[pixel])
    }
}

/// Distance of each pixel from the nearest that is `inside`: the lower envelope of parabolas, along columns and then rows
/// (Felzenszwalb & Huttenlocher 2012).
fn distances(plane: &Plane, inside: impl Fn(f32) -> bool) -> Vec<f32> {
    let (w, h) = (plane.width, plane.height);
    let far = ((w * w + h * h) as f64) * 4.0;
    let mut squares: Vec<f64> = plane.values.iter().map(|&v| if inside(v) { 0.0 } else { far }).collect();
    for x in 0..w {
        let column: Vec<f64> = (0..h).map(|y| squares[y * w + x]).collect();
        for (y, value) in lower_envelope(&column).into_iter().enumerate() {
            squares[y * w + x] = value;
        }
    }
    for row in squares.chunks_exact_mut(w) {
        let envelope = lower_envelope(row);
        row.copy_from_slice(&envelope);
    }
    squares.into_iter().map(|square| square.sqrt() as f32).collect()
}

/// The least of the parabolas `f(q) + (p - q)^2` at each p.
fn lower_envelope(f: &[f64]) -> Vec<f64> {
    let crossing = |q: usize, r: usize| {
        let (a, b) = (q as f64, r as f64);
        ((f[r] + b * b) - (f[q] + a * a)) / (2.0 * (b - a))
    };
    // Vertices of the parabolas of the envelope, and where each of them takes over.
    let mut vertices: Vec<(usize, f64)> = vec![(0, f64::NEG_INFINITY)];
    for r in 1..f.len() {
        while let Some(&(q, from)) = vertices.last() {
            let at = crossing(q, r);
            if at > from {
                vertices.push((r, at));
                break;
            }
            vertices.pop();
        }
        if vertices.is_empty() {
            vertices.push((r, f64::NEG_INFINITY));
        }
    }
    let mut k = 0;
    (0..f.len())
        .map(|p| {
            while vertices.get(k + 1).is_some_and(|&(_, from)| from <= p as f64) {
                k += 1;
            }
            let away = p as f64 - vertices[k].0 as f64;
            f[vertices[k].0] + away * away
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    const GRID: Grid = Grid { width_px: 120, height_px: 100, metres_per_px: 5e-5 };

    /// A wedge whose ridge runs along y, 1 mm long towards +y of its origin, its tip at z = 7 mm.
    fn wedge() -> TriMesh {
        let at = |x: f64, y: f64, z: f64| Point3::new(x * 1e-3, y * 1e-3, z * 1e-3);
        let vertices = vec![
            at(0.0, 0.0, 7.0),
            at(0.0, 1.0, 7.0),
            at(-1.0, 0.0, 6.0),
            at(-1.0, 1.0, 6.0),
            at(1.0, 0.0, 6.0),
            at(1.0, 1.0, 6.0),
        ];
        TriMesh::new(vertices, vec![[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1]]).unwrap()
    }

    #[test]
    fn x_is_right_y_is_up_and_a_turn_is_counter_clockwise() {
        let press = |rotation_rad| {
            let at = IndenterPose { x_px: 60.0, y_px: 50.0, rotation_rad };
            Indenter::of_mesh("wedge", &wedge(), at, 0.4e-3, &GRID).unwrap().depth_px(8.0, None).0
        };
        // The ridge goes up from the origin: 8 px deep there, a pixel less for each pixel beside it.
        let upright = press(0.0);
        assert!((upright.at(60, 40) - 7.75).abs() < 0.1, "{}", upright.at(60, 40));
        assert!((upright.at(63, 40) - 5.0).abs() < 1e-3 && (upright.at(57, 40) - 5.0).abs() < 1e-3);
        assert_eq!((upright.at(60, 53), upright.at(60, 27), upright.at(69, 40)), (0.0, 0.0, 0.0));
        // A quarter of a turn against the clock brings it to the left.
        let turned = press(PI / 2.0);
        assert!((turned.at(50, 53) - 5.0).abs() < 1e-3, "{}", turned.at(50, 53));
        assert_eq!((turned.at(63, 50), turned.at(60, 40)), (0.0, 0.0));
    }

    #[test]
    fn the_circle_of_a_body_has_the_area_of_its_contact() {
        let at = IndenterPose { x_px: 60.0, y_px: 50.0, rotation_rad: 0.0 };
        let circle = Indenter::of_mesh("wedge", &wedge(), at, 0.4e-3, &GRID).unwrap().circle();
        // Deeper than 0.4 of 8 px: 4.8 px to either side of 20 px of ridge.
        let area_px2 = PI * circle.radius_px * circle.radius_px;
        assert!((area_px2 / 192.0 - 1.0).abs() < 0.15, "{area_px2} px2");
        assert_eq!((circle.x_px, circle.y_px), (60.0, 50.0));
    }

    #[test]
    fn in_wider_pixels_it_is_the_same_body() {
        let at = IndenterPose { x_px: 60.0, y_px: 50.0, rotation_rad: 0.3 };
        let fine = Indenter::of_mesh("wedge", &wedge(), at, 0.4e-3, &GRID).unwrap();
        let wide = fine.in_wider_pixels(2);
        assert_eq!((wide.pose.x_px, wide.pose.y_px), (29.75, 24.75));
        let (of_fine, of_wide) = (fine.depth_px(8.0, None).0, wide.depth_px(4.0, None).0);
        for i in 0..60 * 50 {
            let (x, y) = (i % 60, i / 60);
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| of_fine.at(2 * x + dx, 2 * y + dy));
            let mean = four.iter().sum::<f32>() / 8.0;
            let steep = four.iter().any(|d| (d - four[0]).abs() > 2.0);
            assert!(steep || (of_wide.at(x, y) - mean).abs() < 0.4, "{x} {y}: {} {mean}", of_wide.at(x, y));
            let (near, far) = (wide.distance_px(i), fine.distance_px(2 * y * 120 + 2 * x));
            assert!((2.0 * near - far).abs() < 2.0, "{x} {y}: {near} {far}");
        }
    }

    /// A ball that rolls inside a ridge of 90 degrees stays a radius times (sqrt 2 - 1) below it.
    #[test]
    fn a_rounded_ridge_is_lower_by_what_its_ball_does_not_reach() {
        let at = IndenterPose { x_px: 60.0, y_px: 50.0, rotation_rad: 0.0 };
        let sharp = Indenter::of_mesh("wedge", &wedge(), at, 0.4e-3, &GRID).unwrap();
        let round = sharp.rounded(6.0).depth_px(8.0, None).0;
        let lower = sharp.depth_px(8.0, None).0.at(60, 40) - round.at(60, 40);
        // The mean over a pixel of the sharp ridge is a quarter of a pixel below it.
        assert!((lower - (6.0 * (2.0f32.sqrt() - 1.0) - 0.25)).abs() < 0.3, "{lower}");
    }

    #[test]
    fn first_contact_is_that_with_the_gel_as_it_is() {
        let at = IndenterPose { x_px: 60.0, y_px: 50.0, rotation_rad: 0.0 };
        let indenter = Indenter::of_mesh("wedge", &wedge(), at, 0.4e-3, &GRID).unwrap();
        // A gel that lies 30 px lower everywhere is touched 30 px later.
        let lower = Plane::filled(120, 100, -30.0);
        let (flat, low) = (indenter.depth_px(8.0, None).0, indenter.depth_px(8.0, Some(&lower)).0);
        let difference = flat.values.iter().zip(&low.values).fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
        // The highest of the points that are looked at lies a third of a pixel beside the ridge at most.
        assert!(difference < 0.35, "{difference}");
    }

    #[test]
    fn distances_are_those_of_a_plain_search() {
        let mut plane = Plane::filled(23, 17, 0.0);
        for i in [30, 31, 200, 333] {
            plane.values[i] = 1.0;
        }
        let ours = distances(&plane, |v| v > 0.5);
        for (p, ours) in ours.iter().enumerate() {
            let away = |q: usize| {
                let (dx, dy) = ((p % 23) as f64 - (q % 23) as f64, (p / 23) as f64 - (q / 23) as f64);
                dx.hypot(dy)
            };
            let exact = [30, 31, 200, 333].map(away).into_iter().fold(f64::INFINITY, f64::min);
            assert!((f64::from(*ours) - exact).abs() < 1e-5, "{p}: {ours} {exact}");
        }
    }

    #[test]
    fn what_cannot_be_pressed_is_refused_with_its_numbers() {
        let press = |x_px, travel_m| {
            let at = IndenterPose { x_px, y_px: 50.0, rotation_rad: 0.0 };
            Indenter::of_mesh("wedge", &wedge(), at, travel_m, &GRID).map(|_| ()).unwrap_err().to_string()
        };
        assert_eq!(press(60.0, 0.02), "`wedge` travels 20 mm, it must be above 0 and at most 10 mm");
        let outside = "nothing of `wedge` lies over the 120x100 image with its origin at (900, 50)";
        assert_eq!(press(900.0, 4e-4), outside);
    }
}
