//! What the jaws of a pull hold.

use super::PullPredictor;
use gripgen_twin::effects::GripPoint;
use gripgen_twin::predict::PullModel;
use gripgen_twin::{Jaw, PerJaw};

/// How hard the jaws of a pull press.
pub(super) struct NormalForce<'a> {
    /// A jaw as it was commanded.
    pub at: GripPoint<'a>,
    /// Real normal force of each jaw.
    pub force_n: PerJaw<f64>,
}

impl PullPredictor<'_> {
    /// The normal forces of pull `row`.
    pub(super) fn normal_force(&self, model: &PullModel, row: usize) -> NormalForce<'_> {
        let pull = &self.measured.pulls[row];
        let part = self.part_of[row];
        let at = GripPoint {
            jaw: Jaw::Left,
            grip_force_n: pull.grip_force_n,
            contact_area_m2: 0.0,
            pull_rate_n_per_s: pull.increment_n / pull.step_s,
            covariates: &pull.covariates,
            grip: (0, 0),
        };
        let force_n = PerJaw::from_fn(|jaw| {
            let at = GripPoint { jaw, ..at };
            let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == part));
            own.fold(at.grip_force_n, |f, e| match e.spec.normal_force {
                Some(hook) => hook(&e.values, f, &at).max(0.0),
                None => f,
            })
        });
        NormalForce { at, force_n }
    }

    /// What the jaws of pull `row` hold, without scatter.
    pub(super) fn limit_n(&self, model: &PullModel, row: usize) -> f64 {
        let part = self.part_of[row];
        let NormalForce { at, force_n } = self.normal_force(model, row);
        let mut sum = 0.0;
        for jaw in Jaw::BOTH {
            let force_n = force_n[jaw];
            let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == part));
            let mu = own.fold(model.mu[part], |mu, e| match e.spec.friction {
                Some(hook) => {
                    let held = e.held_grip_force_n.map_or(force_n, |(low, high)| force_n.clamp(low, high));
                    hook(&e.values, mu, &GripPoint { jaw, grip_force_n: held, ..at }).max(0.0)
                }
                None => mu,
            });
            sum += mu * force_n;
        }
        sum * model.factor.get(row).copied().unwrap_or(1.0)
    }
}
