//! The twin as what a virtual rig moves: grips where the tool is, pulls that somebody else commands.

use gripgen::{
    Gripped, LoadError, Location, Project, SampleError, SimulateOptions, load_twin_document, pull_session,
};
use gripgen_physics::{Command, PullSession};
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::{Backend, Mechanics};
use gripgen_twin::effects::{SensorChain, SensorPoint};
use gripgen_twin::frames::Pose;
use gripgen_twin::plant::{EmptyGrip, Grip, GripRequest, Plant, PlantError, PullReading, PullRequest};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Covariates, PerJaw, PullCount, Scenario, TactileImage, Twin};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use std::fmt::Display;
use std::sync::{Arc, Mutex, PoisonError};

/// Height of the grip centres above the robot's base, and how far the first is in front of it.
const FIXTURE_Z_M: f64 = 0.25;
const FIXTURE_X_M: f64 = 0.45;
/// Distance between fixtures.
const FIXTURE_STEP_M: f64 = 0.12;
/// A tool that is further from a fixture than this has nothing between its jaws.
const REACH_M: f64 = 0.05;
/// Across the part, and along the pull, the jaws miss it sooner.
const BESIDE_M: f64 = 0.02;

/// Where a part is mounted: the pose of the tool that grips it in its middle at a grip angle of 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// Name of the part.
    pub part: String,
    /// The tool in the robot's base: x along the part's long axis, y along the jaws' axis, z down.
    pub base_from_tool: Pose,
}

/// A twin with its parts mounted in fixtures, and a clock that its pulls are counted by.
pub struct TwinPlant {
    project: Arc<Project>,
    fixtures: Vec<Fixture>,
    seed: u64,
    counted: Arc<Mutex<Counted>>,
    /// What is seen where a sensor file has become unreadable since the start.
    rest: PerJaw<TactileImage>,
}

/// Why a twin cannot be moved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenPlantError {
    /// Its configuration, or a file that it names.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// What its cameras see with the jaws open.
    #[error(transparent)]
    Rest(#[from] SampleError),
}

#[derive(Default)]
struct Counted {
    pulls: u64,
    count: PullCount,
}

impl TwinPlant {
    /// Loads a twin with its files and mounts its parts side by side along the base's y axis, in the order of their names.
    ///
    /// # Errors
    ///
    /// Where it cannot be loaded, or what its cameras see with the jaws open cannot be rendered.
    pub fn open(twin: &Location, sets: &[(String, String)], seed: u64) -> Result<Self, OpenPlantError> {
        let document = load_twin_document(twin, sets)?;
        let checked = document.read_twin().and_then(|file| Twin::new(&file));
        let checked = checked.map_err(|e| LoadError::from(document.located(e)))?;
        let parts: Vec<&str> = checked.parts.keys().map(String::as_str).collect();
        let project = Arc::new(Project::of_twin(twin, &parts, true, sets)?);
        let first_y_m = -0.5 * FIXTURE_STEP_M * (parts.len().max(1) - 1) as f64;
        let mounted = parts.iter().enumerate().map(|(i, part)| {
            let position_m = Vector3::new(FIXTURE_X_M, first_y_m + i as f64 * FIXTURE_STEP_M, FIXTURE_Z_M);
            let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            Fixture {
                part: (*part).into(),
                base_from_tool: Pose::from_parts(Translation3::from(position_m), down),
            }
        });
        let fixtures: Vec<Fixture> = mounted.collect();
        let rest = rest_images(&project, &scenario_of_part(&project, &fixtures[0].part, seed, 0.0))?;
        Ok(Self { project, fixtures, seed, counted: Arc::default(), rest })
    }

    /// Where the parts are.
    pub fn fixtures(&self) -> &[Fixture] {
        &self.fixtures
    }

    /// The twin.
    pub fn twin(&self) -> &Twin {
        &self.project.twin
    }

    /// A pull without a load at this time.
    fn at_rest(&self, time_s: f64) -> Scenario {
        scenario_of_part(&self.project, &self.fixtures[0].part, self.seed, time_s)
    }

    /// The jaws close where the tool is. `None` if nothing is there.
    fn close(&self, how: &GripRequest) -> Result<Option<PlantGrip>, SampleError> {
        let Some((part, offset_m, angle_rad)) = self.part_at(&how.base_from_tool) else { return Ok(None) };
        let mut scenario = scenario_of_part(&self.project, part, self.seed, how.time_s);
        scenario.grip_force_n = how.force_per_jaw_n;
        {
            let counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
            (scenario.index, scenario.group) = (counted.pulls, counted.pulls);
        }
        scenario.covariates.pull_index = scenario.index;
        (scenario.covariates.grip_offset_m, scenario.covariates.grip_angle_rad) = (offset_m, angle_rad);
        let Project { twin, library, .. } = &*self.project;
        let gripped = Gripped::new(twin, library, &scenario, options(true))?;
        let images = gripped.images(twin, &scenario, true, None)?;
        let Some(contact) = &gripped.contact else { return Ok(None) };
        let gel_from_part = &contact.held.grasp.gel_from_part;
        let width_m = gel_from_part.left.translation.z + gel_from_part.right.translation.z;
        let (project, counted) = (self.project.clone(), self.counted.clone());
        Ok(Some(PlantGrip { project, counted, scenario, images, width_m, pull: None, session: None }))
    }

    /// The part between the jaws of a tool, the lever along its long axis, and the angle about the jaws' axis.
    fn part_at(&self, base_from_tool: &Pose) -> Option<(&str, f64, f64)> {
        let relative = |fixture: &Fixture| fixture.base_from_tool.inv_mul(base_from_tool);
        let distance_m = |fixture: &Fixture| relative(fixture).translation.vector.norm();
        let nearest = self.fixtures.iter().min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))?;
        let pose = relative(nearest);
        let [x_m, y_m, z_m] = pose.translation.vector.into();
        if x_m.abs() > REACH_M || y_m.abs() > BESIDE_M || z_m.abs() > BESIDE_M {
            return None;
        }
        let turned = pose.rotation * Vector3::x();
        Some((&nearest.part, x_m, libm::atan2(-turned.z, turned.x)))
    }
}

impl Plant for TwinPlant {
    fn rest_images(&self, time_s: f64) -> PerJaw<TactileImage> {
        rest_images(&self.project, &self.at_rest(time_s)).unwrap_or_else(|_| self.rest.clone())
    }

    fn grip(&self, how: &GripRequest) -> Result<Box<dyn Grip>, PlantError> {
        Ok(match self.close(how).map_err(problem)? {
            Some(grip) => Box::new(grip),
            None => Box::new(EmptyGrip { images: self.rest_images(how.time_s) }),
        })
    }

    fn offset_n(&self, time_s: f64) -> f64 {
        let (twin, scenario) = (&self.project.twin, self.at_rest(time_s));
        let chain = SensorChain::new(twin, &scenario.part, SensorPoint::start_of(&scenario.covariates));
        chain.along(1.0).plus(twin.table_offset_n(&scenario)).read(0.0, 0.0, 0.0)
    }

    fn noise_n(&self, tick: u64) -> f64 {
        // Lanes 0 and 1 are those of pulls and of their no-load readings.
        let mut noise = Stream::with_lane(self.seed, tick, Purpose::ForceNoise, 2);
        self.project.twin.wrist.noise_n * noise.normal()
    }
}

fn problem(e: impl Display) -> PlantError {
    PlantError { problem: e.to_string() }
}

fn scenario_of_part(project: &Project, part: &str, seed: u64, time_s: f64) -> Scenario {
    let mut scenario = project.sweep.scenario(0, &project.twin).0;
    (scenario.seed, scenario.index, scenario.group, scenario.repetition) = (seed, 0, 0, 0);
    scenario.part = part.into();
    scenario.grip_pose = 0;
    scenario.drawn.clear();
    scenario.covariates = Covariates { time_s, ..Covariates::default() };
    scenario.pull.step_jitter = 0.0;
    scenario
}

/// What the cameras see with the jaws open.
fn rest_images(project: &Project, scenario: &Scenario) -> Result<PerJaw<TactileImage>, SampleError> {
    let Project { twin, library, .. } = project;
    Gripped::at_rest(twin, library, scenario, options(true))?.images(twin, scenario, true, None)
}

/// Jaws closed on a part.
struct PlantGrip {
    project: Arc<Project>,
    counted: Arc<Mutex<Counted>>,
    scenario: Scenario,
    images: PerJaw<TactileImage>,
    width_m: f64,
    /// Number of the pull in this grip, once it has begun.
    pull: Option<u64>,
    session: Option<PullSession>,
}

impl PlantGrip {
    /// Friction is that of this dwell, this loading rate, and as many pulls as there were.
    fn begin(&mut self, pull: &PullRequest) -> Result<(), SampleError> {
        let s = &mut self.scenario;
        (s.covariates.dwell_s, s.covariates.time_s) = (pull.dwell_s, pull.time_s);
        s.covariates.pull_direction = pull.direction;
        (s.pull.increment_n, s.pull.step_s) = (pull.increment_n, pull.step_s);
        {
            let mut counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
            let began_anew = self.pull.is_some();
            let pull = *self.pull.get_or_insert(counted.pulls);
            s.covariates.pull_index = pull;
            if !began_anew {
                counted.pulls += 1;
                counted.count.mark(&mut s.covariates);
            }
        }
        let Project { twin, library, .. } = &*self.project;
        let gripped = Gripped::new(twin, library, &self.scenario, options(false))?;
        if let Some(contact) = &gripped.contact {
            self.session = Some(pull_session(twin, &self.scenario, contact)?.0);
        }
        Ok(())
    }

    fn reading(&self) -> PullReading {
        let state = self.session.as_ref().map(PullSession::state);
        state.map_or(PullReading::default(), |s| PullReading {
            measured_n: s.measured_force_n,
            displacement_m: s.displacement_m,
            speed_m_s: s.speed_m_per_s,
        })
    }
}

impl Grip for PlantGrip {
    fn width_mm(&self) -> f64 {
        1e3 * self.width_m
    }

    fn holds(&self) -> bool {
        true
    }

    fn images(&self) -> &PerJaw<TactileImage> {
        &self.images
    }

    fn begin_pull(&mut self, pull: &PullRequest) -> Result<PullReading, PlantError> {
        self.begin(pull).map_err(problem)?;
        Ok(self.reading())
    }

    fn pull(&mut self, force_n: f64, step_s: f64) -> Result<PullReading, PlantError> {
        if let Some(session) = &mut self.session {
            session.step(Command::ForceN(force_n), step_s).map_err(|e| problem(SampleError::from(e)))?;
        }
        Ok(self.reading())
    }
}

fn options(images: bool) -> SimulateOptions {
    SimulateOptions {
        mechanics: Mechanics::Reduced,
        images,
        noise: true,
        trace: true,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::frames::tool_at;

    fn plant() -> TwinPlant {
        TwinPlant::open(&Location::parse("asset:configs/twin-baseline.toml"), &[], 3).unwrap()
    }

    fn request(base_from_tool: &Pose, force_per_jaw_n: f64, time_s: f64) -> GripRequest {
        GripRequest { base_from_tool: *base_from_tool, force_per_jaw_n, time_s }
    }

    #[test]
    fn the_tool_says_which_part_is_gripped_and_where() {
        let plant = plant();
        let fixture = &plant.fixtures()[1];
        for (offset_m, angle_deg) in [(0.0, 0.0), (2e-3, 30.0), (-1.5e-3, 90.0), (0.0, -45.0)] {
            let tool = tool_at(&fixture.base_from_tool, offset_m, f64::to_radians(angle_deg));
            let (part, x_m, rad) = plant.part_at(&tool).unwrap();
            assert_eq!(part, fixture.part);
            assert!((x_m - offset_m).abs() < 1e-12 && (rad.to_degrees() - angle_deg).abs() < 1e-9);
        }
        let mut away = fixture.base_from_tool;
        away.translation.z += 0.1;
        let mut grip = plant.grip(&request(&away, 20.0, 0.0)).unwrap();
        assert!(!grip.holds() && grip.width_mm() == 0.0 && *grip.images() == plant.rest);
        assert_eq!(grip.pull(9.0, 0.1).unwrap(), PullReading::default());
    }

    /// The same pull as that of a sweep: what the rig reads is what the staircase reads.
    #[test]
    fn a_pull_on_the_plant_is_a_pull_of_the_twin() {
        let plant = plant();
        let fixture = plant.fixtures().iter().find(|f| f.part == "long_shaft").unwrap();
        let mut grip = plant.close(&request(&fixture.base_from_tool, 40.0, 5.0)).unwrap().unwrap();
        let width_mm = grip.width_mm();
        assert!(grip.holds() && width_mm > 1.0 && width_mm < 60.0, "{width_mm}");
        let pull = PullRequest { direction: 1.0, increment_n: 1.0, step_s: 0.104, dwell_s: 1.0, time_s: 7.0 };
        let mut reading = grip.begin_pull(&pull).unwrap();
        let (mut tick, mut largest_n) = (0, 0.0_f64);
        while reading.displacement_m < 5e-3 && tick < 20_000 {
            let desired_n = ((f64::from(tick) * 0.002 + 1e-9) / 0.104).floor() + 1.0;
            reading = grip.pull(desired_n, 0.002).unwrap();
            largest_n = largest_n.max(reading.measured_n);
            tick += 1;
        }
        let scenario = grip.scenario.clone();
        let twin = plant.twin();
        let outcome = gripgen::simulate(twin, &plant.project.library, &scenario, options(false), None);
        let gripgen_twin::Outcome::Pulled(pulled) = outcome.unwrap() else { panic!("it slips") };
        let peak = pulled.trace.measured_force_n.iter().copied().fold(0.0, f64::max);
        assert_eq!(largest_n, peak);
        assert!((f64::from(tick) * 0.002 - pulled.trace.time_s.last().unwrap()).abs() < 0.005);
    }
}
