//! What the tests of the optics share: a small sensor, things that are pressed into it, and the effects by name.

use super::{at_depth, dome, rounded_as_seen};
use crate::colour::ColourModel;
use crate::grid::{Grid, Plane, added};
use crate::indent::{Imprint, PressedGel, indent};
use crate::render::Renderer;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use crate::testing::{gel, lights};
use gripgen_twin::effects::{EffectSpec, GripPoint, find};
use gripgen_twin::{Covariates, Gel, Jaw, OpticsState};

pub(super) const GRID: Grid = Grid { width_px: 160, height_px: 120, metres_per_px: 1.5e-4 };

const IMPRINT_M3_PER_N: f64 = 1.0e-9;

/// What is pressed into the gel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// A ball of 3 mm radius.
    Ball,
    /// A plate with teeth: edges in both directions.
    Rack,
    /// A plane as large as the gel.
    Plane,
    /// Nothing.
    Nothing,
}

/// One image of a series.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene {
    pub(super) shape: Shape,
    pub(super) centre_mm: [f64; 2],
    pub(super) force_n: f64,
    pub(super) hours: f64,
    pub(super) pull_index: u64,
}

pub(super) const fn scene(shape: Shape, centre_mm: [f64; 2], force_n: f64, hours: f64) -> Scene {
    Scene { shape, centre_mm, force_n, hours, pull_index: (10.0 * hours) as u64 }
}

pub(super) struct TestSensor {
    pub(super) sensor: Sensor,
    pub(super) gel: Gel,
}

/// Red, green and blue lights at 30, 150 and 270 degrees, each mainly in its channel.
pub(super) fn rig() -> TestSensor {
    let colours = [(30.0, [150.0, 18.0, 14.0]), (150.0, [16.0, 158.0, 24.0]), (270.0, [14.0, 26.0, 140.0])];
    let lambert = lights(0.66, [0.2, 0.05], &colours);
    let unit = 2.0 / GRID.width_px as f64;
    let rest = [0, 1, 2].map(|c| {
        let level = |i: usize| {
            let u = (i % GRID.width_px) as f64 * unit - 1.0;
            let v = ((i / GRID.width_px) as f64 - GRID.height_px as f64 / 2.0) * unit;
            ((lambert.flat(c, u, v) + 30.0) * (1.0 - 0.2 * (u * u + v * v))) as f32
        };
        (0..GRID.len()).map(level).collect()
    });
    let sensor = Sensor::new(GRID, rest, [1.0; 3], ColourModel::Lambert(Box::new(lambert)));
    TestSensor { sensor, gel: gel(&[41, 31, 13, 7, 5]) }
}

impl TestSensor {
    pub(super) fn renderer(&self) -> Renderer<'_> {
        Renderer { sensor: &self.sensor, gel: &self.gel, level: SimdLevel::best() }
    }

    pub(super) fn imprint(&self, scene: &Scene, optics: &OpticsState) -> Option<Imprint> {
        if scene.shape == Shape::Nothing {
            return None;
        }
        let heights = GRID.plane(|x, y| {
            let [x, y] = [x * 1e3 - scene.centre_mm[0], y * 1e3 - scene.centre_mm[1]];
            let [along, across] = [0.956 * x + 0.292 * y, 0.956 * y - 0.292 * x];
            let height_mm = match scene.shape {
                Shape::Ball if x.hypot(y) < 3.0 => (9.0 - x * x - y * y).sqrt() - 3.0,
                // Teeth every 1.8 mm, 0.9 mm high, turned by 17 degrees against the pixels.
                Shape::Plane => 0.0,
                Shape::Rack if along.abs() < 4.5 && across.abs() < 3.0 => {
                    if (along / 1.8).rem_euclid(1.0) < 0.5 { 0.0 } else { -0.9 }
                }
                _ => f64::NEG_INFINITY,
            };
            height_mm * 1e-3 / GRID.metres_per_px
        });
        let gel = PressedGel::of(&self.gel, IMPRINT_M3_PER_N);
        let heights = added(rounded_as_seen(heights, &GRID, optics), dome(&GRID, &GRID, optics).as_ref());
        let imprint = indent(&heights, &GRID, &gel, scene.force_n).unwrap();
        let thickness_m = self.gel.thickness_m;
        let changed = optics.changes_depth();
        Some(if changed { at_depth(imprint, &heights, &GRID, thickness_m, optics) } else { imprint })
    }

    /// What the camera sees of a scene, minus the rest frame.
    pub(super) fn change(&self, scene: &Scene, optics: &OpticsState) -> [Plane; 3] {
        self.renderer().change_seen(self.imprint(scene, optics).as_ref(), optics)
    }

    /// The same with one effect of the library.
    pub(super) fn with(&self, scene: &Scene, id: &str, parameters: &[f64]) -> [Plane; 3] {
        self.change(scene, &state(id, parameters, scene, Jaw::Left))
    }

    /// What the effect adds to the image.
    pub(super) fn signature(&self, scene: &Scene, id: &str, parameters: &[f64]) -> [Plane; 3] {
        let (with, without) = (self.with(scene, id, parameters), self.change(scene, &OpticsState::default()));
        [0, 1, 2].map(|c| difference(&with[c], &without[c]))
    }
}

pub(super) fn spec(id: &str) -> &'static EffectSpec {
    find(id).unwrap_or_else(|| panic!("no effect {id}"))
}

/// The optics of one effect in the circumstances of a scene.
pub(super) fn state(id: &str, parameters: &[f64], scene: &Scene, jaw: Jaw) -> OpticsState {
    let covariates =
        Covariates { time_s: 3600.0 * scene.hours, pull_index: scene.pull_index, ..Default::default() };
    let at = GripPoint {
        jaw,
        grip_force_n: scene.force_n,
        contact_area_m2: 0.0,
        pull_rate_n_per_s: 10.0,
        covariates: &covariates,
        grip: (0, scene.pull_index),
    };
    let mut state = OpticsState::default();
    spec(id).optics.expect("an optics effect")(parameters, &mut state, &at);
    state
}

pub(super) fn difference(a: &Plane, b: &Plane) -> Plane {
    a.zip(b, |x, y| x - y)
}

pub(super) fn rms(planes: &[Plane]) -> f64 {
    let (sum, n) = planes
        .iter()
        .flat_map(|p| &p.values)
        .fold((0.0, 0), |(sum, n), &v| (sum + f64::from(v).powi(2), n + 1));
    (sum / f64::from(n)).sqrt()
}

/// Pixels with a condition on (x, y) in mm from the middle of the image.
pub(super) fn pixels(inside: impl Fn(f64, f64) -> bool) -> Vec<usize> {
    (0..GRID.len())
        .filter(|i| {
            let (x, y) = GRID.centre_m(i % GRID.width_px, i / GRID.width_px);
            inside(x * 1e3, y * 1e3)
        })
        .collect()
}
