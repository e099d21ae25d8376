//! What a diagnosis of any channel hands back.

use super::next::NextPulls;
use crate::analysis::twin_edits::TwinEdits;
use gripgen_identify::Diagnosis;
use gripgen_report::{ReportData, doubt};
use gripgen_twin::Posterior;

/// An answer with what follows from it.
#[derive(Debug, Clone)]
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// What it changes in the twin.
    pub edits: TwinEdits,
    /// What the report shows.
    pub report: ReportData,
    /// The pulls that would tell apart what these could not.
    pub next: Option<NextPulls>,
    /// Overrides of the twin that make the parts which it lacks.
    pub sets: Vec<(String, String)>,
    /// Draws of cause and parameters, of pulls.
    pub posterior: Option<Posterior>,
}

impl Diagnosed {
    /// An answer, with its sentences for a technician: what was found, and that its name is not sure where it is not.
    pub(crate) fn new(mut diagnosis: Diagnosis, edits: TwinEdits, report: ReportData) -> Self {
        let mut plain = gripgen_identify::summary_sentence(&diagnosis);
        if let Some(doubt) = doubt(&diagnosis, &report.evidence) {
            plain += &format!(" {doubt}");
        }
        diagnosis.plain = Some(plain);
        Self { diagnosis, edits, report, next: None, sets: Vec::new(), posterior: None }
    }
}
