//! What a twin is expected to measure: the simulator itself, without noise, over the scatter of friction.
//!
//! A measured pull is put into a scenario and goes through the functions that make a sample: real normal force, imprint,
//! friction law on each cell, limit surface, reduced mechanics, force loop, wrist sensor. What a sample draws is averaged:
//! the scatter of friction by quadrature, the noise of the readings by [`label_moments`].

use gripgen::SampleError;
use gripgen::{Indenter, answering_mass_kg, held, jaw_forces_n};
use gripgen::{Library, in_parallel};
use gripgen_physics::grip_point;
use gripgen_physics::{
    Cache, Command, Held, JawFriction, PullPredictor, PullSession, Signals, SimulatePulls,
    campaign_staircases,
};
use gripgen_physics::{PatchFriction, creep_of, sensor_chain};
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::Mechanics;
use gripgen_twin::effects::{CommandChain, OutsideFit, imprint_volume_m3, jaw_tilt_rad};
use gripgen_twin::label::moments::label_moments;
use gripgen_twin::random::{Purpose, Stream, normal_quantile};
use gripgen_twin::{
    ContactPatch, Jaw, MeasuredPull, MeasuredPulls, PerJaw, PullSettings, Scenario, Staircase, Twin,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Longest pull that is looked at.
const MAX_TIME_S: f64 = 120.0;

/// Patches kept: those of a campaign, for the forces of a few models.
const PATCHES: usize = 4096;

/// Nodes and weights of the Gauss-Hermite rule of 9 points for a standard normal variable (Abramowitz and Stegun 1964,
/// table 25.10, scaled). Enough where the label is a smooth function of what the jaws hold.
const SMOOTH_NODES: [(f64, f64); 9] = [
    (-4.512_745_863_399_783, 2.234_584_400_774_66e-5),
    (-3.205_429_002_856_47, 2.789_141_321_231_77e-3),
    (-2.076_847_978_677_83, 4.991_640_676_521_79e-2),
    (-1.023_255_663_789_13, 2.440_975_028_949_39e-1),
    (0.0, 4.063_492_063_492_06e-1),
    (1.023_255_663_789_13, 2.440_975_028_949_39e-1),
    (2.076_847_978_677_83, 4.991_640_676_521_79e-2),
    (3.205_429_002_856_47, 2.789_141_321_231_77e-3),
    (4.512_745_863_399_783, 2.234_584_400_774_66e-5),
];

/// Where it is not: a force that falls by so much after the slip makes the label jump by as much from step to step of the
/// staircase. Falls below this are lost in the scatter.
const SMALL_FALL_N: f64 = 0.1;
/// Equal parts of the distribution then, and one more for each so many newtons of the fall, up to the most.
const STRATA: (usize, f64, usize) = (12, 0.05, 40);

/// Standard deviations of noise within which a reading counts as possible.
const WIDE: f64 = 7.0;

/// Label of one pull as a function of the scatter of friction: standard normal variable, mean and variance over noise, in
/// rising order.
pub type LabelCurve = Vec<(f64, f64, f64)>;

/// A predictor of measured pulls on the rig of `twin`, whose files `library` holds. `jobs` threads share the work.
pub fn pull_predictor<'a>(
    measured: &'a MeasuredPulls,
    twin: &Twin,
    library: &'a Library,
    jobs: usize,
) -> PullPredictor<'a> {
    let simulator =
        Box::new(Simulated { expectations: Expectations::new(measured, library), jobs: jobs.max(1) });
    PullPredictor::new(measured, twin, answering_mass_kg(twin, library), simulator)
}

/// The pulls of a campaign on a few threads.
struct Simulated<'a> {
    expectations: Expectations<'a>,
    jobs: usize,
}

impl SimulatePulls for Simulated<'_> {
    fn labels_n(&self, twin: &Twin, pulls: &[(usize, f64)]) -> Vec<f64> {
        let quiet = QuietTwin::new(twin);
        let label = |k: usize| self.expectations.expected(&quiet, pulls[k].0, pulls[k].1).label_n;
        in_parallel(pulls.len(), self.jobs, label)
    }

    fn readings_n(&self, twin: &Twin, row: usize, factor: f64) -> Vec<f64> {
        self.expectations.readings(&QuietTwin::new(twin), row, factor).measured_n
    }

    fn contact(&self, twin: &Twin, row: usize) -> Vec<(f64, f64)> {
        self.expectations.contact(&QuietTwin::new(twin), row)
    }

    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        in_parallel(n, self.jobs, task);
    }
}

/// What is expected of one pull.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Expected {
    /// What the jaws hold, without scatter.
    pub limit_n: f64,
    /// Mean of the label over scatter and noise.
    pub label_n: f64,
    /// Its standard deviation.
    pub label_sd_n: f64,
}

/// A twin whose pulls are predicted: without noise, and with laws that never refuse.
#[derive(Debug, Clone)]
pub(crate) struct QuietTwin {
    twin: Twin,
    noise_n: f64,
}

impl QuietTwin {
    pub(crate) fn new(twin: &Twin) -> Self {
        let mut twin = twin.clone();
        let noise_n = std::mem::take(&mut twin.wrist.noise_n);
        for effect in &mut twin.effects {
            // A measured pull is always predicted; how many lie outside is counted elsewhere.
            if effect.outside_fit == OutsideFit::Error {
                effect.outside_fit = OutsideFit::Extrapolate;
            }
        }
        Self { twin, noise_n }
    }
}

/// What a patch depends on beside the gels: part, grip, place, and what each jaw does.
type PatchKey = (String, usize, [u64; 9]);

/// The pulls of a campaign, ready to be made on twins.
pub(crate) struct Expectations<'a> {
    measured: &'a MeasuredPulls,
    library: &'a Library,
    staircases: Vec<Arc<Staircase>>,
    patches: Cache<PatchKey, PerJaw<ContactPatch>>,
}

/// The scenario of a measured pull: what was recorded of it, without anything drawn.
pub(crate) fn scenario_of(pull: &MeasuredPull, stop_m: f64, label_tolerance_n: f64) -> Scenario {
    Scenario {
        seed: 0,
        index: 0,
        group: 0,
        repetition: 0,
        part: pull.part.clone(),
        grip_pose: pull.grip_pose,
        grip_force_n: pull.grip_force_n,
        covariates: pull.covariates.clone(),
        pull: PullSettings {
            increment_n: pull.increment_n,
            start_n: pull.start_n,
            step_s: pull.step_s,
            step_jitter: 0.0,
            stop_m,
            direction: [0.0, 0.0, 1.0],
            max_force_n: None,
            max_time_s: MAX_TIME_S,
            label_tolerance_n,
        },
        drawn: BTreeMap::new(),
    }
}

/// The pull of one row on one twin, without its friction.
struct Prepared {
    scenario: Scenario,
    held: Box<Held>,
    /// Real normal force of each jaw.
    force_n: PerJaw<f64>,
    patches: Arc<PerJaw<ContactPatch>>,
    law: PatchFriction,
}

/// Readings of a pull: commands, readings and forces on the contact at the sensor's rate.
#[derive(Default)]
pub(crate) struct Readings {
    pub desired_n: Vec<f64>,
    pub measured_n: Vec<f64>,
    /// First tick at which the jaws slide along the pull.
    pub slip_tick: Option<usize>,
}

impl<'a> Expectations<'a> {
    pub(crate) fn new(measured: &'a MeasuredPulls, library: &'a Library) -> Self {
        Self { measured, library, staircases: campaign_staircases(measured), patches: Cache::new(PATCHES) }
    }

    /// What is expected of the pull at `row` on a twin, its friction multiplied by `factor`.
    pub(crate) fn expected(&self, quiet: &QuietTwin, row: usize, factor: f64) -> Expected {
        self.expected_curve(quiet, row, factor).0
    }

    /// The same, and the label as a function of the scatter.
    pub(crate) fn expected_curve(
        &self,
        quiet: &QuietTwin,
        row: usize,
        factor: f64,
    ) -> (Expected, LabelCurve) {
        let mut curve = LabelCurve::new();
        let Ok(prepared) = self.prepared(quiet, row) else { return (Expected::default(), curve) };
        let factor = factor * quiet.twin.table_factor(&prepared.scenario);
        let part = &quiet.twin.parts[&prepared.scenario.part];
        let mean = prepared.friction(&quiet.twin, factor);
        let limit_n = mean.left.limit_n() + mean.right.limit_n();
        let mut sums = (0.0, 0.0, 0.0);
        let decided_n = self.measured.label_tolerance_n + WIDE * quiet.noise_n;
        for (weight, z) in nodes(part.scatter, (1.0 - part.kinetic_ratio) * limit_n) {
            let friction = prepared.friction(&quiet.twin, (factor * (1.0 + part.scatter * z)).max(0.0));
            let Ok(readings) = self.pull(quiet, row, &prepared, &friction, decided_n) else { continue };
            let (mean, variance) = self.label(quiet, &readings);
            curve.push((z, mean, variance));
            sums = (sums.0 + weight, sums.1 + weight * mean, sums.2 + weight * (mean * mean + variance));
        }
        let (weight, mean, square) = sums;
        if weight == 0.0 {
            return (Expected { limit_n, ..Expected::default() }, curve);
        }
        let label_n = mean / weight;
        let label_sd_n = (square / weight - label_n * label_n).max(0.0).sqrt();
        (Expected { limit_n, label_n, label_sd_n }, curve)
    }

    /// Mean and variance of a label over the noise of the readings.
    fn label(&self, quiet: &QuietTwin, readings: &Readings) -> (f64, f64) {
        let both = readings.desired_n.iter().zip(&readings.measured_n);
        label_moments(both, self.measured.label_tolerance_n, quiet.noise_n).unwrap_or_else(|| {
            // A reading that was never near the command: the reading at the slip stands in.
            let at = readings.slip_tick.unwrap_or(readings.measured_n.len()).saturating_sub(1);
            (readings.measured_n.get(at).copied().unwrap_or(0.0), 0.0)
        })
    }

    /// Readings of the pull at `row` without scatter and noise, to its end, its friction multiplied by `factor`.
    pub(crate) fn readings(&self, quiet: &QuietTwin, row: usize, factor: f64) -> Readings {
        let Ok(prepared) = self.prepared(quiet, row) else { return Readings::default() };
        let factor = factor * quiet.twin.table_factor(&prepared.scenario);
        let friction = prepared.friction(&quiet.twin, factor);
        self.pull(quiet, row, &prepared, &friction, f64::INFINITY).unwrap_or_default()
    }

    fn prepared(&self, quiet: &QuietTwin, row: usize) -> Result<Prepared, SampleError> {
        let twin = &quiet.twin;
        let mut scenario =
            scenario_of(&self.measured.pulls[row], self.measured.stop_m, self.measured.label_tolerance_n);
        let part = &twin.parts[&scenario.part];
        scenario.grip_pose = scenario.grip_pose.min(part.grips.len() - 1);
        let force_n = jaw_forces_n(twin, &scenario)?;
        let grip = |scenario: &Scenario| held(twin, self.library, scenario, force_n, Mechanics::Reduced);
        let mut pressed = scenario.clone();
        let mut found = grip(&pressed)?;
        if found.is_none() {
            // What was measured had contact: jaws that miss the part in the model hold it as in its middle.
            (pressed.covariates.grip_offset_m, pressed.covariates.grip_angle_rad) = (0.0, 0.0);
            found = grip(&pressed)?;
        }
        let held = found.ok_or(SampleError::Missed)?;
        let patches = self.patches.get(patch_key(twin, &pressed, &force_n), || {
            let press =
                Indenter::new(twin, self.library, &pressed, &force_n, &held.grasp, SimdLevel::best())?;
            let whole = |jaw: Jaw| ContactPatch::uniform(force_n[jaw], WHOLE_AREA_M2);
            // Deeper than the gel: the shape of the contact is not known, its force is.
            Ok::<_, SampleError>(match press.contacts() {
                Ok(imprints) => imprints.map(|_, i| i.patch.clone()),
                Err(_) => PerJaw::from_fn(whole),
            })
        })?;
        let law = PatchFriction::new(twin, &scenario, &PerJaw::from_fn(|jaw| &patches[jaw]))?;
        Ok(Prepared { scenario, held, force_n, patches, law })
    }

    /// Of each cell of both patches of a pull its share of the area and of what the jaws hold; nothing where there is none.
    pub(crate) fn contact(&self, quiet: &QuietTwin, row: usize) -> Vec<(f64, f64)> {
        let Ok(prepared) = self.prepared(quiet, row) else { return vec![] };
        let friction = prepared.friction(&quiet.twin, 1.0);
        let cells = || friction.iter().flat_map(|(_, f)| &f.cells);
        let (area_m2, limit_n) =
            cells().fold((0.0, 0.0), |(area, limit), c| (area + c.area_m2, limit + c.limit_n));
        cells().map(|c| (c.area_m2 / area_m2, c.limit_n / limit_n)).collect()
    }

    fn pull(
        &self,
        quiet: &QuietTwin,
        row: usize,
        prepared: &Prepared,
        friction: &PerJaw<JawFriction>,
        decided_n: f64,
    ) -> Result<Readings, SampleError> {
        let (twin, scenario) = (&quiet.twin, &prepared.scenario);
        let signals = Signals {
            noise: Stream::new(0, 0, Purpose::ForceNoise),
            sensor: sensor_chain(twin, scenario),
            command: CommandChain::new(twin, &scenario.part),
            creep: creep_of(twin, scenario, &prepared.force_n),
        };
        // A sensor that remembers goes on rising after the slip; one that does not reads what the jaws hold at most.
        let decides = signals.sensor.is_identity();
        let mut session: PullSession = (*prepared.held).clone().pull(friction, signals);
        let rate_hz = session.rate_hz();
        let mut stairs = self.staircases[row].from(0.0);
        let mut readings = Readings::default();
        for tick in 0..=(MAX_TIME_S * rate_hz) as usize {
            let state = session.state();
            let desired_n = stairs.desired_n(tick as f64 / rate_hz);
            readings.desired_n.push(desired_n);
            readings.measured_n.push(state.measured_force_n);
            let slips = state.sliding && state.speed_m_per_s > 0.0;
            if slips && readings.slip_tick.is_none() {
                readings.slip_tick = Some(tick);
            }
            // The command only rises: a reading this far below it stays there.
            if state.displacement_m > self.measured.stop_m
                || (decides && slips && desired_n - state.measured_force_n > decided_n)
            {
                break;
            }
            session.step(Command::ForceN(desired_n), 1.0 / rate_hz)?;
        }
        Ok(readings)
    }
}

/// Area of a contact of unknown shape: a tenth of a pad.
const WHOLE_AREA_M2: f64 = 6e-5;

impl Prepared {
    fn friction(&self, twin: &Twin, factor: f64) -> PerJaw<JawFriction> {
        let patches = PerJaw::from_fn(|jaw| &self.patches[jaw]);
        self.law.held(twin, &self.scenario, &patches, factor)
    }
}

/// Weights and standard normal nodes over which friction scatters, for a force that falls by `fall_n` after the slip.
fn nodes(scatter: f64, fall_n: f64) -> Vec<(f64, f64)> {
    if scatter == 0.0 {
        return vec![(1.0, 0.0)];
    }
    if fall_n < SMALL_FALL_N {
        return SMOOTH_NODES[1..8].iter().map(|&(z, w)| (w, z)).collect();
    }
    let (fewest, each_n, most) = STRATA;
    let n = (fewest + (fall_n / each_n) as usize).min(most);
    (0..n).map(|i| (1.0, normal_quantile((i as f64 + 0.5) / n as f64))).collect()
}

fn patch_key(twin: &Twin, scenario: &Scenario, force_n: &PerJaw<f64>) -> PatchKey {
    let c = &scenario.covariates;
    let part = &twin.parts[&scenario.part];
    let tilt = |jaw: Jaw| jaw_tilt_rad(twin, &scenario.part, &grip_point(scenario, jaw, 0.0));
    let volume = |jaw: Jaw| imprint_volume_m3(twin, &scenario.part, part, jaw, force_n[jaw]);
    let numbers = [
        c.grip_offset_m,
        c.grip_angle_rad,
        force_n.left,
        force_n.right,
        tilt(Jaw::Left),
        tilt(Jaw::Right),
        volume(Jaw::Left),
        volume(Jaw::Right),
        c.pull_direction,
    ];
    (scenario.part.clone(), scenario.grip_pose, numbers.map(f64::to_bits))
}
