//! What a sweep will be: size, time, and whether its first samples work.

use crate::project::Project;
use crate::sweep::{SweepError, encode_options, guarded};
use gripgen_record::encode;
use gripgen_record::proto::gripgen_v1::Status;
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{Jaw, Outcome, Pulled, Twin};
use std::time::{Duration, Instant};

/// Samples that a plan tries out.
const PROBES: u64 = 6;

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
        let sample = guarded(project, index, simd);
        let encoded = encode(&sample, &encode_options(project, index))?;
        bytes += encoded.sample.len()
            + encoded.images.as_ref().map_or(0, |both| both.left.len() + both.right.len())
            + encoded.trace.as_ref().map_or(0, Vec::len)
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
    })
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
