//! A pull without inertia: the reduced mechanics in the limit of a light arm, for fits that need a million pulls.
//!
//! The arm's speed is the force that nobody holds over the damping, and all bristles of a jaw are one:
//!
//! ```text
//! d dx/dt = F - F_c,   F_c = k x while the jaws hold,  kinetic_ratio L once k x has reached L
//! ```
//!
//! Contacts that bend have F_c = L b(k x / L) with the backbone b of the contact ([`gripgen_twin::Backbone`]) from three tenths of L on.
//! A tool that creeps under the force that the jaws hold moves besides ([`gripgen_twin::effects::Creep`]): it meets the displacement stop
//! earlier, and the damping takes its share of the force, `d (dF_c/dt / k + rate F_c) = F - F_c`. A loop that closes on its sensor then
//! follows with `lag (1 + d rate)`.
//!
//! All with the force loop of [`crate::PullSession`], its sensor and command effects, and the same order of readings and
//! commands. What is missing against the reduced mechanics is the ringing of the arm's mass on the gel and the
//! differences between contacts; `a_pull_without_inertia_is_the_reduced_one` says how much that is.

mod slip;

pub use slip::{RimTable, SlipPull, SlipRun};

use crate::force_loop::ForceLoop;
use gripgen_twin::effects::{CommandChain, SensorChain};
use gripgen_twin::{Robot, Staircase};

/// What all pulls of a rig share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuasiStatic {
    /// The force loop. The mass is not used.
    pub robot: Robot,
    /// Shear stiffness of both gels together.
    pub stiffness_n_per_m: f64,
    /// Readings per second.
    pub rate_hz: f64,
    /// Time constant with which the force falls to its kinetic value after a slip; 0 in the reduced mechanics.
    pub fall_s: f64,
    /// Displacement at which a pull ends.
    pub stop_m: f64,
    /// Longest time of a pull.
    pub max_time_s: f64,
}

/// The pull of a tool that never slips, up to a force: what slips later is the same until it slips.
#[derive(Debug, Clone, Default)]
pub struct StuckPull {
    /// Command at each tick.
    pub desired_n: Vec<f64>,
    /// Noise-free reading at each tick.
    pub reading_n: Vec<f64>,
    /// Force on the contact at each tick.
    pub contact_n: Vec<f64>,
    /// Largest contact force up to each tick.
    largest_n: Vec<f64>,
    /// Force of the loop at each tick.
    applied_n: Vec<f64>,
    /// What the loop is told at each tick.
    commanded_n: Vec<f64>,
    /// The sensor before every [`SNAPSHOT_TICKS`]th reading, if it has effects.
    sensors: Vec<SensorChain>,
}

/// Ticks between two copies of the sensor's memory.
const SNAPSHOT_TICKS: usize = 64;

impl QuasiStatic {
    fn ticks(&self) -> usize {
        (self.max_time_s * self.rate_hz) as usize
    }

    /// The pull of a tool that holds, until its contact force exceeds `force_n`, into `pull`. It creeps with `creep_m_per_n_s` as long as all of
    /// its contact sticks.
    pub fn stuck(
        &self,
        staircase: &Staircase,
        sensor: &SensorChain,
        command: &CommandChain,
        creep_m_per_n_s: f64,
        force_n: f64,
        pull: &mut StuckPull,
    ) {
        pull.clear();
        // Without effects on readings and commands, as most are, there is nothing to ask them.
        if sensor.is_identity() && command.is_identity() {
            let read = |_: &mut StuckPull, contact_n: f64, _: usize| contact_n;
            self.hold(staircase, read, |desired_n, _| desired_n, creep_m_per_n_s, force_n, pull);
        } else {
            let (mut sensor, step_s) = (sensor.clone(), 1.0 / self.rate_hz);
            let read = |pull: &mut StuckPull, contact_n: f64, tick: usize| {
                if tick.is_multiple_of(SNAPSHOT_TICKS) && !sensor.is_identity() {
                    pull.sensors.push(sensor.clone());
                }
                sensor.read(contact_n, tick as f64 / self.rate_hz, if tick == 0 { 0.0 } else { step_s })
            };
            let command = |desired_n: f64, reading_n: f64| command.apply(desired_n, reading_n);
            self.hold(staircase, read, command, creep_m_per_n_s, force_n, pull);
        }
    }

    #[inline(always)]
    fn hold(
        &self,
        staircase: &Staircase,
        mut read: impl FnMut(&mut StuckPull, f64, usize) -> f64,
        command: impl Fn(f64, f64) -> f64,
        creep_m_per_n_s: f64,
        force_n: f64,
        pull: &mut StuckPull,
    ) {
        let step_s = 1.0 / self.rate_hz;
        let mut control = ForceLoop::new(self.robot);
        let yields = 1.0 + self.robot.damping_n_s_per_m * creep_m_per_n_s;
        let share = 1.0 / (1.0 + step_s * self.stiffness_n_per_m / self.robot.damping_n_s_per_m * yields);
        // A command acts at the first tick at which it has waited its dead time.
        let dead_ticks = ((self.robot.dead_time_s - 1e-9) * self.rate_hz).ceil().max(0.0) as usize;
        let most_n = force_n.min(self.stop_m * self.stiffness_n_per_m);
        let mut stairs = staircase.from(0.0);
        let (mut contact_n, mut applied_n, mut largest_n) = (0.0_f64, 0.0, 0.0_f64);
        for tick in 0..=self.ticks() {
            let reading_n = read(pull, contact_n, tick);
            let desired_n = stairs.desired_n(tick as f64 / self.rate_hz);
            largest_n = if largest_n > contact_n { largest_n } else { contact_n };
            pull.desired_n.push(desired_n);
            pull.reading_n.push(reading_n);
            pull.contact_n.push(contact_n);
            pull.largest_n.push(largest_n);
            pull.applied_n.push(applied_n);
            if contact_n > most_n {
                break;
            }
            pull.commanded_n.push(command(desired_n, reading_n));
            let due_n = tick.checked_sub(dead_ticks).map_or(0.0, |sent| pull.commanded_n[sent]);
            applied_n = control.advance_due(step_s, due_n, reading_n, contact_n);
            // k x, implicit in x.
            let held_n = if yields > 1.0 { applied_n / yields } else { applied_n };
            contact_n = held_n + (contact_n - held_n) * share;
        }
    }
}

impl StuckPull {
    /// Forgets everything and keeps its memory.
    fn clear(&mut self) {
        let Self { desired_n, reading_n, contact_n, largest_n, applied_n, commanded_n, sensors } = self;
        [desired_n, reading_n, contact_n, largest_n, applied_n, commanded_n].into_iter().for_each(Vec::clear);
        sensors.clear();
    }
}
