//! What a campaign can show before it is measured: the size from which on each effect is seen, and what would look like it.

use super::candidates::candidates;
use super::context::Context;
use super::data::PullData;
use super::power::{SEEN, ScoreTest};
use super::terms::Terms;
use crate::diagnosis::Detectable;
use gripgen_twin::MeasuredPulls;
use gripgen_twin::predict::{PredictPulls, PullModel};

/// An effect in a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectableEffect {
    /// Its name in the library.
    pub name: &'static str,
    /// The size that is seen with a probability of 0.8 at a level of 1 %; `None` where the campaign cannot show it at any physical size.
    pub seen: Option<Detectable>,
    /// Unit of that size.
    pub unit: &'static str,
    /// Effects that explain it: fitted in its place, they leave less than one standard error of it at that size.
    pub alike: Vec<&'static str>,
}

/// What pulls like `measured` show of each effect whose columns vary in them, in the order of the library. Slopes of residuals by the size of an
/// effect, as far as friction, kinetic ratio and force loop do not explain them (a score test, Rao 1948). `None` where nothing can be fitted.
pub fn detectable_effects(
    measured: &MeasuredPulls,
    predictor: &dyn PredictPulls,
    given: &PullModel,
) -> Option<Vec<DetectableEffect>> {
    let data = PullData::new(measured);
    let context = Context::new(&data, predictor, given);
    let rows: Vec<usize> = (0..data.len()).collect();
    let plain = context.fit(&context.base, &Terms::default(), &rows)?;
    let test = ScoreTest::new(&context, &plain.model, &plain.terms, &rows, !context.observations.is_empty());
    let largest_n = data.label_n.iter().copied().fold(0.0, f64::max);
    let mut all = candidates(&data, largest_n, context.creep_m_per_n_s(), &[]);
    // A little of what acts beyond a force alone does nothing: no slope says from where on it would be seen.
    all.retain(|c| c.spec.pulls.is_ok_and(|fit| !fit.flat_at_neutral));
    let directions: Vec<_> = all
        .iter()
        .map(|c| {
            let direction = test.direction(c, &c.starts[c.starts.len() / 2]);
            let length = direction.norm();
            (length > 0.0).then(|| direction / length)
        })
        .collect();
    // What is left of an effect at the size that is seen, where another is fitted: SEEN times the sine of the angle between them.
    let cosine = (1.0 - 1.0 / (SEEN * SEEN)).sqrt();
    let alike = |i: usize| {
        let others = (0..all.len()).filter(|&k| k != i);
        let near = |&k: &usize| {
            directions[i].as_ref().zip(directions[k].as_ref()).is_some_and(|(a, b)| a.dot(b).abs() > cosine)
        };
        others.filter(near).map(|k| all[k].spec.id).collect::<Vec<_>>()
    };
    let effect = |i: usize| {
        let seen = test.detectable(&all[i]);
        let unit = all[i].spec.parameters[all[i].size()].unit;
        let alike = if seen.is_some() { alike(i) } else { vec![] };
        DetectableEffect { name: all[i].spec.id, seen, unit, alike }
    };
    Some((0..all.len()).map(effect).collect())
}
