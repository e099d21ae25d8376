//! How force mode follows a staircase, and how the sensor follows force mode.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Time constants and dead times that are tried, s.
const LAGS_S: [f64; 16] =
    [0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.12, 0.16, 0.22, 0.3, 0.42, 0.6, 0.9, 1.4];
const DEAD_S: [f64; 11] = [0.0, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.14, 0.2, 0.3, 0.45];
/// The end of a step that shows what it comes to, as a share of it.
const SETTLED: f64 = 0.2;
/// Rows that a fit needs.
const ROWS: usize = 50;
/// Most rows that are compared.
const MOST_ROWS: usize = 1500;

/// One reading of a pull whose part holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRow {
    /// Time, s.
    pub time_s: f64,
    /// Command.
    pub desired_n: f64,
    /// Reading along the pull.
    pub measured_n: f64,
    /// Displacement along it.
    pub displacement_m: f64,
}

/// What follows a command with a dead time and a time constant: `lag dy/dt = u(t - dead) - y`, `reading = zero + gain y`. Gels give
/// way the more the nearer a pull is to the slip, so a displacement has terms in y^2 and y^3 beside it: without them such a gel looks
/// like a lag of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Follows {
    /// Time constant.
    pub lag_s: f64,
    /// Dead time.
    pub dead_s: f64,
    /// What a newton of command comes to; of a displacement at no force.
    pub gain: f64,
    /// Root mean square of what is left.
    pub rest: f64,
}

impl Follows {
    /// How far it trails a command that rises evenly, s.
    pub fn trails_s(&self) -> f64 {
        self.lag_s + self.dead_s
    }
}

/// The answer to a staircase.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The force that is read.
    pub force: Follows,
    /// The displacement of the tool on gels that give way: what force mode does, whatever the sensor says of it. `gain` and
    /// `rest` in m/N and m.
    pub displacement: Follows,
    /// What the force trails longer than the displacement: the sensor's part, and 0 where it does not.
    pub sensor_s: f64,
    /// How far the force went beyond a command at most, over what noise explains.
    pub overshoot_n: f64,
    /// How far the end of a step stayed from its command at most.
    pub deadband_n: f64,
}

/// What the rows say; `None` if there are too few.
pub fn response(rows: &[StepRow], noise_n: f64) -> Option<Response> {
    if rows.len() < ROWS {
        return None;
    }
    let every = rows.len().div_ceil(MOST_ROWS);
    let rows: Vec<StepRow> = rows.iter().copied().step_by(every).collect();
    let force = follows::<2>(&rows, |row| row.measured_n)?;
    let displacement = follows::<4>(&rows, |row| row.displacement_m)?;
    let over = |row: &StepRow| row.measured_n - row.desired_n - 4.0 * noise_n;
    Some(Response {
        force,
        displacement,
        sensor_s: (force.trails_s() - displacement.trails_s()).max(0.0),
        overshoot_n: rows.iter().map(over).fold(0.0, f64::max),
        deadband_n: deadband_n(&rows),
    })
}

/// The best dead time and time constant for a column, by least squares; `TERMS` powers of what follows, from 0 on.
fn follows<const TERMS: usize>(rows: &[StepRow], of: impl Fn(&StepRow) -> f64) -> Option<Follows> {
    let with = |dead_s: f64, lag_s: f64| fitted::<TERMS>(rows, &of, dead_s, lag_s);
    let mut best: Option<Follows> = None;
    for (dead_s, lag_s) in DEAD_S.iter().flat_map(|dead| LAGS_S.iter().map(move |lag| (*dead, *lag))) {
        best = better(best, with(dead_s, lag_s));
    }
    // Around the best of the grid.
    for scale in [0.3, 0.12, 0.05, 0.02] {
        let middle = best?;
        let (lag_step, dead_step) = (scale * middle.lag_s.max(0.01), scale * middle.dead_s.max(0.01));
        for (i, j) in (-2..=2).flat_map(|i| (-2..=2).map(move |j| (f64::from(i), f64::from(j)))) {
            let (lag_s, dead_s) = (middle.lag_s + i * lag_step, middle.dead_s + j * dead_step);
            if lag_s >= 0.0 && dead_s >= 0.0 {
                best = better(best, with(dead_s, lag_s));
            }
        }
    }
    best
}

fn better(a: Option<Follows>, b: Option<Follows>) -> Option<Follows> {
    match (a, b) {
        (Some(a), Some(b)) if b.rest < a.rest => Some(b),
        (None, b) => b,
        (a, _) => a,
    }
}

fn fitted<const TERMS: usize>(
    rows: &[StepRow],
    of: &impl Fn(&StepRow) -> f64,
    dead_s: f64,
    lag_s: f64,
) -> Option<Follows> {
    let first = rows.first()?;
    let (mut y, mut before_s, mut late) = (0.0, first.time_s, 0);
    let most_n = rows.iter().map(|row| row.desired_n.abs()).fold(0.0, f64::max);
    let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
    let (mut right, mut squares) = (SVector::<f64, TERMS>::zeros(), 0.0);
    for row in rows {
        // The command a dead time ago.
        while late + 1 < rows.len() && rows[late + 1].time_s <= row.time_s - dead_s {
            late += 1;
        }
        let asked_n = if rows[late].time_s <= row.time_s - dead_s { rows[late].desired_n } else { 0.0 };
        let passed_s = row.time_s - before_s;
        y += (asked_n - y) * if lag_s > 0.0 { 1.0 - (-passed_s / lag_s).exp() } else { 1.0 };
        before_s = row.time_s;
        let powers = SVector::<f64, TERMS>::from_fn(|power, _| (y / most_n).powi(power as i32));
        let x = of(row);
        normal += powers * powers.transpose();
        right += powers * x;
        squares += x * x;
    }
    // A ridge far below what varies: steps of one height leave powers that are alike.
    let ridge = SMatrix::<f64, TERMS, TERMS>::identity() * (1e-12 * normal.trace());
    let terms = (normal + ridge).cholesky()?.solve(&right);
    let gain = terms[1] / most_n;
    let rest = ((squares - terms.dot(&right)).max(0.0) / rows.len() as f64).sqrt();
    (rest.is_finite() && gain.is_finite()).then_some(Follows { lag_s, dead_s, gain, rest })
}

/// Largest difference between a command and the mean of the end of its step.
fn deadband_n(rows: &[StepRow]) -> f64 {
    let steps = rows.chunk_by(|a, b| a.desired_n == b.desired_n);
    let off_n = steps.filter(|step| step.len() >= 10).map(|step| {
        let from = step.len() - (SETTLED * step.len() as f64) as usize;
        let end = &step[from.min(step.len() - 1)..];
        (end.iter().map(|row| row.measured_n).sum::<f64>() / end.len() as f64 - end[0].desired_n).abs()
    });
    off_n.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase of 1 N every 0.4 s through two first-order lags and a dead time, in fine steps of its own.
    fn rows(dead_s: f64, loop_s: f64, sensor_s: f64) -> Vec<StepRow> {
        rows_on(|applied_n| 2e-5 * applied_n, dead_s, loop_s, sensor_s)
    }

    /// The same on a gel whose displacement is a function of the force.
    fn rows_on(gel_m: impl Fn(f64) -> f64, dead_s: f64, loop_s: f64, sensor_s: f64) -> Vec<StepRow> {
        let (mut applied_n, mut felt_n) = (0.0, 0.0);
        let follow = |y: f64, u: f64, lag_s: f64| if lag_s > 0.0 { y + (u - y) * 0.0005 / lag_s } else { u };
        let desired = |t: f64| if t < 0.0 { 0.0 } else { (t / 0.4).floor() + 1.0 };
        (0..4000)
            .filter_map(|k| {
                let time_s = f64::from(k) * 0.0005;
                applied_n = follow(applied_n, desired(time_s - dead_s), loop_s);
                felt_n = follow(felt_n, applied_n, sensor_s);
                (k % 4 == 0).then_some(StepRow {
                    time_s,
                    desired_n: desired(time_s),
                    measured_n: 1.1 * felt_n + 0.2,
                    displacement_m: gel_m(applied_n),
                })
            })
            .collect()
    }

    #[test]
    fn loop_and_sensor_are_told_apart() {
        for (dead_s, loop_s, sensor_s) in
            [(0.0, 0.0, 0.0), (0.0, 0.35, 0.0), (0.0, 0.0, 0.35), (0.02, 0.05, 0.1), (0.1, 0.02, 0.0)]
        {
            let found = response(&rows(dead_s, loop_s, sensor_s), 0.0).unwrap();
            let (force_s, tool_s) = (found.force.trails_s(), found.displacement.trails_s());
            let all_s = dead_s + loop_s + sensor_s;
            let said = format!("{dead_s} {loop_s} {sensor_s}: {found:?}");
            assert!((tool_s - dead_s - loop_s).abs() < 0.012, "{said}");
            // Two lags in series are no single one: together they are read too long by a tenth.
            assert!((force_s - all_s).abs() < 0.01 + 0.1 * all_s, "{said}");
            assert!((found.sensor_s - sensor_s).abs() < 0.01 + 0.1 * all_s, "{said}");
        }
        // A gel that gives way the more the nearer the slip (at 9 N), as one under a rim of pressure does.
        let gel_m = |applied_n: f64| -3.6e-4 * (1.0 - applied_n / 9.0).ln();
        for (loop_s, sensor_s) in [(0.35, 0.0), (0.0, 0.35), (0.1, 0.05)] {
            let found = response(&rows_on(gel_m, 0.0, loop_s, sensor_s), 0.0).unwrap();
            assert!((found.displacement.trails_s() - loop_s).abs() < 0.02, "{loop_s} {sensor_s}: {found:?}");
        }
        let quick = response(&rows(0.0, 0.0, 0.0), 0.0).unwrap();
        assert!((quick.force.gain - 1.1).abs() < 0.01 && quick.force.rest < 1e-4, "{quick:?}");
        // 0.2 N of zero and a tenth of gain beside 5 N.
        assert!((quick.deadband_n - 0.7).abs() < 0.01 && (quick.overshoot_n - 0.7).abs() < 0.01, "{quick:?}");
        assert!(response(&rows(0.0, 0.0, 0.0)[..20], 0.0).is_none());
    }
}
