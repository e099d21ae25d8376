//! `gripgen campaign`: plan a campaign.

#[cfg(test)]
mod tests;

use super::diagnose::diagnose_folders;
use super::diagnose::next::{next_toml, twin_words};
use crate::args::CampaignArgs;
use crate::failure::Failure;
use crate::load::{TwinOfPulls, jobs, load_twin, within_rig};
use crate::output::{JsonSink, count, duration, print, program};
use crate::outputs::Outputs;
use crate::shell;
use crate::{Engine, NextPulls, detectable_in_campaign, simulate_campaign};
use gripgen::Location;
use gripgen::twin::columns::{COLUMNS, Column};
use gripgen::twin::effects::OutsideFit;
use gripgen::twin::rounded;
use gripgen::twin::{Campaign, PullKind, Twin};
use gripgen_identify::pulls::detectable::DetectableEffect;
use gripgen_identify::{CampaignError, CampaignOptions, plan_campaign};
use gripgen_measured::Suspects;
use gripgen_measured::{campaign_toml, write_pull_folder};
use gripgen_record::csv_lines;
use serde_json::{Value, json};
use std::path::Path;

/// The rig whose gripper limits a plan for no rig in particular.
const SHIPPED_RIG: &str = "asset:configs/rig.toml";

/// Runs the verb.
pub fn run(args: &CampaignArgs) -> Result<u8, Failure> {
    let at = Location::parse(&args.twin);
    let rig = args.rig.as_deref().unwrap_or(SHIPPED_RIG);
    let mut outputs = Outputs::new(args.json.force)
        .reads_config(&args.twin, &args.set)
        .reads_config(rig, &[])
        .reads_all(&args.separate);
    outputs.allow(&args.out)?;
    outputs.allow_all(args.csv.as_deref())?;
    if let Some(folder) = &args.simulate {
        outputs.allow_new_folder(folder)?;
    }
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let twin = within_rig(load_twin(&args.twin, &args.set)?, Some(rig))?;
    let (campaign, separating) = match &args.separate {
        Some(measured) => {
            let (next, sha256) = separating(args, measured, rig)?;
            let text = next_toml(&next, measured, &args.twin, &sha256);
            (next.campaign, Some(text))
        }
        None => (first(args, &twin)?, None),
    };
    let minutes = campaign.estimated_minutes();
    let hours = format!("{}, about {}", count(pulls_of(&campaign), "pull"), duration(60.0 * minutes));
    let blocks = blocks(&campaign);
    let by_block: String = blocks
        .iter()
        .map(|b| {
            format!(
                "session {}: {}, about {}\n",
                b.session,
                count(b.pulls, "pull"),
                duration(60.0 * b.minutes)
            )
        })
        .collect();
    let about = format!(
        "{hours} of the robot's time, pauses included.\n{by_block}\
         Made by `gripgen campaign`, seed {}: settings in random order, each twice; one reference grip throughout.\n\
         Keys are described in docs/format.md. Run it with `gripgen rig pull`.",
        args.seed
    );
    let text = separating.unwrap_or_else(|| campaign_toml(&campaign, &about));
    outputs.write(&args.out, text.as_bytes())?;
    if let Some(csv) = &args.csv {
        outputs.write(csv, &table_csv(&campaign))?;
    }
    let simulated = match &args.simulate {
        Some(folder) => {
            let made = simulate_campaign(&at, &args.set, &campaign, args.seed).map_err(Failure::usage)?;
            let pending = outputs.begin_folder(folder)?;
            write_pull_folder(pending.path(), &made.pulls).map_err(Failure::new)?;
            pending.publish()?;
            if !args.talk.quiet {
                made.notes.iter().for_each(|note| eprintln!("{note}"));
            }
            Some(folder)
        }
        None => None,
    };
    let told = sink.wanted() || !args.talk.quiet;
    let detectable = match told {
        true => {
            detectable_in_campaign(&at, &args.set, &campaign, args.seed, jobs()).map_err(Failure::usage)?
        }
        false => None,
    }
    .unwrap_or_default();
    if sink.wanted() {
        sink.document(&json!({
            "schema": "gripgen.campaign/1",
            "campaign": args.out,
            "pulls": pulls_of(&campaign),
            "no_load": campaign.pulls.len() as u64 - pulls_of(&campaign),
            "minutes": (minutes * 10.0).round() / 10.0,
            "blocks": blocks.iter().map(|b| json!({
                "session": b.session, "pulls": b.pulls, "minutes": (b.minutes * 10.0).round() / 10.0,
            })).collect::<Vec<_>>(),
            "detectable": detectable.iter().map(detectable_json).collect::<Vec<_>>(),
            "csv": args.csv,
            "simulated": simulated,
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!("{hours}\n{by_block}{}{}\n", detectable_table(&detectable), args.out.display()))?;
        if let Some(csv) = &args.csv {
            print(&format!("{}\n", csv.display()))?;
        }
        if let Some(folder) = simulated {
            print(&format!("{}\n", folder.display()))?;
            eprintln!("next: {}", diagnosis_of(args, folder));
        }
    }
    Ok(0)
}

fn detectable_json(effect: &DetectableEffect) -> Value {
    let seen = effect.seen.as_ref();
    json!({
        "name": effect.name, "unit": effect.unit, "parameter": seen.map(|s| &s.parameter),
        "value": seen.map(|s| s.value), "power": seen.map(|s| s.power), "alike": effect.alike,
    })
}

/// The size from which on labels show each effect, and what explains it as well; then what they do not show.
fn detectable_table(all: &[DetectableEffect]) -> String {
    let shown: Vec<_> = all.iter().filter_map(|effect| Some((effect, effect.seen.as_ref()?))).collect();
    if shown.is_empty() {
        return String::new();
    }
    let mut text = String::from("labels alone show with a probability of 0.8, at a level of 1 %:\n");
    for (effect, seen) in shown {
        let unit = if effect.unit == "1" { String::new() } else { format!(" {}", effect.unit) };
        let from = format!("{} {}{unit}", seen.parameter, rounded(seen.value, &[]));
        let alike = match effect.alike.is_empty() {
            true => String::new(),
            false => format!("  or {}", effect.alike.join(", ")),
        };
        text += format!("  {:<20} {from:<28}{alike}", effect.name).trim_end();
        text.push('\n');
    }
    let hidden: Vec<&str> =
        all.iter().filter(|effect| effect.seen.is_none()).map(|effect| effect.name).collect();
    if !hidden.is_empty() {
        text += &format!("  not at any physical size: {}\n", hidden.join(", "));
    }
    text
}

/// A first campaign.
fn first(args: &CampaignArgs, twin: &Twin) -> Result<Campaign, Failure> {
    plan_campaign(&options(args, twin)?).map_err(|e| match e {
        CampaignError::TooFew { .. } => {
            Failure::usage(e).hint("raise --pulls, or name fewer parts with --parts")
        }
        CampaignError::Sessions { .. } => Failure::usage(e).hint("change --sessions"),
        other => Failure::usage(other),
    })
}

/// The command that diagnoses the pulls that were made, with the twin that they were made on.
fn diagnosis_of(args: &CampaignArgs, folder: &Path) -> String {
    let mut words = vec![program().to_string(), "diagnose".into(), shell::path(folder)];
    words.extend(twin_words(&args.twin, &args.set, args.rig.as_deref()));
    shell::command_line(&words)
}

/// The pulls that separate what a diagnosis of `measured` leaves tied, and the hash of these measurements.
fn separating(args: &CampaignArgs, measured: &Path, rig: &str) -> Result<(NextPulls, String), Failure> {
    let twin = TwinOfPulls { path: &args.twin, sets: &args.set, rig: Some(rig) };
    let diagnosed =
        diagnose_folders(&[measured], &twin, (&[], Engine::default()), Suspects::Screen, &args.talk)?;
    let next = diagnosed.next.ok_or_else(|| {
        let found =
            format!("--separate: {} leaves nothing tied that pulls could separate", measured.display());
        Failure::usage(found)
            .hint("`gripgen diagnose` says what was found; without --separate a first campaign is planned")
    })?;
    Ok((next, diagnosed.diagnosis.data.sha256))
}

fn options(args: &CampaignArgs, twin: &Twin) -> Result<CampaignOptions, Failure> {
    let known: Vec<String> = twin.parts.keys().cloned().collect();
    if let Some(part) = args.parts.iter().find(|part| !twin.parts.contains_key(*part)) {
        return Err(Failure::usage(format!("--parts: {} has no part `{part}`", args.twin))
            .hint(format!("its parts: {}", known.join(", "))));
    }
    let mut parts: Vec<String> = Vec::new();
    for part in if args.parts.is_empty() { &known } else { &args.parts } {
        if !parts.contains(part) {
            parts.push(part.clone());
        }
    }
    let fitted = fitted_range_n(twin, &parts);
    Ok(CampaignOptions {
        parts,
        pulls: args.pulls,
        sessions: args.sessions,
        seed: args.seed,
        min_force_n: fitted.0,
        max_force_n: fitted.1.min(twin.gripper.max_force_n),
        angles_deg: args.angles_deg.clone(),
        offsets_mm: args.offsets_mm.clone(),
        ..CampaignOptions::default()
    })
}

/// The grip forces at which no law of these parts refuses.
fn fitted_range_n(twin: &Twin, parts: &[String]) -> (f64, f64) {
    let refusing = twin.effects.iter().filter(|e| e.outside_fit == OutsideFit::Error);
    let ranges =
        refusing.filter(|e| parts.iter().any(|p| e.acts_on(p))).filter_map(|e| e.fitted_grip_force_n);
    ranges.fold((0.0, f64::INFINITY), |(low, high), (l, h)| (low.max(l), high.min(h)))
}

fn pulls_of(campaign: &Campaign) -> u64 {
    campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).count() as u64
}

/// A session of a campaign.
struct Block {
    session: String,
    pulls: u64,
    minutes: f64,
}

/// The sessions of a campaign in their order, and how long each keeps the robot busy, the pause before it included.
fn blocks(campaign: &Campaign) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for pull in &campaign.pulls {
        if blocks.last().is_none_or(|block| block.session != pull.session) {
            blocks.push(Block { session: pull.session.clone(), pulls: 0, minutes: 0.0 });
        }
        if let Some(block) = blocks.last_mut() {
            block.pulls += u64::from(pull.kind == PullKind::Pull);
            block.minutes += pull.estimated_s(campaign.label_tolerance_n) / 60.0;
        }
    }
    blocks
}

/// Columns that somebody fills in at the rig.
const BY_HAND: [&str; 4] = ["time_s", "temperature_c", "max_pull_force_n", "status"];

/// The pulls as a table to print and fill in: once the empty cells are filled it is a `pulls.csv`.
fn table_csv(campaign: &Campaign) -> Vec<u8> {
    let planned = |column: &&Column| {
        let absent = BY_HAND.contains(&column.name) || column.name == "pull_index";
        column.is_covariate() && !absent
    };
    let columns: Vec<&Column> = COLUMNS.iter().filter(planned).collect();
    let names = columns.iter().map(|column| column.name);
    let mut rows: Vec<Vec<String>> =
        vec![["pull_id"].into_iter().chain(names).chain(BY_HAND).map(String::from).collect()];
    let pulls = campaign.pulls.iter().filter(|pull| pull.kind == PullKind::Pull);
    for (pull, number) in pulls.zip(1..) {
        let covariates = pull.covariates();
        let mut cells = vec![format!("p{number:04}")];
        cells.extend(columns.iter().map(|column| column.cell(pull.view(&covariates)).into_owned()));
        cells.extend(BY_HAND.map(|_| String::new()));
        rows.push(cells);
    }
    csv_lines(&rows)
}
