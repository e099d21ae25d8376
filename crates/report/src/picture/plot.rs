//! The pull curve: command, measured force and displacement over time.

use super::canvas::{Anchor, Canvas, TextStyle};
use super::colours::{COMMAND, DISPLACEMENT, GRID, MEASURED, SLIP, SOFT_INK};
use crate::axis::nice_step;
use gripgen_twin::PullTrace;

/// A rectangle of the canvas.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// Its left side.
    pub x: f64,
    /// Its top.
    pub y: f64,
    /// Its width.
    pub width: f64,
    /// Its height.
    pub height: f64,
}

/// What a curve shows.
pub struct Curve<'a> {
    /// The pull.
    pub trace: &'a PullTrace,
    /// Time and force of the label.
    pub slip: Option<(f64, f64)>,
    /// Names of the axes, and displacement; without them the plot is a thumbnail.
    pub full: bool,
}

/// Places of the grid lines from 0 to `end`, about as many as are wanted, with their numbers.
fn ticks(end: f64, wanted: f64) -> impl Iterator<Item = (f64, String)> {
    let step = nice_step(end / wanted, 1.0);
    let decimals = if step >= 1.0 { 0 } else { (-libm::log10(step)).ceil() as usize };
    let places = std::iter::successors(Some(0.0), move |at| Some(at + step));
    places.take_while(move |at| *at <= end).map(move |at| (at, format!("{at:.decimals$}")))
}

/// Draws a pull curve into `area`; axes and their numbers are inside it.
pub fn pull_curve(canvas: &mut Canvas, area: Area, curve: &Curve<'_>) {
    let t = curve.trace;
    let pulled = || t.rows().filter(|r| r.time_s >= 0.0);
    let end_s = t.time_s.last().copied().unwrap_or(1.0).max(1e-3);
    let top_n = t
        .measured_force_n
        .iter()
        .chain(&t.desired_force_n)
        .fold(1e-3_f64, |a, &b| if b.is_finite() { a.max(b) } else { a })
        * 1.08;
    let (left, right, below) = if curve.full { (56.0, 56.0, 42.0) } else { (30.0, 4.0, 20.0) };
    let plot = Area {
        x: area.x + left,
        y: area.y + 6.0,
        width: area.width - left - right,
        height: area.height - below - 6.0,
    };
    let x = |time_s: f64| plot.x + plot.width * time_s / end_s;
    let y = |force_n: f64| plot.y + plot.height * (1.0 - force_n.max(0.0) / top_n);
    axes(canvas, plot, end_s, top_n, curve.full.then_some("time / s"));
    let command: Vec<(f64, f64)> = pulled().map(|r| (x(r.time_s), y(r.desired_force_n))).collect();
    canvas.line(&command, 1.2, COMMAND);
    let measured: Vec<(f64, f64)> = pulled().map(|r| (x(r.time_s), y(r.measured_force_n))).collect();
    canvas.line(&measured, if curve.full { 1.6 } else { 1.2 }, MEASURED);
    if curve.full {
        displacement(canvas, plot, t, end_s);
    }
    if let Some((time_s, force_n)) = curve.slip {
        canvas.dashed(&[(x(time_s), y(force_n)), (x(time_s), plot.y + plot.height)], 1.0, SLIP);
        canvas.disc(x(time_s), y(force_n), if curve.full { 5.0 } else { 3.5 }, SLIP);
    }
}

/// Grid and numbers of forces over what runs to the right; a plot without its name is a thumbnail.
pub(crate) fn axes(canvas: &mut Canvas, plot: Area, end: f64, top_n: f64, name: Option<&str>) {
    let small = TextStyle::small(SOFT_INK);
    let (columns, rows) = if name.is_some() { (8.0, 6.0) } else { (3.0, 3.0) };
    for (at, number) in ticks(end, columns) {
        let x = plot.x + plot.width * at / end;
        canvas.line(&[(x, plot.y), (x, plot.y + plot.height)], 1.0, GRID);
        canvas.text(&number, x, plot.y + plot.height + 3.0, Anchor::Middle, small);
    }
    for (force, number) in ticks(top_n, rows) {
        let y = plot.y + plot.height * (1.0 - force / top_n);
        canvas.line(&[(plot.x, y), (plot.x + plot.width, y)], 1.0, GRID);
        canvas.text(&number, plot.x - 4.0, y - 8.0, Anchor::Right, small);
    }
    if let Some(name) = name {
        let (middle, below) = (plot.x + plot.width / 2.0, plot.y + plot.height + 21.0);
        canvas.text(name, middle, below, Anchor::Middle, small);
    }
}

/// Displacement on a separate axis, at the right.
fn displacement(canvas: &mut Canvas, plot: Area, trace: &PullTrace, end_s: f64) {
    let top_mm = trace.displacement_m.iter().fold(1e-3_f64, |a, &b| a.max(b * 1e3)) * 1.08;
    let points: Vec<(f64, f64)> = trace
        .rows()
        .filter(|r| r.time_s >= 0.0)
        .map(|r| {
            let share = (r.displacement_m * 1e3).max(0.0) / top_mm;
            (plot.x + plot.width * r.time_s / end_s, plot.y + plot.height * (1.0 - share))
        })
        .collect();
    canvas.line(&points, 1.2, DISPLACEMENT);
    for (mm, number) in ticks(top_mm, 6.0) {
        let y = plot.y + plot.height * (1.0 - mm / top_mm);
        let style = TextStyle::small(DISPLACEMENT);
        canvas.text(&number, plot.x + plot.width + 5.0, y - 8.0, Anchor::Left, style);
    }
}
