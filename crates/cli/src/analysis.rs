//! What is made of measured data: calibration, diagnosis, comparison, the design of campaigns.

mod beyond;
mod calibrate;
mod campaign;
mod catalogue;
mod compare;
mod compare_images;
mod diagnose;
mod expect;
mod imprint;
mod imprint_set;
mod label_shares;
mod own_parts;
mod posterior;
mod presses;
mod priors;
mod twin_edits;
mod unmeasured;
mod unvaried;

pub use beyond::{Beyond, beyond};
pub use calibrate::{CalibratePullsError, calibrate_twin, with_few_density};
pub use campaign::{SimulateCampaignError, detectable_in_campaign, simulate_campaign};
pub use catalogue::{EffectCurve, effect_curve};
pub use compare::{LabelErrors, PullComparison, compare_pulls, compare_pulls_with};
pub use compare_images::{CompareImagesError, ImageComparison, ImageScore, compare_images};
pub use diagnose::{
    Diagnosed, Engine, MeasuredPresses, NextPulls, PressCovariate, PressDiagnosisInput, PressValues,
    PullDiagnoseOptions, calibrate_imprint_table, calibrate_sensor_table, compare_imprint_table,
    compare_sensor_table, diagnose_imprint_table, diagnose_measured_presses, diagnose_presses,
    diagnose_pull_table, diagnose_sensor_table, given_model, imprint_calibration_edits, is_sensor_table,
    measured_presses, sensor_calibration_edits,
};
pub use expect::pull_predictor;
pub use imprint::{
    CalibrateImprintsError, ImprintCalibration, ImprintCalibrations, ImprintImagesError, calibrate_imprints,
};
pub use imprint_set::{ImprintSet, LoadImprintsError, imprint_data, is_imprint_set, load_imprint_set};
pub use label_shares::{LabelShares, Source, label_shares};
pub use own_parts::{OwnParts, effects_of_geometry, jaws_of_grip_force, own_parts};
pub use posterior::posterior_twins;
pub use presses::{
    FoundCircles, LoadPressesError, LoadSensorError, PressGeometry, find_circles_with_sensor,
    find_missing_circles, is_press_set, load_presses, load_sensor, load_twin_sensor, presses_sha256,
};
pub use priors::{pull_priors, shipped_priors};
pub(crate) use twin_edits::before_data;
pub use twin_edits::{EditedValue, TwinEdits, WriteTwinError, edited_twin, edited_twin_toml, write_twin};
pub use unmeasured::unmeasured;
pub use unvaried::{Unvaried, unvaried};
