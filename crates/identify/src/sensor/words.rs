//! The table of evidence.

use super::choose::{Choice, model_of, ties};
use super::moments::Model;
use super::refine::values_at;
use super::search::Workspace;
use crate::statistics::mean_and_error;

/// A candidate in the table of evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorEvidence {
    /// Id of the effect, or `curve in` a covariate, or `none`.
    pub name: String,
    /// Held-out gain in log-likelihood over gain and offset alone.
    pub heldout_gain: f64,
    /// Its standard error over blocks.
    pub standard_error: f64,
    /// Held-out error with it, in the unit of the measured column.
    pub heldout_rmse_n: f64,
    /// Chance of as good a fit in data without any effect.
    pub p_value: f64,
    /// Fitted values for people.
    pub values: String,
    /// What became of it.
    pub fate: String,
}

/// All candidates against the baseline, best first, "none" last.
pub(crate) fn evidence(ws: &Workspace<'_>, choice: &Choice) -> Vec<SensorEvidence> {
    let base = Model::baseline();
    let rows = ws.rows();
    let rmse = |model: &Model| libm::sqrt(ws.fit.held_out(model, &ws.raw).iter().sum::<f64>() / rows);
    let round = ws.round(&base, &[], 0, 0);
    let tied: Vec<usize> = (0..choice.picked.len())
        .filter(|&at| ws.candidates[choice.picked[at].0].is_effect())
        .flat_map(|at| ties(ws, &choice.picked, at, 1).1)
        .map(|t| t.candidate)
        .collect();
    let mut table: Vec<SensorEvidence> = Vec::new();
    for (k, score) in round.scores.iter().enumerate() {
        let Some(score) = score else { continue };
        let candidate = &ws.candidates[k];
        let model = candidate.points[score.point].1.on(&base);
        let gains = ws.held_out_gain(&base, &model);
        let (_, error) = mean_and_error(&gains);
        let p_value = choice.first.as_ref().and_then(|r| r.scores[k].as_ref()).map_or(1.0, |s| s.p_value);
        let size = ws.fit.solve(&model, |_| true).added.first().copied().unwrap_or(0.0);
        let values = values_at(candidate, score.point, size).map_or_else(String::new, |(spec, values)| {
            let each = spec.parameters.iter().zip(values).map(|(p, v)| format!("{} = {v:.4}", p.name));
            each.collect::<Vec<String>>().join(", ")
        });
        let fate = if choice.picked.iter().any(|p| p.0 == k) {
            if candidate.is_effect() { "named" } else { "unknown" }
        } else if tied.contains(&k) {
            "tied"
        } else if p_value > 0.05 {
            "not significant"
        } else {
            "worse"
        };
        let name = if candidate.is_effect() {
            candidate.name().to_string()
        } else {
            format!("curve in {}", candidate.name())
        };
        table.push(SensorEvidence {
            name,
            heldout_gain: gains.iter().sum(),
            standard_error: error * gains.len() as f64,
            heldout_rmse_n: rmse(&model),
            p_value,
            values,
            fate: fate.into(),
        });
    }
    table.sort_by(|a, b| b.heldout_gain.total_cmp(&a.heldout_gain));
    table.push(SensorEvidence {
        name: "none".into(),
        heldout_gain: 0.0,
        standard_error: 0.0,
        heldout_rmse_n: rmse(&base),
        p_value: 1.0,
        values: "gain and offset of each session".into(),
        fate: if choice.picked.is_empty() { "kept".into() } else { "worse".into() },
    });
    if choice.picked.len() > 1 {
        let all = model_of(ws, &choice.picked);
        let gains = ws.held_out_gain(&base, &all);
        let (_, error) = mean_and_error(&gains);
        table.insert(
            0,
            SensorEvidence {
                name: "all that were named".into(),
                heldout_gain: gains.iter().sum(),
                standard_error: error * gains.len() as f64,
                heldout_rmse_n: rmse(&all),
                p_value: 0.0,
                values: String::new(),
                fate: "together".into(),
            },
        );
    }
    table
}
