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

mod label;
mod slip;

pub use label::{LabelRule, label_moments};
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
        let step_s = 1.0 / self.rate_hz;
        let (mut sensor, mut control) = (sensor.clone(), ForceLoop::new(self.robot));
        let yields = 1.0 + self.robot.damping_n_s_per_m * creep_m_per_n_s;
        let share = 1.0 / (1.0 + step_s * self.stiffness_n_per_m / self.robot.damping_n_s_per_m * yields);
        pull.clear();
        let mut stairs = staircase.from(0.0);
        let (mut contact_n, mut applied_n, mut largest_n) = (0.0_f64, 0.0, 0.0_f64);
        for tick in 0..=self.ticks() {
            let time_s = tick as f64 / self.rate_hz;
            if tick % SNAPSHOT_TICKS == 0 && !sensor.is_identity() {
                pull.sensors.push(sensor.clone());
            }
            let reading_n = sensor.read(contact_n, time_s, if tick == 0 { 0.0 } else { step_s });
            let desired_n = stairs.desired_n(time_s);
            largest_n = largest_n.max(contact_n);
            pull.desired_n.push(desired_n);
            pull.reading_n.push(reading_n);
            pull.contact_n.push(contact_n);
            pull.largest_n.push(largest_n);
            pull.applied_n.push(applied_n);
            if contact_n > force_n || contact_n > self.stop_m * self.stiffness_n_per_m {
                break;
            }
            let commanded_n = command.apply(desired_n, reading_n);
            applied_n = control.advance(time_s, step_s, commanded_n, reading_n, contact_n);
            // k x, implicit in x.
            let held_n = applied_n / yields;
            contact_n = held_n + (contact_n - held_n) * share;
        }
    }
}

impl StuckPull {
    /// Forgets everything and keeps its memory.
    fn clear(&mut self) {
        let Self { desired_n, reading_n, contact_n, largest_n, applied_n, sensors } = self;
        [desired_n, reading_n, contact_n, largest_n, applied_n].into_iter().for_each(Vec::clear);
        sensors.clear();
    }
}
