//! How far the sensor's zero moves during a pull.

/// Fewest readings that make a zero.
const READINGS: usize = 10;

/// Times and readings without a load.
#[derive(Default)]
pub(super) struct Unloaded {
    n: usize,
    time_s: f64,
    force_n: f64,
}

impl Unloaded {
    pub(super) fn of(readings: impl Iterator<Item = (f64, f64)>) -> Self {
        readings.fold(Self::default(), |sum, (time_s, force_n)| Self {
            n: sum.n + 1,
            time_s: sum.time_s + time_s,
            force_n: sum.force_n + force_n,
        })
    }

    fn mean(&self) -> Option<(f64, f64)> {
        (self.n >= READINGS).then(|| (self.time_s / self.n as f64, self.force_n / self.n as f64))
    }
}

/// How far the zero has moved at `at_s`, on a straight line from the readings before to those after; `None` where one of them is
/// missing. A zero that warms up bends, and is between both still.
pub(super) fn shift_n(before: &Unloaded, after: &Unloaded, at_s: f64) -> Option<f64> {
    let ((from_s, from_n), (to_s, to_n)) = (before.mean()?, after.mean()?);
    let share =
        if to_s > from_s { ((at_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) } else { return None };
    Some(share * (to_n - from_n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_that_drifts_is_read_off_at_the_slip() {
        let drift =
            |from_s: f64| {
                Unloaded::of((0..50).map(move |i| {
                    (from_s + 0.01 * f64::from(i), 0.3 + 0.02 * (from_s + 0.01 * f64::from(i)))
                }))
            };
        let shift = shift_n(&drift(0.0), &drift(60.0), 50.245).unwrap();
        assert!((shift - 1.0).abs() < 1e-9, "{shift}");
        assert_eq!(shift_n(&drift(0.0), &Unloaded::default(), 50.0), None);
        assert_eq!(shift_n(&drift(60.0), &drift(0.0), 50.0), None);
    }
}
