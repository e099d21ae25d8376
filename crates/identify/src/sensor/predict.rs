//! How far a chain of sensor effects is from a table.

use super::SensorData;
use super::candidates::chain;
use super::prepare::prepare;
use gripgen_twin::effects::EffectSpec;

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
