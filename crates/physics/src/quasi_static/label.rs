//! Labels of pulls whose readings carry noise.

/// Mean and variance of the label of a pull whose readings carry white noise, exactly: the label rule takes the last
/// reading within the tolerance of the command, and
///
/// ```text
/// P(T_slip = t) = p_t prod over s > t of (1 - p_s),   p_t = P(|F(t) + noise - F_des(t)| < tolerance)
/// ```
///
/// `desired_and_reading_n` are the ticks in order. `None` if no reading is ever near the command.
pub fn label_moments<'a>(
    desired_and_reading_n: impl DoubleEndedIterator<Item = (&'a f64, &'a f64)>,
    tolerance_n: f64,
    noise_n: f64,
) -> Option<(f64, f64)> {
    let (mut alive, mut sum, mut mean, mut square) = (1.0, 0.0, 0.0, 0.0);
    let wide = 7.0 * noise_n;
    for (desired, reading) in desired_and_reading_n.rev() {
        let d = reading - desired;
        if d.abs() >= tolerance_n + wide {
            continue;
        }
        let (p, value, var) = if d.abs() < tolerance_n - wide || noise_n == 0.0 {
            (1.0, *reading, noise_n * noise_n)
        } else {
            within(*reading, d, tolerance_n, noise_n)
        };
        let share = alive * p;
        sum += share;
        mean += share * value;
        square += share * (value * value + var);
        alive *= 1.0 - p;
        if alive < 1e-5 {
            break;
        }
    }
    if sum < 1e-3 {
        return None;
    }
    let mean = mean / sum;
    Some((mean, (square / sum - mean * mean).max(0.0)))
}

/// Probability that a reading is within the tolerance, and mean and variance of those that are.
fn within(reading_n: f64, difference_n: f64, tolerance_n: f64, noise_n: f64) -> (f64, f64, f64) {
    let (a, b) = ((-tolerance_n - difference_n) / noise_n, (tolerance_n - difference_n) / noise_n);
    let p = normal_cdf(b) - normal_cdf(a);
    if p < 1e-12 {
        return (0.0, reading_n, 0.0);
    }
    let (fa, fb) = (normal_pdf(a), normal_pdf(b));
    let shift = (fa - fb) / p;
    let var = (1.0 + (a * fa - b * fb) / p - shift * shift).max(0.0);
    (p, reading_n + noise_n * shift, noise_n * noise_n * var)
}

fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

fn normal_pdf(x: f64) -> f64 {
    const ROOT: f64 = 0.398_942_280_401_432_7;
    ROOT * libm::exp(-0.5 * x * x)
}
