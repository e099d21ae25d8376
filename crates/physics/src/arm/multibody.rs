//! The arm link by link, as a multibody of Rapier: six revolute joints, the gripper on the last link, two jaws.
//!
//! Control is in task space, at the grip centre, by an external wrench on the last link; the engine maps it to the
//! joints (`J^T F`). Along the pull it is the force loop's output. The other five directions are held by a spring
//! and damper shaped by the arm's task-space inertia `L = (J M^-1 J^T)^-1` (Khatib 1987):
//!
//! ```text
//! a_s = (1 - d d^T) (-w^2 e - 2 z w v)      across the pull d   (e: error of pose, v: twist)
//! a_d = (F - F_contact - d.L a_s) / L_dd    along the pull, expected
//! wrench = F d + (1 - d d^T) L (a_s + a_d d)
//! ```
//!
//! so every direction has the same bandwidth and a pull does not push the arm sideways. The expected acceleration
//! is not optional: the free arm is 4 times lighter along the pull than the held one (4 kg to 16 kg, since it can
//! give way by pitching), which the force loop's damping would make unstable. Weight is compensated:
//! gravity does not act on the arm. The wrist sensor balances momentum in task space, `F_contact = F - d.L dv/dt`:
//! what d'Alembert's principle leaves of the Newton-Euler equations of all links, with rotors, for a virtual
//! displacement along the pull.

use crate::arm::model::LinkInertia;
use crate::arm::placed::{PlacedArm, gripper_inertia};
use crate::convert::rapier_pose;
use crate::setup::GripSetup;
use crate::world::World;
use gripgen_twin::frames::Pose;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use rapier3d_f64::prelude::{
    GenericJoint, GenericJointBuilder, JointAxesMask, MassProperties, Matrix, MultibodyJointHandle,
    RigidBodyBuilder, RigidBodyHandle, Rotation, Vector,
};
use rapier3d_f64::utils::AngularInertiaOps;

/// Bandwidth of the position control across the pull: 100 N on 20 kg give way by 0.2 mm, if the pads do not hold.
const HOLD_HZ: f64 = 25.0;

/// Largest angular bandwidth times time step: the control is explicit, and unstable near 1.
const HOLD_PER_STEP: f64 = 0.4;

/// Damping ratio of the position control across the pull.
const HOLD_DAMPING: f64 = 1.0;

/// Time constant with which the expected acceleration follows the contact force: unfiltered, pads that rock on a
/// flat face drift before they slip.
const CONTACT_FILTER_S: f64 = 0.02;

/// Travel after which the task-space inertia is computed afresh; it changes by a few percent per centimetre.
const FOLLOW_M: f64 = 1e-3;

/// The arm in the world.
#[derive(Clone)]
pub(crate) struct ArmBodies {
    last: RigidBodyHandle,
    joint: MultibodyJointHandle,
    joints_rad: [f64; 6],
    rotor_inertia_kg_m2: [f64; 6],
    /// Grip centre in the last link.
    last_from_grip: rapier3d_f64::prelude::Pose,
    /// Task-space inertia at the grip centre, and where it was computed.
    inertia: Matrix6<f64>,
    inertia_at: Vector,
    /// Contact force along the pull, filtered.
    contact_n: f64,
}

impl ArmBodies {
    pub(crate) fn build(world: &mut World, setup: &GripSetup<'_>, arm: &PlacedArm) -> Self {
        let mut parent = world.add_body(RigidBodyBuilder::fixed().pose(rapier_pose(&arm.world_from_base)));
        let mut joint = None;
        let links = arm.world_from_links.len();
        let mut last_from_grip = Pose::identity();
        for (i, (part, world_from_link)) in arm.model.joints.iter().zip(&arm.world_from_links).enumerate() {
            let mut inertia = part.inertia;
            if i + 1 == links {
                last_from_grip = world_from_link.inverse();
                inertia = with_gripper(&inertia, setup.gripper.mass_kg, &last_from_grip, arm);
            }
            let body = world.add_body(
                RigidBodyBuilder::dynamic()
                    .pose(rapier_pose(world_from_link))
                    .additional_mass_properties(mass_properties(&inertia))
                    .gravity_scale(0.0),
            );
            let along_x = Rotation::from_rotation_arc(Vector::X, Vector::from_array(part.axis));
            let along_x = rapier3d_f64::prelude::Pose::from_parts(Vector::ZERO, along_x);
            let revolute = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
                .local_frame1(rapier_pose(&part.parent_from_joint) * along_x)
                .local_frame2(along_x);
            joint = world.multibodies.insert(parent, body, revolute.build(), true);
            parent = body;
        }
        Self {
            last: parent,
            joint: joint.expect("a chain of fresh bodies is a tree"),
            joints_rad: arm.stance.joints_rad,
            rotor_inertia_kg_m2: arm.stance.rotor_inertia_kg_m2,
            last_from_grip: rapier_pose(&last_from_grip),
            inertia: Matrix6::identity(),
            inertia_at: Vector::ZERO,
            contact_n: 0.0,
        }
    }

    pub(crate) fn attach_jaw(&self, world: &mut World, jaw: RigidBodyHandle, at: Vector) {
        let along_y = Rotation::from_rotation_arc(Vector::X, Vector::Y);
        let frame = rapier3d_f64::prelude::Pose::from_parts(at, along_y);
        let slide: GenericJoint = GenericJointBuilder::new(JointAxesMask::LOCKED_PRISMATIC_AXES)
            .local_frame1(self.last_from_grip * frame)
            .local_frame2(rapier3d_f64::prelude::Pose::from_parts(Vector::ZERO, along_y))
            .contacts_enabled(false)
            .build();
        world.multibodies.insert(self.last, jaw, slide, true);
    }

    /// Turns the joints to the stance, sets the rotors and computes the inertia.
    pub(crate) fn finish(&mut self, world: &mut World) {
        let World { bodies, colliders, multibodies, .. } = world;
        let Some((arm, _)) = multibodies.get_mut(self.joint) else { return };
        for link in arm.links() {
            bodies[link.rigid_body_handle()].recompute_mass_properties_from_colliders(colliders);
        }
        arm.forward_kinematics(bodies, true);
        let mut angles = vec![0.0; arm.ndofs()];
        angles[..6].copy_from_slice(&self.joints_rad);
        arm.apply_displacements(&angles);
        // The engine's default joint damping would be a force that nobody measures.
        arm.damping_mut().fill(0.0);
        for (i, &inertia) in self.rotor_inertia_kg_m2.iter().enumerate() {
            arm.armature_mut()[i] = inertia;
        }
        arm.forward_kinematics(bodies, false);
        arm.update_rigid_bodies(bodies, true);
        self.measure_inertia(world);
    }

    /// Holds the arm where it began.
    pub(crate) fn hold(&self, world: &mut World, jaws_n: f64) {
        let wrench = self.inertia * self.restoring(world);
        self.apply(world, wrench, jaws_n);
    }

    /// Pulls along `direction` and holds the other directions.
    pub(crate) fn pull(
        &mut self,
        world: &mut World,
        direction: Vector,
        force_n: f64,
        contact_n: f64,
        jaws_n: f64,
    ) {
        let share = -libm::expm1(-world.step_s() / CONTACT_FILTER_S);
        self.contact_n += share * (contact_n - self.contact_n);
        let d = along(direction);
        let mut acceleration = self.restoring(world);
        acceleration -= d * d.dot(&acceleration);
        let expected_n = force_n - self.contact_n - d.dot(&(self.inertia * acceleration));
        acceleration += d * (expected_n / self.mass_kg(direction));
        let mut wrench = self.inertia * acceleration;
        wrench += d * (force_n - d.dot(&wrench));
        self.apply(world, wrench, jaws_n);
    }

    /// Sets what the contact is expected to take along the pull.
    pub(crate) fn expect(&mut self, contact_n: f64) {
        self.contact_n = contact_n;
    }

    pub(crate) fn position(&self, world: &World) -> Vector {
        (*world.bodies[self.last].position() * self.last_from_grip).translation
    }

    pub(crate) fn velocity(&self, world: &World) -> Vector {
        let v = self.twist(world);
        Vector::new(v[0], v[1], v[2])
    }

    pub(crate) fn momentum(&self, world: &World, direction: Vector) -> f64 {
        along(direction).dot(&(self.inertia * self.twist(world)))
    }

    pub(crate) fn mass_kg(&self, direction: Vector) -> f64 {
        let d = along(direction);
        d.dot(&(self.inertia * d))
    }

    pub(crate) fn follow(&mut self, world: &World) {
        if self.position(world).distance_squared(self.inertia_at) > FOLLOW_M * FOLLOW_M {
            self.measure_inertia(world);
        }
    }

    /// Acceleration that takes the grip centre back to where it began.
    fn restoring(&self, world: &World) -> Vector6<f64> {
        let pose = *world.bodies[self.last].position() * self.last_from_grip;
        let q = pose.rotation;
        // At the start the frame of the grip is that of `world`. For small angles the rotation vector is 2 q.
        let turn = Vector::new(q.x, q.y, q.z) * (2.0 * q.w.signum());
        let omega = (std::f64::consts::TAU * HOLD_HZ).min(HOLD_PER_STEP / world.step_s());
        stack(pose.translation, turn) * (-omega * omega) - self.twist(world) * (2.0 * HOLD_DAMPING * omega)
    }

    /// Velocity and rate of turn of the grip centre.
    ///
    /// From the joints: the velocity that Rapier leaves on the bodies of a multibody lacks the last solver
    /// iteration's share of the forces.
    fn twist(&self, world: &World) -> Vector6<f64> {
        let Some((arm, id)) = world.multibodies.get(self.joint) else { return Vector6::zeros() };
        let j = arm.body_jacobian(id);
        let mut twist = Vector6::zeros();
        for (k, &rate) in arm.generalized_velocity().iter().enumerate() {
            twist += j.column(k) * rate;
        }
        let lever = self.position(world) - world.bodies[self.last].center_of_mass();
        let turned = twist.fixed_rows::<3>(3).cross(&Vector3::new(lever.x, lever.y, lever.z));
        let mut linear = twist.fixed_rows_mut::<3>(0);
        linear += turned;
        twist
    }

    fn apply(&self, world: &mut World, wrench: Vector6<f64>, jaws_n: f64) {
        let at = self.position(world);
        let body = &mut world.bodies[self.last];
        body.reset_forces(false);
        body.reset_torques(false);
        // The gripper pushes its jaws, and they push back.
        let force = Vector::new(wrench[0], wrench[1] - jaws_n, wrench[2]);
        body.add_force_at_point(force, at, true);
        body.add_torque(Vector::new(wrench[3], wrench[4], wrench[5]), true);
    }

    /// `L = J^-T M J^-1`, with the jaws carried along.
    fn measure_inertia(&mut self, world: &World) {
        let Some((arm, _)) = world.multibodies.get(self.joint) else { return };
        let mut mass = Matrix6::from_diagonal(&self.rotor_inertia_kg_m2.into());
        let at = self.position(world);
        let mut jacobian = Matrix6::zeros();
        for (id, link) in arm.links().enumerate() {
            let handle = link.rigid_body_handle();
            let body = &world.bodies[handle];
            // Of the centre of mass; the jaws' own columns come after the arm's.
            let j = arm.body_jacobian(id).fixed_view::<6, 6>(0, 0).into_owned();
            let properties = body.mass_properties();
            let tensor = properties.effective_angular_inertia().into_matrix();
            let mut own = Matrix6::from_diagonal_element(if id == 0 { 0.0 } else { body.mass() });
            own.fixed_view_mut::<3, 3>(3, 3).copy_from(&if id == 0 {
                Matrix3::zeros()
            } else {
                from_engine(&tensor)
            });
            mass += j.transpose() * own * j;
            if handle == self.last {
                let lever = at - body.center_of_mass();
                let lever = Vector3::new(lever.x, lever.y, lever.z);
                jacobian = j;
                let turned = lever.cross_matrix() * j.fixed_rows::<3>(3);
                let mut linear = jacobian.fixed_rows_mut::<3>(0);
                linear -= turned;
            }
        }
        // The stance was checked and a pull moves little: the inverse exists.
        if let Some(inverse) = jacobian.try_inverse() {
            self.inertia = inverse.transpose() * mass * inverse;
            self.inertia_at = at;
        }
    }
}

fn stack(a: Vector, b: Vector) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

fn along(direction: Vector) -> Vector6<f64> {
    stack(direction, Vector::ZERO)
}

fn from_engine(m: &Matrix) -> Matrix3<f64> {
    Matrix3::from_fn(|r, c| m.col(c)[r])
}

/// The last link with the gripper, a compact body half-way between tip and grip centre.
fn with_gripper(link: &LinkInertia, mass_kg: f64, last_from_grip: &Pose, arm: &PlacedArm) -> LinkInertia {
    let world = gripper_inertia(mass_kg, arm.stance.tip_to_grip_m);
    let centre_m = (last_from_grip * nalgebra::Point3::from(world.centre_m)).coords;
    let gripper = LinkInertia { centre_m, ..world };
    LinkInertia::sum(&[*link, gripper])
}

fn mass_properties(body: &LinkInertia) -> MassProperties {
    let (c, i) = (body.centre_m, body.about_centre_kg_m2);
    let column = |k: usize| Vector::new(i[(0, k)], i[(1, k)], i[(2, k)]);
    let tensor = Matrix::from_cols(column(0), column(1), column(2));
    MassProperties::with_inertia_matrix(Vector::new(c.x, c.y, c.z), body.mass_kg, tensor)
}
