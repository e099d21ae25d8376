//! Settings of the label rule under which labels are explained: the kinetic ratios that are tried.

use super::gaussian::Measured;
use super::labels::LabelCurves;
use super::search::{Fit, Search};
use crate::pulls::data::PullData;
use gripgen_twin::predict::{PredictPulls, PullModel};

/// Kinetic ratios that are tried. What is believed of them: 1/2 to 1 for rough contacts (Farkas 2005, cond-mat/0502644), areas that fall by
/// up to 30 % before the slip (Sahli 2018, 10.1073/pnas.1706434115); 0.84 with a deviation of 0.09.
const RATIOS: [f64; 7] = [1.0, 0.95, 0.9, 0.84, 0.78, 0.7, 0.6];
const RATIO: (f64, f64) = (0.84, 0.09);

/// Labels of one setting of the label rule with the search over them.
pub(super) struct Setting {
    pub(super) curves: LabelCurves,
    pub(super) log_prior: f64,
    pub(super) search: Search,
    pub(super) plain: Fit,
    /// What labels of the simulator lie above those of the curves, near the model that is fitted.
    pub(super) above_n: Vec<f64>,
}

impl Setting {
    /// Takes the labels, less what the simulator adds to them, as linear about those of these logarithms of friction.
    pub(super) fn look_near(&mut self, label_n: &[f64], z: &[f64]) {
        let own: Vec<f64> = label_n.iter().zip(&self.above_n).map(|(y, above)| y - above).collect();
        let wider = std::mem::replace(&mut self.search.measured.wider, nalgebra::DVector::zeros(0));
        self.search.measured = Measured { wider, ..self.curves.measured_near(&own, z) };
    }
}

/// A setting of the label rule, and how well parts alone explain the labels with it.
fn setting(
    data: &PullData<'_>,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    ratio: f64,
) -> Option<Setting> {
    let model = PullModel { kinetic_ratio: ratio, ..given.clone() };
    let curves = LabelCurves::new(predictor, &model, data.len());
    let search = Search::new(data, curves.measured(&data.label_n), vec![]);
    let plain = search.plain()?;
    let far = (ratio - RATIO.0) / RATIO.1;
    Some(Setting { curves, log_prior: -0.5 * far * far, search, plain, above_n: vec![0.0; data.len()] })
}

/// The settings from which a search starts. With traces (`seen`), that of the kinetic ratio that they show, or else the best one. Without,
/// that in which the force does not fall after the slip, and the best other one; the lag is that of the twin.
pub(super) fn settings(
    data: &PullData<'_>,
    predictor: &dyn PredictPulls,
    given: &PullModel,
    seen: bool,
    ratio: Option<f64>,
) -> Vec<Setting> {
    let best = |found: Vec<Setting>| {
        let score = |s: &Setting| s.plain.score + s.log_prior;
        found.into_iter().reduce(|a, b| if score(&b) > score(&a) { b } else { a })
    };
    let over =
        |ratios: &[f64]| best(ratios.iter().filter_map(|r| setting(data, predictor, given, *r)).collect());
    if seen {
        return over(&ratio.map_or(RATIOS.to_vec(), |ratio| vec![ratio])).into_iter().collect();
    }
    over(&RATIOS[..1]).into_iter().chain(over(&RATIOS[1..])).collect()
}
