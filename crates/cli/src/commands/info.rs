//! `gripgen info`: what a run folder holds, or a folder of measured pulls.

use crate::args::InfoArgs;
use crate::failure::Failure;
use crate::load::{jobs, no_pulls, say_warnings};
use crate::output::{JsonSink, count, print, size};
use crate::outputs::Outputs;
use crate::{LabelShares, label_shares};
use gripgen::Project;
use gripgen::record::{INDEX_COLUMNS, RIG_SOURCE, RunFolder};
use gripgen_identify::{Level, levels};
use gripgen_measured::{PULLS_FILE, is_pulls, load_pulls_of};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Labels of a part.
#[derive(Default)]
struct PartSummary {
    samples: u64,
    labels: u64,
    sum_n: f64,
    low_n: Option<f64>,
    high_n: Option<f64>,
    /// Grip force and label of the pulls that slipped: the label of another is a bound, or none.
    slipped: Vec<(f64, f64)>,
}

impl PartSummary {
    fn add(&mut self, label: Option<f64>) {
        self.samples += 1;
        if let Some(label) = label {
            self.labels += 1;
            self.sum_n += label;
            self.low_n = Some(self.low_n.map_or(label, |x| x.min(label)));
            self.high_n = Some(self.high_n.map_or(label, |x| x.max(label)));
        }
    }

    fn mean_n(&self) -> Option<f64> {
        (self.labels > 0).then(|| self.sum_n / self.labels as f64)
    }
}

/// Runs the verb.
pub fn run(args: &InfoArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads(&args.run);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    if !args.run.join("run.json").is_file() && is_pulls(&args.run) {
        return pulls(args, sink);
    }
    let folder = RunFolder::open(&args.run)?;
    let info = folder.info();
    let at = |name: &str| INDEX_COLUMNS.iter().position(|c| *c == name).unwrap_or(0);
    let (status, part, label) = (at("status"), at("part"), at("max_pull_force_n"));
    let force = at("grip_force_n");
    let mut statuses: BTreeMap<String, u64> = BTreeMap::new();
    let mut parts: BTreeMap<String, PartSummary> = BTreeMap::new();
    let (mut done, mut failed, mut shards, mut bytes) = (0, 0, 0, 0);
    for shard in 0..info.shards {
        let Some(sidecar) = folder.finished(shard)? else { continue };
        shards += 1;
        done += sidecar.samples;
        failed += sidecar.failed;
        bytes += sidecar.bytes;
        for row in &sidecar.rows {
            *statuses.entry(row[status].clone()).or_default() += 1;
            // A suspect label is none to average.
            let label_n = row[label].parse().ok().filter(|_| row[status] != "suspect");
            let summary = parts.entry(row[part].clone()).or_default();
            summary.add(label_n);
            if let ("slipped", Ok(force_n), Some(label_n)) =
                (row[status].as_str(), row[force].parse(), label_n)
            {
                summary.slipped.push((force_n, label_n));
            }
        }
    }
    let by_level = levels_of(&parts);
    let missing = info.samples.saturating_sub(done);
    // A run of another version, or of a rig, has no draws to exchange.
    let project = (info.source != RIG_SOURCE).then(|| Project::from_run(&folder).ok()).flatten();
    let told = sink.wanted() || !args.talk.quiet;
    let shares = project.filter(|_| told).and_then(|project| label_shares(&project, jobs()));
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.info/1", "name": info.name, "source": info.source,
            "gripgen_version": info.gripgen_version, "config_sha256": info.config_sha256,
            "samples": info.samples, "done": done, "missing": missing, "failed": failed,
            "shards": info.shards, "shards_done": shards, "bytes": bytes,
            "status": statuses, "parts": parts_json(&parts, &by_level),
            "label_shares": shares.as_ref().map(LabelShares::json),
        }))?;
        if sink.on_stdout() {
            return Ok(0);
        }
    }
    if args.talk.quiet {
        return Ok(0);
    }
    let mut text = format!("{} ({}), made by gripgen {}\n", info.name, info.source, info.gripgen_version);
    text += &format!("configuration {}\n", &info.config_sha256[..16.min(info.config_sha256.len())]);
    text += &match info.source == RIG_SOURCE {
        true => {
            format!(
                "{done} of {}, {missing} missing, {failed} failed, {}\n",
                count(info.samples, "pull"),
                size(bytes)
            )
        }
        false => {
            let bytes = size(bytes);
            format!(
                "{done} of {}, {shards} of {}, {bytes}\n",
                count(info.samples, "sample"),
                count(info.shards, "shard")
            )
        }
    };
    let counts: Vec<String> = statuses.iter().map(|(name, n)| format!("{n} {name}")).collect();
    text += &format!("{}\n", counts.join(", "));
    shares.iter().for_each(|shares| text += &format!("{shares}\n"));
    text += "\n";
    text += &format!("{:<20} {:>8} {:>24}\n", "part", "samples", "max_pull_force_n");
    text += &format!("{:<20} {:>8} {:>8} {:>7} {:>7}\n", "", "", "mean", "low", "high");
    if args.talk.verbose {
        text += &format!("{}\n", info.config_toml);
    }
    let number = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.2}"));
    for (name, p) in &parts {
        let (mean, low, high) = (number(p.mean_n()), number(p.low_n), number(p.high_n));
        text += &format!("{name:<20} {:>8} {mean:>8} {low:>7} {high:>7}\n", p.samples);
    }
    text += &levels_table(&by_level);
    print(&text)?;
    Ok(0)
}

/// A folder with pulls.csv, or bags of ROS 2.
fn pulls(args: &InfoArgs, mut sink: JsonSink) -> Result<u8, Failure> {
    let folder = [args.run.as_path()];
    let loaded = load_pulls_of(&folder).map_err(|e| no_pulls(&folder, &e))?;
    say_warnings(&loaded, &args.talk);
    let measured = &loaded.pulls;
    let mut parts: BTreeMap<String, PartSummary> = BTreeMap::new();
    for pull in &measured.pulls {
        let summary = parts.entry(pull.part.clone()).or_default();
        summary.add(Some(pull.max_pull_force_n));
        summary.slipped.push((pull.grip_force_n, pull.max_pull_force_n));
    }
    let by_level = levels_of(&parts);
    let traces = measured.pulls.iter().filter(|p| p.trace.is_some()).count();
    let extra: Vec<&str> = measured.extra.iter().map(|e| e.name.as_str()).collect();
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.info/1", "source": PULLS_FILE, "samples": measured.pulls.len(), "traces": traces,
            "recorded": measured.recorded, "further_columns": extra, "missing_cells": loaded.missing.counts(), "sha256": measured.sha256,
            "label_tolerance_n": measured.label_tolerance_n, "stop_mm": 1e3 * measured.stop_m,
            "parts": parts_json(&parts, &by_level),
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
    print(&(text + &levels_table(&by_level)))?;
    loaded.notes.iter().for_each(|note| eprintln!("note: {note}"));
    Ok(0)
}

fn levels_of(parts: &BTreeMap<String, PartSummary>) -> BTreeMap<String, Vec<Level>> {
    parts.iter().map(|(name, part)| (name.clone(), levels(&part.slipped))).collect()
}

/// The parts as they stand in `--json`.
fn parts_json(parts: &BTreeMap<String, PartSummary>, by_level: &BTreeMap<String, Vec<Level>>) -> Value {
    let part = |(name, p): (&String, &PartSummary)| {
        let value = json!({
            "samples": p.samples, "mean_max_pull_force_n": p.mean_n(), "low_n": p.low_n, "high_n": p.high_n,
            "levels": levels_json(&by_level[name]),
        });
        (name.clone(), value)
    };
    Value::Object(parts.iter().map(part).collect())
}

/// Mean and RMS of each grip force, as they stand in `--json`.
fn levels_json(levels: &[Level]) -> Value {
    let each = levels.iter().map(|l| {
        json!({
            "grip_force_n": l.grip_force_n, "from_n": l.span_n.0, "to_n": l.span_n.1, "n": l.rows.len(),
            "mean_n": l.mean_n, "rms_n": l.rms_n, "low_n": l.low_n, "high_n": l.high_n,
        })
    });
    each.collect::<Vec<_>>().into()
}

/// The same as a table, for the parts in order.
fn levels_table(parts: &BTreeMap<String, Vec<Level>>) -> String {
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
