//! What a diagnosis says, as it stands in `diagnose --json` (DESIGN 5.4).

use crate::effect_search::separating;
use gripgen_twin::effects::{Experiment, Measured, find};
use serde::Serialize;
use std::collections::BTreeMap;

/// Format string of the document.
pub const DIAGNOSIS_SCHEMA: &str = "gripgen.diagnosis/1";

/// What kind of measurement was diagnosed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Pulls: labels and traces.
    Pulls,
    /// A table of a force sensor beside a reference.
    Sensor,
    /// Presses of a ball on a tactile sensor.
    Presses,
    /// Imprints of grasps beside the normal force of the jaw.
    Imprints,
}

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing beyond the baseline.
    None,
    /// One or more effects of the library act.
    Effect,
    /// There is structure that no effect of the library explains.
    Unknown,
    /// The data cannot answer; [`Diagnosis::notes`] says what is missing.
    Insufficient,
}

/// What was looked at.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DataSummary {
    /// Pulls, of the pull channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulls: Option<usize>,
    /// Those with a trace.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traces: Option<usize>,
    /// Rows, of the sensor channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<usize>,
    /// Presses, of the press channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub presses: Option<usize>,
    /// Imprints, of the imprint channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imprints: Option<usize>,
    /// Their grasps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grasps: Option<usize>,
    /// Missing cells of each column that other rows fill.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub missing_cells: BTreeMap<String, usize>,
    /// Hash of the data.
    pub sha256: String,
    /// Names of observations that fit nothing and were given little weight: worst first.
    pub outliers: Vec<String>,
}

/// A value nearer than this share of its range to a bound stands at it.
const NEAR_BOUND: f64 = 1e-3;

/// Weight at most of an effect with a value at a bound.
const MAX_WEIGHT_AT_BOUND: f64 = 0.5;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterEstimate {
    /// Value.
    pub value: f64,
    /// Lower end of the 90 % interval.
    pub low90: f64,
    /// Upper end of the 90 % interval.
    pub high90: f64,
    /// Unit, `1` for a plain number.
    pub unit: String,
    /// Whether the fit ended at a bound of the parameter that is not its neutral value: something else may look like it.
    #[serde(skip_serializing_if = "is_false")]
    pub at_bound: bool,
}

impl ParameterEstimate {
    /// A value with its 90 % interval, inside its bounds. An interval of another method than the value may miss it, and is widened up to
    /// it: nobody is told a value that its own interval rules out.
    pub fn new(value: f64, (low90, high90): (f64, f64), unit: &str) -> Self {
        // Written so that an end that is not known stays so.
        let low90 = if low90 > value { value } else { low90 };
        let high90 = if high90 < value { value } else { high90 };
        Self { value, low90, high90, unit: unit.into(), at_bound: false }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_false(flag: &bool) -> bool {
    !*flag
}

/// What looked like an effect and did not pay: it is not in the twin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hint {
    /// Id of the effect, or the covariate of a curve.
    pub name: String,
    /// Share of the root mean squared error that it takes off data that were held out.
    pub gain: f64,
    /// Why it is no name.
    pub reason: String,
}

/// What was learnt of the data without a name: it is in the twin as tables that are not physical.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Residual {
    /// Share of the root mean squared error that it takes off data that were held out.
    pub gain: f64,
    /// The covariates it depends on, the strongest first; products as `a*b`.
    pub covariates: Vec<String>,
}

/// An effect that the data do not tell from the one named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rival {
    /// Its id.
    pub name: String,
    /// Its share of the evidence.
    pub weight: f64,
}

/// The experiment that separates rivals.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SeparateBy {
    /// For people.
    pub text: String,
    /// The campaign file, where one was written.
    pub campaign: Option<String>,
}

/// An effect that acts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedEffect {
    /// Its id.
    pub name: String,
    /// The only part it acts on, if it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// It and what is confused with it.
    pub class: Vec<String>,
    /// Its share of the evidence.
    pub weight: f64,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, ParameterEstimate>,
    /// What it cannot be told apart from in these data.
    pub indistinguishable_from: Vec<Rival>,
    /// What would tell them apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separate_by: Option<SeparateBy>,
    /// Share of the campaigns that were simulated with it that name it, or what is tied with it, first; where they were.
    #[serde(skip)]
    pub named_again: Option<f64>,
}

impl NamedEffect {
    /// An effect of a channel that is no pulls' with what is confused with it. `otherwise`: what tells them apart where the library
    /// knows no experiment.
    pub(crate) fn new(
        id: &str,
        weight: f64,
        parameters: BTreeMap<String, ParameterEstimate>,
        rivals: Vec<Rival>,
        (measured, otherwise): (Measured, Option<&str>),
    ) -> Self {
        let class: Vec<&str> = std::iter::once(id).chain(rivals.iter().map(|r| r.name.as_str())).collect();
        let steps: Vec<&str> = separating(measured, &class).into_iter().map(Experiment::text).collect();
        let text = if steps.is_empty() { otherwise.map(Into::into) } else { Some(steps.join("; ")) };
        Self {
            name: id.into(),
            part: None,
            class: class.iter().map(|name| (*name).into()).collect(),
            weight,
            parameters,
            separate_by: text.filter(|_| !rivals.is_empty()).map(|text| SeparateBy { text, campaign: None }),
            indistinguishable_from: rivals,
            named_again: None,
        }
    }
}

/// A covariate on which the residual depends in a way that the library does not explain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnknownCovariate {
    /// Column; an interaction as `a*b`.
    pub covariate: String,
    /// Share of the variance of the residual that it explains.
    pub strength: f64,
    /// Of a permutation test by block.
    pub p_value: f64,
}

impl UnknownCovariate {
    /// Its columns in a sentence: `a`, or `a, b and c together`.
    pub fn in_words(&self) -> String {
        match self.covariate.rsplit_once('*') {
            Some((others, last)) => format!("{} and {last} together", others.replace('*', ", ")),
            None => self.covariate.clone(),
        }
    }
}

/// The size at which an effect would have been seen in these data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detectable {
    /// Its parameter.
    pub parameter: String,
    /// That size.
    pub value: f64,
    /// With this probability.
    pub power: f64,
}

/// An error on data that the fit has not seen.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct HeldOutError {
    /// Root of the mean squared error, of forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_n: Option<f64>,
    /// Mean squared error, of images in grey levels squared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mse: Option<f64>,
    /// Root of the mean squared error, of volumes of imprints in mm^3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_mm3: Option<f64>,
    /// Lower end of its 90 % interval.
    pub low90: f64,
    /// Upper end of its 90 % interval.
    pub high90: f64,
    /// Mean of the absolute error as a share of the measured value, of forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mape_pct: Option<f64>,
}

/// Before and after the effects were added.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ErrorPair {
    /// The baseline, refitted.
    pub before: HeldOutError,
    /// With the effects.
    pub after: HeldOutError,
}

/// The error on other held-out sets.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ErrorsBy {
    /// One level of the main covariate held out at a time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<ErrorPair>,
    /// One session held out at a time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sessions: Option<ErrorPair>,
}

/// The error on data that the fit has not seen, through the simulator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorReport {
    /// What was held out: `repetitions` in the pull channel.
    pub heldout: String,
    /// Before.
    pub before: HeldOutError,
    /// After.
    pub after: HeldOutError,
    /// By other held-out sets.
    pub by: ErrorsBy,
}

/// A file of draws.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PosteriorFile {
    /// Its name: it lies beside the twin.
    pub file: String,
    /// Draws in it.
    pub draws: usize,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// [`DIAGNOSIS_SCHEMA`].
    pub schema: &'static str,
    /// What was measured.
    pub channel: Channel,
    /// How much of it.
    pub data: DataSummary,
    /// Scatter of repetitions, of forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_n: Option<f64>,
    /// Mean squared scatter that no model of this kind can predict, of images.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_mse: Option<f64>,
    /// Scatter of a volume from row to row, of imprints in mm^3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_mm3: Option<f64>,
    /// The answer in a word.
    pub verdict: Verdict,
    /// Effects that act, by weight.
    pub effects: Vec<NamedEffect>,
    /// Covariates that matter in an unknown way, strongest first.
    pub unknown: Vec<UnknownCovariate>,
    /// Sizes at which effects that were not found would have been.
    pub would_have_seen: BTreeMap<String, Detectable>,
    /// Covariates that never varied.
    pub not_excited: Vec<String>,
    /// Covariates that nobody wrote down.
    pub not_recorded: Vec<String>,
    /// Fitted baseline values by key.
    pub baseline: BTreeMap<String, ParameterEstimate>,
    /// The error before and after, where it could be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorReport>,
    /// What looked like an effect and did not pay.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hints: Vec<Hint>,
    /// What was learnt without a name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<Residual>,
    /// The draws of cause and parameters, where they were written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posterior: Option<PosteriorFile>,
    /// The answer in one sentence for a technician.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain: Option<String>,
    /// Remarks for people: what is missing, what was left out, what to beware of.
    pub notes: Vec<String>,
    /// Those of the notes that decide how far the answer may be believed, the most important first.
    #[serde(skip)]
    pub deciding: Vec<String>,
    /// Whether the forces look as if they were not in newtons.
    #[serde(skip)]
    pub other_unit: bool,
    /// Whether the error is far beyond the scatter of repetitions; a note has the numbers.
    #[serde(skip)]
    pub not_described: bool,
}

impl Diagnosis {
    /// An answer that says nothing yet.
    pub fn blank(channel: Channel, data: DataSummary) -> Self {
        Self {
            schema: DIAGNOSIS_SCHEMA,
            channel,
            data,
            noise_floor_n: None,
            noise_floor_mse: None,
            noise_floor_mm3: None,
            verdict: Verdict::Insufficient,
            effects: Vec::new(),
            unknown: Vec::new(),
            would_have_seen: BTreeMap::new(),
            not_excited: Vec::new(),
            not_recorded: Vec::new(),
            baseline: BTreeMap::new(),
            error: None,
            hints: Vec::new(),
            residual: None,
            posterior: None,
            plain: None,
            notes: Vec::new(),
            deciding: Vec::new(),
            other_unit: false,
            not_described: false,
        }
    }

    /// Ids of the effects, in the order of the alphabet.
    #[cfg(test)]
    pub(crate) fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.effects.iter().map(|e| e.name.as_str()).collect();
        names.sort_unstable();
        names
    }

    /// Adds a note that decides how far the answer may be believed.
    pub fn decides(&mut self, note: String) {
        self.deciding.push(note.clone());
        self.notes.push(note);
    }

    /// Takes back that nothing was found: the model does not describe the data, as the note says.
    pub(crate) fn is_not_described(&mut self, note: String) {
        if self.verdict == Verdict::None {
            self.verdict = Verdict::Unknown;
        }
        self.not_described = true;
        self.decides(note);
    }

    /// Puts the verdict that follows from what was found: an effect before a dependence that none explains.
    pub fn conclude(&mut self) {
        let unexplained = !self.unknown.is_empty() || self.residual.is_some();
        self.verdict = match (self.effects.is_empty(), !unexplained) {
            (false, _) => Verdict::Effect,
            (true, false) => Verdict::Unknown,
            (true, true) => Verdict::None,
        };
        self.say_bounds();
    }

    /// Marks values that stand at a bound of their parameter, says so, and trusts their effects less.
    fn say_bounds(&mut self) {
        let mut bounds_met = Vec::new();
        for effect in &mut self.effects {
            let Some(spec) = find(&effect.name) else { continue };
            for p in spec.parameters {
                let Some(estimate) = effect.parameters.get_mut(p.name) else { continue };
                let range = p.bounds.1 - p.bounds.0;
                let mut bounds = [p.bounds.0, p.bounds.1].into_iter();
                // A range over orders of magnitude is no measure at its lower end: a limit of 11 N between 1 and a million.
                let at = |bound: &f64| {
                    let near = NEAR_BOUND * range;
                    let near = if *bound == 0.0 { near } else { near.min(bound.abs()) };
                    (bound - p.neutral).abs() > near && (bound - estimate.value).abs() < near
                };
                let Some(bound) = bounds.find(at) else { continue };
                estimate.at_bound = true;
                effect.weight = effect.weight.min(MAX_WEIGHT_AT_BOUND);
                bounds_met.push(format!(
                    "{}.{} = {} stands at the bound of what is fitted, {bound}: something else may look like {0}",
                    effect.name, p.name, estimate.value
                ));
            }
        }
        bounds_met.into_iter().for_each(|note| self.decides(note));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value of one method and the interval of another: 0.0120 (0.0063 to 0.0108) was printed.
    #[test]
    fn an_interval_holds_its_value() {
        let ends = |value, interval| {
            let found = ParameterEstimate::new(value, interval, "s");
            (found.low90, found.high90)
        };
        assert_eq!(ends(0.012, (0.0063, 0.0108)), (0.0063, 0.012));
        assert_eq!(ends(0.012, (0.013, 0.02)), (0.012, 0.02));
        assert_eq!(ends(0.012, (0.01, 0.02)), (0.01, 0.02));
        assert!(ends(0.012, (f64::NAN, f64::NAN)).0.is_nan());
    }
}
