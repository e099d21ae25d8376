//! A part in closed form: a spring up to the force at which it slips, then it slides.

use gripgen_twin::plant::{Grip, GripRequest, Plant, PlantError, PullReading, PullRequest};
use gripgen_twin::{PerJaw, TactileImage};

const STIFFNESS_N_M: f64 = 50_000.0;
/// Speed of a part that slips.
pub(super) const SLIDING_M_S: f64 = 0.02;
/// What the sensor says before it is zeroed.
const OFFSET_N: f64 = 0.75;

/// A part and a sensor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring {
    /// Pull at which it slips.
    pub(super) limit_n: f64,
    /// Reading of the sensor for a newton of pull.
    pub(super) gain: f64,
}

impl Plant for Spring {
    fn rest_images(&self, _: f64) -> PerJaw<TactileImage> {
        images()
    }

    fn grip(&self, _: &GripRequest) -> Result<Box<dyn Grip>, PlantError> {
        Ok(Box::new(Held { spring: *self, images: images(), direction: 1.0, displacement_m: 0.0 }))
    }

    fn offset_n(&self, _: f64) -> f64 {
        OFFSET_N
    }

    fn noise_n(&self, _: u64) -> f64 {
        0.0
    }
}

fn images() -> PerJaw<TactileImage> {
    let image = || TactileImage { width_px: 1, height_px: 1, rgb: vec![0; 3] };
    PerJaw { left: image(), right: image() }
}

struct Held {
    spring: Spring,
    images: PerJaw<TactileImage>,
    direction: f64,
    displacement_m: f64,
}

impl Grip for Held {
    fn width_mm(&self) -> f64 {
        20.0
    }

    fn holds(&self) -> bool {
        true
    }

    fn images(&self) -> &PerJaw<TactileImage> {
        &self.images
    }

    fn begin_pull(&mut self, pull: &PullRequest) -> Result<PullReading, PlantError> {
        (self.direction, self.displacement_m) = (pull.direction, 0.0);
        self.pull(0.0, 0.0)
    }

    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError> {
        let slides = force_n > self.spring.limit_n;
        self.displacement_m =
            if slides { self.displacement_m + SLIDING_M_S * step_s } else { force_n / STIFFNESS_N_M };
        Ok(PullReading {
            measured_n: self.spring.gain * force_n.min(self.spring.limit_n) + self.direction * OFFSET_N,
            displacement_m: self.displacement_m,
            speed_m_s: if slides { SLIDING_M_S } else { 0.0 },
        })
    }
}
