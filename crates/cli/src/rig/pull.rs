//! The pulls of a campaign on a rig, recorded: from a campaign to a run folder.

use super::programs::checked_programs;
use super::record::{Standing, rig_pull, suspect};
use super::rehearsal::keep;
use super::standing::CampaignClock;
use super::{after_stop, load_rehearsal, no_pose, unprepared};
use crate::failure::{Failure, another_run, code};
use crate::output::program;
use crate::rig::{plain_campaign, rig_run_differences, rig_run_toml};
use gripgen::VERSION;
use gripgen::record::{
    FolderError, RigRunInfo, RunFolder, create_rig_run, discard_failed, failed_pulls, missing_pulls,
    suspect_pulls, write_rig_pull,
};
use gripgen::twin::columns::notes::{check_note, note_of};
use gripgen::twin::draw::Drawn;
use gripgen::twin::{Campaign, PlannedPull, PullKind};
use gripgen_report::publish_contact_sheet;
use gripgen_rig::experiment::check::check;
use gripgen_rig::experiment::prepare::Permit;
use gripgen_rig::experiment::pull::ExecutedPull;
use gripgen_rig::experiment::rehearse::StoredRehearsal;
use gripgen_rig::experiment::slowing::slowed;
use gripgen_rig::experiment::{
    Ask, CampaignError, CampaignPlan, Devices, RigConfig, RigEvent, check_campaign, run_campaign,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// A campaign of every part with every grip force; all parts that are taught where `parts` is empty.
///
/// # Errors
///
/// A rig on which nothing is taught; `rig` is its name for the message.
pub fn plan_pulls(
    config: &RigConfig,
    rig: &str,
    parts: &[String],
    grip_force_n: &[f64],
    repetitions: usize,
    seed: u64,
) -> Result<Campaign, Failure> {
    let taught: Vec<String> = config.poses.keys().cloned().collect();
    let parts = if parts.is_empty() { &taught } else { parts };
    if parts.is_empty() {
        return Err(no_pose(rig));
    }
    Ok(plain_campaign(parts, grip_force_n, repetitions, seed))
}

/// A campaign that is inside the limits of a rig. Nothing was sent yet.
pub struct PullJob {
    /// The rig.
    pub config: RigConfig,
    /// The campaign, its staircases slowed as the rehearsal asks for it.
    pub campaign: Campaign,
    /// What the rehearsal did to the campaign, in words.
    pub slowed: Option<String>,
    rehearsal: Option<(PathBuf, StoredRehearsal)>,
    notes: BTreeMap<String, Drawn>,
    asked: Vec<String>,
}

impl PullJob {
    /// Checks every pull against the limits.
    ///
    /// # Errors
    ///
    /// A pull that this rig does not make, or a rehearsal that cannot be read or speaks against pulls.
    pub fn new(config: RigConfig, mut campaign: Campaign, rehearsal: Option<&Path>) -> Result<Self, Failure> {
        let rehearsal = match rehearsal {
            Some(path) => Some((path.to_path_buf(), load_rehearsal(path)?)),
            None => None,
        };
        let slowed =
            rehearsal.as_ref().map(|(_, stored)| slowed_by(stored, &config, &mut campaign)).transpose()?;
        check_campaign(&config, &campaign).map_err(|e| {
            Failure::usage(e).hint("nothing was sent and nothing moved; the limits stand in the rig's file and in the device's data sheet")
        })?;
        Ok(Self { config, campaign, slowed, rehearsal, notes: BTreeMap::new(), asked: Vec::new() })
    }

    /// Notes these columns of every pull, and asks for the others before each.
    ///
    /// # Errors
    ///
    /// A column that is given twice, has the name of something else, or a value that cannot have been measured.
    pub fn with_notes(mut self, notes: &[(String, String)], asked: &[String]) -> Result<Self, Failure> {
        let none = |name: &str| {
            Failure::usage(format!("--column {name}: there is no value"))
                .hint("leave the flag out where nothing was measured")
        };
        for (name, text) in notes {
            // Known columns of a campaign stand in its entries.
            let known: Option<fn(&mut PlannedPull) -> &mut String> = match name.as_str() {
                "gel_id" => Some(|pull| &mut pull.gel_id),
                "session" => Some(|pull| &mut pull.session),
                _ => None,
            };
            if let Some(field) = known {
                self.campaign.pulls.iter_mut().for_each(|pull| field(pull).clone_from(text));
                continue;
            }
            let value = note_of(text).ok_or_else(|| none(name))?;
            check_note(name, &value).map_err(|e| Failure::usage(format!("--column: {e}")))?;
            self.notes.insert(name.clone(), value);
        }
        for name in asked {
            check_note(name, &Drawn::Number(0.0)).map_err(|e| Failure::usage(format!("--ask: {e}")))?;
            self.asked.push(name.clone());
        }
        let mut names: Vec<&String> = notes.iter().map(|(name, _)| name).chain(asked).collect();
        names.sort();
        match names.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(Failure::usage(format!("the column {} is given twice", pair[0])).hint(
                "a column is either the same for all pulls (--column) or asked for before each (--ask)",
            )),
            None => Ok(self),
        }
    }

    /// The pulls, without what is between them.
    pub fn pulls(&self) -> Vec<&PlannedPull> {
        self.campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).collect()
    }

    /// Runs what the robot would be sent on the virtual robot.
    ///
    /// # Errors
    ///
    /// A program that does not do what its numbers say.
    pub fn check_programs(&self) -> Result<(), Failure> {
        let checked = checked_programs(&self.config, &self.campaign);
        checked.map(|_| ()).map_err(|problem| {
            Failure::new(problem).hint("nothing was sent and nothing moved; `--print-program` shows the text")
        })
    }

    /// Opens the run folder; `after` is a run on the same rig and gels before this one.
    ///
    /// # Errors
    ///
    /// A rig that has changed since its rehearsal, or a folder that is another run.
    pub fn open(&self, name: &str, out: &Path, after: Option<&Path>) -> Result<PullRun<'_>, Failure> {
        if let Some((_, stored)) = &self.rehearsal {
            unchanged(&self.config, stored)?;
        }
        // Before a folder is made.
        let before = after.map(RunFolder::open).transpose()?;
        let before = before.as_ref().map(CampaignClock::of).transpose()?.unwrap_or_default();
        let folder = self.open_folder(name, out)?;
        if let Some((path, _)) = &self.rehearsal {
            keep(path, &folder)?;
        }
        let mut todo: BTreeSet<u64> = missing_pulls(&folder)?.into_iter().collect();
        todo.extend(failed_pulls(&folder)?);
        Ok(PullRun { job: self, folder, todo, before })
    }

    fn open_folder(&self, name: &str, out: &Path) -> Result<RunFolder, Failure> {
        let config_toml = rig_run_toml(&self.config, &self.campaign, self.notes.keys().chain(&self.asked))
            .map_err(Failure::new)?;
        let pulls = self.pulls().len() as u64;
        let info = RigRunInfo { name: name.into(), gripgen_version: VERSION.into(), config_toml, pulls };
        create_rig_run(out, &info).map_err(|e| match &e {
            FolderError::AnotherRun { what: "config_sha256", .. } => {
                match rig_run_differences(out, &info.config_toml) {
                    Some(keys) => another_run(&format!("{} holds another run: {keys}", out.display())),
                    None => e.into(),
                }
            }
            _ => e.into(),
        })
    }
}

/// Asks every device what a rehearsal asked it.
fn unchanged(config: &RigConfig, stored: &StoredRehearsal) -> Result<(), Failure> {
    let mut lines = Vec::new();
    check(config, |line| lines.push(line));
    let line = stored.compare(&lines);
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

/// What a person has allowed, and what is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HowToPull {
    /// What a person who stands beside the robot has allowed.
    pub permit: Permit,
    /// How often a fault after which the robot stands still may be answered by a new connection.
    pub reconnects: u32,
    /// Whether frames of the cameras are told of.
    pub frames: bool,
}

/// What happens while pulls are made.
#[derive(Debug)]
pub enum PullProgress<'a> {
    /// On the rig.
    Rig(RigEvent),
    /// A pull is over and is written next.
    Pulled {
        /// Where it stands in its campaign.
        standing: Standing,
        /// All that came of it.
        pull: &'a ExecutedPull,
        /// Why its label is suspect, where it is.
        suspect: Option<&'a str>,
    },
}

/// How a run stands after its pulls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PullSummary {
    /// Pulls that have no label.
    pub failed: usize,
    /// Pulls whose label is suspect.
    pub suspect: usize,
    /// Whether every pull has one.
    pub complete: bool,
}

/// A run folder whose pulls are made.
pub struct PullRun<'a> {
    job: &'a PullJob,
    folder: RunFolder,
    todo: BTreeSet<u64>,
    before: CampaignClock,
}

impl PullRun<'_> {
    /// Where it is.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Pulls that have no label yet.
    pub fn todo(&self) -> usize {
        self.todo.len()
    }

    /// Makes what is missing, records it, and finishes the run. `ask` asks a person for the columns of [`PullJob::with_notes`]. An error
    /// of `tell` ends it after the pull under way.
    ///
    /// # Errors
    ///
    /// What stopped the rig, or a pull that cannot be written.
    pub fn make(
        &self,
        how: HowToPull,
        stop: &AtomicBool,
        ask: &mut Ask<'_>,
        tell: &mut dyn FnMut(PullProgress<'_>) -> Result<(), Failure>,
    ) -> Result<PullSummary, Failure> {
        let PullJob { config, campaign, rehearsal, notes, asked, .. } = self.job;
        let trails_s = rehearsal.as_ref().and_then(|(_, stored)| stored.rehearsal.trails_s());
        let plan = CampaignPlan {
            config,
            campaign,
            todo: self.todo.clone(),
            permit: how.permit,
            reconnects: how.reconnects,
            trails_s: trails_s.unwrap_or_default(),
            frames: how.frames,
            notes: notes.clone(),
            asked: asked.clone(),
        };
        let mut clock = CampaignClock::of(&self.folder)?;
        if clock.is_new() {
            clock = self.before;
        }
        let mut on_event = |event| match event {
            RigEvent::PullFinished { place, pull } => {
                let standing = clock.standing(place, &pull);
                let suspect = suspect(config, campaign, &pull);
                // A pull is recorded, whether or not somebody still listens.
                let told = tell(PullProgress::Pulled { standing, pull: &pull, suspect: suspect.as_deref() });
                discard_failed(&self.folder, standing.index).map_err(Failure::new)?;
                let pull = rig_pull(config, campaign, standing, *pull, suspect);
                write_rig_pull(&self.folder, &pull).map_err(Failure::new)?;
                told
            }
            other => tell(PullProgress::Rig(other)),
        };
        let failed = match self.todo.is_empty() {
            true => 0,
            false => run_campaign(&plan, Devices::connect, stop, ask, &mut on_event).map_err(ended)?,
        };
        let complete = self.folder.write_index()?;
        if complete {
            publish_contact_sheet(&self.folder).map_err(Failure::new)?;
        }
        Ok(PullSummary { failed, suspect: suspect_pulls(&self.folder)?.len(), complete })
    }
}

/// Why a campaign ended, with what to do about it.
fn ended(e: CampaignError<Failure>) -> Failure {
    match e {
        CampaignError::Connect(e) => Failure::new(e).hint(
            "`gripgen rig check` says which devices answer; a virtual rig is started by `gripgen rig serve`",
        ),
        // It is not ours to stop.
        CampaignError::Busy(fault) => {
            let hint = fault.hint();
            Failure::new(fault).hint_if(hint)
        }
        CampaignError::Stopped { stopped, interrupted } => {
            let again = format!("`{} rig pull` with the same arguments goes on", program());
            let hint = after_stop(&stopped, &again);
            let failure = Failure::new(stopped).hint(hint);
            if interrupted { failure.with_code(code::INTERRUPTED) } else { failure }
        }
        CampaignError::InARow { problem } => {
            Failure::new(problem).hint("look at the rig; the same command goes on")
        }
        CampaignError::Told(failure) => failure,
        CampaignError::Prepare(e) => unprepared(&e),
    }
}
