//! What the jaws of a pull hold.

use super::PullPredictor;
use gripgen_identify::pulls::model::PullModel;
use gripgen_twin::Jaw;
use gripgen_twin::effects::GripPoint;

impl PullPredictor<'_> {
    /// What the jaws of pull `row` hold, without scatter.
    pub(super) fn limit_n(&self, model: &PullModel, row: usize) -> f64 {
        let pull = &self.measured.pulls[row];
        let part = self.part_of[row];
        let mut sum = 0.0;
        for jaw in Jaw::BOTH {
            let mut at = GripPoint {
                jaw,
                grip_force_n: pull.grip_force_n,
                contact_area_m2: 0.0,
                pull_rate_n_per_s: pull.increment_n / pull.step_s,
                covariates: &pull.covariates,
                grip: (0, 0),
            };
            let own = || model.effects.iter().filter(|e| e.part.is_none_or(|p| p == part));
            let force_n = own().fold(at.grip_force_n, |f, e| match e.spec.normal_force {
                Some(hook) => hook(&e.values, f, &at).max(0.0),
                None => f,
            });
            at.grip_force_n = force_n;
            let mu = own().fold(model.mu[part], |mu, e| match e.spec.friction {
                Some(hook) => {
                    let held = e.held_grip_force_n.map_or(force_n, |(low, high)| force_n.clamp(low, high));
                    hook(&e.values, mu, &GripPoint { grip_force_n: held, ..at }).max(0.0)
                }
                None => mu,
            });
            sum += mu * force_n;
        }
        sum * model.factor.get(row).copied().unwrap_or(1.0)
    }
}
