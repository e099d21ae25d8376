//! What is not known of the rig, as points with weights: lag, noise and scatter drawn from their priors, kinetic ratios on a grid.

use super::super::context::Context;
use super::super::priors::PullPriors;
use crate::draws::Draws;

/// Points of lag, noise and scatter without a trace, and of scatter with traces.
const RIGS: (usize, usize) = (16, 8);

/// Distance of kinetic ratios without a trace: that of the tables of labels.
const RATIO_STEP: f64 = 0.025;

/// Weight of a kinetic ratio below which it is left out.
const LEAST: f64 = 0.01;

/// A rig that may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rig {
    pub(super) lag_s: f64,
    pub(super) noise_n: f64,
    pub(super) scatter: f64,
}

/// Rigs, equally likely: a Latin hypercube of the priors (McKay, Beckman and Conover 1979). Traces show lag and noise.
pub(super) fn rigs(context: &Context<'_>, priors: &PullPriors) -> Vec<Rig> {
    let traces = !context.observations.is_empty();
    let count = if traces { RIGS.1 } else { RIGS.0 };
    let mut draws = Draws::new(17, 1);
    let mut column = || -> Vec<f64> {
        let mut order: Vec<usize> = (0..count).collect();
        draws.shuffle(&mut order);
        let place = |k: usize| gripgen_twin::random::normal_quantile((k as f64 + 0.5) / count as f64);
        order.into_iter().map(place).collect()
    };
    let (lag, noise, scatter) = (column(), column(), column());
    (0..count)
        .map(|k| Rig {
            lag_s: if traces { context.base.lag_s } else { priors.lag_s.at(lag[k]) },
            noise_n: if traces { context.base.noise_n } else { priors.noise_n.at(noise[k]) },
            scatter: priors.scatter.at(scatter[k]),
        })
        .collect()
}

/// Kinetic ratios with their weights: what the slips of traces say, or the belief.
pub(super) fn ratios(context: &Context<'_>, priors: &PullPriors) -> Vec<(f64, f64)> {
    if let Some((ratio, sd)) = context.kinetic {
        // Gauss-Hermite, 3 points.
        return [(-3.0_f64.sqrt(), 1.0 / 6.0), (0.0, 2.0 / 3.0), (3.0_f64.sqrt(), 1.0 / 6.0)]
            .map(|(z, weight)| ((ratio + z * sd).clamp(0.3, 1.0), weight))
            .to_vec();
    }
    let p = &priors.kinetic_ratio;
    if p.spread < RATIO_STEP {
        return [-1.2, 0.0, 1.2].map(|z| (p.at(z), 1.0 / 3.0)).to_vec();
    }
    let steps = (1.0 / RATIO_STEP).round() as usize;
    let inside = (0..=steps).map(|k| k as f64 * RATIO_STEP).filter(|k| (p.bounds.0..=p.bounds.1).contains(k));
    let mut all: Vec<(f64, f64)> = inside
        .map(|k| {
            let z = (k - p.centre) / p.spread;
            // Half of the last interval lies beyond 1.
            (k, libm::exp(-0.5 * z * z) * if k > 1.0 - 0.5 * RATIO_STEP { 0.5 } else { 1.0 })
        })
        .collect();
    let sum: f64 = all.iter().map(|(_, w)| w).sum();
    all.retain(|(_, w)| *w > LEAST * sum);
    let sum: f64 = all.iter().map(|(_, w)| w).sum();
    all.iter_mut().for_each(|(_, w)| *w /= sum);
    all
}
