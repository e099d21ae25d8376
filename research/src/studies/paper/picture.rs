//! The picture of the paper's report: ratios over grip force, and a pull profile.

use super::cells::PartCells;
use gripgen::twin::PullTrace;
use gripgen_report::picture::{Anchor, Area, Canvas, Curve, TextStyle, pull_curve};
use gripgen_report::picture::{COMMAND, GRID, INK, MEASURED, PANEL, PAPER, SLIP, SOFT_INK};

const MARGIN: f64 = 16.0;
const PLOT: (f64, f64) = (360.0, 260.0);
const TITLE: f64 = 28.0;
const PROFILE_HEIGHT: f64 = 360.0;
/// Grip forces and ratios shown.
const FORCES_N: (f64, f64) = (15.0, 85.0);
const RATIOS: (f64, f64) = (0.6, 1.8);

pub fn paper_picture(with: &[PartCells], without: &[PartCells], profile: &PullTrace) -> Vec<u8> {
    let width = MARGIN + with.len() as f64 * (PLOT.0 + MARGIN);
    let height = 2.0 * TITLE + PLOT.1 + PROFILE_HEIGHT + 3.0 * MARGIN;
    let mut canvas = Canvas::new(width as u32, height as u32, PAPER);
    for (i, (part, plain)) in with.iter().zip(without).enumerate() {
        let x = MARGIN + i as f64 * (PLOT.0 + MARGIN);
        canvas.text(&part.name, x, 8.0, Anchor::Left, TextStyle::title(INK));
        ratio_plot(&mut canvas, Area { x, y: MARGIN + TITLE, width: PLOT.0, height: PLOT.1 }, part, plain);
    }
    let y = 2.0 * MARGIN + TITLE + PLOT.1;
    let text = "long shaft at 40 N: command (grey), measured force (blue) in N, displacement (green) in mm";
    canvas.text(text, MARGIN, y, Anchor::Left, TextStyle::small(INK));
    let area = Area { x: MARGIN, y: y + TITLE, width: width - 2.0 * MARGIN, height: PROFILE_HEIGHT };
    canvas.rect(area.x, area.y, area.width, area.height, PANEL);
    pull_curve(&mut canvas, area, &Curve { trace: profile, slip: None, full: true });
    canvas.into_png()
}

fn ratio_plot(canvas: &mut Canvas, area: Area, part: &PartCells, plain: &PartCells) {
    canvas.rect(area.x, area.y, area.width, area.height, PANEL);
    let (left, below) = (44.0, 42.0);
    let at = |force_n: f64, ratio: f64| {
        let u = (force_n - FORCES_N.0) / (FORCES_N.1 - FORCES_N.0);
        let v = (ratio - RATIOS.0) / (RATIOS.1 - RATIOS.0);
        (
            area.x + left + u * (area.width - left - 8.0),
            area.y + 8.0 + (1.0 - v) * (area.height - below - 8.0),
        )
    };
    let small = TextStyle::small(SOFT_INK);
    for force_n in [20.0, 40.0, 60.0, 80.0] {
        let (x, bottom) = at(force_n, RATIOS.0);
        canvas.line(&[at(force_n, RATIOS.1), (x, bottom)], 1.0, GRID);
        canvas.text(&format!("{force_n}"), x, bottom + 3.0, Anchor::Middle, small);
    }
    for ratio in [0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8] {
        let (x, y) = at(FORCES_N.0, ratio);
        canvas.line(&[(x, y), at(FORCES_N.1, ratio)], 1.0, GRID);
        canvas.text(&format!("{ratio:.1}"), x - 4.0, y - 8.0, Anchor::Right, small);
    }
    let (middle, bottom) = at(50.0, RATIOS.0);
    canvas.text("F_G / N;  up: F_max / (2 mu F_G)", middle, bottom + 20.0, Anchor::Middle, small);
    if let Some((a, b)) = part.law {
        let law: Vec<(f64, f64)> = (0..=60).map(|f| f64::from(f) + 20.0).map(|f| at(f, a + b / f)).collect();
        canvas.line(&law, 1.6, SLIP);
    }
    for (part, ink, radius) in [(plain, COMMAND, 2.5), (part, MEASURED, 3.5)] {
        for cell in &part.cells {
            let ideal_n = 2.0 * part.mu * cell.grip_force_n;
            let (mean, rms) = (cell.mean_n() / ideal_n, cell.rms_n() / ideal_n);
            canvas.line(&[at(cell.grip_force_n, mean - rms), at(cell.grip_force_n, mean + rms)], 1.4, ink);
            let (x, y) = at(cell.grip_force_n, mean);
            canvas.disc(x, y, radius, ink);
        }
    }
}
