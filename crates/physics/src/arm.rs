//! What carries the gripper: a carriage on one rail, or a robot arm.
//!
//! Both take the same pull and give the same answers: where the tool is, how fast it moves, and how much momentum
//! along the pull they hold. What the arm applies and does not become momentum went into the contact.

mod carriage;
mod model;
mod multibody;
mod placed;
#[cfg(test)]
pub(crate) mod tests;

pub use model::{ArmJoint, ArmMesh, ArmModel, LinkInertia, UrdfError};
pub use placed::{ArmError, PlacedArm};

use crate::setup::{Arm, GripSetup};
use crate::world::World;
use carriage::Carriage;
use multibody::ArmBodies;
use rapier3d_f64::prelude::{RigidBodyHandle, Vector};

/// The arm's part of the scene.
#[derive(Clone)]
pub(crate) enum ArmRig {
    Carriage(Carriage),
    Multibody(Box<ArmBodies>),
}

impl ArmRig {
    pub(crate) fn build(world: &mut World, setup: &GripSetup<'_>) -> Self {
        match setup.arm {
            Arm::Carriage => Self::Carriage(Carriage::build(world, setup)),
            Arm::Multibody(arm) => Self::Multibody(Box::new(ArmBodies::build(world, setup, arm))),
        }
    }

    /// Hangs a jaw on the arm, free to move along the jaw axis. `at` is where it is in `world`.
    pub(crate) fn attach_jaw(&mut self, world: &mut World, jaw: RigidBodyHandle, at: Vector) {
        match self {
            Self::Carriage(carriage) => carriage.attach_jaw(world, jaw, at),
            Self::Multibody(arm) => arm.attach_jaw(world, jaw, at),
        }
    }

    /// Once both jaws hang on it.
    pub(crate) fn finish(&mut self, world: &mut World) {
        if let Self::Multibody(arm) = self {
            arm.finish(world);
        }
    }

    /// Takes the forces of the last step off the arm and keeps it where it is while the jaws close.
    /// `jaws_n` is the force along the jaw axis with which it pushes the jaws.
    pub(crate) fn hold(&self, world: &mut World, jaws_n: f64) {
        if let Self::Multibody(arm) = self {
            arm.hold(world, jaws_n);
        }
    }

    /// Pulls with a force along `direction` for the next step. `contact_n` is what the contact took last.
    pub(crate) fn pull(
        &mut self,
        world: &mut World,
        direction: Vector,
        force_n: f64,
        contact_n: f64,
        jaws_n: f64,
    ) {
        match self {
            Self::Carriage(carriage) => carriage.pull(world, direction, force_n),
            Self::Multibody(arm) => arm.pull(world, direction, force_n, contact_n, jaws_n),
        }
    }

    /// Says what the contact takes along the pull, at once.
    pub(crate) fn expect(&mut self, contact_n: f64) {
        if let Self::Multibody(arm) = self {
            arm.expect(contact_n);
        }
    }

    /// Where the tool is.
    pub(crate) fn position(&self, world: &World) -> Vector {
        match self {
            Self::Carriage(carriage) => world.bodies[carriage.body].translation(),
            Self::Multibody(arm) => arm.position(world),
        }
    }

    /// How fast the tool moves.
    pub(crate) fn velocity(&self, world: &World) -> Vector {
        match self {
            Self::Carriage(carriage) => world.bodies[carriage.body].linvel(),
            Self::Multibody(arm) => arm.velocity(world),
        }
    }

    /// Velocity along the jaw axis against which a closing jaw is damped.
    pub(crate) fn jaw_reference_velocity(&self, world: &World) -> f64 {
        match self {
            // The carriage's motion has no component along the jaws.
            Self::Carriage(_) => 0.0,
            Self::Multibody(arm) => arm.velocity(world).y,
        }
    }

    /// Momentum along `direction` of the arm with the jaws.
    pub(crate) fn momentum(&self, world: &World, direction: Vector, jaws: [RigidBodyHandle; 2]) -> f64 {
        match self {
            Self::Carriage(carriage) => carriage.momentum(world, direction, jaws),
            Self::Multibody(arm) => arm.momentum(world, direction),
        }
    }

    /// Mass that a force along `direction` accelerates.
    pub(crate) fn mass_kg(&self, world: &World, direction: Vector, jaws: [RigidBodyHandle; 2]) -> f64 {
        match self {
            Self::Carriage(carriage) => carriage.mass_kg(world, jaws),
            Self::Multibody(arm) => arm.mass_kg(direction),
        }
    }

    /// Follows the change of the arm's inertia with its pose. Call before a momentum that differences start from.
    pub(crate) fn follow(&mut self, world: &World) {
        if let Self::Multibody(arm) = self {
            arm.follow(world);
        }
    }
}
