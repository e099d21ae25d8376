//! The diagnosis of a force sensor.

use super::calibrate::estimate;
use super::candidates::{Candidate, candidates, force_rate};
use super::choose::{Choice, choose, model_of, ties, without};
use super::errors::{Errors, errors};
use super::moments::{Model, Moments};
use super::prepare::{Prepared, prepare, range};
use super::refine::{JointFit, Refined, joint_fit, values_at};
use super::search::{Weighing, Workspace};
use super::words::{SensorEvidence, evidence};
use super::{SensorData, SensorOptions, detect};
use crate::diagnosis::{
    Channel, DataSummary, Diagnosis, ErrorReport, ErrorsBy, NamedEffect, Rival, UnknownCovariate,
};
use gripgen_twin::effects::{EffectSpec, FORCE_RATE, Measured};
use gripgen_twin::rounded;
use gripgen_twin::values::median;

/// A group of rows with what was predicted from the other blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRow {
    /// Time since the start of the table.
    pub clock_s: f64,
    /// Session, by its place in [`SensorDiagnosis::sessions`].
    pub session: usize,
    /// Mean reference force.
    pub reference_n: f64,
    /// Mean change of the reference per second.
    pub rate_n_per_s: f64,
    /// Mean reading.
    pub measured_n: f64,
    /// Reading that gain and offset predict.
    pub before_n: f64,
    /// Reading with the effects.
    pub after_n: f64,
}

/// A contiguous stretch of one session.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorBlock {
    /// Session.
    pub session: String,
    /// First and last time since the start of the table.
    pub from_to_s: (f64, f64),
    /// Mean reading.
    pub measured_n: f64,
    /// Mean of the held-out predictions.
    pub predicted_n: f64,
    /// Held-out error.
    pub rmse_n: f64,
}

/// What a diagnosis of a table hands back.
#[derive(Debug, Clone)]
pub struct SensorDiagnosis {
    /// The answer; `data.sha256` is left for who read the file.
    pub diagnosis: Diagnosis,
    /// The effects that act, with values in the order of their specs.
    pub effects: Vec<(&'static EffectSpec, Vec<f64>)>,
    /// Sessions that were used.
    pub sessions: Vec<String>,
    /// Rows or groups of rows, held out.
    pub rows: Vec<SensorRow>,
    /// Blocks, the worst first.
    pub blocks: Vec<SensorBlock>,
    /// The candidates, best first.
    pub evidence: Vec<SensorEvidence>,
}

/// Diagnoses a table. Never fails: what cannot be diagnosed is `insufficient`, and the notes say what is missing.
pub fn diagnose_sensor(data: &SensorData, options: &SensorOptions) -> SensorDiagnosis {
    let mut answer = bare(data);
    let prepared = match prepare(data, options.max_rows) {
        Ok(prepared) => prepared,
        Err(reason) => return insufficient(answer, reason),
    };
    answer.diagnosis.notes.extend(prepared.notes.iter().cloned());
    answer.diagnosis.data.outliers = prepared.spikes.iter().map(|row| format!("row {}", row + 1)).collect();
    answer.sessions.clone_from(&prepared.names);
    excitation(data, &prepared, &mut answer.diagnosis);
    let gains = baseline_gains(&prepared);
    if let Err(reason) = plausible(&prepared, &gains) {
        return insufficient(answer, reason);
    }
    let (candidates, mut columns) = candidates(data, &prepared, &gains);
    columns.push(prepared.grouped(&prepared.measured));
    let mut ws = Workspace::new(&prepared, &candidates, columns);
    let choice = choose(&mut ws, options);
    finish(answer, &mut ws, &choice, options)
}

fn finish(
    mut answer: SensorDiagnosis,
    ws: &mut Workspace<'_>,
    choice: &Choice,
    options: &SensorOptions,
) -> SensorDiagnosis {
    let prepared = ws.prepared;
    let equal_weights = ws.weighing == Weighing::Blocks;
    let model = model_of(ws, &choice.picked);
    let solution = ws.fit.solve(&model, |_| true);
    let mut next = 0;
    let mut start = Vec::new();
    let mut named = Vec::new();
    let mut curves = Vec::new();
    for (at, &(k, point)) in choice.picked.iter().enumerate() {
        let columns = ws.candidates[k].points[point].1.size();
        let size = solution.added.get(next).copied().filter(|_| columns > 0);
        next += columns;
        match values_at(&ws.candidates[k], point, size.unwrap_or(0.0)) {
            Some(values) => {
                start.push(values);
                named.push(at);
            }
            None => curves.push(at),
        }
    }
    let noise = if equal_weights { ws.noise_of(&model) } else { ws.noise };
    let fit = joint_fit(prepared, &start, noise, equal_weights);
    let diagnosis = &mut answer.diagnosis;
    for (effect, &at) in fit.effects.iter().zip(&named) {
        let (weight, tied) = ties(ws, &choice.picked, at, options.seed);
        diagnosis.effects.push(named_effect(effect, weight, &tied, ws.candidates));
    }
    let all_left = ws.fit.solve(&Model::baseline(), |_| true).left;
    for &at in &curves {
        let fewer = model_of(ws, &without(&choice.picked, at));
        let left_without = ws.fit.solve(&fewer, |_| true).left;
        diagnosis.unknown.push(UnknownCovariate {
            covariate: ws.candidates[choice.picked[at].0].name().to_string(),
            strength: ((left_without - solution.left) / all_left.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
            p_value: choice.p_values.get(at).map_or(1.0, |p| p.max(1e-6)),
        });
    }
    diagnosis.effects.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    diagnosis.unknown.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    diagnosis.conclude();
    baseline_values(diagnosis, prepared, &fit);
    diagnosis.would_have_seen = detect::detectable(ws, &choice.picked, options.seed);
    answer.evidence = evidence(ws, choice);
    answer.effects = fit.effects.iter().map(|e| (e.spec, e.values.clone())).collect();
    let errors = errors(ws, &answer.effects);
    report_errors(&mut answer, prepared, &errors, ws, &model);
    if equal_weights {
        answer.diagnosis.notes.push(
            "the residual is no plain noise, so rows have equal weight and only the error of held-out blocks counts"
                .into(),
        );
    }
    answer
}

fn named_effect(
    effect: &Refined,
    weight: f64,
    tied: &[super::choose::Tie],
    candidates: &[Candidate],
) -> NamedEffect {
    let parameters = effect
        .spec
        .parameters
        .iter()
        .zip(effect.values.iter().zip(&effect.half90))
        .map(|(p, (value, half90))| (p.name.to_string(), estimate(*value, *half90, p.unit)))
        .collect();
    let rival =
        |t: &super::choose::Tie| Rival { name: candidates[t.candidate].name().into(), weight: t.weight };
    let rivals = tied.iter().map(rival).collect();
    NamedEffect::new(effect.spec.id, weight, parameters, rivals, (Measured::SensorTable, Some("")))
}

fn baseline_values(diagnosis: &mut Diagnosis, prepared: &Prepared, fit: &JointFit) {
    for (name, ([offset, gain], [offset90, gain90])) in prepared.names.iter().zip(&fit.sessions) {
        diagnosis.baseline.insert(format!("sessions.{name}.gain"), estimate(*gain, *gain90, "1"));
        diagnosis.baseline.insert(format!("sessions.{name}.offset_n"), estimate(*offset, *offset90, "N"));
    }
}

fn report_errors(
    answer: &mut SensorDiagnosis,
    prepared: &Prepared,
    errors: &Errors,
    ws: &Workspace<'_>,
    model: &Model,
) {
    let rows = ws.rows();
    let freedom = (rows - 2.0 * prepared.names.len() as f64 - model.added.len() as f64).max(1.0);
    let left: f64 = ws.residual(model, false).iter().map(|r| r * r).sum();
    answer.diagnosis.noise_floor_n = Some(libm::sqrt(left / freedom));
    answer.diagnosis.error = Some(ErrorReport {
        heldout: "blocks".into(),
        before: errors.blocks.before,
        after: errors.blocks.after,
        by: ErrorsBy { levels: None, sessions: errors.sessions },
    });
    let rate = prepared.grouped(&force_rate(prepared));
    let clock = prepared.grouped(&prepared.clock_s);
    let sessions = prepared.group_session();
    let reference = prepared.grouped(&prepared.reference_n);
    let measured = prepared.grouped(&prepared.measured);
    answer.rows = (0..measured.len())
        .map(|i| SensorRow {
            clock_s: clock[i],
            session: sessions[i],
            reference_n: reference[i],
            rate_n_per_s: rate[i],
            measured_n: measured[i],
            before_n: errors.before[i],
            after_n: errors.after[i],
        })
        .collect();
    let mut blocks: Vec<SensorBlock> = prepared
        .units
        .chunk_by(|a, b| (a.session, a.fold) == (b.session, b.fold))
        .map(|units| {
            let all = &answer.rows[units[0].from..units[units.len() - 1].to];
            let n = all.len() as f64;
            let mean = |f: fn(&SensorRow) -> f64| all.iter().map(f).sum::<f64>() / n;
            SensorBlock {
                session: prepared.names[units[0].session].clone(),
                from_to_s: (all[0].clock_s, all[all.len() - 1].clock_s),
                measured_n: mean(|r| r.measured_n),
                predicted_n: mean(|r| r.after_n),
                rmse_n: libm::sqrt(mean(|r| (r.measured_n - r.after_n) * (r.measured_n - r.after_n))),
            }
        })
        .collect();
    blocks.sort_by(|a, b| b.rmse_n.total_cmp(&a.rmse_n));
    answer.blocks = blocks;
}

fn bare(data: &SensorData) -> SensorDiagnosis {
    SensorDiagnosis {
        diagnosis: Diagnosis::blank(
            Channel::Sensor,
            DataSummary { rows: Some(data.time_s.len()), ..DataSummary::default() },
        ),
        effects: Vec::new(),
        sessions: Vec::new(),
        rows: Vec::new(),
        blocks: Vec::new(),
        evidence: Vec::new(),
    }
}

fn insufficient(mut answer: SensorDiagnosis, reason: String) -> SensorDiagnosis {
    answer.diagnosis.notes.insert(0, reason);
    answer
}

/// What never varied, and what nobody wrote down.
fn excitation(data: &SensorData, prepared: &Prepared, diagnosis: &mut Diagnosis) {
    for (name, covariate) in &data.extra {
        if !covariate.varies() {
            diagnosis.not_excited.push(name.clone());
        }
    }
    let rate = force_rate(prepared);
    let (lowest, highest) = range(rate.iter().copied());
    if lowest >= 0.0 || highest <= 0.0 {
        diagnosis.not_excited.push(FORCE_RATE.into());
        diagnosis.notes.push(
            "the reference force never turns round: hysteresis cannot be told from a change of the offset"
                .into(),
        );
    }
    let named = |word: &str| data.extra.iter().any(|(name, _)| name.contains(word));
    if !named("temperature") {
        diagnosis.not_recorded.push("temperature_c".into());
    }
}

/// Gains of the sessions by equal weights.
fn baseline_gains(prepared: &Prepared) -> Vec<f64> {
    let columns = [
        vec![1.0; prepared.groups.len()],
        prepared.grouped(&prepared.reference_n),
        prepared.grouped(&prepared.measured),
    ];
    let fit = Moments::new(&prepared.units, &columns).solve(&Model::baseline(), |_| true);
    fit.sessions.iter().map(|s| s[1]).collect()
}

/// Whether the two columns are forces of one sensor in plausible units.
fn plausible(prepared: &Prepared, gains: &[f64]) -> Result<(), String> {
    let (low, high) = range(prepared.reference_n.iter().copied());
    let most = high.abs().max(low.abs());
    if !(1e-2..=5e3).contains(&most) {
        return Err(format!(
            "reference forces reach {most} N: this table is for forces of a gripper; is the column in another unit?"
        ));
    }
    let gain = median(gains.iter().map(|g| g.abs()).collect()).unwrap_or_default();
    if !(4e-3..=250.0).contains(&gain) {
        return Err(format!(
            "the measured column is {} times the reference: one of them is in another unit (a factor of \
             1000?), or the sensor does not see this force",
            rounded(gain, &[4e-3, 250.0])
        ));
    }
    Ok(())
}
