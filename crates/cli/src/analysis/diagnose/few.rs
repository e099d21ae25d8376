//! Diagnosis of so few pulls that nothing gets a name: the calibrated twin, and what to pull next.

use super::diagnosed::Diagnosed;
use super::next::NextPulls;
use super::pull_values::pull_values;
use crate::analysis::priors::shipped_priors;
use crate::analysis::twin_edits::TwinEdits;
use gripgen_identify::pulls::few_diagnosis::diagnose_few;
use gripgen_identify::{CampaignOptions, plan_campaign};
use gripgen_physics::PullPredictor;
use gripgen_report::ReportData;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{MeasuredPulls, Twin};

/// Pulls that are planned for a part, and at least.
const PULLS_OF_A_PART: usize = 20;
const LEAST_PULLS: usize = 40;

/// Says what a few pulls show, and plans a campaign of the same parts.
pub(super) fn diagnose_few_pulls(
    measured: &MeasuredPulls,
    predictor: &PullPredictor<'_>,
    given: &PullModel,
    twin: &Twin,
) -> Diagnosed {
    let answer = diagnose_few(measured, predictor, given, &shipped_priors(twin));
    let evidence = format!("gripgen diagnose of {} pulls", measured.pulls.len());
    let parts = predictor.part_names();
    let edits = answer.found.as_ref().map(|found| TwinEdits {
        values: pull_values(&found.model, &found.baseline, predictor, &evidence, &measured.sha256),
        effects: Some(vec![]),
    });
    let pulls = (PULLS_OF_A_PART * parts.len()).max(LEAST_PULLS);
    let forces = || measured.pulls.iter().map(|pull| pull.grip_force_n);
    let (least_n, most_n) = (forces().fold(f64::INFINITY, f64::min), forces().fold(0.0, f64::max));
    let options = CampaignOptions {
        // A range that was measured is one that the gripper has; of one force alone the weaker ones are tried, too.
        min_force_n: if least_n < most_n { least_n } else { 0.0 },
        parts: parts.to_vec(),
        pulls,
        max_force_n: twin.gripper.max_force_n.min(80.0),
        label_tolerance_n: measured.label_tolerance_n,
        stop_m: measured.stop_m,
        ..CampaignOptions::default()
    };
    let next =
        plan_campaign(&options).ok().map(|campaign| NextPulls { campaign, apart: vec![], left: vec![] });
    let mut diagnosis = answer.diagnosis;
    if let Some(next) = &next {
        diagnosis.notes.push(format!("what to pull next: {}", next.text()));
    }
    let report = ReportData { error_unit: "N".into(), ..ReportData::default() };
    let posterior = answer.found.map(|found| found.posterior);
    Diagnosed { next, posterior, ..Diagnosed::new(diagnosis, edits.unwrap_or_default(), report) }
}
