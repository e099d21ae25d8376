//! What a few pulls can show: never a name, but a calibrated baseline, what contradicts it, and what is missing.

use super::answer::blank;
use super::data::PullData;
use super::few::{FEW_PULLS, FewPulls, calibrate_few};
use super::priors::PullPriors;
use crate::diagnosis::{Diagnosis, Hint};
use gripgen_twin::MeasuredPulls;
use gripgen_twin::effects::OFFSET_LAW;
use gripgen_twin::predict::{PredictPulls, PullModel};

/// Standard deviations from which on a pull is said to lie off.
pub(super) const FAR: f64 = 3.0;

/// Odds from which on an offset is said to look likely.
const ODDS: f64 = 3.0;

/// The answer to a few pulls.
#[derive(Debug, Clone)]
pub struct FewDiagnosis {
    /// The answer: insufficient.
    pub diagnosis: Diagnosis,
    /// The calibrated baseline, where there is one.
    pub found: Option<FewPulls>,
}

/// Whether a campaign has so few pulls that nothing in it gets a name.
pub fn is_few(measured: &MeasuredPulls) -> bool {
    measured.pulls.len() <= FEW_PULLS
}

/// Says what a few pulls show.
pub fn diagnose_few(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    priors: &PullPriors,
) -> FewDiagnosis {
    let data = PullData::new(measured);
    let mut diagnosis = blank(&data);
    let n = data.len();
    let count = if n == 1 { "one pull is".to_string() } else { format!("{n} pulls are") };
    diagnosis.notes.push(format!(
        "{count} too few to name an effect, a diagnosis needs {} at least: the twin has the friction that they show, with what is believed of parts and rigs in \
         general, and nothing else",
        FEW_PULLS + 1
    ));
    let found = calibrate_few(&data, predictor, given, priors, false);
    let Some(plain) = &found else {
        diagnosis.other_unit = true;
        diagnosis
            .notes
            .push("the labels cannot be predicted at all: is the unit of the forces newton?".into());
        return FewDiagnosis { diagnosis, found };
    };
    diagnosis.baseline = plain.baseline.clone();
    let far: Vec<usize> = (0..n).filter(|&i| plain.deviations[i].abs() > FAR).collect();
    diagnosis.data.outliers = far.iter().map(|&i| measured.pulls[i].id.clone()).collect();
    let largest = plain.deviations.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
    diagnosis.notes.push(match far.is_empty() {
        true => format!("plain friction agrees with all of them: none lies further off than {largest:.1} standard deviations"),
        false => format!("{} lie further from plain friction than {FAR} standard deviations", far.len()),
    });
    if data.varies("grip_force_n")
        && let Some(law) = calibrate_few(&data, predictor, given, priors, true)
    {
        let odds = libm::exp((law.log_evidence - plain.log_evidence).clamp(-50.0, 50.0));
        if odds > ODDS {
            let square = |d: &[f64]| (d.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
            let gain = (1.0 - square(&law.deviations) / square(&plain.deviations).max(1e-9)).max(0.0);
            let reason = format!(
                "odds of {odds:.0} to 1 over plain friction, of {n} pulls: too few for a name. `gripgen calibrate pulls --law offset` fits it"
            );
            diagnosis.hints.push(Hint { name: OFFSET_LAW.id.into(), gain, reason });
        }
    }
    if !diagnosis.not_excited.is_empty() {
        diagnosis.notes.push(format!("never varied: {}", diagnosis.not_excited.join(", ")));
    }
    diagnosis.notes.extend(plain.notes.iter().cloned());
    FewDiagnosis { diagnosis, found }
}
