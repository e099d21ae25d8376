//! A pull under way: force loop and wrist sensor around one of the mechanics.

#[cfg(test)]
use crate::contact::ContactForce;
use crate::force_loop::{ForceLoop, Motion};
use crate::jaw_friction::JawFriction;
use crate::rapier_pull::RapierPull;
use crate::reduced::ReducedPull;
use crate::world::NotFinite;
use gripgen_twin::effects::{CommandChain, Creep, SensorChain};
use gripgen_twin::random::Stream;
use gripgen_twin::{PerJaw, Robot, Wrist};

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

/// What stands between the mechanics and the numbers that the arm is told and reports.
#[derive(Debug, Clone)]
pub struct Signals {
    /// Noise of the wrist sensor.
    pub noise: Stream,
    /// Effects on the wrist sensor, before its noise.
    pub sensor: SensorChain,
    /// Effects on the command of the force loop.
    pub command: CommandChain,
    /// How the tool creeps under the contact force, in series with the mechanics.
    pub creep: Creep,
}

impl From<Stream> for Signals {
    /// Noise alone.
    fn from(noise: Stream) -> Self {
        Self {
            noise,
            sensor: SensorChain::default(),
            command: CommandChain::default(),
            creep: Creep::default(),
        }
    }
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
    /// Speed of the tool along the pull: of the jaws, and of what creeps.
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

/// What moves when the arm pulls: one file each.
#[derive(Clone)]
pub(crate) enum PullMechanics {
    Rapier(Box<RapierPull>),
    Reduced(Box<ReducedPull>),
}

impl PullMechanics {
    fn mass_kg(&self) -> f64 {
        match self {
            PullMechanics::Rapier(pull) => pull.mass_kg(),
            PullMechanics::Reduced(pull) => pull.mass_kg(),
        }
    }

    /// The force to apply for a tool that answers `free_n` as one of `apparent_mass_kg` does. The reduced arm has that mass.
    fn answering_n(&self, free_n: f64, apparent_mass_kg: f64) -> f64 {
        match self {
            PullMechanics::Rapier(pull) => pull.answering_n(free_n, apparent_mass_kg),
            PullMechanics::Reduced(_) => free_n,
        }
    }

    fn position_m(&self) -> f64 {
        match self {
            PullMechanics::Rapier(pull) => pull.position_m(),
            PullMechanics::Reduced(pull) => pull.position_m(),
        }
    }

    fn advance(&mut self, applied_n: f64, step_s: f64) -> Result<Motion, NotFinite> {
        match self {
            PullMechanics::Rapier(pull) => pull.advance(applied_n, step_s),
            PullMechanics::Reduced(pull) => pull.advance(applied_n, step_s),
        }
    }
}

/// A pull under way. `Send` and `Clone`: a clone continues exactly as the original would.
#[derive(Clone)]
pub struct PullSession {
    plant: PullMechanics,
    robot: Robot,
    wrist: Wrist,
    control: ForceLoop,
    signals: Signals,
    /// Where a velocity command wants the tool to be.
    target_m: Option<f64>,
    limit_n: f64,
    has_slid: bool,
    /// Way that the tool has crept.
    crept_m: f64,
    /// The speed of that without what the rim adds, as the damping of the arm feels it.
    felt_m_per_s: f64,
    /// Noise of the last reading, in its standard deviations; `None` before the first.
    last_noise: Option<f64>,
    state: PullState,
}

impl PullSession {
    pub(crate) fn new(
        plant: PullMechanics,
        robot: Robot,
        wrist: Wrist,
        friction: &PerJaw<JawFriction>,
        signals: Signals,
    ) -> Self {
        let mut session = Self {
            plant,
            robot,
            wrist,
            control: ForceLoop::new(robot),
            signals,
            target_m: None,
            limit_n: friction.left.limit_n() + friction.right.limit_n(),
            has_slid: false,
            crept_m: 0.0,
            felt_m_per_s: 0.0,
            last_noise: None,
            state: PullState {
                time_s: 0.0,
                contact_force_n: 0.0,
                measured_force_n: 0.0,
                displacement_m: 0.0,
                speed_m_per_s: 0.0,
                sliding: false,
            },
        };
        session.state.measured_force_n = session.reading(0.0, 0.0, 0.0);
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

    /// How far the tool has crept.
    pub(crate) fn crept_m(&self) -> f64 {
        self.crept_m
    }

    /// What the wrist sensor can report at most, as long as the jaws obey their static limits; nothing is known of a
    /// sensor with effects.
    pub(crate) fn largest_reading_n(&self) -> f64 {
        match self.signals.sensor.is_identity() {
            true => self.limit_n + LARGEST_NORMAL * self.wrist.noise_n,
            false => f64::INFINITY,
        }
    }

    /// Readings of the wrist sensor per second; the time between two of them is the natural step.
    pub fn rate_hz(&self) -> f64 {
        self.wrist.rate_hz
    }

    /// Carries out `command` for `duration_s`, in steps no longer than the sensor's.
    ///
    /// # Errors
    ///
    /// Bodies that become non-finite.
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
        let PullMechanics::Rapier(pull) = &self.plant else { panic!("only the engine has contacts") };
        PerJaw::from_fn(|jaw| pull.contact(jaw))
    }

    /// Mass that moves along the pull.
    #[cfg(test)]
    pub(crate) fn mass_kg(&self) -> f64 {
        self.plant.mass_kg()
    }

    /// Lets the engine act from the start of the pull.
    #[cfg(test)]
    pub(crate) fn begin_engine(&mut self) {
        if let PullMechanics::Rapier(pull) = &mut self.plant {
            pull.begin_engine();
        }
    }

    /// Where the tool is, relative to the start of the pull.
    #[cfg(test)]
    pub(crate) fn tool_travel_m(&self) -> rapier3d_f64::prelude::Vector {
        let PullMechanics::Rapier(pull) = &self.plant else { panic!("only the engine has a tool in space") };
        pull.tool_travel_m()
    }

    fn tick(&mut self, command: Command, step_s: f64) -> Result<(), PullError> {
        let before = &self.state;
        let applied_n = match command {
            Command::ForceN(desired_n) => {
                self.target_m = None;
                let desired_n = self.signals.command.apply(desired_n, before.measured_force_n);
                let force = self.control.advance(
                    before.time_s,
                    step_s,
                    desired_n,
                    before.measured_force_n,
                    before.contact_force_n,
                );
                let free_n = force - self.robot.damping_n_s_per_m * before.speed_m_per_s;
                self.robot.apparent_mass_kg.map_or(free_n, |mass_kg| self.plant.answering_n(free_n, mass_kg))
            }
            Command::SpeedMPerS(speed) => {
                let speed = speed.clamp(-self.robot.speed_limit_m_per_s, self.robot.speed_limit_m_per_s);
                let position = self.plant.position_m() + self.crept_m;
                let target = self.target_m.unwrap_or(position) + speed * step_s;
                self.target_m = Some(target);
                // A critically damped position loop, with the contact force fed forward.
                let omega = std::f64::consts::TAU * VELOCITY_BANDWIDTH_HZ;
                let force = before.contact_force_n
                    + self.plant.mass_kg()
                        * (omega * omega * (target - position)
                            + 2.0 * omega * (speed - before.speed_m_per_s));
                self.control.take_over(force);
                force
            }
        };
        let time_s = self.state.time_s;
        let motion =
            self.plant.advance(applied_n, step_s).map_err(|e| PullError { bodies: e.bodies, time_s })?;
        self.has_slid |= motion.sliding;
        self.creep(if motion.sliding { 0.0 } else { motion.contact_force_n }, step_s);
        self.state = PullState {
            time_s: time_s + step_s,
            contact_force_n: motion.contact_force_n,
            measured_force_n: self.reading(motion.contact_force_n, time_s + step_s, step_s),
            displacement_m: motion.displacement_m + self.crept_m,
            speed_m_per_s: motion.speed_m_per_s + self.felt_m_per_s,
            sliding: motion.sliding,
        };
        Ok(())
    }

    /// Creeps under a force that the jaws hold. A contact without mass answers at once, and a damper that felt the speed of the step before
    /// would drive it to and fro: what it feels is implicit in the force.
    fn creep(&mut self, held_n: f64, step_s: f64) {
        let creep = self.signals.creep;
        if creep.rate_m_per_n_s == 0.0 {
            return;
        }
        let slope = self.robot.damping_n_s_per_m * creep.rate_m_per_n_s;
        self.felt_m_per_s += (creep.rate_m_per_n_s * held_n - self.felt_m_per_s) / (1.0 + slope);
        self.crept_m += creep.speed_m_per_s(held_n, self.limit_n) * step_s;
    }

    /// What the wrist sensor reports for a force: a balance of momentum behind it, weight and inertia of the gripper
    /// compensated, as by a robot that knows its payload.
    fn reading(&mut self, force_n: f64, time_s: f64, step_s: f64) -> f64 {
        let force_n = self.signals.sensor.read(force_n, time_s, step_s);
        if self.wrist.noise_n == 0.0 {
            return force_n;
        }
        force_n + self.wrist.noise_n * self.noise(step_s)
    }

    /// Noise of unit variance: white, or a first-order autoregression that forgets with the time constant of the sensor.
    fn noise(&mut self, step_s: f64) -> f64 {
        let own = self.signals.noise.normal();
        if self.wrist.noise_time_s == 0.0 {
            return own;
        }
        let noise = match self.last_noise {
            None => own,
            Some(last) => {
                let kept = libm::exp(-step_s / self.wrist.noise_time_s);
                kept * last + libm::sqrt(1.0 - kept * kept) * own
            }
        };
        self.last_noise = Some(noise);
        noise
    }
}

/// No standard normal number from 53 random bits is larger.
const LARGEST_NORMAL: f64 = 8.3;
