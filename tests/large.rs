//! The images of the large set carry information about its labels.

use crate::common::project;
use gripgen::generate;
use gripgen::tactile::SimdLevel;
use gripgen::twin::Outcome;
use std::collections::BTreeMap;

/// Residual variance of `y` after a cubic in `x`, by least squares on orthogonal polynomials of the sample.
fn left_after_cubic(points: &[(f64, f64)]) -> f64 {
    let n = points.len();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for power in 0..4 {
        let mut column: Vec<f64> = points.iter().map(|(x, _)| (x / 80.0).powi(power)).collect();
        for b in &basis {
            let along: f64 = column.iter().zip(b).map(|(c, b)| c * b).sum();
            column.iter_mut().zip(b).for_each(|(c, b)| *c -= along * b);
        }
        let norm = column.iter().map(|c| c * c).sum::<f64>().sqrt();
        column.iter_mut().for_each(|c| *c /= norm);
        basis.push(column);
    }
    let mut rest: Vec<f64> = points.iter().map(|(_, y)| *y).collect();
    for b in &basis {
        let along: f64 = rest.iter().zip(b).map(|(r, b)| r * b).sum();
        rest.iter_mut().zip(b).for_each(|(r, b)| *r -= along * b);
    }
    rest.iter().map(|r| r * r).sum::<f64>() / n as f64
}

/// Share of the label's variance that part and grip force leave open.
fn share_left(sets: &[&str]) -> f64 {
    let mut all = vec!["samples=2000", "images=none"];
    all.extend(sets);
    let p = project("asset:configs/large.toml", &all);
    let mut by_part: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    let mut labels = Vec::new();
    for index in 0..p.sweep.samples {
        let sample = generate(&p, index, SimdLevel::best());
        let label = match sample.outcome {
            Outcome::Pulled(pulled) => pulled.label.max_pull_force_n,
            Outcome::NoContact { .. } => continue,
            Outcome::Failed { reason } => panic!("{reason}"),
        };
        labels.push(label);
        by_part.entry(sample.scenario.part).or_default().push((sample.scenario.grip_force_n, label));
    }
    let n = labels.len() as f64;
    let mean = labels.iter().sum::<f64>() / n;
    let variance = labels.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n;
    let left: f64 = by_part.values().map(|points| left_after_cubic(points) * points.len() as f64 / n).sum();
    left / variance
}

/// At least a fifth of the label's variance is not in (part, grip force), and most of that is geometry that the camera
/// sees, not scatter that it does not.
#[test]
fn part_and_grip_force_do_not_tell_the_label() {
    let left = share_left(&[]);
    let quiet: Vec<String> = ["ball_bearing", "long_shaft", "gear", "roller_bearing"]
        .map(|part| format!("parts.{part}.scatter=0"))
        .into_iter()
        .chain(["wrist.noise_n=0".to_string()])
        .collect();
    let seen = share_left(&quiet.iter().map(String::as_str).collect::<Vec<_>>());
    println!(
        "label variance left after (part, grip force): {:.1} %, without scatter and noise {:.1} %",
        100.0 * left,
        100.0 * seen
    );
    assert!(left > 0.2, "{left}");
    assert!(seen > 0.8 * left, "{seen} of {left}");
}
