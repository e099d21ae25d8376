//! The contact sheet: a few samples of a run at a glance.

use super::canvas::{Anchor, Canvas, Rgb, TextStyle, averaged};
use super::colours::{FAILED, INK, PANEL, PAPER, SOFT_INK};
use super::plot::{Area, Curve, pull_curve};
use crate::text::{spread, wrapped};
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
/// Characters of a line in a tile.
const LINE: usize = 58;

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
    let title = format!("{}: {} sample{}", info.name, info.samples, if info.samples == 1 { "" } else { "s" });
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

/// Samples that [`contact_sheet`] shows: parts in turn, and of each part labels from small to large; then samples that failed.
///
/// # Errors
///
/// A run that cannot be read.
pub fn contact_sheet_samples(folder: &RunFolder) -> Result<Vec<u64>, FolderError> {
    let at = |name: &str| INDEX_COLUMNS.iter().position(|c| *c == name).unwrap_or(0);
    let (part, label) = (at("part"), at("max_pull_force_n"));
    let mut by_part: BTreeMap<String, Vec<(f64, u64)>> = BTreeMap::new();
    let (mut failed, mut read) = (Vec::new(), 0);
    for shard in 0..folder.info().shards {
        let Some(sidecar) = folder.finished(shard)? else { continue };
        for (row, index) in sidecar.rows.iter().zip(sidecar.first_sample..) {
            // Whatever has no label failed.
            match row[label].parse() {
                Ok(label) => by_part.entry(row[part].clone()).or_default().push((label, index)),
                Err(_) => failed.push(index),
            }
        }
        read += sidecar.rows.len();
        // Enough to choose from, also in a run of a billion samples.
        if read > 100_000 {
            break;
        }
    }
    Ok(chosen(by_part, &failed))
}

/// Labelled samples by part, and failed ones behind them: a row of the sheet, or as much as the others leave.
fn chosen(mut by_part: BTreeMap<String, Vec<(f64, u64)>>, failed: &[u64]) -> Vec<u64> {
    let room = COLUMNS * ROWS;
    let labelled: usize = by_part.values().map(Vec::len).sum();
    let of_failed = failed.len().min(COLUMNS.max(room.saturating_sub(labelled)));
    let per_part = (room - of_failed).div_ceil(by_part.len().max(1));
    let mut chosen = Vec::new();
    for samples in by_part.values_mut() {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        chosen.extend(spread(samples, per_part).map(|sample| sample.1));
    }
    chosen.truncate(room - of_failed);
    chosen.extend(spread(failed, of_failed));
    chosen
}

fn tile(canvas: &mut Canvas, x: u32, y: u32, record: &Record) {
    let s = &record.sample;
    canvas.rect(f64::from(x), f64::from(y), f64::from(TILE_WIDTH), f64::from(TILE_HEIGHT), PANEL);
    let (left, mut top) = (f64::from(x + GAP), f64::from(y + GAP / 2));
    let ink = if s.status() == Status::Failed { FAILED } else { INK };
    canvas.text(&heading(s), left, top, Anchor::Left, TextStyle { ink, large: false, bold: true });
    top += 18.0;
    // A failed sample has nothing but its reason, and the whole tile for it.
    let most = if s.status() == Status::Failed { usize::MAX } else { 1 };
    for (i, line) in wrapped(&details(s), LINE).iter().take(most).enumerate() {
        canvas.text(line, left, top + 18.0 * i as f64, Anchor::Left, TextStyle::small(SOFT_INK));
    }
    top += 22.0;
    if let Some(images) = &record.images {
        for (k, (_, image)) in images.iter().enumerate() {
            let at = x + GAP + k as u32 * (IMAGE_WIDTH + GAP);
            let small = averaged(image, (IMAGE_WIDTH, IMAGE_HEIGHT));
            for (y, x) in (0..IMAGE_HEIGHT).flat_map(|y| (0..IMAGE_WIDTH).map(move |x| (y, x))) {
                let [r, g, b] = small.pixel(x, y);
                canvas.put(at + x, top as u32 + y, Rgb(r, g, b));
            }
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
        return s.status_reason.clone();
    }
    if s.status() == Status::Failed {
        return s.failure.clone();
    }
    format!(
        "grip {} with {:.0} N, {:.0}\u{b0}, offset {:.1} mm",
        s.grip_pose, s.grip_force_n, s.grip_angle_deg, s.grip_offset_mm
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_come_last_and_take_a_row_at_most() {
        let part = |name: &str, from: u64, n: u64| {
            (name.to_string(), (from..from + n).map(|i| ((100 - i) as f64, i)).collect::<Vec<_>>())
        };
        let many: BTreeMap<_, _> = [part("a", 0, 20), part("b", 20, 20)].into();
        let failed: Vec<u64> = (40..60).collect();
        let sheet = chosen(many.clone(), &failed);
        assert_eq!((sheet.len(), &sheet[9..]), (12, &[40, 49, 59][..]));
        assert!(sheet[..9].iter().all(|i| *i < 40), "{sheet:?}");
        assert_eq!(chosen(many, &[]).len(), 12);
        // What has room is all there, the failures behind.
        assert_eq!(chosen([part("a", 0, 2)].into(), &failed[..5]), [1, 0, 40, 41, 42, 43, 44]);
        assert_eq!(chosen(BTreeMap::new(), &failed[..1]), [40]);
    }
}
