//! The arm as one body on a rail along the pull.

use crate::convert::{compact, vector};
use crate::setup::GripSetup;
use crate::world::World;
use rapier3d_f64::prelude::{PrismaticJointBuilder, RigidBodyBuilder, RigidBodyHandle, Vector};

/// The carriage: arm and gripper.
#[derive(Clone, Copy)]
pub(crate) struct Carriage {
    pub(crate) body: RigidBodyHandle,
}

impl Carriage {
    pub(crate) fn build(world: &mut World, setup: &GripSetup<'_>) -> Self {
        let base = world.add_body(RigidBodyBuilder::fixed());
        let mass_kg = setup.robot.moving_mass_kg + setup.gripper.mass_kg;
        let carried = RigidBodyBuilder::dynamic().additional_mass_properties(compact(mass_kg));
        let body = world.add_body(carried.gravity_scale(0.0));
        world.joints.insert(base, body, PrismaticJointBuilder::new(vector(setup.direction)), true);
        Self { body }
    }

    pub(crate) fn attach_jaw(&self, world: &mut World, jaw: RigidBodyHandle, at: Vector) {
        let slide = PrismaticJointBuilder::new(Vector::Y).local_anchor1(at).contacts_enabled(false);
        world.joints.insert(self.body, jaw, slide, true);
    }

    pub(crate) fn pull(&self, world: &mut World, direction: Vector, force_n: f64) {
        let carriage = &mut world.bodies[self.body];
        carriage.reset_forces(false);
        carriage.add_force(direction * force_n, true);
    }

    pub(crate) fn momentum(&self, world: &World, direction: Vector, [l, r]: [RigidBodyHandle; 2]) -> f64 {
        [self.body, l, r]
            .into_iter()
            .map(|h| world.bodies[h].mass() * world.bodies[h].linvel().dot(direction))
            .sum()
    }

    pub(crate) fn mass_kg(&self, world: &World, jaws: [RigidBodyHandle; 2]) -> f64 {
        let [l, r] = jaws.map(|h| world.bodies[h].mass());
        world.bodies[self.body].mass() + l + r
    }
}
