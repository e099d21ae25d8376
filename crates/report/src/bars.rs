//! The error before and after, as bars with intervals and the noise floor.

use crate::axis::Axis;
use crate::svg::label;
use crate::text::number;
use std::fmt::Write;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bar {
    /// What it is an error of.
    pub(crate) name: String,
    /// After the effects were added.
    pub(crate) after: bool,
    pub(crate) value: f64,
    /// Its 90 % interval.
    pub(crate) interval: (f64, f64),
}

const WIDTH: f64 = 420.0;
const ROW: f64 = 40.0;
const SIDE: f64 = 10.0;

/// Draws the bars below each other, and the floor as a line through all of them.
pub(crate) fn draw(bars: &[Bar], floor: Option<f64>, unit: &str) -> String {
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
        svg += &label(px, bottom + 16.0, "x", text);
    }
    let _ = write!(svg, "<path class=\"grid\" d=\"{grid}\"/>");
    if let Some(floor) = floor {
        let px = at(floor);
        // Near the right end the words stand to the left of the line.
        let (tx, class) = if px > WIDTH / 2.0 { (px + 4.0, "y") } else { (px - 4.0, "start") };
        svg += &label(tx, 14.0, class, &format!("noise floor {}", number(floor)));
    }
    for (i, bar) in bars.iter().enumerate() {
        let y = top + ROW * i as f64;
        let [value, low, high] = [bar.value, bar.interval.0, bar.interval.1];
        let numbers = format!("{}: {} ({} to {})", bar.name, number(value), number(low), number(high));
        svg += &label(SIDE, y + 14.0, "start", &numbers);
        let class = if bar.after { "after" } else { "before" };
        let (zero, end, low, high, cap) = (at(0.0), at(value), at(low), at(high), y + 23.0);
        let _ = write!(
            svg,
            "<rect class=\"{class}\" x=\"{zero:.1}\" y=\"{:.0}\" width=\"{:.1}\" height=\"14\"/>\
             <path class=\"interval\" d=\"M{low:.1} {:.0}H{high:.1}M{low:.1} {cap:.0}v8M{high:.1} {cap:.0}v8\"/>",
            y + 20.0,
            (end - zero).max(0.0),
            y + 27.0,
        );
        if let Some(floor) = floor {
            let _ = write!(svg, "<path class=\"floor\" d=\"M{:.1} {:.0}v20\"/>", at(floor), y + 17.0);
        }
    }
    svg + &label(WIDTH / 2.0, bottom + 36.0, "x", &format!("held-out error, {unit}")) + "</svg>"
}
