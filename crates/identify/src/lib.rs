//! Calibration and diagnosis: numbers in, parameters and causes out.
//!
//! ```
//! use gripgen_identify::{FitOptions, FreeParameter, fit};
//!
//! // A coefficient that falls with grip force, mu = 0.3 (1 + b / F): b comes back from five forces.
//! let forces_n = [5.0, 10.0, 20.0, 40.0, 80.0];
//! let mu = |b_n: f64, force_n: f64| 0.3 * (1.0 + b_n / force_n);
//! let b_n = FreeParameter { name: "b_n".into(), start: 0.0, bounds: (-4.0, 10.0), scale: 0.5 };
//! let found = fit(&[b_n], FitOptions::default(), |v| {
//!     forces_n.iter().map(|&f| mu(v[0], f) - mu(2.5, f)).collect()
//! })?;
//! assert!((found.values[0] - 2.5).abs() < 1e-6);
//! # Ok::<(), gripgen_identify::FitError>(())
//! ```
//!
//! This crate does not know how predictions are made. It is given observations and a way to predict them from
//! parameters, and returns fitted values with intervals, and a [`Diagnosis`]: what the model lacks, what cannot be told
//! apart, and what to measure next. `docs/diagnosis.md` describes the method.

mod bounded;
mod design;
mod diagnosis;
mod draws;
mod effect_search;
mod grouped;
mod imprints;
mod least_squares;
mod levels;
mod model;
mod permutation;
mod predictive;
mod presses;
pub mod pulls;
mod ratio;
mod robust_line;
mod sensor;
mod shares;
mod statistics;
mod summary;

pub use design::{
    CampaignError, CampaignOptions, CandidatePull, DWELLS_S, FORCES_N, NO_LOAD_S, SeparableRival,
    SeparateError, SeparatingPlan, plan_campaign, plan_separating,
};
pub use diagnosis::{
    Channel, DIAGNOSIS_SCHEMA, DataSummary, Detectable, Diagnosis, ErrorPair, ErrorReport, ErrorsBy,
    HeldOutError, Hint, NamedEffect, ParameterEstimate, PosteriorFile, Residual, Rival, SeparateBy,
    UnknownCovariate, Verdict,
};
pub use draws::Draws;
pub use grouped::{
    GroupMoments, GroupedFit, GroupedModel, fit_grouped, fold_steps, grouped_intervals, grouped_step,
    held_out_costs, t_quantile_95,
};
pub use imprints::{
    FittedPress, GraspConstant, ImprintComparison, ImprintConstants, ImprintData, ImprintDiagnosis,
    ImprintEstimate, ImprintEvidence, ImprintRow, MeasuredGrasp, PartConstant, SharedConstant,
    calibrate_imprint_set, compare_imprints, diagnose_imprints, imprint_constant,
};
pub use least_squares::{Fit, FitError, FitOptions, FreeParameter, fit};
pub use levels::{Level, levels};
pub use model::{LearntTable, ModelAnswer, ModelFit, describe_by_process, diagnose_by_model, rms_error_n};
pub use permutation::{Covariate, Dependence, benjamini_hochberg, dependence, interaction};
pub use predictive::share_below;
pub use presses::{
    ActingEffect, MIN_DIAGNOSED_PRESSES, PRESS_ZONES, PredictPresses, PressCovariate, PressData,
    PressDiagnosis, PressPixels, PressTrial, PressValues, diagnose_presses, too_few_presses,
};
pub use ratio::{PartRatio, RatioFit, part_ratio, pull_ratios};
pub use robust_line::RobustLine;
pub use sensor::{
    SensorBlock, SensorCalibration, SensorComparison, SensorData, SensorDiagnosis, SensorEvidence,
    SensorOptions, SensorRow, SessionCalibration, calibrate_sensor, compare_sensor, diagnose_sensor,
};
pub use shares::{closed_share, total_share};
pub use summary::{MIN_REPORTABLE_WEIGHT, summary_sentence};
