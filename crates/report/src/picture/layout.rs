//! What the pictures of a sample and of a measured pull share.

use super::canvas::{Anchor, CAPTION, Canvas, MARGIN, Rgb, TextStyle};
use super::colours::{COMMAND, DISPLACEMENT, INK, MEASURED, PANEL, PAPER, SLIP, SOFT_INK};
use super::film::{STRIP_HEIGHT, draw_strip};
use super::plot::{Area, Curve, pull_curve};
use super::sheet::{details, heading};
use gripgen_record::proto::gripgen_v1::Sample;
use gripgen_record::{Film, Record};
use gripgen_twin::TactileImage;

pub(crate) const IMAGE: (u32, u32) = (400, 300);
pub(crate) const HEADER: u32 = 64;
/// Height of a row of images with their captions.
pub(crate) const ROW: u32 = CAPTION + IMAGE.1 + MARGIN;
const CURVE_HEIGHT: u32 = 380;

fn second_line(s: &Sample) -> String {
    let mut text = details(s);
    if let Some(mu) = s.mu_effective {
        text += &format!(", mu {mu:.4}");
    }
    if s.lag_exceeds_tolerance {
        text += ", force loop lags beyond the label tolerance";
    }
    if s.outside_fit {
        text += ", friction law outside its fitted range";
    }
    text
}

/// A picture of one sample: its heading, `rows` rows of images that `draw` draws, its pull curve and its film.
pub(super) fn sample_sheet(
    record: &Record,
    film: Option<&Film>,
    (columns, rows): (u32, u32),
    draw: impl FnOnce(&mut Canvas),
) -> Vec<u8> {
    let width = columns * (IMAGE.0 + MARGIN) + MARGIN;
    let curve = HEADER + rows * ROW;
    let plain = curve + CAPTION + CURVE_HEIGHT + MARGIN;
    let height = plain + if film.is_some() { STRIP_HEIGHT } else { 0 };
    let mut canvas = Canvas::new(width, height, PAPER);
    let s = &record.sample;
    canvas.text(&heading(s), f64::from(MARGIN), 10.0, Anchor::Left, TextStyle::title(INK));
    canvas.text(&second_line(s), f64::from(MARGIN), 36.0, Anchor::Left, TextStyle::small(SOFT_INK));
    draw(&mut canvas);
    draw_curve(&mut canvas, curve, width, record);
    if let Some(film) = film {
        draw_strip(&mut canvas, (plain, width), film);
    }
    canvas.into_png()
}

/// An empty frame with a caption above it.
pub(crate) fn frame(canvas: &mut Canvas, (x, top): (u32, u32), caption: &str) {
    canvas.text(caption, f64::from(x), f64::from(top), Anchor::Left, TextStyle::small(INK));
    canvas.rect(f64::from(x), f64::from(top + CAPTION), f64::from(IMAGE.0), f64::from(IMAGE.1), PANEL);
}

/// A frame with an image in it.
pub(crate) fn framed(canvas: &mut Canvas, at: (u32, u32), caption: &str, image: &TactileImage) {
    frame(canvas, at, caption);
    fit(canvas, at, (image.width_px, image.height_px), |u, v| {
        let [r, g, b] = image.pixel(u, v);
        Rgb(r, g, b)
    });
}

/// Draws an image into the frame below the caption at a place, as large as it fits, centred.
pub(super) fn fit(
    canvas: &mut Canvas,
    (x, caption): (u32, u32),
    size: (u32, u32),
    colour: impl Fn(u32, u32) -> Rgb,
) {
    let y = caption + CAPTION;
    let (zoom, left, top) = placement(size);
    let (width, height) = ((f64::from(size.0) * zoom) as u32, (f64::from(size.1) * zoom) as u32);
    for row in 0..height {
        for column in 0..width {
            let u = ((f64::from(column) + 0.5) / zoom) as u32;
            let v = ((f64::from(row) + 0.5) / zoom) as u32;
            let ink = colour(u.min(size.0 - 1), v.min(size.1 - 1));
            canvas.put(x + left + column, y + top + row, ink);
        }
    }
}

fn draw_curve(canvas: &mut Canvas, top: u32, width: u32, record: &Record) {
    let mut x = f64::from(MARGIN);
    for (text, ink) in [
        ("force / N:", INK),
        ("command", COMMAND),
        ("measured", MEASURED),
        ("slip", SLIP),
        ("displacement / mm (right)", DISPLACEMENT),
    ] {
        canvas.text(text, x, f64::from(top), Anchor::Left, TextStyle::small(ink));
        x += 8.0 * (text.chars().count() + 2) as f64;
    }
    let area = Area {
        x: f64::from(MARGIN),
        y: f64::from(top + CAPTION),
        width: f64::from(width - 2 * MARGIN),
        height: f64::from(CURVE_HEIGHT),
    };
    canvas.rect(area.x, area.y, area.width, area.height, PANEL);
    let s = &record.sample;
    match &record.trace {
        Some(trace) => {
            let slip = s.slip_time_s.zip(s.max_pull_force_n);
            pull_curve(canvas, area, &Curve { trace, slip, full: true });
        }
        None => {
            let why = if s.failure.is_empty() { "this run stores no traces" } else { &s.failure };
            canvas.text(why, area.x + 12.0, area.y + 12.0, Anchor::Left, TextStyle::small(SOFT_INK));
        }
    }
}

/// Zoom and margins of an image of this size in the frame.
pub(super) fn placement(size: (u32, u32)) -> (f64, u32, u32) {
    let zoom = (f64::from(IMAGE.0) / f64::from(size.0)).min(f64::from(IMAGE.1) / f64::from(size.1));
    let rest = |frame: u32, n: u32| ((f64::from(frame) - f64::from(n) * zoom) / 2.0).max(0.0) as u32;
    (zoom, rest(IMAGE.0, size.0), rest(IMAGE.1, size.1))
}
