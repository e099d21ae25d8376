//! The effects library: what a twin may be missing, one file an effect.
//!
//! An effect is a pure function on one or two hooks of the simulation, with named parameters that have a unit, a
//! neutral value and physical bounds. The simulator and the identification use the same function. At the
//! neutral values an effect gives bitwise the unmodified result, so taking it out of a twin restores the old
//! data bit for bit. Where an effect needs a scale that cannot be told apart from its other parameters or from
//! the baseline (the rate at which the coefficient was measured, say), that scale is a parameter too, a
//! *reference*: it has a documented default and is not fitted.

mod anisotropy;
mod area_saturation;
mod asymmetric_jaws;
mod background_change;
mod cad_mismatch;
mod cast_shadow;
mod chain;
mod conditioning;
mod contamination;
mod controller_gain;
mod deadband;
mod defocus;
mod dwell_ageing;
mod exposure;
mod gel_dome;
mod gel_kernel;
mod grip_force_loss;
mod grip_relaxation;
mod hooks;
mod imprint_nonlinearity;
mod jaw_tilt;
mod light_drift;
mod load_offset;
mod load_power_law;
mod misregistration;
mod off_centre;
mod rate_dependence;
mod regime_transition;
mod rest_offset;
mod sensor_bias;
mod sensor_creep;
mod sensor_drift;
mod sensor_gain;
mod sensor_gain_drift;
mod sensor_hysteresis;
mod sensor_lowpass;
mod sensor_quadratic;
mod sensor_saturation;
mod shear_strength;
mod temperature;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod wear;

pub use chain::{CommandChain, SensorChain, imprint_volume_m3, jaw_tilt_rad, normal_force_n, optics_state};
pub use hooks::{
    CommandHook, FrictionHook, GripPoint, ImprintHook, NormalForceHook, OpticsHook, SensorHook, SensorMemory,
    SensorPoint, TiltHook,
};

use crate::OpticsState;
use std::fmt;

/// The effects of this version: friction, gel and jaws, sensor and robot, optics.
pub const LIBRARY: &[&EffectSpec] = &[
    &load_offset::SPEC,
    &load_power_law::SPEC,
    &area_saturation::SPEC,
    &regime_transition::SPEC,
    &shear_strength::SPEC,
    &rate_dependence::SPEC,
    &dwell_ageing::SPEC,
    &anisotropy::SPEC,
    &contamination::SPEC,
    &wear::SPEC,
    &conditioning::SPEC,
    &temperature::SPEC,
    &grip_relaxation::SPEC,
    &imprint_nonlinearity::SPEC,
    &jaw_tilt::SPEC,
    &off_centre::SPEC,
    &asymmetric_jaws::SPEC,
    &grip_force_loss::SPEC,
    &sensor_gain::SPEC,
    &sensor_bias::SPEC,
    &sensor_drift::SPEC,
    &sensor_gain_drift::SPEC,
    &sensor_hysteresis::SPEC,
    &sensor_quadratic::SPEC,
    &sensor_saturation::SPEC,
    &sensor_lowpass::SPEC,
    &sensor_creep::SPEC,
    &controller_gain::SPEC,
    &deadband::SPEC,
    &light_drift::SPEC,
    &background_change::SPEC,
    &misregistration::SPEC,
    &exposure::SPEC,
    &defocus::SPEC,
    &gel_kernel::SPEC,
    &cad_mismatch::SPEC,
    &rest_offset::SPEC,
    &cast_shadow::SPEC,
    &gel_dome::SPEC,
];

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Name in a twin file, with its unit suffix.
    pub name: &'static str,
    /// Unit, `1` for a plain number.
    pub unit: &'static str,
    /// Value where a twin leaves it out. With every parameter at this value the effect does nothing.
    pub neutral: f64,
    /// Smallest and largest physical value.
    pub bounds: (f64, f64),
    /// What it means.
    pub about: &'static str,
}

/// How large an effect has to be for more than what a first-order loop gets wrong of an arm: less is none, however often it was
/// measured. Sizes are those of the first parameter that is fitted, less its neutral value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Visible {
    /// However small.
    Always,
    /// From this size on.
    From(f64),
    /// What has grown to this from the first pull of a campaign to the last; the size is one per hour.
    OverTheCampaign(f64),
    /// What has grown to this at the largest label of a campaign; the size is one per newton.
    AtTheLargestForce(f64),
}

impl Visible {
    /// Whether a size is enough, in a campaign of so many hours with such a largest label.
    pub fn holds(self, size: f64, hours: f64, largest_n: f64) -> bool {
        match self {
            Visible::Always => true,
            Visible::From(least) => size >= least,
            Visible::OverTheCampaign(least) => size * hours >= least,
            Visible::AtTheLargestForce(least) => size * largest_n >= least,
        }
    }
}

/// The description of an effect.
#[derive(Clone, Copy)]
pub struct EffectSpec {
    /// Stable id, the name in a twin file and in a diagnosis.
    pub id: &'static str,
    /// One line: what it is.
    pub about: &'static str,
    /// The formula, with the parameter names.
    pub formula: &'static str,
    /// Where the formula comes from.
    pub source: &'static str,
    /// Its parameters, in twin-file units.
    pub parameters: &'static [ParameterSpec],
    /// Names of those parameters that are references, or choose between forms of the law: not fitted.
    pub references: &'static [&'static str],
    /// Columns of a pull table that it needs.
    pub covariates: &'static [&'static str],
    /// Its friction law is one of the contact pressure: it is always taken for each pressure cell.
    pub of_pressure: bool,
    /// Its sensor hook depends on the clock of the campaign.
    pub reads_clock: bool,
    /// Its sensor hook depends on readings before.
    pub remembers: bool,
    /// Its formula knows pulls up and down, and no other direction.
    pub upright_only: bool,
    /// An effect of the surface, which parts may have each in their own way. Those of gel, gripper, sensor and robot are common.
    pub per_part: bool,
    /// The size from which on it is an effect.
    pub visible: Visible,
    /// Acts on the friction coefficient of a jaw.
    pub friction: Option<FrictionHook>,
    /// Acts on the normal force of a jaw, before imprint, friction and mechanics.
    pub normal_force: Option<NormalForceHook>,
    /// Acts on the imprint volume of a jaw.
    pub imprint_volume: Option<ImprintHook>,
    /// Acts on the angle of a gel.
    pub tilt_rad: Option<TiltHook>,
    /// Acts on the readings of the wrist sensor.
    pub sensor: Option<SensorHook>,
    /// Acts on the command of the force loop.
    pub command: Option<CommandHook>,
    /// Acts on the images of a jaw, and on nothing else.
    pub optics: Option<OpticsHook>,
}

impl EffectSpec {
    /// No name and no hook: what the specs fill in.
    const BARE: EffectSpec = EffectSpec {
        id: "",
        about: "",
        formula: "",
        source: "",
        parameters: &[],
        references: &[],
        covariates: &[],
        of_pressure: false,
        reads_clock: false,
        remembers: false,
        upright_only: false,
        per_part: false,
        visible: Visible::Always,
        friction: None,
        normal_force: None,
        imprint_volume: None,
        tilt_rad: None,
        sensor: None,
        command: None,
        optics: None,
    };

    /// Whether the effect is a friction law of the grip force, which can be taken per pressure cell.
    pub fn is_load_law(&self) -> bool {
        self.friction.is_some() && self.covariates.contains(&"grip_force_n") && !self.of_pressure
    }
}

impl fmt::Debug for EffectSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EffectSpec({})", self.id)
    }
}

impl PartialEq for EffectSpec {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

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
