//! Diagnosis of ball presses: what a sensor file lacks.
//!
//! What presses look like under any effects is drawn here; what acts is found by [`gripgen_identify::diagnose_presses`].
//! `docs/diagnosis-presses.md`.

mod answer;
mod marks;
mod work;

pub use gripgen_identify::{PressCovariate, PressValues};

use super::diagnosed::Diagnosed;
use crate::TwinEdits;
use answer::{edits, remark};
use gripgen_identify::{MIN_DIAGNOSED_PRESSES, PressData, too_few_presses};
use gripgen_report::{PressPlace, ReportData, press_report};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::{Press, PressSet, ZONES};
use gripgen_twin::Covariates;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::PressNeeds;
use work::{Work, noise_mse};

/// Time from one press to the next where nobody wrote it down.
pub(crate) const ASSUMED_PRESS_S: f64 = 60.0;

/// Presses to diagnose.
#[derive(Debug, Clone)]
pub struct PressDiagnosisInput<'a> {
    /// The presses in the order in which they were taken; those without a circle are left out.
    pub set: &'a PressSet,
    /// The sensor file as it stands.
    pub sensor: &'a Sensor,
    /// Seconds since the first press, where it was written down; one press per minute is assumed otherwise.
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
    let data = PressData {
        names: input.set.presses.iter().map(|p| p.name.clone()).collect(),
        sha256: input.sha256.clone(),
        noise_mse: noise_mse(input.sensor),
        covariates: covariates(input),
        known: known(input),
        press_gain_sd: input.sensor.press_gain_sd.map(|sd| sd.map(f64::from)),
    };
    let n = input.set.presses.iter().filter(|p| p.circle.is_some()).count();
    if n < MIN_DIAGNOSED_PRESSES || n < input.set.presses.len() {
        let diagnosis = too_few_presses(&data, n);
        let report = ReportData { title: "Diagnosis of presses".into(), ..ReportData::default() };
        return Diagnosed::new(diagnosis, TwinEdits::default(), report);
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
    let mut found = gripgen_identify::diagnose_presses(&work, &data, progress);
    remark(&mut found.diagnosis, input, &work, &found.acting, scatter_px);
    let place = |press: &Press| PressPlace {
        name: press.name.clone(),
        place: press.circle.map_or(String::new(), |c| {
            format!("at ({:.0}, {:.0}), radius {:.0} px", c.x_px, c.y_px, c.radius_px)
        }),
    };
    let places: Vec<PressPlace> = input.set.presses.iter().map(place).collect();
    let report = press_report(&places, ZONES.map(|zone| zone.name()), &data.covariates, &found);
    let edits = edits(input, &found.diagnosis);
    Diagnosed::new(found.diagnosis, edits, report)
}

/// What is known of the presses beside their images.
fn known(input: &PressDiagnosisInput<'_>) -> Vec<PressNeeds> {
    let presses = &input.set.presses;
    let edges = presses.iter().any(|press| press.indenter.is_some());
    let depths = presses.iter().all(|press| press.travel_m.is_some());
    let all = [(input.marked, PressNeeds::Marks), (depths, PressNeeds::Depths), (edges, PressNeeds::Edges)];
    all.into_iter().filter(|(is_known, _)| *is_known).map(|(_, need)| need).collect()
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
