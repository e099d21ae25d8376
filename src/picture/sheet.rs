//! The contact sheet: a few samples of a run at a glance.

use super::canvas::{Anchor, Canvas, TextStyle};
use super::colours::{FAILED, INK, PANEL, PAPER, SOFT_INK};
use super::plot::{Area, Curve, pull_curve};
use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_record::{FolderError, INDEX_COLUMNS, ReadError, Record, RunFolder, ShardReader, status_name};
use std::collections::BTreeMap;

/// Tiles along and down the sheet.
const COLUMNS: usize = 3;
const ROWS: usize = 4;

/// Size of a tile: two images side by side above a curve.
const IMAGE_WIDTH: u32 = 232;
const GAP: u32 = 8;
const TILE_WIDTH: u32 = 2 * IMAGE_WIDTH + 3 * GAP;
const IMAGE_HEIGHT: u32 = 174;
const CURVE_HEIGHT: u32 = 150;
const TILE_HEIGHT: u32 = IMAGE_HEIGHT + CURVE_HEIGHT + 44 + 3 * GAP;
const HEADER: u32 = 52;

/// Why a contact sheet could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A shard.
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// Name of the overview in a run folder.
pub const CONTACT_SHEET: &str = "contact-sheet.png";

/// Draws the overview of a run into its folder.
///
/// # Errors
///
/// As [`contact_sheet`], or a file that cannot be written.
pub fn publish_contact_sheet(folder: &RunFolder) -> Result<(), SheetError> {
    Ok(folder.publish(CONTACT_SHEET, &contact_sheet(folder)?)?)
}

/// A PNG of a few samples, spread over parts and labels.
///
/// # Errors
///
/// A run that cannot be read.
pub fn contact_sheet(folder: &RunFolder) -> Result<Vec<u8>, SheetError> {
    let chosen = contact_sheet_samples(folder)?;
    let rows = chosen.len().div_ceil(COLUMNS).max(1) as u32;
    let width = COLUMNS as u32 * (TILE_WIDTH + GAP) + GAP;
    let height = HEADER + rows * (TILE_HEIGHT + GAP) + GAP;
    let mut canvas = Canvas::new(width, height, PAPER);
    let info = folder.info();
    let title = format!("{}: {} samples", info.name, info.samples);
    canvas.text(&title, 16.0, 8.0, Anchor::Left, TextStyle::title(INK));
    let legend =
        "left and right jaw; below: command (grey) and measured force (blue) in N over time in s, slip (red)";
    canvas.text(legend, 16.0, 30.0, Anchor::Left, TextStyle::small(SOFT_INK));
    for (i, &index) in chosen.iter().enumerate() {
        let reader = ShardReader::open(&folder.shard_path(index / info.shard_samples))?;
        let x = GAP + (i % COLUMNS) as u32 * (TILE_WIDTH + GAP);
        let y = HEADER + (i / COLUMNS) as u32 * (TILE_HEIGHT + GAP);
        tile(&mut canvas, x, y, &reader.record(index)?);
    }
    Ok(canvas.into_png())
}

/// Samples that [`contact_sheet`] shows: parts in turn, and of each part labels from small to large.
///
/// # Errors
///
/// A run that cannot be read.
pub fn contact_sheet_samples(folder: &RunFolder) -> Result<Vec<u64>, FolderError> {
    let at = |name: &str| INDEX_COLUMNS.iter().position(|c| *c == name).unwrap_or(0);
    let (part, label) = (at("part"), at("max_pull_force_n"));
    let mut by_part: BTreeMap<String, Vec<(f64, u64)>> = BTreeMap::new();
    for shard in 0..folder.info().shards {
        let Some(sidecar) = folder.finished(shard)? else { continue };
        for (row, index) in sidecar.rows.iter().zip(sidecar.first_sample..) {
            let label = row[label].parse().unwrap_or(-1.0);
            by_part.entry(row[part].clone()).or_default().push((label, index));
        }
        // Enough to choose from, also in a run of a billion samples.
        if by_part.values().map(Vec::len).sum::<usize>() > 100_000 {
            break;
        }
    }
    let mut chosen = Vec::new();
    for samples in by_part.values_mut() {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
    let room = COLUMNS * ROWS;
    let per_part = room.div_ceil(by_part.len().max(1));
    for samples in by_part.values() {
        let n = per_part.min(samples.len());
        for k in 0..n {
            let i = if n == 1 { samples.len() / 2 } else { k * (samples.len() - 1) / (n - 1) };
            chosen.push(samples[i].1);
        }
    }
    chosen.truncate(room);
    Ok(chosen)
}

fn tile(canvas: &mut Canvas, x: u32, y: u32, record: &Record) {
    let s = &record.sample;
    canvas.rect(f64::from(x), f64::from(y), f64::from(TILE_WIDTH), f64::from(TILE_HEIGHT), PANEL);
    let (left, mut top) = (f64::from(x + GAP), f64::from(y + GAP / 2));
    let ink = if s.status() == Status::Failed { FAILED } else { INK };
    canvas.text(&heading(s), left, top, Anchor::Left, TextStyle { ink, large: false, bold: true });
    top += 18.0;
    canvas.text(&details(s), left, top, Anchor::Left, TextStyle::small(SOFT_INK));
    top += 22.0;
    if let Some(images) = &record.images {
        for (k, (_, image)) in images.iter().enumerate() {
            let at = x + GAP + k as u32 * (IMAGE_WIDTH + GAP);
            thumbnail(canvas, image, at, top as u32);
        }
    }
    top += f64::from(IMAGE_HEIGHT + GAP);
    if let Some(trace) = &record.trace {
        let area =
            Area { x: left, y: top, width: f64::from(TILE_WIDTH - 2 * GAP), height: f64::from(CURVE_HEIGHT) };
        let slip = s.slip_time_s.zip(s.max_pull_force_n);
        pull_curve(canvas, area, &Curve { trace, slip, full: false });
    }
}

/// One line: which sample, and its label.
pub(super) fn heading(s: &Sample) -> String {
    let label = match (s.status(), s.max_pull_force_n) {
        (Status::Slipped, Some(force)) => format!("slips at {force:.2} N"),
        (Status::Censored, Some(force)) => format!("held {force:.2} N (censored)"),
        (Status::Suspect, Some(force)) => format!("{force:.2} N (suspect)"),
        (status, _) => status_name(status).replace('_', " "),
    };
    format!("{}  {}  {label}", s.index, s.part)
}

/// One line: how it was gripped.
pub(super) fn details(s: &Sample) -> String {
    if s.status() == Status::Suspect {
        return s.status_reason.chars().take(58).collect();
    }
    if s.status() == Status::Failed {
        return s.failure.chars().take(58).collect();
    }
    format!(
        "grip {} with {:.0} N, {:.0}\u{b0}, offset {:.1} mm",
        s.grip_pose, s.grip_force_n, s.grip_angle_deg, s.grip_offset_mm
    )
}

/// An image shrunk (or stretched) to the size of a tile's half, by averaging.
fn thumbnail(canvas: &mut Canvas, image: &gripgen_twin::TactileImage, x: u32, y: u32) {
    let (sx, sy) = (
        f64::from(image.width_px) / f64::from(IMAGE_WIDTH),
        f64::from(image.height_px) / f64::from(IMAGE_HEIGHT),
    );
    for row in 0..IMAGE_HEIGHT {
        for column in 0..IMAGE_WIDTH {
            let span = |i: u32, s: f64, n: u32| {
                let from = (f64::from(i) * s) as u32;
                let to = ((f64::from(i + 1) * s).ceil() as u32).clamp(from + 1, n);
                from.min(n - 1)..to
            };
            let mut sum = [0u32; 3];
            let mut count = 0;
            for v in span(row, sy, image.height_px) {
                for u in span(column, sx, image.width_px) {
                    let pixel = image.pixel(u, v);
                    (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
                    count += 1;
                }
            }
            let [r, g, b] = sum.map(|s| (s / count) as u8);
            canvas.put(x + column, y + row, super::Rgb(r, g, b));
        }
    }
}
