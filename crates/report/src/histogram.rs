//! Distributions as bars; those of a selection are drawn over those of all by the script of the page.

use crate::axis::Axis;
use crate::svg::label;
use crate::text::{escape, shorten};
use gripgen_twin::Values;
use std::collections::BTreeMap;
use std::fmt::Write;

const WIDTH: f64 = 420.0;
const INNER: f64 = 110.0;
const TOP: f64 = 6.0;
const SIDE: f64 = 10.0;
/// Bars of numbers, and of words.
const BINS: usize = 28;
const WORDS: usize = 16;
/// Letters of a word below its bar.
const LETTERS: usize = 12;

/// How often values fall into each bin, and which bin each of them is in.
pub(crate) struct Histogram {
    /// Of each value its bin; `None` where there is no value.
    pub(crate) bin_of: Vec<Option<u8>>,
    /// Values in each bin.
    pub(crate) counts: Vec<usize>,
    axis: Axis,
    words: bool,
}

impl Histogram {
    /// Counts values. Of words the most frequent have bars, the others share the last one.
    pub(crate) fn of(values: &Values) -> Self {
        match values {
            Values::Numbers(x) => Self::of_numbers(x),
            Values::Words(words) => Self::of_words(words),
        }
    }

    fn of_numbers(x: &[f64]) -> Self {
        let finite = || x.iter().copied().filter(|x| x.abs() < 1e300);
        let axis = Axis::of(finite(), 6);
        let low = finite().fold(f64::INFINITY, f64::min);
        let high = finite().fold(f64::NEG_INFINITY, f64::max);
        let axis = if low < high { Axis { low, high, ..axis } } else { axis };
        let bin = |x: f64| ((axis.share(x) * BINS as f64) as usize).min(BINS - 1) as u8;
        let bin_of: Vec<Option<u8>> = x.iter().map(|&x| (x.abs() < 1e300).then(|| bin(x))).collect();
        let counts = counted(&bin_of, BINS);
        Self { bin_of, counts, axis, words: false }
    }

    fn of_words(words: &[String]) -> Self {
        let mut often: BTreeMap<&str, usize> = BTreeMap::new();
        words.iter().for_each(|word| *often.entry(word).or_default() += 1);
        let mut names: Vec<(&str, usize)> = often.into_iter().collect();
        if names.len() > WORDS {
            names.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
        }
        let rest = names.len() > WORDS;
        let mut shown: Vec<String> =
            names.iter().take(WORDS).map(|(name, _)| shorten(name, LETTERS)).collect();
        let place: BTreeMap<&str, u8> =
            names.iter().enumerate().map(|(i, (name, _))| (*name, i.min(WORDS) as u8)).collect();
        if rest {
            shown.push("others".into());
        }
        let bin_of: Vec<Option<u8>> = words.iter().map(|word| place.get(word.as_str()).copied()).collect();
        let counts = counted(&bin_of, shown.len());
        Self { bin_of, counts, axis: Axis::of_words(&shown, 6), words: true }
    }

    /// The drawing: of each bin a bar of all, and one of class `own` over it that a script may shrink.
    pub(crate) fn svg(&self, name: &str) -> String {
        let bottom = TOP + INNER;
        let whole = bottom + 20.0;
        let name = escape(&format!("distribution of {name}"));
        let mut svg = format!(
            "<svg class=\"plot bins\" viewBox=\"0 0 {WIDTH} {whole}\" role=\"img\" aria-label=\"{name}\" \
             data-top=\"{TOP}\" data-inner=\"{INNER}\">"
        );
        let room = WIDTH - 2.0 * SIDE;
        let most = self.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        let slot = room / self.counts.len().max(1) as f64;
        let bar = slot * if self.words { 0.8 } else { 0.92 };
        for class in ["all", "own"] {
            for (i, count) in self.counts.iter().enumerate() {
                let (x, height) = (SIDE + slot * i as f64 + (slot - bar) / 2.0, INNER * *count as f64 / most);
                let _ = write!(
                    svg,
                    "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{bar:.1}\" height=\"{height:.1}\"/>",
                    bottom - height
                );
            }
        }
        for (value, text) in &self.axis.ticks {
            let share = self.axis.share(*value);
            if (0.0..=1.0).contains(&share) {
                // Words at the ends do not stand out of the drawing.
                let half = 3.3 * text.chars().count() as f64;
                let x = (SIDE + room * share).clamp(half, WIDTH - half);
                svg += &label(x, bottom + 15.0, "x", text);
            }
        }
        svg + "</svg>"
    }
}

fn counted(bin_of: &[Option<u8>], bins: usize) -> Vec<usize> {
    let mut counts = vec![0; bins];
    bin_of.iter().flatten().for_each(|bin| counts[usize::from(*bin)] += 1);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_counted_once() {
        let numbers = Histogram::of(&Values::Numbers(vec![0.0, 1.0, 0.5, f64::NAN, 1.0]));
        assert_eq!(numbers.counts.iter().sum::<usize>(), 4);
        assert_eq!((numbers.counts[0], numbers.counts[BINS - 1], numbers.counts[BINS / 2]), (1, 2, 1));
        assert_eq!(numbers.bin_of[3], None);
        let words: Vec<String> = (0..40).map(|i| format!("w{}", i % 20)).collect();
        let words = Histogram::of(&Values::Words(words));
        assert_eq!(words.counts.len(), WORDS + 1);
        assert_eq!((words.counts[0], words.counts[WORDS]), (2, 8), "the others share a bar");
        for values in [vec![], vec![3.0], vec![f64::NAN], vec![f64::MAX, 1.0]] {
            let svg = Histogram::of(&Values::Numbers(values)).svg("<x>");
            assert!(svg.contains("&lt;x&gt;") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
