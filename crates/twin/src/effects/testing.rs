//! What the tests of the effects share.

use super::{GripPoint, OpticsHook, SensorHook, SensorMemory, SensorPoint};
use crate::config::{ConfigError, read_twin_table};
use crate::{Covariates, Jaw, OpticsState, Twin};

/// The left jaw with a patch of 1 cm2, pulled at 10 N/s.
pub(crate) fn grip(covariates: &Covariates, grip_force_n: f64) -> GripPoint<'_> {
    let (contact_area_m2, pull_rate_n_per_s) = (1e-4, 10.0);
    GripPoint { jaw: Jaw::Left, grip_force_n, contact_area_m2, pull_rate_n_per_s, covariates, grip: (0, 0) }
}

/// Readings of true forces, `step_s` apart from clock 0 on.
pub(crate) fn readings(hook: SensorHook, parameters: &[f64], forces_n: &[f64], step_s: f64) -> Vec<f64> {
    let mut memory = SensorMemory::default();
    let read = |(i, &force_n): (usize, &f64)| {
        hook(
            parameters,
            force_n,
            &mut memory,
            &SensorPoint { clock_s: i as f64 * step_s, since_zero_s: i as f64 * step_s, step_s },
        )
    };
    forces_n.iter().enumerate().map(read).collect()
}

/// The optics of the left jaw, gripped with 40 N, after a hook with each of these parameters.
pub(crate) fn optics_after(hook: OpticsHook, parameters: &[&[f64]]) -> OpticsState {
    let (covariates, mut state) = (Covariates::default(), OpticsState::default());
    parameters.iter().for_each(|p| hook(p, &mut state, &grip(&covariates, 40.0)));
    state
}

/// A twin of two parts (`plate` with mu 0.2, `rod` with mu 0.3) and these effects.
pub(crate) fn twin(effects: &str) -> Result<Twin, ConfigError> {
    let text = format!("{BASELINE}\n{effects}");
    Twin::new(&read_twin_table(&text.parse().expect("valid TOML"))?)
}

const BASELINE: &str = r#"
robot = { model = "carriage", moving_mass_kg = 8.0, lag_s = 0.05, dead_time_s = 0.0, damping_n_s_per_m = 2000.0, speed_limit_mm_s = 20.0, feedback = "measured" }
gripper = { model = "wsg50", force_convention = "per_jaw", mass_kg = 1.2, jaw_mass_kg = 0.2, opening_mm = 110.0, max_force_n = 80.0 }
wrist = { noise_n = 0.0, rate_hz = 500.0 }
gel.left = { model = "pyramid", thickness_mm = 4.0, width_mm = 28.0, height_mm = 21.0, shear_stiffness_n_per_mm = 20.0, kernels_px = [5], restore_depth_fraction = 0.4 }
optics.left = { sensor = "s.npz", image_noise = "off" }
parts.plate = { mesh = "plate.stl", mu = 0.2, imprint_mm3_per_n = 1.5 }
parts.rod = { mesh = "rod.stl", mu = 0.3, imprint_mm3_per_n = 1.5 }
"#;
