//! How the force follows its command while the part is held.

/// Time constants that are tried.
const LAGS_S: [f64; 13] = [0.0, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.14, 0.2, 0.3, 0.45, 0.7, 1.0];
/// Halvings of the interval around the best of them.
const REFINEMENTS: usize = 8;
/// Fewest rows, and least rise of the command, that tell a factor from a zero.
const GAIN_ROWS: usize = 40;
const GAIN_RISE_N: f64 = 4.0;

/// A first-order loop, `F = zero + gain y`, `lag dy/dt = F_des - y`, `y(0) = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Follow {
    pub(super) lag_s: f64,
    pub(super) zero_n: f64,
    pub(super) gain: f64,
    /// Sum of squares that it leaves.
    rss: f64,
}

/// The loop that explains these rows best; `lag_s` where it is known.
pub(super) fn follow(time_s: &[f64], desired_n: &[f64], measured_n: &[f64], lag_s: Option<f64>) -> Follow {
    let rise_n = desired_n.last().zip(desired_n.first()).map_or(0.0, |(last, first)| last - first);
    let free_gain = time_s.len() >= GAIN_ROWS && rise_n >= GAIN_RISE_N;
    let with = |lag_s: f64| fitted(time_s, desired_n, measured_n, lag_s, free_gain);
    if let Some(lag_s) = lag_s {
        return with(lag_s);
    }
    let tried: Vec<Follow> = LAGS_S.iter().map(|&lag_s| with(lag_s)).collect();
    let best = (0..tried.len()).min_by(|&a, &b| tried[a].rss.total_cmp(&tried[b].rss)).unwrap_or(0);
    let (mut low, mut high) =
        (tried[best.saturating_sub(1)].lag_s, tried[(best + 1).min(tried.len() - 1)].lag_s);
    let mut found = tried[best];
    for _ in 0..REFINEMENTS {
        let thirds = [low + (high - low) / 3.0, high - (high - low) / 3.0].map(with);
        if thirds[0].rss < thirds[1].rss {
            high = thirds[1].lag_s;
        } else {
            low = thirds[0].lag_s;
        }
        for third in thirds {
            if third.rss < found.rss {
                found = third;
            }
        }
    }
    found
}

/// The response to the command; a row's command acts until the next row.
pub(super) fn response(time_s: &[f64], desired_n: &[f64], lag_s: f64) -> impl Iterator<Item = f64> {
    let mut response_n = 0.0;
    let mut share = (0.0, 0.0);
    (0..time_s.len()).map(move |i| {
        if i > 0 {
            let step_s = time_s[i] - time_s[i - 1];
            // Equal steps differ by rounding.
            if (step_s - share.0).abs() > 1e-6 {
                let caught_up = if lag_s > 0.0 { -libm::expm1(-step_s / lag_s) } else { 1.0 };
                share = (step_s, caught_up);
            }
            response_n += share.1 * (desired_n[i - 1] - response_n);
        }
        response_n
    })
}

fn fitted(time_s: &[f64], desired_n: &[f64], measured_n: &[f64], lag_s: f64, free_gain: bool) -> Follow {
    let n = time_s.len() as f64;
    let (mut y, mut f, mut yy, mut yf, mut ff) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (response_n, &force_n) in response(time_s, desired_n, lag_s).zip(measured_n) {
        y += response_n;
        f += force_n;
        yy += response_n * response_n;
        yf += response_n * force_n;
        ff += force_n * force_n;
    }
    let spread = yy - y * y / n;
    let gain = if free_gain && spread > 1e-9 { (yf - y * f / n) / spread } else { 1.0 };
    let zero_n = (f - gain * y) / n;
    let rss = ff - 2.0 * gain * yf - 2.0 * zero_n * f
        + gain * gain * yy
        + 2.0 * gain * zero_n * y
        + n * zero_n * zero_n;
    Follow { lag_s, zero_n, gain, rss }
}
