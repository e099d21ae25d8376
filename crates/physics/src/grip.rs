//! Closing the jaws on a part.

use crate::convert::vector;
use crate::jaw_friction::JawFriction;
use crate::rapier_pull::{RapierPull, RapierStart};
use crate::reduced::ReducedPull;
use crate::scene::{SceneBodies, build};
use crate::session::{PullMechanics, PullSession, Signals};
use crate::setup::{Arm, GripError, GripSetup, Mount};
use crate::touch::{Touch, touch};
use crate::world::World;
use gripgen_twin::config::Mechanics;
use gripgen_twin::frames::world_from_gel;
use gripgen_twin::{Gel, Grasp, Jaw, PerJaw, Robot, Wrist};

/// A grip has settled when each jaw's normal force is this close to the grip force, as a fraction.
const SETTLED_FRACTION: f64 = 1e-4;

/// Shortest and longest time a grip settles.
const SETTLE_S: (f64, f64) = (0.1, 2.0);

/// What became of a grip.
pub enum Grip {
    /// Both jaws hold the part.
    Held(Box<Held>),
    /// The jaws met without both touching the part.
    NoContact,
}

/// A part held by settled jaws.
#[derive(Clone)]
pub struct Held {
    /// Where the part lies in each gel and how hard each jaw presses.
    pub grasp: Grasp,
    robot: Robot,
    wrist: Wrist,
    start: Start,
}

#[derive(Clone)]
enum Start {
    Rapier(Box<RapierStart>),
    Reduced { mass_kg: f64, gel: Box<PerJaw<Gel>> },
}

/// Closes the jaws on the part and lets them settle, without friction.
///
/// Without an engine the jaws stop where they first touch the part and press with their commanded force.
///
/// # Errors
///
/// A part wider than the open gripper, jaws that do not settle, a contact shape that cannot be gripped, or bodies that
/// become non-finite.
pub fn grip(setup: &GripSetup<'_>) -> Result<Grip, GripError> {
    let Some(Touch { distance_m: touch, shape }) = touch(setup)? else { return Ok(Grip::NoContact) };
    if setup.mechanics == Mechanics::Reduced {
        return Ok(Grip::Held(Box::new(Held {
            grasp: grasp(setup, &touch, setup.grip_force_n),
            robot: setup.robot,
            wrist: setup.wrist,
            start: Start::Reduced {
                mass_kg: setup.robot.apparent_mass_kg.unwrap_or_else(|| match setup.arm {
                    Arm::Carriage => setup.robot.carriage_mass_kg(&setup.gripper),
                    Arm::Multibody(arm) => arm.held_mass_kg(&setup.gripper, setup.direction),
                }),
                gel: Box::new(setup.gel.clone()),
            },
        })));
    }
    let gravity_m_per_s2 = match setup.mount {
        Mount::Fixed => 0.0,
        Mount::Free { gravity_m_per_s2, .. } => gravity_m_per_s2,
    };
    let mut world = World::new(setup.wrist.step_s(), gravity_m_per_s2);
    let rig = build(&mut world, setup, &touch, &shape.contact_shape(setup, &touch));
    settle(&mut world, &rig, setup)?;
    let distance = PerJaw::from_fn(|jaw| {
        let centre = world.bodies[rig.jaws[jaw]].translation().y * jaw.side();
        centre - setup.gel[jaw].thickness_m / 2.0
    });
    let grasp = grasp(setup, &distance, PerJaw::from_fn(|jaw| rig.contact(&world, jaw).normal_n));
    let start = RapierStart {
        world,
        rig,
        jaw_mass_kg: setup.gripper.jaw_mass_kg,
        grip_force_n: setup.grip_force_n,
        direction: vector(setup.direction),
        shear_stiffness_n_per_m: setup.gel.left.shear_stiffness_n_per_m
            + setup.gel.right.shear_stiffness_n_per_m,
        normal_force_n: grasp.normal_force_n,
        fixed: matches!(setup.mount, Mount::Fixed),
    };
    let (robot, wrist, start) = (setup.robot, setup.wrist, Start::Rapier(Box::new(start)));
    Ok(Grip::Held(Box::new(Held { grasp, robot, wrist, start })))
}

/// The grasp of gels whose surfaces stand at these distances from the grip centre.
fn grasp(setup: &GripSetup<'_>, distance_m: &PerJaw<f64>, normal_force_n: PerJaw<f64>) -> Grasp {
    let gel_from_part = distance_m.map(|jaw, &d| world_from_gel(jaw, d).inverse() * setup.world_from_part);
    Grasp { gel_from_part, normal_force_n }
}

impl Held {
    /// Starts a pull. `friction` is what each jaw can hold, `signals` what arm and sensor make of the mechanics.
    pub fn pull(self, friction: &PerJaw<JawFriction>, signals: impl Into<Signals>) -> PullSession {
        let plant = match self.start {
            Start::Rapier(start) => PullMechanics::Rapier(Box::new(RapierPull::new(*start, friction))),
            Start::Reduced { mass_kg, gel } => {
                PullMechanics::Reduced(Box::new(ReducedPull::new(mass_kg, &gel, friction)))
            }
        };
        PullSession::new(plant, self.robot, self.wrist, friction, signals.into())
    }
}

/// Lets the jaws close until each presses with its force.
fn settle(world: &mut World, rig: &SceneBodies, setup: &GripSetup<'_>) -> Result<(), GripError> {
    let step_s = setup.wrist.step_s();
    let mut time_s = 0.0;
    loop {
        let jaws_n = rig.close_jaws(world, &setup.grip_force_n, setup.gripper.jaw_mass_kg);
        rig.arm.hold(world, jaws_n);
        world.step(step_s, false).map_err(|e| GripError::NotFinite { bodies: e.bodies, time_s })?;
        time_s += step_s;
        if time_s < SETTLE_S.0 {
            continue;
        }
        let off = PerJaw::from_fn(|jaw| {
            // Along the jaw axis: on tilted contacts the sum of the magnitudes is larger than the grip force.
            let body = &world.bodies[rig.jaws[jaw]];
            let acceleration_n = body.linvel().y.abs() * setup.gripper.jaw_mass_kg / step_s;
            let normal = rig.contact(world, jaw).normal_n;
            let missing = (setup.grip_force_n[jaw] - normal).max(0.0);
            (missing.max(acceleration_n) / setup.grip_force_n[jaw], normal)
        });
        if off.iter().all(|(_, &(off, _))| off <= SETTLED_FRACTION) {
            return Ok(());
        }
        if time_s > SETTLE_S.1 {
            let jaw = if off.left.0 >= off.right.0 { Jaw::Left } else { Jaw::Right };
            return Err(GripError::NotSettled {
                jaw,
                normal_n: off[jaw].1,
                wanted_n: setup.grip_force_n[jaw],
                time_s: SETTLE_S.1,
            });
        }
    }
}
