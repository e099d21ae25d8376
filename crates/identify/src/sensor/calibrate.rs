//! Gain and offset of a force sensor, and how far a chain of sensor effects is from a table.

use super::candidates::chain;
use super::moments::{Model, Moments};
use super::noise::{Noise, Whitener, fit_noise};
use super::prepare::{Prepared, prepare};
use super::refine::joint_fit;
use super::{SensorData, SensorOptions};
use crate::diagnosis::ParameterEstimate;
use gripgen_twin::effects::EffectSpec;

/// Gain and offset of one session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionCalibration {
    /// Its name.
    pub name: String,
    /// Rows that were used.
    pub rows: usize,
    /// Measured over reference.
    pub gain: ParameterEstimate,
    /// Reading without load, in the unit of the measured column.
    pub offset: ParameterEstimate,
    /// Root of the mean squared residual, in the unit of the measured column.
    pub rmse_n: f64,
    /// Correlation of the residual from one row to the next.
    pub lag_one: f64,
}

/// Gain and offset of every session.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorCalibration {
    /// In the order of the table.
    pub sessions: Vec<SessionCalibration>,
    /// Reference forces of the table: smallest and largest.
    pub reference_range_n: (f64, f64),
    /// Remarks for people.
    pub notes: Vec<String>,
}

/// Fits gain and offset of every session by least squares. The 90 % intervals hold for residuals as correlated as the
/// measured ones: white noise beside a first-order autoregression, simulated. The error says what is missing.
///
/// # Errors
///
/// A table from which gain and offset do not follow; the text says why.
pub fn calibrate_sensor(data: &SensorData) -> Result<SensorCalibration, String> {
    let prepared = prepare(data, SensorOptions::default().max_rows)?;
    let noise = baseline_noise(&prepared);
    let fit = joint_fit(&prepared, &[], noise, true);
    let estimates: Vec<SessionCalibration> = fit
        .sessions
        .iter()
        .zip(&prepared.names)
        .enumerate()
        .map(|(s, (&([offset, gain], [offset90, gain90]), name))| {
            let left: Vec<f64> = (0..prepared.session.len())
                .filter(|&i| prepared.session[i] == s)
                .map(|i| prepared.measured[i] - offset - gain * prepared.reference_n[i])
                .collect();
            let power: f64 = left.iter().map(|r| r * r).sum();
            let next: f64 = left.windows(2).map(|w| w[0] * w[1]).sum();
            SessionCalibration {
                name: name.clone(),
                rows: left.len(),
                gain: estimate(gain, gain90, "1"),
                offset: estimate(offset, offset90, "N"),
                rmse_n: libm::sqrt(power / left.len() as f64),
                lag_one: if power > 0.0 { next / power } else { 0.0 },
            }
        })
        .collect();
    let reference_range_n = super::prepare::range(prepared.reference_n.iter().copied());
    Ok(SensorCalibration { sessions: estimates, reference_range_n, notes: prepared.notes })
}

/// Value and half length of its interval.
pub(crate) fn estimate(value: f64, half90: f64, unit: &str) -> ParameterEstimate {
    ParameterEstimate::new(value, (value - half90, value + half90), unit)
}

/// The noise beside gain and offset.
fn baseline_noise(prepared: &Prepared) -> Noise {
    let columns = [
        vec![1.0; prepared.groups.len()],
        prepared.grouped(&chain(prepared, &[])),
        prepared.grouped(&prepared.measured),
    ];
    let n = prepared.groups.len() as f64;
    fit_noise(|noise| {
        let whitener = Whitener::new(noise, &prepared.group_steps);
        let mut weighed = columns.to_vec();
        for column in &mut weighed {
            whitener.apply(column);
        }
        let left = Moments::new(&prepared.units, &weighed).solve(&Model::baseline(), |_| true).left;
        0.5 * (n * libm::log((left / n).max(f64::MIN_POSITIVE)) + whitener.log_determinant)
    })
    .0
}

/// Error of a prediction of a table, gain and offset of each session refitted.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorComparison {
    /// Rows.
    pub n: usize,
    /// Root of the mean squared error, in the unit of the measured column.
    pub rmse_n: f64,
    /// Mean error over mean reading, both without sign.
    pub mape_pct: f64,
    /// Mean error: 0, since the offset is refitted.
    pub bias_n: f64,
    /// Name, rows and error of each session.
    pub by_session: Vec<(String, usize, f64)>,
}

/// Compares a table with what `effects` (spec and values in its order) make of its reference forces. The error says what
/// the table lacks.
///
/// # Errors
///
/// A table from which gain and offset do not follow; the text says why.
pub fn compare_sensor(
    data: &SensorData,
    effects: &[(&EffectSpec, &[f64])],
) -> Result<SensorComparison, String> {
    let prepared = prepare(data, usize::MAX)?;
    let force = chain(&prepared, effects);
    let y = &prepared.measured;
    let mut errors = vec![0.0; y.len()];
    let mut by_session = Vec::new();
    for (s, name) in prepared.names.iter().enumerate() {
        let rows: Vec<usize> = (0..y.len()).filter(|&i| prepared.session[i] == s).collect();
        let n = rows.len() as f64;
        let (mf, my) =
            (rows.iter().map(|&i| force[i]).sum::<f64>() / n, rows.iter().map(|&i| y[i]).sum::<f64>() / n);
        let product: f64 = rows.iter().map(|&i| (force[i] - mf) * (y[i] - my)).sum();
        let square: f64 = rows.iter().map(|&i| (force[i] - mf) * (force[i] - mf)).sum();
        let gain = if square > 0.0 { product / square } else { 0.0 };
        let mut sum = 0.0;
        for &i in &rows {
            errors[i] = my + gain * (force[i] - mf) - y[i];
            sum += errors[i] * errors[i];
        }
        by_session.push((name.clone(), rows.len(), libm::sqrt(sum / n)));
    }
    let n = errors.len() as f64;
    let absolute: f64 = errors.iter().map(|e| e.abs()).sum();
    let readings: f64 = y.iter().map(|v| v.abs()).sum();
    Ok(SensorComparison {
        n: errors.len(),
        rmse_n: libm::sqrt(errors.iter().map(|e| e * e).sum::<f64>() / n),
        mape_pct: if readings > 0.0 { 100.0 * absolute / readings } else { 0.0 },
        bias_n: errors.iter().sum::<f64>() / n,
        by_session,
    })
}
