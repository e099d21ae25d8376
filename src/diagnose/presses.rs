//! Diagnosis of ball presses: what a sensor file lacks.
//!
//! The baseline is the sensor file as it stands; nothing of it is refitted. Each optics effect of the library is fitted
//! to the presses, scored on presses that its fit has not seen, and compared with the others, with nothing, and with
//! smooth fields that have no name. The press is the unit of all of it: pixels of one image err together.
//! `docs/diagnosis-presses.md`.

mod answer;
mod candidates;
mod marks;
mod page;
mod score;
mod search;
mod unnamed;
mod work;

pub use unnamed::{PressCovariate, PressValues};

use crate::report::Diagnosed;
use answer::{Answer, insufficient};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::PressSet;
use gripgen_twin::Covariates;
use gripgen_twin::config::EffectFile;
use search::{candidates, search};
use work::Work;

/// Presses at least.
const FEWEST_PRESSES: usize = 4;

/// Time from one press to the next where nobody wrote it down.
pub(crate) const ASSUMED_PRESS_S: f64 = 60.0;

/// Presses to diagnose.
#[derive(Debug, Clone)]
pub struct PressDiagnosisInput<'a> {
    /// The presses in the order in which they were taken; those without a circle are left out.
    pub set: &'a PressSet,
    /// The sensor file as it stands.
    pub sensor: &'a Sensor,
    /// Seconds since the first press, where it was written down; one press a minute is assumed otherwise.
    pub time_s: Option<Vec<f64>>,
    /// Further columns of the table, a value for each press.
    pub covariates: Vec<PressCovariate>,
    /// Whether the contacts were marked: circles that were found in the images say nothing of where they should be.
    pub marked: bool,
    /// Hash of the data.
    pub sha256: String,
    /// Effects of the twin that are not of the optics, which its new version keeps.
    pub kept_effects: Vec<EffectFile>,
}

/// Diagnoses presses. `progress` hears how far it is, from 0 to 1, and what is tried.
pub fn diagnose_presses(input: &PressDiagnosisInput<'_>, progress: &mut dyn FnMut(f64, &str)) -> Diagnosed {
    let n = input.set.presses.iter().filter(|p| p.circle.is_some()).count();
    if n < FEWEST_PRESSES || n < input.set.presses.len() {
        let missing = format!("{n} presses with a visible contact, {FEWEST_PRESSES} are needed");
        return insufficient(input, &missing);
    }
    let circumstances: Vec<Covariates> = (0..n)
        .map(|i| Covariates {
            pull_index: i as u64,
            time_s: input.time_s.as_ref().map_or(i as f64 * ASSUMED_PRESS_S, |t| t[i]),
            ..Default::default()
        })
        .collect();
    progress(0.0, "drawing the presses");
    let mut work = Work::new(input.set, input.sensor, circumstances);
    let scatter_px = marks::straighten(&mut work);
    let covariates = covariates(input);
    let found = search(&mut work, &covariates, &candidates(input.marked), progress);
    progress(0.97, "whole frames");
    Answer { input, work: &work, found: &found, covariates: &covariates, scatter_px }.diagnosed()
}

/// Whether a name is that of an effect on images.
pub fn is_optics_effect(name: &str) -> bool {
    gripgen_twin::effects::find(name).is_some_and(|spec| spec.optics.is_some())
}

/// What the residual may depend on: order, place and size of the contact, further columns.
fn covariates(input: &PressDiagnosisInput<'_>) -> Vec<PressCovariate> {
    let circles: Vec<_> = input.set.presses.iter().filter_map(|p| p.circle).collect();
    let numbers = |name: &str, of: &dyn Fn(usize) -> f64| PressCovariate {
        name: name.into(),
        values: PressValues::Numbers((0..circles.len()).map(of).collect()),
    };
    let mut list = vec![
        numbers("pull_index", &|i| i as f64),
        numbers("x_px", &|i| circles[i].x_px),
        numbers("y_px", &|i| circles[i].y_px),
        numbers("radius_px", &|i| circles[i].radius_px),
    ];
    list.extend(
        input
            .covariates
            .iter()
            .map(|c| PressCovariate { name: c.name.clone(), values: c.values.clone().without_gaps() }),
    );
    list
}
