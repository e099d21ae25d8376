//! A campaign made on a twin instead of on a rig, and the options of a first one from a twin.

use super::diagnose::given_model;
use super::expect::pull_predictor;
use gripgen::Location;
use gripgen::SimulateOptions;
use gripgen::simulate;
use gripgen::{LoadError, Project, load_twin_document};
use gripgen_identify::pulls::detectable::{DetectableEffect, detectable_effects};
use gripgen_measured::{LoadedPulls, MissingCells};
use gripgen_physics::sensor_chain;
use gripgen_record::sha256_hex;
use gripgen_tactile::SimdLevel;
use gripgen_twin::columns::{Column, covariates};
use gripgen_twin::config::{Backend, Mechanics, Twist};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::rounded;
use gripgen_twin::{
    Campaign, Covariates, MeasuredPull, MeasuredPulls, Outcome, PlannedPull, PullCount, PullKind, PullTrace,
    Scenario, TraceRow, Twin,
};

/// Time between readings of a stored trace; the label is taken at the full rate.
const TRACE_STEP_S: f64 = 0.01;
/// The no-load reading before a pull.
const NO_LOAD_S: f64 = 0.5;

/// Why a campaign cannot be made on a twin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateCampaignError {
    /// The twin, or a file that it names.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A part that the twin does not have.
    #[error("pulls[{index}]: the twin has no part `{part}`; its parts: {known}")]
    Part {
        /// Which entry of the campaign.
        index: usize,
        /// Its part.
        part: String,
        /// Those of the twin.
        known: String,
    },
    /// More force than the gripper has.
    #[error("pulls[{index}]: {} N per jaw, the gripper has at most {max_n} N per jaw", rounded(*.force_n, &[*.max_n]))]
    Force {
        /// Which entry of the campaign.
        index: usize,
        /// Its grip force.
        force_n: f64,
        /// Limit of the gripper.
        max_n: f64,
    },
}

/// Makes a campaign on a twin with the reduced mechanics: the measurements that a rig which is this twin would give, with
/// scatter and noise. `sets` are overrides of the twin. The same arguments give the same measurements.
///
/// Pull `i` of the campaign has the id `p` and four digits; its clock is the time that the campaign took so far. Pulls
/// that fail or do not slip are left out and counted in the notes; entries without a load only take their time.
///
/// # Errors
///
/// A twin that cannot be loaded, a part that it lacks, or a grip force beyond its gripper.
pub fn simulate_campaign(
    twin: &Location,
    sets: &[(String, String)],
    campaign: &Campaign,
    seed: u64,
) -> Result<LoadedPulls, SimulateCampaignError> {
    let mut project = load(twin, sets, campaign)?;
    if let Some(feedback) = campaign.feedback {
        project.twin.robot.feedback = feedback;
    }
    let (mut pulls, mut clock_s, mut left_out) = (Vec::new(), 0.0, 0);
    let made = campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).count();
    let mut index = 0;
    let mut count = PullCount::default();
    for planned in &campaign.pulls {
        clock_s += planned.pause_s;
        if planned.kind == PullKind::Pull {
            let mut scenario = scenario(&project, campaign, planned, seed, index, clock_s);
            count.mark(&mut scenario.covariates);
            match pull(&project, &scenario, index) {
                Some(pull) => pulls.push(pull),
                None => left_out += 1,
            }
            index += 1;
        }
        clock_s += planned.estimated_s(campaign.label_tolerance_n) - planned.pause_s;
    }
    let notes = match left_out {
        0 => Vec::new(),
        n => vec![format!("{n} of {made} pulls were left out: they failed or did not slip")],
    };
    let there = |column: &&Column| pulls.iter().any(|p: &MeasuredPull| column.value(p.view()).is_some());
    let recorded = covariates().filter(there).map(|c| c.name.into()).collect();
    let text = format!("{}{seed}{:?}", project.config_sha256, campaign);
    Ok(LoadedPulls {
        missing: MissingCells::default(),
        pulls: MeasuredPulls {
            pulls,
            recorded,
            extra: Vec::new(),
            label_tolerance_n: campaign.label_tolerance_n,
            stop_m: campaign.stop_m,
            feedback: Some(project.twin.robot.feedback),
            sha256: sha256_hex(text.as_bytes()),
        },
        notes,
        warnings: Vec::new(),
        implausible: None,
    })
}

/// What a campaign shows of the effects whose columns it varies, by labels alone: it is made on the twin without the effects of that. `None` where
/// nothing can be fitted to it.
///
/// # Errors
///
/// As [`simulate_campaign`].
pub fn detectable_in_campaign(
    twin: &Location,
    sets: &[(String, String)],
    campaign: &Campaign,
    seed: u64,
    jobs: usize,
) -> Result<Option<Vec<DetectableEffect>>, SimulateCampaignError> {
    let plain: Vec<(String, String)> =
        sets.iter().cloned().chain([("effects".to_string(), "[]".to_string())]).collect();
    let project = load(twin, &plain, campaign)?;
    if project.twin.robot.twist == Twist::Free {
        return Ok(None);
    }
    let mut measured = simulate_campaign(twin, &plain, campaign, seed)?.pulls;
    measured.pulls.iter_mut().for_each(|pull| pull.trace = None);
    let predictor = pull_predictor(&measured, &project.twin, &project.library, jobs);
    let Ok(given) = given_model(&project.twin, predictor.part_names()) else { return Ok(None) };
    Ok(detectable_effects(&measured, &predictor, &given))
}

/// The twin of `twin` with the files of the campaign's parts, as a sweep that is never run.
fn load(
    twin: &Location,
    sets: &[(String, String)],
    campaign: &Campaign,
) -> Result<Project, SimulateCampaignError> {
    let document = load_twin_document(twin, sets)?;
    let checked = document.read_twin().and_then(|file| Twin::new(&file)).map_err(LoadError::Config)?;
    let mut parts: Vec<&str> = Vec::new();
    for (index, pull) in campaign.pulls.iter().enumerate().filter(|(_, p)| p.kind == PullKind::Pull) {
        if !checked.parts.contains_key(&pull.part) {
            let known = checked.parts.keys().cloned().collect::<Vec<_>>().join(", ");
            return Err(SimulateCampaignError::Part { index, part: pull.part.clone(), known });
        }
        if pull.grip_force_n > checked.gripper.max_force_n {
            let (force_n, max_n) = (pull.grip_force_n, checked.gripper.max_force_n);
            return Err(SimulateCampaignError::Force { index, force_n, max_n });
        }
        if !parts.contains(&pull.part.as_str()) {
            parts.push(&pull.part);
        }
    }
    Ok(Project::of_twin(twin, &parts, false, sets)?)
}

fn scenario(
    project: &Project,
    campaign: &Campaign,
    planned: &PlannedPull,
    seed: u64,
    index: u64,
    clock_s: f64,
) -> Scenario {
    let mut scenario = project.sweep.scenario(0, &project.twin).0;
    (scenario.seed, scenario.index, scenario.group, scenario.repetition) = (seed, index, index, 0);
    scenario.part.clone_from(&planned.part);
    (scenario.grip_pose, scenario.grip_force_n) = (0, planned.grip_force_n);
    scenario.drawn.clear();
    scenario.covariates = Covariates {
        pull_index: index,
        // A pull's clock is that of its start.
        time_s: ((clock_s + planned.dwell_s) * 1e3).round() / 1e3,
        ..planned.covariates()
    };
    scenario.pull.increment_n = planned.force_increment_n;
    scenario.pull.start_n = planned.force_start_n;
    scenario.pull.step_s = planned.step_time_s;
    scenario.pull.step_jitter = 0.0;
    scenario.pull.stop_m = campaign.stop_m;
    scenario.pull.label_tolerance_n = campaign.label_tolerance_n;
    scenario
}

/// One pull as a rig would record it; `None` if there is no label.
fn pull(project: &Project, scenario: &Scenario, index: u64) -> Option<MeasuredPull> {
    let options = SimulateOptions {
        mechanics: Mechanics::Reduced,
        images: false,
        noise: true,
        trace: true,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    };
    let Ok(Outcome::Pulled(pulled)) = simulate(&project.twin, &project.library, scenario, options, None)
    else {
        return None;
    };
    if pulled.label.censored || pulled.label.max_pull_force_n < 0.0 {
        return None;
    }
    Some(MeasuredPull {
        id: format!("p{index:04}"),
        part: scenario.part.clone(),
        grip_pose: scenario.grip_pose,
        grip_force_n: scenario.grip_force_n,
        increment_n: scenario.pull.increment_n,
        start_n: scenario.pull.start_n,
        step_s: scenario.pull.step_s,
        covariates: scenario.covariates.clone(),
        max_pull_force_n: (pulled.label.max_pull_force_n * 1e3).round() / 1e3,
        zero_shift_n: 0.0,
        trace: Some(stored(&project.twin, scenario, &pulled.trace)),
    })
}

/// The no-load reading and the pull, at the rate of a stored trace.
fn stored(twin: &Twin, scenario: &Scenario, trace: &PullTrace) -> PullTrace {
    let every = (TRACE_STEP_S / twin.wrist.step_s()).round().max(1.0) as usize;
    let step_s = every as f64 * twin.wrist.step_s();
    let mut sensor = sensor_chain(twin, scenario);
    // The noise of the pull itself is lane 0.
    let mut noise = Stream::with_lane(scenario.seed, scenario.index, Purpose::ForceNoise, 1);
    let before = (NO_LOAD_S / step_s).round() as usize;
    let rounded = |x: f64, digits: f64| (x * digits).round() / digits;
    let row = |row: TraceRow| TraceRow {
        time_s: rounded(row.time_s, 1e6),
        desired_force_n: rounded(row.desired_force_n, 1e6),
        measured_force_n: rounded(row.measured_force_n, 1e3),
        displacement_m: rounded(row.displacement_m, 1e7),
    };
    let unloaded = (0..before).map(|i| {
        let time_s = -((before - i) as f64) * step_s;
        let measured_force_n = sensor.read(0.0, time_s, step_s) + twin.wrist.noise_n * noise.normal();
        TraceRow { time_s, desired_force_n: 0.0, measured_force_n, displacement_m: 0.0 }
    });
    unloaded.chain(trace.rows().step_by(every)).map(row).collect()
}
