//! Sets of effects whose parameters are fitted together, as moments of the presses.

use super::candidates::free_parameter;
use super::observed::Observed;
use super::predict::ActingEffect;
use crate::{FreeParameter, GroupMoments, GroupedModel};

/// A set of effects whose parameters are fitted together.
pub(super) struct NamedModel<'a> {
    pub(super) observed: &'a Observed<'a>,
    pub(super) acting: Vec<ActingEffect>,
    /// Effect and parameter of each free value.
    pub(super) free: Vec<(usize, usize)>,
    pub(super) parameters: Vec<FreeParameter>,
}

impl<'a> NamedModel<'a> {
    pub(super) fn new(observed: &'a Observed<'a>, acting: Vec<ActingEffect>) -> Self {
        let mut free = Vec::new();
        let mut parameters = Vec::new();
        for (e, one) in acting.iter().enumerate() {
            for j in one.free() {
                free.push((e, j));
                let start = one.values[j];
                parameters
                    .push(FreeParameter { start, ..free_parameter(one.spec, j, observed.predictor.px_mm()) });
            }
        }
        Self { observed, acting, free, parameters }
    }

    /// The effects at other values of the free parameters.
    pub(super) fn at(&self, values: &[f64]) -> Vec<ActingEffect> {
        let mut acting = self.acting.clone();
        for (&(e, j), v) in self.free.iter().zip(values) {
            acting[e].values[j] = *v;
        }
        acting
    }

    /// Levels at the pixels of a press, and their derivatives by each free parameter.
    pub(super) fn derivatives(&self, press: usize, values: &[f64]) -> (Vec<[f32; 3]>, Vec<Vec<[f32; 3]>>) {
        let observed = self.observed;
        let base = observed.levels(press, &self.at(values));
        let slopes = self.parameters.iter().enumerate().map(|(k, p)| {
            let step = 0.1 * p.scale;
            let step = if values[k] + step > p.bounds.1 { -step } else { step };
            let mut moved = values.to_vec();
            moved[k] += step;
            let levels = observed.levels(press, &self.at(&moved));
            let slope = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| (a[c] - b[c]) / step as f32);
            levels.iter().zip(&base).map(slope).collect()
        });
        let slopes = slopes.collect();
        (base, slopes)
    }
}

/// Derivatives by the parameters of effects that were accepted, where their fit ended: drawn once, used beside every
/// further candidate.
pub(super) struct Head {
    free: Vec<(usize, usize)>,
    parameters: Vec<FreeParameter>,
    /// By press and parameter.
    slopes: Vec<Vec<Vec<[f32; 3]>>>,
}

impl Head {
    pub(super) fn new(observed: &Observed<'_>, acting: &[ActingEffect]) -> Self {
        let model = NamedModel::new(observed, acting.to_vec());
        let values: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
        let slopes = observed.for_each(observed.count(), |i| model.derivatives(i, &values).1);
        Self { free: model.free, parameters: model.parameters, slopes }
    }

    /// Where the parameters are.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.parameters.iter().map(|p| p.start)
    }
}

impl<'a> NamedModel<'a> {
    /// The last effect of a list alone, those before it where they are.
    pub(super) fn last(observed: &'a Observed<'a>, acting: Vec<ActingEffect>) -> Self {
        let all = Self::new(observed, acting);
        let own = |e: usize| e + 1 == all.acting.len();
        let both = all.free.iter().zip(&all.parameters).filter(|((e, _), _)| own(*e));
        let (free, parameters) = both.map(|(f, p)| (*f, p.clone())).unzip();
        Self { observed, acting: all.acting, free, parameters }
    }

    /// This model's parameters behind those of a head.
    pub(super) fn behind(&self, head: &Head) -> (Vec<(usize, usize)>, Vec<FreeParameter>) {
        let free = head.free.iter().chain(&self.free).copied().collect();
        let parameters = head.parameters.iter().chain(&self.parameters).cloned().collect();
        (free, parameters)
    }

    /// Moments of a head's parameters and this model's.
    pub(super) fn moments_behind(&self, head: &Head, values: &[f64]) -> Vec<GroupMoments> {
        self.observed.for_each(self.observed.count(), |i| {
            let (base, own) = self.derivatives(i, values);
            let slopes: Vec<&Vec<[f32; 3]>> = head.slopes[i].iter().chain(&own).collect();
            moments_of(self.observed, i, &base, &slopes)
        })
    }
}

fn moments_of(
    observed: &Observed<'_>,
    press: usize,
    base: &[[f32; 3]],
    slopes: &[&Vec<[f32; 3]>],
) -> GroupMoments {
    let off = |k: usize, c: usize| f64::from(base[k][c] - observed.pixels[press].measured[k][c]);
    moments_from(observed, press, slopes.len(), off, |k, c, row| {
        row.iter_mut().zip(slopes).for_each(|(r, s)| *r = f64::from(s[k][c]));
    })
}

/// Moments of a press from what its levels are `off` by at a pixel and channel, and the derivatives of them by `n` parameters,
/// which `fill` writes. Where presses have gains of their own, those are taken out of both and stand beside.
pub(super) fn moments_from(
    observed: &Observed<'_>,
    press: usize,
    n: usize,
    off: impl Fn(usize, usize) -> f64,
    fill: impl Fn(usize, usize, &mut [f64]),
) -> GroupMoments {
    let weights = observed.pixel_weights(press);
    let mut moments = GroupMoments::zero(n);
    let mut row = vec![0.0; n];
    let Some(gain_weights) = observed.gain_weights(press) else {
        for (k, weight) in weights.iter().enumerate() {
            for c in 0..3 {
                fill(k, c, &mut row);
                moments.add(off(k, c), &row, *weight);
            }
        }
        moments.finish();
        return moments;
    };
    // [pixel][channel] x n derivatives.
    let mut rows = vec![0.0; 3 * weights.len() * n];
    for (i, row) in rows.chunks_exact_mut(n.max(1)).enumerate() {
        fill(i / 3, i % 3, row);
    }
    let gain = observed.gain_of(press, &off);
    let gains: Vec<[f64; 3]> =
        (0..n).map(|j| observed.gain_of(press, |k, c| rows[(3 * k + c) * n + j])).collect();
    for (k, weight) in weights.iter().enumerate() {
        let level = observed.gained(press, k, [1.0; 3]);
        for c in 0..3 {
            for (j, value) in row.iter_mut().enumerate() {
                *value = rows[(3 * k + c) * n + j] - gains[j][c] * level[c];
            }
            moments.add(off(k, c) - gain[c] * level[c], &row, *weight);
        }
    }
    for c in 0..3 {
        row.iter_mut().zip(&gains).for_each(|(r, g)| *r = g[c]);
        moments.add(gain[c], &row, gain_weights[c]);
    }
    moments.finish();
    moments
}

impl GroupedModel for NamedModel<'_> {
    fn moments(&self, values: &[f64]) -> Vec<GroupMoments> {
        self.observed.for_each(self.observed.count(), |i| {
            let (base, slopes) = self.derivatives(i, values);
            moments_of(self.observed, i, &base, &slopes.iter().collect::<Vec<_>>())
        })
    }

    fn costs(&self, values: &[f64]) -> Vec<f64> {
        let acting = self.at(values);
        self.observed.for_each(self.observed.count(), |i| {
            let levels = self.observed.levels(i, &acting);
            let measured = &self.observed.pixels[i].measured;
            let off = |k: usize, c: usize| f64::from(levels[k][c] - measured[k][c]);
            moments_from(self.observed, i, 0, off, |_, _, _| {}).cost
        })
    }
}
