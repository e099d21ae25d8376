//! The wrist sensor of the shipped twin against logs of a real UR arm.

use crate::common::{project, root};

/// Time and z force of a log.
fn log(path: &std::path::Path) -> Vec<(f64, f64)> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map_while(|c| c.trim().parse().ok()).collect();
        Some((*cells.first()?, *cells.get(3)?))
    };
    text.lines().skip(1).filter_map(row).collect()
}

/// Mean time, mean force and standard deviation of windows of 2 s.
fn windows(log: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
    let rate_hz = (log.len() - 1) as f64 / (log[log.len() - 1].0 - log[0].0);
    log.chunks_exact((2.0 * rate_hz) as usize)
        .map(|w| {
            let n = w.len() as f64;
            let (time, mean) = (w[w.len() / 2].0, w.iter().map(|r| r.1).sum::<f64>() / n);
            let variance = w.iter().map(|r| (r.1 - mean).powi(2)).sum::<f64>() / n;
            (time, mean, variance.sqrt())
        })
        .collect()
}

/// The shipped noise lies between the quietest stretches of the logs, and over the seconds of a pull a resting arm
/// drifts by less than that noise: the sensor is zeroed before each pull, and `sensor_drift` is an effect, not baseline.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn noise_and_drift_are_those_of_recorded_forces() {
    let mut quietest: Vec<f64> = Vec::new();
    let mut drifts: Vec<f64> = Vec::new();
    let mut files: Vec<_> = std::fs::read_dir(root().join("../shared/real/ur_rtde_force"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    for file in &files {
        let windows = windows(&log(file));
        quietest.push(windows.iter().map(|w| w.2).fold(f64::INFINITY, f64::min));
        let quiet: Vec<_> = windows.iter().filter(|w| w.2 < 0.2).collect();
        drifts.extend(quiet.windows(3).filter(|w| w[2].0 - w[0].0 < 6.0).map(|w| (w[2].1 - w[0].1).abs()));
    }
    let (low, high) = quietest.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &s| (l.min(s), h.max(s)));
    drifts.sort_by(f64::total_cmp);
    let median = drifts[drifts.len() / 2];
    let noise_n = project("asset:configs/quickstart.toml", &[]).twin.wrist.noise_n;
    println!(
        "quietest stretches {low:.3}..{high:.3} N, median drift over 4 s {median:.3} N, shipped noise {noise_n} N"
    );
    assert!((low..=high).contains(&noise_n), "{noise_n} N against {low}..{high} N");
    assert!(median < noise_n, "{median} N over 4 s");
}
