//! `gripgen info` of pulls: labels over grip force, and folders with pulls.csv.

use crate::args::InfoArgs;
use crate::failure::Failure;
use crate::load::{no_pulls, say_warnings};
use crate::output::{JsonSink, count, print};
use gripgen::identify::{Level, levels};
use gripgen::load_pulls_of;
use gripgen::record::{PULLS_FILE, ROSBAG_FILE};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Mean and RMS of each grip force, as they stand in `--json`.
pub fn levels_json(levels: &[Level]) -> Value {
    let each = levels.iter().map(|l| {
        json!({
            "grip_force_n": l.grip_force_n, "from_n": l.span_n.0, "to_n": l.span_n.1, "n": l.rows.len(),
            "mean_n": l.mean_n, "rms_n": l.rms_n, "low_n": l.low_n, "high_n": l.high_n,
        })
    });
    each.collect::<Vec<_>>().into()
}

/// The same as a table, for the parts in order.
pub fn levels_table(parts: &BTreeMap<String, Vec<Level>>) -> String {
    let mut text = format!(
        "\n{:<20} {:>15} {:>6} {:>8} {:>7} {:>7} {:>7}\n",
        "part", "grip_force_n", "pulls", "mean", "RMS", "low", "high"
    );
    for (name, level) in parts.iter().flat_map(|(name, levels)| levels.iter().map(move |l| (name, l))) {
        let (low, high) = level.span_n;
        let force = match low == high {
            true => format!("{low}"),
            false => format!("{low:.2} to {high:.2}"),
        };
        text += &format!(
            "{name:<20} {force:>15} {:>6} {:>8.3} {:>7.3} {:>7.3} {:>7.3}\n",
            level.rows.len(),
            level.mean_n,
            level.rms_n,
            level.low_n,
            level.high_n
        );
    }
    text
}

/// A folder with pulls.csv, or bags of ROS 2.
pub fn run(args: &InfoArgs, mut sink: JsonSink) -> Result<u8, Failure> {
    let folder = [args.run.as_path()];
    let loaded = load_pulls_of(&folder).map_err(|e| no_pulls(&folder, &e))?;
    say_warnings(&loaded, &args.talk);
    let measured = &loaded.pulls;
    let mut labels: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for pull in &measured.pulls {
        labels.entry(pull.part.clone()).or_default().push((pull.grip_force_n, pull.max_pull_force_n));
    }
    let parts: BTreeMap<String, Vec<Level>> =
        labels.iter().map(|(name, labels)| (name.clone(), levels(labels))).collect();
    let traces = measured.pulls.iter().filter(|p| p.trace.is_some()).count();
    let extra: Vec<&str> = measured.extra.iter().map(|e| e.name.as_str()).collect();
    let table = args.run.join(PULLS_FILE).is_file();
    let source = if table { PULLS_FILE } else { ROSBAG_FILE };
    if sink.wanted() {
        let part = |(name, labels): (&String, &Vec<(f64, f64)>)| {
            let each = || labels.iter().map(|l| l.1);
            let value = json!({
                "samples": labels.len(), "mean_max_pull_force_n": each().sum::<f64>() / labels.len() as f64,
                "low_n": each().fold(f64::INFINITY, f64::min), "high_n": each().fold(f64::NEG_INFINITY, f64::max),
                "levels": levels_json(&parts[name]),
            });
            (name.clone(), value)
        };
        sink.document(&json!({
            "schema": "gripgen.info/1", "source": source, "samples": measured.pulls.len(), "traces": traces,
            "recorded": measured.recorded, "further_columns": extra, "sha256": measured.sha256,
            "label_tolerance_n": measured.label_tolerance_n, "stop_mm": 1e3 * measured.stop_m,
            "parts": labels.iter().map(part).collect::<serde_json::Map<_, _>>(),
        }))?;
        if sink.on_stdout() {
            return Ok(0);
        }
    }
    if args.talk.quiet {
        return Ok(0);
    }
    let mut text = format!("{}, {traces} with a trace\n", count(measured.pulls.len() as u64, "pull"));
    text += &format!("recorded: {}\n", measured.recorded.join(", "));
    if !extra.is_empty() {
        text += &format!("further columns: {}\n", extra.join(", "));
    }
    print(&(text + &levels_table(&parts)))?;
    loaded.notes.iter().for_each(|note| eprintln!("note: {note}"));
    Ok(0)
}
