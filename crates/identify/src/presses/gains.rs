//! Gains that differ from press to press by chance: a camera that balances white, or exposes, by itself.
//!
//! Each press says its own gain away from the contact. What of the gains goes smoothly with the order of the presses, or steps
//! once, has causes of other names (light, exposure, another background); what is left is the camera's.

use super::candidates::press_effects;
use super::observed::Observed;
use super::predict::ActingEffect;
use super::score::{Design, MATERIAL, PressTrial, SURE, differences, shares};
use super::unnamed::{PressCovariate, PressValues};
use crate::Detectable;
use nalgebra::{DMatrix, DVector};

/// Gains scatter if they differ by this many times what the halves of a frame disagree by.
const ABOVE_NOISE: f64 = 2.0;

/// A camera that is known to scatter does so more than was known if its gains scatter by this factor more.
const ABOVE_KNOWN: f64 = 1.5;

/// A column explains gains if it leaves less than this share of them.
const MOST: f64 = 0.3;

/// Presses from which on a step in the order is looked for.
const STEPS_FROM: usize = 10;

/// Presses before and after a step at least.
const MIN_PRESSES_PER_SIDE: usize = 3;

/// What the gains of presses say.
pub(super) struct Scatter {
    /// The effect, where it is one.
    pub(super) named: Option<ActingEffect>,
    /// 90 % intervals of the standard deviations.
    pub(super) intervals: [(f64, f64); 3],
    /// How it did.
    pub(super) trial: Option<PressTrial>,
    /// The scatter that would have been found.
    pub(super) seen_from: Option<(String, Detectable)>,
}

impl Scatter {
    /// Some effects with this one, as one with its like.
    pub(super) fn beside(&self, mut acting: Vec<ActingEffect>) -> Vec<ActingEffect> {
        let Some(own) = &self.named else { return acting };
        match acting.iter_mut().find(|effect| effect.spec == own.spec) {
            Some(like) => {
                let from = like.values.len() - 3;
                like.values[from..].copy_from_slice(&own.values[from..]);
            }
            None => acting.push(own.clone()),
        }
        acting
    }
}

/// Looks whether presses have gains of their own, and lets `observed` divide them from then on if they have, or if the sensor
/// file says so (`known`: standard deviations of their logarithms).
pub(super) fn scatter(
    observed: &mut Observed<'_>,
    design: &Design,
    covariates: &[PressCovariate],
    known: Option<[f64; 3]>,
) -> Scatter {
    let nothing = Scatter { named: None, intervals: [(0.0, 0.0); 3], trial: None, seen_from: None };
    let Some((spec, _)) = press_effects().find(|(_, fit)| fit.scatters == 3) else { return nothing };
    observed.rescale(&[]);
    let plain = observed.pixel_costs(&[]);
    observed.divide_gains();
    let (gains, noise) = measured(observed);
    let (base, _) = design.mean(&plain);
    let divided = observed.pixel_costs(&[]);
    let (gain, error) = design.mean(&differences(&plain, &divided));
    // Gains of the size of chance differ from press to press by nature, so how sure they are is a matter of shares.
    let (share_off, share_error) = design.mean(&shares(&plain, &divided));
    let freedom = gains.len() as f64 - terms(gains.len()) as f64;
    let sd = left_over(&gains, covariates, freedom);
    let square = |values: &[f64; 3]| values.iter().map(|v| v * v).sum::<f64>();
    let all = gains.iter().map(square).sum::<f64>() / gains.len() as f64;
    // What goes with the order has its share of the gain, and other names.
    let share = (square(&sd) / all.max(1e-300)).min(1.0);
    let least = MATERIAL * base;
    let (gain, error) = (gain * share, error * share);
    let is_there = square(&sd) > ABOVE_NOISE * ABOVE_NOISE * square(&noise)
        && gain > least
        && share_off > SURE * share_error;
    let is_new = known.is_none_or(|known| square(&sd) > ABOVE_KNOWN * ABOVE_KNOWN * square(&known));
    let sd = sd.map(|sd| sd.clamp(0.0, 0.5));
    let own = &spec.parameters[spec.parameters.len() - 3..];
    let text = own.iter().zip(sd).map(|(p, v)| format!("{} {v:.3}", p.name));
    let trial = PressTrial {
        round: 0,
        name: spec.id.into(),
        gain,
        standard_error: error,
        cost: base - gain,
        values: text.collect::<Vec<_>>().join(", "),
    };
    if known.is_none() && !is_there {
        observed.keep_gains();
    }
    observed.measure_gains_by(match known {
        Some(known) if !(is_there && is_new) => known,
        _ => sd,
    });
    if is_there && is_new {
        // Of the logarithm of a standard deviation: 1 / sqrt(2 freedom).
        let factor = libm::exp(1.645 / (2.0 * freedom.max(1.0)).sqrt());
        let intervals = sd.map(|sd| (sd / factor, sd * factor));
        let neutral = spec.parameters.iter().map(|p| p.neutral);
        let values = neutral.take(spec.parameters.len() - 3).chain(sd).collect();
        let named = Some(ActingEffect { spec, values, fitted: 0 });
        return Scatter { named, intervals, trial: Some(trial), seen_from: None };
    }
    // The cost that a scatter takes off goes with its square.
    let of_cost = if gain > 0.0 { square(&sd) * least / gain } else { 0.0 };
    let of_known = known.map_or(0.0, |known| ABOVE_KNOWN * ABOVE_KNOWN * square(&known));
    let of_noise = ABOVE_NOISE * ABOVE_NOISE * square(&noise);
    let value = (of_cost.max(of_known).max(of_noise) / 3.0).sqrt().clamp(1e-4, 0.5);
    let parameter = own[0].name.into();
    let seen_from = Some((spec.id.into(), Detectable { parameter, value, power: 0.8 }));
    Scatter { trial: Some(trial), seen_from, ..nothing }
}

/// The gains of each press, as shares, and how much the halves of a frame disagree on them.
fn measured(observed: &Observed<'_>) -> (Vec<[f64; 3]>, [f64; 3]) {
    let count = observed.count();
    let mut squares = [0.0; 3];
    let gains = (0..count).map(|press| {
        let levels = observed.levels(press, &[]);
        let pixels = &observed.pixels[press];
        let off = |k: usize, c: usize| f64::from(pixels.measured[k][c] - levels[k][c]);
        let half = |left: bool| observed.gain_in(press, |k| (pixels.places[k][0] < 0.0) == left, off);
        let (left, right) = (half(true), half(false));
        (0..3).for_each(|c| squares[c] += (left[c] - right[c]).powi(2) / 4.0);
        observed.gain_of(press, off)
    });
    let gains = gains.collect();
    (gains, squares.map(|s| (s / count.max(1) as f64).sqrt()))
}

/// Terms of what goes smoothly with the order, with a step where one is looked for.
fn terms(count: usize) -> usize {
    degree(count) + 1 + if count >= STEPS_FROM { 2 } else { 0 }
}

fn degree(count: usize) -> usize {
    (count.saturating_sub(2) / 3).min(3)
}

/// Standard deviation of what a polynomial in the order leaves of the gains, with a step at its best place.
fn left_over(gains: &[[f64; 3]], covariates: &[PressCovariate], freedom: f64) -> [f64; 3] {
    let n = gains.len();
    let smooth = |i: usize, d: usize| libm::pow(2.0 * i as f64 / (n.max(2) - 1) as f64 - 1.0, d as f64);
    let steps = (MIN_PRESSES_PER_SIDE..(n + 1).saturating_sub(MIN_PRESSES_PER_SIDE)).map(Some);
    let places: Vec<Option<usize>> = std::iter::once(None).chain(steps.filter(|_| n >= STEPS_FROM)).collect();
    let squares = |step: Option<usize>, further: &[Vec<f64>]| {
        let ordered = degree(n) + 1 + usize::from(step.is_some());
        let columns = ordered + further.len();
        let design = DMatrix::from_fn(n, columns, |i, d| match step {
            _ if d >= ordered => further[d - ordered][i],
            Some(from) if d == ordered - 1 => f64::from(u8::from(i >= from)),
            _ => smooth(i, d),
        });
        [0, 1, 2].map(|c| {
            let values = DVector::from_fn(n, |i, _| gains[i][c]);
            let mut normal = design.tr_mul(&design);
            (0..columns).for_each(|d| normal[(d, d)] += 1e-9);
            let Some(solver) = normal.cholesky() else { return values.norm_squared() };
            (&values - &design * solver.solve(&design.tr_mul(&values))).norm_squared()
        })
    };
    let total = |s: &[f64; 3]| s.iter().sum::<f64>();
    let best_of = |further: &[Vec<f64>]| {
        let all = places.iter().map(|&step| squares(step, further));
        all.min_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_default()
    };
    // A column that explains most of what is left has a name of its own.
    let of_columns = covariates.iter().map(|covariate| best_of(&curve(covariate, n)));
    let plain = best_of(&[]);
    let best = of_columns
        .filter(|left| total(left) < MOST * total(&plain))
        .fold(plain, |a, b| if total(&b) < total(&a) { b } else { a });
    best.map(|s| (s / freedom.max(1.0)).sqrt())
}

/// A column and its square, or its words one by one; nothing where it says too little or too much.
fn curve(covariate: &PressCovariate, n: usize) -> Vec<Vec<f64>> {
    match &covariate.values {
        PressValues::Numbers(values) => {
            let (low, high) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            if values.len() != n || high <= low || !(high - low).is_finite() {
                return Vec::new();
            }
            let scaled: Vec<f64> = values.iter().map(|v| 2.0 * (v - low) / (high - low) - 1.0).collect();
            let square = scaled.iter().map(|x| x * x).collect();
            vec![scaled, square]
        }
        PressValues::Words(words) => {
            let mut levels: Vec<&String> = words.iter().collect();
            levels.sort();
            levels.dedup();
            if words.len() != n || 3 * levels.len() > n {
                return Vec::new();
            }
            let of = |level: &&String| words.iter().map(|w| f64::from(u8::from(w == *level))).collect();
            levels.iter().skip(1).map(of).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    fn sd_of(of: impl Fn(usize, f64) -> f64) -> f64 {
        let mut draws = Draws::new(5, 2);
        let gains: Vec<[f64; 3]> = (0..30).map(|i| [of(i, draws.normal()), 0.0, 0.0]).collect();
        left_over(&gains, &[], 30.0 - terms(30) as f64)[0]
    }

    /// A lamp that warms up, and one that was exchanged, leave nothing; chance stays, beside them too.
    #[test]
    fn what_goes_with_the_order_is_no_scatter() {
        let warming = |i: usize| -0.1 * (1.0 - (-(i as f64) / 8.0).exp());
        let exchanged = |i: usize| if i < 12 { 0.0 } else { 0.08 };
        assert!(sd_of(|i, _| warming(i)) < 2e-3);
        assert!(sd_of(|i, _| exchanged(i)) < 1e-6);
        for cause in [&warming as &dyn Fn(usize) -> f64, &exchanged] {
            let sd = sd_of(|i, n| cause(i) + 0.03 * n);
            assert!((0.02..0.04).contains(&sd), "{sd}");
        }
    }
}
