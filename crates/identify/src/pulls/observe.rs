//! What a trace says, in a few numbers: the no-load reading, the readings while the jaws held, the reading at which they
//! slipped, the reading while they slid.

use gripgen_twin::{MeasuredPull, PullTrace};

/// Levels of force at which the readings before a slip are averaged.
pub const LEVELS: usize = 6;

/// Displacement beyond that of the sheared gels at which the jaws have slipped, if noise allows to see it.
const SLID_M: f64 = 0.03e-3;

/// Share by which the displacement grows beyond that of the sheared gels while the rim of the contact slips.
const SOFTER: f64 = 0.12;

/// Time at the start of a pull that is left out: the response of an arm is of higher order than its model.
pub const START_S: f64 = 0.25;

/// Readings before the slip that are kept beside those while the jaws held.
const BEFORE_SLIP: usize = 6;

/// The numbers of one trace.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceObservation {
    /// Which pull.
    pub row: usize,
    /// Mean reading without load, and how many readings.
    pub no_load_n: Option<(f64, usize)>,
    /// Times of readings while the jaws held.
    pub held_s: Vec<f64>,
    /// These readings.
    pub held_n: Vec<f64>,
    /// Displacements at these readings.
    pub held_m: Vec<f64>,
    /// Time of the first row after the slip, if there is one.
    pub slip_s: Option<f64>,
    /// The last readings before the slip, the rim's included.
    pub before_slip_n: Vec<f64>,
    /// Mean reading while the jaws slid, and how many readings.
    pub slid_n: Option<(f64, usize)>,
    /// Time, reading and displacement while the jaws slid.
    pub slid_rows: Vec<(f64, f64, f64)>,
}

/// Standard deviation of the no-load readings of all traces, about the mean of each.
pub fn noise_n(pulls: &[MeasuredPull]) -> Option<f64> {
    let (mut square, mut count) = (0.0, 0_usize);
    for trace in pulls.iter().filter_map(|p| p.trace.as_ref()) {
        let x: Vec<f64> = trace.rows().filter(|r| r.time_s < 0.0).map(|r| r.measured_force_n).collect();
        if x.len() < 5 {
            continue;
        }
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        square += x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        count += x.len() - 1;
    }
    (count >= 20).then(|| (square / count as f64).sqrt())
}

/// Reads a trace. `noise_n` is the noise of a reading.
pub fn observe(row: usize, trace: &PullTrace, noise_n: f64) -> TraceObservation {
    let no_load: Vec<f64> = trace.rows().filter(|r| r.time_s < 0.0).map(|r| r.measured_force_n).collect();
    let pulled: Vec<_> = trace.rows().filter(|r| r.time_s >= 0.0).collect();
    let by_displacement =
        slip_row(&pulled.iter().map(|r| (r.measured_force_n, r.displacement_m)).collect::<Vec<_>>(), noise_n);
    let slip = by_displacement.map(|row| {
        let rows: Vec<_> = pulled.iter().map(|r| (r.time_s, r.measured_force_n)).collect();
        let from = rows.partition_point(|r| r.0 < START_S);
        force_levels(&rows[from..]).map_or(row, |row| from + row)
    });
    // While the rim slips nothing has let go, but the gels are no springs any more.
    let held = by_displacement.into_iter().chain(slip).min().unwrap_or(pulled.len());
    let mut observation = TraceObservation {
        row,
        no_load_n: mean(&no_load),
        held_s: vec![],
        held_n: vec![],
        held_m: vec![],
        slip_s: slip.map(|i| pulled[i].time_s),
        before_slip_n: vec![],
        slid_n: None,
        slid_rows: vec![],
    };
    for r in pulled[..held].iter().filter(|r| r.time_s >= START_S) {
        observation.held_s.push(r.time_s);
        observation.held_n.push(r.measured_force_n);
        observation.held_m.push(r.displacement_m);
    }
    if let Some(slip) = slip {
        let last = &pulled[slip.saturating_sub(BEFORE_SLIP)..slip];
        observation.before_slip_n = last.iter().map(|r| r.measured_force_n).collect();
        let slid: Vec<f64> = pulled[slip..].iter().skip(1).map(|r| r.measured_force_n).collect();
        observation.slid_n = mean(&slid).filter(|(_, n)| *n >= 3);
        observation.slid_rows =
            pulled[slip..].iter().map(|r| (r.time_s, r.measured_force_n, r.displacement_m)).collect();
    }
    observation
}

/// The value in the middle, the upper one of two; 0 of none.
pub(super) fn median(x: &mut [f64]) -> f64 {
    x.sort_by(f64::total_cmp);
    x.get(x.len() / 2).copied().unwrap_or(0.0)
}

/// Mean and number, of one at least.
pub(super) fn mean(x: &[f64]) -> Option<(f64, usize)> {
    (!x.is_empty()).then(|| (x.iter().sum::<f64>() / x.len() as f64, x.len()))
}

/// The first row at which a force stops to follow its staircase, of (time, reading) rows: a line up to it, a level from it on,
/// by least squares. Unlike the displacement this knows nothing of how the gels bend before they slip.
fn force_levels(rows: &[(f64, f64)]) -> Option<usize> {
    let n = rows.len();
    // Sums of 1, t, t^2, y, t y, y^2 over the rows before each.
    let mut sums = vec![[0.0; 6]; n + 1];
    for (i, (t, y)) in rows.iter().enumerate() {
        let row = [1.0, *t, t * t, *y, t * y, y * y];
        for (k, x) in row.into_iter().enumerate() {
            sums[i + 1][k] = sums[i][k] + x;
        }
    }
    let cost = |at: usize| {
        let [n0, t, tt, y, ty, yy] = sums[at];
        let (vt, cty, vy) = (tt - t * t / n0, ty - t * y / n0, yy - y * y / n0);
        let after: Vec<f64> = sums[n].iter().zip(&sums[at]).map(|(a, b)| a - b).collect();
        vy - cty * cty / vt + after[5] - after[3] * after[3] / after[0]
    };
    (8..n.saturating_sub(3)).min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
}

/// Noise of displacements from their second differences, which a steady motion does not have; of three at least.
pub(super) fn displacement_noise(way_m: &[f64]) -> f64 {
    let mut bends: Vec<f64> = way_m.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    bends.sort_by(f64::total_cmp);
    0.605 * bends[bends.len() / 2]
}

/// The first row after the slip of (reading, displacement) rows: from there on the displacement is beyond that of the
/// sheared gels for good. Late where the jaws slide slowly at first, early where the rim slips first.
fn slip_row(rows: &[(f64, f64)], noise_n: f64) -> Option<usize> {
    let n = rows.len();
    if n < 8 {
        return None;
    }
    // Compliance of the gels from the first part of the pull, by least squares through the first rows that carry load.
    let most = rows.iter().map(|r| r.0).fold(0.0, f64::max);
    let (mut fx, mut ff) = (0.0, 0.0);
    let mut x0 = 0.0;
    for (i, (force, x)) in rows.iter().enumerate() {
        if i == 0 {
            x0 = *x;
        }
        if *force > 0.85 * most {
            break;
        }
        if *force > 2.0 * noise_n {
            fx += force * (x - x0);
            ff += force * force;
        }
    }
    let compliance = if ff > 0.0 { (fx / ff).max(0.0) } else { 0.0 };
    let beyond = |i: usize| rows[i].1 - x0 - compliance * rows[i].0;
    let displacements: Vec<f64> = rows[..n / 2 + 2].iter().map(|r| r.1).collect();
    let threshold = SLID_M.max(5.0 * displacement_noise(&displacements));
    // Slip that begins at the rim softens the gels before the jaws let go.
    let slid = |i: usize| beyond(i) > threshold.max(SOFTER * compliance * rows[i].0);
    if !slid(n - 1) {
        return None;
    }
    let mut first = n - 1;
    while first > 0 && slid(first - 1) {
        first -= 1;
    }
    // The rows just before the threshold belong to the slide already.
    Some(first.saturating_sub(1).max(1))
}

/// Time constant of the fall after a slip: the area above the kinetic force, over the drop, of all traces that drop by much.
pub(super) fn fall_s(raw: &[TraceObservation], noise_n: f64) -> Option<f64> {
    let mut each: Vec<f64> = raw
        .iter()
        .filter_map(|t| {
            if t.held_n.len() < 8 || t.slid_rows.len() < 8 {
                return None;
            }
            // The kinetic force is that of the second half of the slide; the limit the largest mean of three around the slip.
            let half = &t.slid_rows[t.slid_rows.len() / 2..];
            let kinetic = half.iter().map(|r| r.1).sum::<f64>() / half.len() as f64;
            let slid = t.slid_rows.iter().map(|r| r.1);
            let force: Vec<f64> = t.before_slip_n.iter().copied().chain(slid).collect();
            let threes = force.windows(3).take(2 * t.before_slip_n.len() + 1);
            let limit = threes.map(|w| w.iter().sum::<f64>() / 3.0).fold(f64::NEG_INFINITY, f64::max);
            let step_s = t.slid_rows[1].0 - t.slid_rows[0].0;
            let drop = limit - kinetic;
            // From the last reading near the limit on: nothing, on average, of a force that falls at once.
            let share: Vec<f64> = force.iter().map(|f| (f - kinetic) / drop).collect();
            let near = share.iter().rposition(|u| *u > 0.75)?;
            let area: f64 = share[near + 1..].iter().take(8).sum::<f64>() * step_s;
            (drop > 0.6 && drop > 6.0 * noise_n).then_some(area)
        })
        .collect();
    each.sort_by(f64::total_cmp);
    (each.len() >= 4).then(|| each[each.len() / 2].clamp(0.0, 0.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    /// A sphere on a soft gel (Mindlin 1949) moves by half as much again before it slips, at 1.6 s: the displacement leaves that
    /// of the gels earlier, the force follows until then.
    #[test]
    fn a_contact_that_bends_has_not_slipped() {
        let mut draws = Draws::new(2, 0);
        let rows: Vec<(f64, f64, f64)> = (0..200)
            .map(|i| {
                let t = 0.01 * f64::from(i);
                let force = 8.0 * t.min(1.6);
                let sheared = 1.5 * (1.0 - (1.0 - force / 12.8).powf(2.0 / 3.0)) * 12.8 / 20e3;
                (t, force + 0.1 * draws.normal(), sheared + 0.02 * (t - 1.6).max(0.0))
            })
            .collect();
        let by_displacement = slip_row(&rows.iter().map(|r| (r.1, r.2)).collect::<Vec<_>>(), 0.1).unwrap();
        assert!(rows[by_displacement].0 < 1.5, "what the force is for: {by_displacement}");
        let by_force = force_levels(&rows.iter().map(|r| (r.0, r.1)).collect::<Vec<_>>()).unwrap();
        assert!((rows[by_force].0 - 1.6).abs() < 0.04, "{by_force}");
    }
}
