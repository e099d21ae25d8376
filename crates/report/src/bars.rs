//! The error before and after, as bars with intervals and the noise floor.

use super::axis::Axis;
use super::plot::escape;
use std::fmt::Write;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bar {
    /// What it is an error of.
    pub(super) name: String,
    /// After the effects were added.
    pub(super) after: bool,
    pub(super) value: f64,
    /// Its 90 % interval.
    pub(super) interval: (f64, f64),
}

const WIDTH: f64 = 420.0;
const ROW: f64 = 40.0;
const SIDE: f64 = 10.0;

/// Draws the bars below each other, and the floor as a line through all of them.
pub(super) fn draw(bars: &[Bar], floor: Option<f64>, unit: &str) -> String {
    let floor = floor.filter(|f| f.is_finite());
    let values = bars.iter().flat_map(|b| [b.value, b.interval.0, b.interval.1]).chain(floor).chain([0.0]);
    let x = Axis::of(values.filter(|v| v.is_finite()), 5);
    let top = if floor.is_some() { 22.0 } else { 4.0 };
    let bottom = top + ROW * bars.len() as f64;
    let height = bottom + 42.0;
    let at = |value: f64| SIDE + x.share(value).clamp(0.0, 1.0) * (WIDTH - 2.0 * SIDE);
    let mut svg = format!(
        "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"error before and after\">"
    );
    let mut grid = String::new();
    for (value, text) in &x.ticks {
        let px = at(*value);
        let _ = write!(grid, "M{px:.1} {top:.0}V{bottom:.0}");
        let _ =
            write!(svg, "<text x=\"{px:.1}\" y=\"{:.0}\" class=\"x\">{}</text>", bottom + 16.0, escape(text));
    }
    let _ = write!(svg, "<path class=\"grid\" d=\"{grid}\"/>");
    if let Some(floor) = floor {
        let (px, text) = (at(floor), escape(&format!("noise floor {}", number(floor))));
        // Near the right end the words stand to the left of the line.
        let (tx, class) = if px > WIDTH / 2.0 { (px + 4.0, "y") } else { (px - 4.0, "start") };
        let _ = write!(svg, "<text x=\"{tx:.1}\" y=\"14\" class=\"{class}\">{text}</text>");
    }
    for (i, bar) in bars.iter().enumerate() {
        let y = top + ROW * i as f64;
        let numbers = format!(
            "{}: {} ({} to {})",
            bar.name,
            number(bar.value),
            number(bar.interval.0),
            number(bar.interval.1)
        );
        let class = if bar.after { "after" } else { "before" };
        let _ = write!(svg, "<text x=\"{SIDE}\" y=\"{:.0}\">{}</text>", y + 14.0, escape(&numbers));
        let (zero, end) = (at(0.0), at(bar.value));
        let _ = write!(
            svg,
            "<rect class=\"{class}\" x=\"{zero:.1}\" y=\"{:.0}\" width=\"{:.1}\" height=\"14\"/>",
            y + 20.0,
            (end - zero).max(0.0)
        );
        let (low, high) = (at(bar.interval.0), at(bar.interval.1));
        let middle = y + 27.0;
        let _ = write!(
            svg,
            "<path class=\"interval\" d=\"M{low:.1} {middle:.0}H{high:.1}M{low:.1} {:.0}v8M{high:.1} {:.0}v8\"/>",
            middle - 4.0,
            middle - 4.0
        );
        if let Some(floor) = floor {
            let _ = write!(svg, "<path class=\"floor\" d=\"M{:.1} {:.0}v20\"/>", at(floor), y + 17.0);
        }
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" class=\"x\">held-out error, {}</text></svg>",
        WIDTH / 2.0,
        bottom + 36.0,
        escape(unit)
    );
    svg
}

/// A number with three digits that count.
pub(super) fn number(x: f64) -> String {
    if !x.is_finite() {
        return "\u{2013}".into();
    }
    let text = match x.abs() {
        0.0 => "0".into(),
        size if !(1e-4..1e6).contains(&size) => format!("{x:.2e}"),
        size => {
            let decimals = (2.0 - libm::floor(libm::log10(size))).clamp(0.0, 6.0) as usize;
            format!("{x:.decimals$}")
        }
    };
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let shown = [0.0, 0.331, 12.34, 412.7, 0.012_345, -2.0, 1.5e-9, 2e7, f64::NAN].map(number);
        assert_eq!(shown[..6], ["0", "0.331", "12.3", "413", "0.0123", "\u{2212}2.00"]);
        assert_eq!(shown[6..], ["1.50e\u{2212}9", "2.00e7", "\u{2013}"]);
    }
}
