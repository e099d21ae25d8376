//! A rig from Python: the functions that the command line calls, in the caller's thread with its signals.

use crate::{error, values};
use gripgen_cli::Failure;
use gripgen_cli::rig::{
    HowToPull, Permit, PullJob, PullOutcome, PullProgress, RigEvent, check_rig, load_rehearsal, load_rig,
    plan_pulls, plan_rehearsal, rehearsal_text, rehearse_rig,
};
use gripgen_measured::read_campaign;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Time between two looks at the interpreter's signals.
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

/// A value of an event.
#[derive(IntoPyObject)]
enum Item {
    Text(String),
    Number(f64),
    Count(u64),
}

/// What happened, and its values by name.
type Told = (&'static str, Vec<(&'static str, Item)>);

/// Asks every device and checks the programs. Returns what was asked, whether it is right, and what was found.
#[pyfunction]
#[pyo3(signature = (config, overrides = None, rehearsal = None))]
pub fn rig_check(
    py: Python<'_>,
    config: &str,
    overrides: Option<&Bound<'_, PyDict>>,
    rehearsal: Option<PathBuf>,
) -> PyResult<Vec<(String, bool, String)>> {
    let sets = values::overrides(overrides)?;
    let checked = py.detach(|| {
        let config = load_rig(config, &sets)?;
        let rehearsal = rehearsal.as_deref().map(load_rehearsal).transpose()?;
        Ok(check_rig(&config, rehearsal.as_ref(), |_| ()))
    });
    let lines = checked.map_err(|e: Failure| error::failure(py, &e))?;
    Ok(lines.into_iter().map(|line| (line.what.to_string(), line.ok, line.found)).collect())
}

/// Rehearses and returns the text of the file of a rehearsal.
#[pyfunction]
#[pyo3(signature = (config, overrides = None, part = None, grip_force_n = 30.0, dwell_s = 5.0, on_event = None))]
pub fn rig_rehearse(
    py: Python<'_>,
    config: &str,
    overrides: Option<&Bound<'_, PyDict>>,
    part: Option<String>,
    grip_force_n: f64,
    dwell_s: f64,
    on_event: Option<Py<PyAny>>,
) -> PyResult<String> {
    let sets = values::overrides(overrides)?;
    watched(py, on_event.as_ref(), |stop, tell| {
        let rig = load_rig(config, &sets)?;
        let plan = plan_rehearsal(&rig, config, part, grip_force_n, dwell_s)?;
        let mut emit = |event: RigEvent| drop(tell.send(told(&event)));
        rehearsal_text(&rehearse_rig(&rig, &plan, stop, &mut emit)?)
    })
}

/// Makes the pulls of a campaign that have no label yet, into a run folder. Returns how the run stands.
#[pyfunction]
#[pyo3(signature = (config, out, overrides, campaign, parts, grip_force_n, repetitions, seed, rehearsal, after, columns, power_on, unlock, reconnect, on_event))]
#[expect(clippy::too_many_arguments, reason = "the keywords of `gripgen.rig.pull`")]
pub fn rig_pull<'py>(
    py: Python<'py>,
    config: &str,
    out: PathBuf,
    overrides: Option<&Bound<'py, PyDict>>,
    campaign: Option<PathBuf>,
    parts: Vec<String>,
    grip_force_n: Vec<f64>,
    repetitions: usize,
    seed: u64,
    rehearsal: Option<PathBuf>,
    after: Option<PathBuf>,
    columns: Vec<(String, String)>,
    power_on: bool,
    unlock: bool,
    reconnect: u32,
    on_event: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let sets = values::overrides(overrides)?;
    let made = watched(py, on_event.as_ref(), |stop, tell| {
        let rig = load_rig(config, &sets)?;
        let planned = match &campaign {
            Some(path) => read_campaign(path).map_err(Failure::usage)?,
            None => plan_pulls(&rig, config, &parts, &grip_force_n, repetitions, seed)?,
        };
        let job = PullJob::new(rig, planned, rehearsal.as_deref())?.with_notes(&columns, &[])?;
        job.check_programs()?;
        let name = campaign.as_ref().and_then(|path| path.file_stem());
        let name = name.map_or("rig".into(), |stem| stem.to_string_lossy().into_owned());
        let how = HowToPull { permit: Permit { power_on, unlock }, reconnects: reconnect, frames: false };
        let mut emit = |progress: PullProgress<'_>| {
            drop(tell.send(match &progress {
                PullProgress::Rig(event) => told(event),
                PullProgress::Pulled { standing, pull, suspect } => pulled(standing.index, pull, *suspect),
            }));
            Ok(())
        };
        job.open(&name, &out, after.as_deref())?.make(how, stop, &mut |_, _, _| channel().1, &mut emit)
    })?;
    let found = PyDict::new(py);
    found.set_item("failed", made.failed)?;
    found.set_item("suspect", made.suspect)?;
    found.set_item("complete", made.complete)?;
    Ok(found)
}

/// Does `work` in a thread, and meanwhile calls `on_event` here and looks at the signals. An exception of either stops the rig
/// safely and is raised once that has ended.
fn watched<T: Send>(
    py: Python<'_>,
    on_event: Option<&Py<PyAny>>,
    work: impl FnOnce(&AtomicBool, Sender<Told>) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let (tell, told) = channel();
    let (done, raised) = py.detach(move || {
        std::thread::scope(|scope| {
            let stop = &stop;
            let working = scope.spawn(move || work(stop, tell));
            let mut raised = None;
            loop {
                let event = match told.recv_timeout(BETWEEN_LOOKS) {
                    Ok(event) => Some(event),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                if raised.is_some() {
                    continue;
                }
                let seen = Python::attach(|py| {
                    py.check_signals()?;
                    event
                        .zip(on_event)
                        .map(|(event, call)| call.call1(py, (dict_of(py, event)?,)))
                        .transpose()
                });
                if let Err(e) = seen {
                    stop.store(true, Ordering::SeqCst);
                    raised = Some(e);
                }
            }
            (working.join(), raised)
        })
    });
    match (raised, done) {
        (Some(e), _) => Err(e),
        (None, Ok(done)) => done.map_err(|e| error::failure(py, &e)),
        (None, Err(panic)) => std::panic::resume_unwind(panic),
    }
}

fn dict_of(py: Python<'_>, (name, items): Told) -> PyResult<Bound<'_, PyDict>> {
    let event = PyDict::new(py);
    event.set_item("event", name)?;
    items.into_iter().try_for_each(|(key, item)| event.set_item(key, item))?;
    Ok(event)
}

/// An event without its images.
fn told(event: &RigEvent) -> Told {
    let text = |text: &str| Item::Text(text.into());
    match event {
        RigEvent::PullStarted { place, planned } => (
            "pull_started",
            vec![
                ("index", Item::Count(*place)),
                ("part", text(&planned.part)),
                ("grip_force_n", Item::Number(planned.grip_force_n)),
            ],
        ),
        RigEvent::Images { what, .. } => ("images", vec![("what", text(what))]),
        RigEvent::Step(step) => ("step", vec![("step", text(step))]),
        RigEvent::Reading { time_s, desired_n, measured_n, displacement_mm } => (
            "reading",
            vec![
                ("time_s", Item::Number(*time_s)),
                ("desired_n", Item::Number(*desired_n)),
                ("measured_n", Item::Number(*measured_n)),
                ("displacement_mm", Item::Number(*displacement_mm)),
            ],
        ),
        RigEvent::Stopped(stopped) => ("stopped", vec![("reason", text(&stopped.to_string()))]),
        RigEvent::Reconnecting { reason } => ("reconnecting", vec![("reason", text(reason))]),
        RigEvent::Said { source, text: words } => {
            ("said", vec![("source", text(source)), ("text", text(words))])
        }
        _ => ("other", vec![]),
    }
}

fn pulled(index: u64, pull: &gripgen_cli::rig::ExecutedPull, suspect: Option<&str>) -> Told {
    let mut items = vec![("index", Item::Count(index)), ("part", Item::Text(pull.planned.part.clone()))];
    let (status, reason) = match &pull.outcome {
        PullOutcome::Labelled(_) if suspect.is_some() => ("suspect", suspect),
        PullOutcome::Labelled(label) if label.censored => ("censored", None),
        PullOutcome::Labelled(_) => ("slipped", None),
        PullOutcome::NoContact => ("no_contact", None),
        PullOutcome::Failed { reason } => ("failed", Some(reason.as_str())),
    };
    items.push(("status", Item::Text(status.into())));
    if let PullOutcome::Labelled(label) = &pull.outcome {
        items.push(("max_pull_force_n", Item::Number(label.max_pull_force_n)));
    }
    items.extend(reason.map(|reason| ("reason", Item::Text(reason.into()))));
    ("pull_finished", items)
}
