//! Presses as a camera sees them under optics that its sensor file does not know.

mod reduce;
mod view;

pub use view::{PressView, surface_part};

use super::compare::{gel_of, sink_in_fraction};
use super::contact::{Deeper, ball_imprint};
use super::{Circle, PressSet};
use crate::grid::Plane;
use crate::render::Renderer;
use crate::sensor::{GelShape, Sensor};
use crate::simd::SimdLevel;
use gripgen_twin::{Gel, OpticsState};
use reduce::reduced_sensor;

/// Widest image that is looked at pixel by pixel: larger ones are averaged over squares of pixels for fits.
const FIT_WIDTH_PX: usize = 300;

/// A sensor, its gel and a ball: everything but where it is pressed in.
#[derive(Debug, Clone)]
pub struct PressScene {
    sensor: Sensor,
    gel: Gel,
    ball_m: f64,
    /// Pixels of the sensor file along the side of one of this scene.
    factor: usize,
}

impl PressScene {
    /// At the resolution of the sensor file.
    pub fn new(sensor: &Sensor, ball_m: f64) -> Self {
        Self { sensor: sensor.clone(), gel: gel_of(sensor), ball_m, factor: 1 }
    }

    /// At a resolution that suffices for fits: squares of 2 x 2 pixels or more of a large image are one. Sensors with
    /// markers keep theirs.
    pub fn for_fits(sensor: &Sensor, ball_m: f64) -> Self {
        let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
        let fits = |f: &usize| w.is_multiple_of(*f) && h.is_multiple_of(*f) && w / f >= FIT_WIDTH_PX;
        let factor = (1..=8).filter(fits).max().unwrap_or(1);
        match reduced_sensor(sensor, factor) {
            Some(sensor) => Self { gel: gel_of(&sensor), sensor, ball_m, factor },
            None => Self::new(sensor, ball_m),
        }
    }

    /// The sensor at the resolution of the scene.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Pixels of the sensor file along the side of one of this scene.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// A circle of the images in pixels of the scene.
    fn circle_here(&self, circle: &Circle) -> Circle {
        let f = self.factor as f64;
        Circle {
            x_px: (circle.x_px + 0.5) / f - 0.5,
            y_px: (circle.y_px + 0.5) / f - 0.5,
            radius_px: circle.radius_px / f,
        }
    }

    /// What the camera sees of a press whose rim of contact is `circle`, in pixels of the images, minus the rest frame
    /// of the sensor file; without a circle, of no contact. Grey levels of red, green and blue.
    ///
    /// A dome of the effects is one that the marked circle lies on: the rim is where it was seen, whatever the gel.
    pub fn change_seen(&self, circle: Option<&Circle>, optics: &OpticsState) -> [Plane; 3] {
        let imprint = circle.map(|circle| {
            let circle = self.circle_here(circle);
            let deeper = Deeper::By(sink_in_fraction(&self.sensor));
            let dome = self.dome(optics);
            let shape = dome.as_ref().unwrap_or(&self.sensor.gel_shape);
            ball_imprint(&circle, deeper, self.ball_m, &self.sensor.grid, shape)
        });
        let renderer = Renderer { sensor: &self.sensor, gel: &self.gel, level: SimdLevel::best() };
        renderer.change_seen(imprint.as_ref(), optics)
    }

    /// The gel at rest with what the effects add to it.
    fn dome(&self, optics: &OpticsState) -> Option<GelShape> {
        if optics.dome_sag_m == 0.0 {
            return None;
        }
        let grid = &self.sensor.grid;
        let added = GelShape::Dome { sag_m: optics.dome_sag_m };
        Some(match (self.sensor.gel_shape.rest_px(grid), added.rest_px(grid)) {
            (Some(rest), Some(dome)) => {
                GelShape::Map(rest.values.iter().zip(&dome.values).map(|(a, b)| a + b).collect())
            }
            _ => added,
        })
    }
}

/// Mean squared difference of an image to what is seen of it, over the whole frame and all channels, in grey levels
/// squared; both rounded to whole levels as `compare` has them.
pub fn frame_mse(set: &PressSet, index: usize, scene: &PressScene, optics: &OpticsState) -> f64 {
    let press = &set.presses[index];
    let change = scene.change_seen(press.circle.as_ref(), optics);
    let image = crate::finish(&scene.sensor, Some(&change), None);
    let squares = |(&a, &b): (&u8, &u8)| (f64::from(a) - f64::from(b)) * (f64::from(a) - f64::from(b));
    image.rgb.iter().zip(&press.image.rgb).map(squares).sum::<f64>() / image.rgb.len().max(1) as f64
}
