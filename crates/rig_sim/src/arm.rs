//! The virtual arm: where it is, what moves it, what it feels.

mod force;
mod joints;

use super::kinematics::{Joints, MAX_SPEED_RAD_S, OutOfReachError};
use super::urscript::ForceMode;
use force::Pulling;
use gripgen_rig::program::TcpPose;
use gripgen_twin::plant::{Grip, GripRequest, Plant, PlantError};
use nalgebra::UnitQuaternion;
use std::collections::VecDeque;
use std::sync::Arc;

/// Control step of an e-Series robot.
pub const STEP_S: f64 = 0.002;
/// How far a gripped part, which is fixed, lets itself be moved before the robot stops by itself.
const COLLISION_M: f64 = 2e-3;
/// Standard gravity.
const GRAVITY_M_S2: f64 = 9.806_65;
/// How it brakes by itself.
const BRAKE_M_S2: f64 = 2.0;
/// Damping and gain of force mode until a program sets them (script manual).
const DAMPING: f64 = 0.025;
const GAIN: f64 = 1.0;

/// What moves the arm beside force mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing.
    Hold,
    /// A straight line.
    Line {
        /// Where to.
        target: TcpPose,
        /// How fast.
        speed_m_s: f64,
        /// How fast it gets there, and comes to rest.
        acceleration_m_s2: f64,
    },
    /// All joints at once, the one with the longest way as fast as is said.
    Joints {
        /// Where to.
        target_rad: Joints,
        /// How fast.
        speed_rad_s: f64,
        /// How fast it gets there, and comes to rest.
        acceleration_rad_s2: f64,
    },
    /// It brakes.
    Stop {
        /// How.
        deceleration_m_s2: f64,
    },
    /// Its joints brake.
    StopJoints {
        /// How.
        deceleration_rad_s2: f64,
    },
}

/// Why the arm stopped by itself.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// It moved while it held a fixed part.
    #[error("the arm moved {moved_mm:.1} mm with a fixed part in its jaws")]
    Collision {
        /// How far.
        moved_mm: f64,
    },
    /// No joints carry the tool there.
    #[error(transparent)]
    OutOfReach(#[from] OutOfReachError),
    /// A joint would have to turn faster than it can: near a singularity little ways of the tool are long ones of a joint.
    #[error("joint {joint} would turn at {speed_rad_s:.1} rad/s, {MAX_SPEED_RAD_S:.1} rad/s are the most")]
    TooFast {
        /// From the base, 1 to 6.
        joint: usize,
        /// How fast.
        speed_rad_s: f64,
    },
    /// The simulator.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// How far the arm is from one that follows at once and feels truly.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ArmFaults {
    /// Time constant of force mode.
    pub force_lag_s: f64,
    /// Time before force mode begins to follow.
    pub force_dead_s: f64,
    /// Time constant of the sensor.
    pub sensor_lag_s: f64,
    /// How the sensor's zero wanders, N per second.
    pub drift_n_s: f64,
    /// What jaws that have closed on a part press across the pull, along the base's x.
    pub clamp_n: f64,
}

/// The arm.
pub struct Arm {
    plant: Arc<dyn Plant>,
    tcp: TcpPose,
    velocity_m_s: [f64; 3],
    /// Grip centre at the flange.
    tool_m: [f64; 3],
    joints_rad: Joints,
    joint_speeds_rad_s: Joints,
    /// Where these joints carry the tool.
    carried: TcpPose,
    /// Whether what joints cannot do stops it.
    has_limits: bool,
    drive: Drive,
    force: Option<ForceMode>,
    damping: f64,
    gain: f64,
    grip: Option<Box<dyn Grip>>,
    closed_at_s: f64,
    gripped_at: TcpPose,
    pulling: Option<Pulling>,
    hung_mass_kg: f64,
    faults: ArmFaults,
    /// What was asked of force mode along z and has not come to it yet, oldest first; and what it applies.
    asked_n: VecDeque<f64>,
    applied_n: f64,
    /// What the sensor feels along z, behind what loads it.
    felt_n: f64,
    drift_n: f64,
    aside_n: f64,
    aside_zero_n: f64,
    zero_n: f64,
    raw_n: f64,
    tick: u64,
}

impl Arm {
    /// An arm at rest, its grip centre so far from the flange. Where no joints reach the pose, it cannot move from there.
    pub fn new(plant: Arc<dyn Plant>, tcp: TcpPose, tool_m: [f64; 3]) -> Self {
        let zero_n = plant.offset_n(0.0);
        Self {
            plant,
            tcp,
            velocity_m_s: [0.0; 3],
            tool_m,
            joints_rad: joints::at_start(&tcp, tool_m),
            joint_speeds_rad_s: [0.0; 6],
            carried: tcp,
            has_limits: true,
            drive: Drive::Hold,
            force: None,
            damping: DAMPING,
            gain: GAIN,
            grip: None,
            closed_at_s: 0.0,
            gripped_at: tcp,
            pulling: None,
            hung_mass_kg: 0.0,
            faults: ArmFaults::default(),
            asked_n: VecDeque::new(),
            applied_n: 0.0,
            felt_n: -zero_n,
            drift_n: 0.0,
            aside_n: 0.0,
            aside_zero_n: 0.0,
            zero_n,
            raw_n: zero_n,
            tick: 0,
        }
    }

    /// Where the tool is.
    pub fn tcp(&self) -> TcpPose {
        self.tcp
    }

    /// How fast it moves.
    pub fn velocity_m_s(&self) -> [f64; 3] {
        self.velocity_m_s
    }

    /// Speed of the tool.
    pub fn speed_m_s(&self) -> f64 {
        self.velocity_m_s.iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// What moves it beside force mode.
    pub fn drive(&self) -> Drive {
        self.drive
    }

    /// Begins to move in a line. Numbers that are none are a stop.
    ///
    /// # Errors
    ///
    /// In force mode.
    pub fn move_line(
        &mut self,
        target: TcpPose,
        acceleration_m_s2: f64,
        speed_m_s: f64,
    ) -> Result<(), String> {
        if self.force.is_some() {
            return Err("a motion in force mode is not simulated".into());
        }
        let numbers = target.numbers();
        let finite = numbers.iter().chain(&[acceleration_m_s2, speed_m_s]).all(|x| x.is_finite());
        self.drive = match finite {
            true => Drive::Line { target, speed_m_s, acceleration_m_s2 },
            false => Drive::Stop { deceleration_m_s2: BRAKE_M_S2 },
        };
        Ok(())
    }

    /// Brakes what moves it; joints that turn, as joints. Force mode goes on.
    pub fn brake(&mut self, deceleration_m_s2: f64) {
        self.drive = match self.drive {
            Drive::Joints { .. } => Drive::StopJoints { deceleration_rad_s2: joints::BRAKE_RAD_S2 },
            brakes @ Drive::StopJoints { .. } => brakes,
            _ => Drive::Stop { deceleration_m_s2 },
        };
    }

    /// Whether a line or a braking is under way.
    pub fn is_driven(&self) -> bool {
        self.drive != Drive::Hold
    }

    /// Force mode begins, or gets other numbers.
    ///
    /// # Errors
    ///
    /// A number that is none.
    pub fn force_mode(&mut self, mode: ForceMode) -> Result<(), String> {
        let numbers = [mode.frame, mode.wrench, mode.limits];
        if !numbers.iter().flatten().all(|x| x.is_finite()) {
            return Err("force mode with a number that is none".into());
        }
        if self.force.is_none() {
            (self.applied_n, self.drive) = (0.0, Drive::Hold);
            self.asked_n.clear();
        }
        self.force = Some(mode);
        Ok(())
    }

    /// Force mode ends, and the arm brakes.
    pub fn end_force_mode(&mut self) {
        if self.force.take().is_some() {
            self.drive = Drive::Stop { deceleration_m_s2: BRAKE_M_S2 };
        }
    }

    /// Damping and gain of force mode. They stay until they are set again.
    pub fn set_force_settings(&mut self, damping: Option<f64>, gain: Option<f64>) {
        self.damping = damping.unwrap_or(self.damping);
        self.gain = gain.unwrap_or(self.gain);
    }

    /// Damping and gain of force mode.
    pub fn force_settings(&self) -> (f64, f64) {
        (self.damping, self.gain)
    }

    /// Whether it is in force mode.
    pub fn applies_force(&self) -> bool {
        self.force.is_some()
    }

    /// What force mode was last asked for.
    pub fn force_command(&self) -> Option<ForceMode> {
        self.force
    }

    /// Ends whatever moves it, and brakes.
    pub fn stop(&mut self) {
        self.force = None;
        self.brake(BRAKE_M_S2);
    }

    /// Somebody pushes the tool by so much, against the stiffness of the arm.
    pub fn push(&mut self, by_m: [f64; 3]) {
        for (position_m, by_m) in self.tcp.position_m.iter_mut().zip(by_m) {
            *position_m += by_m;
        }
    }

    /// How far it is from a perfect arm.
    pub fn faults(&self) -> ArmFaults {
        self.faults
    }

    /// Makes it less perfect, or perfect again.
    pub fn set_faults(&mut self, faults: ArmFaults) {
        self.faults = faults;
    }

    /// Force on the tool along the base's z: zeroed, and raw. A pull upwards loads the tool downwards.
    pub fn force_z_n(&self) -> (f64, f64) {
        (self.raw_n - self.zero_n, self.raw_n)
    }

    /// Takes what the sensor says now as zero. The controller averages its noise away.
    pub fn zero(&mut self) {
        self.zero_n = self.felt_n + self.drift_n;
        self.aside_zero_n = self.across_n();
    }

    /// Hangs a mass on the tool, or takes it off.
    pub fn hang(&mut self, mass_kg: f64) {
        self.hung_mass_kg = mass_kg;
    }

    /// Something pulls aside, along the base's x.
    pub fn pull_aside(&mut self, force_n: f64) {
        self.aside_n = force_n;
    }

    /// Force on the tool along the base's x: zeroed, and raw.
    pub fn aside_n(&self) -> (f64, f64) {
        (self.across_n() - self.aside_zero_n, self.across_n())
    }

    /// What loads the tool along the base's x.
    fn across_n(&self) -> f64 {
        let clamps = self.grip.as_ref().is_some_and(|grip| grip.holds());
        self.aside_n + if clamps { self.faults.clamp_n } else { 0.0 }
    }

    /// How the jaws would close now.
    pub fn grip_request(&self, force_per_jaw_n: f64, time_s: f64) -> GripRequest {
        GripRequest { base_from_tool: self.tcp.base_from_tool(), force_per_jaw_n, time_s }
    }

    /// The jaws have closed.
    pub fn close(&mut self, grip: Box<dyn Grip>, time_s: f64) {
        (self.grip, self.closed_at_s, self.gripped_at) = (Some(grip), time_s, self.tcp);
    }

    /// The jaws are open, or the part is gone.
    pub fn open(&mut self) {
        (self.grip, self.pulling) = (None, None);
    }

    /// The grip, while the jaws are closed.
    pub fn grip(&self) -> Option<&dyn Grip> {
        self.grip.as_deref()
    }

    /// Time since the jaws closed.
    pub fn dwell_s(&self, time_s: f64) -> f64 {
        if self.grip.is_some() { time_s - self.closed_at_s } else { 0.0 }
    }

    /// The sensor without noise, not zeroed: load on the tool along z.
    fn load_n(&self, time_s: f64) -> f64 {
        let without_mass_n = match &self.pulling {
            Some(p) => -p.request.direction * p.reading.measured_n,
            None => -self.plant.offset_n(time_s),
        };
        without_mass_n - self.hung_mass_kg * GRAVITY_M_S2
    }

    /// One control step of physics.
    ///
    /// # Errors
    ///
    /// A fixed part that the arm would carry along, or a plant that cannot go on.
    pub fn advance(&mut self, time_s: f64) -> Result<(), ArmError> {
        self.tick += 1;
        let before = self.tcp;
        if let Some(mode) = self.force {
            self.drive = Drive::Hold;
            self.apply(&mode, time_s)?;
            self.take_joints_along()?;
        } else {
            let moves = matches!(self.drive, Drive::Line { .. } | Drive::Joints { .. });
            match self.drive {
                Drive::Hold => self.velocity_m_s = [0.0; 3],
                Drive::Stop { deceleration_m_s2 } => self.slow_down(deceleration_m_s2),
                Drive::Line { target, speed_m_s, acceleration_m_s2 } => {
                    self.follow(&target, speed_m_s, acceleration_m_s2);
                }
                Drive::Joints { target_rad, speed_rad_s, acceleration_rad_s2 } => {
                    self.turn(&target_rad, speed_rad_s, acceleration_rad_s2);
                }
                Drive::StopJoints { deceleration_rad_s2 } => self.slow_joints(deceleration_rad_s2),
            }
            self.take_joints_along()?;
            self.velocity_m_s = [0, 1, 2].map(|i| (self.tcp.position_m[i] - before.position_m[i]) / STEP_S);
            if moves {
                self.carries_nothing_fixed()?;
            }
        }
        // While the simulator pulls, its sensor has its own noise.
        let noise_n =
            if self.pulling.is_some() && self.force.is_some() { 0.0 } else { self.plant.noise_n(self.tick) };
        self.felt_n += (self.load_n(time_s) - self.felt_n) * share(self.faults.sensor_lag_s);
        self.drift_n += self.faults.drift_n_s * STEP_S;
        self.raw_n = self.felt_n + self.drift_n + noise_n;
        Ok(())
    }

    fn slow_down(&mut self, deceleration_m_s2: f64) {
        let speed = self.speed_m_s();
        let slower = (speed - deceleration_m_s2 * STEP_S).max(0.0);
        let factor = if speed > 0.0 { slower / speed } else { 0.0 };
        for axis in 0..3 {
            self.tcp.position_m[axis] += factor * self.velocity_m_s[axis] * STEP_S;
        }
        if slower == 0.0 {
            self.drive = Drive::Hold;
        }
    }

    fn follow(&mut self, target: &TcpPose, speed_m_s: f64, acceleration_m_s2: f64) {
        let left_m = self.tcp.distance_m(target);
        // As fast as it has become, and as it can still brake from.
        let faster = self.speed_m_s() + acceleration_m_s2 * STEP_S;
        let brakes = (2.0 * acceleration_m_s2 * left_m).sqrt().max(0.5 * acceleration_m_s2 * STEP_S);
        let step_m = speed_m_s.min(faster).min(brakes) * STEP_S;
        let share = if left_m <= step_m { 1.0 } else { step_m / left_m };
        for axis in 0..3 {
            self.tcp.position_m[axis] += share * (target.position_m[axis] - self.tcp.position_m[axis]);
        }
        if self.tcp.rotation_rad != target.rotation_rad {
            let (from, to) = (self.tcp.base_from_tool().rotation, target.base_from_tool().rotation);
            // The shorter way round, about one axis.
            let step = UnitQuaternion::from_scaled_axis(share * from.rotation_to(&to).scaled_axis());
            self.tcp.rotation_rad = (step * from).scaled_axis().into();
        }
        if share == 1.0 {
            (self.tcp, self.drive) = (*target, Drive::Hold);
        }
    }

    /// A fixed part in the jaws lets itself be moved by little.
    fn carries_nothing_fixed(&mut self) -> Result<(), ArmError> {
        let moved_m = self.tcp.distance_m(&self.gripped_at);
        let held = self.grip.as_ref().is_some_and(|g| g.holds()) && self.pulling.is_none();
        if held && moved_m > COLLISION_M {
            self.brake(BRAKE_M_S2);
            return Err(ArmError::Collision { moved_mm: 1e3 * moved_m });
        }
        Ok(())
    }
}

/// How much of the way a first-order lag goes in a control step.
fn share(lag_s: f64) -> f64 {
    if lag_s > 0.0 { 1.0 - (-STEP_S / lag_s).exp() } else { 1.0 }
}
