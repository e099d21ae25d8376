//! Shares of a variance, by what is drawn.

/// Share of the variance of y that a group of inputs carries, alone and among themselves: the closed index of Sobol 1993. Each pair is
/// y at two draws that have these inputs in common and no other. The estimate is that of Janon et al. 2014, which treats both alike:
///
/// ```text
/// S = (<y y'> - m^2) / (<(y^2 + y'^2) / 2> - m^2),   m = <(y + y') / 2>
/// ```
///
/// with its standard error, `(1 - S^2) / sqrt(n)` as of a correlation. Cut to 0 to 1; `None` of fewer than 3 pairs or of a y that does
/// not vary.
pub fn closed_share(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = pairs.len() as f64;
    if pairs.len() < 3 {
        return None;
    }
    let mean = pairs.iter().map(|(a, b)| a + b).sum::<f64>() / (2.0 * n);
    let both = pairs.iter().map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n;
    let own = pairs.iter().map(|(a, b)| (a - mean).powi(2) + (b - mean).powi(2)).sum::<f64>() / (2.0 * n);
    // Rounding of values that are all alike.
    if own <= 1e-18 * (1.0 + mean * mean) {
        return None;
    }
    let share = (both / own).clamp(0.0, 1.0);
    Some((share, (1.0 - share * share) / libm::sqrt(n)))
}

/// Share of the variance of y that goes when a group of inputs is known in addition to all others: the total index (Jansen 1999). Each
/// pair is y at two draws that differ in these inputs alone; their noise is the same, so that a group without effect has exactly 0.
/// `None` of a y that does not vary.
///
/// ```text
/// T = <(y - y')^2> / (2 var y)
/// ```
pub fn total_share(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = 2.0 * pairs.len() as f64;
    let mean = pairs.iter().map(|(a, b)| a + b).sum::<f64>() / n;
    let variance = pairs.iter().map(|(a, b)| (a - mean).powi(2) + (b - mean).powi(2)).sum::<f64>() / n;
    let moved = pairs.iter().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n;
    (variance > 1e-18 * (1.0 + mean * mean)).then(|| (moved / variance).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::random::{Purpose, Stream};

    /// y = 3 a + 4 b + c: 9, 16 and 1 of 26.
    #[test]
    fn shares_of_a_sum_are_those_of_its_variances() {
        let draw = |lane| {
            let mut stream = Stream::with_lane(5, 1, Purpose::Draw, lane);
            (0..20_000).map(|_| stream.normal()).collect::<Vec<f64>>()
        };
        let [a, b, c, b2, c2] = [0, 1, 2, 3, 4].map(draw);
        let y = |a: f64, b: f64, c: f64| 3.0 * a + 4.0 * b + c;
        let of = |with_b: bool| {
            let other = |i: usize| y(a[i], if with_b { b[i] } else { b2[i] }, c2[i]);
            closed_share(&(0..a.len()).map(|i| (y(a[i], b[i], c[i]), other(i))).collect::<Vec<_>>()).unwrap()
        };
        let ((alone, error), (both, _)) = (of(false), of(true));
        assert!((alone - 9.0 / 26.0).abs() < 3.0 * error, "{alone}");
        assert!((both - 25.0 / 26.0).abs() < 0.01, "{both}");
        assert_eq!(closed_share(&[(2.0, 2.0); 9]), None);
        let moved: Vec<(f64, f64)> =
            (0..a.len()).map(|i| (y(a[i], b[i], c[i]), y(a[i], b2[i], c[i]))).collect();
        let total = total_share(&moved).unwrap();
        assert!((total - 16.0 / 26.0).abs() < 0.02, "{total}");
        assert_eq!(total_share(&[(1.0, 1.0), (2.0, 2.0)]), Some(0.0));
    }
}
