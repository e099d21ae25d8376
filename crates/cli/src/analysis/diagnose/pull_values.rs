//! Fitted values of pulls as they stand in a twin.

use crate::analysis::twin_edits::{EditedValue, calibration_entry};
use gripgen_identify::ParameterEstimate;
use gripgen_physics::{PullPredictor, speed_limit_m_per_s};
use gripgen_twin::Jaw;
use gripgen_twin::predict::PullModel;
use std::collections::BTreeMap;

/// Fitted baseline values as they stand in a twin: a file has the shear stiffness of a gel of compliance 1.
pub(crate) fn pull_values(
    model: &PullModel,
    baseline: &BTreeMap<String, ParameterEstimate>,
    predictor: &PullPredictor<'_>,
    evidence: &str,
    sha256: &str,
) -> Vec<EditedValue> {
    let mut values = Vec::new();
    let mut set = |key: String, value: f64, known: Option<&ParameterEstimate>| {
        let calibration = known.map(|estimate| calibration_entry(estimate, evidence, sha256));
        values.push(EditedValue { key, value, calibration });
    };
    let interval = |name: &str| baseline.get(name);
    let scatter = baseline.get("scatter").map_or(model.scatter, |e| e.value);
    for (name, mu) in predictor.part_names().iter().zip(&model.mu) {
        set(format!("parts.{name}.mu"), *mu, interval(&format!("parts.{name}.mu")));
        set(format!("parts.{name}.kinetic_ratio"), model.kinetic_ratio, interval("kinetic_ratio"));
        set(format!("parts.{name}.kinetic_fall_s"), model.fall_s, None);
        set(format!("parts.{name}.scatter"), scatter, interval("scatter").filter(|e| e.low90 < e.high90));
    }
    set("robot.lag_s".into(), model.lag_s, interval("robot.lag_s"));
    set("robot.dead_time_s".into(), model.dead_time_s, interval("robot.dead_time_s"));
    set("wrist.noise_n".into(), model.noise_n, interval("wrist.noise_n"));
    if baseline.contains_key("robot.damping_n_s_per_m") {
        set("robot.damping_n_s_per_m".into(), model.damping_n_s_per_m, None);
        set("robot.speed_limit_mm_s".into(), 1e3 * speed_limit_m_per_s(model.damping_n_s_per_m), None);
        if let Some(mass_kg) = model.apparent_mass_kg {
            set("robot.apparent_mass_kg".into(), mass_kg, None);
        }
        for jaw in Jaw::BOTH {
            let own = model.stiffness_n_per_m * 0.5e-3 * predictor.compliance(jaw);
            set(format!("gel.{jaw}.shear_stiffness_n_per_mm"), own, None);
            set(format!("gel.{jaw}.shear_by_area"), model.shear_by_area, None);
        }
    }
    values
}
