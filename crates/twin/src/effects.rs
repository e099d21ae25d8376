//! The effects library: what a twin may be missing, one file an effect.
//!
//! An effect is a pure function on one hook of the simulation, with named parameters that have a unit, a
//! neutral value and physical bounds. The simulator and the identification use the same function. At the
//! neutral values an effect gives bitwise the unmodified result, so taking it out of a twin restores the old
//! data bit for bit.

mod load_offset;

use std::fmt;

/// The effects of this version, in the order of their ids.
pub const LIBRARY: &[&EffectSpec] = &[&load_offset::SPEC];

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Name in a twin file, with its unit suffix.
    pub name: &'static str,
    /// Unit, `1` for a plain number.
    pub unit: &'static str,
    /// Value at which the effect does nothing.
    pub neutral: f64,
    /// Smallest and largest physical value.
    pub bounds: (f64, f64),
    /// What it means.
    pub about: &'static str,
}

/// What a friction hook may look at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionPoint {
    /// Commanded grip force, per jaw.
    pub grip_force_n: f64,
}

/// Changes a friction coefficient: (parameters in the order of the spec, coefficient so far, where) -> new one.
pub type FrictionHook = fn(&[f64], f64, &FrictionPoint) -> f64;

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
    /// Its parameters.
    pub parameters: &'static [ParameterSpec],
    /// Columns of a pull table that it needs.
    pub covariates: &'static [&'static str],
    /// The friction hook.
    pub friction: Option<FrictionHook>,
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

/// An effect with its parameter values, as it stands in a twin.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Which effect.
    pub spec: &'static EffectSpec,
    /// The only part it acts on, or all of them.
    pub part: Option<String>,
    /// Parameter values in the order of the spec.
    pub values: Vec<f64>,
    /// Grip forces (per jaw) the values were fitted on.
    pub fitted_grip_force_n: Option<(f64, f64)>,
    /// What happens outside that range.
    pub outside_fit: OutsideFit,
}

impl Effect {
    /// Whether the effect acts on `part`.
    pub fn acts_on(&self, part: &str) -> bool {
        self.part.as_deref().is_none_or(|p| p == part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_and_parameter_names_are_unique_and_neutral_values_lie_inside_the_bounds() {
        for (i, spec) in LIBRARY.iter().enumerate() {
            assert!(LIBRARY[i + 1..].iter().all(|other| other.id != spec.id), "{} twice", spec.id);
            assert_eq!(find(spec.id), Some(*spec));
            for (j, p) in spec.parameters.iter().enumerate() {
                assert!(spec.parameters[j + 1..].iter().all(|other| other.name != p.name));
                assert!(p.bounds.0 <= p.neutral && p.neutral <= p.bounds.1, "{}.{}", spec.id, p.name);
            }
        }
    }

    #[test]
    fn neutral_parameters_change_nothing_bitwise() {
        for spec in LIBRARY {
            let neutral: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
            for mu in [0.0, 0.14, 0.168, 1.0 / 3.0, 1.7] {
                for grip_force_n in [0.1, 5.0, 20.0, 33.3, 80.0] {
                    if let Some(friction) = spec.friction {
                        let after = friction(&neutral, mu, &FrictionPoint { grip_force_n });
                        assert_eq!(after.to_bits(), f64::to_bits(mu), "{} at {grip_force_n} N", spec.id);
                    }
                }
            }
        }
    }
}
