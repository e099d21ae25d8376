//! Planning a first campaign: pulls from which effects can be told apart.
//!
//! The published experiment varies nothing but the grip force, in order; then offset, bias, rate and drift look alike
//! (`docs/diagnosis.md`). The plan here varies force, step height, step time, dwell and direction independently, in a
//! random order within blocks that each hold all forces, makes every setting twice in different sessions, and repeats one
//! reference grip throughout, which separates what comes with time and use from the rest.

use crate::Draws;
use gripgen_twin::{Campaign, PlannedPull, PullKind};

/// What a first campaign is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignOptions {
    /// Names of the parts.
    pub parts: Vec<String>,
    /// Pulls to make, reference grips included.
    pub pulls: usize,
    /// Sessions, with a pause before each but the first.
    pub sessions: usize,
    /// Seed of the order.
    pub seed: u64,
    /// Smallest grip force, per jaw: where the laws of the twin begin.
    pub min_force_n: f64,
    /// Largest grip force, per jaw.
    pub max_force_n: f64,
    /// Grip angles to use.
    pub angles_deg: Vec<f64>,
    /// Grip offsets to use.
    pub offsets_mm: Vec<f64>,
    /// A reference grip stands before every so many others.
    pub reference_every: usize,
    /// Tolerance of the label rule.
    pub label_tolerance_n: f64,
    /// Displacement at which a pull ends.
    pub stop_m: f64,
}

impl Default for CampaignOptions {
    fn default() -> Self {
        Self {
            parts: Vec::new(),
            pulls: 120,
            sessions: 3,
            seed: 1,
            min_force_n: 0.0,
            max_force_n: 80.0,
            angles_deg: vec![0.0],
            offsets_mm: vec![0.0],
            reference_every: 8,
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
        }
    }
}

/// Why a campaign cannot be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// Nothing to pull.
    #[error("there are no parts to pull")]
    NoParts,
    /// Too few pulls to tell anything.
    #[error("{pulls} pulls are too few for {parts} parts: at least {least}")]
    TooFew {
        /// Pulls asked for.
        pulls: usize,
        /// Parts.
        parts: usize,
        /// Pulls that are needed.
        least: usize,
    },
    /// More sessions than pulls.
    #[error("{sessions} sessions for {pulls} pulls: at most {most}, and at least one")]
    Sessions {
        /// Sessions asked for.
        sessions: usize,
        /// Pulls asked for.
        pulls: usize,
        /// Sessions that make sense.
        most: usize,
    },
    /// A number that cannot be.
    #[error("{name} is {value}, it must be a number above 0")]
    Number {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Grip forces of a gripper that reaches 80 N; three lie below 20 N, where offsets show.
pub const FORCES_N: [f64; 8] = [5.0, 8.0, 12.0, 20.0, 30.0, 45.0, 60.0, 80.0];
/// The highest with the shortest step is 29 N/s: what force mode is late by (0.05 s, a UR5e) and the step together stay below
/// the 3 N of the label rule, beyond which labels end a step early.
const INCREMENTS_N: [f64; 3] = [0.5, 1.0, 1.5];
const STEPS_S: [f64; 3] = [0.052, 0.104, 0.208];
/// Dwells that are used: ageing and relaxation go with their logarithm.
pub const DWELLS_S: [f64; 3] = [1.0, 10.0, 60.0];
const DIRECTIONS: [f64; 2] = [1.0, -1.0];
/// Pause before a session: temperature, gel and sensor come to rest.
const PAUSE_S: f64 = 1500.0;
/// How long the sensor is read without a load.
pub const NO_LOAD_S: f64 = 5.0;
/// Assignments of the factors that are tried; the least correlated one is kept.
const TRIES: u64 = 60;

/// Plans a first campaign. The same options give the same plan.
///
/// # Errors
///
/// No parts, too few pulls for the parts or the sessions, or an option that is no number above 0.
pub fn plan_campaign(options: &CampaignOptions) -> Result<Campaign, CampaignError> {
    check(options)?;
    let forces_n = levels_n(options.min_force_n, options.max_force_n);
    let references = options.pulls.div_ceil(options.reference_every + 1);
    let design = options.pulls - references;
    // Each setting is made twice.
    let unique = design.div_ceil(2);
    let settings = (0..TRIES)
        .map(|lane| assign(options, &forces_n, unique, lane))
        .min_by(|a, b| worst_correlation(a).total_cmp(&worst_correlation(b)))
        .unwrap_or_default();
    let mut draws = Draws::new(options.seed, TRIES);
    let mut order = in_blocks(&settings, forces_n.len(), &mut draws);
    order.extend(in_blocks(&settings, forces_n.len(), &mut draws).into_iter().take(design - unique));
    let reference = PlannedPull {
        part: options.parts[0].clone(),
        grip_force_n: forces_n[forces_n.len() / 2],
        ..PlannedPull::default()
    };
    let mut pulls = Vec::with_capacity(options.pulls);
    let mut left = references;
    for (i, setting) in order.into_iter().enumerate() {
        if i % options.reference_every == 0 && left > 0 {
            pulls.push(reference.clone());
            left -= 1;
        }
        pulls.push(setting);
    }
    pulls.extend(std::iter::repeat_n(reference, left));
    let pulls = in_sessions(pulls, options.sessions);
    let (label_tolerance_n, stop_m) = (options.label_tolerance_n, options.stop_m);
    Ok(Campaign { label_tolerance_n, stop_m, feedback: None, pulls })
}

fn check(options: &CampaignOptions) -> Result<(), CampaignError> {
    let parts = options.parts.len();
    if parts == 0 {
        return Err(CampaignError::NoParts);
    }
    let numbers = [
        ("the largest grip force", options.max_force_n),
        ("the tolerance of the label rule", options.label_tolerance_n),
        ("the stop", options.stop_m),
        ("the distance of reference grips", options.reference_every as f64),
    ];
    for (name, value) in numbers {
        if !(value.is_finite() && value > 0.0) {
            return Err(CampaignError::Number { name, value });
        }
    }
    let least = 6 * parts;
    if options.pulls < least {
        return Err(CampaignError::TooFew { pulls: options.pulls, parts, least });
    }
    let most = options.pulls / 3;
    if !(1..=most).contains(&options.sessions) {
        return Err(CampaignError::Sessions { sessions: options.sessions, pulls: options.pulls, most });
    }
    Ok(())
}

/// The forces that a gripper reaches and a twin knows; in a short range, or of a weak gripper, six in equal ratios.
fn levels_n(min_force_n: f64, max_force_n: f64) -> Vec<f64> {
    let reached = |f: &f64| (min_force_n..=max_force_n).contains(f);
    if max_force_n >= 30.0 && FORCES_N.iter().filter(|&f| reached(f)).count() >= 4 {
        let mut levels: Vec<f64> = FORCES_N.iter().copied().filter(reached).collect();
        // The upper end itself, where it lies well above the last.
        if levels.last().is_some_and(|&last| max_force_n > 1.2 * last) {
            levels.push(max_force_n);
        }
        return levels;
    }
    let least = (max_force_n * libm::pow(0.62, 5.0)).max(min_force_n).min(max_force_n);
    let level = |i| max_force_n * libm::pow(least / max_force_n, f64::from(5 - i) / 5.0);
    (0..6).map(|i| (level(i) * 100.0).round() / 100.0).map(|f| f.clamp(least, max_force_n)).collect()
}

/// Settings in blocks that hold each force once; every other factor is balanced and independent.
fn assign(options: &CampaignOptions, forces_n: &[f64], unique: usize, lane: u64) -> Vec<PlannedPull> {
    let mut draws = Draws::new(options.seed, lane);
    // The parts go round block by block, so that each part has every force.
    let part = |i: usize| &options.parts[(i / forces_n.len() + i) % options.parts.len()];
    let mut column = |levels: &[f64]| {
        let mut column: Vec<f64> = (0..unique).map(|i| levels[i % levels.len()]).collect();
        draws.shuffle(&mut column);
        column
    };
    let (increments, steps, dwells) = (column(&INCREMENTS_N), column(&STEPS_S), column(&DWELLS_S));
    let (directions, angles, offsets) =
        (column(&DIRECTIONS), column(or_zero(&options.angles_deg)), column(or_zero(&options.offsets_mm)));
    (0..unique)
        .map(|i| PlannedPull {
            part: part(i).clone(),
            grip_force_n: forces_n[i % forces_n.len()],
            force_increment_n: increments[i],
            step_time_s: steps[i],
            dwell_s: dwells[i],
            pull_direction: directions[i],
            grip_angle_deg: angles[i],
            grip_offset_mm: offsets[i],
            ..PlannedPull::default()
        })
        .collect()
}

fn or_zero(levels: &[f64]) -> &[f64] {
    if levels.is_empty() { &[0.0] } else { levels }
}

/// The factors of a setting on the scales on which effects are straight.
fn factors(pull: &PlannedPull) -> [f64; 7] {
    [
        libm::log(pull.grip_force_n),
        libm::log(pull.force_increment_n),
        libm::log(pull.step_time_s),
        libm::log(pull.dwell_s),
        pull.pull_direction,
        pull.grip_angle_deg,
        pull.grip_offset_mm,
    ]
}

/// The largest absolute correlation between two factors of a design; constant ones have none.
fn worst_correlation(pulls: &[PlannedPull]) -> f64 {
    let rows: Vec<[f64; 7]> = pulls.iter().map(factors).collect();
    let n = rows.len() as f64;
    let mean = |a: usize| rows.iter().map(|r| r[a]).sum::<f64>() / n;
    let means: Vec<f64> = (0..7).map(mean).collect();
    let covariance =
        |a: usize, b: usize| rows.iter().map(|r| (r[a] - means[a]) * (r[b] - means[b])).sum::<f64>();
    let mut worst = 0.0f64;
    for a in 0..7 {
        for b in 0..a {
            let scale = libm::sqrt(covariance(a, a) * covariance(b, b));
            if scale > 1e-12 {
                worst = worst.max((covariance(a, b) / scale).abs());
            }
        }
    }
    worst
}

/// Blocks in random order, and each in random order inside.
fn in_blocks(settings: &[PlannedPull], block: usize, draws: &mut Draws) -> Vec<PlannedPull> {
    let mut blocks: Vec<Vec<PlannedPull>> = settings.chunks(block).map(<[PlannedPull]>::to_vec).collect();
    draws.shuffle(&mut blocks);
    for block in &mut blocks {
        draws.shuffle(block);
    }
    blocks.concat()
}

/// Cuts the pulls into sessions of equal length; each begins and ends with a reading without a load.
fn in_sessions(pulls: Vec<PlannedPull>, sessions: usize) -> Vec<PlannedPull> {
    let (n, mut planned) = (pulls.len(), Vec::with_capacity(pulls.len() + 2 * sessions));
    let mut rest = pulls.into_iter();
    for session in 0..sessions {
        let size = n * (session + 1) / sessions - n * session / sessions;
        let name = (session + 1).to_string();
        let reading = |pause_s: f64| PlannedPull {
            kind: PullKind::NoLoad,
            dwell_s: NO_LOAD_S,
            pause_s,
            session: name.clone(),
            ..PlannedPull::default()
        };
        planned.push(reading(if session == 0 { 0.0 } else { PAUSE_S }));
        planned.extend(rest.by_ref().take(size).map(|pull| PlannedPull { session: name.clone(), ..pull }));
        planned.push(reading(0.0));
    }
    planned
}

#[cfg(test)]
mod tests;
