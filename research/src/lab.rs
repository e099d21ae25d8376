//! A lab of its own: pulls by bristles that share no code with the reduced mechanics, for measuring how often intervals
//! hold the truth.

use gripgen::twin::config::Feedback;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Covariates, MeasuredPull, MeasuredPulls, PullTrace, TraceRow};

/// Readings per second, and rows of a stored trace: labels are taken from all readings, traces keep every fifth.
const RATE_HZ: f64 = 500.0;
const EVERY: usize = 5;

/// Integration steps in the time of a reading.
const SUBSTEPS: usize = 4;

/// Bristles of both jaws together.
const BRISTLES: usize = 32;

const STOP_M: f64 = 5e-3;
const TOLERANCE_N: f64 = 3.0;

/// How the contact gives way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// All at once.
    Flat,
    /// From the rim: F = L (1 - (1 - x / s)^(3/2)), Cattaneo 1938 and Mindlin 1949.
    Mindlin,
}

/// What is true in a campaign.
#[derive(Debug, Clone)]
pub struct World {
    pub mu: Vec<f64>,
    /// The law mu (a + b / F_G) of every part.
    pub law: Option<(f64, f64)>,
    pub kinetic_ratio: f64,
    pub lag_s: f64,
    pub dead_time_s: f64,
    /// Of both gels together, at small forces.
    pub stiffness_n_per_m: f64,
    pub damping_n_s_per_m: f64,
    pub noise_n: f64,
    pub scatter: f64,
    pub contact: Contact,
    pub feedback: Feedback,
}

/// What is done in a campaign.
#[derive(Debug, Clone)]
pub struct Plan {
    pub pulls: usize,
    /// One of so many pulls keeps its trace; none at 0.
    pub trace_every: usize,
    pub grip_force_n: Vec<f64>,
    pub increment_n: Vec<f64>,
}

/// Shares of the stiffness are equal; these are the stretches at which bristles let go, in units of L / k.
fn reaches(contact: Contact) -> Vec<f64> {
    let even = |i: usize| (i as f64 + 0.5) / BRISTLES as f64;
    match contact {
        Contact::Flat => vec![1.0; BRISTLES],
        // -F''(x) is the stiffness that lets go between x and x + dx; its distribution function is 1 - sqrt(1 - x / s).
        Contact::Mindlin => {
            let raw: Vec<f64> = (0..BRISTLES).map(|i| 1.0 - (1.0 - even(i)).powi(2)).collect();
            let mean = raw.iter().sum::<f64>() / BRISTLES as f64;
            raw.iter().map(|x| x / mean).collect()
        }
    }
}

/// One pull: its label, and the rows of its trace.
fn pull(world: &World, limit_n: f64, increment_n: f64, step_s: f64, noise: &mut Stream) -> (f64, PullTrace) {
    let k = world.stiffness_n_per_m / BRISTLES as f64;
    let reach: Vec<f64> =
        reaches(world.contact).iter().map(|x| x * limit_n / world.stiffness_n_per_m).collect();
    let mut foot = vec![0.0_f64; BRISTLES];
    let (mut x, mut applied, mut sliding) = (0.0_f64, 0.0_f64, false);
    let (mut contact_n, dt) = (0.0_f64, 1.0 / RATE_HZ / SUBSTEPS as f64);
    let follow = if world.lag_s > 0.0 { 1.0 - (-dt / world.lag_s).exp() } else { 1.0 };
    let desired = |t: f64| if t < -1e-9 { 0.0 } else { increment_n * ((t / step_s + 1e-9).floor() + 1.0) };
    let mut trace = PullTrace::default();
    let mut label = 0.0;
    for tick in -250_i64..60_000 {
        let t = tick as f64 / RATE_HZ;
        let reading = contact_n + world.noise_n * noise.normal();
        if tick >= 0 && (reading - desired(t)).abs() < TOLERANCE_N {
            label = reading;
        }
        if tick.rem_euclid(EVERY as i64) == 0 {
            trace.push(TraceRow {
                time_s: t,
                desired_force_n: desired(t),
                measured_force_n: reading,
                displacement_m: x + 8e-6 * noise.normal(),
            });
        }
        if x > STOP_M {
            break;
        }
        if tick < 0 {
            continue;
        }
        for sub in 0..SUBSTEPS {
            let now = t + sub as f64 * dt;
            let closed = match world.feedback {
                Feedback::Measured => reading,
                Feedback::Independent => applied,
            };
            applied += follow * (desired(now - world.dead_time_s) - closed);
            // The loop may be ahead of the contact by 40 N, as in the shipped twin.
            applied = applied.clamp(contact_n - 40.0, contact_n + 40.0);
            // Implicit while everything holds, exact enough otherwise.
            let holding = foot.iter().zip(&reach).filter(|(f, r)| x - **f < **r).count() as f64 * k;
            let slope = if sliding { 0.0 } else { holding };
            let speed = (applied - contact_n) / (world.damping_n_s_per_m + slope * dt);
            x += speed * dt;
            if sliding && speed <= 0.0 {
                // Jaws that stop hold again where they are.
                foot.iter_mut().zip(&reach).for_each(|(f, r)| *f = x - world.kinetic_ratio * r);
                sliding = false;
            }
            contact_n = 0.0;
            let mut all = true;
            for (foot, reach) in foot.iter_mut().zip(&reach) {
                let stretch = (x - *foot).clamp(-reach, *reach);
                all &= stretch >= *reach;
                *foot = x - stretch;
                contact_n += k * stretch;
            }
            sliding |= all;
            if sliding {
                contact_n = world.kinetic_ratio * limit_n;
            }
        }
    }
    (label, trace)
}

/// A campaign: part, force and step height in random order.
pub fn campaign(world: &World, plan: &Plan, seed: u64) -> MeasuredPulls {
    let mut order = Stream::new(seed, 0, Purpose::Draw);
    let step_s = 0.104;
    let mut pulls = Vec::new();
    let mut time_s = 0.0;
    let mut draw = |n: usize| ((order.uniform() * n as f64) as usize).min(n - 1);
    for i in 0..plan.pulls {
        // Every second pull may have a trace, so parts change every second pull.
        let part = (i / 2) % world.mu.len();
        let grip_force_n = plan.grip_force_n[draw(plan.grip_force_n.len())];
        let increment_n = plan.increment_n[draw(plan.increment_n.len())];
        let mut noise = Stream::new(seed, 1 + i as u64, Purpose::ForceNoise);
        let mu = world.law.map_or(world.mu[part], |(a, b)| world.mu[part] * (a + b / grip_force_n));
        let limit_n = 2.0 * mu * grip_force_n * (1.0 + world.scatter * noise.normal());
        let (label, trace) = pull(world, limit_n, increment_n, step_s, &mut noise);
        time_s += 40.0;
        pulls.push(MeasuredPull {
            id: format!("p{i:04}"),
            part: ["gear", "long_shaft", "roller_bearing"][part].into(),
            grip_pose: 0,
            grip_force_n,
            increment_n,
            start_n: None,
            step_s,
            covariates: Covariates { pull_index: i as u64, time_s, ..Covariates::default() },
            max_pull_force_n: label,
            zero_shift_n: 0.0,
            trace: (plan.trace_every > 0 && i % plan.trace_every == 0).then_some(trace),
        });
    }
    MeasuredPulls {
        pulls,
        recorded: ["part", "grip_force_n", "force_increment_n", "step_time_s", "pull_index", "time_s"]
            .map(String::from)
            .to_vec(),
        extra: vec![],
        label_tolerance_n: TOLERANCE_N,
        stop_m: STOP_M,
        feedback: Some(world.feedback),
        sha256: String::new(),
    }
}
