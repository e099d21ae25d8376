//! Presses as a camera sees them under optics that its sensor file does not know.

mod reduce;
mod view;

pub use view::{PressView, surface_part};

use super::compare::{gel_of, sink_in_fraction};
use super::gain::within_gain;
use super::{Circle, Contact, Press, PressSet};
use crate::grid::Plane;
use crate::render::Renderer;
use crate::sensor::{GelShape, Sensor};
use crate::simd::SimdLevel;
use gripgen_twin::{Gel, OpticsState};
pub(super) use reduce::means;
use reduce::reduced_sensor;

/// Widest image that is looked at pixel by pixel: larger ones are averaged over squares of pixels for fits.
const FIT_WIDTH_PX: usize = 300;

/// Where something is pressed in, in pixels of the images.
#[derive(Debug, Clone, PartialEq)]
pub struct PressContact(Contact);

impl PressContact {
    /// Of a press whose contact is known.
    pub fn of(press: &Press) -> Option<Self> {
        Some(Self(Contact::of_press(press, press.circle?)))
    }

    /// A ball that is known by its circle alone.
    pub fn of_circle(circle: Circle) -> Self {
        Self(Contact::of_circle(circle))
    }

    /// The same with another circle; of a body that is no ball, which has its own place, the same.
    pub fn at(&self, circle: Circle) -> Self {
        match self.is_ball() {
            true => Self(Contact { circle, ..self.0.clone() }),
            false => self.clone(),
        }
    }

    /// Its circle: the rim of a ball, or one around another body.
    pub fn circle(&self) -> &Circle {
        &self.0.circle
    }

    /// Whether it is a ball's.
    pub fn is_ball(&self) -> bool {
        self.0.indenter.is_none()
    }
}

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
        Self::at_least(FIT_WIDTH_PX, sensor, ball_m)
    }

    /// The same with images at least so wide.
    pub(super) fn at_least(width_px: usize, sensor: &Sensor, ball_m: f64) -> Self {
        let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
        let fits = |f: &usize| w.is_multiple_of(*f) && h.is_multiple_of(*f) && w / f >= width_px;
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

    /// What the camera sees of a press, minus the rest frame of the sensor file; without a contact, of the gel alone. Grey levels
    /// of red, green and blue.
    ///
    /// A dome of the effects is one that a marked circle lies on: the rim is where it was seen, whatever the gel.
    pub fn change_seen(&self, press: Option<&PressContact>, optics: &OpticsState) -> [Plane; 3] {
        let imprint = press.map(|PressContact(contact)| {
            let here = (self.factor > 1).then(|| contact.in_wider_pixels(self.factor));
            let dome = self.dome(optics);
            let shape = dome.as_ref().unwrap_or(&self.sensor.gel_shape);
            let sink_in = sink_in_fraction(&self.sensor);
            let contact = here.as_ref().unwrap_or(contact);
            contact.imprint_seen(self.ball_m, &self.sensor.grid, shape, sink_in, optics)
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
///
/// `gain_sd`: how much the gains of the camera scatter from press to press. The image then has the gain of its press, as far as
/// such a camera may have it.
pub fn frame_mse(
    set: &PressSet,
    index: usize,
    scene: &PressScene,
    optics: &OpticsState,
    gain_sd: Option<[f64; 3]>,
) -> f64 {
    let press = &set.presses[index];
    let contact = PressContact::of(press);
    let change = scene.change_seen(contact.as_ref(), optics);
    let mut image = crate::finish(&scene.sensor, Some(&change), None);
    if let (Some(sd), Some(PressContact(contact))) = (gain_sd, &contact) {
        image = within_gain(&press.image, &image, contact, &scene.sensor.grid, sd);
    }
    let squares = |(&a, &b): (&u8, &u8)| (f64::from(a) - f64::from(b)) * (f64::from(a) - f64::from(b));
    image.rgb.iter().zip(&press.image.rgb).map(squares).sum::<f64>() / image.rgb.len().max(1) as f64
}
