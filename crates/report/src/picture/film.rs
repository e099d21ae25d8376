//! A strip of frames of a filmed pull: what the cameras see, and which part of the contact has slipped.

use super::canvas::{Anchor, CAPTION, Canvas, MARGIN, Rgb, TextStyle};
use super::colours::{INK, SLIP};
use crate::text::spread;
use gripgen_record::Film;
use gripgen_twin::{FilmFrame, Jaw, PerJaw};

/// Frames of a strip.
const FRAMES: usize = 6;

/// Size of a frame in the strip.
const TILE: (u32, u32) = (264, 198);

/// Height of the strip, with its captions.
pub(super) const STRIP_HEIGHT: u32 = CAPTION + 2 * (TILE.1 + 4) + MARGIN;

/// Draws a few frames of a film, from its first to its last: left jaw above right jaw. What has slipped is tinted.
pub(super) fn draw_strip(canvas: &mut Canvas, (top, width): (u32, u32), film: &Film) {
    let there_is_room_for = ((width - MARGIN) / (TILE.0 + 4)) as usize;
    let frames: Vec<(usize, &PerJaw<FilmFrame>)> = film.frames.iter().enumerate().collect();
    for (i, &(number, both)) in spread(&frames, FRAMES.min(there_is_room_for)).enumerate() {
        let x = MARGIN + i as u32 * (TILE.0 + 4);
        let f = &both.left;
        let caption = format!(
            "frame {number}, {:.2} s, {:.1} N, {:.2} mm",
            f.time_s,
            f.contact_force_n,
            f.displacement_m * 1e3
        );
        canvas.text(&caption, f64::from(x), f64::from(top), Anchor::Left, TextStyle::small(INK));
        for (row, jaw) in Jaw::BOTH.into_iter().enumerate() {
            draw_frame(canvas, (x, top + CAPTION + row as u32 * (TILE.1 + 4)), &both[jaw]);
        }
    }
}

fn draw_frame(canvas: &mut Canvas, at: (u32, u32), frame: &FilmFrame) {
    let (width, height) = (frame.image.width_px, frame.image.height_px);
    let zoom = (f64::from(width) / f64::from(TILE.0)).max(f64::from(height) / f64::from(TILE.1));
    for y in 0..TILE.1 {
        for x in 0..TILE.0 {
            let (u, v) = ((f64::from(x) * zoom) as u32, (f64::from(y) * zoom) as u32);
            if u >= width || v >= height {
                continue;
            }
            let [r, g, b] = frame.image.pixel(u, v);
            let cell = frame.cell_of_px.get((v * width + u) as usize).copied().unwrap_or(0);
            let slipped = cell > 0 && frame.cells.get(usize::from(cell) - 1).is_some_and(|c| c.slipped);
            let mixed = |a: u8, b: u8| ((2 * u16::from(a) + u16::from(b)) / 3) as u8;
            let ink = if slipped {
                Rgb(mixed(r, SLIP.0), mixed(g, SLIP.1), mixed(b, SLIP.2))
            } else {
                Rgb(r, g, b)
            };
            canvas.put(at.0 + x, at.1 + y, ink);
        }
    }
}
