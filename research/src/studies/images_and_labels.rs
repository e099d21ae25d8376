//! What the images of the shipped sets tell of their labels: the table of docs/training.md.
//!
//! `cargo xtask research images-and-labels` takes some minutes.

use crate::StudyResult;
use gripgen::tactile::SimdLevel;
use gripgen::twin::Outcome;
use gripgen::{Location, Project, generate};
use std::error::Error;

/// A sample as a predictor sees it.
struct Row {
    part: String,
    pose: usize,
    force_n: f64,
    label_n: f64,
    /// Means of 20 x 20 pixels of each channel of both images.
    seen: Vec<f64>,
}

fn rows(config: &str, samples: u64) -> Result<Vec<Row>, Box<dyn Error>> {
    let samples = samples.to_string();
    let sets =
        [("design", "random"), ("mechanics", "reduced"), ("trace", "none"), ("samples", samples.as_str())];
    let project =
        Project::load(&Location::parse(config), &sets.map(|(k, v)| (k.to_string(), v.to_string())))?;
    let mut rows = Vec::new();
    for index in 0..project.sweep.samples {
        let sample = generate(&project, index, SimdLevel::best());
        let pulled = match sample.outcome {
            Outcome::Pulled(pulled) => pulled,
            Outcome::NoContact { .. } => continue,
            Outcome::Failed { reason } => return Err(reason.into()),
        };
        let mut seen = Vec::new();
        for (_, image) in pulled.images.iter().flat_map(|images| images.iter()) {
            for (x0, y0) in (0..16).flat_map(|x| (0..12).map(move |y| (20 * x, 20 * y))) {
                let mut sum = [0.0; 3];
                for (x, y) in (x0..x0 + 20).flat_map(|x| (y0..y0 + 20).map(move |y| (x, y))) {
                    sum.iter_mut().zip(image.pixel(x, y)).for_each(|(s, v)| *s += f64::from(v) / 400.0);
                }
                seen.extend(sum);
            }
        }
        rows.push(Row {
            part: sample.scenario.part,
            pose: sample.scenario.grip_pose,
            force_n: sample.scenario.grip_force_n,
            label_n: pulled.label.max_pull_force_n,
            seen,
        });
    }
    Ok(rows)
}

fn variance(rows: &[Row]) -> f64 {
    let n = rows.len() as f64;
    let mean = rows.iter().map(|r| r.label_n).sum::<f64>() / n;
    rows.iter().map(|r| (r.label_n - mean).powi(2)).sum::<f64>() / n
}

/// Share of the labels' variance of the last quarter of `rows` that a ridge regression on the others leaves open. It is
/// given part, pose if `posed`, a cubic in the grip force for each, and the images if `sighted`.
fn left_after_ridge(rows: &[Row], posed: bool, sighted: bool) -> f64 {
    let mut groups: Vec<(&str, usize)> =
        rows.iter().map(|r| (r.part.as_str(), r.pose * usize::from(posed))).collect();
    let own = groups.clone();
    groups.sort_unstable();
    groups.dedup();
    let features = |i: usize| {
        let row = &rows[i];
        let here = groups.iter().map(|g| f64::from(u8::from(*g == own[i])));
        let cubic = here.flat_map(|on| (0..4).map(move |k| on * (row.force_n / 40.0).powi(k)));
        let mut all: Vec<f64> = cubic.collect();
        if sighted {
            all.extend(row.seen.iter().map(|v| v / 30.0));
            all.extend(row.seen.iter().map(|v| v / 30.0 * row.force_n / 40.0));
        }
        all
    };
    let train = rows.len() * 3 / 4;
    let width = features(0).len();
    let made: Vec<Vec<f64>> = (0..rows.len()).map(features).collect();
    let x = nalgebra::DMatrix::from_fn(train, width, |i, j| made[i][j]);
    let y = nalgebra::DVector::from_fn(train, |i, _| rows[i].label_n);
    let (gram, moment) = (x.tr_mul(&x), x.tr_mul(&y));
    let held = &rows[train..];
    let mut best = f64::INFINITY;
    for ridge in [1e-3, 0.1, 1.0, 10.0] {
        let mut own = gram.clone();
        (0..width).for_each(|j| own[(j, j)] += if j < 4 * groups.len() { 1e-6 } else { ridge });
        let weights = own.cholesky().expect("the ridge makes it positive").solve(&moment);
        let error = |i: usize| {
            made[train + i].iter().zip(weights.iter()).map(|(a, b)| a * b).sum::<f64>() - held[i].label_n
        };
        let left =
            (0..held.len()).map(|i| error(i).powi(2)).sum::<f64>() / held.len() as f64 / variance(held);
        best = best.min(left);
    }
    best
}

pub fn run() -> StudyResult {
    for config in ["asset:configs/quickstart.toml", "asset:configs/training.toml"] {
        let rows = rows(config, 4000)?;
        for (name, posed, sighted) in [
            ("part, F_G", false, false),
            ("part, pose, F_G", true, false),
            ("part, F_G, images", false, true),
            ("part, pose, F_G, images", true, true),
        ] {
            println!("{config}: {name}: {:.1} % left", 100.0 * left_after_ridge(&rows, posed, sighted));
        }
    }
    Ok(())
}
