//! A pull without inertia: the reduced mechanics in the limit of a light arm, for fits that need a million pulls.
//!
//! The arm's speed is the force that nobody holds over the damping, and all bristles of a jaw are one:
//!
//! ```text
//! d dx/dt = F - F_c,   F_c = k x while the jaws hold,  kinetic_ratio L once k x has reached L
//! ```
//!
//! Contacts that bend have F_c = L b(k x / L) with the backbone b of the contact ([`Backbone`]) from [`BENDS_FROM`] of L on.
//!
//!
//! with the force loop of [`crate::PullSession`], its sensor and command effects, and the same order of readings and
//! commands. What is missing against the reduced mechanics is the ringing of the arm's mass on the gel and the
//! differences between contacts; `a_pull_without_inertia_is_the_reduced_one` says how much that is.

use crate::force_loop::ForceLoop;
use gripgen_twin::effects::{CommandChain, SensorChain};
use gripgen_twin::{Backbone, Robot, Staircase};

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

/// What follows after a slip.
#[derive(Debug, Clone, Default)]
pub struct SlipPull {
    /// The first tick at which the jaws slide, or bend, or one past the last tick of a pull that ends before.
    pub slip_tick: usize,
    /// Command at each tick from there on.
    pub desired_n: Vec<f64>,
    /// Noise-free reading at each of them.
    pub reading_n: Vec<f64>,
    /// Displacement at the last tick.
    pub displacement_m: f64,
}

/// Ticks between two copies of the sensor's memory.
const SNAPSHOT_TICKS: usize = 64;

/// Share of the limit up to which contacts that bend are taken for springs: what they trail more below is forgotten, within
/// the time in which gels and damping relax, before they slip.
const BENDS_FROM: f64 = 0.3;

impl QuasiStatic {
    fn ticks(&self) -> usize {
        (self.max_time_s * self.rate_hz) as usize
    }

    /// The pull of a tool that holds, until its contact force exceeds `force_n`, into `pull`.
    pub fn stuck(
        &self,
        staircase: &Staircase,
        sensor: &SensorChain,
        command: &CommandChain,
        force_n: f64,
        pull: &mut StuckPull,
    ) {
        let step_s = 1.0 / self.rate_hz;
        let (mut sensor, mut control) = (sensor.clone(), ForceLoop::new(self.robot));
        let share = 1.0 / (1.0 + step_s * self.stiffness_n_per_m / self.robot.damping_n_s_per_m);
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
            contact_n = applied_n + (contact_n - applied_n) * share;
        }
    }

    /// What follows when the jaws hold `limit_n` only. Ends at the displacement stop, or when the command is more than
    /// `decided_n` above the reading: the label cannot change any more. `sensor` and `command` are those of `stuck`.
    #[allow(clippy::too_many_arguments)]
    pub fn slip(
        &self,
        stuck: &StuckPull,
        staircase: &Staircase,
        limit_n: f64,
        kinetic_ratio: f64,
        backbone: &Backbone,
        decided_n: f64,
        sensor: &SensorChain,
        command: &CommandChain,
        pull: &mut SlipPull,
    ) {
        let step_s = 1.0 / self.rate_hz;
        pull.desired_n.clear();
        pull.reading_n.clear();
        let from_n = if backbone.bends() { BENDS_FROM * limit_n } else { limit_n };
        let held = stuck.largest_n.partition_point(|&f| f < from_n);
        pull.displacement_m = limit_n / self.stiffness_n_per_m;
        pull.slip_tick = held;
        if held >= stuck.desired_n.len() {
            return;
        }
        let mut sensor = match stuck.sensors.get(held / SNAPSHOT_TICKS) {
            Some(remembered) => remembered.clone(),
            None => sensor.clone(),
        };
        if !sensor.is_identity() {
            for tick in held / SNAPSHOT_TICKS * SNAPSHOT_TICKS..held {
                let before_s = if tick == 0 { 0.0 } else { step_s };
                sensor.read(stuck.contact_n[tick], tick as f64 / self.rate_hz, before_s);
            }
        }
        let kinetic_n = limit_n * kinetic_ratio;
        let mut control = ForceLoop::new(self.robot);
        control.take_over(stuck.applied_n[held]);
        let dead_ticks = (self.robot.dead_time_s * self.rate_hz - 1e-9).ceil().max(0.0);
        let kept = if self.fall_s > 0.0 { libm::exp(-step_s / self.fall_s) } else { 0.0 };
        let mut above_n = (limit_n - kinetic_n) * kept;
        let held_s = held as f64 / self.rate_hz;
        let (mut stairs, mut due) =
            (staircase.from(held_s), staircase.from((held_s - dead_ticks * step_s).max(0.0)));
        // Shear and displacement of a contact that bends, until all of it has slipped.
        let mut bent = backbone.bends().then(|| {
            let shear = backbone.shear_of(stuck.contact_n[held] / limit_n);
            (shear, backbone.at(shear))
        });
        let shear_of_m = self.stiffness_n_per_m / limit_n;
        // What a force that nobody holds moves in a step, and how much of it a spring of the gels' stiffness takes away.
        let metres_per_n = step_s / self.robot.damping_n_s_per_m;
        let held_back = self.stiffness_n_per_m * metres_per_n;
        for tick in held..=self.ticks() {
            let time_s = tick as f64 / self.rate_hz;
            let contact_n = match bent {
                Some((_, (share, _))) => limit_n * share,
                None => kinetic_n + above_n,
            };
            if bent.is_none() {
                above_n *= kept;
            }
            let reading_n = sensor.read(contact_n, time_s, step_s);
            let desired_n = stairs.desired_n(time_s);
            pull.desired_n.push(desired_n);
            pull.reading_n.push(reading_n);
            if let Some((shear, _)) = bent {
                pull.displacement_m = shear / shear_of_m;
            }
            let decided = bent.is_none() && desired_n - reading_n > decided_n;
            if pull.displacement_m > self.stop_m || decided {
                break;
            }
            // Commands under way at the slip go on arriving: the loop is given the one that is due.
            let due_n = due.desired_n((time_s - dead_ticks * step_s).max(0.0));
            let commanded_n = command.apply(due_n, reading_n);
            let applied_n = control.advance_due(step_s, commanded_n, reading_n, contact_n);
            let step_m = (applied_n - contact_n) * metres_per_n;
            bent = match bent {
                Some((shear, (_, slope))) => {
                    // Implicit in x while it holds.
                    let next = shear + step_m * shear_of_m / (1.0 + held_back * slope);
                    (next < backbone.slips_at()).then(|| (next, backbone.at(next)))
                }
                None => {
                    pull.displacement_m += step_m.max(0.0);
                    None
                }
            };
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

impl SlipPull {
    /// Mean and variance of the label of this pull whose readings carry white noise: [`label_moments`].
    pub fn label(&self, stuck: &StuckPull, tolerance_n: f64, noise_n: f64) -> Option<(f64, f64)> {
        let held = self.slip_tick.min(stuck.desired_n.len());
        let before = stuck.desired_n[..held].iter().zip(&stuck.reading_n[..held]);
        label_moments(before.chain(self.desired_n.iter().zip(&self.reading_n)), tolerance_n, noise_n)
    }
}

/// Mean and variance of the label of a pull whose readings carry white noise, exactly: the label rule takes the last
/// reading within the tolerance of the command, and
///
/// ```text
/// P(T_slip = t) = p_t prod over s > t of (1 - p_s),   p_t = P(|F(t) + noise - F_des(t)| < tolerance)
/// ```
///
/// `desired_and_reading_n` are the ticks in order. `None` if no reading is ever near the command.
pub fn label_moments<'a>(
    desired_and_reading_n: impl DoubleEndedIterator<Item = (&'a f64, &'a f64)>,
    tolerance_n: f64,
    noise_n: f64,
) -> Option<(f64, f64)> {
    let (mut alive, mut sum, mut mean, mut square) = (1.0, 0.0, 0.0, 0.0);
    let wide = 7.0 * noise_n;
    for (desired, reading) in desired_and_reading_n.rev() {
        let d = reading - desired;
        if d.abs() >= tolerance_n + wide {
            continue;
        }
        let (p, value, var) = if d.abs() < tolerance_n - wide || noise_n == 0.0 {
            (1.0, *reading, noise_n * noise_n)
        } else {
            within(*reading, d, tolerance_n, noise_n)
        };
        let share = alive * p;
        sum += share;
        mean += share * value;
        square += share * (value * value + var);
        alive *= 1.0 - p;
        if alive < 1e-5 {
            break;
        }
    }
    if sum < 1e-3 {
        return None;
    }
    let mean = mean / sum;
    Some((mean, (square / sum - mean * mean).max(0.0)))
}

/// Probability that a reading is within the tolerance, and mean and variance of those that are.
fn within(reading_n: f64, difference_n: f64, tolerance_n: f64, noise_n: f64) -> (f64, f64, f64) {
    let (a, b) = ((-tolerance_n - difference_n) / noise_n, (tolerance_n - difference_n) / noise_n);
    let p = normal_cdf(b) - normal_cdf(a);
    if p < 1e-12 {
        return (0.0, reading_n, 0.0);
    }
    let (fa, fb) = (normal_pdf(a), normal_pdf(b));
    let shift = (fa - fb) / p;
    let var = (1.0 + (a * fa - b * fb) / p - shift * shift).max(0.0);
    (p, reading_n + noise_n * shift, noise_n * noise_n * var)
}

fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

fn normal_pdf(x: f64) -> f64 {
    const ROOT: f64 = 0.398_942_280_401_432_7;
    ROOT * libm::exp(-0.5 * x * x)
}
