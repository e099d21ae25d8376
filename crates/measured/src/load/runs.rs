//! Measured pulls from a run folder.

use super::left_out::LeftOut;
use super::suspects::{self, Suspects};
use super::traces::{fewer_traces, thinned};
use super::{LoadPullsError, LoadedPulls, zero};
use crate::pulls::{MissingCells, SAY_NOTHING, fill_missing};
use gripgen_record::proto::gripgen_v1::{Sample, Status};
use gripgen_record::{
    RIG_SOURCE, RigCampaign, RunFolder, ShardReader, rig_campaign, sample_covariates, sha256_hex,
};
use gripgen_twin::columns::{Column, covariate, covariates, recorded_covariates};
use gripgen_twin::config::Feedback;
use gripgen_twin::{ExtraColumn, MeasuredPull, MeasuredPulls, PullTrace, Values};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::Path;

/// The pulls of a run folder: of a sweep or of a rig.
pub(super) fn load_run(path: &Path, suspects: Suspects) -> Result<LoadedPulls, LoadPullsError> {
    let folder = RunFolder::open(path)?;
    let rig = (folder.info().source == RIG_SOURCE).then(|| rig_campaign(&folder)).transpose()?;
    let mut left_out = LeftOut { rig: rig.is_some(), ..LeftOut::default() };
    let (mut pulls, mut standing, mut hashes) = (Vec::new(), Vec::new(), String::new());
    let mut rule: Option<(f64, f64)> = None;
    for shard in 0..folder.info().shards {
        let Some(sidecar) = folder.finished(shard)? else {
            left_out.unfinished_shards += 1;
            continue;
        };
        hashes += &sidecar.sha256;
        let reader = ShardReader::open(&folder.shard_path(shard))?;
        for index in reader.indices() {
            let (sample, trace) = reader.pull(index)?;
            left_out.count(sample.status());
            if !matches!(sample.status(), Status::Slipped | Status::Suspect) {
                continue;
            }
            let mine = (sample.label_tolerance_n, sample.stop_mm);
            if *rule.get_or_insert(mine) != mine {
                left_out.other_rule += 1;
                continue;
            }
            let stands = suspects::standing_of(&sample, trace.as_ref());
            if let Some(pull) = measured(sample, trace.as_ref()) {
                pulls.push(pull);
                standing.push(stands);
            }
        }
    }
    let ids: Vec<&str> = pulls.iter().map(|p: &MeasuredPull| p.id.as_str()).collect();
    let (keep, note) = suspects::kept(&standing, &ids, suspects);
    let mut notes: Vec<String> = left_out.notes().into_iter().chain(note).collect();
    let mut keeps = keep.iter();
    pulls.retain(|_| keeps.next().is_some_and(|keep| *keep));
    let rule = rule.filter(|_| !pulls.is_empty());
    let Some((label_tolerance_n, stop_mm)) = rule else {
        return Err(LoadPullsError::Nothing { path: path.into(), notes: notes.join("; ") });
    };
    let there = |column: &&Column| pulls.iter().any(|p: &MeasuredPull| column.value(p.view()).is_some());
    let there: Vec<&Column> = covariates().filter(there).collect();
    let mut pulls = MeasuredPulls {
        pulls,
        recorded: there.iter().map(|c| c.name.into()).collect(),
        extra: Vec::new(),
        label_tolerance_n,
        stop_m: stop_mm * 1e-3,
        feedback: feedback_of(&folder.info().config_toml),
        sha256: sha256_hex(hashes.as_bytes()),
    };
    match rig {
        Some(campaign) => as_made(&mut pulls, campaign),
        None => pulls.extra = own_columns(&pulls.pulls),
    }
    notes.extend(zero::without_shift(&mut pulls));
    fewer_traces(&mut pulls.pulls, &mut notes);
    // A sweep and a rig write newtons.
    let mut missing = MissingCells::default();
    for column in there {
        let rows: Vec<usize> =
            (0..pulls.pulls.len()).filter(|&i| column.is_missing(pulls.pulls[i].view())).collect();
        if !rows.is_empty() {
            missing.add(column.name, rows.len(), fill_missing(column, &rows, &mut pulls.pulls));
        }
    }
    for column in &pulls.extra {
        let empty = (0..pulls.pulls.len()).filter(|&i| column.values.at(i).is_none()).count();
        missing.add(&column.name, empty, SAY_NOTHING);
    }
    notes.extend(missing.notes());
    Ok(LoadedPulls { pulls, notes, warnings: Vec::new(), implausible: None, missing })
}

/// What is known of pulls that a rig made, and samples of a sweep have not: the order in which they were made, rests
/// between them, what was written down.
fn as_made(pulls: &mut MeasuredPulls, campaign: RigCampaign) {
    pulls.feedback = campaign.feedback;
    if let Some(recorded) = campaign.recorded {
        let measured = |c: &Column| pulls.pulls.iter().any(|pull| c.value(pull.view()).is_some());
        pulls.recorded =
            recorded_covariates(&recorded).filter(|c| measured(c)).map(|c| c.name.into()).collect();
    }
    if pulls.recorded.iter().any(|c| c == "time_s") {
        // A pull that failed at first was made again after the others.
        pulls.pulls.sort_by(|a, b| a.covariates.time_s.total_cmp(&b.covariates.time_s));
    }
    pulls.extra = own_columns(&pulls.pulls);
    pulls.count();
}

/// The columns of pulls that gripgen does not know.
fn own_columns(pulls: &[MeasuredPull]) -> Vec<ExtraColumn> {
    let names: BTreeSet<&String> = pulls.iter().flat_map(|p| p.covariates.extra.keys()).collect();
    let column = |name: &String| ExtraColumn {
        name: name.clone(),
        values: Values::of_drawn(pulls.iter().map(|p| p.covariates.extra.get(name))),
    };
    names.into_iter().filter(|name| covariate(name).is_none()).map(column).collect()
}

/// A pull that slipped; `None` if it has no label after all.
fn measured(sample: Sample, trace: Option<&PullTrace>) -> Option<MeasuredPull> {
    let covariates = sample_covariates(&sample);
    Some(MeasuredPull {
        id: sample.index.to_string(),
        max_pull_force_n: sample.max_pull_force_n?,
        zero_shift_n: 0.0,
        grip_pose: sample.grip_pose as usize,
        grip_force_n: sample.grip_force_n,
        increment_n: sample.force_increment_n,
        start_n: sample.force_start_n,
        step_s: sample.step_time_s,
        covariates,
        part: sample.part,
        trace: trace.map(thinned),
    })
}

/// What the force loop of a sweep closed on, where its configuration says so.
fn feedback_of(config_toml: &str) -> Option<Feedback> {
    let config: toml::Table = config_toml.parse().ok()?;
    let feedback = config.get("twin")?.get("robot")?.get("feedback")?;
    Feedback::deserialize(feedback.clone()).ok()
}
