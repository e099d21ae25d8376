//! Labels over grip force: mean and RMS of the repetitions, as Wucherer et al. 2023 show them, of any pulls.

/// Different grip forces of a part that are levels of their own; where there are more, grips of nearby forces are put together.
const MAX_LEVELS: usize = 24;
/// Ranges of equal width in their place.
const RANGES: usize = 12;

/// Pulls of one part at one grip force, or in one range of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Mean grip force, per jaw.
    pub grip_force_n: f64,
    /// Smallest and largest grip force.
    pub span_n: (f64, f64),
    /// Mean of the labels.
    pub mean_n: f64,
    /// Root mean square deviation from that mean.
    pub rms_n: f64,
    /// Smallest label.
    pub low_n: f64,
    /// Largest label.
    pub high_n: f64,
    /// Which pulls, as places in what was given.
    pub rows: Vec<usize>,
}

/// Levels of pulls of one part, given as grip force and label, from the weakest grip to the strongest. Pulls with a number
/// that is none are left out.
pub fn levels(pulls: &[(f64, f64)]) -> Vec<Level> {
    let mut rows: Vec<usize> =
        (0..pulls.len()).filter(|&i| pulls[i].0.is_finite() && pulls[i].1.is_finite()).collect();
    rows.sort_by(|&a, &b| pulls[a].0.total_cmp(&pulls[b].0));
    let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return vec![] };
    let (low_n, high_n) = (pulls[first].0, pulls[last].0);
    let different = 1 + rows.windows(2).filter(|w| pulls[w[0]].0 != pulls[w[1]].0).count();
    let range = |i: usize| {
        ((pulls[i].0 - low_n) / (high_n - low_n) * RANGES as f64).min(RANGES as f64 - 1.0) as usize
    };
    let together = |a: usize, b: usize| match different > MAX_LEVELS {
        true => range(a) == range(b),
        false => pulls[a].0 == pulls[b].0,
    };
    rows.chunk_by(|&a, &b| together(a, b)).map(|rows| level(pulls, rows)).collect()
}

fn level(pulls: &[(f64, f64)], rows: &[usize]) -> Level {
    let n = rows.len() as f64;
    let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|&i| of(i)).sum::<f64>() / n;
    let ends = |of: &dyn Fn(usize) -> f64| {
        rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &i| (l.min(of(i)), h.max(of(i))))
    };
    let mean_n = mean(&|i| pulls[i].1);
    let (low_n, high_n) = ends(&|i| pulls[i].1);
    let span_n = ends(&|i| pulls[i].0);
    Level {
        // Not a mean of equal numbers, which may round to another.
        grip_force_n: if span_n.0 == span_n.1 { span_n.0 } else { mean(&|i| pulls[i].0) },
        span_n,
        mean_n,
        rms_n: libm::sqrt(mean(&|i| (pulls[i].1 - mean_n) * (pulls[i].1 - mean_n))),
        low_n,
        high_n,
        rows: rows.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_rms_of_each_grip_force() {
        let pulls = [(40.0, 11.0), (20.0, 5.0), (40.0, 13.0), (20.0, f64::NAN), (40.0, 12.0)];
        let [weak, strong] = &levels(&pulls)[..] else { panic!("two levels") };
        assert_eq!((weak.grip_force_n, weak.mean_n, weak.rms_n, &weak.rows[..]), (20.0, 5.0, 0.0, &[1][..]));
        // (1 + 0 + 1) / 3.
        assert_eq!((strong.mean_n, strong.low_n, strong.high_n), (12.0, 11.0, 13.0));
        assert!((strong.rms_n - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!(levels(&[]).is_empty() && levels(&[(f64::NAN, 1.0)]).is_empty());
    }

    #[test]
    fn grip_forces_that_never_repeat_are_put_into_ranges() {
        let pulls: Vec<(f64, f64)> =
            (0..600).map(|i| (20.0 + 0.1 * f64::from(i), 3.0 + 0.03 * f64::from(i))).collect();
        let found = levels(&pulls);
        assert_eq!(found.len(), 12);
        assert_eq!(found.iter().map(|l| l.rows.len()).sum::<usize>(), 600);
        for (a, b) in found.iter().zip(&found[1..]) {
            assert!(a.span_n.1 < b.span_n.0, "{a:?}");
        }
        // On a straight line the mean label is that of the mean force.
        assert!(found.iter().all(|l| (l.mean_n - (3.0 + 0.3 * (l.grip_force_n - 20.0))).abs() < 1e-9));
    }
}
