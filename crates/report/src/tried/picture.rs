//! A part that was tried, as one picture: a row for each grip.

use super::{FrictionRange, GripTried, TriedPart};
use crate::Rasterise;
use crate::picture::canvas::{CAPTION, MARGIN};
use crate::picture::grips::{PANEL as DRAWING, panel};
use crate::picture::layout::{HEADER, IMAGE, ROW as IMAGES, framed};
use crate::picture::{Anchor, Area, Canvas, FAILED, INK, MEASURED, PANEL, PAPER, SOFT_INK, TextStyle, axes};
use crate::text::wrapped;
use gripgen_twin::Jaw;

/// Size of the curve, and of a row.
const CURVE: (u32, u32) = (560, 600);
const ROW: u32 = 2 * IMAGES;
/// Height of a line of text, and letters of one below a drawing.
const LINE: u32 = 18;
const LETTERS: usize = 76;
/// Letters of a line as wide as the picture.
const WIDE: usize = 190;
/// Sentences below a drawing.
const SENTENCES: usize = 3;

/// A PNG: of each grip the part between the jaws, both images, what it holds, and where it fails.
pub fn tried_picture(part: &TriedPart, rasterise: &Rasterise<'_>) -> Vec<u8> {
    let width = 4 * MARGIN + DRAWING.0 + IMAGE.0 + CURVE.0;
    let words = wrapped(&part.friction, WIDE);
    let top = HEADER + LINE * words.len() as u32;
    let mut canvas = Canvas::new(width, top + part.grips.len() as u32 * ROW, PAPER);
    let [x, y, z] = part.size_mm;
    let title = format!("{}: {x:.1} x {y:.1} x {z:.1} mm, {} grips were tried", part.name, part.tried);
    canvas.text(&title, f64::from(MARGIN), 10.0, Anchor::Left, TextStyle::title(INK));
    let small = TextStyle::small(SOFT_INK);
    let mesh_words = part.mesh_words.join("; ");
    for (i, line) in wrapped(&mesh_words, WIDE).iter().take(1).chain(&words).enumerate() {
        let at = 34.0 + f64::from(LINE * i as u32);
        canvas.text(line, f64::from(MARGIN), at, Anchor::Left, small);
    }
    for (i, grip) in part.grips.iter().enumerate() {
        row(&mut canvas, top + i as u32 * ROW, part, grip, rasterise);
    }
    canvas.into_png()
}

fn row(canvas: &mut Canvas, top: u32, part: &TriedPart, grip: &GripTried, rasterise: &Rasterise<'_>) {
    panel(canvas, (MARGIN, top), &part.mesh, (grip.grip_pose, &grip.proposal), rasterise);
    let mut y = top + DRAWING.1 + 4;
    let said: Vec<&String> = grip.doubts.iter().chain(&grip.fails).collect();
    let shown = said.iter().copied().take(SENTENCES);
    let left_out = said.len().saturating_sub(SENTENCES);
    let more =
        (left_out > 0).then(|| format!("{left_out} more doubts and places where it fails: see the page"));
    let works = grip.fails.is_empty().then(|| "works wherever it was tried".to_string());
    for sentence in shown.chain(&more).chain(&works) {
        let ink = if Some(sentence) == works.as_ref() { SOFT_INK } else { FAILED };
        for line in wrapped(sentence, LETTERS).iter().take(3) {
            canvas.text(line, f64::from(MARGIN), f64::from(y), Anchor::Left, TextStyle::small(ink));
            y += LINE;
        }
    }
    let x = 2 * MARGIN + DRAWING.0;
    for (i, jaw) in (0..).zip(Jaw::BOTH) {
        let caption = format!("{jaw} jaw at {} N", grip.force_n);
        framed(canvas, (x, top + i * IMAGES), &caption, &grip.images[jaw]);
    }
    curve(canvas, (x + IMAGE.0 + MARGIN, top + CAPTION), grip, part.mu);
}

fn curve(canvas: &mut Canvas, (x, y): (u32, u32), grip: &GripTried, mu: FrictionRange) {
    let (x, y) = (f64::from(x), f64::from(y));
    let caption = "expected pull at slip / N";
    canvas.text(caption, x, y - f64::from(CAPTION), Anchor::Left, TextStyle::small(INK));
    canvas.rect(x, y, f64::from(CURVE.0), f64::from(CURVE.1), PANEL);
    let plot =
        Area { x: x + 56.0, y: y + 6.0, width: f64::from(CURVE.0) - 76.0, height: f64::from(CURVE.1) - 48.0 };
    let end_n = grip.holding.iter().fold(1.0_f64, |most, h| most.max(h.grip_force_n)) * 1.04;
    let holds = grip.holds();
    let top_n = holds.iter().fold(1.0_f64, |most, (_, [.., high])| most.max(*high)) * 1.08;
    axes(canvas, plot, end_n, top_n, Some("grip force of a jaw / N"));
    let at = |force_n: f64, pull_n: f64| {
        (plot.x + plot.width * force_n / end_n, plot.y + plot.height * (1.0 - pull_n / top_n))
    };
    let over = |end: usize| -> Vec<(f64, f64)> { holds.iter().map(|(n, pull)| at(*n, pull[end])).collect() };
    for end in [0, 2] {
        canvas.dashed(&over(end), 1.4, MEASURED);
    }
    canvas.line(&over(1), 2.0, MEASURED);
    for (px, py) in over(1) {
        canvas.disc(px, py, 3.5, MEASURED);
    }
    for (end, mu) in [mu.low, mu.value, mu.high].into_iter().enumerate() {
        let Some(&(n, pull)) = holds.last() else { break };
        let (px, py) = at(n, pull[end]);
        let name = format!("mu {mu:.2}");
        canvas.text(&name, px - 8.0, py - 19.0, Anchor::Right, TextStyle::small(MEASURED));
    }
    for failed in grip.holding.iter().filter(|h| h.max_pull_force_n.is_err()) {
        let (px, py) = at(failed.grip_force_n, 0.0);
        canvas.text("fails", px, py - 20.0, Anchor::Middle, TextStyle::small(FAILED));
    }
}
