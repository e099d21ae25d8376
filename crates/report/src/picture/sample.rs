//! One sample in full: images, height, pressure, pull curve.

use super::canvas::Canvas;
use super::canvas::{CAPTION, MARGIN};
use super::colours::{SLIP, scale};
use super::layout::{HEADER, IMAGE, fit, frame, framed, placement, sample_sheet};
use super::rig::rig_picture;
use gripgen_record::proto::gripgen_v1::JawContact;
use gripgen_record::{FolderError, RIG_SOURCE, ReadError, Record, RunFolder, ShardReader};
use gripgen_twin::{Jaw, PerJaw};

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

/// How a jaw is pressed, as the engine makes it again from the configuration of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct JawPress {
    /// Size of the map below.
    pub size_px: (u32, u32),
    /// Depth of the press in pixels, row by row.
    pub depth_px: Vec<f32>,
    /// Side of a pixel.
    pub mm_per_px: f64,
    /// Largest depth.
    pub press_depth_mm: f64,
    /// Largest pressure of a cell.
    pub peak_pressure_pa: f64,
}

/// A PNG of one sample of a run. `press` makes its height and pressure maps again; where that is not possible the stored
/// pressure cells are drawn instead. Of a measured pull the images before and in the grip and their difference are drawn, and
/// nothing is pressed.
///
/// # Errors
///
/// A sample that is not done, or that cannot be read.
pub fn sample_picture(
    folder: &RunFolder,
    index: u64,
    press: impl FnOnce() -> Option<PerJaw<JawPress>>,
) -> Result<Vec<u8>, PictureSampleError> {
    let shard = index / folder.info().shard_samples;
    if folder.finished(shard)?.is_none() {
        return Err(PictureSampleError::NotDone { index, shard });
    }
    let reader = ShardReader::open(&folder.shard_path(shard))?;
    let record = reader.record(index)?;
    let film = reader.film(index)?;
    if folder.info().source == RIG_SOURCE {
        return Ok(rig_picture(&record, reader.rest(index)?.as_ref(), film.as_ref()));
    }
    let press = press();
    Ok(sample_sheet(&record, film.as_ref(), (4, 1), |canvas| {
        for (i, jaw) in (0..).zip(Jaw::BOTH) {
            let x = MARGIN + 2 * i * (IMAGE.0 + MARGIN);
            draw_jaw(canvas, (x, HEADER), jaw, &record, press.as_ref().map(|press| &press[jaw]));
        }
    }))
}

/// Image and height map of a jaw side by side.
fn draw_jaw(canvas: &mut Canvas, at: (u32, u32), jaw: Jaw, record: &Record, press: Option<&JawPress>) {
    let caption = format!("{jaw} jaw, image");
    match &record.images {
        Some(images) => framed(canvas, at, &caption, &images[jaw]),
        None => frame(canvas, at, &caption),
    }
    let at = (at.0 + IMAGE.0 + MARGIN, at.1);
    let contact = match jaw {
        Jaw::Left => &record.sample.left,
        Jaw::Right => &record.sample.right,
    };
    match (press, contact) {
        (Some(press), Some(contact)) => {
            let (depth_mm, peak_mpa) = (press.press_depth_mm, press.peak_pressure_pa * 1e-6);
            frame(canvas, at, &format!("depth to {depth_mm:.2} mm, cells to {peak_mpa:.2} MPa"));
            let depth_px = |u, v| f64::from(press.depth_px[(v * press.size_px.0 + u) as usize]);
            fit(canvas, at, press.size_px, |u, v| scale(depth_px(u, v) * press.mm_per_px / depth_mm));
            draw_cells(canvas, at, press, contact);
        }
        (None, Some(contact)) => {
            frame(canvas, at, &format!("pressure cells, depth {:.2} mm", contact.press_depth_mm));
            draw_cells_alone(canvas, (at.0, at.1 + CAPTION), contact);
        }
        _ => frame(canvas, at, "no contact"),
    }
}

/// The pressure cells over the depth map: a dot each, its area proportional to the force.
fn draw_cells(canvas: &mut Canvas, (x, caption): (u32, u32), press: &JawPress, contact: &JawContact) {
    let size = press.size_px;
    let (zoom, left, top) = placement(size);
    let (left, top) = (f64::from(x + left), f64::from(caption + CAPTION + top));
    let largest = contact.cell_force_n.iter().fold(1e-9_f32, |a, &b| a.max(b));
    for i in 0..contact.cell_force_n.len() {
        let column = f64::from(contact.cell_x_mm[i]) / press.mm_per_px + f64::from(size.0) / 2.0;
        let row = f64::from(contact.cell_y_mm[i]) / press.mm_per_px + f64::from(size.1) / 2.0;
        let radius = 4.5 * f64::from(contact.cell_force_n[i] / largest).sqrt();
        canvas.disc(left + column * zoom, top + row * zoom, radius, SLIP);
    }
}

/// The pressure cells where no depth map can be made: their own extent fills the frame.
fn draw_cells_alone(canvas: &mut Canvas, (x, y): (u32, u32), contact: &JawContact) {
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
