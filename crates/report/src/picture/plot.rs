//! The pull curve: command, measured force and displacement over time.

use super::canvas::{Anchor, Canvas, TextStyle};
use super::colours::{COMMAND, DISPLACEMENT, GRID, MEASURED, SLIP, SOFT_INK};
use gripgen_twin::PullTrace;

/// A rectangle of the canvas.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

/// What a curve shows.
pub struct Curve<'a> {
    pub trace: &'a PullTrace,
    /// Time and force of the label.
    pub slip: Option<(f64, f64)>,
    /// Names of the axes, and displacement; without them the plot is a thumbnail.
    pub full: bool,
}

/// Distance of two grid lines that divides `range` into about `wanted` pieces: 1, 2 or 5 times a power of ten.
fn tick(range: f64, wanted: f64) -> f64 {
    let raw = range / wanted;
    let power = libm::pow(10.0, libm::log10(raw).floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= raw).unwrap_or(10.0);
    factor * power
}

/// A number with as many decimals as its grid needs.
fn label(value: f64, step: f64) -> String {
    let decimals = if step >= 1.0 { 0 } else { (-libm::log10(step)).ceil() as usize };
    format!("{value:.decimals$}")
}

/// Draws a pull curve into `area`; axes and their numbers are inside it.
pub fn pull_curve(canvas: &mut Canvas, area: Area, curve: &Curve<'_>) {
    let t = curve.trace;
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
    let command: Vec<(f64, f64)> =
        t.rows().filter(|r| r.time_s >= 0.0).map(|r| (x(r.time_s), y(r.desired_force_n))).collect();
    canvas.line(&command, 1.2, COMMAND);
    let measured: Vec<(f64, f64)> =
        t.rows().filter(|r| r.time_s >= 0.0).map(|r| (x(r.time_s), y(r.measured_force_n))).collect();
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
    let step = tick(end, columns);
    let mut at = 0.0;
    while at <= end {
        let x = plot.x + plot.width * at / end;
        canvas.line(&[(x, plot.y), (x, plot.y + plot.height)], 1.0, GRID);
        canvas.text(&label(at, step), x, plot.y + plot.height + 3.0, Anchor::Middle, small);
        at += step;
    }
    let step = tick(top_n, rows);
    let mut force = 0.0;
    while force <= top_n {
        let y = plot.y + plot.height * (1.0 - force / top_n);
        canvas.line(&[(plot.x, y), (plot.x + plot.width, y)], 1.0, GRID);
        canvas.text(&label(force, step), plot.x - 4.0, y - 8.0, Anchor::Right, small);
        force += step;
    }
    if let Some(name) = name {
        let (middle, below) = (plot.x + plot.width / 2.0, plot.y + plot.height + 21.0);
        canvas.text(name, middle, below, Anchor::Middle, small);
    }
}

/// Displacement on an axis of its own, at the right.
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
    let step = tick(top_mm, 6.0);
    let mut mm = 0.0;
    while mm <= top_mm {
        let y = plot.y + plot.height * (1.0 - mm / top_mm);
        let style = TextStyle::small(DISPLACEMENT);
        canvas.text(&label(mm, step), plot.x + plot.width + 5.0, y - 8.0, Anchor::Left, style);
        mm += step;
    }
}
