//! The virtual arm: where it is, what moves it, what it feels.

use crate::program::{STOP_DECELERATION_M_S2, TcpPose};
use gripgen_twin::plant::{Grip, GripRequest, Plant, PlantError, PullReading, PullRequest};
use std::sync::Arc;

/// Control step of an e-Series robot.
pub const STEP_S: f64 = 0.002;
/// How far a gripped part, which is fixed, lets itself be moved before the robot stops by itself.
const COLLISION_M: f64 = 2e-3;
/// Standard gravity.
const GRAVITY_M_S2: f64 = 9.806_65;

/// What moves the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Nothing.
    Hold,
    /// Force mode along the base's z.
    Force {
        /// What the arm applies.
        force_n: f64,
        /// Largest speed.
        speed_limit_m_s: f64,
        /// What the pull is: its direction and steps.
        pull: PullRequest,
    },
    /// A straight line.
    Line {
        /// Where to.
        target: TcpPose,
        /// How fast.
        speed_m_s: f64,
    },
    /// It brakes.
    Stop,
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
    /// The simulator.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// A pull under way, or ended with the jaws still closed.
struct Pulling {
    from: TcpPose,
    direction: f64,
    reading: PullReading,
}

/// The arm.
pub struct Arm {
    plant: Arc<dyn Plant>,
    tcp: TcpPose,
    velocity_m_s: [f64; 3],
    drive: Drive,
    grip: Option<Box<dyn Grip>>,
    closed_at_s: f64,
    gripped_at: TcpPose,
    pulling: Option<Pulling>,
    hung_mass_kg: f64,
    aside_n: f64,
    aside_zero_n: f64,
    zero_n: f64,
    raw_n: f64,
    tick: u64,
}

impl Arm {
    /// An arm at rest.
    pub fn new(plant: Arc<dyn Plant>, tcp: TcpPose) -> Self {
        let zero_n = plant.offset_n(0.0);
        Self {
            plant,
            tcp,
            velocity_m_s: [0.0; 3],
            drive: Drive::Hold,
            grip: None,
            closed_at_s: 0.0,
            gripped_at: tcp,
            pulling: None,
            hung_mass_kg: 0.0,
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

    /// What moves it. A drive with a number that is none is a stop.
    pub fn set_drive(&mut self, drive: Drive) {
        let finite = match drive {
            Drive::Hold | Drive::Stop => true,
            Drive::Force { force_n, speed_limit_m_s, .. } => {
                force_n.is_finite() && speed_limit_m_s.is_finite()
            }
            Drive::Line { target, speed_m_s } => {
                speed_m_s.is_finite() && target.numbers().iter().all(|x| x.is_finite())
            }
        };
        self.drive = if finite { drive } else { Drive::Stop };
    }

    /// Whether it is in force mode.
    pub fn applies_force(&self) -> bool {
        matches!(self.drive, Drive::Force { .. })
    }

    /// Brakes, if it moves.
    pub fn stop(&mut self) {
        self.drive = Drive::Stop;
    }

    /// Force on the tool along the base's z: zeroed, and raw. A pull upwards loads the tool downwards.
    pub fn force_z_n(&self) -> (f64, f64) {
        (self.raw_n - self.zero_n, self.raw_n)
    }

    /// Takes what the sensor says now as zero. The controller averages its noise away.
    pub fn zero(&mut self, time_s: f64) {
        self.zero_n = self.load_n(time_s);
        self.aside_zero_n = self.aside_n;
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
        (self.aside_n - self.aside_zero_n, self.aside_n)
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
            Some(p) => -p.direction * p.reading.measured_n,
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
        match self.drive {
            Drive::Hold => self.velocity_m_s = [0.0; 3],
            Drive::Stop => {
                let speed = self.speed_m_s();
                let slower = (speed - STOP_DECELERATION_M_S2 * STEP_S).max(0.0);
                let factor = if speed > 0.0 { slower / speed } else { 0.0 };
                self.velocity_m_s = self.velocity_m_s.map(|v| v * factor);
                for axis in 0..3 {
                    self.tcp.position_m[axis] += self.velocity_m_s[axis] * STEP_S;
                }
                if slower == 0.0 {
                    self.drive = Drive::Hold;
                }
            }
            Drive::Line { target, speed_m_s } => self.follow(&target, speed_m_s)?,
            Drive::Force { force_n, speed_limit_m_s, pull } => {
                self.pull(force_n, speed_limit_m_s, &pull)?;
            }
        }
        if !matches!(self.drive, Drive::Force { .. }) {
            self.velocity_m_s = [0, 1, 2].map(|i| (self.tcp.position_m[i] - before.position_m[i]) / STEP_S);
        }
        // While the simulator pulls, its sensor has its own noise.
        let pulling = self.pulling.is_some() && matches!(self.drive, Drive::Force { .. });
        let noise_n = if pulling { 0.0 } else { self.plant.noise_n(self.tick) };
        self.raw_n = self.load_n(time_s) + noise_n;
        Ok(())
    }

    fn follow(&mut self, target: &TcpPose, speed_m_s: f64) -> Result<(), ArmError> {
        let left_m = self.tcp.distance_m(target);
        let share = if left_m <= speed_m_s * STEP_S { 1.0 } else { speed_m_s * STEP_S / left_m };
        for axis in 0..3 {
            self.tcp.position_m[axis] += share * (target.position_m[axis] - self.tcp.position_m[axis]);
            self.tcp.rotation_rad[axis] += share * (target.rotation_rad[axis] - self.tcp.rotation_rad[axis]);
        }
        let moved_m = self.tcp.distance_m(&self.gripped_at);
        let held = self.grip.as_ref().is_some_and(|g| g.holds()) && self.pulling.is_none();
        if held && moved_m > COLLISION_M {
            self.drive = Drive::Stop;
            return Err(ArmError::Collision { moved_mm: 1e3 * moved_m });
        }
        Ok(())
    }

    fn pull(&mut self, force_n: f64, limit_m_s: f64, pull: &PullRequest) -> Result<(), ArmError> {
        let Some(grip) = self.grip.as_mut().filter(|grip| grip.holds()) else {
            // Nothing holds the arm back.
            let speed = if force_n == 0.0 { 0.0 } else { limit_m_s.copysign(force_n) };
            self.velocity_m_s = [0.0, 0.0, speed];
            self.tcp.position_m[2] += speed * STEP_S;
            return Ok(());
        };
        if self.pulling.is_none() {
            let reading = grip.begin_pull(pull)?;
            self.pulling = Some(Pulling { from: self.tcp, direction: pull.direction, reading });
        }
        if let Some(p) = &mut self.pulling {
            p.reading = grip.pull(p.direction * force_n, STEP_S)?;
            let before = self.tcp.position_m[2];
            self.tcp = p.from.raised(p.direction * p.reading.displacement_m);
            self.velocity_m_s = [0.0, 0.0, (self.tcp.position_m[2] - before) / STEP_S];
        }
        Ok(())
    }
}
