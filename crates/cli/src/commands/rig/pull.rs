//! `gripgen rig pull`: the experiment, recorded.

use super::live::Live;
use crate::rig::load_rig;
use crate::rig::programs::judged;
use crate::rig::record::{Standing, rig_pull, suspect};
use crate::rig::rehearsal;
use crate::rig::standing::CampaignClock;
use crate::args::RigPullArgs;
use crate::failure::{Failure, another_run, code};
use crate::interrupt::stop_flag;
use crate::output::{JsonSink, count, duration, print, program};
use crate::outputs::Outputs;
use gripgen::record::{
    FolderError, RigRunInfo, RunFolder, create_rig_run, discard_failed, failed_pulls, missing_pulls,
    read_campaign, suspect_pulls, write_rig_pull,
};
use gripgen::twin::{Campaign, PlannedPull, PullKind};
use gripgen::{VERSION, plain_campaign, publish_contact_sheet, rig_run_differences, rig_run_toml};
use gripgen_rig::experiment::check::check;
use gripgen_rig::experiment::plan::pull_program;
use gripgen_rig::experiment::prepare::Permit;
use gripgen_rig::experiment::pull::ExecutedPull;
use gripgen_rig::experiment::rehearse::StoredRehearsal;
use gripgen_rig::experiment::slowing::slowed;
use gripgen_rig::experiment::{Devices, Experiment, Fault, PullOutcome, RigConfig, check_campaign};
use serde_json::json;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pulls in a row without a label after which somebody has to look.
const MAX_FAILED_IN_A_ROW: usize = 3;

/// Runs the verb.
pub fn run(args: &RigPullArgs) -> Result<u8, Failure> {
    let config = load_rig(&args.rig, &args.set)?;
    let mut campaign = planned(args, &config)?;
    let rehearsal = args.rehearsal.as_deref().map(rehearsal::load).transpose()?;
    let slow = rehearsal.as_ref().map(|stored| slowed_by(stored, &config, &mut campaign)).transpose()?;
    let campaign = campaign;
    check_campaign(&config, &campaign).map_err(|e| {
        Failure::usage(e).hint("nothing was sent and nothing moved; the limits stand in the rig's file and in the device's data sheet")
    })?;
    let pulls: Vec<&PlannedPull> = campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).collect();
    let out = folder_of(args);
    let mut outputs = Outputs::of("rig pull", args.json.force)
        .reads_config(&args.rig, &args.set)
        .reads_all(&args.campaign)
        .reads_all(&args.after)
        .makes_run(&out);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    if args.print_program {
        let Some(first) = pulls.first() else { return Ok(0) };
        let script = pull_program(&config, &campaign, first, 1).script().map_err(Failure::usage)?;
        return print(&script).map(|()| 0);
    }
    judged(&config, &campaign).map_err(|problem| {
        Failure::new(problem).hint("nothing was sent and nothing moved; `--print-program` shows the text")
    })?;
    let minutes = campaign.estimated_minutes();
    let words = format!("{}, about {}", count(pulls.len() as u64, "pull"), duration(60.0 * minutes));
    if args.dry_run {
        sink.line(&json!({"event": "checked", "pulls": pulls.len(), "minutes": minutes}))?;
        if !sink.on_stdout() {
            print(&format!("{words}; everything is inside the limits, nothing was sent\n"))?;
        }
        return Ok(0);
    }
    if let Some(stored) = &rehearsal {
        unchanged(&config, stored)?;
    }
    // Before a folder is made.
    let before = args.after.as_deref().map(RunFolder::open).transpose()?;
    let before = before.as_ref().map(CampaignClock::of).transpose()?.unwrap_or_default();
    let folder = open_folder(args, &config, &campaign, pulls.len() as u64)?;
    if let Some(path) = &args.rehearsal {
        rehearsal::keep(path, &folder)?;
    }
    let todo = todo(&folder)?;
    let mut live = Live::new(pulls.len() as u64, todo.len() as u64, &args.talk, sink);
    if let Some(port) = args.live {
        live.show_on_page(port, &name_of(args), config.views())?;
    }
    let live = RefCell::new(live);
    if todo.is_empty() {
        return finish(&folder, &live.borrow(), 0);
    }
    if let Some(slow) = slow {
        live.borrow().say(&slow);
    }
    live.borrow().say(&format!("{words}; {} to make, into {}", todo.len(), folder.path().display()));
    let stop = stop_flag("stopping the robot safely");
    let trails_s = rehearsal.and_then(|stored| stored.rehearsal.trails_s()).unwrap_or_default();
    let job = Job {
        args,
        config: &config,
        campaign: &campaign,
        folder: &folder,
        before,
        live: &live,
        stop,
        trails_s,
    };
    let failed = job.make(&todo)?;
    finish(&folder, &live.borrow(), failed)
}

/// Asks every device what a rehearsal asked it.
fn unchanged(config: &RigConfig, stored: &StoredRehearsal) -> Result<(), Failure> {
    let mut lines = Vec::new();
    check(config, |line| lines.push(line));
    let line = rehearsal::compared(stored, &lines);
    if line.ok { Ok(()) } else { Err(Failure::new(line.found).hint("nothing was sent and nothing moved")) }
}

/// A rehearsal that speaks for pulls slows their staircases; what it did, in words.
fn slowed_by(
    stored: &StoredRehearsal,
    config: &RigConfig,
    campaign: &mut Campaign,
) -> Result<String, Failure> {
    if let Some(doubt) = stored.doubts.first() {
        return Err(Failure::new(format!("the rehearsal speaks against pulls: {doubt}"))
            .hint("nothing was sent; mend it and rehearse again, or pull without --rehearsal"));
    }
    let trails_s = stored.rehearsal.trails_s().unwrap_or_default();
    let limits = &config.limits;
    let count = slowed(campaign, trails_s, limits.pull_force_n / limits.pull_time_s);
    let words = format!("rehearsed: the force trails by {trails_s:.3} s");
    Ok(if count == 0 { words } else { format!("{words}, staircases are slowed for {count} of the pulls") })
}

/// The campaign of a file, or that of the flags.
fn planned(args: &RigPullArgs, config: &RigConfig) -> Result<Campaign, Failure> {
    if let Some(path) = &args.campaign {
        return read_campaign(path).map_err(Failure::usage);
    }
    let known: Vec<String> = config.poses.keys().cloned().collect();
    let parts = if args.parts.is_empty() { &known } else { &args.parts };
    if parts.is_empty() {
        return Err(Failure::usage(format!("{}: no pose is taught", args.rig))
            .hint("move the tool to a part by hand, then `gripgen rig teach NAME`"));
    }
    Ok(plain_campaign(parts, &args.grip_force_n, args.repetitions, args.seed))
}

fn name_of(args: &RigPullArgs) -> String {
    let stem = args.campaign.as_ref().and_then(|path| path.file_stem());
    stem.map_or("rig".into(), |stem| stem.to_string_lossy().into_owned())
}

/// The run folder.
fn folder_of(args: &RigPullArgs) -> PathBuf {
    args.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(name_of(args)))
}

fn open_folder(
    args: &RigPullArgs,
    config: &RigConfig,
    campaign: &Campaign,
    pulls: u64,
) -> Result<RunFolder, Failure> {
    let (name, out) = (name_of(args), folder_of(args));
    let config_toml = rig_run_toml(config, campaign).map_err(Failure::new)?;
    let info = RigRunInfo { name, gripgen_version: VERSION.into(), config_toml, pulls };
    create_rig_run(&out, &info).map_err(|e| match &e {
        FolderError::AnotherRun { what: "config_sha256", .. } => {
            match rig_run_differences(&out, &info.config_toml) {
                Some(keys) => another_run(&format!("{} holds another run: {keys}", out.display())),
                None => e.into(),
            }
        }
        _ => e.into(),
    })
}

/// Pulls that are missing or failed.
fn todo(folder: &RunFolder) -> Result<BTreeSet<u64>, Failure> {
    let mut todo: BTreeSet<u64> = missing_pulls(folder)?.into_iter().collect();
    todo.extend(failed_pulls(folder)?);
    Ok(todo)
}

fn finish(folder: &RunFolder, live: &Live, failed: usize) -> Result<u8, Failure> {
    let complete = folder.write_index()?;
    if complete {
        publish_contact_sheet(folder).map_err(Failure::new)?;
    }
    let suspect = suspect_pulls(folder)?.len();
    live.done(folder.path(), failed, suspect, complete)?;
    Ok(if failed > 0 || suspect > 0 { code::SAMPLES_FAILED } else { 0 })
}

/// What is to be made, and where it goes.
struct Job<'a> {
    args: &'a RigPullArgs,
    config: &'a RigConfig,
    campaign: &'a Campaign,
    folder: &'a RunFolder,
    before: CampaignClock,
    live: &'a RefCell<Live>,
    stop: &'a AtomicBool,
    /// How far a reading trails, as it was rehearsed.
    trails_s: f64,
}

/// How a row of pulls ended.
enum End {
    /// All were tried; so many have no label.
    Done(usize),
    /// A safe stop; the robot said that it stands.
    Stopped { reason: String, still: bool },
}

impl Job<'_> {
    /// Makes what is left, connecting anew between pulls as often as somebody allowed it.
    fn make(&self, todo: &BTreeSet<u64>) -> Result<usize, Failure> {
        let mut left = todo.clone();
        let mut reconnects = self.args.reconnect;
        let mut clock = CampaignClock::of(self.folder)?;
        if clock.is_new() {
            clock = self.before;
        }
        loop {
            let (reason, still) = match self.connected(&mut left, &mut clock)? {
                End::Done(failed) => return Ok(failed),
                End::Stopped { reason, still } => (reason, still),
            };
            let interrupted = self.stop.load(Ordering::SeqCst);
            if interrupted || !still || reconnects == 0 {
                let again =
                    format!("look at the rig; `{} rig pull` with the same arguments goes on", program());
                let rest = if still {
                    "the robot stands still"
                } else {
                    "NOBODY KNOWS WHETHER THE ROBOT STANDS STILL"
                };
                let failure =
                    Failure::new(format!("{reason}; {rest}, the gripper keeps what it holds")).hint(again);
                return Err(if interrupted { failure.with_code(code::INTERRUPTED) } else { failure });
            }
            reconnects -= 1;
            self.live.borrow().say(&format!("{reason}; the robot stands still, connecting again"));
        }
    }

    /// One connection: pulls until all are made, or one is stopped.
    fn connected(&self, left: &mut BTreeSet<u64>, clock: &mut CampaignClock) -> Result<End, Failure> {
        let mut devices = Devices::connect(self.config).map_err(|e| {
            Failure::new(e).hint("`gripgen rig check` says which devices answer; a virtual rig is started by `gripgen rig serve`")
        })?;
        let permit = Permit { power_on: self.args.power_on, unlock: self.args.unlock };
        devices.prepare(permit).map_err(Failure::new)?;
        let mut emit = |event| self.live.borrow_mut().event(&event);
        let mut experiment = Experiment::new(self.config, devices, self.stop, &mut emit);
        experiment.trails(self.trails_s);
        if self.args.live.is_some() {
            experiment.show_frames();
        }
        if let Err(fault) = experiment.begin() {
            if let Fault::Busy { .. } = fault {
                // It is not ours to stop.
                return Err(Failure::new(fault)
                    .hint("wait for its end, or stop it on the teach pendant; nothing was moved"));
            }
            let stopped = experiment.safe_stop(&fault);
            return Ok(End::Stopped { reason: stopped.reason, still: stopped.still });
        }
        let (mut index, mut in_a_row) = (0, 0);
        let mut waiting: Vec<&PlannedPull> = Vec::new();
        for entry in &self.campaign.pulls {
            if entry.kind != PullKind::Pull {
                waiting.push(entry);
                continue;
            }
            let place = index;
            index += 1;
            if !left.contains(&place) {
                waiting.clear();
                continue;
            }
            waiting.push(entry);
            let made = self.one(&mut experiment, &waiting, place, clock);
            waiting.clear();
            let pull = made?;
            if let Some(stopped) = &pull.stopped {
                return Ok(End::Stopped { reason: stopped.reason.clone(), still: stopped.still });
            }
            match pull.outcome {
                PullOutcome::Failed { reason } if in_a_row + 1 >= MAX_FAILED_IN_A_ROW => {
                    experiment.close();
                    let words =
                        format!("{MAX_FAILED_IN_A_ROW} pulls in a row have no label, the last one: {reason}");
                    return Err(Failure::new(words).hint("look at the rig; the same command goes on"));
                }
                PullOutcome::Failed { .. } => in_a_row += 1,
                _ => {
                    in_a_row = 0;
                    left.remove(&place);
                }
            }
        }
        experiment.close();
        Ok(End::Done(left.len()))
    }

    /// What comes before a pull, the pull, and its record.
    fn one(
        &self,
        experiment: &mut Experiment<'_>,
        waiting: &[&PlannedPull],
        place: u64,
        clock: &mut CampaignClock,
    ) -> Result<Recorded, Failure> {
        let planned = waiting.last().copied().cloned().unwrap_or_default();
        self.live.borrow_mut().begin(place, &planned);
        let before = waiting.iter().try_for_each(|entry| {
            experiment.pause(entry.pause_s)?;
            if entry.kind == PullKind::NoLoad { experiment.read_no_load(entry.dwell_s) } else { Ok(()) }
        });
        let measured = match before {
            Ok(()) => experiment.pull(self.campaign, &planned),
            Err(fault) => experiment.give_up(&planned, &fault),
        };
        let recorded = Recorded { outcome: measured.outcome.clone(), stopped: measured.stopped.clone() };
        let standing = clock.standing(place, &measured);
        // A pull is recorded, whether or not somebody still listens.
        let suspect = suspect(self.config, self.campaign, &measured);
        let told = self.live.borrow_mut().pulled(&standing, &measured, suspect.as_deref());
        self.record(standing, measured, suspect)?;
        told?;
        Ok(recorded)
    }

    fn record(
        &self,
        standing: Standing,
        measured: ExecutedPull,
        suspect: Option<String>,
    ) -> Result<(), Failure> {
        discard_failed(self.folder, standing.index).map_err(Failure::new)?;
        let pull = rig_pull(self.config, self.campaign, standing, measured, suspect);
        write_rig_pull(self.folder, &pull).map_err(Failure::new)?;
        Ok(())
    }
}

/// What the loop needs of a pull that is written.
struct Recorded {
    outcome: PullOutcome,
    stopped: Option<gripgen_rig::experiment::Stopped>,
}
