//! One pull: its images, its curve, everything that is known of it.

use super::expected::Expected;
use super::rows::Rows;
use crate::picture::canvas::averaged;
use crate::text::{clean, data_url};
use gripgen_record::{Dataset, DatasetError, encode_jpeg};
use gripgen_twin::{Jaw, PullTrace, TraceRow, Values, rounded};
use serde_json::{Value, json};
use std::fmt::Write;

/// Widest image of the page.
const WIDEST_PX: u32 = 320;
/// Quality of its JPEG: at 90 no level is off by more than a few.
const QUALITY: u8 = 90;
/// Points of a curve.
const POINTS: usize = 80;
/// Size of the drawn curve.
const WIDTH: f64 = 320.0;
const HEIGHT: f64 = 84.0;
/// Letters of a cell, and of a reason.
const CELL: usize = 80;
const REASON: usize = 300;

/// What the template is given of a row.
pub(super) fn card(
    dataset: &Dataset,
    rows: &Rows<'_>,
    expected: Option<Expected>,
    row: usize,
) -> Result<Value, DatasetError> {
    let images = dataset.images(row)?;
    let images: Vec<Value> = images
        .iter()
        .flat_map(|both| Jaw::BOTH.map(|jaw| (jaw, &both[jaw])))
        .filter_map(|(jaw, image)| {
            let by = image.width_px.div_ceil(WIDEST_PX).max(1);
            let small = averaged(image, (image.width_px / by, (image.height_px / by).max(1)));
            let jpeg = encode_jpeg(&small, QUALITY).ok()?;
            Some(json!({
                "jaw": jaw.to_string(), "url": data_url("jpeg", &jpeg), "width": small.width_px, "height": small.height_px,
            }))
        })
        .collect();
    let label = rows.label_n(row);
    let curve = dataset.trace(row)?.and_then(|trace| {
        let slip_s = rows.table.numbers("slip_time_s").map(|all| all[row]).filter(|t| t.is_finite());
        curve(&trace, slip_s, label)
    });
    let status = rows.status(row);
    let said = match status {
        "slipped" => format!("slips at {} N", rounded(label, &[])),
        "censored" => format!("held {} N", rounded(label, &[])),
        "suspect" if label.is_finite() => format!("{} N, suspect", rounded(label, &[])),
        other => other.replace('_', " "),
    };
    let force = rows.force_n(row);
    let gripped = if force.is_finite() { format!("{} N a jaw", rounded(force, &[])) } else { String::new() };
    let cells = rows.table.columns().iter().filter_map(|(name, values)| {
        let value = match values {
            Values::Numbers(x) => x[row].is_finite().then(|| x[row].to_string()),
            Values::Words(words) => Some(words[row].clone()).filter(|word| !word.is_empty()),
        };
        Some(json!({"name": clean(name, CELL), "value": clean(&value?, REASON)}))
    });
    Ok(json!({
        "row": row, "id": clean(&rows.id(row), CELL), "part": clean(rows.part(row), CELL),
        "grip": clean(&rows.grip(row), CELL), "status": clean(status, CELL),
        "force": finite(force), "label": finite(label), "said": said, "gripped": gripped,
        "reason": clean(rows.reason(row), REASON), "images": images, "curve": curve,
        "far": expected.map(|e| finite(e.deviations.abs())),
        "expected": expected.map(|e| format!(
            "expected {} N of this grip at this force: {} {}, {} standard deviations",
            rounded(e.label_n, &[]), rounded((label - e.label_n).abs(), &[]),
            if label < e.label_n { "N below" } else { "N above" }, rounded(e.deviations.abs(), &[]),
        )),
        "cells": cells.collect::<Vec<_>>(),
    }))
}

/// A number for an attribute of the page; nothing where there is none.
fn finite(x: f64) -> String {
    if x.is_finite() { x.to_string() } else { String::new() }
}

/// The pull as a small drawing: command, measured force, slip. Nothing of a trace without two rows.
fn curve(trace: &PullTrace, slip_s: Option<f64>, label_n: f64) -> Option<Value> {
    let step = trace.len().div_ceil(POINTS).max(1);
    let kept: Vec<_> = trace.rows().step_by(step).filter(|r| r.time_s.is_finite()).collect();
    let (first, last) = (kept.first()?.time_s, kept.last()?.time_s);
    let forces = kept.iter().flat_map(|r| [r.desired_force_n, r.measured_force_n]).filter(|f| f.is_finite());
    let (low, high) = forces.fold((0.0_f64, 0.0_f64), |(l, h), f| (l.min(f), h.max(f)));
    if last <= first || high <= low {
        return None;
    }
    let x = |t: f64| WIDTH * (t - first) / (last - first);
    let y = |f: f64| 2.0 + (HEIGHT - 4.0) * (high - f) / (high - low);
    let path = |of: fn(&TraceRow) -> f64| {
        let mut path = String::new();
        for row in kept.iter().filter(|row| of(row).is_finite()) {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{command}{:.1} {:.1}", x(row.time_s), y(of(row)));
        }
        path
    };
    let slip = slip_s.filter(|t| (first..=last).contains(t) && label_n.is_finite());
    Some(json!({
        "desired": path(|r| r.desired_force_n), "measured": path(|r| r.measured_force_n),
        "slip": slip.map(|t| format!("M{:.1} {:.1}h0", x(t), y(label_n))),
        "says": format!("{} s, up to {} N", rounded(last - first.min(0.0), &[]), rounded(high, &[])),
    }))
}
