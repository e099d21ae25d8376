//! What one trace crept by, and where it slipped.

use super::super::observe::{TraceObservation, displacement_noise, mean};
use gripgen_twin::PullTrace;
use nalgebra::{DMatrix, DVector};

/// Share of the largest force up to which a trace is looked at.
const HELD: f64 = 0.8;

/// Way that a trace has to creep, and how much more that has to be than what its gels shear by.
pub const LEAST_M: f64 = 1e-4;
const BEYOND_SHEAR: f64 = 3.0;

/// What may be left of a trace: a part of its way, or of the noise of its displacement.
const LEFT: f64 = 0.1;
const LEFT_OF_NOISE: f64 = 3.0;

/// Fewest rows of a trace.
const MIN_ROWS: usize = 10;

/// Share by which a model of creep differs from what a trace does.
const MODEL_SD: f64 = 0.07;

/// Slope of the readings after a slip over that before it, above which nothing has slipped.
const RISES_ON: f64 = 0.5;

/// What a trace crept by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crept {
    /// Way over impulse, in m/(N s), and its standard deviation.
    pub rate: f64,
    pub sd: f64,
    /// The force up to which that is.
    pub to_n: f64,
}

/// Time, force and displacement of the rows of the pull, forces less the reading without load.
pub fn pulled(trace: &PullTrace) -> Vec<(f64, f64, f64)> {
    let no_load: Vec<f64> = trace.rows().filter(|r| r.time_s < 0.0).map(|r| r.measured_force_n).collect();
    let zero_n = mean(&no_load).filter(|(_, n)| *n >= 5).map_or(0.0, |(zero_n, _)| zero_n);
    let rows = trace.rows().filter(|r| r.time_s >= 0.0);
    rows.map(|r| (r.time_s, r.measured_force_n - zero_n, r.displacement_m)).collect()
}

/// Force times time up to each row of a pull.
pub fn impulses_n_s(pulled: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut impulse_n_s = 0.0;
    let steps = pulled.windows(2).map(|w| {
        impulse_n_s += 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0);
        impulse_n_s
    });
    std::iter::once(0.0).chain(steps).take(pulled.len()).collect()
}

/// What follows a slip is level: readings that rise on are those of a tool that creeps to its stop.
pub fn without_slips_that_rise(mut seen: TraceObservation) -> TraceObservation {
    let slope = |rows: &[(f64, f64)]| {
        let n = rows.len() as f64;
        let (mt, my) = (rows.iter().map(|r| r.0).sum::<f64>() / n, rows.iter().map(|r| r.1).sum::<f64>() / n);
        let (ty, tt) = rows
            .iter()
            .fold((0.0, 0.0), |(ty, tt), (t, y)| (ty + (t - mt) * (y - my), tt + (t - mt) * (t - mt)));
        if tt > 0.0 { ty / tt } else { 0.0 }
    };
    let after: Vec<(f64, f64)> = seen.slid_rows.iter().map(|r| (r.0, r.1)).collect();
    let before: Vec<(f64, f64)> = seen.held_s.iter().copied().zip(seen.held_n.iter().copied()).collect();
    if seen.slip_s.is_some()
        && (after.len() < 3 || before.len() < 3 || slope(&after) > RISES_ON * slope(&before))
    {
        (seen.slip_s, seen.slid_n) = (None, None);
        seen.before_slip_n.clear();
        seen.slid_rows.clear();
    }
    seen
}

/// A trace with enough rows.
#[derive(Debug, Clone, Copy)]
pub struct LookedAt {
    /// Force times time up to where it is looked at.
    pub impulse_n_s: f64,
    /// What it crept by, if that is far.
    pub crept: Option<Crept>,
}

impl LookedAt {
    /// What is seen of a trace, if it has enough rows.
    pub fn of(trace: &PullTrace) -> Option<Self> {
        let rows = pulled(trace);
        let smooth: Vec<f64> = rows.windows(3).map(|w| w.iter().map(|r| r.1).sum::<f64>() / 3.0).collect();
        let most_n = smooth.iter().copied().fold(0.0, f64::max);
        let held = smooth.iter().position(|f| *f >= HELD * most_n)?;
        if held < MIN_ROWS {
            return None;
        }
        let held_rows = &rows[..=held];
        let impulse_n_s = impulses_n_s(held_rows);
        let mut points: Vec<(Vec<f64>, f64)> =
            held_rows.iter().zip(&impulse_n_s).map(|(r, i)| (vec![1.0, r.1, *i], r.2)).collect();
        let mut found = least_squares(&points)?;
        if found[1] < 0.0 {
            points.iter_mut().for_each(|(x, _)| x[1] = 0.0);
            found = least_squares(&points)?;
        }
        let left =
            points.iter().map(|(x, y)| (y - x.iter().zip(&found).map(|(a, b)| a * b).sum::<f64>()).powi(2));
        let left_m = (left.sum::<f64>() / points.len() as f64).sqrt();
        let (shear_m, crept_m) = (found[1] * rows[held].1, found[2] * impulse_n_s[held]);
        let way_m: Vec<f64> = held_rows.iter().map(|r| r.2).collect();
        let noise_m = displacement_noise(&way_m);
        let creeps = crept_m >= LEAST_M && crept_m >= BEYOND_SHEAR * shear_m;
        let follows = left_m <= (LEFT_OF_NOISE * noise_m).max(LEFT * crept_m);
        let sd = found[2] * libm::hypot(MODEL_SD, left_m / crept_m);
        let crept = (creeps && follows).then_some(Crept { rate: found[2], sd, to_n: smooth[held] });
        Some(Self { impulse_n_s: impulse_n_s[held], crept })
    }
}

/// Least squares; columns without a size stay out.
pub fn least_squares(rows: &[(Vec<f64>, f64)]) -> Option<Vec<f64>> {
    let columns = rows.first()?.0.len();
    let size = |k: usize| rows.iter().map(|(x, _)| x[k] * x[k]).sum::<f64>();
    let used: Vec<usize> = (0..columns).filter(|&k| size(k) > 0.0).collect();
    let slopes = DMatrix::from_fn(rows.len(), used.len(), |i, k| rows[i].0[used[k]]);
    let measured = DVector::from_iterator(rows.len(), rows.iter().map(|(_, y)| *y));
    let solved = slopes.tr_mul(&slopes).cholesky()?.solve(&slopes.tr_mul(&measured));
    let mut found = vec![0.0; columns];
    used.iter().zip(solved.iter()).for_each(|(&k, value)| found[k] = *value);
    Some(found)
}
