//! The posterior density of few pulls at a point, for samplers that check the draws.

use super::super::context::Context;
use super::super::data::PullData;
use super::super::priors::PullPriors;
use super::part::PartOnRig;
use super::prepared;
use gripgen_twin::predict::{PredictPulls, PullModel};

/// What the draws of [`super::calibrate_few`] are draws of: likelihood times belief, of labels alone.
///
/// A point is one standard normal variable for each quantity, of which belief is a function ([`super::super::priors::Prior::at`]): the coefficient of
/// each part, with its offset after it where there is a law; then kinetic ratio, lag, noise and scatter.
pub struct FewDensity<'a> {
    context: Context<'a>,
    priors: &'a PullPriors,
    law: bool,
}

impl<'a> FewDensity<'a> {
    /// Of these pulls. `None` where nothing can be predicted, or where there are traces, which are weighed otherwise.
    pub fn new(
        data: &'a PullData<'a>,
        predictor: &'a dyn PredictPulls,
        given: &PullModel,
        priors: &'a PullPriors,
        law: bool,
    ) -> Option<Self> {
        let context = prepared(data, predictor, given, priors, law)?;
        context.observations.is_empty().then_some(Self { context, priors, law })
    }

    /// How many variables a point has.
    pub fn dimensions(&self) -> usize {
        self.context.data.parts.len() * self.each() + 4
    }

    fn each(&self) -> usize {
        1 + usize::from(self.law)
    }

    /// Logarithm of the density at a point of [`Self::dimensions`] variables, up to a constant.
    pub fn log_at(&self, z: &[f64]) -> f64 {
        let parts = self.context.data.parts.len();
        let rig = &z[parts * self.each()..];
        let model = PullModel {
            kinetic_ratio: self.priors.kinetic_ratio.at(rig[0]),
            lag_s: self.priors.lag_s.at(rig[1]),
            noise_n: self.priors.noise_n.at(rig[2]),
            scatter: self.priors.scatter.at(rig[3]),
            misread_n: 0.0,
            ..self.context.base.clone()
        };
        let of_part = |part: usize| {
            let rows: Vec<usize> =
                (0..self.context.data.len()).filter(|&i| self.context.data.part_of[i] == part).collect();
            let own = PartOnRig {
                context: &self.context,
                priors: self.priors,
                rig: &model,
                part,
                rows: &rows,
                law: self.law,
            };
            own.log_likelihood(&own.model(own.friction(&z[part * self.each()..(part + 1) * self.each()])))
        };
        (0..parts).map(of_part).sum::<f64>() - 0.5 * z.iter().map(|z| z * z).sum::<f64>()
    }
}
