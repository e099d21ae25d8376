//! What a scenario makes of a twin: direction, wrist sensor, creep, and the arguments of its effects.

use gripgen_twin::effects::{Creep, GripPoint, SensorChain, SensorPoint, creep};
use gripgen_twin::{Jaw, PerJaw, Scenario, Twin};

/// Unit vector of the pull in `world`.
pub fn pull_direction(scenario: &Scenario) -> [f64; 3] {
    scenario.pull.direction.map(|x| x * scenario.covariates.pull_direction)
}

/// What the effects look at.
pub fn grip_point(scenario: &Scenario, jaw: Jaw, contact_area_m2: f64) -> GripPoint<'_> {
    GripPoint {
        jaw,
        grip_force_n: scenario.grip_force_n,
        contact_area_m2,
        pull_rate_n_per_s: scenario.pull.increment_n / scenario.pull.step_s,
        covariates: &scenario.covariates,
        grip: (scenario.seed, scenario.group),
    }
}

/// How the tool of a pull creeps whose jaws press with these normal forces.
pub fn creep_of(twin: &Twin, scenario: &Scenario, force_n: &PerJaw<f64>) -> Creep {
    let mean_n = 0.5 * (force_n.left + force_n.right);
    creep(twin, &scenario.part, &GripPoint { grip_force_n: mean_n, ..grip_point(scenario, Jaw::Left, 0.0) })
}

/// The wrist sensor of a pull, with what tables of the twin add to its readings.
pub fn sensor_chain(twin: &Twin, scenario: &Scenario) -> SensorChain {
    SensorChain::new(twin, &scenario.part, SensorPoint::start_of(&scenario.covariates))
        .along(scenario.covariates.pull_direction)
        .plus(twin.table_offset_n(scenario))
}
