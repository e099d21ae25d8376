//! The friction coefficient of a grip.
//!
//! A coefficient belongs to a pair of surfaces (this part's steel on this gel), it is empirical, and it is
//! written here as static friction: the jaw holds a tangential force up to `mu` times its normal force. Once it
//! slides, friction is `kinetic_ratio` times that. The laws of the effects library change `mu` from grip to
//! grip, and may differ from cell to cell of a contact patch.

use crate::effects::{Effect, FrictionHook, GripPoint, OutsideFit, normal_force_n};
use crate::rounded::rounded;
use crate::{ContactPatch, Part, Twin};

/// Friction of one grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripFriction {
    /// Static friction coefficient of the jaw, after all effects.
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
        "grip force {} N is outside the {low} to {high} N on which `{effect}` of part `{part}` was fitted",
        rounded(*.grip_force_n, &[*.low, *.high])
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
        "`{effect}` gives part `{part}` a friction coefficient of {mu:.4} at a grip force of {} N; it must not be negative",
        rounded(*.grip_force_n, &[])
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

/// Evaluates the friction laws of `twin` for one jaw that grips part `part_name`.
///
/// `at` has the commanded grip force; the laws see the real normal force, which follows from it. A law per cell
/// is taken at the mean pressure, or like one per jaw where the contact area is not known.
///
/// # Errors
///
/// A grip force outside the fit of a law that says `outside_fit = "error"`, or a coefficient below 0.
pub fn grip_friction(
    twin: &Twin,
    part_name: &str,
    part: &Part,
    at: &GripPoint<'_>,
) -> Result<GripFriction, FrictionError> {
    let mut mu = part.mu;
    let mut outside_fit = false;
    for law in laws(twin, part_name, at) {
        let law = law?;
        outside_fit |= law.outside_fit;
        mu = law.on_jaw(mu, at);
        if mu < 0.0 {
            if law.effect.outside_fit != OutsideFit::Extrapolate && !law.effect.differs_by_cell() {
                return Err(FrictionError::Negative {
                    effect: law.effect.spec.id,
                    part: part_name.into(),
                    mu,
                    grip_force_n: at.grip_force_n,
                });
            }
            mu = 0.0;
        }
    }
    Ok(GripFriction { mu, kinetic_ratio: part.kinetic_ratio, outside_fit })
}

/// Evaluates the friction laws for each cell of a jaw's contact patch, in the order of the cells.
///
/// Without a law per cell every coefficient is that of [`grip_friction`] bit for bit. With one, the coefficient
/// of the jaw is the mean of the cells, weighted with their forces, and a cell whose law goes negative has 0.
///
/// # Errors
///
/// As [`grip_friction`], for any cell.
pub fn cell_friction(
    twin: &Twin,
    part_name: &str,
    part: &Part,
    at: &GripPoint<'_>,
    patch: &ContactPatch,
) -> Result<(Vec<f64>, GripFriction), FrictionError> {
    let mut jaw = grip_friction(twin, part_name, part, at)?;
    let laws = laws(twin, part_name, at).collect::<Result<Vec<_>, _>>()?;
    if laws.iter().all(|law| !law.effect.differs_by_cell()) {
        return Ok((vec![jaw.mu; patch.cells.len()], jaw));
    }
    let mu_of =
        |pressure_pa: f64| laws.iter().fold(part.mu, |mu, law| law.on_cell(mu, pressure_pa, at).max(0.0));
    let cells: Vec<f64> = patch
        .cells
        .iter()
        .map(|cell| if cell.area_m2 > 0.0 { mu_of(cell.pressure_pa()) } else { jaw.mu })
        .collect();
    let normal_n = patch.normal_force_n();
    // Where no cell differs the mean is the value itself, without rounding.
    if normal_n > 0.0 && cells.iter().any(|&mu| mu != jaw.mu) {
        jaw.mu = cells.iter().zip(&patch.cells).map(|(mu, cell)| mu * cell.force_n).sum::<f64>() / normal_n;
    }
    Ok((cells, jaw))
}

/// A friction law that acts on a grip, with what it needs to know of the jaw.
struct Law<'a> {
    effect: &'a Effect,
    hook: FrictionHook,
    /// Normal force of the jaw, inside the fitted range where the law holds its ends.
    force_n: f64,
    outside_fit: bool,
}

impl Law<'_> {
    fn on_jaw(&self, mu: f64, at: &GripPoint<'_>) -> f64 {
        if self.effect.differs_by_cell() && at.contact_area_m2 > 0.0 {
            self.on_cell(mu, self.force_n / at.contact_area_m2, at)
        } else {
            self.at_force(mu, self.force_n, at)
        }
    }

    fn on_cell(&self, mu: f64, pressure_pa: f64, at: &GripPoint<'_>) -> f64 {
        if self.effect.spec.of_pressure {
            // The hook takes force over area: here those of one square metre.
            return self.at_force(mu, pressure_pa, &GripPoint { contact_area_m2: 1.0, ..*at });
        }
        let Some(area_m2) = self.effect.cell_area_m2() else { return self.at_force(mu, self.force_n, at) };
        let force_n = pressure_pa * area_m2;
        // The law is held to the forces it was fitted on, which are those it sees.
        let held = match (self.effect.outside_fit, self.effect.fitted_grip_force_n) {
            (OutsideFit::Hold, Some((low, high))) => force_n.clamp(low, high),
            _ => force_n,
        };
        self.at_force(mu, held, at)
    }

    fn at_force(&self, mu: f64, grip_force_n: f64, at: &GripPoint<'_>) -> f64 {
        (self.hook)(&self.effect.values, mu, &GripPoint { grip_force_n, ..*at })
    }
}

/// The friction laws in the order of the twin; those that refuse the grip force are errors.
fn laws<'a>(
    twin: &'a Twin,
    part_name: &'a str,
    at: &'a GripPoint<'a>,
) -> impl Iterator<Item = Result<Law<'a>, FrictionError>> {
    twin.effects.iter().filter(move |e| e.acts_on(part_name)).filter_map(move |effect| {
        let hook = effect.spec.friction?;
        let mut commanded_n = at.grip_force_n;
        let mut outside_fit = false;
        if let Some((low, high)) = effect.fitted_grip_force_n
            && !(low..=high).contains(&commanded_n)
        {
            outside_fit = true;
            match effect.outside_fit {
                OutsideFit::Error => {
                    return Some(Err(FrictionError::OutsideFit {
                        effect: effect.spec.id,
                        part: part_name.into(),
                        grip_force_n: commanded_n,
                        low,
                        high,
                    }));
                }
                OutsideFit::Hold => commanded_n = commanded_n.clamp(low, high),
                OutsideFit::Extrapolate => {}
            }
        }
        let force_n = normal_force_n(twin, part_name, &GripPoint { grip_force_n: commanded_n, ..*at });
        Some(Ok(Law { effect, hook, force_n, outside_fit }))
    })
}
