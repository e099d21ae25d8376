//! Pulls whose tools creep under a force that the jaws hold, each grip at a rate of its own.

use super::PullPredictor;
use super::limit::NormalForce;
use gripgen_twin::effects::Creep;
use gripgen_twin::predict::{PullModel, PullPrediction};

/// Ratio of the rates for which there are tables. Labels that end at the stop go with one over the root of the rate, so that is what is linear
/// between two of them.
const RATE_RATIO: f64 = 1.2;

/// Rates below this reach no stop: 5 mm at 100 N take 50 s.
const LEAST_M_PER_N_S: f64 = 1e-6;

/// Whether tools of a model creep.
pub(super) fn creeps(model: &PullModel) -> bool {
    model.effects.iter().any(|e| e.spec.creep.is_some())
}

impl PullPredictor<'_> {
    /// How the tool of pull `row` creeps.
    pub(super) fn creep(&self, model: &PullModel, row: usize) -> Creep {
        let NormalForce { mut at, force_n } = self.normal_force(model, row);
        at.grip_force_n = 0.5 * (force_n.left + force_n.right);
        let part = self.part_of[row];
        let own = model.effects.iter().filter(|e| e.part.is_none_or(|p| p == part));
        own.filter_map(|e| Some(e.spec.creep?(&e.values, &at))).next_back().unwrap_or_default()
    }

    /// The prediction of pull `row` from tables of the signals of pull `signals`: between those of two rates.
    pub(super) fn crept(&self, model: &PullModel, signals: usize, row: usize) -> PullPrediction {
        let limit_n = self.limit_n(model, row);
        let creep = self.creep(model, row);
        let at = |rate_m_per_n_s: f64| {
            let creep = Some(Creep { rate_m_per_n_s, ..creep });
            let model = PullModel { creep, ..model.clone() };
            self.at(&self.tables_of(&model, signals), limit_n)
        };
        if creep.rate_m_per_n_s < LEAST_M_PER_N_S {
            return at(0.0);
        }
        let place = libm::log(creep.rate_m_per_n_s / LEAST_M_PER_N_S) / libm::log(RATE_RATIO);
        let node = |k: f64| LEAST_M_PER_N_S * libm::pow(RATE_RATIO, k);
        let (low, high) = (node(place.floor()), node(place.floor() + 1.0));
        let [low_root, root, high_root] = [low, creep.rate_m_per_n_s, high].map(|rate| 1.0 / rate.sqrt());
        at(low).mixed(&at(high), ((low_root - root) / (low_root - high_root)).clamp(0.0, 1.0))
    }
}
