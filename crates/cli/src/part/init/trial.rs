//! Trying grips as the sweep will: the sweep's own code, forces, offsets and angles.

use super::pose::GripAt;
use gripgen::Library;
use gripgen::SampleError;
use gripgen::in_parallel;
use gripgen::try_grip;
use gripgen_tactile::IndentError;
use gripgen_twin::{Covariates, Part, PullSettings, Scenario, Twin};
use std::collections::BTreeMap;

/// Angles, offsets and forces that a sweep may have; a narrower one leaves some out.
pub(crate) const ANGLES_DEG: [f64; 4] = [0.0, 30.0, 60.0, 90.0];
const OFFSET_SDS_MM: [f64; 3] = [1.0, 0.5, 0.25];
pub(crate) const HIGHEST_N: [f64; 3] = [40.0, 20.0, 10.0];
pub(super) const LOWEST_N: f64 = 5.0;
/// Offsets are tried as far out as this many standard deviations: 1 draw in 370 lies beyond.
const SDS: f64 = 3.0;

/// What a sweep varies beside the grip.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// Smallest and largest grip force of a jaw.
    pub grip_force_n: (f64, f64),
    /// Standard deviation of the grip offset.
    pub grip_offset_sd_mm: f64,
    /// Grip angles.
    pub grip_angle_deg: Vec<f64>,
}

/// Where a grip works.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trial {
    /// In the order of [`ANGLES_DEG`], then of [`offsets_mm`].
    pub(crate) cells: Vec<TrialCell>,
}

/// How a grip does at an angle and an offset.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrialCell {
    pub(crate) angle_deg: f64,
    pub(crate) offset_mm: f64,
    /// The largest force that was tried and works; 0 if none does.
    pub(crate) largest_n: f64,
    /// Why a larger force, or every one, fails.
    pub(crate) failure: Option<String>,
}

/// Offsets tried: the middle, and both ends of each spread.
fn offsets_mm() -> Vec<f64> {
    std::iter::once(0.0).chain(OFFSET_SDS_MM.iter().flat_map(|sd| [SDS * sd, -SDS * sd])).collect()
}

/// A part with the grips that are tried.
pub(super) struct Trials<'a> {
    twin: Twin,
    library: &'a Library,
    name: String,
}

impl<'a> Trials<'a> {
    pub(super) fn new(baseline: &Twin, library: &'a Library, part: Part, grips: &[GripAt]) -> Self {
        let name = "part".to_string();
        let part = Part { grips: grips.iter().map(GripAt::part_from_mesh).collect(), ..part };
        let twin = Twin { parts: BTreeMap::from([(name.clone(), part)]), ..baseline.clone() };
        Self { twin, library, name }
    }

    /// Tries every grip at all angles and offsets.
    pub(super) fn run(&self, threads: usize) -> Vec<Trial> {
        in_parallel(self.twin.parts[&self.name].grips.len(), threads, |grip| self.try_all(grip))
    }

    /// Why the first grip does not stand a variation, at its outermost offsets and forces and at each of its angles; `None` if it does.
    pub(super) fn fails(&self, varied: &Varied) -> Option<String> {
        let out_mm = SDS * varied.grip_offset_sd_mm;
        for &angle_deg in &varied.grip_angle_deg {
            for offset_mm in [0.0, out_mm, -out_mm] {
                for force_n in [varied.grip_force_n.1, varied.grip_force_n.0] {
                    let outcome = self.holds(0, angle_deg, offset_mm, force_n);
                    if !matches!(outcome, Ok(true)) {
                        return Some(said(&outcome));
                    }
                }
            }
        }
        None
    }

    fn try_all(&self, grip: usize) -> Trial {
        let places = ANGLES_DEG.iter().flat_map(|&angle| offsets_mm().into_iter().map(move |o| (angle, o)));
        let cell = |(angle_deg, offset_mm)| {
            let (largest_n, failure) = self.largest_n(grip, angle_deg, offset_mm);
            TrialCell { angle_deg, offset_mm, largest_n, failure }
        };
        Trial { cells: places.map(cell).collect() }
    }

    /// The largest force that works, 0 if none does, and why a larger one does not.
    fn largest_n(&self, grip: usize, angle_deg: f64, offset_mm: f64) -> (f64, Option<String>) {
        let mut failure = None;
        for force_n in HIGHEST_N {
            match self.holds(grip, angle_deg, offset_mm, force_n) {
                // The smallest force needs less of everything but a contact.
                Ok(true) => match self.holds(grip, angle_deg, offset_mm, LOWEST_N) {
                    Ok(true) => return (force_n, failure),
                    other => return (0.0, Some(said(&other))),
                },
                other => {
                    let too_hard =
                        matches!(&other, Err(SampleError::Indent { source, .. }) if is_deep(source));
                    failure = Some(said(&other));
                    if !too_hard {
                        return (0.0, failure);
                    }
                }
            }
        }
        (0.0, failure)
    }

    fn holds(&self, grip: usize, angle_deg: f64, offset_mm: f64, force_n: f64) -> Result<bool, SampleError> {
        try_grip(&self.twin, self.library, &scenario(&self.name, grip, angle_deg, offset_mm, force_n))
    }
}

fn is_deep(error: &IndentError) -> bool {
    matches!(error, IndentError::ThroughTheGel { .. } | IndentError::DeeperThanTheGel { .. })
}

fn said(outcome: &Result<bool, SampleError>) -> String {
    match outcome {
        Ok(_) => "the jaws meet without touching the part".into(),
        Err(e) => e.to_string(),
    }
}

fn scenario(part: &str, grip: usize, angle_deg: f64, offset_mm: f64, force_n: f64) -> Scenario {
    let covariates = Covariates {
        grip_offset_m: offset_mm * 1e-3,
        grip_angle_rad: angle_deg.to_radians(),
        ..Covariates::default()
    };
    Scenario {
        seed: 1,
        index: 0,
        group: 0,
        repetition: 0,
        part: part.into(),
        grip_pose: grip,
        grip_force_n: force_n,
        covariates,
        pull: PullSettings::default(),
        drawn: BTreeMap::new(),
    }
}

impl Trial {
    /// Whether the grip works wherever a sweep goes.
    pub(super) fn works(&self, varied: &Varied) -> bool {
        let tried = self.cells.iter().filter(|cell| {
            varied.grip_angle_deg.contains(&cell.angle_deg)
                && cell.offset_mm.abs() <= SDS * varied.grip_offset_sd_mm + 1e-9
        });
        tried.clone().all(|cell| cell.largest_n >= varied.grip_force_n.1)
    }

    /// Why the grip failed where it first did.
    pub(super) fn failure(&self) -> Option<&String> {
        self.cells.iter().find_map(|cell| cell.failure.as_ref())
    }
}

/// What a sweep may vary, the widest first: forces, offsets and angles are given up one by one.
pub(super) fn widest_first() -> Vec<(usize, Varied)> {
    let mut all = Vec::new();
    for (f, highest_n) in HIGHEST_N.into_iter().enumerate() {
        for (o, grip_offset_sd_mm) in OFFSET_SDS_MM.into_iter().enumerate() {
            for angles in 1_usize..1 << ANGLES_DEG.len() {
                let chosen = |(i, angle): (usize, f64)| (angles >> i & 1 == 1).then_some(angle);
                let grip_angle_deg: Vec<f64> =
                    ANGLES_DEG.into_iter().enumerate().filter_map(chosen).collect();
                let given_up = ANGLES_DEG.len() - grip_angle_deg.len();
                let grip_force_n = (LOWEST_N, highest_n);
                all.push((2 * f + o + given_up, Varied { grip_force_n, grip_offset_sd_mm, grip_angle_deg }));
            }
        }
    }
    all.sort_by_key(|a| a.0);
    all
}
