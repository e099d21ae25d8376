//! The effects library: what a twin may be missing, one file per effect.
//!
//! An effect is a pure function on one or two hooks of the simulation, with named parameters that have a unit, a
//! neutral value and physical bounds. The simulator and the identification use the same function. At the
//! neutral values an effect gives bitwise the unmodified result, so taking it out of a twin restores the old
//! data bit for bit. Where an effect needs a scale that cannot be told apart from its other parameters or from
//! the baseline (the rate at which the coefficient was measured, say), that scale is a parameter too, a
//! *reference*: it has a documented default and is not fitted.

mod chain;
mod experiment;
mod fit;
mod hooks;
mod spec;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use chain::{
    CommandChain, SensorChain, creep, imprint_volume_m3, jaw_tilt_rad, normal_force_n, optics_state,
};
pub use experiment::{Experiment, Measured};
pub use fit::{
    Bounds, FORCE_RATE, Fit, GraspSpan, Grid, ImprintFit, Named, PressFit, PressNeeds, PullFit, PullSpan,
    REFERENCE_FORCE, Seen, TableFit, TableSpan,
};
use fit::{log_spaced, wider};
pub use hooks::{
    CommandHook, Creep, CreepHook, FrictionHook, GraspForceHook, GripPoint, ImprintHook, NormalForceHook,
    OpticsHook, SensorHook, SensorMemory, SensorPoint, TiltHook,
};
use hooks::{positive, values};
use spec::parameter;
pub use spec::{EffectSpec, Group, ParameterSpec, Visible};

/// Declares the modules of the effects and lists their specs: one line per effect.
macro_rules! library {
    ($(mod $id:ident;)*) => {
        $(mod $id;)*

        /// The effects of this version: friction, gel and jaws, sensor and robot, optics.
        pub const LIBRARY: &[&EffectSpec] = &[$(&$id::SPEC),*];
    };
}

library! {
    mod load_offset;
    mod load_power_law;
    mod area_saturation;
    mod regime_transition;
    mod shear_strength;
    mod adhesion;
    mod rate_dependence;
    mod dwell_ageing;
    mod anisotropy;
    mod contamination;
    mod wear;
    mod conditioning;
    mod temperature;
    mod imprint_delay;
    mod grip_relaxation;
    mod imprint_nonlinearity;
    mod jaw_tilt;
    mod off_centre;
    mod asymmetric_jaws;
    mod grip_split;
    mod grip_force_loss;
    mod shear_creep;
    mod sensor_gain;
    mod sensor_bias;
    mod sensor_drift;
    mod session_zero_drift;
    mod sensor_gain_drift;
    mod sensor_hysteresis;
    mod sensor_quadratic;
    mod sensor_saturation;
    mod sensor_lowpass;
    mod sensor_creep;
    mod controller_gain;
    mod deadband;
    mod light_drift;
    mod background_change;
    mod misregistration;
    mod exposure;
    mod defocus;
    mod gel_kernel;
    mod cad_mismatch;
    mod rest_offset;
    mod cast_shadow;
    mod gel_dome;
    mod press_gain;
    mod press_depth;
    mod edge_rounding;
}

/// The correction of the friction coefficient of Wucherer et al. 2023, mu (a + b / F_G), which is fitted per part.
pub const OFFSET_LAW: &EffectSpec = &load_offset::SPEC;

/// A factor on the readings and a constant added to them: what a calibration of a force sensor finds.
pub const SENSOR_LINE: [&EffectSpec; 2] = [&sensor_gain::SPEC, &sensor_bias::SPEC];

/// The effect called `id`.
pub fn find(id: &str) -> Option<&'static EffectSpec> {
    LIBRARY.iter().copied().find(|spec| spec.id == id)
}

/// What an effect does outside the grip forces it was fitted on.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum OutsideFit {
    /// The sample fails.
    Error,
    /// The law is taken at the nearer end of the range.
    Hold,
    /// The law is used as it is; friction never falls below 0.
    #[default]
    Extrapolate,
}

/// What a friction law is evaluated for.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// Once for a jaw, with its normal force.
    #[default]
    Jaw,
    /// For each pressure cell, with its pressure times a reference area as the force.
    Cell,
}

impl Per {
    /// Whether this is the default.
    pub(crate) fn is_jaw(&self) -> bool {
        *self == Per::Jaw
    }
}

/// An effect with its parameter values, as it stands in a twin.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Which effect.
    pub spec: &'static EffectSpec,
    /// The only part it acts on, or all of them.
    pub part: Option<String>,
    /// Parameter values in the order of the spec.
    pub values: Vec<f64>,
    /// Grip forces (commanded, per jaw) the values were fitted on.
    pub fitted_grip_force_n: Option<(f64, f64)>,
    /// What happens outside that range.
    pub outside_fit: OutsideFit,
    /// What its friction law is evaluated for.
    pub per: Per,
    /// Area that turns the pressure of a cell into the force of the law; there with [`Per::Cell`].
    pub reference_area_m2: Option<f64>,
}

impl Effect {
    /// Whether the effect acts on `part`.
    pub fn acts_on(&self, part: &str) -> bool {
        self.part.as_deref().is_none_or(|p| p == part)
    }

    /// Reference area of a law that is evaluated per cell.
    pub fn cell_area_m2(&self) -> Option<f64> {
        self.reference_area_m2.filter(|_| self.per == Per::Cell)
    }

    /// Whether its friction law may differ from cell to cell of a contact.
    pub fn differs_by_cell(&self) -> bool {
        self.spec.of_pressure || self.cell_area_m2().is_some()
    }
}
