//! The bodies of a grip: part, arm, jaws and pads.

use crate::arm::ArmRig;
use crate::contact::{ContactForce, contact_force};
use crate::convert::{compact, rapier_pose};
use crate::setup::{GripSetup, Mount};
use crate::world::World;
use gripgen_twin::{Gel, Jaw, PerJaw};
use rapier3d_f64::prelude as rapier;
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, ColliderHandle, LockedAxes, RigidBodyBuilder, RigidBodyHandle,
    Shape, SharedShape,
};

/// Damping of a closing jaw, per jaw mass: a jaw comes to rest within a few hundredths of a second.
const CLOSING_DAMPING_PER_S: f64 = 100.0;

/// Gap between pad and part from which a jaw closes under force.
const CLOSING_GAP_M: f64 = 0.2e-3;

/// The bodies of the scene.
#[derive(Clone)]
pub(crate) struct SceneBodies {
    part: RigidBodyHandle,
    part_shape: ColliderHandle,
    pub(crate) arm: ArmRig,
    pub(crate) jaws: PerJaw<RigidBodyHandle>,
    pub(crate) pads: PerJaw<ColliderHandle>,
}

impl SceneBodies {
    /// Lets a free part go, once the jaws have friction to hold it.
    pub(crate) fn release_part(&self, world: &mut World) {
        let part = &mut world.bodies[self.part];
        part.set_locked_axes(LockedAxes::empty(), true);
        part.set_gravity_scale(1.0, true);
    }

    /// Pushes both jaws inwards. Returns the sum of the two forces along the jaw axis, for the arm to bear.
    pub(crate) fn close_jaws(&self, world: &mut World, grip_force_n: &PerJaw<f64>, jaw_mass_kg: f64) -> f64 {
        let reference = self.arm.jaw_reference_velocity(world);
        let mut sum = 0.0;
        for (jaw, handle) in self.jaws.iter() {
            let body = &mut world.bodies[*handle];
            let damping = CLOSING_DAMPING_PER_S * jaw_mass_kg * (body.linvel().y - reference);
            body.reset_forces(false);
            let force = -jaw.side() * grip_force_n[jaw] - damping;
            body.add_force(rapier::Vector::new(0.0, force, 0.0), true);
            sum += force;
        }
        sum
    }

    /// What the contact between a jaw's pad and the part carries.
    pub(crate) fn contact(&self, world: &World, jaw: Jaw) -> ContactForce {
        contact_force(world, self.pads[jaw], self.part_shape)
    }

    /// Momentum along `direction` of all that hangs on the arm, and of the arm.
    pub(crate) fn momentum(&self, world: &World, direction: rapier::Vector) -> f64 {
        self.arm.momentum(world, direction, self.jaw_bodies())
    }

    /// Mass that a pull along `direction` accelerates.
    pub(crate) fn arm_mass_kg(&self, world: &World, direction: rapier::Vector) -> f64 {
        self.arm.mass_kg(world, direction, self.jaw_bodies())
    }

    fn jaw_bodies(&self) -> [RigidBodyHandle; 2] {
        [self.jaws.left, self.jaws.right]
    }
}

/// Puts part, arm, jaws and pads into the world; the jaws stand [`CLOSING_GAP_M`] off the part.
pub(crate) fn build(
    world: &mut World,
    setup: &GripSetup<'_>,
    touch: &PerJaw<f64>,
    shape: &SharedShape,
) -> SceneBodies {
    // The pads alone carry friction: the larger of the two coefficients of a pair counts, the part's is 0.
    let part_collider = ColliderBuilder::new(shape.clone())
        .friction(0.0)
        .friction_combine_rule(CoefficientCombineRule::Max)
        .density(0.0);
    let pose = rapier_pose(&setup.world_from_part);
    let part = match setup.mount {
        Mount::Fixed => RigidBodyBuilder::fixed().pose(pose),
        Mount::Free { mass_kg, .. } => {
            // Held in place while the jaws close, which they do without friction.
            let everything = LockedAxes::TRANSLATION_LOCKED | LockedAxes::ROTATION_LOCKED;
            let body = RigidBodyBuilder::dynamic().pose(pose).gravity_scale(0.0);
            body.additional_mass_properties(compact(mass_kg)).locked_axes(everything)
        }
    };
    let part = world.add_body(part);
    let part_shape = world.add_collider(part_collider, part);

    let mut arm = ArmRig::build(world, setup);
    let mut pads = Vec::with_capacity(2);
    let jaws = PerJaw::from_fn(|jaw| {
        let gel = &setup.gel[jaw];
        let y = jaw.side() * (touch[jaw] + CLOSING_GAP_M + gel.thickness_m / 2.0);
        let at = rapier::Vector::new(0.0, y, 0.0);
        // The arm carries the weight of all that belongs to it.
        let jaw_body = RigidBodyBuilder::dynamic()
            .additional_mass_properties(compact(setup.gripper.jaw_mass_kg))
            .gravity_scale(0.0);
        let body = world.add_body(jaw_body.translation(at));
        arm.attach_jaw(world, body, at);
        let half = pad_half_extents(gel);
        let pad = ColliderBuilder::cuboid(half.x, half.y, half.z)
            .friction(0.0)
            .friction_combine_rule(CoefficientCombineRule::Max)
            .density(0.0);
        pads.push(world.add_collider(pad, body));
        body
    });
    arm.finish(world);
    SceneBodies { part, part_shape, arm, jaws, pads: PerJaw { left: pads[0], right: pads[1] } }
}

/// Half sides of a pad: the gel's width along x, its thickness along the jaw axis, its height along z.
fn pad_half_extents(gel: &Gel) -> rapier::Vector {
    rapier::Vector::new(gel.width_m / 2.0, gel.thickness_m / 2.0, gel.height_m / 2.0)
}

pub(crate) fn pad_shape(gel: &Gel) -> impl Shape + use<> {
    rapier::Cuboid::new(pad_half_extents(gel))
}
