//! How large an effect must be to be seen in these data.

use super::candidates::{Candidate, Change, Kind, size_parameter};
use super::choose::model_of;
use super::noise::draw;
use super::search::{Weighing, Workspace};
use crate::diagnosis::Detectable;
use crate::draws::Draws;
use gripgen_twin::values::median;
use std::collections::BTreeMap;

/// Standard errors at which a first effect is accepted among all candidates, about.
const THRESHOLD: f64 = 3.1;
/// Standard normal quantile of the power.
const POWER: (f64, f64) = (0.8, 0.84);
/// Simulated data sets, where there is no formula.
const SIMULATIONS: usize = 60;

/// For each effect that was not picked, the size of its first parameter that would have been seen in 80 % of such data.
pub(crate) fn detectable(
    ws: &Workspace<'_>,
    picked: &[(usize, usize)],
    seed: u64,
) -> BTreeMap<String, Detectable> {
    let base = model_of(ws, picked);
    let solution = ws.fit.solve(&base, |_| true);
    let freedom = (ws.rows() - 2.0 * ws.fit.sessions as f64).max(1.0);
    let variance = solution.left / freedom;
    let gain = solution.sessions.iter().map(|s| s[1].abs()).sum::<f64>() / solution.sessions.len() as f64;
    let simulated = (ws.weighing == Weighing::Blocks).then(|| responses(ws, variance, seed));
    let mut found = BTreeMap::new();
    for (k, candidate) in ws.candidates.iter().enumerate() {
        let Kind::Effect(spec) = candidate.kind else { continue };
        if picked.iter().any(|p| p.0 == k) {
            continue;
        }
        let error = |column: usize, scale: f64| {
            let model = base.with(&[column]);
            let spread = match &simulated {
                None => {
                    let all = ws.fit.solve(&model, |_| true).spread;
                    let last = all.nrows() - 1;
                    libm::sqrt(variance * all[(last, last)])
                }
                Some(moments) => {
                    let square: f64 = moments
                        .iter()
                        .map(|m| m.solve(&model, |_| true).added.last().copied().unwrap_or(0.0))
                        .map(|c| c * c)
                        .sum();
                    libm::sqrt(square / moments.len() as f64)
                }
            };
            (THRESHOLD + POWER.1) * spread / scale
        };
        if let Some(value) = smallest(candidate, gain, error) {
            let parameter = spec.parameters[size_parameter(spec)].name.to_string();
            found.insert(spec.id.to_string(), Detectable { parameter, value, power: POWER.0 });
        }
    }
    found
}

fn smallest(candidate: &Candidate, gain: f64, error: impl Fn(usize, f64) -> f64) -> Option<f64> {
    let mut sizes = Vec::new();
    let mut shapes = Vec::new();
    for (inner, change) in &candidate.points {
        match change {
            Change::Add(columns, _) => sizes.push(error(columns[0], 1.0)),
            // A change of the force has factor 1: it is seen where that is more than its error.
            Change::Force(column) => {
                if error(*column, gain) <= 1.0 {
                    shapes.extend(inner.map(|(_, value)| value));
                }
            }
        }
    }
    if sizes.is_empty() {
        return if candidate.grows_with_its_shape() {
            shapes.into_iter().min_by(f64::total_cmp)
        } else {
            shapes.into_iter().max_by(f64::total_cmp)
        };
    }
    median(sizes).filter(|v| v.is_finite())
}

fn responses(ws: &Workspace<'_>, variance: f64, seed: u64) -> Vec<super::moments::Moments> {
    let mut draws = Draws::new(seed, 41);
    let size = libm::sqrt(variance / ws.noise.variance());
    (0..SIMULATIONS)
        .map(|_| {
            let noise: Vec<f64> =
                draw(ws.noise, &ws.prepared.group_steps, &mut draws).into_iter().map(|e| size * e).collect();
            let mut moments = ws.fit.clone();
            moments.replace_response(&ws.weighed, &noise);
            moments
        })
        .collect()
}
