//! From what was found to the answer.

use super::candidates::tried;
use super::frame_error::FrameErrors;
use super::observed::Observed;
use super::power::would_have_seen;
use super::residual::Left;
use super::score::hash;
use super::search::Found;
use super::unnamed::{PressCovariate, PressValues};
use super::{PressData, PressDiagnosis};
use crate::summary::left;
use crate::{
    Channel, DataSummary, Diagnosis, ErrorPair, ErrorReport, ErrorsBy, HeldOutError, NamedEffect,
    ParameterEstimate, Rival, UnknownCovariate, grouped_intervals,
};
use gripgen_twin::effects::Measured;
use gripgen_twin::values::median;
use std::collections::BTreeMap;

/// What tells an effect from its rivals: an experiment of the library, or this.
const SEPARATED_BY: (Measured, Option<&str>) =
    (Measured::Presses, Some("more presses, at other places and depths"));

/// Everything that the answer is made of.
pub(super) struct Answer<'a> {
    pub(super) data: &'a PressData,
    pub(super) observed: &'a Observed<'a>,
    pub(super) found: Found,
    pub(super) errors: FrameErrors,
}

/// A diagnosis that says nothing yet.
pub(super) fn bare(data: &PressData) -> Diagnosis {
    let summary = DataSummary {
        presses: Some(data.names.len()),
        sha256: data.sha256.clone(),
        ..DataSummary::default()
    };
    // Rounding to whole grey levels adds a twelfth.
    let noise_floor_mse = Some(data.noise_mse + 1.0 / 12.0);
    Diagnosis { noise_floor_mse, ..Diagnosis::blank(Channel::Presses, summary) }
}

impl Answer<'_> {
    pub(super) fn diagnosed(self) -> PressDiagnosis {
        let errors = &self.errors;
        let mut diagnosis = bare(self.data);
        diagnosis.effects = self.effects();
        let unknown = |(covariate, strength, p): &(String, f64, f64)| UnknownCovariate {
            covariate: covariate.clone(),
            strength: *strength,
            p_value: p.max(1e-6),
        };
        diagnosis.unknown = self.found.unknown.iter().map(unknown).collect();
        diagnosis.hints.clone_from(&self.found.hints);
        diagnosis.conclude();
        diagnosis.would_have_seen = would_have_seen(self.observed, &self.found);
        diagnosis.would_have_seen.extend(self.found.scatter.seen_from.clone());
        diagnosis.not_excited = self.not_excited();
        diagnosis.data.outliers = self.outliers();
        let pair = |after: &[f64]| ErrorPair { before: interval(&errors.before), after: interval(after) };
        let drawn = pair(&errors.after);
        diagnosis.error = Some(ErrorReport {
            heldout: "presses".into(),
            before: drawn.before,
            after: drawn.after,
            by: ErrorsBy { levels: None, sessions: Some(pair(&errors.after_blocks)) },
        });
        if let Some(times) = left(&diagnosis) {
            diagnosis.notes.push(Left::of(self.observed, &self.found.model.acting).text(times));
        }
        diagnosis.notes.push("`by.sessions` holds out blocks of presses that follow one another".into());
        PressDiagnosis {
            diagnosis,
            zone_mse: [self.found.zone_mse, self.observed.zone_mse(&self.found.model.acting)],
            frame_mse: errors.before.iter().copied().zip(errors.after.iter().copied()).collect(),
            acting: self.found.acting(),
            trials: self.found.trials,
        }
    }

    fn effects(&self) -> Vec<NamedEffect> {
        let model = &self.found.model;
        let intervals = grouped_intervals(&model.parameters, &model.fit, &self.found.design.weights);
        let mut list: Vec<(f64, NamedEffect)> = model
            .acting
            .iter()
            .enumerate()
            .map(|(e, acting)| {
                let mut parameters = BTreeMap::new();
                for (k, &(effect, j)) in model.free.iter().enumerate() {
                    if effect == e {
                        let p = &acting.spec.parameters[j];
                        let estimate = ParameterEstimate::new(acting.values[j], intervals[k], p.unit);
                        parameters.insert(p.name.to_string(), estimate);
                    }
                }
                if let Some(j) = tried(acting.spec) {
                    let value = acting.values[j];
                    let interval = if value > 0.0 { (value - 1.0, value + 1.0) } else { (0.0, 0.0) };
                    let estimate = ParameterEstimate::new(value, interval, "1");
                    parameters.insert(acting.spec.parameters[j].name.into(), estimate);
                }
                let (own, rivals) = self.weights(e);
                let named = NamedEffect::new(acting.spec.id, own, parameters, rivals, SEPARATED_BY);
                (self.found.gains.get(e).copied().unwrap_or(0.0), named)
            })
            .collect();
        self.add_scatter(&mut list);
        list.sort_by(|a, b| b.1.weight.total_cmp(&a.1.weight).then(b.0.total_cmp(&a.0)));
        list.into_iter().map(|(_, named)| named).collect()
    }

    /// Adds gains that differ from press to press, with what they took off; to their like, where it was found.
    fn add_scatter(&self, list: &mut Vec<(f64, NamedEffect)>) {
        let Some(acting) = &self.found.scatter.named else { return };
        let from = acting.values.len() - 3;
        let values = acting.values[from..].iter().zip(&self.found.scatter.intervals);
        let parameters = acting.spec.parameters[from..].iter().zip(values).map(|(p, (value, interval))| {
            (p.name.to_string(), ParameterEstimate::new(*value, *interval, p.unit))
        });
        if let Some((_, like)) = list.iter_mut().find(|(_, named)| named.name == acting.spec.id) {
            like.parameters.extend(parameters);
            return;
        }
        let named = NamedEffect::new(acting.spec.id, 0.95, parameters.collect(), Vec::new(), SEPARATED_BY);
        list.push((self.found.scatter.trial.as_ref().map_or(0.0, |trial| trial.gain), named));
    }

    /// Shares of the evidence: an effect, and its rivals.
    fn weights(&self, e: usize) -> (f64, Vec<Rival>) {
        let Some(tied) = self.found.rivals.get(e) else { return (0.95, Vec::new()) };
        let gain = self.found.gains[e].max(1e-12);
        let evidence: Vec<f64> = tied
            .iter()
            .map(|r| {
                let width = r.standard_error.max(0.03 * gain);
                let t = r.loss.max(0.0) / width;
                libm::exp(-0.5 * t * t)
            })
            .collect();
        let sum = 1.05 + evidence.iter().sum::<f64>();
        let mut rivals: Vec<Rival> = tied
            .iter()
            .zip(&evidence)
            .map(|(r, w)| Rival { name: r.spec.id.into(), weight: w / sum })
            .collect();
        rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        (1.0 / sum, rivals)
    }

    /// Presses that the model explains far worse than the others.
    fn outliers(&self) -> Vec<String> {
        let costs: Vec<f64> = self.found.model.fit.moments.iter().map(|m| m.cost).collect();
        let median = median(costs.clone()).unwrap_or_default();
        let mut list: Vec<usize> = (0..costs.len()).filter(|&i| costs[i] > 6.0 * median).collect();
        list.sort_by(|&a, &b| costs[b].total_cmp(&costs[a]));
        list.into_iter().map(|i| self.data.names[i].clone()).collect()
    }

    fn not_excited(&self) -> Vec<String> {
        let constant = |covariate: &&PressCovariate| match &covariate.values {
            PressValues::Numbers(values) => {
                let (low, high) = values
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                let narrow = covariate.name == "radius_px" && high - low < 0.05 * high;
                high <= low || narrow
            }
            PressValues::Words(words) => words.iter().all(|w| *w == words[0]),
        };
        self.data.covariates.iter().filter(constant).map(|c| c.name.clone()).collect()
    }
}

/// Mean over the presses with a 90 % interval by resampling them.
fn interval(errors: &[f64]) -> HeldOutError {
    let n = errors.len();
    let mean = |list: &mut dyn Iterator<Item = f64>| list.sum::<f64>() / n as f64;
    let mut means: Vec<f64> = (0..2000u64)
        .map(|draw| {
            let pick = |k: usize| errors[(hash(draw * 7919 + k as u64 * 104_729) % n as u64) as usize];
            mean(&mut (0..n).map(pick))
        })
        .collect();
    means.sort_by(f64::total_cmp);
    HeldOutError {
        mse: Some(mean(&mut errors.iter().copied())),
        low90: means[99],
        high90: means[1899],
        ..Default::default()
    }
}
