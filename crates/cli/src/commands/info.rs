//! `gripgen info`: what a run folder holds, or a folder of measured pulls.

use crate::args::InfoArgs;
use crate::commands::{info_pulls, open_run};
use crate::failure::Failure;
use crate::output::{JsonSink, count, print, size};
use crate::outputs::Outputs;
use gripgen::identify::levels;
use gripgen::is_pulls;
use gripgen::record::{INDEX_COLUMNS, RIG_SOURCE};
use serde_json::json;
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
    let mut outputs = Outputs::of("info", args.json.force).reads(&args.run);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    if !args.run.join("run.json").is_file() && is_pulls(&args.run) {
        return info_pulls::run(args, sink);
    }
    let folder = open_run(&args.run)?;
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
    let by_level: BTreeMap<_, _> = parts.iter().map(|(name, p)| (name.clone(), levels(&p.slipped))).collect();
    let missing = info.samples.saturating_sub(done);
    if sink.wanted() {
        let by_part: BTreeMap<_, _> = parts
            .iter()
            .map(|(name, p)| {
                let value = json!({
                    "samples": p.samples, "mean_max_pull_force_n": p.mean_n(),
                    "low_n": p.low_n, "high_n": p.high_n,
                    "levels": info_pulls::levels_json(&by_level[name]),
                });
                (name, value)
            })
            .collect();
        sink.document(&json!({
            "schema": "gripgen.info/1", "name": info.name, "source": info.source,
            "gripgen_version": info.gripgen_version, "config_sha256": info.config_sha256,
            "samples": info.samples, "done": done, "missing": missing, "failed": failed,
            "shards": info.shards, "shards_done": shards, "bytes": bytes,
            "status": statuses, "parts": by_part,
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
    text += &format!("{}\n\n", counts.join(", "));
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
    text += &info_pulls::levels_table(&by_level);
    print(&text)?;
    Ok(0)
}
