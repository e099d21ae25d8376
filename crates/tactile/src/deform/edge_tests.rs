//! Edges of a block that stand at an angle to the rows of the image, against the same scene at four times the resolution.

use super::{Core, blurred, deform_with, gaussian, half_gaussian};
use crate::appearance::appearance;
use crate::convolve::Follow;
use crate::gradient::gradient;
use crate::grid::{Grid, Plane};
use crate::indent::Imprint;
use crate::raster::ClusteredMesh;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use crate::testing::{gel, lights};
use crate::{ColourModel, Renderer};
use gripgen_twin::TriMesh;
use gripgen_twin::frames::{pose, rotation_from_fixed_xyz};
use nalgebra::{Point3, Vector3};

const GRID: Grid = Grid { width_px: 200, height_px: 200, metres_per_px: 5.93e-5 };
const FINE: usize = 4;
const KERNELS_PX: [u32; 5] = [71, 51, 21, 11, 5];
const HALF_M: [f64; 2] = [2.5e-3, 3.5e-3];
const PRESS_M: f64 = 0.5e-3;
const CORE: f64 = 0.4;

fn block() -> ClusteredMesh {
    let [a, b] = HALF_M;
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        Point3::new(a * sign(0), b * sign(1), 2e-3 * (1.0 + sign(2)))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ClusteredMesh::new(&TriMesh::new((0..8).map(corner).collect(), triangles).unwrap())
}

fn sensor(grid: Grid, colour: ColourModel) -> Sensor {
    Sensor::new(grid, [0, 1, 2].map(|_| vec![110.0; grid.len()]), [0.0; 3], colour)
}

/// Three lights, and the colours of two real sensors.
fn colours() -> [(&'static str, ColourModel); 3] {
    let lit = [(30.0, [150.0, 18.0, 14.0]), (150.0, [16.0, 158.0, 24.0]), (270.0, [14.0, 26.0, 140.0])];
    let real = |bytes: &[u8]| Sensor::from_npz(bytes, None, None).unwrap().colour;
    [
        ("lights", ColourModel::Lambert(Box::new(lights(0.66, [0.2, 0.05], &lit)))),
        ("R1.5", real(include_bytes!("../../../../assets/sensors/gelsight_r15/sensor.npz"))),
        ("Taxim's", real(include_bytes!("../../../../assets/sensors/gelsight_taxim/sensor.npz"))),
    ]
}

/// The block turned by an angle and pressed in, on a grid.
fn pressed(grid: Grid, angle_rad: f64) -> Imprint {
    let [(_, lights), ..] = colours();
    let sensor = sensor(grid, lights);
    let gel = gel(&KERNELS_PX);
    let at = pose(&rotation_from_fixed_xyz([0.0, 0.0, angle_rad]), Vector3::zeros());
    let force_n = 4.0 * HALF_M[0] * HALF_M[1] * PRESS_M / 1e-9;
    let renderer = Renderer { sensor: &sensor, gel: &gel, level: SimdLevel::best() };
    renderer.press(&block(), &at, 1e-9, force_n).unwrap()
}

/// The gel around the block, in pixels of [`GRID`].
fn coarse(angle_rad: f64, shares: bool) -> Plane {
    let imprint = pressed(GRID, angle_rad);
    let from_px = CORE * imprint.press_depth_m / GRID.metres_per_px;
    let core = Core { from_px, follow: Follow::AtLeast, whole_pixels: !shares };
    deform_with(&imprint, core, &KERNELS_PX.map(gaussian), None, SimdLevel::best())
}

/// The same blurred in pixels of a quarter, by Gaussians of the same variance, as the mean over each pixel of [`GRID`].
fn reference(angle_rad: f64) -> Plane {
    let (f, level) = (FINE as f64, SimdLevel::best());
    let (width_px, height_px) = (FINE * GRID.width_px, FINE * GRID.height_px);
    let imprint = pressed(Grid { width_px, height_px, metres_per_px: GRID.metres_per_px / f }, angle_rad);
    let kernels = KERNELS_PX.map(|size| {
        let half = i64::from(size / 2);
        let of = |(i, w): (usize, f32)| (i as i64 - half).pow(2) as f64 * f64::from(w);
        let variance: f64 = gaussian(size).into_iter().enumerate().map(of).sum::<f64>() * f * f;
        let half = FINE as i64 * half;
        let weights: Vec<f64> = (-half..=half).map(|i| (-0.5 * (i * i) as f64 / variance).exp()).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|w| (w / sum) as f32).collect::<Vec<f32>>()
    });
    let from_px = CORE * imprint.press_depth_m / GRID.metres_per_px * f;
    let core = Core { from_px, follow: Follow::AtLeast, whole_pixels: false };
    let fine = deform_with(&imprint, core, &kernels, None, level);
    // The last blur is that of fine pixels: the rest of the last one of GRID.
    let last = half_gaussian((f * f - 1.0).sqrt());
    let last: Vec<f32> = last[1..].iter().rev().chain(&last).map(|&w| w as f32).collect();
    let fine = blurred(&fine, &last, level);
    Plane::from_fn(GRID.width_px, GRID.height_px, |x, y| {
        let rows = FINE * y..FINE * (y + 1);
        let sum: f32 = rows.flat_map(|y| &fine.row(y)[FINE * x..FINE * (x + 1)]).sum();
        sum / (FINE * FINE * FINE) as f32
    })
}

/// Spread of a plane along a long edge of the block: root mean square over lines within 1.5 px of it.
fn ripple(plane: &Plane, angle_rad: f64) -> f64 {
    let (sin, cos) = angle_rad.sin_cos();
    let between = |x: f64, y: f64| {
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let at = |dx: usize, dy: usize| f64::from(plane.at(x as usize + dx, y as usize + dy));
        (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
    };
    let middle = GRID.width_px as f64 / 2.0 - 0.5;
    let half = HALF_M.map(|h| h / GRID.metres_per_px);
    let lines = (-3..=3).map(|k| half[0] + 0.5 * f64::from(k));
    let squares = lines.map(|off| {
        let values: Vec<f64> = (-280..=280)
            .map(|i| 0.125 * f64::from(i))
            .map(|along| between(middle + off * cos - along * sin, middle + off * sin + along * cos))
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
    });
    (squares.sum::<f64>() / 7.0).sqrt()
}

fn slope(surface: &Plane) -> Plane {
    let (along_x, along_y) = gradient(surface);
    along_x.zip(&along_y, |a, b| (a * a + b * b).sqrt())
}

/// Change of the image, and its spread along the edge: root mean square over the colours.
fn image(surface: &Plane, colour: &ColourModel, angle_rad: f64) -> ([Plane; 3], f64) {
    let change = appearance(&sensor(GRID, colour.clone()), surface, |_| false, SimdLevel::best());
    let ripples = change.each_ref().map(|plane| ripple(plane, angle_rad).powi(2));
    (change, (ripples.iter().sum::<f64>() / 3.0).sqrt())
}

fn apart(a: &[Plane; 3], b: &[Plane; 3]) -> f64 {
    let off = a.iter().zip(b).flat_map(|(a, b)| a.values.iter().zip(&b.values));
    let sum: f64 = off.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (sum / (3 * GRID.len()) as f64).sqrt()
}

/// Slanted edges are as even as those of finer pixels. A core of whole pixels draws stripes along them.
#[test]
fn slanted_edges_have_no_stripes() {
    for degrees in [10.0f64, 30.0] {
        let angle = degrees.to_radians();
        let surfaces = [reference(angle), coarse(angle, true), coarse(angle, false)];
        let [exact, shares, whole] = surfaces.each_ref().map(|surface| ripple(&slope(surface), angle));
        println!(
            "{degrees} deg: ripple of the slope {exact:.4}, by shares {shares:.4}, whole pixels {whole:.4}"
        );
        assert!(shares < 1.3 * exact && whole > 3.0 * shares);
        for (name, colour) in colours() {
            let images = surfaces.each_ref().map(|surface| image(surface, &colour, angle));
            let [exact, shares, whole] = &images;
            let (error, error_whole) = (apart(&shares.0, &exact.0), apart(&whole.0, &exact.0));
            println!(
                "{degrees} deg, {name}: ripple of the image {:.3}, by shares {:.3}, whole pixels {:.3}; off by {error:.3}, {error_whole:.3}",
                exact.1, shares.1, whole.1
            );
            assert!(shares.1 < 1.2 * exact.1 && whole.1 > 1.5 * shares.1, "{name}");
            // Grey levels: those lights change them three times as much as real ones do.
            assert!(error < if name == "lights" { 0.3 } else { 0.15 }, "{name}: {error}");
            assert!(error < 0.15 * error_whole, "{name}: {error}, {error_whole}");
        }
    }
}
