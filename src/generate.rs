//! One sample: from a scenario to images, trace and label.

use crate::library::{Library, LibraryError};
use crate::project::Project;
use gripgen_physics::{
    Grip, GripError, GripSetup, JawFriction, Mount, PullError, grip, pull_staircase, staircase_of,
};
use gripgen_tactile::{Imprint, IndentError, Renderer, Sensor, SimdLevel};
use gripgen_twin::config::{ConfigError, ImageNoise, ImageStorage};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{
    FrictionError, ImprintSummary, Jaw, LabelError, Outcome, Part, PerJaw, Pulled, Sample, Scenario,
    TactileImage, Twin, grip_friction, slip_label,
};
use std::sync::Arc;

/// Why a sample failed. It keeps its place in the data set.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// Drawn values that the twin or the scenario does not allow.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// The grip.
    #[error(transparent)]
    Grip(#[from] GripError),
    /// The imprint.
    #[error("{jaw} jaw: {source}")]
    Indent {
        /// Which jaw.
        jaw: Jaw,
        /// What is wrong.
        source: IndentError,
    },
    /// The friction law.
    #[error(transparent)]
    Friction(#[from] FrictionError),
    /// The pull.
    #[error(transparent)]
    Pull(#[from] PullError),
    /// The label.
    #[error(transparent)]
    Label(#[from] LabelError),
}

/// What a sample shows of a grip beside the data that is stored: for pictures.
pub struct Press {
    /// Imprints of both jaws.
    pub imprint: PerJaw<Imprint>,
    /// Sensors of both jaws.
    pub sensors: PerJaw<Arc<Sensor>>,
}

/// Simulates sample `index` of a sweep. Depends on the project and the index alone; `level` changes no bit.
pub fn generate(project: &Project, index: u64, level: SimdLevel) -> Sample {
    let mut scenario = drawn_scenario(project, index);
    let outcome = try_generate(project, index, level, &mut scenario).unwrap_or_else(|e| {
        let reason = format!("{e} (sample {index}, seed {})", project.sweep.seed);
        Outcome::Failed { reason }
    });
    Sample { scenario, outcome }
}

/// What is known of a sample before its own twin is: enough to record one that fails.
pub(crate) fn drawn_scenario(project: &Project, index: u64) -> Scenario {
    project.sweep.scenario(index, &project.twin).0
}

fn try_generate(
    project: &Project,
    index: u64,
    level: SimdLevel,
    known: &mut Scenario,
) -> Result<Outcome, SampleError> {
    let twin = project.twin_of(index)?;
    let (scenario, usable) = project.sweep.scenario(index, &twin);
    *known = scenario;
    usable?;
    simulate(&twin, &project.library, known, project.sweep.images != ImageStorage::None, level)
}

/// Simulates one scenario on a twin.
pub fn simulate(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    with_images: bool,
    level: SimdLevel,
) -> Result<Outcome, SampleError> {
    let part = &twin.parts[&scenario.part];
    let sensors = PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?;
    let renderers = PerJaw::from_fn(|jaw| Renderer { sensor: &sensors[jaw], gel: &twin.gel[jaw], level });
    let shape = library.shape(part, scenario.grip_pose)?;
    let Grip::Held(held) = grip(&grip_setup(twin, scenario, &shape))? else {
        let images = with_images.then(|| images(twin, scenario, &renderers, None));
        return Ok(Outcome::NoContact { images });
    };
    let imprint = press(library, part, scenario, &held.grasp, &renderers)?;
    let law = grip_friction(twin, &scenario.part, part, scenario.grip_force_n)?;
    let mu = law.mu * scatter(part, scenario);
    // The jaw holds mu times the pressure, summed over its patch.
    let friction = imprint.map(|_, i| JawFriction {
        limit_n: i.patch.cells.iter().map(|cell| mu * cell.force_n).sum(),
        kinetic_ratio: law.kinetic_ratio,
    });
    let grasp = held.grasp.clone();
    let stream = |purpose| Stream::new(scenario.seed, scenario.index, purpose);
    let mut session = held.pull(&friction, stream(Purpose::ForceNoise));
    let staircase = staircase_of(&scenario.pull, &mut stream(Purpose::StepJitter));
    let result = pull_staircase(&mut session, &staircase, &scenario.pull)?;
    let label = slip_label(&result.trace, scenario.pull.label_tolerance_n, result.end)?;
    let images = with_images.then(|| images(twin, scenario, &renderers, Some(&imprint)));
    let summary =
        imprint.map(|_, i| ImprintSummary { press_depth_m: i.press_depth_m, patch: i.patch.clone() });
    Ok(Outcome::Pulled(Box::new(Pulled {
        grasp,
        imprint: summary,
        images,
        mu,
        outside_fit: law.outside_fit,
        trace: result.trace,
        label,
    })))
}

/// The imprints of a scenario's grip, without pulling; `None` without contact.
pub fn press_only(twin: &Twin, library: &Library, scenario: &Scenario) -> Result<Option<Press>, SampleError> {
    let part = &twin.parts[&scenario.part];
    let sensors = PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?;
    let level = SimdLevel::best();
    let renderers = PerJaw::from_fn(|jaw| Renderer { sensor: &sensors[jaw], gel: &twin.gel[jaw], level });
    let shape = library.shape(part, scenario.grip_pose)?;
    let Grip::Held(held) = grip(&grip_setup(twin, scenario, &shape))? else { return Ok(None) };
    let imprint = press(library, part, scenario, &held.grasp, &renderers)?;
    Ok(Some(Press { imprint, sensors }))
}

fn grip_setup<'a>(
    twin: &'a Twin,
    scenario: &Scenario,
    shape: &'a gripgen_physics::PartShape,
) -> GripSetup<'a> {
    let c = &scenario.covariates;
    GripSetup {
        robot: twin.robot,
        gripper: twin.gripper,
        wrist: twin.wrist,
        gel: &twin.gel,
        shape,
        world_from_part: Part::world_from_part(c.grip_angle_rad, c.grip_offset_m),
        grip_force_n: PerJaw { left: scenario.grip_force_n, right: scenario.grip_force_n },
        direction: scenario.pull.direction.map(|x| x * c.pull_direction),
        mount: Mount::Fixed,
    }
}

fn press(
    library: &Library,
    part: &Part,
    scenario: &Scenario,
    grasp: &gripgen_twin::Grasp,
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

fn images(
    twin: &Twin,
    scenario: &Scenario,
    renderers: &PerJaw<Renderer<'_>>,
    imprint: Option<&PerJaw<Imprint>>,
) -> PerJaw<TactileImage> {
    PerJaw::from_fn(|jaw| {
        let purpose = match jaw {
            Jaw::Left => Purpose::ImageNoiseLeft,
            Jaw::Right => Purpose::ImageNoiseRight,
        };
        let key = match twin.optics[jaw].image_noise {
            ImageNoise::Off => None,
            ImageNoise::Measured => Some(Stream::new(scenario.seed, scenario.index, purpose).bits()),
        };
        renderers[jaw].image(imprint.map(|both| &both[jaw]), key)
    })
}

/// The factor by which this grip's friction differs from the mean, never negative.
fn scatter(part: &Part, scenario: &Scenario) -> f64 {
    if part.scatter == 0.0 {
        return 1.0;
    }
    let z = Stream::new(scenario.seed, scenario.index, Purpose::Scatter).normal();
    (1.0 + part.scatter * z).max(0.0)
}
