//! The loop over the pulls of a campaign: connect, make what has no label yet, connect again where that is allowed.

use super::config::RigConfig;
use super::devices::{ConnectError, Devices};
use super::event::{ExecutedPull, PullOutcome, RigEvent, Stopped};
use super::fault::Fault;
use super::prepare::{Permit, PrepareError};
use super::run::Experiment;
use gripgen_twin::draw::Drawn;
use gripgen_twin::{Campaign, PlannedPull, PullKind};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};

/// Pulls in a row without a label after which a person has to look at the rig.
const MAX_FAILED_IN_A_ROW: usize = 3;

/// What is to be made, and what is allowed. A campaign is checked before: see [`check_campaign`](super::check_campaign).
#[derive(Debug, Clone)]
pub struct CampaignPlan<'a> {
    /// The rig.
    pub config: &'a RigConfig,
    /// All pulls, with the pauses and readings between them.
    pub campaign: &'a Campaign,
    /// Places among the pulls that have no label yet.
    pub todo: BTreeSet<u64>,
    /// What a person who stands beside the robot has allowed.
    pub permit: Permit,
    /// How often a fault after which the robot stands still may be answered by a new connection.
    pub reconnects: u32,
    /// How far a reading trails, as a rehearsal found it; else 0.
    pub trails_s: f64,
    /// Whether frames of the cameras are told of.
    pub frames: bool,
    /// What is noted of every pull, in addition to the notes of the campaign; it counts where both have a column.
    pub notes: BTreeMap<String, Drawn>,
    /// Columns that a person is asked for before each pull.
    pub asked: Vec<String>,
}

/// Asks a person for a column of a pull, and gives where the answer will come: nothing where it was not measured. An end without an
/// answer means that there is no person.
pub type Ask<'a> = dyn FnMut(u64, &PlannedPull, &str) -> Receiver<Option<Drawn>> + 'a;

/// Why a campaign ended before its last pull.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError<E> {
    /// A device does not answer.
    #[error("{0}")]
    Connect(ConnectError),
    /// The robot is not ready.
    #[error("{0}")]
    Prepare(PrepareError),
    /// The robot runs a program of somebody else, which is not stopped.
    #[error("{0}")]
    Busy(Fault),
    /// Everything was stopped.
    #[error("{stopped}")]
    Stopped {
        /// How that went.
        stopped: Stopped,
        /// Whether a person asked for it.
        interrupted: bool,
    },
    /// Too many pulls in a row have no label.
    #[error("{problem}")]
    InARow {
        /// How many, and why the last one has none.
        problem: String,
    },
    /// Whoever was told refused to go on.
    #[error("{0}")]
    Told(E),
}

/// How the pulls of one connection ended.
enum End {
    /// All were tried; this many have no label.
    Done(usize),
    /// A safe stop.
    Stopped(Stopped),
}

/// Makes the pulls of a plan on the devices that `connect` gives, and tells what happens. Gives how many have no label.
///
/// What `tell` refuses ends the campaign after the pull under way; [`RigEvent::PullFinished`] is told in every case.
///
/// # Errors
///
/// See [`CampaignError`].
pub fn run_campaign<E>(
    plan: &CampaignPlan<'_>,
    mut connect: impl FnMut(&RigConfig) -> Result<Devices, ConnectError>,
    stop: &AtomicBool,
    ask: &mut Ask<'_>,
    tell: &mut dyn FnMut(RigEvent) -> Result<(), E>,
) -> Result<usize, CampaignError<E>> {
    let (mut left, mut reconnects) = (plan.todo.clone(), plan.reconnects);
    loop {
        let devices = connect(plan.config).map_err(CampaignError::Connect)?;
        let stopped = match on_devices(plan, devices, &mut left, stop, ask, tell)? {
            End::Done(failed) => return Ok(failed),
            End::Stopped(stopped) => stopped,
        };
        let interrupted = stop.load(Ordering::SeqCst);
        if interrupted || !stopped.still || reconnects == 0 {
            return Err(CampaignError::Stopped { stopped, interrupted });
        }
        reconnects -= 1;
        tell(RigEvent::Reconnecting { reason: stopped.reason }).map_err(CampaignError::Told)?;
    }
}

/// One connection: pulls until all are made, or one is stopped.
fn on_devices<E>(
    plan: &CampaignPlan<'_>,
    mut devices: Devices,
    left: &mut BTreeSet<u64>,
    stop: &AtomicBool,
    ask: &mut Ask<'_>,
    tell: &mut dyn FnMut(RigEvent) -> Result<(), E>,
) -> Result<End, CampaignError<E>> {
    if let Err(e) = devices.prepare(plan.permit) {
        // Nothing has moved: the gripper is left as it was found.
        devices.close();
        return Err(CampaignError::Prepare(e));
    }
    let refused = RefCell::new(None);
    let mut emit = |event| {
        if let Err(e) = tell(event) {
            refused.borrow_mut().get_or_insert(e);
        }
    };
    let mut experiment = Experiment::new(plan.config, devices, stop, &mut emit);
    experiment.trails(plan.trails_s);
    if plan.frames {
        experiment.show_frames();
    }
    if let Err(fault) = experiment.begin() {
        if let Fault::Busy { .. } = fault {
            experiment.close();
            return Err(CampaignError::Busy(fault));
        }
        return Ok(End::Stopped(experiment.safe_stop(&fault)));
    }
    let mut in_a_row = 0;
    // Each pull with what comes before it.
    let pulls = plan.campaign.pulls.split_inclusive(|entry| entry.kind == PullKind::Pull);
    for (place, entries) in (0..).zip(pulls) {
        let Some(planned) = entries.last().filter(|e| e.kind == PullKind::Pull && left.contains(&place))
        else {
            continue;
        };
        let mut planned = planned.clone();
        planned.notes.extend(plan.notes.clone());
        let answered = plan.asked.iter().try_for_each(|name| {
            let answer = ask(place, &planned, name);
            let noted = experiment.answer(name, &answer)?;
            planned.notes.remove(name);
            planned.notes.extend(noted.map(|value| (name.clone(), value)));
            Ok(())
        });
        experiment.tell(RigEvent::PullStarted { place, planned: planned.clone() });
        let pull = match answered {
            Ok(()) => experiment.entries(plan.campaign, entries, &planned),
            Err(fault) => experiment.give_up(&planned, &fault),
        };
        let (outcome, stopped) = (pull.outcome.clone(), pull.stopped.clone());
        experiment.tell(RigEvent::PullFinished { place, pull: Box::new(pull) });
        if let Some(e) = refused.take() {
            return Err(CampaignError::Told(e));
        }
        if !matches!(outcome, PullOutcome::Failed { .. }) {
            left.remove(&place);
        }
        if let Some(stopped) = stopped {
            return Ok(End::Stopped(stopped));
        }
        match outcome {
            PullOutcome::Failed { reason } if in_a_row + 1 >= MAX_FAILED_IN_A_ROW => {
                experiment.close();
                let problem =
                    format!("{MAX_FAILED_IN_A_ROW} pulls in a row have no label, the last one: {reason}");
                return Err(CampaignError::InARow { problem });
            }
            PullOutcome::Failed { .. } => in_a_row += 1,
            _ => in_a_row = 0,
        }
    }
    experiment.close();
    Ok(End::Done(left.len()))
}

impl Experiment<'_> {
    /// Waits for the answer of a person, however long that takes; the robot is looked at meanwhile.
    fn answer(&mut self, name: &str, answer: &Receiver<Option<Drawn>>) -> Result<Option<Drawn>, Fault> {
        loop {
            self.look()?;
            // Readings that are not recorded would fill the memory.
            self.rows.clear();
            match answer.try_recv() {
                Ok(value) => return Ok(value),
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(Fault::Unanswered { name: name.into() }),
            }
        }
    }

    /// What comes before a pull, and the pull.
    fn entries(
        &mut self,
        campaign: &Campaign,
        entries: &[PlannedPull],
        planned: &PlannedPull,
    ) -> ExecutedPull {
        let before = entries.iter().try_for_each(|entry| {
            self.pause(entry.pause_s)?;
            if entry.kind == PullKind::NoLoad { self.read_no_load(entry.dwell_s) } else { Ok(()) }
        });
        match before {
            Ok(()) => self.pull(campaign, planned),
            Err(fault) => self.give_up(planned, &fault),
        }
    }
}
