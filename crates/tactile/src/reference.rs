//! The stages once more, as plain loops in f64 that follow their definition word by word. The fast ones are checked
//! against them.

use crate::convolve::mirrored;
use crate::deform::gaussian;
use crate::grid::{Grid, Plane};
use gripgen_twin::TriMesh;
use gripgen_twin::frames::Pose;

/// Heights above the gel plane: every triangle into every row, with nothing left out.
fn raster(mesh: &TriMesh, gel_from_mesh: &Pose, grid: &Grid) -> Plane {
    let mut map = Plane::filled(grid.width_px, grid.height_px, f32::NEG_INFINITY);
    let scale = 1.0 / grid.metres_per_px;
    let (x0, y0) = (grid.width_px as f64 / 2.0 - 0.5, grid.height_px as f64 / 2.0 - 0.5);
    let corner = |v: u32| {
        let p = gel_from_mesh * mesh.vertices_m()[v as usize];
        [p.x * scale + x0, p.y * scale + y0, -p.z * scale, f64::from(v)]
    };
    for triangle in mesh.triangles() {
        let t = triangle.map(corner);
        let [u, v] = [1, 2].map(|i| [0, 1, 2].map(|k| t[i][k] - t[0][k]));
        let area = u[0] * v[1] - u[1] * v[0];
        if area == 0.0 {
            continue;
        }
        let slopes = ((u[2] * v[1] - v[2] * u[1]) / area, (v[2] * u[0] - u[2] * v[0]) / area);
        let all = |k: usize| t.map(|corner| corner[k]);
        let (bottom, top) = all(2).iter().fold((f64::MAX, f64::MIN), |(a, b), &h| (a.min(h), b.max(h)));
        for row in 0..grid.height_px {
            let y = row as f64;
            // Where edges cross the row, each seen from its end with the lower number.
            let mut crossings = Vec::new();
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let (a, b) = if t[a][3] <= t[b][3] { (t[a], t[b]) } else { (t[b], t[a]) };
                if a[1] != b[1] && y >= a[1].min(b[1]) && y <= a[1].max(b[1]) {
                    crossings.push(a[0] + (y - a[1]) * ((b[0] - a[0]) / (b[1] - a[1])));
                }
            }
            let from = crossings.iter().fold(f64::INFINITY, |a, &b| a.min(b));
            let to = crossings.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
            for column in (0..grid.width_px).filter(|&c| c as f64 >= from && c as f64 <= to) {
                let along_row = t[0][2] + slopes.1 * (y - t[0][1]);
                let height = along_row + slopes.0 * (column as f64 - t[0][0]);
                let cell = &mut map.values[row * grid.width_px + column];
                *cell = cell.max(height.clamp(bottom, top) as f32);
            }
        }
    }
    map
}

/// The press in pixels, by halving.
fn press_px(heights: &Plane, wanted_px3: f64, thickness_px: f64) -> f64 {
    let top = heights.highest();
    let volume = |press: f64| -> f64 {
        heights.values.iter().map(|&h| (f64::from(h) - f64::from(top) + press).max(0.0)).sum()
    };
    let (mut low, mut high) = (0.0, thickness_px);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if volume(middle) < wanted_px3 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Heights of a part above the gel at rest: at the centres of pixels, and at nine points of each.
struct Sampled {
    centres: Plane,
    points: Vec<[f64; 9]>,
}

impl Sampled {
    fn new(mesh: &TriMesh, gel_from_mesh: &Pose, grid: &Grid, rest: &Plane) -> Self {
        let (w, h) = (grid.width_px, grid.height_px);
        let fine = Grid { width_px: 3 * w, height_px: 3 * h, metres_per_px: grid.metres_per_px / 3.0 };
        let fine = raster(mesh, gel_from_mesh, &fine);
        let centres = raster(mesh, gel_from_mesh, grid).zip(rest, |h, r| h + r);
        let at = |i: usize, k: usize| f64::from(fine.at(3 * (i % w) + k % 3, 3 * (i / w) + k / 3)) / 3.0;
        let of = |i: usize| std::array::from_fn(|k| at(i, k) + f64::from(rest.values[i]));
        Self { centres, points: (0..w * h).map(of).collect() }
    }

    /// Depths and press of a contact by their definition: the centres of pixels first, then nine points in each pixel beside
    /// a step of more than half a pixel, which alone count from a whole one on.
    fn pressed(&self, wanted_px3: f64) -> (Vec<f64>, f64) {
        let (w, h) = (self.centres.width, self.centres.height);
        let top = f64::from(self.centres.highest());
        let first_px = press_px(&self.centres, wanted_px3, 16.0);
        let depth = |h: f64, press: f64| (h - top + press).max(0.0);
        let at = |x: usize, y: usize| depth(f64::from(self.centres.at(x, y)), first_px);
        let weight = |x: usize, y: usize| {
            let beside =
                [(x.max(1) - 1, y), ((x + 1).min(w - 1), y), (x, y.max(1) - 1), (x, (y + 1).min(h - 1))];
            let step = beside.iter().fold(0.0, |m: f64, &(i, j)| m.max((at(x, y) - at(i, j)).abs()));
            (2.0 * step - 1.0).clamp(0.0, 1.0)
        };
        let weights: Vec<f64> = (0..w * h).map(|i| weight(i % w, i / w)).collect();
        let depths = |press: f64| -> Vec<f64> {
            let of = |i: usize| {
                let points = self.points[i].iter().map(|&h| depth(h, press)).sum::<f64>() / 9.0;
                (1.0 - weights[i]) * depth(f64::from(self.centres.values[i]), press) + weights[i] * points
            };
            (0..w * h).map(of).collect()
        };
        let (mut low, mut high) = (0.0, 16.0);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            let volume: f64 = depths(middle).iter().sum();
            (low, high) = if volume < wanted_px3 { (middle, high) } else { (low, middle) };
        }
        (depths(high), high)
    }
}

/// A blur along both axes as plain sums.
pub(crate) fn blur(values: &[f64], width: usize, height: usize, size: u32) -> Vec<f64> {
    let weights: Vec<f64> = gaussian(size).iter().map(|&w| f64::from(w)).collect();
    let half = size as isize / 2;
    let pass = |input: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        let at = |i: isize| {
            let (x, y) = (i % width as isize, i / width as isize);
            let sum = |(k, w): (usize, &f64)| {
                let o = k as isize - half;
                w * input[mirrored(y + o * dy, height) * width + mirrored(x + o * dx, width)]
            };
            weights.iter().enumerate().map(sum).sum()
        };
        (0..input.len() as isize).map(at).collect()
    };
    pass(&pass(values, 0, 1), 1, 0)
}

/// Taxim's deformation of the whole gel, whose height towards the camera is `gel` at rest: blur, restore, subtract.
fn deform(depth: &Plane, gel: &[f64], kernels_px: &[u32], core_px: f64) -> Vec<f64> {
    let start: Vec<f64> = depth.values.iter().zip(gel).map(|(&d, g)| f64::from(d) + g).collect();
    let mut z = start.clone();
    for &kernel in kernels_px {
        z = blur(&z, depth.width, depth.height, kernel);
        for i in 0..z.len() {
            if depth.values[i] > core_px as f32 {
                z[i] = start[i];
            }
        }
    }
    blur(&z, depth.width, depth.height, 5).iter().zip(gel).map(|(z, g)| z - g).collect()
}

mod tests {
    use super::*;
    use crate::colour::{ColourModel, shade};
    use crate::sensor::{GelShape, Sensor};
    use crate::testing::{assert_same_on_every_unit, gel, lights};
    use crate::{BlurredRest, ClusteredMesh, Imprint, PressedGel, Renderer, SimdLevel, gradient, indent};
    use gripgen_twin::frames::{pose, rotation_from_fixed_xyz};
    use gripgen_twin::parts::{InvoluteGear, SteppedShaft};
    use nalgebra::Vector3;

    const GRID: Grid = Grid { width_px: 104, height_px: 78, metres_per_px: 0.25e-3 };
    const KERNELS_PX: [u32; 4] = [31, 21, 11, 5];

    fn scenes() -> Vec<(&'static str, TriMesh, Pose)> {
        let at = |angles, z| pose(&rotation_from_fixed_xyz(angles), Vector3::new(0.3e-3, -0.2e-3, z));
        let (shaft, gear) = (SteppedShaft::default().mesh(), InvoluteGear::default().mesh());
        vec![
            ("shaft", shaft.clone(), at([0.1, 0.02, 0.3], 12e-3)),
            ("shaft, upright", shaft, at([0.0, 1.5, 0.2], 30e-3)),
            ("gear", gear.clone(), at([0.3, 0.1, 0.0], 15e-3)),
            ("gear, aside", gear, at([1.57, 0.0, 0.4], 20e-3)),
        ]
    }

    fn sensor(gel_shape: GelShape) -> Sensor {
        let lights = lights(0.4, [0.3, 0.1], &[(11.5, [90.0, 0.0, 5.0]), (132.0, [0.0, 80.0, 4.0])]);
        let rest = [0, 1, 2].map(|_| vec![110.0; GRID.len()]);
        let colour = ColourModel::Lambert(Box::new(lights));
        Sensor { gel_shape, ..Sensor::new(GRID, rest, [1.5; 3], colour) }
    }

    /// Clusters, culling and the order of drawing change no bit of what is near enough to touch.
    #[test]
    fn clusters_draw_what_a_plain_loop_draws() {
        for (name, mesh, at) in scenes() {
            let clustered = ClusteredMesh::new(&mesh);
            let plain = raster(&mesh, &at, &GRID);
            let top = plain.highest();
            assert!(top.is_finite(), "{name}");
            for depth_px in [1.0, 16.0, f64::INFINITY] {
                let ours = clustered.raster(&at, &GRID, depth_px);
                let floor = (f64::from(top) - depth_px) as f32;
                for (i, (&a, &b)) in ours.values.iter().zip(&plain.values).enumerate() {
                    let expected = if b < floor { f32::NEG_INFINITY } else { b };
                    assert!(a == expected, "{name}, pixel {i}, depth {depth_px}: {a}, not {b}");
                }
            }
        }
    }

    /// A press draws no deeper than it must and ends where one of the whole part does.
    #[test]
    fn a_press_is_that_of_the_whole_part() {
        for (name, mesh, at) in scenes() {
            let clustered = ClusteredMesh::new(&mesh);
            for shape in [GelShape::Flat, GelShape::Dome { sag_m: 0.6e-3 }] {
                let (sensor, gel) = (sensor(shape), gel(&KERNELS_PX));
                let rest = sensor.gel_shape.rest_px(&GRID).unwrap_or(Plane::filled(104, 78, 0.0));
                let sampled = Sampled::new(&mesh, &at, &GRID, &rest);
                let above = &sampled.centres;
                for force_n in [0.5, 10.0, 60.0] {
                    let pressed_gel =
                        PressedGel { thickness_m: gel.thickness_m, imprint_m3_per_n: 1e-9, stiffens: false };
                    let wanted_px3 = 1e-9 * force_n / GRID.metres_per_px.powi(3);
                    let by_centres = indent(above, &GRID, &pressed_gel, force_n).unwrap();
                    let exact = press_px(above, wanted_px3, 16.0);
                    let found = by_centres.press_depth_m / GRID.metres_per_px;
                    assert!((found - exact).abs() < 1e-9, "{name}, {force_n} N: {found}, not {exact}");
                    let (depths, exact) = sampled.pressed(wanted_px3);
                    let renderer = Renderer { sensor: &sensor, gel: &gel, level: SimdLevel::best() };
                    let sunk = renderer.press(&clustered, &at, 1e-9, force_n).unwrap();
                    let found = sunk.press_depth_m / GRID.metres_per_px;
                    assert!((found - exact).abs() < 1e-4, "{name}, {force_n} N: {found}, not {exact}");
                    let off =
                        sunk.depth_px.values.iter().zip(&depths).map(|(&a, b)| (f64::from(a) - b).abs());
                    let worst = off.fold(0.0, f64::max);
                    assert!(worst < 1e-3, "{name}, {force_n} N: depths differ by {worst} px");
                    assert_same_on_every_unit(&format!("{name}, {force_n} N"), |level| {
                        let renderer = Renderer { sensor: &sensor, gel: &gel, level };
                        renderer.press(&clustered, &at, 1e-9, force_n).unwrap()
                    });
                }
            }
        }
    }

    fn imprints(sensor: &Sensor) -> Vec<(&'static str, Imprint)> {
        let (gel, level) = (gel(&KERNELS_PX), SimdLevel::best());
        let renderer = Renderer { sensor, gel: &gel, level };
        let press = |(name, mesh, at): (&'static str, TriMesh, Pose)| {
            (name, renderer.press(&ClusteredMesh::new(&mesh), &at, 1e-9, 20.0).unwrap())
        };
        scenes().into_iter().map(press).collect()
    }

    #[test]
    fn surfaces_are_those_of_plain_sums() {
        for shape in [GelShape::Flat, GelShape::Dome { sag_m: 0.6e-3 }] {
            let sensor = sensor(shape);
            let rest = sensor.gel_shape.rest_px(&GRID).unwrap_or(Plane::filled(104, 78, 0.0));
            let at_rest: Vec<f64> = rest.values.iter().map(|&r| -f64::from(r)).collect();
            for (name, imprint) in imprints(&sensor) {
                let core_px = 0.4 * imprint.press_depth_m / GRID.metres_per_px;
                let exact = deform(&imprint.depth_px, &at_rest, &KERNELS_PX, core_px);
                for level in SimdLevel::available() {
                    let blurred = BlurredRest::new(&rest, &KERNELS_PX, level);
                    let ours =
                        crate::deform(&imprint, &KERNELS_PX, 0.4, GRID.metres_per_px, Some(&blurred), level);
                    let worst = ours.values.iter().zip(&exact).map(|(&a, b)| (f64::from(a) - b).abs());
                    let worst = worst.fold(0.0, f64::max);
                    assert!(worst < 1e-4, "{name}, {level:?}: {worst} px");
                }
            }
        }
    }

    /// With lights or a regression the displacement is blurred, whatever the gel's shape: far away nothing moves.
    #[test]
    fn a_dome_is_displaced_like_a_flat_gel() {
        let (domed, flat, gel) =
            (sensor(GelShape::Dome { sag_m: 0.6e-3 }), sensor(GelShape::Flat), gel(&KERNELS_PX));
        for (name, imprint) in imprints(&domed) {
            let surface = |sensor| Renderer { sensor, gel: &gel, level: SimdLevel::best() }.surface(&imprint);
            let moved = surface(&domed);
            assert!(moved == surface(&flat), "{name}");
            let change = Renderer { sensor: &domed, gel: &gel, level: SimdLevel::best() }.change(&imprint);
            for (i, &raised) in moved.values.iter().enumerate() {
                let (x, y) = (i % GRID.width_px, i / GRID.width_px);
                let inner = (2..GRID.width_px - 2).contains(&x) && (2..GRID.height_px - 2).contains(&y);
                let at_rest = |x: usize, y: usize| moved.at(x, y) == 0.0;
                if inner
                    && raised == 0.0
                    && at_rest(x - 1, y)
                    && at_rest(x + 1, y)
                    && at_rest(x, y - 1)
                    && at_rest(x, y + 1)
                {
                    assert!(change.iter().all(|plane| plane.values[i].abs() < 1e-4), "{name}, ({x}, {y})");
                }
            }
        }
    }

    /// The fused walk over the part that is not flat gives the bits of the stages one by one, which give Lambert's
    /// law in f64.
    #[test]
    fn colours_are_those_of_the_stages_and_of_the_law() {
        let (sensor, gel) = (sensor(GelShape::Flat), gel(&KERNELS_PX));
        let ColourModel::Lambert(lambert) = &sensor.colour else { unreachable!() };
        let fields = lambert.coefficients();
        for (name, imprint) in imprints(&sensor) {
            let surface = Renderer { sensor: &sensor, gel: &gel, level: SimdLevel::best() }.surface(&imprint);
            let (gx, gy) = gradient(&surface);
            let staged = shade(&sensor.colour, &surface, &gx, &gy, None);
            for level in SimdLevel::available() {
                let change = Renderer { sensor: &sensor, gel: &gel, level }.change(&imprint);
                assert!(change == staged, "{name}, {level:?}");
            }
            for i in (0..GRID.len()).step_by(7) {
                let (x, y) = ((i % GRID.width_px) as f64, (i / GRID.width_px) as f64);
                let (u, v) = ((x - 51.5) / 52.0, (y - 38.5) / 52.0);
                let (sx, sy) = (f64::from(gx.values[i]), f64::from(gy.values[i]));
                let length = (1.0 + sx * sx + sy * sy).sqrt();
                let normal = [-sx / length, -sy / length, 1.0 / length - 1.0];
                for channel in 0..3 {
                    let terms = [1.0, u, v, u * u, u * v, v * v];
                    let c = &fields[18 * channel..][..18];
                    let exact: f64 = (0..18).map(|k| c[k] * terms[k % 6] * normal[k / 6]).sum();
                    let ours = f64::from(staged[channel].values[i]);
                    assert!((ours - exact).abs() < 1e-3, "{name}, pixel {i}: {ours}, not {exact}");
                }
            }
        }
    }
}
