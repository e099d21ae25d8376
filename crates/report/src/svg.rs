//! Plots as SVG, drawn by ourselves: a page needs no script and no other file.

use crate::axis::Axis;
use crate::text::{escape, shorten};
use crate::{Mark, Plot, Series};
use std::fmt::Write;

/// Width of a plot in its own units, and height of what is drawn in it; the page scales it.
const WIDTH: f64 = 420.0;
const INNER_HEIGHT: f64 = 232.0;
const TOP: f64 = 8.0;
const RIGHT: f64 = 12.0;
/// Width of a letter of the labels, in the mean.
const LETTER: f64 = 6.6;
/// Colours of series; the style sheet has as many.
const COLOURS: usize = 8;
/// Letters of a word on the x axis.
const LONGEST_WORD: usize = 18;
/// Series of a plot.
pub(crate) const SERIES: usize = 12;

/// The points whose name begins the name of a line (`gear` of `gear 0, expected`).
fn points_of(all: &[Series], i: usize) -> Option<usize> {
    let begins =
        |whole: &str, name: &str| whole.strip_prefix(name).is_some_and(|rest| rest.starts_with([' ', ',']));
    let of = |s: &Series| s.mark == Mark::Points && begins(&all[i].name, &s.name);
    all.iter().position(of).filter(|_| all[i].mark == Mark::Line)
}

/// The class of a series, which gives it its colour: before and after have the same everywhere, and a line has that of its points.
pub(crate) fn class(all: &[Series], i: usize) -> String {
    let i = points_of(all, i).unwrap_or(i);
    let of = |name: &str| match name {
        "before" => Some("cb"),
        "after" => Some("ca"),
        _ => None,
    };
    let number = (0..i).filter(|&j| points_of(all, j).is_none()).count();
    match of(&all[i].name) {
        Some(class) => class.into(),
        // The first colour is that of what is after.
        None if all.iter().any(|s| of(&s.name).is_some()) => format!("c{}", 1 + number % (COLOURS - 1)),
        None => format!("c{}", number % COLOURS),
    }
}

/// A text of a drawing; `class` says which end of it is at `x`.
pub(crate) fn label(x: f64, y: f64, class: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{}</text>", escape(text))
}

/// The same, read from below.
fn upright(x: f64, y: f64, class: &str, text: &str) -> String {
    let turned = format!("<text transform=\"rotate(-90 {x:.1} {y:.1})\"");
    label(x, y, class, text).replace("<text", &turned)
}

/// Draws a plot; of each series at most `most` points, so that a page has a size.
pub(crate) fn draw(plot: &Plot, most: usize) -> String {
    let all = &plot.series[..plot.series.len().min(SERIES)];
    let mut thinned: Vec<Thinned> = all.iter().map(|s| thin(s, most)).collect();
    let points = || thinned.iter().flat_map(|s| &s.points);
    let y = Axis::of(points().flat_map(|p| [p.1 - p.2, p.1 + p.2]), 5);
    let words: Vec<String> = plot.x_words.iter().map(|w| shorten(w, LONGEST_WORD)).collect();
    let x = if words.is_empty() { Axis::of(points().map(|p| p.0), 6) } else { Axis::of_words(&words, 24) };

    let letters =
        |ticks: &[(f64, String)]| ticks.iter().map(|t| t.1.chars().count()).max().unwrap_or(1) as f64;
    let left = 34.0 + LETTER * letters(&y.ticks);
    let right = WIDTH - RIGHT;
    // Words that do not fit next to each other stand upright.
    let room = (right - left) / x.ticks.len().max(1) as f64;
    let is_upright = !words.is_empty() && LETTER * letters(&x.ticks) + 6.0 > room;
    let below = if is_upright { 14.0 + LETTER * letters(&x.ticks) } else { 20.0 };
    let bottom = TOP + INNER_HEIGHT;
    let whole = bottom + below + 20.0;
    let at = |px: f64, py: f64| (left + x.share(px) * (right - left), bottom - y.share(py) * INNER_HEIGHT);

    let name = escape(&format!("{}: {} over {}", plot.title, plot.y_label, plot.x_label));
    let mut svg =
        format!("<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {whole:.0}\" role=\"img\" aria-label=\"{name}\">");
    let mut grid = String::new();
    for (value, text) in &y.ticks {
        let (_, py) = at(x.low, *value);
        let _ = write!(grid, "M{left:.0} {py:.1}H{right:.0}");
        svg += &label(left - 6.0, py + 4.0, "y", text);
    }
    for (value, text) in &x.ticks {
        let (px, _) = at(*value, y.low);
        let _ = write!(grid, "M{px:.1} {bottom:.0}v-{INNER_HEIGHT:.0}");
        svg += &match is_upright {
            true => upright(px + 4.0, bottom + 6.0, "y", text),
            false => label(px, bottom + 15.0, "x", text),
        };
    }
    let _ = write!(svg, "<path class=\"grid\" d=\"{grid}\"/>");
    if y.low < 0.0 && y.high > 0.0 {
        let _ = write!(svg, "<path class=\"zero\" d=\"M{left:.0} {:.1}H{right:.0}\"/>", at(x.low, 0.0).1);
    }
    let shown = all.len().max(1) as f64;
    for (i, (own, thinned)) in all.iter().zip(&mut thinned).enumerate() {
        // One point a word is a mean, which stands where it is.
        let many = thinned.points.len() > words.len();
        if !words.is_empty() && own.mark == Mark::Points && many {
            spread(&mut thinned.points, 0.7 * ((i as f64 + 0.5) / shown - 0.5), 0.5 / shown);
        }
        svg += &marks(own.mark, thinned, &class(all, i), &at);
    }
    svg += &label((left + right) / 2.0, whole - 6.0, "x", &shorten(&plot.x_label, 60));
    svg += &upright(13.0, (TOP + bottom) / 2.0, "x", &shorten(&plot.y_label, 40));
    svg + "</svg>"
}

/// What the style sheet of a page says of plots, for a separate picture.
const STYLE: &str = "text { font: 12px system-ui, sans-serif; fill: #1d2328 } .x { text-anchor: middle } \
    .y { text-anchor: end } path { fill: none; stroke: #0072b2 } .grid { stroke: #e6e9ed } .zero { stroke: #5b6670 } \
    .line { stroke-width: 2 } .dots { stroke-width: 5.5; stroke-linecap: round } .c1 { stroke: #d55e00 } .cb { stroke: #87919b }";

impl Plot {
    /// The plot as a separate SVG file, with its title above it.
    pub fn to_svg(&self) -> String {
        let inner = draw(self, 800).replace("<svg class=\"plot\"", "<svg y=\"24\"");
        let title = escape(&shorten(&self.title, 60));
        let (width, height) = (WIDTH, INNER_HEIGHT + 100.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\"><style>{STYLE}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <text x=\"{}\" y=\"18\" class=\"x\">{title}</text>{inner}</svg>\n",
            WIDTH / 2.0
        )
    }
}

/// Points with the half lengths of their error bars, few enough to draw.
struct Thinned {
    points: Vec<(f64, f64, f64)>,
    errors: bool,
}

/// At most about `most` of the finite points: of a line the lowest and the highest of each stretch, of dots every n-th.
fn thin(series: &Series, most: usize) -> Thinned {
    let errors = series.errors.len() == series.points.len() && !series.errors.is_empty();
    let error = |i: usize| if errors && series.errors[i].is_finite() { series.errors[i].abs() } else { 0.0 };
    let all = series.points.iter().enumerate().map(|(i, &(x, y))| (x, y, error(i)));
    // Beyond this the distance of two values has no number.
    let points: Vec<_> = all.filter(|p| p.0.abs() < 1e300 && p.1.abs() + p.2 < 1e300).collect();
    let most = most.max(4);
    if points.len() <= most {
        return Thinned { points, errors };
    }
    let points = match series.mark {
        Mark::Points | Mark::Band => (0..most).map(|i| points[i * points.len() / most]).collect(),
        Mark::Line => {
            let stretch = points.len().div_ceil(most / 2);
            points.chunks(stretch).flat_map(ends).collect()
        }
    };
    Thinned { points, errors }
}

/// The lowest and the highest point of a stretch, in their order.
fn ends(stretch: &[(f64, f64, f64)]) -> Vec<(f64, f64, f64)> {
    let by = |a: &&(f64, f64, f64), b: &&(f64, f64, f64)| a.1.total_cmp(&b.1);
    let place = |p: &(f64, f64, f64)| stretch.iter().position(|q| q == p);
    let (Some(low), Some(high)) = (stretch.iter().min_by(by), stretch.iter().max_by(by)) else {
        return vec![];
    };
    if place(low) <= place(high) { vec![*low, *high] } else { vec![*high, *low] }
}

/// Points of one word next to each other, those of each series in a separate strip: they hide each other less.
fn spread(points: &mut [(f64, f64, f64)], middle: f64, width: f64) {
    if points.len() < 2 {
        return;
    }
    for (i, point) in points.iter_mut().enumerate() {
        let share = (i as f64 * 0.618_034).fract();
        point.0 += middle + width * (share - 0.5);
    }
}

fn marks(mark: Mark, series: &Thinned, colour: &str, at: &dyn Fn(f64, f64) -> (f64, f64)) -> String {
    let (mut path, mut bars) = (String::new(), String::new());
    for (i, &(px, py, error)) in series.points.iter().enumerate() {
        let (x, y) = at(px, py);
        let _ = match mark {
            // A line of no length with round ends is a dot.
            Mark::Points => write!(path, "M{x:.1} {y:.1}h0"),
            Mark::Line | Mark::Band => write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' }),
        };
        if series.errors && error > 0.0 {
            let _ = write!(bars, "M{x:.1} {:.1}V{:.1}", at(px, py - error).1, at(px, py + error).1);
        }
    }
    let class = match mark {
        Mark::Points if series.points.len() > 120 => "dots many",
        Mark::Points => "dots",
        Mark::Line => "line",
        Mark::Band => "band",
    };
    let bars = if bars.is_empty() { bars } else { format!("<path class=\"bars {colour}\" d=\"{bars}\"/>") };
    format!("{bars}<path class=\"{class} {colour}\" d=\"{path}\"/>")
}
