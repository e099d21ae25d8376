//! A plant in closed form: a spring up to the friction limit, then sliding at a constant speed. Programs are checked on it, and the
//! virtual devices are tested with it.

use gripgen_twin::plant::{Grip, GripRequest, Plant, PlantError, PullReading, PullRequest};
use gripgen_twin::{PerJaw, TactileImage};

/// The part and the sensors.
#[derive(Debug, Clone, Copy)]
pub struct Spring {
    /// Pull at which the part slips.
    pub limit_n: f64,
    /// Force of the sensor for a newton of pull.
    pub gain: f64,
    /// Offset of the sensor.
    pub offset_n: f64,
    /// Stiffness before it slips.
    pub stiffness_n_m: f64,
    /// Speed after it has.
    pub sliding_m_s: f64,
}

impl Spring {
    /// A sensor that reads true but for an offset, and a part that slips at 10.25 N.
    pub const PLAIN: Self =
        Self { limit_n: 10.25, gain: 1.0, offset_n: 0.75, stiffness_n_m: 50_000.0, sliding_m_s: 0.02 };
}

impl Default for Spring {
    fn default() -> Self {
        Self::PLAIN
    }
}

fn images(of: u8) -> PerJaw<TactileImage> {
    let image = |of| TactileImage { width_px: 16, height_px: 8, rgb: vec![of; 3 * 16 * 8] };
    PerJaw { left: image(of), right: image(of + 1) }
}

impl Plant for Spring {
    fn rest_images(&self, _: f64) -> PerJaw<TactileImage> {
        images(20)
    }

    fn grip(&self, _: &GripRequest) -> Result<Box<dyn Grip>, PlantError> {
        Ok(Box::new(Held {
            spring: *self,
            images: images(120),
            direction: 1.0,
            reading: PullReading::default(),
        }))
    }

    fn offset_n(&self, _: f64) -> f64 {
        self.offset_n
    }

    fn noise_n(&self, _: u64) -> f64 {
        0.0
    }
}

/// The part between the jaws.
struct Held {
    spring: Spring,
    images: PerJaw<TactileImage>,
    direction: f64,
    reading: PullReading,
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
        self.direction = pull.direction;
        self.pull(0.0, 0.0)
    }

    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError> {
        let Spring { limit_n, gain, offset_n, stiffness_n_m, sliding_m_s } = self.spring;
        let slides = force_n > limit_n;
        let felt_n = force_n.min(limit_n);
        self.reading = PullReading {
            measured_n: gain * felt_n + self.direction * offset_n,
            displacement_m: if slides {
                self.reading.displacement_m + sliding_m_s * step_s
            } else {
                force_n / stiffness_n_m
            },
            speed_m_s: if slides { sliding_m_s } else { 0.0 },
        };
        Ok(self.reading)
    }
}
