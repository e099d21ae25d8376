//! Whether the label is the force at which the jaws slipped.

use super::follow::{Follow, follow, response};
use super::signal::{MEDIAN_OF_NORMAL, Signal, WINDOW_S, mean};
use super::{Expected, Finding, FindingKind, LabelBudget, LabelEvidence, SIGMAS, cap_n, zero_cap_n};

/// Traces slower than this show no loop, s between two rows.
const SLOWEST_S: f64 = 0.025;
/// The part is surely held below this share of the largest force.
const HELD: f64 = 0.93;
/// Time, and rows, after the label in which the force must have stopped to rise.
const AFTER_S: f64 = 0.1;
const AFTER_ROWS: usize = 8;
/// Displacement beyond the gels' shear that is a slip, m.
const SLIP_M: f64 = 1.5e-4;
/// A displacement whose bend is less than this share of the whole does not show where the slip began.
const BEND: f64 = 0.35;
/// Share of a step of the command by which a loop of a higher order than the fitted one may leave it.
const STEP_SHARE: f64 = 0.6;
/// The same while it starts, and how long that is: s, and time constants.
const STARTING_SHARE: f64 = 1.0;
const SETTLED_S: f64 = 0.15;
const SETTLED_LAGS: f64 = 1.5;
/// Fewest rows of a pull that show how it follows.
const HELD_ROWS: usize = 12;
/// Time from the start in which the loop has hardly acted.
const START_S: f64 = 0.01;
/// Standard deviations of a comparison that another one has to confirm.
const SIGMAS_OF_TWO: f64 = 3.0;
/// Standard deviations where the loop itself says that the rule may fire early.
const SIGMAS_OF_SLOW: f64 = 2.0;
/// Time after a jump in which a part that is held follows the command.
const AGAIN_S: f64 = 0.2;

/// All comparisons around the slip.
pub(super) fn slip(
    signal: &Signal<'_>,
    evidence: &LabelEvidence<'_>,
    expected: &Expected,
    findings: &mut Vec<Finding>,
    budget: &mut LabelBudget,
) {
    let Some(last) = signal.last else { return };
    if signal.spacing_s > SLOWEST_S {
        return;
    }
    let held = held_rows(signal);
    let loop_ = (held >= HELD_ROWS).then(|| {
        let (t, d, f) = (signal.time_s, signal.desired_n, signal.measured_n);
        follow(&t[..held], &d[..held], &f[..held], expected.lag_s)
    });
    if let Some(loop_) = &loop_ {
        findings.push(start(signal, evidence, loop_));
        findings.extend(jump(signal, evidence, loop_, (held, last)));
        budget.gain_n = (loop_.gain - 1.0).abs() * evidence.label_n.abs();
    }
    larger_before(signal, evidence, last, findings, budget);
    if evidence.censored {
        return;
    }
    let lag_s = expected.lag_s.or(loop_.map(|l| l.lag_s)).unwrap_or(0.0);
    early(signal, evidence, last, lag_s, findings, budget);
    findings.extend(displacement(signal, evidence, held));
}

/// Rows from the start on in which the part is surely held.
fn held_rows(signal: &Signal<'_>) -> usize {
    let Some((largest_n, _)) = signal.largest_mean_n(0, signal.len()) else { return 0 };
    let w = signal.window;
    (0..=signal.len() - w)
        .find(|&i| signal.mean_n(i, i + w) >= HELD * largest_n)
        .map_or(signal.len(), |i| i + w / 2)
}

/// A zero that is off from the first reading on and stays so while the command rises: not that of the reading without a load,
/// and no load either, which a loop would take away. Both have to show it, so each may be less sure.
fn start(signal: &Signal<'_>, evidence: &LabelEvidence<'_>, loop_: &Follow) -> Finding {
    let before_n = mean(signal.before_n);
    let rows = signal.rows(START_S).clamp(1, signal.len());
    let of_loop_n =
        response(signal.time_s, signal.desired_n, loop_.lag_s).take(rows).sum::<f64>() / rows as f64;
    let read_n = signal.mean_n(0, rows) - before_n;
    // An arm that gives way first is slower than its loop: the reading is anywhere between nothing and what the loop gives.
    let first_n = read_n - read_n.min(of_loop_n).max(0.0);
    let smaller_n = match (first_n, loop_.zero_n - before_n) {
        (a, b) if a * b <= 0.0 => 0.0,
        (a, b) if a.abs() < b.abs() => a,
        (_, b) => b,
    };
    let chance_n = SIGMAS_OF_TWO * signal.noise_n / (rows as f64).sqrt();
    Finding {
        kind: FindingKind::ZeroShift,
        found: before_n + smaller_n,
        wanted: before_n,
        allowed: zero_cap_n(evidence.label_n).max(chance_n),
        time_s: Some(signal.time_s[0]),
    }
}

/// The largest jump of the reading against the loop, up to the label: up, at any time; down, where the force follows the
/// command again afterwards, so that the part is still held.
fn jump(
    signal: &Signal<'_>,
    evidence: &LabelEvidence<'_>,
    loop_: &Follow,
    (held, last): (usize, usize),
) -> Option<Finding> {
    let w = signal.window;
    let end = (last + 1).max(2 * w + 1).min(signal.len());
    if end < 2 * w + 1 {
        return None;
    }
    let response_n = response(signal.time_s, signal.desired_n, loop_.lag_s);
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(end + 1);
    sums.push(sum);
    for (y, f) in response_n.zip(signal.measured_n).take(end) {
        sum += f - loop_.gain * y;
        sums.push(sum);
    }
    let step_n = |i: usize| (sums[i + w] - 2.0 * sums[i] + sums[i - w]) / w as f64;
    let again = signal.rows(AGAIN_S).max(2 * w);
    let follows = |i: usize| {
        let (from, to) = (i + w, i + w + again);
        to < signal.len() && {
            let rise_n = signal.mean_n(to - w, to) - signal.mean_n(from, from + w);
            rise_n > 0.5 * (signal.desired_n[to - w] - signal.desired_n[from]) && rise_n > 0.0
        }
    };
    let counts = |i: usize| step_n(i) > 0.0 || follows(i);
    let chance_n = SIGMAS * signal.noise_n * (2.0 / w as f64).sqrt();
    let (min_n, highest_n) = (zero_cap_n(evidence.label_n).max(chance_n), signal.largest_step_n());
    let settled_s = SETTLED_S.max(SETTLED_LAGS * loop_.lag_s);
    let allowed_n = |i: usize| {
        let share = if signal.time_s[i] < settled_s { STARTING_SHARE } else { STEP_SHARE };
        min_n.max(share * highest_n)
    };
    let mut most = None;
    for i in w..=end - w {
        let excess_n = step_n(i).abs() - allowed_n(i);
        if most.is_none_or(|(n, _)| excess_n > n) && counts(i) {
            most = Some((excess_n, i));
        }
    }
    let (_, at) = most?;
    let mut allowed = allowed_n(at);
    if step_n(at).abs() > allowed {
        // A loop that closes on its sensor makes slow waves of its noise: what chance explains shows in all other rows.
        let others = (w..(held.min(end) + 1).saturating_sub(w)).filter(|i| i.abs_diff(at) > w);
        let mut others_n: Vec<f64> = others.map(|i| step_n(i).abs()).collect();
        let middle = others_n.len() / 2;
        if others_n.len() > 2 * w {
            let median_n = *others_n.select_nth_unstable_by(middle, f64::total_cmp).1;
            allowed = allowed.max(SIGMAS * median_n / MEDIAN_OF_NORMAL);
        }
    }
    Some(Finding {
        kind: FindingKind::Jump,
        found: step_n(at),
        wanted: 0.0,
        allowed,
        time_s: Some(signal.time_s[at]),
    })
}

/// What the jaws held before the label. The rule takes a force up to its tolerance below it.
fn larger_before(
    signal: &Signal<'_>,
    evidence: &LabelEvidence<'_>,
    last: usize,
    findings: &mut Vec<Finding>,
    budget: &mut LabelBudget,
) {
    let Some((largest_n, at)) = signal.largest_mean_n(0, last + 1) else { return };
    budget.rule_n = (largest_n - evidence.label_n).max(0.0);
    findings.push(Finding {
        kind: FindingKind::LargerBefore,
        found: largest_n.max(evidence.label_n),
        wanted: evidence.label_n,
        allowed: evidence.tolerance_n + cap_n(evidence.label_n).max(SIGMAS * signal.noise_n),
        time_s: Some(signal.time_s[at]),
    });
}

/// Whether the force still rose after the label, or would have if the pull had gone on: its slope times the loop's time
/// constant is what it lacked.
fn early(
    signal: &Signal<'_>,
    evidence: &LabelEvidence<'_>,
    last: usize,
    lag_s: f64,
    findings: &mut Vec<Finding>,
    budget: &mut LabelBudget,
) {
    let label_n = evidence.label_n;
    // Steps that are higher than the tolerance jump over it.
    let over_n = (signal.largest_step_n() - evidence.tolerance_n).max(0.0);
    budget.rule_n = budget.rule_n.max(over_n);
    let cap = cap_n(label_n);
    let rose_n = signal.largest_mean_n(last + 1, signal.len()).map_or(0.0, |(n, _)| n - label_n);
    let mut found = Finding {
        kind: FindingKind::Early,
        found: label_n + rose_n.max(0.0),
        wanted: label_n,
        allowed: cap.max(SIGMAS * signal.noise_n) + over_n,
        time_s: Some(signal.time_s[last]),
    };
    budget.lag_n = rose_n.max(0.0);
    // A slow loop fades slowly, and needs more rows.
    let after_s = (0.5 * lag_s).clamp(AFTER_S, 2.0 * AFTER_S);
    let rows = signal.rows(after_s).max(AFTER_ROWS);
    let to = (last + 1 + rows).min(signal.len());
    // Of a label at the end of the trace, the rows before it.
    let from = to.saturating_sub(rows);
    if rows < signal.len() / 2 {
        let (slope, error) = slope(&signal.time_s[from..to], &signal.measured_n[from..to], signal.noise_n);
        // The slope stands in the middle of these rows; it was more at the label, and fades with the lag.
        let since_s = 0.5 * (signal.time_s[from] + signal.time_s[to - 1]) - signal.time_s[last];
        let faded = libm::exp((since_s / lag_s.max(1e-3)).clamp(-1.0, 1.0));
        let (lacks_n, error_n) = (lag_s * slope.max(0.0) * faded, lag_s * error * faded);
        budget.lag_n = budget.lag_n.max(lacks_n);
        // A loop that trails by half the tolerance has to show that the force stands still.
        let trails_n = lag_s * signal.desired_n[last] / signal.time_s[last].max(signal.spacing_s);
        let sigmas = if trails_n > 0.5 * evidence.tolerance_n { SIGMAS_OF_SLOW } else { SIGMAS };
        let allowed = cap.max(sigmas * error_n) + over_n;
        if !found.is_reason() && lacks_n > allowed {
            found = Finding { found: label_n + lacks_n, allowed, ..found };
        }
    }
    findings.push(found);
}

/// Slope of a line through these rows, and its standard error.
fn slope(time_s: &[f64], force_n: &[f64], noise_n: f64) -> (f64, f64) {
    let (t, f) = (mean(time_s), mean(force_n));
    let (mut tt, mut tf) = (0.0, 0.0);
    for (&time_s, &force_n) in time_s.iter().zip(force_n) {
        tt += (time_s - t) * (time_s - t);
        tf += (time_s - t) * (force_n - f);
    }
    if tt > 0.0 { (tf / tt, noise_n / tt.sqrt()) } else { (0.0, f64::INFINITY) }
}

/// The label against the force at which the displacement leaves the shear of the gels.
fn displacement(signal: &Signal<'_>, evidence: &LabelEvidence<'_>, held: usize) -> Option<Finding> {
    let (x, t) = (signal.displacement_m, signal.time_s);
    let end = signal.len() - 1;
    let (whole_m, span_s) = (x[end] - x[0], t[end] - t[0]);
    // Where it is farthest below the line from its beginning to its end.
    let below_m = |i: usize| x[0] + whole_m * (t[i] - t[0]) / span_s - x[i];
    let knee = (0..=end).max_by(|&a, &b| below_m(a).total_cmp(&below_m(b)))?;
    if whole_m < 0.5 * evidence.stop_m || below_m(knee) < BEND * whole_m || held < HELD_ROWS || held > knee {
        return None;
    }
    let (mut ff, mut fx) = (0.0, 0.0);
    for (&force_n, &x) in signal.measured_n[..held].iter().zip(x) {
        ff += force_n * force_n;
        fx += force_n * x;
    }
    let shear_m_per_n = if ff > 0.0 { (fx / ff).max(0.0) } else { 0.0 };
    let sheared = |i: usize| x[i] <= shear_m_per_n * signal.measured_n[i] + SLIP_M;
    let began = (0..=knee).rev().find(|&i| sheared(i)).unwrap_or(0);
    let half = signal.rows(WINDOW_S);
    let (from, to) = (began.saturating_sub(half), (knee + 2 * half + 1).min(signal.len()));
    let means = (from..(to + 1).saturating_sub(signal.window)).map(|i| signal.mean_n(i, i + signal.window));
    let low_n = means.fold(f64::INFINITY, f64::min);
    // A force that falls to its kinetic part does so before much has moved: what was held before is not too much.
    let high_n = signal.measured_n[..to].iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let label_n = evidence.label_n;
    let allowed = cap_n(label_n).max(SIGMAS * signal.noise_n);
    (low_n <= high_n).then(|| Finding {
        kind: FindingKind::Displacement,
        found: label_n.max(low_n).min(high_n),
        wanted: label_n,
        allowed,
        time_s: Some(t[began]),
    })
}
