//! A pull under way.

#[cfg(test)]
use crate::contact::ContactForce;
use crate::force_loop::ForceLoop;
use crate::scene::Rig;
use crate::world::World;
use gripgen_twin::random::Stream;
use gripgen_twin::{PerJaw, Robot, Wrist};
use rapier3d_f64::prelude as rapier;

/// Speed above which jaws at their limit count as sliding, so that kinetic friction acts.
const SLIDING_M_PER_S: f64 = 1e-4;

/// Share of the jaws' static limits that the contact has to carry before they can slide: motion under less is gel
/// shear and the engine's own pre-slip drift, however fast the force rises.
const AT_LIMIT: f64 = 0.99;

/// Speed below which sliding jaws stick again.
const STICKING_M_PER_S: f64 = 1e-5;

/// Bandwidth of the position loop behind velocity commands.
const VELOCITY_BANDWIDTH_HZ: f64 = 5.0;

/// What the arm is told to do along the pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Pull with this force.
    ForceN(f64),
    /// Move with this speed.
    SpeedMPerS(f64),
}

/// What one jaw can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JawFriction {
    /// Largest tangential force before the jaw slips: the friction law summed over its contact patch.
    pub limit_n: f64,
    /// Kinetic over static friction.
    pub kinetic_ratio: f64,
}

/// The pull after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullState {
    /// Time since the start of the pull.
    pub time_s: f64,
    /// Force that the part exerts on the gripper against the pull.
    pub contact_force_n: f64,
    /// The same as the wrist sensor reports it.
    pub measured_force_n: f64,
    /// Displacement of the tool along the pull.
    pub displacement_m: f64,
    /// Speed of the jaws along the pull.
    pub speed_m_per_s: f64,
    /// Whether the jaws slide on the part.
    pub sliding: bool,
}

/// A pull that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{bodies} bodies became non-finite {time_s:.3} s into the pull")]
pub struct PullError {
    /// Bodies concerned.
    pub bodies: usize,
    /// Time since the start of the pull.
    pub time_s: f64,
}

/// What a grip hands over to a pull.
pub(crate) struct SessionStart {
    pub(crate) world: World,
    pub(crate) rig: Rig,
    pub(crate) robot: Robot,
    pub(crate) wrist: Wrist,
    pub(crate) jaw_mass_kg: f64,
    pub(crate) grip_force_n: PerJaw<f64>,
    pub(crate) direction: rapier::Vector,
    pub(crate) shear_stiffness_n_per_m: f64,
    pub(crate) normal_force_n: PerJaw<f64>,
}

/// A pull under way. `Send` and `Clone`: a clone continues exactly as the original would.
#[derive(Clone)]
pub struct PullSession {
    world: World,
    rig: Rig,
    robot: Robot,
    wrist: Wrist,
    jaw_mass_kg: f64,
    grip_force_n: PerJaw<f64>,
    direction: rapier::Vector,
    shear_stiffness_n_per_m: f64,
    /// Static friction coefficient of each pad: its limit over its settled normal force.
    pad_friction: PerJaw<f64>,
    /// What both jaws hold together before they slip.
    limit_n: f64,
    kinetic_ratio: PerJaw<f64>,
    control: ForceLoop,
    noise: Stream,
    start: rapier::Vector,
    /// Where a velocity command wants the carriage to be.
    target_m: Option<f64>,
    momentum_n_s: f64,
    refresh_contacts: bool,
    has_slid: bool,
    state: PullState,
}

impl PullSession {
    pub(crate) fn new(start: SessionStart, friction: &PerJaw<JawFriction>, noise: Stream) -> Self {
        let SessionStart { mut world, rig, robot, wrist, jaw_mass_kg, grip_force_n, direction, .. } = start;
        rig.release_part(&mut world);
        let mut session = Self {
            momentum_n_s: rig.momentum(&world, direction),
            start: world.bodies[rig.carriage].translation(),
            world,
            rig,
            robot,
            wrist,
            jaw_mass_kg,
            grip_force_n,
            direction,
            shear_stiffness_n_per_m: start.shear_stiffness_n_per_m,
            pad_friction: friction.map(|jaw, f| f.limit_n / start.normal_force_n[jaw]),
            limit_n: friction.left.limit_n + friction.right.limit_n,
            kinetic_ratio: friction.map(|_, f| f.kinetic_ratio),
            control: ForceLoop::new(robot),
            noise,
            target_m: None,
            refresh_contacts: false,
            has_slid: false,
            state: PullState {
                time_s: 0.0,
                contact_force_n: 0.0,
                measured_force_n: 0.0,
                displacement_m: 0.0,
                speed_m_per_s: 0.0,
                sliding: false,
            },
        };
        session.state.measured_force_n = session.reading(0.0);
        session.write_friction();
        session
    }

    /// The state after the last step.
    pub fn state(&self) -> PullState {
        self.state
    }

    /// Whether the jaws have slid on the part since the start of the pull.
    pub fn has_slid(&self) -> bool {
        self.has_slid
    }

    /// Readings of the wrist sensor per second; the time between two of them is the natural step.
    pub fn rate_hz(&self) -> f64 {
        self.wrist.rate_hz
    }

    /// Carries out `command` for `duration_s`, in steps no longer than the sensor's.
    pub fn step(&mut self, command: Command, duration_s: f64) -> Result<PullState, PullError> {
        let steps = (duration_s / self.wrist.step_s() - 1e-6).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.tick(command, duration_s / steps)?;
        }
        Ok(self.state)
    }

    /// Normal force, friction and penetration of each pad, read back from the engine.
    #[cfg(test)]
    pub(crate) fn contact_forces(&self) -> PerJaw<ContactForce> {
        PerJaw::from_fn(|jaw| self.rig.contact(&self.world, jaw))
    }

    fn tick(&mut self, command: Command, step_s: f64) -> Result<(), PullError> {
        let before = &self.state;
        let mass_kg = self.arm_mass_kg();
        let applied_n = match command {
            Command::ForceN(desired_n) => {
                self.target_m = None;
                let force = self.control.advance(
                    before.time_s,
                    step_s,
                    desired_n,
                    before.measured_force_n,
                    before.contact_force_n,
                );
                force - self.robot.damping_n_s_per_m * before.speed_m_per_s
            }
            Command::SpeedMPerS(speed) => {
                let speed = speed.clamp(-self.robot.speed_limit_m_per_s, self.robot.speed_limit_m_per_s);
                let position = self.carriage_position_m();
                let target = self.target_m.unwrap_or(position) + speed * step_s;
                self.target_m = Some(target);
                // A critically damped position loop, with the contact force fed forward.
                let omega = std::f64::consts::TAU * VELOCITY_BANDWIDTH_HZ;
                let force = before.contact_force_n
                    + mass_kg
                        * (omega * omega * (target - position)
                            + 2.0 * omega * (speed - before.speed_m_per_s));
                self.control.take_over(force);
                force
            }
        };
        self.rig.close_jaws(&mut self.world, &self.grip_force_n, self.jaw_mass_kg);
        let carriage = &mut self.world.bodies[self.rig.carriage];
        carriage.reset_forces(false);
        carriage.add_force(self.direction * applied_n, true);
        let refresh = std::mem::take(&mut self.refresh_contacts);
        self.world
            .step(step_s, refresh)
            .map_err(|e| PullError { bodies: e.bodies, time_s: self.state.time_s })?;
        self.observe(applied_n, step_s);
        Ok(())
    }

    /// Reads sensor and displacement after a step.
    ///
    /// The wrist sensor is a balance of momentum: what the arm applied and did not become momentum went into the
    /// contact. Weight and inertia of the gripper are compensated, as by a robot that knows its payload.
    fn observe(&mut self, applied_n: f64, step_s: f64) {
        let momentum = self.rig.momentum(&self.world, self.direction);
        let contact_force_n = applied_n - (momentum - self.momentum_n_s) / step_s;
        self.momentum_n_s = momentum;
        let speed_m_per_s = self.world.bodies[self.rig.carriage].linvel().dot(self.direction);
        let was_sliding = self.state.sliding;
        let speed = speed_m_per_s.abs();
        let sliding = if was_sliding {
            speed > STICKING_M_PER_S
        } else {
            speed > SLIDING_M_PER_S && contact_force_n.abs() >= AT_LIMIT * self.limit_n
        };
        self.has_slid |= sliding;
        self.state = PullState {
            time_s: self.state.time_s + step_s,
            contact_force_n,
            measured_force_n: self.reading(contact_force_n),
            displacement_m: self.carriage_position_m() + contact_force_n / self.shear_stiffness_n_per_m,
            speed_m_per_s,
            sliding,
        };
        if sliding != was_sliding && self.kinetic_ratio.iter().any(|(_, &ratio)| ratio != 1.0) {
            self.write_friction();
        }
    }

    /// What the wrist sensor reports for a force.
    fn reading(&mut self, force_n: f64) -> f64 {
        if self.wrist.noise_n == 0.0 {
            return force_n;
        }
        force_n + self.wrist.noise_n * self.noise.normal()
    }

    /// Hands the jaws' friction to the engine. It acts from the next step on, which rebuilds all contacts.
    fn write_friction(&mut self) {
        for (jaw, &pad) in self.rig.pads.iter() {
            let ratio = if self.state.sliding { self.kinetic_ratio[jaw] } else { 1.0 };
            self.world.colliders[pad].set_friction(self.pad_friction[jaw] * ratio);
        }
        self.refresh_contacts = true;
    }

    fn carriage_position_m(&self) -> f64 {
        (self.world.bodies[self.rig.carriage].translation() - self.start).dot(self.direction)
    }

    fn arm_mass_kg(&self) -> f64 {
        let [l, r] = [self.rig.jaws.left, self.rig.jaws.right].map(|h| self.world.bodies[h].mass());
        self.world.bodies[self.rig.carriage].mass() + l + r
    }
}
