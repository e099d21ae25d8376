//! What an effect does to the label, for the catalogue of effects.

use crate::analysis::compare::compare_pulls;
use crate::analysis::diagnose::UnknownPartError;
use gripgen::Library;
use gripgen_report::{Plot, Series};
use gripgen_twin::columns::{self, Column, Kind};
use gripgen_twin::effects::{Effect, EffectSpec, OutsideFit, Per};
use gripgen_twin::{Covariates, MeasuredPull, MeasuredPulls, Twin};

/// Points of a curve over numbers.
const POINTS: usize = 25;

/// Grip force where something else is varied.
const GRIP_FORCE_N: f64 = 40.0;

/// The label (the measured force at slip) with an effect over that without it, as a function of what the effect depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectCurve {
    /// Name of the column that is varied, with its unit.
    pub covariate: &'static str,
    /// Its values.
    pub x: Vec<f64>,
    /// Label with the typical values of the effect over the label without it, per value.
    pub ratio: Vec<f64>,
}

/// How one column is varied: its range in its unit, and whether in equal ratios.
struct Sweep {
    column: &'static str,
    range: (f64, f64),
    log: bool,
}

/// Ranges that a rig covers in a day.
const SWEEPS: [Sweep; 9] = [
    Sweep { column: "grip_force_n", range: (5.0, 80.0), log: false },
    Sweep { column: "force_increment_n", range: (0.2, 5.0), log: true },
    Sweep { column: "dwell_s", range: (0.1, 300.0), log: true },
    Sweep { column: "pull_index", range: (0.0, 480.0), log: false },
    Sweep { column: "time_s", range: (0.0, 28_800.0), log: false },
    Sweep { column: "temperature_c", range: (15.0, 35.0), log: false },
    Sweep { column: "grip_offset_mm", range: (-15.0, 15.0), log: false },
    Sweep { column: "grip_angle_deg", range: (-90.0, 90.0), log: false },
    Sweep { column: "pull_direction", range: (-1.0, 1.0), log: false },
];

impl Sweep {
    fn column(&self) -> &'static Column {
        columns::find(self.column).expect("a sweep names a column")
    }

    fn values(&self) -> Vec<f64> {
        let (low, high) = self.range;
        if self.column().kind == Kind::Direction {
            return vec![low, high];
        }
        let at = |k: usize| {
            let share = k as f64 / (POINTS - 1) as f64;
            if self.log { low * libm::pow(high / low, share) } else { low + share * (high - low) }
        };
        (0..POINTS).map(at).collect()
    }
}

/// What an effect with its typical values does to the labels that `twin` is expected to measure, over the first of its
/// covariates, or over the grip force, without noise. The part is the first of the twin.
///
/// # Errors
/// A twin without parts.
pub fn effect_curve(
    spec: &'static EffectSpec,
    twin: &Twin,
    library: &Library,
    jobs: usize,
) -> Result<EffectCurve, UnknownPartError> {
    let own = spec.covariates.iter().find_map(|name| SWEEPS.iter().find(|s| s.column == *name));
    let sweep = own.unwrap_or(&SWEEPS[0]);
    let x = sweep.values();
    let part = twin.parts.keys().next().cloned().unwrap_or_default();
    let pull = |(i, x): (usize, &f64)| {
        let mut pull = MeasuredPull {
            id: i.to_string(),
            part: part.clone(),
            grip_pose: 0,
            grip_force_n: GRIP_FORCE_N,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates::default(),
            max_pull_force_n: 0.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        sweep.column().set_number(&mut pull.edit(), *x);
        pull
    };
    let measured = MeasuredPulls {
        pulls: x.iter().enumerate().map(pull).collect(),
        recorded: vec![sweep.column.into()],
        extra: Vec::new(),
        label_tolerance_n: 3.0,
        stop_m: 5e-3,
        feedback: None,
        sha256: String::new(),
    };
    // Of noise a label keeps the highest reading, which is a constant beside the force.
    let mut without = twin.clone();
    without.wrist.noise_n = 0.0;
    let mut with = without.clone();
    with.effects.push(Effect {
        spec,
        part: None,
        values: spec.typical_values(),
        fitted_grip_force_n: None,
        outside_fit: OutsideFit::Extrapolate,
        per: Per::Jaw,
        reference_area_m2: None,
    });
    let without_n = compare_pulls(&measured, &without, library, jobs)?.label_n;
    let with_n = compare_pulls(&measured, &with, library, jobs)?.label_n;
    let ratio = with_n.iter().zip(&without_n).map(|(a, b)| a / b).collect();
    Ok(EffectCurve { covariate: sweep.column, x, ratio })
}

impl EffectCurve {
    /// The curve as a plot.
    pub fn plot(&self, title: &str) -> Plot {
        let points = self.x.iter().copied().zip(self.ratio.iter().copied());
        Plot::new(title, self.covariate, "label with over without", vec![Series::line(title, points)])
    }
}
