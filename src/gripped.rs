//! The first half of a sample: grip, imprints, and what the cameras see without noise.
//!
//! Repetitions of a configuration share it; scatter, noise and the pull itself are drawn anew for each.

use crate::generate::{SampleError, SimulateOptions};
use crate::library::Library;
use gripgen_physics::{Grip, GripSetup, Held, Mount, PartShape, grip};
use gripgen_tactile::{Imprint, Plane, Renderer, Sensor};
use gripgen_twin::config::{ImageNoise, Mechanics};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Grasp, Jaw, Part, PerJaw, Scenario, TactileImage, Twin};
use std::sync::Arc;

/// A grip with its imprints.
pub(crate) struct Gripped {
    pub(crate) sensors: PerJaw<Arc<Sensor>>,
    /// `None` if the jaws miss the part.
    pub(crate) contact: Option<Contact>,
}

/// Jaws that hold a part.
pub(crate) struct Contact {
    pub(crate) held: Box<Held>,
    pub(crate) imprint: PerJaw<Imprint>,
    /// What the imprint changes in the image, if there are images.
    change: Option<PerJaw<[Plane; 3]>>,
}

impl Gripped {
    /// Grips and presses. Depends on what repetitions share only: not on index, scatter or noise.
    pub(crate) fn new(
        twin: &Twin,
        library: &Library,
        scenario: &Scenario,
        options: SimulateOptions,
    ) -> Result<Self, SampleError> {
        let part = &twin.parts[&scenario.part];
        let sensors = PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?;
        let shape = library.shape(part, scenario.grip_pose)?;
        let Grip::Held(held) = grip(&grip_setup(twin, scenario, options.mechanics, &shape))? else {
            return Ok(Self { sensors, contact: None });
        };
        let renderers = PerJaw::from_fn(|jaw| Renderer {
            sensor: &sensors[jaw],
            gel: &twin.gel[jaw],
            level: options.level,
        });
        let imprint = press(library, part, scenario, &held.grasp, &renderers)?;
        let change = options.images.then(|| imprint.map(|jaw, imprint| renderers[jaw].change(imprint)));
        Ok(Self { sensors, contact: Some(Contact { held, imprint, change }) })
    }

    /// The images of one repetition.
    pub(crate) fn images(&self, twin: &Twin, scenario: &Scenario) -> PerJaw<TactileImage> {
        PerJaw::from_fn(|jaw| {
            let purpose = match jaw {
                Jaw::Left => Purpose::ImageNoiseLeft,
                Jaw::Right => Purpose::ImageNoiseRight,
            };
            let key = match twin.optics[jaw].image_noise {
                ImageNoise::Off => None,
                ImageNoise::Measured => Some(Stream::new(scenario.seed, scenario.index, purpose).bits()),
            };
            let change = self.contact.as_ref().and_then(|c| c.change.as_ref()).map(|both| &both[jaw]);
            gripgen_tactile::finish(&self.sensors[jaw], change, key)
        })
    }
}

fn grip_setup<'a>(
    twin: &'a Twin,
    scenario: &Scenario,
    mechanics: Mechanics,
    shape: &'a PartShape,
) -> GripSetup<'a> {
    GripSetup {
        mechanics,
        robot: twin.robot,
        gripper: twin.gripper,
        wrist: twin.wrist,
        gel: &twin.gel,
        shape,
        world_from_part: world_from_part(scenario),
        grip_force_n: PerJaw { left: scenario.grip_force_n, right: scenario.grip_force_n },
        direction: pull_direction(scenario),
        mount: Mount::Fixed,
    }
}

/// Where the part lies between the jaws.
pub(crate) fn world_from_part(scenario: &Scenario) -> gripgen_twin::frames::Pose {
    let c = &scenario.covariates;
    Part::world_from_part(c.grip_angle_rad, c.grip_offset_m)
}

/// Unit vector of the pull in `world`.
pub(crate) fn pull_direction(scenario: &Scenario) -> [f64; 3] {
    scenario.pull.direction.map(|x| x * scenario.covariates.pull_direction)
}

fn press(
    library: &Library,
    part: &Part,
    scenario: &Scenario,
    grasp: &Grasp,
    renderers: &PerJaw<Renderer<'_>>,
) -> Result<PerJaw<Imprint>, SampleError> {
    let mesh = library.mesh(part)?;
    PerJaw::try_from_fn(|jaw| {
        let gel_from_mesh = grasp.gel_from_part[jaw] * part.grips[scenario.grip_pose];
        renderers[jaw]
            .press(&mesh, &gel_from_mesh, part.imprint_m3_per_n, scenario.grip_force_n)
            .map_err(|source| SampleError::Indent { jaw, source })
    })
}
