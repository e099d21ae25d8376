//! The friction coefficient of a grip.
//!
//! A coefficient belongs to a pair of surfaces (this part's steel on this gel), it is empirical, and it is
//! written here as static friction: the jaw holds a tangential force up to `mu` times its normal force. Once it
//! slides, friction is `kinetic_ratio` times that. The laws of the effects library change `mu` from grip to
//! grip.

use crate::effects::{FrictionPoint, OutsideFit};
use crate::{Part, Twin};

/// Friction of one grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripFriction {
    /// Static friction coefficient, after all effects.
    pub mu: f64,
    /// Kinetic over static friction; 1 = none lost.
    pub kinetic_ratio: f64,
    /// An effect was used outside the grip forces it was fitted on.
    pub outside_fit: bool,
}

/// Why a friction coefficient could not be given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrictionError {
    /// The law was fitted elsewhere and says that extending it is an error.
    #[error(
        "grip force {grip_force_n} N is outside the {low}..={high} N on which `{effect}` of part `{part}` was fitted"
    )]
    OutsideFit {
        /// Effect id.
        effect: &'static str,
        /// Part gripped.
        part: String,
        /// Commanded grip force, per jaw.
        grip_force_n: f64,
        /// Lower end of the fitted range.
        low: f64,
        /// Upper end of the fitted range.
        high: f64,
    },
    /// The law gives a negative coefficient.
    #[error(
        "`{effect}` gives part `{part}` a friction coefficient of {mu:.4} at a grip force of {grip_force_n} N; it must not be negative"
    )]
    Negative {
        /// Effect id.
        effect: &'static str,
        /// Part gripped.
        part: String,
        /// The coefficient.
        mu: f64,
        /// Commanded grip force, per jaw.
        grip_force_n: f64,
    },
}

/// Evaluates the friction laws of `twin` for part `part_name` gripped with `grip_force_n` per jaw.
pub fn grip_friction(
    twin: &Twin,
    part_name: &str,
    part: &Part,
    grip_force_n: f64,
) -> Result<GripFriction, FrictionError> {
    let mut mu = part.mu;
    let mut outside = false;
    for effect in twin.effects.iter().filter(|e| e.acts_on(part_name)) {
        let Some(hook) = effect.spec.friction else { continue };
        let mut force = grip_force_n;
        if let Some((low, high)) = effect.fitted_grip_force_n
            && !(low..=high).contains(&force)
        {
            outside = true;
            match effect.outside_fit {
                OutsideFit::Error => {
                    return Err(FrictionError::OutsideFit {
                        effect: effect.spec.id,
                        part: part_name.into(),
                        grip_force_n,
                        low,
                        high,
                    });
                }
                OutsideFit::Hold => force = force.clamp(low, high),
                OutsideFit::Extrapolate => {}
            }
        }
        mu = hook(&effect.values, mu, &FrictionPoint { grip_force_n: force });
        if mu < 0.0 {
            if effect.outside_fit != OutsideFit::Extrapolate {
                return Err(FrictionError::Negative {
                    effect: effect.spec.id,
                    part: part_name.into(),
                    mu,
                    grip_force_n,
                });
            }
            mu = 0.0;
        }
    }
    Ok(GripFriction { mu, kinetic_ratio: part.kinetic_ratio, outside_fit: outside })
}
