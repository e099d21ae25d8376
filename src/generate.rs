//! One sample: from a scenario to images, trace and label.

use crate::film::{Film, Seen};
use crate::gpu::Gpu;
use crate::gripped::{Contact, Gripped, Indenter};
use crate::library::Library;
use crate::project::Project;
use crate::sample::{SampleError, SimulateOptions};
use gripgen_physics::{
    JawFriction, PatchFriction, PullSession, PullState, Signals, Until, creep_of, pull_staircase_seen,
    sensor_chain, slip_onset_force_n, staircase_of,
};
use gripgen_tactile::{Imprint, Sensor, SimdLevel};
use gripgen_twin::config::{Backend, Mechanics};
use gripgen_twin::effects::CommandChain;
use gripgen_twin::label::check::suspect_simulated;
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{
    FilmPace, GripFriction, ImprintSummary, OpticsState, Outcome, Part, PerJaw, Pulled, Sample, Scenario,
    TactileImage, Twin, slip_label,
};
use std::borrow::Cow;
use std::sync::Arc;

/// What a sample shows of a grip in addition to the data that is stored: for pictures.
pub struct GripImprints {
    /// Imprints of both jaws on the pixels of their images, without optics effects; patches are those of the pads.
    pub imprint: PerJaw<Imprint>,
    /// Sensors of both jaws.
    pub sensors: PerJaw<Arc<Sensor>>,
}

/// Simulates sample `index` of a sweep. Depends on the project and the index alone; `level` changes no bit.
pub fn generate(project: &Project, index: u64, level: SimdLevel) -> Sample {
    made(project, index, level, None).0
}

/// The same with the film of its pull, where the sweep has films and the pull took place.
pub fn generate_filmed(project: &Project, index: u64, level: SimdLevel) -> (Sample, Option<Film>) {
    made(project, index, level, project.sweep.film)
}

fn made(project: &Project, index: u64, level: SimdLevel, film: Option<FilmPace>) -> (Sample, Option<Film>) {
    let mut scenario = drawn_scenario(project, index);
    let (outcome, film) = try_generate(project, index, level, &mut scenario, film).unwrap_or_else(|e| {
        let reason = format!("{e} (sample {index}, seed {})", project.sweep.seed);
        (Outcome::Failed { reason }, None)
    });
    (Sample { scenario, outcome }, film)
}

/// What is known of a sample before its own twin is: enough to record one that fails.
pub fn drawn_scenario(project: &Project, index: u64) -> Scenario {
    project.sweep.scenario(index, &project.twin).0
}

fn try_generate(
    project: &Project,
    index: u64,
    level: SimdLevel,
    known: &mut Scenario,
    film: Option<FilmPace>,
) -> Result<(Outcome, Option<Film>), SampleError> {
    let twin = project.twin_of(index)?;
    let (scenario, usable) = project.sweep.scenario(index, &twin);
    *known = scenario;
    usable?;
    let options = SimulateOptions::of(&project.sweep, level);
    let grip = || Gripped::new(&twin, &project.library, known, options);
    // Repetitions of a configuration share their grip.
    let gripped = match project.sweep.repetitions_share_grip() {
        false => Arc::new(grip()?),
        true => project.grips.get((known.group, options), grip)?,
    };
    let gpu = if options.images { project.gpu()? } else { None };
    let Some(pace) = film else { return Ok((pull(&twin, known, &gripped, options, gpu, |_| {})?, None)) };
    filmed(&twin, &project.library, known, &gripped, options, pace)
}

/// Simulates one scenario on a twin. `gpu` makes the images where `options` say so.
///
/// # Errors
///
/// What makes a sample fail: a grip, an imprint, a friction law, a pull or the GPU ([`SampleError`]).
pub fn simulate(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    options: SimulateOptions,
    gpu: Option<&Gpu>,
) -> Result<Outcome, SampleError> {
    pull(twin, scenario, &Gripped::new(twin, library, scenario, options)?, options, gpu, |_| {})
}

/// The same of a grip that is there, without images.
pub fn pull_gripped(
    twin: &Twin,
    scenario: &Scenario,
    gripped: &Gripped,
    options: SimulateOptions,
) -> Result<Outcome, SampleError> {
    pull(twin, scenario, gripped, SimulateOptions { images: false, ..options }, None, |_| {})
}

/// A grip that is ready to pull.
pub struct StartedPull {
    /// What the cameras see, where images are wanted.
    pub images: Option<PerJaw<TactileImage>>,
    /// The pull; `None` if the jaws miss the part.
    pub session: Option<PullSession>,
}

/// Grips for a scenario and stops before the pull, which the caller commands step by step.
///
/// # Errors
///
/// What makes a sample fail before its pull: a grip, an imprint or a friction law ([`SampleError`]).
pub fn start_pull(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    options: SimulateOptions,
) -> Result<StartedPull, SampleError> {
    let gripped = Gripped::new(twin, library, scenario, options)?;
    let images =
        if options.images { Some(gripped.images(twin, scenario, options.noise, None)?) } else { None };
    let session = match &gripped.contact {
        Some(contact) => Some(pull_session(twin, scenario, contact)?.0),
        None => None,
    };
    Ok(StartedPull { images, session })
}

/// The session of this repetition, the friction laws of both jaws, and the factor of its scatter.
pub fn pull_session(
    twin: &Twin,
    scenario: &Scenario,
    contact: &Contact,
) -> Result<(PullSession, PerJaw<GripFriction>, f64), SampleError> {
    let (friction, law, scatter) = held_friction(twin, scenario, contact)?;
    Ok((started(twin, scenario, contact, &friction), law, scatter))
}

fn started(
    twin: &Twin,
    scenario: &Scenario,
    contact: &Contact,
    friction: &PerJaw<JawFriction>,
) -> PullSession {
    let signals = Signals {
        noise: Stream::new(scenario.seed, scenario.index, Purpose::ForceNoise),
        sensor: sensor_chain(twin, scenario),
        command: CommandChain::new(twin, &scenario.part),
        creep: creep_of(twin, scenario, &contact.force_n),
    };
    (*contact.held).clone().pull(friction, signals)
}

/// What the jaws hold in this repetition, the friction laws of both, and the factor of its scatter.
fn held_friction(
    twin: &Twin,
    scenario: &Scenario,
    contact: &Contact,
) -> Result<(PerJaw<JawFriction>, PerJaw<GripFriction>, f64), SampleError> {
    let patches = PerJaw::from_fn(|jaw| &contact.imprint[jaw].patch);
    let law = PatchFriction::new(twin, scenario, &patches)?;
    let scatter = scatter(&twin.parts[&scenario.part], scenario) * twin.table_factor(scenario);
    Ok((law.held(twin, scenario, &patches, scatter), law.law, scatter))
}

/// A pull and its film.
fn filmed(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    gripped: &Gripped,
    options: SimulateOptions,
    pace: FilmPace,
) -> Result<(Outcome, Option<Film>), SampleError> {
    let mut states = Vec::new();
    // A film goes to the end of the pull, whether its trace is stored or not.
    let whole = SimulateOptions { trace: true, ..options };
    let mut outcome = pull(twin, scenario, gripped, whole, None, |state| states.push(*state))?;
    let (Outcome::Pulled(pulled), Some(contact)) = (&mut outcome, &gripped.contact) else {
        return Ok((outcome, None));
    };
    if !options.trace {
        // Only a trace that is stored is evidence.
        pulled.suspect = None;
    }
    let friction = held_friction(twin, scenario, contact)?.0;
    let seen = Seen { states: &states, trace: &pulled.trace, friction: &friction, pace };
    let film = Film::new(twin, library, scenario, gripped, contact, options, &seen)?;
    Ok((outcome, Some(film)))
}

/// The second half of a sample: friction of this repetition, pull, label, image noise. `see` is called with each state of
/// the pull.
fn pull(
    twin: &Twin,
    scenario: &Scenario,
    gripped: &Gripped,
    options: SimulateOptions,
    gpu: Option<&Gpu>,
    mut see: impl FnMut(&PullState),
) -> Result<Outcome, SampleError> {
    let images =
        if options.images { Some(gripped.images(twin, scenario, options.noise, gpu)?) } else { None };
    let Some(contact) = &gripped.contact else {
        return Ok(Outcome::NoContact { images });
    };
    let (friction, law, factor) = held_friction(twin, scenario, contact)?;
    let onset_n = slip_onset_force_n(&twin.gel, &friction);
    let (mut slip_onset_s, mut slip_s) = (None, None);
    let watched = |state: &PullState| {
        if state.sliding && slip_s.is_none() {
            slip_s = Some(state.time_s);
        }
        if slip_onset_s.is_none() && (state.sliding || state.contact_force_n > onset_n) {
            slip_onset_s = Some(state.time_s);
        }
        see(state);
    };
    let mut session = started(twin, scenario, contact, &friction);
    let mut jitter = Stream::new(scenario.seed, scenario.index, Purpose::StepJitter);
    let staircase = staircase_of(&scenario.pull, &mut jitter);
    let until = if options.trace { Until::Stopped } else { Until::Decided };
    let result = pull_staircase_seen(&mut session, &staircase, &scenario.pull, until, watched)?;
    let label = slip_label(&result.trace, scenario.pull.label_tolerance_n, result.slid)?;
    // A pull that ends as soon as its label is decided has no whole trace.
    let suspect = if options.trace { suspect_simulated(twin, scenario, &result.trace, &label) } else { None };
    let Contact { held, imprint, force_n } = contact;
    let summary =
        imprint.map(|_, i| ImprintSummary { press_depth_m: i.press_depth_m, patch: i.patch.clone() });
    Ok(Outcome::Pulled(Box::new(Pulled {
        grasp: held.grasp.clone(),
        imprint: summary,
        images,
        mu_drawn: twin.parts[&scenario.part].mu * scatter(&twin.parts[&scenario.part], scenario),
        mu_effective: mean_mu(&law, force_n) * factor,
        outside_fit: law.left.outside_fit || law.right.outside_fit,
        lag_exceeds_tolerance: lag_exceeds_tolerance(twin, scenario),
        trace: result.trace,
        label,
        forces: result.forces,
        limit_force_n: friction.left.limit_n() + friction.right.limit_n(),
        slip_onset_s,
        slip_s,
        suspect,
    })))
}

/// The imprints of a scenario's grip, without pulling; `None` without contact.
///
/// # Errors
///
/// A grip or an imprint that fails.
pub fn press_only(
    twin: &Twin,
    library: &Library,
    scenario: &Scenario,
    mechanics: Mechanics,
) -> Result<Option<GripImprints>, SampleError> {
    let options = SimulateOptions {
        mechanics,
        images: false,
        noise: true,
        trace: false,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    };
    let Gripped { sensors, contact, .. } = Gripped::new(twin, library, scenario, options)?;
    let Some(Contact { held, imprint, force_n }) = contact else { return Ok(None) };
    let press = Indenter::new(twin, library, scenario, &force_n, &held.grasp, options.level)?;
    let plain = OpticsState::default();
    let imprint = PerJaw::try_from_fn(|jaw| press.seen(jaw, &imprint[jaw], &plain).map(Cow::into_owned))?;
    Ok(Some(GripImprints { imprint, sensors }))
}

/// Whether the steady lag error of the force loop, `dF / dt (tau + T)`, is more than half the label tolerance.
fn lag_exceeds_tolerance(twin: &Twin, scenario: &Scenario) -> bool {
    let pull = &scenario.pull;
    let trails_n = pull.increment_n / pull.step_s * (twin.robot.lag_s + twin.robot.dead_time_s);
    trails_n > 0.5 * pull.label_tolerance_n
}

/// Friction coefficient of both jaws together.
fn mean_mu(law: &PerJaw<GripFriction>, force_n: &PerJaw<f64>) -> f64 {
    let (left, right) = (law.left.mu, law.right.mu);
    if left == right {
        return left;
    }
    (left * force_n.left + right * force_n.right) / (force_n.left + force_n.right)
}

/// The factor by which this grip's friction differs from the mean, never negative.
fn scatter(part: &Part, scenario: &Scenario) -> f64 {
    if part.scatter == 0.0 {
        return 1.0;
    }
    let z = Stream::new(scenario.seed, scenario.index, Purpose::Scatter).normal();
    (1.0 + part.scatter * z).max(0.0)
}
