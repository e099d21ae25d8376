//! Axes: where the ticks are and what they say.

/// A range of values and the round numbers in it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Places of the ticks and their labels.
    pub(crate) ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis for finite values, with a margin, and about `wanted` ticks at 1, 2 or 5 times a power of ten.
    pub(crate) fn of(values: impl Iterator<Item = f64>, wanted: usize) -> Self {
        let (mut low, mut high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        // A range that is negligible next to its place: a constant, up to rounding.
        let size = low.abs().max(high.abs());
        if high - low <= 1e-9 * size || high - low < 1e-300 {
            let half = if size > 0.0 { 0.5 * size } else { 0.5 };
            (low, high) = (low - half, high + half);
        }
        let margin = 0.04 * (high - low);
        let zero_is_end = low >= 0.0 && low < 0.15 * high;
        low = if zero_is_end { 0.0 } else { low - margin };
        high += margin;
        Self { low, high, ticks: ticks(low, high, wanted) }
    }

    /// An axis of words at 0, 1, 2...
    pub(crate) fn of_words(words: &[String], most: usize) -> Self {
        let every = words.len().div_ceil(most.max(1)).max(1);
        let ticks = words.iter().enumerate().step_by(every).map(|(i, word)| (i as f64, word.clone()));
        Self { low: -0.5, high: words.len() as f64 - 0.5, ticks: ticks.collect() }
    }

    /// Where a value lies between the ends, 0 to 1.
    pub(crate) fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

fn ticks(low: f64, high: f64, wanted: usize) -> Vec<(f64, String)> {
    let step = nice_step((high - low) / wanted.max(1) as f64, 0.75);
    let (first, last) = ((low / step).ceil(), (high / step).floor());
    (0..=(last - first).clamp(0.0, 40.0) as usize)
        .map(|i| (first + i as f64) * step)
        .map(|x| (x, label(x, step)))
        .collect()
}

/// The smallest of 1, 2, 5 times a power of ten that is not below a share of `rough`.
pub(crate) fn nice_step(rough: f64, share: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= share * rough).unwrap_or(10.0);
    factor * power
}

/// A tick's number with the decimals that its step needs.
fn label(x: f64, step: f64) -> String {
    let decimals = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
    let x = if x.abs() < 1e-9 * step { 0.0 } else { x };
    let text = if x.abs() >= 1e6 || decimals > 5 { format!("{x:.2e}") } else { format!("{x:.decimals$}") };
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: &[f64], wanted: usize) -> Vec<String> {
        Axis::of(values.iter().copied(), wanted).ticks.into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(labels(&[5.0, 80.0], 5), ["0", "20", "40", "60", "80"]);
        assert_eq!(labels(&[-1.3, 0.9], 5), ["\u{2212}1.0", "\u{2212}0.5", "0.0", "0.5"]);
        assert_eq!(labels(&[20.1, 20.4], 4), ["20.1", "20.2", "20.3", "20.4"]);
        assert_eq!(labels(&[0.0, 41_000.0], 4), ["0", "10000", "20000", "30000", "40000"]);
        assert_eq!(labels(&[0.0, 0.000_3], 4), ["0.0000", "0.0001", "0.0002", "0.0003"]);
        for (low, high) in [(1e-12, 3e-12), (-5e9, 7e12), (3.0, 3.0), (0.0, 0.0), (-1e-320, 1e-320)] {
            let axis = Axis::of([low, high].into_iter(), 5);
            assert!(axis.low < axis.high && (1..=12).contains(&axis.ticks.len()), "{axis:?}");
            assert!(axis.ticks.iter().all(|(x, _)| (0.0..=1.0).contains(&axis.share(*x))), "{axis:?}");
            assert!((0.0..=1.0).contains(&axis.share(low)) && (0.0..=1.0).contains(&axis.share(high)));
        }
        assert!(labels(&[], 4).len() > 2, "an empty plot has an axis too");
    }

    #[test]
    fn words_stand_at_whole_numbers_and_are_thinned() {
        let words: Vec<String> = (0..30).map(|i| format!("s{i}")).collect();
        let axis = Axis::of_words(&words, 10);
        assert_eq!(axis.ticks.len(), 10);
        assert_eq!(axis.ticks[1], (3.0, "s3".into()));
        assert_eq!((axis.share(-0.5), axis.share(29.5)), (0.0, 1.0));
    }
}
