//! The report of a diagnosis: one HTML page with its plots inside.

mod axis;
mod bars;
mod comparison;
mod doubt;
mod histogram;
mod page;
mod plot;
mod sections;
mod sentence;
#[cfg(test)]
mod tests;

pub use comparison::{PageTable, comparison_page};
pub(crate) use doubt::one_for_all;
pub(crate) use histogram::Histogram;
pub use page::diagnosis_page;
pub(crate) use page::{clean, figure, rendered_with};
pub(crate) use sections::{PageFigure, PageSection, jpeg_url, png_url, sections_page};

use gripgen_identify::Diagnosis;
use gripgen_twin::Posterior;

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A dot each, with a bar where an error is given.
    Points,
    /// Joined by a line.
    Line,
    /// The outline of an area, which is filled.
    Band,
}

/// Points of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// (x, y) of each point.
    pub points: Vec<(f64, f64)>,
    /// Half lengths of error bars, or empty.
    pub errors: Vec<f64>,
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// Label of the x axis, with its unit.
    pub x_label: String,
    /// Label of the y axis, with its unit.
    pub y_label: String,
    /// Words in place of the numbers 0, 1, 2... of the x axis, for covariates that are words.
    pub x_words: Vec<String>,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Plots that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotGroup {
    /// Heading.
    pub title: String,
    /// A sentence below it.
    pub about: String,
    /// The plots.
    pub plots: Vec<Plot>,
}

/// A candidate in the table of evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct EvidenceRow {
    /// Its name: an effect, "none", or "curve in humidity_pct".
    pub name: String,
    /// Gain in held-out log-likelihood over the model without it.
    pub heldout_gain: f64,
    /// Standard error of that.
    pub standard_error: f64,
    /// Error on held-out data with it.
    pub heldout_error: f64,
    /// Fitted values, for people.
    pub values: String,
    /// What became of it: "named", "tied with wear", "worse", "as good on held-out pulls", "contradicted by the traces".
    pub fate: String,
}

/// An observation that fits badly.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstRow {
    /// Its id.
    pub id: String,
    /// What it is, for people: part, force.
    pub about: String,
    /// Measured.
    pub measured: f64,
    /// Predicted after the effects were added.
    pub predicted: f64,
    /// Difference in standard deviations.
    pub deviations: f64,
}

/// What the page shows beside the diagnosis itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportData {
    /// Title of the page.
    pub title: String,
    /// The verdict in one sentence.
    pub sentence: String,
    /// Plots in the order of the page.
    pub groups: Vec<PlotGroup>,
    /// How many of these decide the answer: they stand before everything else.
    pub decides: usize,
    /// What to do next: a sentence, and a command or nothing.
    pub next: Vec<(String, String)>,
    /// The candidates.
    pub evidence: Vec<EvidenceRow>,
    /// The worst observations.
    pub worst: Vec<WorstRow>,
    /// The unit of errors: `N`, or `grey levels^2`.
    pub error_unit: String,
}

/// What a diagnosis of any channel hands back.
#[derive(Debug, Clone)]
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// What it changes in the twin.
    pub edits: crate::TwinEdits,
    /// What the report shows.
    pub report: ReportData,
    /// The pulls that would tell apart what these could not.
    pub next: Option<crate::NextPulls>,
    /// Draws of cause and parameters, of pulls.
    pub posterior: Option<Posterior>,
}

impl Diagnosed {
    /// An answer, with its sentences for a technician: what was found, and that its name is not sure where it is not.
    pub(crate) fn new(mut diagnosis: Diagnosis, edits: crate::TwinEdits, report: ReportData) -> Self {
        let mut plain = gripgen_identify::summary_sentence(&diagnosis);
        if let Some(doubt) = doubt::doubt(&diagnosis, &report.evidence) {
            plain += &format!(" {doubt}");
        }
        diagnosis.plain = Some(plain);
        Self { diagnosis, edits, report, next: None, posterior: None }
    }
}
