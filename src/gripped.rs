//! The first half of a sample: grip, imprints, and what the cameras see without noise.
//!
//! Repetitions of a configuration share it; scatter, noise and the pull itself are drawn anew for each.

use crate::gpu::{Gpu, ImageFault, ImageJob, PlacedPart};
use crate::library::Library;
use crate::sample::{SampleError, SimulateOptions};
use gripgen_physics::{
    Arm, Grip, GripSetup, Held, Mount, PartShape, PlacedArm, grip, grip_point, pull_direction,
};
use gripgen_tactile::gpu::makes;
use gripgen_tactile::{ClusteredMesh, Imprint, Pad, Plane, Renderer, Sensor, SimdLevel, contact_slopes};
use gripgen_twin::config::{Backend, ImageNoise, Mechanics};
use gripgen_twin::effects::{imprint_volume_m3, jaw_tilt_rad, normal_force_n, optics_state};
use gripgen_twin::frames::{pose, rotation_about_axis, world_from_gel};
use gripgen_twin::image::pixel_noise::PixelNoise;
use gripgen_twin::{Grasp, Jaw, OpticsState, Part, PerJaw, Scenario, TactileImage, Twin};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::sync::Arc;

/// Smallest normal force of a jaw that still grips.
const MIN_FORCE_N: f64 = 1e-3;

/// A grip with its imprints.
pub struct Gripped {
    /// The sensor of each jaw.
    pub sensors: PerJaw<Arc<Sensor>>,
    /// `None` if the jaws miss the part.
    pub contact: Option<Contact>,
    /// What the images are made of, if anything differs from the rest frame and there are images.
    look: Option<Look>,
}

/// What the cameras see without noise.
enum Look {
    /// The change of the image.
    Change(PerJaw<[Plane; 3]>),
    /// The parts in front of the gels: the graphics processor makes the image when its noise is known.
    Parts(PerJaw<PlacedPart>),
}

/// Jaws that hold a part.
pub struct Contact {
    /// The grip in the mechanics.
    pub held: Box<Held>,
    /// What is pressed into each gel.
    pub imprint: PerJaw<Imprint>,
    /// Real normal force of each jaw.
    pub force_n: PerJaw<f64>,
}

impl Gripped {
    /// Grips and presses. Depends on what repetitions share only: not on index, scatter or noise.
    pub fn new(
        twin: &Twin,
        library: &Library,
        scenario: &Scenario,
        options: SimulateOptions,
    ) -> Result<Self, SampleError> {
        let sensors = PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?;
        let optics =
            PerJaw::from_fn(|jaw| optics_state(twin, &scenario.part, &grip_point(scenario, jaw, 0.0)));
        let force_n = jaw_forces_n(twin, scenario)?;
        let Some(held) = held(twin, library, scenario, force_n, options.mechanics)? else {
            return Self::at_rest(twin, library, scenario, options);
        };
        let press = Indenter::new(twin, library, scenario, &force_n, &held.grasp, options.level)?;
        let imprint = press.contacts()?;
        let look = if !options.images {
            None
        } else if options.backend == Backend::Gpu && press.on_device(&optics) {
            Some(Look::Parts(press.parts))
        } else {
            Some(Look::Change(PerJaw::try_from_fn(|jaw| {
                let seen = press.seen(jaw, &imprint[jaw], &optics[jaw])?;
                Ok::<_, SampleError>(press.renderer(jaw).change_seen(Some(&*seen), &optics[jaw]))
            })?))
        };
        Ok(Self { sensors, contact: Some(Contact { held, imprint, force_n }), look })
    }

    /// Open jaws, or jaws that miss the part.
    pub fn at_rest(
        twin: &Twin,
        library: &Library,
        scenario: &Scenario,
        options: SimulateOptions,
    ) -> Result<Self, SampleError> {
        let sensors = PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?;
        let optics =
            PerJaw::from_fn(|jaw| optics_state(twin, &scenario.part, &grip_point(scenario, jaw, 0.0)));
        let differs = options.images && Jaw::BOTH.iter().any(|&jaw| optics[jaw].changes_frame());
        let look = differs.then(|| {
            Look::Change(PerJaw::from_fn(|jaw| {
                let renderer = Renderer { sensor: &sensors[jaw], gel: &twin.gel[jaw], level: options.level };
                renderer.change_seen(None, &optics[jaw])
            }))
        });
        Ok(Self { sensors, contact: None, look })
    }

    /// The images of one repetition, with the noise of the sensors or without.
    pub fn images(
        &self,
        twin: &Twin,
        scenario: &Scenario,
        noise: bool,
        gpu: Option<&Gpu>,
    ) -> Result<PerJaw<TactileImage>, SampleError> {
        let key = |jaw: Jaw| match twin.optics[jaw].image_noise {
            ImageNoise::Measured if noise => Some(PixelNoise::key_of(scenario.seed, scenario.index, jaw)),
            _ => None,
        };
        let look = self.look.as_ref();
        if let (Some(Look::Parts(parts)), Some(gpu)) = (look, gpu) {
            let job = |jaw: Jaw| ImageJob {
                sensor: self.sensors[jaw].clone(),
                gel: twin.gel[jaw].clone(),
                part: parts[jaw].clone(),
                noise_key: key(jaw),
            };
            let [left, right] = gpu.images(Jaw::BOTH.map(job));
            let checked = |jaw, image: Result<TactileImage, ImageFault>| {
                image.map_err(|fault| match fault {
                    ImageFault::Device(e) => SampleError::Gpu(e),
                    ImageFault::Indent(source) => SampleError::Indent { jaw, source },
                })
            };
            return Ok(PerJaw { left: checked(Jaw::Left, left)?, right: checked(Jaw::Right, right)? });
        }
        Ok(PerJaw::from_fn(|jaw| {
            let change = match look {
                Some(Look::Change(both)) => Some(&both[jaw]),
                _ => None,
            };
            gripgen_tactile::finish(&self.sensors[jaw], change, key(jaw))
        }))
    }
}

/// Real normal force of each jaw. An error if an effect leaves a jaw none.
pub fn jaw_forces_n(twin: &Twin, scenario: &Scenario) -> Result<PerJaw<f64>, SampleError> {
    PerJaw::try_from_fn(|jaw| {
        let force_n = normal_force_n(twin, &scenario.part, &grip_point(scenario, jaw, 0.0));
        let commanded_n = scenario.grip_force_n;
        if force_n < MIN_FORCE_N {
            Err(SampleError::NoForce { jaw, force_n, commanded_n })
        } else {
            Ok(force_n)
        }
    })
}

/// The part between closed jaws; `None` if they miss it.
pub fn held(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    force_n: PerJaw<f64>,
    mechanics: Mechanics,
) -> Result<Option<Box<Held>>, SampleError> {
    let shape = library.shape(&twin.parts[&scenario.part], scenario.grip_pose)?;
    let arm = twin.arm.as_ref().map(|arm| library.arm(arm)).transpose()?;
    if let Some(arm) = arm.as_deref() {
        check_damping(twin, arm, pull_direction(scenario))?;
    }
    let arm = arm.as_deref().map_or(Arm::Carriage, Arm::Multibody);
    match grip(&grip_setup(twin, scenario, force_n, mechanics, arm, &shape))? {
        Grip::Held(held) => Ok(Some(held)),
        Grip::NoContact => Ok(None),
    }
}

/// A part in front of both gels, ready to be pressed in.
pub struct Indenter<'a> {
    twin: &'a Twin,
    sensors: PerJaw<Arc<Sensor>>,
    parts: PerJaw<PlacedPart>,
    /// Direction of the pull in the frame of each gel.
    along: PerJaw<[f64; 2]>,
    mesh: Arc<ClusteredMesh>,
    level: SimdLevel,
}

impl<'a> Indenter<'a> {
    /// The part in front of both gels.
    ///
    /// # Errors
    ///
    /// A mesh or a sensor that cannot be used.
    pub fn new(
        twin: &'a Twin,
        library: &Library,
        scenario: &Scenario,
        force_n: &PerJaw<f64>,
        grasp: &Grasp,
        level: SimdLevel,
    ) -> Result<Self, SampleError> {
        Ok(Self {
            twin,
            sensors: PerJaw::try_from_fn(|jaw| library.sensor(&twin.optics[jaw]))?,
            parts: placed_parts(twin, library, scenario, force_n, grasp)?,
            along: PerJaw::from_fn(|jaw| along_gel(scenario, jaw)),
            mesh: library.clustered_mesh(&twin.parts[&scenario.part])?,
            level,
        })
    }

    /// The part in front of a gel.
    pub fn part(&self, jaw: Jaw) -> &PlacedPart {
        &self.parts[jaw]
    }

    fn renderer(&self, jaw: Jaw) -> Renderer<'_> {
        Renderer { sensor: &self.sensors[jaw], gel: &self.twin.gel[jaw], level: self.level }
    }

    /// Whether a GPU makes the images of both jaws: it solves the contact on the pixels of the image, so that these have
    /// to be those of the pad.
    fn on_device(&self, optics: &PerJaw<OpticsState>) -> bool {
        Jaw::BOTH.iter().all(|&jaw| {
            let renderer = self.renderer(jaw);
            optics[jaw].is_neutral() && renderer.sees_pad() && makes(renderer.sensor, renderer.gel)
        })
    }

    /// The contact of the part with both pads, with its slopes where they count.
    ///
    /// # Errors
    ///
    /// A part beside a pad, or a press deeper than a gel.
    pub fn contacts(&self) -> Result<PerJaw<Imprint>, SampleError> {
        PerJaw::try_from_fn(|jaw| {
            let PlacedPart { gel_from_mesh, imprint_m3_per_n, force_n, .. } = &self.parts[jaw];
            let gel = &self.twin.gel[jaw];
            let pad = Pad { gel, level: self.level };
            let contact = pad.press(&self.mesh, gel_from_mesh, *imprint_m3_per_n, *force_n);
            let mut contact = contact.map_err(|source| SampleError::Indent { jaw, source })?;
            if gel.interlock > 0.0 {
                let smoothing_m = gel.interlock_smoothing_m;
                contact.patch.slopes =
                    contact_slopes(&contact.depth_px, &pad.grid(), smoothing_m, self.along[jaw], self.level);
            }
            Ok(contact)
        })
    }

    /// What the camera of a jaw sees of `contact`. Optics effects change the image and not the contact: where they change the imprint, the camera has
    /// its own.
    ///
    /// # Errors
    ///
    /// As [`Indenter::contacts`].
    pub fn seen<'i>(
        &self,
        jaw: Jaw,
        contact: &'i Imprint,
        optics: &OpticsState,
    ) -> Result<Cow<'i, Imprint>, SampleError> {
        let PlacedPart { gel_from_mesh, imprint_m3_per_n, force_n, .. } = &self.parts[jaw];
        let renderer = self.renderer(jaw);
        if !optics.changes_press() {
            return Ok(renderer.seen(&self.mesh, gel_from_mesh, contact, optics));
        }
        let pad = Pad { gel: renderer.gel, level: self.level };
        let own = pad.press_seen(&renderer, &self.mesh, gel_from_mesh, *imprint_m3_per_n, *force_n, optics);
        let own = own.map_err(|source| SampleError::Indent { jaw, source })?;
        Ok(Cow::Owned(renderer.seen(&self.mesh, gel_from_mesh, &own, optics).into_owned()))
    }
}

/// The direction of a pull in the plane of a gel.
fn along_gel(scenario: &Scenario, jaw: Jaw) -> [f64; 2] {
    let along = world_from_gel(jaw, 0.0).inverse() * Vector3::from(pull_direction(scenario));
    [along.x, along.y]
}

fn grip_setup<'a>(
    twin: &'a Twin,
    scenario: &Scenario,
    grip_force_n: PerJaw<f64>,
    mechanics: Mechanics,
    arm: Arm<'a>,
    shape: &'a PartShape,
) -> GripSetup<'a> {
    GripSetup {
        mechanics,
        arm,
        robot: twin.robot,
        gripper: twin.gripper,
        wrist: twin.wrist,
        gel: &twin.gel,
        shape,
        world_from_part: world_from_part(scenario),
        grip_force_n,
        direction: pull_direction(scenario),
        mount: Mount::Fixed,
    }
}

/// Where the part lies between the jaws.
pub fn world_from_part(scenario: &Scenario) -> gripgen_twin::frames::Pose {
    let c = &scenario.covariates;
    Part::world_from_part(c.grip_angle_rad, c.grip_offset_m)
}

/// Mass with which the tool of a rig answers along +z. Of an arm whose description cannot be read, that of its carriage.
pub fn answering_mass_kg(twin: &Twin, library: &Library) -> f64 {
    let carried_kg = twin.robot.carriage_mass_kg(&twin.gripper);
    let arm = twin.arm.as_ref().and_then(|arm| library.arm(arm).ok());
    let of_rig_kg = arm.map_or(carried_kg, |arm| arm.held_mass_kg(&twin.gripper, [0.0, 0.0, 1.0]));
    twin.robot.apparent_mass_kg.unwrap_or(of_rig_kg)
}

/// Damping that stops more than the arm's mass within one step of the force loop makes it unstable.
pub fn check_damping(twin: &Twin, arm: &PlacedArm, direction: [f64; 3]) -> Result<(), SampleError> {
    let (damping, step_s) = (twin.robot.damping_n_s_per_m, twin.wrist.step_s());
    let mass_kg = twin.robot.apparent_mass_kg.unwrap_or_else(|| arm.held_mass_kg(&twin.gripper, direction));
    if damping * step_s < mass_kg {
        return Ok(());
    }
    Err(SampleError::Damping { damping_n_s_per_m: damping, mass_kg, step_s })
}

/// The part in front of each gel, and how hard it is pressed.
pub fn placed_parts(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    force_n: &PerJaw<f64>,
    grasp: &Grasp,
) -> Result<PerJaw<PlacedPart>, SampleError> {
    let part = &twin.parts[&scenario.part];
    let mesh = library.mesh(part)?;
    Ok(PerJaw::from_fn(|jaw| {
        let mut gel_from_mesh = grasp.gel_from_part[jaw] * part.grips[scenario.grip_pose];
        let tilt_rad = jaw_tilt_rad(twin, &scenario.part, &grip_point(scenario, jaw, 0.0));
        if tilt_rad != 0.0 {
            // The gel turns about its own x axis, so the part turns the other way in it.
            gel_from_mesh = pose(&rotation_about_axis(0, -tilt_rad), Vector3::zeros()) * gel_from_mesh;
        }
        let volume_m3 = imprint_volume_m3(twin, &scenario.part, part, jaw, force_n[jaw]);
        let unchanged = volume_m3 == part.imprint_m3_per_n * force_n[jaw];
        let imprint_m3_per_n = if unchanged { part.imprint_m3_per_n } else { volume_m3 / force_n[jaw] };
        PlacedPart { mesh: mesh.clone(), gel_from_mesh, imprint_m3_per_n, force_n: force_n[jaw] }
    }))
}

/// Grips and presses as a sample does, without images and pull: whether the jaws hold the part. Jaws stop at the surface in both
/// mechanics, so the reduced one answers for both.
pub fn try_grip(twin: &Twin, library: &Library, scenario: &Scenario) -> Result<bool, SampleError> {
    let force_n = jaw_forces_n(twin, scenario)?;
    let Some(held) = held(twin, library, scenario, force_n, Mechanics::Reduced)? else { return Ok(false) };
    let press = Indenter::new(twin, library, scenario, &force_n, &held.grasp, SimdLevel::best())?;
    press.contacts().map(|_| true)
}
