//! From what was found to the answer, the twin's edits and the report.

use super::candidates::{press_effects, tried};
use super::search::{Found, MATERIAL, SURE};
use super::unnamed::{PressCovariate, PressValues};
use super::work::{Acting, Work, for_each, optics_at};
use super::{ASSUMED_PRESS_S, PressDiagnosisInput, page};
use crate::TwinEdits;
use crate::report::Diagnosed;
use gripgen_identify::{
    Channel, DIAGNOSIS_SCHEMA, DataSummary, Detectable, Diagnosis, ErrorPair, ErrorReport, ErrorsBy,
    HeldOutError, NamedEffect, ParameterEstimate, Rival, SeparateBy, UnknownCovariate, Verdict,
    grouped_intervals,
};
use gripgen_tactile::presses::frame_mse;
use gripgen_twin::OpticsState;
use gripgen_twin::config::{CalibrationFile, EffectFile};
use gripgen_twin::effects::{EffectSpec, Measured, OutsideFit, Per, separating};
use std::collections::BTreeMap;

/// Everything that the answer is made of.
pub(super) struct Answer<'a> {
    pub(super) input: &'a PressDiagnosisInput<'a>,
    pub(super) work: &'a Work,
    pub(super) found: &'a Found,
    pub(super) covariates: &'a [PressCovariate],
    /// How far circles were moved before anything was fitted: centres and radii.
    pub(super) scatter_px: [f64; 2],
}

/// The error of each press over its whole frame.
pub(super) struct FrameErrors {
    pub(super) before: Vec<f64>,
    /// Held out in folds that were drawn.
    pub(super) after: Vec<f64>,
    /// Held out in blocks of neighbours.
    pub(super) after_blocks: Vec<f64>,
}

/// The answer where nothing can be said.
pub(super) fn insufficient(input: &PressDiagnosisInput<'_>, missing: &str) -> Diagnosed {
    let mut diagnosis = bare(input);
    diagnosis.verdict = Verdict::Insufficient;
    diagnosis.notes.push(format!("too little to go by: {missing}"));
    let report = page::report(&diagnosis, None, &[]);
    Diagnosed { diagnosis, edits: TwinEdits::default(), report, next: None }
}

fn bare(input: &PressDiagnosisInput<'_>) -> Diagnosis {
    let noise = input.sensor.noise_rgb.iter().map(|s| f64::from(*s).powi(2)).sum::<f64>() / 3.0;
    Diagnosis {
        schema: DIAGNOSIS_SCHEMA,
        channel: Channel::Presses,
        data: DataSummary {
            presses: Some(input.set.presses.len()),
            sha256: input.sha256.clone(),
            ..Default::default()
        },
        noise_floor_n: None,
        // Rounding to whole grey levels adds a twelfth.
        noise_floor_mse: Some(noise + 1.0 / 12.0),
        verdict: Verdict::None,
        effects: Vec::new(),
        unknown: Vec::new(),
        would_have_seen: BTreeMap::new(),
        not_excited: Vec::new(),
        not_recorded: Vec::new(),
        baseline: BTreeMap::new(),
        error: None,
        notes: Vec::new(),
    }
}

impl Answer<'_> {
    pub(super) fn diagnosed(&self) -> Diagnosed {
        let errors = self.frame_errors();
        let mut diagnosis = bare(self.input);
        diagnosis.effects = self.effects();
        diagnosis.unknown = self
            .found
            .unknown
            .iter()
            .map(|(covariate, strength, p)| UnknownCovariate {
                covariate: covariate.clone(),
                strength: *strength,
                p_value: p.max(1e-6),
            })
            .collect();
        diagnosis.verdict = match (diagnosis.effects.is_empty(), diagnosis.unknown.is_empty()) {
            (true, true) => Verdict::None,
            (true, false) => Verdict::Unknown,
            (false, _) => Verdict::Effect,
        };
        diagnosis.would_have_seen = self.would_have_seen();
        diagnosis.not_excited = self.not_excited();
        if self.input.time_s.is_none() {
            diagnosis.not_recorded.push("time_s".into());
            diagnosis.notes.push(format!(
                "no column `time_s`: the order of the presses is their clock, {ASSUMED_PRESS_S} s from one to the next"
            ));
        }
        let [centre, radius] = self.scatter_px;
        diagnosis.notes.push(format!(
            "the marks scatter by {centre:.1} px in the centre and {radius:.1} px in the radius; fits are on straightened ones, errors on the marks as they are"
        ));
        if !self.input.marked {
            diagnosis.not_recorded.extend(["x_px".into(), "y_px".into()]);
            diagnosis.notes.push(
                "the contacts were looked for in the images, so nothing is said of where they should have been"
                    .into(),
            );
        }
        if self.input.set.rest.is_none() {
            diagnosis.not_recorded.push("rest.png".into());
        }
        if let (Some(before), Some(after)) =
            (rest_difference(self, &[]), rest_difference(self, &self.found.model.acting))
        {
            let levels = |d: [f64; 3]| d.map(|v| format!("{v:.1}")).join(", ");
            diagnosis.notes.push(format!(
                "the frame without contact of the set differs from the sensor file's by {} grey levels (red, green, blue) on average, under the effects that were found by {}",
                levels(before),
                levels(after)
            ));
        }
        diagnosis.data.outliers = self.outliers();
        let pair = |after: &[f64]| ErrorPair { before: interval(&errors.before), after: interval(after) };
        let drawn = pair(&errors.after);
        diagnosis.error = Some(ErrorReport {
            heldout: "presses".into(),
            before: drawn.before,
            after: drawn.after,
            by: ErrorsBy { levels: None, sessions: Some(pair(&errors.after_blocks)) },
        });
        diagnosis.notes.push("`by.sessions` holds out blocks of presses that follow one another".into());
        let report = page::report(&diagnosis, Some(self), &errors.both());
        Diagnosed { edits: self.edits(&diagnosis), diagnosis, report, next: None }
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
                        let (low90, high90) = intervals[k];
                        let estimate =
                            ParameterEstimate { value: acting.values[j], low90, high90, unit: p.unit.into() };
                        parameters.insert(p.name.to_string(), estimate);
                    }
                }
                if let Some(j) = tried(acting.spec) {
                    let value = acting.values[j];
                    let (low90, high90) = if value > 0.0 { (value - 1.0, value + 1.0) } else { (0.0, 0.0) };
                    let estimate = ParameterEstimate { value, low90, high90, unit: "1".into() };
                    parameters.insert(acting.spec.parameters[j].name.into(), estimate);
                }
                let (own, rivals) = self.weights(e);
                let mut class = vec![acting.spec.id.to_string()];
                class.extend(rivals.iter().map(|r| r.name.clone()));
                let named = NamedEffect {
                    name: acting.spec.id.into(),
                    part: None,
                    separate_by: (!rivals.is_empty())
                        .then(|| SeparateBy { text: separate_by(acting.spec.id, &rivals), campaign: None }),
                    class,
                    weight: own,
                    parameters,
                    indistinguishable_from: rivals,
                };
                (self.found.gains.get(e).copied().unwrap_or(0.0), named)
            })
            .collect();
        list.sort_by(|a, b| b.1.weight.total_cmp(&a.1.weight).then(b.0.total_cmp(&a.0)));
        list.into_iter().map(|(_, named)| named).collect()
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
        let mut sorted = costs.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let mut list: Vec<usize> = (0..costs.len()).filter(|&i| costs[i] > 6.0 * median).collect();
        list.sort_by(|&a, &b| costs[b].total_cmp(&costs[a]));
        list.into_iter().map(|i| self.input.set.presses[i].name.clone()).collect()
    }

    /// For each effect that was not found the size that would have been: its signature stands as far above 0 as a
    /// candidate has to, with a power of 0.8.
    fn would_have_seen(&self) -> BTreeMap<String, Detectable> {
        let base = self.found.cost;
        let mut sizes = BTreeMap::new();
        for (spec, fit) in press_effects() {
            if self.found.model.acting.iter().any(|a| a.spec == spec) {
                continue;
            }
            let scatter =
                self.found.trials.iter().rev().find(|t| t.name == spec.id).map_or(0.0, |t| t.standard_error);
            let wanted = (MATERIAL * base).max(SURE * scatter) + 0.84 * scatter;
            let Some(j) = spec.position(fit.main) else { continue };
            if let Some(value) = self.size_of(spec, j, wanted) {
                let parameter = spec.parameters[j].name.into();
                sizes.insert(spec.id.to_string(), Detectable { parameter, value, power: 0.8 });
            }
        }
        sizes
    }

    /// The value of a parameter whose signature has a mean square of `wanted`.
    fn size_of(&self, spec: &'static EffectSpec, j: usize, wanted: f64) -> Option<f64> {
        let p = &spec.parameters[j];
        let room = p.bounds.1 - p.neutral;
        let some: Vec<usize> =
            (0..self.work.views.len()).step_by(self.work.views.len().div_ceil(6)).collect();
        let square = |size: f64| -> f64 {
            let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
            values[j] = p.neutral + size;
            let sums = for_each(some.len(), |k| {
                let i = some[k];
                let mut acting = self.found.model.acting.clone();
                let plain = self.work.levels(i, &self.work.optics(i, &acting));
                acting.push(Acting { spec, values: values.clone() });
                let levels = self.work.levels(i, &self.work.optics(i, &acting));
                let weights = self.work.pixel_weights(i);
                let one = |((a, b), w): ((&[f32; 3], &[f32; 3]), f64)| {
                    w * (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()
                };
                levels.iter().zip(&plain).zip(weights).map(one).sum::<f64>()
            });
            sums.iter().sum::<f64>() / some.len() as f64
        };
        let mut size = 0.05 * room;
        for _ in 0..5 {
            let now = square(size);
            if now <= 0.0 {
                return None;
            }
            size = (size * libm::pow(wanted / now, 0.4)).clamp(1e-4 * room, room);
        }
        Some(p.neutral + size)
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
        self.covariates.iter().filter(constant).map(|c| c.name.clone()).collect()
    }

    /// Errors over whole frames at the resolution of the images, through the renderer.
    fn frame_errors(&self) -> FrameErrors {
        let set = self.input.set;
        let n = set.presses.len();
        let full = &self.work.full;
        let plain = OpticsState::default();
        let before = for_each(n, |i| frame_mse(set, i, full, &plain));
        let model = &self.found.model;
        let held_out = |folds: &[usize]| {
            if model.acting.is_empty() {
                return before.clone();
            }
            let by_fold = model.by_fold(&self.found.design.weights, folds);
            for_each(n, |i| frame_mse(set, i, full, &self.work.optics(i, &by_fold[folds[i]])))
        };
        let after = held_out(&self.found.design.folds);
        let after_blocks = held_out(&self.found.design.blocks);
        FrameErrors { before, after, after_blocks }
    }

    /// The optics effects of the new twin.
    fn edits(&self, diagnosis: &Diagnosis) -> TwinEdits {
        let mut effects = self.input.kept_effects.clone();
        for named in &diagnosis.effects {
            let entry =
                |(name, p): (&String, &ParameterEstimate)| (name.clone(), toml::Value::Float(p.value));
            let interval = |(name, p): (&String, &ParameterEstimate)| {
                let calibration = CalibrationFile {
                    low90: p.low90,
                    high90: p.high90,
                    evidence: Some(format!("diagnosed from {} presses", self.input.set.presses.len())),
                    data_sha256: Some(self.input.sha256.clone()),
                };
                (name.clone(), calibration)
            };
            effects.push(EffectFile {
                name: named.name.clone(),
                part: None,
                fitted_grip_force_n: None,
                outside_fit: OutsideFit::default(),
                per: Per::default(),
                reference_area_mm2: None,
                source: Some("gripgen diagnose, presses".into()),
                calibration: named.parameters.iter().map(interval).collect(),
                parameters: named.parameters.iter().map(entry).collect(),
            });
        }
        TwinEdits { values: Vec::new(), effects: Some(effects) }
    }
}

impl FrameErrors {
    fn both(&self) -> Vec<(f64, f64)> {
        self.before.iter().copied().zip(self.after.iter().copied()).collect()
    }
}

/// The frame without contact of the set against that of the sensor file under some effects at the start: mean
/// difference of each channel.
fn rest_difference(answer: &Answer<'_>, acting: &[Acting]) -> Option<[f64; 3]> {
    let rest = answer.input.set.rest.as_ref()?;
    let optics = optics_at(&Default::default(), acting);
    let change = answer.work.full.change_seen(None, &optics);
    let n = change[0].values.len() as f64;
    Some([0, 1, 2].map(|c| {
        let seen = answer.input.sensor.rest[c].iter().zip(&change[c].values).map(|(r, d)| f64::from(r + d));
        let measured = rest.rgb.iter().skip(c).step_by(3).map(|&v| f64::from(v));
        measured.zip(seen).map(|(m, s)| m - s).sum::<f64>() / n
    }))
}

/// Mean over the presses with a 90 % interval by resampling them.
fn interval(errors: &[f64]) -> HeldOutError {
    let n = errors.len();
    let mean = |list: &mut dyn Iterator<Item = f64>| list.sum::<f64>() / n as f64;
    let mut means: Vec<f64> = (0..2000u64)
        .map(|draw| {
            let pick =
                |k: usize| errors[(super::score::hash(draw * 7919 + k as u64 * 104_729) % n as u64) as usize];
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

/// What tells an effect from its rivals.
fn separate_by(name: &str, rivals: &[Rival]) -> String {
    let suspects: Vec<&str> = std::iter::once(name).chain(rivals.iter().map(|r| r.name.as_str())).collect();
    let steps = separating(Measured::Presses, &suspects);
    if steps.is_empty() {
        return "more presses, at other places and depths".into();
    }
    steps.iter().map(|step| step.text()).collect::<Vec<_>>().join("; ")
}
