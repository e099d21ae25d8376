//! The twin's plant in the place that the virtual rig has for one.

use gripgen::twin::{PerJaw, TactileImage};
use gripgen::{PlantGrip, PlantPull, PlantReading, TwinPlant};
use gripgen_rig::virtual_rig::plant::{Grip, GripRequest, Plant, PlantError, PullReading, PullRequest};
use std::fmt::Display;

/// A twin that a virtual rig moves.
pub struct Moved {
    plant: TwinPlant,
    /// What is seen where a sensor file has become unreadable since the start.
    rest: PerJaw<TactileImage>,
}

impl Moved {
    /// Checks that its sensors can be seen.
    pub fn new(plant: TwinPlant) -> Result<Self, gripgen::SampleError> {
        let rest = plant.rest_images(0.0)?;
        Ok(Self { plant, rest })
    }
}

fn problem(e: impl Display) -> PlantError {
    PlantError { problem: e.to_string() }
}

impl Plant for Moved {
    fn rest_images(&self, time_s: f64) -> PerJaw<TactileImage> {
        self.plant.rest_images(time_s).unwrap_or_else(|_| self.rest.clone())
    }

    fn grip(&self, how: &GripRequest) -> Result<Box<dyn Grip>, PlantError> {
        let tool = how.tcp.base_from_tool();
        let grip = self.plant.grip(&tool, how.force_per_jaw_n, how.time_s).map_err(problem)?;
        Ok(match grip {
            Some(grip) => Box::new(Closed(grip)),
            None => Box::new(Empty { images: self.rest_images(how.time_s) }),
        })
    }

    fn offset_n(&self, time_s: f64) -> f64 {
        self.plant.offset_n(time_s)
    }

    fn noise_n(&self, tick: u64) -> f64 {
        self.plant.noise_n(tick)
    }
}

/// Jaws on a part.
struct Closed(PlantGrip);

fn reading(r: PlantReading) -> PullReading {
    PullReading { measured_n: r.measured_n, displacement_m: r.displacement_m, speed_m_s: r.speed_m_s }
}

impl Grip for Closed {
    fn width_mm(&self) -> f64 {
        1e3 * self.0.width_m()
    }

    fn holds(&self) -> bool {
        true
    }

    fn images(&self) -> &PerJaw<TactileImage> {
        self.0.images()
    }

    fn begin_pull(&mut self, pull: &PullRequest) -> Result<PullReading, PlantError> {
        let pull = PlantPull {
            direction: pull.direction,
            increment_n: pull.increment_n,
            step_s: pull.step_s,
            dwell_s: pull.dwell_s,
            time_s: pull.time_s,
        };
        self.0.begin_pull(&pull).map(reading).map_err(problem)
    }

    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError> {
        self.0.pull(force_n, step_s).map(reading).map_err(problem)
    }
}

/// Jaws on each other.
struct Empty {
    images: PerJaw<TactileImage>,
}

impl Grip for Empty {
    fn width_mm(&self) -> f64 {
        0.0
    }

    fn holds(&self) -> bool {
        false
    }

    fn images(&self) -> &PerJaw<TactileImage> {
        &self.images
    }

    fn begin_pull(&mut self, _: &PullRequest) -> Result<PullReading, PlantError> {
        Ok(PullReading::default())
    }

    fn pull(&mut self, _: f64, _: f64) -> Result<PullReading, PlantError> {
        Ok(PullReading::default())
    }
}
