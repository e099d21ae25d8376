//! What a sweep will be: size, time, and whether its first samples and its outermost grips work.

use gripgen::Project;
use gripgen::SampleError;
use gripgen::drawn_scenario;
use gripgen::try_grip;
use gripgen::{SweepError, encode_filmed, guarded};
use gripgen_record::EncodedFrame;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{Jaw, Outcome, Pulled, Twin};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Samples that a plan tries out.
const PROBES: u64 = 6;

/// Samples among which the outermost grips are looked for, and grips that are tried.
const LOOKED_AT: u64 = 20_000;
const TRIED: usize = 96;

/// A sweep before it is run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of samples.
    pub samples: u64,
    /// Number of shards.
    pub shards: u64,
    /// Size on disk, from the samples tried out.
    pub estimated_bytes: u64,
    /// Processor time of the whole sweep, from the samples tried out.
    pub estimated_cpu: Duration,
    /// Samples tried out.
    pub probes: Vec<Probe>,
    /// Outermost grips of each part and pose that were tried.
    pub grips: Vec<TriedGrip>,
    /// Parts whose mesh has holes, and its open edges.
    pub open_meshes: Vec<(String, usize)>,
}

/// A grip of a part, at the ends of what the sweep draws for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TriedGrip {
    /// The part.
    pub part: String,
    /// Which of its grips.
    pub grip_pose: usize,
    /// Samples whose grip was tried.
    pub tried: usize,
    /// Samples whose grip fails or misses the part, and why.
    pub failed: Vec<(u64, String)>,
}

/// A sample that was tried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Its index.
    pub index: u64,
    /// How it ended.
    pub status: Status,
    /// Why, if it failed.
    pub failure: Option<String>,
    /// Whether the force loop lags beyond half the label tolerance.
    pub lag_exceeds_tolerance: bool,
    /// Mean pressure of the contact over Young's modulus of the gel, of the jaw where it is larger; `None` without an elastic gel.
    /// Beyond [`gripgen_tactile::LINEAR_PRESSURE_SHARE`] linear elasticity is an extrapolation.
    pub pressure_over_modulus: Option<f64>,
}

/// Tries out a few samples spread over the sweep and extrapolates. Writes nothing.
///
/// # Errors
///
/// No device for the GPU backend, or an image that cannot be compressed.
pub fn plan(project: &Project, simd: SimdLevel) -> Result<Plan, SweepError> {
    project.prepare_gpu()?;
    let samples = project.sweep.samples;
    let probes = PROBES.min(samples);
    let (mut bytes, mut tried) = (0, Vec::new());
    // The first sample also builds contact shapes, which later ones share.
    guarded(project, 0, simd);
    let start = Instant::now();
    for i in 0..probes {
        let index = ((i as f64 + 0.5) / probes as f64 * samples as f64) as u64;
        let (sample, film) = guarded(project, index, simd);
        let encoded = encode_filmed(project, &sample, film.as_ref())?;
        bytes += encoded.sample.len()
            + encoded.images.as_ref().map_or(0, |both| both.left.len() + both.right.len())
            + encoded.trace.as_ref().map_or(0, Vec::len)
            + encoded.film.iter().map(EncodedFrame::bytes).sum::<usize>()
            + encoded.states.iter().map(|s| s.data.len() + 31).sum::<usize>();
        let (mut failure, mut lag_exceeds_tolerance, mut pressure_over_modulus) = (None, false, None);
        match sample.outcome {
            Outcome::Failed { reason } => failure = Some(reason),
            Outcome::Pulled(pulled) => {
                lag_exceeds_tolerance = pulled.lag_exceeds_tolerance;
                // A sample that was pulled had a twin.
                pressure_over_modulus =
                    project.twin_of(index).ok().and_then(|twin| largest_pressure_share(&twin, &pulled));
            }
            Outcome::NoContact { .. } => {}
        }
        let status = encoded.status;
        tried.push(Probe { index, status, failure, lag_exceeds_tolerance, pressure_over_modulus });
    }
    let share = samples as f64 / probes as f64;
    Ok(Plan {
        samples,
        shards: project.sweep.shards(),
        estimated_bytes: (bytes as f64 * share) as u64,
        estimated_cpu: start.elapsed().mul_f64(share),
        probes: tried,
        grips: outermost_grips(project),
        open_meshes: open_meshes(project),
    })
}

/// Force, offset and angle of a sample.
type Place = [f64; 3];

/// Tries the grips of the samples that lie farthest out: largest and smallest force, offset and angle of each part and pose. The
/// samples are those of the sweep; they are gripped and pressed in, without images and pull.
fn outermost_grips(project: &Project) -> Vec<TriedGrip> {
    let mut drawn: BTreeMap<(String, usize), Vec<(u64, Place)>> = BTreeMap::new();
    for index in 0..project.sweep.samples.min(LOOKED_AT) {
        let scenario = drawn_scenario(project, index);
        let c = &scenario.covariates;
        let place = [scenario.grip_force_n, c.grip_offset_m, c.grip_angle_rad];
        drawn.entry((scenario.part, scenario.grip_pose)).or_default().push((index, place));
    }
    let each = (TRIED / drawn.len().max(1)).max(1);
    let of_grip = |((part, grip_pose), samples): ((String, usize), Vec<(u64, Place)>)| {
        let tried: Vec<u64> = corners(&samples).into_iter().take(each).collect();
        let outcomes: Vec<_> = tried.iter().map(|&index| (index, grips(project, index))).collect();
        // Some that miss the part are samples like others; a grip that misses it nearest to its own place, too, is a mistake.
        let missed = |outcome: &Result<bool, SampleError>| matches!(outcome, Ok(false));
        let nearest = samples.iter().min_by(|a, b| a.1[1].abs().total_cmp(&b.1[1].abs()));
        let all_miss = outcomes.iter().all(|(_, outcome)| missed(outcome))
            && nearest.is_some_and(|(index, _)| missed(&grips(project, *index)));
        let failure = |(index, outcome): (u64, Result<bool, SampleError>)| match outcome {
            Ok(true) => None,
            Ok(false) => all_miss.then(|| (index, "the jaws miss the part".to_string())),
            Err(e) => Some((index, e.to_string())),
        };
        let failed = outcomes.into_iter().filter_map(failure).collect();
        TriedGrip { part, grip_pose, tried: tried.len(), failed }
    };
    drawn.into_iter().map(of_grip).collect()
}

fn grips(project: &Project, index: u64) -> Result<bool, SampleError> {
    let twin = project.twin_of(index)?;
    let (scenario, usable) = project.sweep.scenario(index, &twin);
    usable?;
    try_grip(&twin, &project.library, &scenario)
}

/// The samples that lie farthest out towards each corner of what was drawn, high forces first.
fn corners(samples: &[(u64, Place)]) -> Vec<u64> {
    let range = |i: usize| {
        let values = samples.iter().map(|(_, place)| place[i]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
    };
    let ranges = [range(0), range(1), range(2)];
    // From -1 to 1; 0 for what does not vary.
    let at = |place: &Place, i: usize| {
        let (low, high) = ranges[i];
        if high > low { 2.0 * (place[i] - low) / (high - low) - 1.0 } else { 0.0 }
    };
    let mut found = Vec::new();
    for corner in 0..8 {
        let sign = |bit: usize| if corner >> (2 - bit) & 1 == 0 { 1.0 } else { -1.0 };
        let out = |place: &Place| (0..3).map(|i| sign(i) * at(place, i)).sum::<f64>();
        let farthest = samples.iter().reduce(|best, s| if out(&s.1) > out(&best.1) { s } else { best });
        found.extend(farthest.map(|(index, _)| *index).filter(|index| !found.contains(index)));
    }
    found
}

/// Parts of the twin whose mesh has holes.
fn open_meshes(project: &Project) -> Vec<(String, usize)> {
    let look = |(name, part): (&String, &gripgen_twin::Part)| {
        let open_edges = project.library.mesh(part).ok()?.look().open_edges;
        (open_edges > 0).then(|| (name.clone(), open_edges))
    };
    project.twin.parts.iter().filter_map(look).collect()
}

/// Mean pressure over modulus of the jaw where it is larger; `None` where no gel is elastic.
fn largest_pressure_share(twin: &Twin, pulled: &Pulled) -> Option<f64> {
    let shares = Jaw::BOTH.into_iter().filter_map(|jaw| {
        let gel = &twin.gel[jaw];
        let elastic = gel.elastic.filter(|_| gel.model == GelModel::Elastic)?;
        let patch = &pulled.imprint[jaw].patch;
        Some(patch.normal_force_n() / patch.area_m2() / elastic.young_modulus_pa)
    });
    shares.reduce(f64::max)
}
