//! One sample in full: images, height, pressure, pull curve.

use super::canvas::{Anchor, Canvas, TextStyle};
use super::colours::{INK, PAPER, SLIP, SOFT_INK, scale};
use super::film::{STRIP_HEIGHT, draw_strip};
use super::layout::{
    CAPTION, CURVE_HEIGHT, HEADER, IMAGE, MARGIN, draw_curve, fit, frame, pixel, placement, second_line,
};
use super::rig::rig_picture;
use super::sheet::heading;
use crate::generate::{GripImprints, press_only};
use crate::project::Project;
use gripgen_record::proto::gripgen_v1::JawContact;
use gripgen_record::{FolderError, RIG_SOURCE, ReadError, Record, RunFolder, ShardReader};
use gripgen_tactile::Plane;
use gripgen_twin::Jaw;

/// Why a sample could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureSampleError {
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A shard.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The shard is not there yet.
    #[error("sample {index} belongs to shard {shard}, which is not done")]
    NotDone {
        /// The sample.
        index: u64,
        /// Its shard.
        shard: u64,
    },
}

/// A PNG of one sample of a run. Height and pressure maps are made again from the run's configuration; where that is
/// not possible the stored pressure cells are drawn instead. Of a measured pull the images before and in the grip and their
/// difference are drawn.
///
/// # Errors
///
/// A sample that is not done, or that cannot be read.
pub fn sample_picture(folder: &RunFolder, index: u64) -> Result<Vec<u8>, PictureSampleError> {
    let shard = index / folder.info().shard_samples;
    if folder.finished(shard)?.is_none() {
        return Err(PictureSampleError::NotDone { index, shard });
    }
    let reader = ShardReader::open(&folder.shard_path(shard))?;
    let record = reader.record(index)?;
    if folder.info().source == RIG_SOURCE {
        return Ok(rig_picture(&record, reader.rest(index)?.as_ref(), reader.film(index)?.as_ref()));
    }
    let press = press_again(folder, index);
    let columns = 4;
    let width = columns * (IMAGE.0 + MARGIN) + MARGIN;
    let film = reader.film(index)?;
    let plain = HEADER + CAPTION + IMAGE.1 + MARGIN + CAPTION + CURVE_HEIGHT + MARGIN;
    let height = plain + if film.is_some() { STRIP_HEIGHT } else { 0 };
    let mut canvas = Canvas::new(width, height, PAPER);
    let s = &record.sample;
    canvas.text(&heading(s), f64::from(MARGIN), 10.0, Anchor::Left, TextStyle::title(INK));
    canvas.text(&second_line(s), f64::from(MARGIN), 36.0, Anchor::Left, TextStyle::small(SOFT_INK));
    let top = HEADER;
    for (i, jaw) in Jaw::BOTH.into_iter().enumerate() {
        let x = MARGIN + 2 * i as u32 * (IMAGE.0 + MARGIN);
        draw_jaw(&mut canvas, (x, top), jaw, &record, press.as_ref());
    }
    draw_curve(&mut canvas, top + CAPTION + IMAGE.1 + MARGIN, width, &record);
    if let Some(film) = &film {
        draw_strip(&mut canvas, (plain, width), film);
    }
    Ok(canvas.into_png())
}

/// The imprints of a simulated sample.
fn press_again(folder: &RunFolder, index: u64) -> Option<GripImprints> {
    let project = Project::from_run(folder).ok()?;
    let twin = project.twin_of(index).ok()?;
    let (scenario, usable) = project.sweep.scenario(index, &twin);
    usable.ok()?;
    press_only(&twin, &project.library, &scenario, project.sweep.mechanics).ok()?
}

/// Image and height map of a jaw side by side.
fn draw_jaw(canvas: &mut Canvas, at: (u32, u32), jaw: Jaw, record: &Record, press: Option<&GripImprints>) {
    let (x, y) = (at.0, at.1 + CAPTION);
    let small = TextStyle::small(INK);
    canvas.text(&format!("{jaw} jaw, image"), f64::from(x), f64::from(at.1), Anchor::Left, small);
    frame(canvas, x, y);
    if let Some(images) = &record.images {
        fit(canvas, x, y, (images[jaw].width_px, images[jaw].height_px), |u, v| pixel(&images[jaw], u, v));
    }
    let x = x + IMAGE.0 + MARGIN;
    frame(canvas, x, y);
    let contact = match jaw {
        Jaw::Left => &record.sample.left,
        Jaw::Right => &record.sample.right,
    };
    match (press, contact) {
        (Some(press), Some(_)) => {
            let imprint = &press.imprint[jaw];
            let depth_mm = imprint.press_depth_m * 1e3;
            let unit = press.sensors[jaw].grid.metres_per_px * 1e3;
            let peak = imprint.patch.cells.iter().map(|c| c.pressure_pa()).fold(0.0, f64::max);
            let caption = format!("depth to {depth_mm:.2} mm, cells to {:.2} MPa", peak * 1e-6);
            canvas.text(&caption, f64::from(x), f64::from(at.1), Anchor::Left, small);
            let plane = &imprint.depth_px;
            let colour = |u, v| scale(f64::from(plane.at(u as usize, v as usize)) * unit / depth_mm);
            fit(canvas, x, y, (plane.width as u32, plane.height as u32), colour);
            draw_cells(canvas, x, y, plane, unit, contact.as_ref());
        }
        (None, Some(contact)) => {
            let caption = format!("pressure cells, depth {:.2} mm", contact.press_depth_mm);
            canvas.text(&caption, f64::from(x), f64::from(at.1), Anchor::Left, small);
            draw_cells_alone(canvas, x, y, contact);
        }
        _ => canvas.text("no contact", f64::from(x), f64::from(at.1), Anchor::Left, small),
    }
}

/// The pressure cells over the depth map: a dot each, its area proportional to the force.
fn draw_cells(
    canvas: &mut Canvas,
    x: u32,
    y: u32,
    plane: &Plane,
    mm_per_px: f64,
    contact: Option<&JawContact>,
) {
    let Some(contact) = contact else { return };
    let size = (plane.width as u32, plane.height as u32);
    let (zoom, left, top) = placement(size);
    let largest = contact.cell_force_n.iter().fold(1e-9_f32, |a, &b| a.max(b));
    for i in 0..contact.cell_force_n.len() {
        let column = f64::from(contact.cell_x_mm[i]) / mm_per_px + f64::from(size.0) / 2.0;
        let row = f64::from(contact.cell_y_mm[i]) / mm_per_px + f64::from(size.1) / 2.0;
        let radius = 4.5 * f64::from(contact.cell_force_n[i] / largest).sqrt();
        canvas.disc(f64::from(x + left) + column * zoom, f64::from(y + top) + row * zoom, radius, SLIP);
    }
}

/// The pressure cells where no depth map can be made: their own extent fills the frame.
fn draw_cells_alone(canvas: &mut Canvas, x: u32, y: u32, contact: &JawContact) {
    let reach =
        contact.cell_x_mm.iter().chain(&contact.cell_y_mm).fold(1e-3_f64, |a, &b| a.max(f64::from(b).abs()));
    let zoom = 0.45 * f64::from(IMAGE.0.min(IMAGE.1)) / reach;
    let largest = contact.cell_force_n.iter().fold(1e-9_f32, |a, &b| a.max(b));
    for i in 0..contact.cell_force_n.len() {
        let radius = 6.0 * f64::from(contact.cell_force_n[i] / largest).sqrt();
        let (cx, cy) = (f64::from(x) + f64::from(IMAGE.0) / 2.0, f64::from(y) + f64::from(IMAGE.1) / 2.0);
        let (dx, dy) = (f64::from(contact.cell_x_mm[i]) * zoom, f64::from(contact.cell_y_mm[i]) * zoom);
        canvas.disc(cx + dx, cy + dy, radius, SLIP);
    }
}
