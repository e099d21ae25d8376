//! Closes the loop on five real sessions of a force sensor, and writes `research/loop/force-sensor.md` with its plots anew.
//!
//! `cargo xtask research loop-force-sensor [FOLDER [OUT]]`. FOLDER holds `S1.txt` to `S5.txt` (Farajian et al.
//! 2020, MIT; `../shared/real/gripforce_two_sensors` where it is left out), OUT is `research/loop`. The tables made from
//! them lie in a temporary folder; none of the data is kept.

use crate::{StudyResult, arguments};
use gripgen_cli::{calibrate_sensor_table, diagnose_sensor_table};
use gripgen_identify::{Diagnosis, HeldOutError, Verdict};
use gripgen_measured::read_sensor_table;
use gripgen_report::Plot;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Session, rows in which the person pressed (from the authors' own script), and the held-out table of the data's README:
/// error of gain and offset, and the smallest one with its effect.
const SESSIONS: [(&str, usize, usize, f64, &str); 5] = [
    ("S1", 144, 844, 3.83, "none, 3.83"),
    ("S2", 490, 1050, 1.82, "creep, 1.65"),
    ("S3", 180, 880, 8.46, "quadratic 6.26, gain drift 6.56, drift 6.68"),
    ("S4", 450, 1165, 4.30, "gain drift, 3.80"),
    ("S5", 165, 650, 1.56, "quadratic, 1.37"),
];

const TEXT: &str = include_str!("loop_force_sensor.md");

pub fn run() -> StudyResult {
    let mut arguments = arguments();
    let folder = PathBuf::from(arguments.next().unwrap_or("../shared/real/gripforce_two_sensors".into()));
    let out = PathBuf::from(arguments.next().unwrap_or("research/loop".into()));
    std::fs::create_dir_all(out.join("images"))?;
    let work = std::env::temp_dir().join(format!("gripgen-loop-{}", std::process::id()));
    let result = write_page(&folder, &out, &work);
    std::fs::remove_dir_all(&work).ok();
    result
}

fn write_page(folder: &Path, out: &Path, work: &Path) -> Result<(), Box<dyn Error>> {
    let (mut rows, mut details) = (String::new(), String::new());
    for (name, from, to, before_n, best) in SESSIONS {
        let text = std::fs::read_to_string(folder.join(format!("{name}.txt")))?;
        let made = work.join(name);
        std::fs::create_dir_all(&made)?;
        std::fs::write(made.join("sensor.csv"), table(&text, from, to)?)?;
        let table = read_sensor_table(&made)?;
        let scale = 1.0 / calibrate_sensor_table(&table)?.sessions[0].gain.value.abs();
        let diagnosed = diagnose_sensor_table(&table);
        rows += &row(name, before_n, best, &diagnosed.diagnosis, scale);
        writeln!(details, "\n### {name}\n")?;
        for line in diagnosed.diagnosis.plain.iter().chain(&diagnosed.diagnosis.notes) {
            writeln!(details, "* {}", line.trim_end_matches('.'))?;
        }
        writeln!(details, "\n| candidate | held-out gain | standard error | held-out error, N | fate |")?;
        writeln!(details, "|---|---|---|---|---|")?;
        for e in &diagnosed.report.evidence {
            let error_n = e.heldout_error * scale;
            let (gain, spread) = (e.heldout_gain, e.standard_error);
            writeln!(details, "| {} | {gain:.1} | {spread:.1} | {error_n:.2} | {} |", e.name, e.fate)?;
        }
        let plots = diagnosed.report.groups.first().map_or(&[][..], |g| &g.plots);
        let file = format!("images/force-sensor-{name}.svg");
        std::fs::write(out.join(&file), picture(plots, scale))?;
        writeln!(details, "\n![residuals of {name} before and after]({file})")?;
    }
    let page = TEXT.replace("{rows}", rows.trim_end()).replace("{details}", details.trim());
    std::fs::write(out.join("force-sensor.md"), page)?;
    println!("{rows}\n{}", out.join("force-sensor.md").display());
    Ok(())
}

/// `sensor.csv` of a session: column 1 is the time, column 20 the outer sensor (its size), column 13 the inner one, from
/// its first value on and turned round, so that pressing counts up.
fn table(text: &str, from: usize, to: usize) -> Result<String, Box<dyn Error>> {
    let row = |line: &str| -> Option<[f64; 3]> {
        let cells: Vec<f64> = line.split_whitespace().map_while(|c| c.parse().ok()).collect();
        Some([*cells.first()?, *cells.get(19)?, *cells.get(12)?])
    };
    let rows: Vec<[f64; 3]> = text.lines().skip(from).take(to + 1 - from).filter_map(row).collect();
    let first = rows.first().ok_or("a session without rows")?[2];
    let mut csv = String::from("time_s,reference_force_n,measured_force_n\n");
    for [time_s, reference, inner] in rows {
        writeln!(csv, "{time_s},{},{}", reference.abs(), first - inner)?;
    }
    Ok(csv)
}

fn row(name: &str, before_n: f64, best: &str, diagnosis: &Diagnosis, scale: f64) -> String {
    let effects = diagnosis.effects.iter().map(|e| {
        let rivals = e.indistinguishable_from.iter().map(|r| format!(" = {} ({:.2})", r.name, r.weight));
        format!("{} ({:.2}){}", e.name, e.weight, rivals.collect::<String>())
    });
    let mut answer: Vec<String> = effects.collect();
    answer.extend(diagnosis.unknown.iter().map(|u| format!("unknown: {}", u.covariate)));
    if diagnosis.verdict == Verdict::None {
        answer.push("none".into());
    }
    let show = |e: &HeldOutError| {
        let [value, low, high] = [e.rmse_n.unwrap_or_default(), e.low90, e.high90].map(|x| x * scale);
        format!("{value:.2} ({low:.2} to {high:.2})")
    };
    let (before, after) =
        diagnosis.error.as_ref().map_or_else(Default::default, |e| (show(&e.before), show(&e.after)));
    format!("| {name} | {} | {before} | {after} | {before_n:.2} | {best} |\n", answer.join("; "))
}

/// Residuals before (grey) and after (blue) as points, one panel a plot, in newtons of the reference.
fn picture(plots: &[Plot], scale: f64) -> String {
    const WIDTH: f64 = 300.0;
    const HEIGHT: f64 = 180.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"11\">\n",
        WIDTH * plots.len() as f64,
        HEIGHT + 40.0
    );
    for (k, plot) in plots.iter().enumerate() {
        let points = || plot.series.iter().flat_map(|s| &s.points);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (left, right) = range(&mut points().map(|p| p.0));
        let (bottom, top) = range(&mut points().map(|p| p.1 * scale));
        let x0 = WIDTH * k as f64 + 34.0;
        let x = |v: f64| x0 + (v - left) / (right - left).max(1e-12) * (WIDTH - 44.0);
        let y = |v: f64| 10.0 + (top - v) / (top - bottom).max(1e-12) * HEIGHT;
        let (end, floor) = (x0 + WIDTH - 44.0, 10.0 + HEIGHT);
        svg += &format!("<path d=\"M{x0} 10V{floor}H{end}\" fill=\"none\" stroke=\"#444\"/>\n");
        svg += &format!("<path d=\"M{x0} {0:.1}H{end}\" stroke=\"#bbb\"/>\n", y(0.0));
        for (value, at) in [(top, 18.0), (bottom, floor)] {
            svg += &format!("<text x=\"{}\" y=\"{at}\" text-anchor=\"end\">{value:.1}</text>\n", x0 - 3.0);
        }
        let below = floor + 14.0;
        svg += &format!("<text x=\"{x0}\" y=\"{below}\">{left:.0}</text>\n");
        svg += &format!("<text x=\"{end}\" y=\"{below}\" text-anchor=\"end\">{right:.0}</text>\n");
        let middle = (x0 + end) / 2.0;
        svg += &format!(
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
            below + 14.0,
            plot.x_label
        );
        for (series, colour) in plot.series.iter().zip(["#999", "#1565c0"]) {
            let mut path = String::new();
            for (px, py) in series.points.iter().step_by(series.points.len().div_ceil(250)) {
                path += &format!("M{:.0} {:.0}h1", x(*px), y(py * scale));
            }
            svg += &format!(
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"2\"><title>{}</title></path>\n",
                series.name
            );
        }
    }
    svg + "</svg>\n"
}
