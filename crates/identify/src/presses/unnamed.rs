//! Rivals without a name: smooth fields over the frame whose size is a smooth curve of a covariate.
//!
//! All of them are linear: columns are a term of the field at a pixel times a term of the curve at a press. The moments
//! of the field's terms in each press therefore give those of every curve.

use super::model::{NamedModel, moments_from};
use super::observed::Observed;
use super::predict::PressPixels;
use super::score::{Design, Scored};
use crate::{FreeParameter, GroupMoments, GroupedFit, held_out_costs};
pub use gripgen_twin::Values as PressValues;
use nalgebra::{DMatrix, DVector};

/// Terms of a field in each channel: 1, u, v, u2, uv, v2, the level, the change by the contact, level of the other two
/// channels, u3, u2v, uv2, v3, change of the other two channels.
const TERMS: usize = 16;

const OFFSET_AND_LEVEL: &[usize] = &[0, 6];
const COLOURS: &[usize] = &[0, 6, 8, 9, 7, 14, 15];
const CUBIC: &[usize] = &[0, 1, 2, 3, 4, 5, 10, 11, 12, 13];
const WIDE: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7];
const CONTRAST: &[usize] = &[7];

/// Rivals that are the same in all presses.
const CONSTANT: [&str; 2] = ["colour", "x_px*y_px"];

/// A covariate of presses: what a column of the table says about each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct PressCovariate {
    /// Its name.
    pub name: String,
    /// Its values, one per press.
    pub values: PressValues,
}

/// How the size of a field goes with a covariate.
#[derive(Debug, Clone)]
struct Curve {
    /// Values of the terms at each press.
    terms: Vec<Vec<f64>>,
    field: &'static [usize],
}

/// A rival.
#[derive(Debug, Clone)]
pub(super) struct Unnamed {
    /// The covariate that it depends on.
    pub(super) covariate: String,
    /// Cost of each press under a fit without its fold.
    pub(super) held_out: Vec<f64>,
    curve: Curve,
}

/// Moments of the field's terms in each press beside those of a named model.
pub(super) struct Fields {
    moments: Vec<GroupMoments>,
    named: Vec<FreeParameter>,
    values: Vec<f64>,
}

impl Fields {
    pub(super) fn new(observed: &Observed<'_>, scored: &Scored) -> Self {
        let model = NamedModel {
            observed,
            acting: scored.acting.clone(),
            free: scored.free.clone(),
            parameters: scored.parameters.clone(),
        };
        let k = model.parameters.len();
        let moments = observed.for_each(observed.count(), |i| {
            let (levels, slopes) = model.derivatives(i, &scored.fit.values);
            let contact = observed.predictor.contact_levels(i, &model.acting);
            let PressPixels { measured, places, .. } = &observed.pixels[i];
            let off = |p: usize, c: usize| f64::from(levels[p][c] - measured[p][c]);
            moments_from(observed, i, k + 3 * TERMS, off, |p, c, row| {
                let [u, v] = places[p];
                row[k..].fill(0.0);
                row[..k].iter_mut().zip(&slopes).for_each(|(r, s)| *r = f64::from(s[p][c]));
                let level = |d: usize| f64::from(levels[p][(c + d) % 3]) / 64.0;
                let change = |d: usize| f64::from(contact[p][(c + d) % 3]) / 16.0;
                let terms = [
                    1.0,
                    u,
                    v,
                    u * u,
                    u * v,
                    v * v,
                    level(0),
                    change(0),
                    level(1),
                    level(2),
                    u * u * u,
                    u * u * v,
                    u * v * v,
                    v * v * v,
                    change(1),
                    change(2),
                ];
                row[k + c * TERMS..k + (c + 1) * TERMS].copy_from_slice(&terms);
            })
        });
        Self { moments, named: scored.parameters.clone(), values: scored.fit.values.clone() }
    }

    /// Scores a curve beside the named model.
    fn scored(&self, curve: &Curve, design: &Design) -> Vec<f64> {
        let fields: Vec<usize> =
            (0..3).flat_map(|c| curve.field.iter().map(move |t| self.named.len() + c * TERMS + t)).collect();
        let degree = curve.terms.first().map_or(0, Vec::len);
        let columns: Vec<(usize, Option<usize>)> = (0..self.named.len())
            .map(|j| (j, None))
            .chain(fields.iter().flat_map(|&f| (0..degree).map(move |d| (f, Some(d)))))
            .collect();
        let n = columns.len();
        let moments = self.moments.iter().zip(&curve.terms).map(|(m, terms)| {
            let size = |&(_, d): &(usize, Option<usize>)| d.map_or(1.0, |d| terms[d]);
            GroupMoments {
                cost: m.cost,
                gradient: DVector::from_fn(n, |a, _| m.gradient[columns[a].0] * size(&columns[a])),
                normal: DMatrix::from_fn(n, n, |a, b| {
                    m.normal[(columns[a].0, columns[b].0)] * size(&columns[a]) * size(&columns[b])
                }),
            }
        });
        let free = FreeParameter { name: String::new(), start: 0.0, bounds: (-1e6, 1e6), scale: 1.0 };
        let parameters: Vec<FreeParameter> = columns
            .iter()
            .map(|(j, d)| if d.is_none() { self.named[*j].clone() } else { free.clone() })
            .collect();
        let values = columns.iter().map(|(j, d)| if d.is_none() { self.values[*j] } else { 0.0 }).collect();
        let fit = GroupedFit { values, moments: moments.collect() };
        held_out_costs(&parameters, &fit, &design.weights, &design.folds)
    }

    /// The best curve of each covariate beside the whole named model, best first.
    pub(super) fn rivals(&self, covariates: &[PressCovariate], design: &Design) -> Vec<Unnamed> {
        let n = self.moments.len();
        let constant = vec![vec![1.0]; n];
        let mut found: Vec<Unnamed> = Vec::new();
        let mut add = |covariate: &str, curves: Vec<Curve>| {
            let best = curves
                .into_iter()
                .map(|curve| (self.scored(&curve, design), curve))
                .min_by(|a, b| design.mean(&a.0).0.total_cmp(&design.mean(&b.0).0));
            if let Some((held_out, curve)) = best {
                found.push(Unnamed { covariate: covariate.into(), held_out, curve });
            }
        };
        add(CONSTANT[0], vec![Curve { terms: constant.clone(), field: COLOURS }]);
        add(CONSTANT[1], vec![Curve { terms: constant, field: CUBIC }]);
        for covariate in covariates {
            add(&covariate.name, curves(covariate));
        }
        found.sort_by(|a, b| design.mean(&a.held_out).0.total_cmp(&design.mean(&b.held_out).0));
        found
    }

    /// Held-out cost of each press under a rival beside this model. The rival then has its mean level too, where its
    /// covariate has no origin: it stands instead of effects that were taken out.
    pub(super) fn beside(&self, rival: &Unnamed, design: &Design) -> Vec<f64> {
        let mut curve = rival.curve.clone();
        if rival.covariate != "pull_index" && !CONSTANT.contains(&rival.covariate.as_str()) {
            curve.terms.iter_mut().for_each(|terms| terms.push(1.0));
        }
        self.scored(&curve, design)
    }
}

/// Curves to try in a covariate. That of the order is 0 at its beginning, where the sensor file was right.
fn curves(covariate: &PressCovariate) -> Vec<Curve> {
    match &covariate.values {
        PressValues::Words(words) => {
            let mut levels: Vec<&String> = words.iter().collect();
            levels.sort();
            levels.dedup();
            if levels.len() < 2 || levels.len() > 6 || levels.len() * 3 > words.len() {
                return Vec::new();
            }
            let n = words.len() as f64;
            let share: Vec<f64> =
                levels.iter().map(|l| words.iter().filter(|w| w == l).count() as f64 / n).collect();
            let terms = words
                .iter()
                .map(|w| (1..levels.len()).map(|l| f64::from(u8::from(w == levels[l])) - share[l]).collect());
            let terms: Vec<Vec<f64>> = terms.collect();
            [OFFSET_AND_LEVEL, WIDE].map(|field| Curve { terms: terms.clone(), field }).to_vec()
        }
        PressValues::Numbers(values) => {
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            sorted.dedup();
            let (low, high) = (sorted.first().copied().unwrap_or(0.0), sorted.last().copied().unwrap_or(0.0));
            if sorted.len() < 2 || !(high - low).is_finite() {
                return Vec::new();
            }
            let anchored = covariate.name == "pull_index";
            let power = |value: f64, d: usize| {
                let x = if anchored {
                    (value - low) / (high - low)
                } else {
                    2.0 * (value - low) / (high - low) - 1.0
                };
                x.powi(d as i32)
            };
            let terms = |most: usize| -> Vec<Vec<f64>> {
                let degree = most.min(sorted.len() - 1);
                let mean: Vec<f64> = (1..=degree)
                    .map(|d| values.iter().map(|&v| power(v, d)).sum::<f64>() / values.len() as f64)
                    .collect();
                values
                    .iter()
                    .map(|&v| {
                        (1..=degree).map(|d| power(v, d) - if anchored { 0.0 } else { mean[d - 1] }).collect()
                    })
                    .collect()
            };
            vec![
                Curve { terms: terms(1), field: OFFSET_AND_LEVEL },
                Curve { terms: terms(3), field: OFFSET_AND_LEVEL },
                Curve { terms: terms(1), field: WIDE },
                Curve { terms: terms(2), field: WIDE },
                Curve { terms: terms(2), field: CONTRAST },
            ]
        }
    }
}
