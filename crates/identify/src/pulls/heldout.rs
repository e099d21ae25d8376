//! The error on pulls that a fit has not seen.

use super::candidates::Candidate;
use super::context::Context;
use super::fitting::Fitted;
use super::learnt::learnt_again;
use super::terms::Terms;
use crate::draws::Draws;
use gripgen_twin::predict::PullModel;
use std::sync::Mutex;

/// Share of a label's standard deviation that is not felt.
pub(super) const UNFELT: f64 = 0.1;

/// Folds of repetitions.
const FOLDS: usize = 5;

/// Sets of pulls that are held out one after the other.
pub fn folds(n: usize) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..n).collect();
    let mut draws = Draws::new(5, 1);
    for i in (1..n).rev() {
        order.swap(i, draws.below(i + 1));
    }
    let count = FOLDS.min(n);
    (0..count).map(|k| order.iter().copied().skip(k).step_by(count).collect()).collect()
}

/// One set for each value.
pub fn by_value(of: &[u64]) -> Vec<Vec<usize>> {
    let mut values = of.to_vec();
    values.sort_unstable();
    values.dedup();
    values.iter().map(|v| (0..of.len()).filter(|&i| of[i] == *v).collect()).collect()
}

/// Labels predicted for pulls by a fit that has not seen them. NaN where no fit was possible. With `hold_signals` what acts on
/// signals, which traces show rather than labels, stays as all pulls gave it. Of a fit that is stated, in its context, these
/// are the labels of the simulator to second order in what a fold changes of the model. Without traces nothing is held.
pub fn predicted(
    context: &Context<'_>,
    fitted: &Fitted,
    held_out: &[Vec<usize>],
    hold_signals: bool,
) -> Vec<f64> {
    let n = context.data.len();
    let result = Mutex::new(vec![f64::NAN; n]);
    // Labels alone show what acts on signals too: then it is fitted again like everything else.
    let hold_signals = hold_signals && !context.observations.is_empty();
    // What was learnt without a name is learnt again from the pulls of each fold.
    let learns = !fitted.terms.learnt.is_empty();
    let terms = &Terms { hold_signals, learnt: vec![], ..fitted.terms.clone() };
    context.predictor.for_each(held_out.len(), &|k| {
        let out = &held_out[k];
        let rows: Vec<usize> = (0..n).filter(|i| !out.contains(i)).collect();
        let (start, terms) = unfelt_forgotten(context, &fitted.model, unseen_forgotten(terms, &rows), &rows);
        let Some(found) = context.fit_again(&start, &terms, &rows) else {
            return;
        };
        let found = if learns { learnt_again(context, found, &rows, terms.learnt_share) } else { found };
        let mut model = found.model;
        model.scatter = scatter(&model, found.likelihood.scale);
        // What the simulator says beyond the fast prediction was worked out with the effect that is forgotten.
        let labels = match terms.stated && terms.effects.len() < fitted.terms.effects.len() {
            true => context.predictor.labels_n(&model, out),
            false => context.labels_n(&model, out),
        };
        if let Ok(mut result) = result.lock() {
            out.iter().zip(&labels).for_each(|(&i, label_n)| result[i] = *label_n);
        }
    });
    result.into_inner().unwrap_or_default()
}

/// Terms without what all pulls said of words that no pull at `rows` has: a step of a session that is held out is not known.
fn unseen_forgotten(terms: &Terms, rows: &[usize]) -> Terms {
    let mut terms = terms.clone();
    for (curve, values) in &mut terms.curves {
        for (k, value) in values.iter_mut().enumerate() {
            let mut own = rows.iter().map(|&i| curve.basis[i][k]);
            let first = own.next();
            if own.all(|v| Some(v) == first) {
                *value = 0.0;
            }
        }
    }
    terms
}

/// A model and its terms without the effects that no pull at `rows` feels, though they have a size: the end of a range that only the pulls
/// which are held out reach.
fn unfelt_forgotten(
    context: &Context<'_>,
    model: &PullModel,
    mut terms: Terms,
    rows: &[usize],
) -> (PullModel, Terms) {
    let mut start = model.clone();
    let ends = terms.effects.iter().map(|(c, _)| c).filter(|c| c.is_end_of_a_range());
    for candidate in ends.cloned().collect::<Vec<Candidate>>() {
        if unfelt_without(context, &start, &candidate, rows) {
            terms.effects.retain(|(c, _)| c.spec != candidate.spec);
            start.effects.retain(|effect| effect.spec != candidate.spec);
        }
    }
    (start, terms)
}

/// Whether no label at `rows` is another where an effect has no size.
fn unfelt_without(context: &Context<'_>, model: &PullModel, candidate: &Candidate, rows: &[usize]) -> bool {
    // At its neutral value rather than without it: the same way of predicting.
    let (spec, size) = (candidate.spec, candidate.size());
    let mut neutral = model.clone();
    let effects = neutral.effects.iter_mut().filter(|effect| effect.spec == spec);
    effects.for_each(|effect| effect.values[size] = spec.parameters[size].neutral);
    let labels = [model, &neutral].map(|model| context.labels_n(model, rows));
    let sd_n = context.deviations(model, rows);
    (0..rows.len()).all(|k| (labels[0][k] - labels[1][k]).abs() <= UNFELT * sd_n[k])
}

/// The pulls of `rows` whose labels are others where an effect has no size.
pub(super) fn feeling(
    context: &Context<'_>,
    model: &PullModel,
    candidate: &Candidate,
    rows: &[usize],
) -> Vec<usize> {
    rows.iter().copied().filter(|&i| !unfelt_without(context, model, candidate, &[i])).collect()
}

/// How a rival predicts pulls that no fit has seen, against the model without it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutScore {
    /// Gain in log-likelihood: half the difference of the squared errors over the variance that is left.
    pub gain: f64,
    /// Standard error of the gain, pulls taken as independent.
    pub standard_error: f64,
    /// Root mean square of its errors.
    pub rmse_n: f64,
}

/// Scores predictions at the pulls of `rows` against those without the rival. `sd_n` are the standard deviations of the
/// labels: a weak grip that is predicted well says as much as a strong one.
pub fn held_out_score(
    label_n: &[f64],
    sd_n: &[f64],
    without: &[f64],
    with: &[f64],
    rows: &[usize],
) -> Option<HeldOutScore> {
    let known: Vec<usize> =
        rows.iter().copied().filter(|&i| without[i].is_finite() && with[i].is_finite()).collect();
    let n = known.len() as f64;
    let mean = |of: &dyn Fn(usize) -> f64| known.iter().map(|&i| of(i)).sum::<f64>() / n;
    let error = |predicted: &[f64], i: usize| predicted[i] - label_n[i];
    let relative = mean(&|i| (error(with, i) / sd_n[i]).powi(2));
    if known.len() < 3 || relative <= 0.0 {
        return None;
    }
    let each = |i: usize| {
        let (a, b) = (error(without, i) / sd_n[i], error(with, i) / sd_n[i]);
        0.5 * (a * a - b * b) / relative
    };
    let gain = mean(&each);
    let variance = mean(&|i| (each(i) - gain).powi(2)) * n / (n - 1.0);
    Some(HeldOutScore {
        gain: n * gain,
        standard_error: (n * variance).sqrt(),
        rmse_n: mean(&|i| error(with, i).powi(2)).sqrt(),
    })
}

/// The scatter of friction that residuals of this scale show.
pub fn scatter(model: &PullModel, scale: f64) -> f64 {
    (model.scatter * scale).clamp(0.001, 0.3)
}

/// Scatter of repetitions about the mean of their configuration, after what a model predicts of their differences is
/// taken out: pooled standard deviation. Without repetitions the errors themselves, with the fitted parameters counted.
pub fn noise_floor_n(errors: &[f64], groups: &[usize], parameters: usize) -> f64 {
    let count = groups.iter().max().map_or(0, |g| g + 1);
    let mut sums = vec![(0.0, 0.0, 0_usize); count];
    for (e, g) in errors.iter().zip(groups) {
        sums[*g].0 += e;
        sums[*g].1 += e * e;
        sums[*g].2 += 1;
    }
    let (mut square, mut free) = (0.0, 0_usize);
    for (sum, squares, n) in sums.into_iter().filter(|s| s.2 > 1) {
        square += squares - sum * sum / n as f64;
        free += n - 1;
    }
    if free >= 10 {
        return (square / free as f64).max(0.0).sqrt();
    }
    let n = errors.len();
    (errors.iter().map(|e| e * e).sum::<f64>() / n.saturating_sub(parameters).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps between three sessions: where the third is held out, its step is unknown and the other one stays.
    #[test]
    fn the_step_of_a_session_that_is_held_out_is_forgotten() {
        let column = super::super::data::Column::Word(
            vec![0, 0, 0, 1, 1, 1, 2, 2, 2],
            ["a", "b", "c"].map(String::from).to_vec(),
        );
        let curve = super::super::curves::curves_in("session", &column).remove(0);
        let terms = Terms { curves: vec![(curve, vec![0.2, -0.3])], ..Terms::default() };
        assert_eq!(unseen_forgotten(&terms, &[0, 1, 2, 3, 4, 5]).curves[0].1, vec![0.2, 0.0]);
        assert_eq!(unseen_forgotten(&terms, &[0, 1, 3, 4, 8]).curves[0].1, vec![0.2, -0.3]);
    }

    #[test]
    fn every_pull_is_held_out_once() {
        let mut all: Vec<usize> = folds(23).concat();
        all.sort_unstable();
        assert_eq!(all, (0..23).collect::<Vec<_>>());
        assert_eq!(by_value(&[3, 1, 3]), vec![vec![1], vec![0, 2]]);
    }

    /// Errors of 2 N that become 1 N gain 1.5 each, all alike.
    #[test]
    fn gains_are_those_of_the_squares() {
        let label = [10.0; 8];
        let found = held_out_score(&label, &[0.5; 8], &[12.0; 8], &[9.0; 8], &[0, 1, 2, 3]).unwrap();
        assert_eq!(found, HeldOutScore { gain: 6.0, standard_error: 0.0, rmse_n: 1.0 });
        assert_eq!(held_out_score(&label, &[0.5; 8], &[12.0; 8], &[f64::NAN; 8], &[0, 1, 2, 3]), None);
    }

    #[test]
    fn the_floor_is_the_scatter_within_configurations() {
        let errors = [1.0, 3.0, 10.0, 12.0, -5.0, -3.0];
        let groups = [0, 0, 1, 1, 2, 2];
        // Three free differences are too few: the errors themselves.
        assert!((noise_floor_n(&errors, &groups, 0) - (288.0_f64 / 6.0).sqrt()).abs() < 1e-9);
        let errors: Vec<f64> =
            (0..40).map(|i| f64::from(i / 2) + if i % 2 == 0 { 0.5 } else { -0.5 }).collect();
        let groups: Vec<usize> = (0..40).map(|i| i / 2).collect();
        assert!((noise_floor_n(&errors, &groups, 0) - 0.5_f64.sqrt()).abs() < 1e-9);
    }
}
