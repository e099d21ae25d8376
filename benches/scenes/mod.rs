//! A part for the tactile benchmarks.

use gripgen::tactile::presses::{
    CalibrateOptions, Circle, Press, PressSet, calibrate_presses, predict_press,
};
use gripgen::tactile::{ColourModel, Markers, Sensor, Shadow, ShadowKind, ShadowTable, print_markers};
use gripgen::twin::frames::{Pose, pose, rotation_from_fixed_xyz};
use gripgen::twin::{Elastic, Gel, TactileImage, TriMesh};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Rings of the ball: 4 x 112^2 = 50,176 triangles.
const RINGS: usize = 112;

/// A ball of 9.6 mm radius with bumps of 1 % of it, of some 50,000 triangles.
pub fn bumpy_ball() -> TriMesh {
    let around = 2 * RINGS;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=RINGS {
        for j in 0..around {
            let (p, a) = (PI * i as f64 / RINGS as f64, PI * j as f64 / RINGS as f64);
            let radius = 9.6e-3 * (1.0 + 0.01 * (9.0 * p).sin() * (12.0 * a).cos());
            vertices.push(Point3::new(p.sin() * a.cos(), p.cos(), p.sin() * a.sin()) * radius);
        }
    }
    for i in 0..RINGS {
        for j in 0..around {
            let corner = |i: usize, j: usize| (i * around + j % around) as u32;
            let (a, b, c, d) = (corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j));
            triangles.push([a, d, c]);
            triangles.push([a, c, b]);
        }
    }
    TriMesh::new(vertices, triangles).expect("a ball is a mesh")
}

/// Where it meets the gel with its side, somewhat turned.
pub fn gel_from_ball() -> Pose {
    pose(&rotation_from_fixed_xyz([0.3, 0.2, 0.1]), Vector3::new(0.0, 0.0, 9.6e-3))
}

/// Its press.
pub const FORCE_N: f64 = 20.0;
/// Imprint constant of a metal part.
pub const IMPRINT_M3_PER_N: f64 = 1.5e-9;

/// Kinds of sensor by name, with the frame, the pixels and the gel of a sensor with lights: `regressor`, calibrated with
/// presses of a ball that the lights draw; `shadow`, with a table of shadows that fade over 3 mm; `markers`, with 14 x 11
/// dots; `regressor_shadow`, calibrated and with that table.
pub fn sensors(lights: &Sensor) -> [(&'static str, Sensor); 4] {
    let (grid, colour) = (lights.grid, &lights.colour);
    let regressor =
        calibrate_presses(&presses(lights), &CalibrateOptions { folds: Some(2), ..Default::default() })
            .expect("presses of a ball")
            .sensor;
    let rays = (0..DIRECTIONS * HEIGHTS).map(|i| {
        let depth = 0.4 * (i % HEIGHTS + 1) as f32;
        [0, 1, 2].map(|_| (0..80).map(|j| -depth * (1.0 - j as f32 / 80.0)).collect())
    });
    let table = ShadowTable {
        kind: ShadowKind::Darkening,
        directions_rad: (0..DIRECTIONS).map(|i| 2.0 * PI * i as f64 / DIRECTIONS as f64).collect(),
        first_height_m: 0.0,
        height_step_m: 0.02e-3,
        heights: HEIGHTS,
        step_m: 37e-6,
        rays: rays.collect(),
    };
    let regressor = Sensor { gel_shape: lights.gel_shape.clone(), ..regressor };
    let shadow = |colour: &ColourModel| {
        Some(Box::new(Shadow::new(table.clone(), grid.metres_per_px, grid.width_px, colour)))
    };
    let both = Sensor { shadow: shadow(&regressor.colour), ..regressor.clone() };
    let markers = Markers::regular(&grid, 14, 11, 20.0, 3.0, [0.5; 3]);
    let mut marked = lights.clone();
    print_markers(&mut marked.rest, &grid, &markers);
    [
        ("regressor", regressor),
        ("shadow", Sensor { shadow: shadow(colour), ..lights.clone() }),
        ("markers", Sensor { markers: Some(markers), ..marked }),
        ("regressor_shadow", both),
    ]
}

/// The gel with a known modulus, so that its markers move.
pub fn with_modulus(gel: &Gel) -> Gel {
    Gel { elastic: Some(Elastic { young_modulus_pa: 0.2e6, poisson_ratio: 0.48 }), ..gel.clone() }
}

/// Rays and rows of the table of shadows.
const DIRECTIONS: usize = 63;
const HEIGHTS: usize = 50;

/// Eight presses of a ball of 4 mm all over the frame.
fn presses(sensor: &Sensor) -> PressSet {
    let grid = &sensor.grid;
    let press = |i: usize| {
        // A low-discrepancy sequence (Roberts 2018).
        let at = |a: f64, n: usize| 40.0 + (n as f64 - 80.0) * ((i + 1) as f64 * a).fract();
        let circle = Circle {
            x_px: at(0.754_877_666, grid.width_px),
            y_px: at(0.569_840_291, grid.height_px),
            radius_px: (1.2e-3 + 0.1e-3 * (i % 4) as f64) / grid.metres_per_px,
        };
        let blank = TactileImage {
            width_px: grid.width_px as u32,
            height_px: grid.height_px as u32,
            rgb: vec![0; 3 * grid.len()],
        };
        let mut press = Press::of_ball(i.to_string(), blank, Some(circle));
        press.image = predict_press(&press, BALL_M, sensor).expect("one size");
        press
    };
    PressSet {
        metres_per_px: grid.metres_per_px,
        ball_m: BALL_M,
        rest: None,
        presses: (0..8).map(press).collect(),
    }
}

const BALL_M: f64 = 4e-3;
