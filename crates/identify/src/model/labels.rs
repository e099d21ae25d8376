//! What labels say of friction: the factor on the friction of a pull that makes its label the expected one.
//!
//! The label rule, the staircase, the force loop and the kinetic ratio are in the prediction, so that the residual is that of the logarithm
//! of the friction, in which effects add.

use super::gaussian::Measured;
use gripgen_twin::predict::{ModelEffect, PredictPulls, PullModel};
use nalgebra::DVector;

/// Logarithms of factors on which labels are predicted: from a fiftieth to fifty times the friction of the model.
const WIDEST: f64 = 4.0;
const NODES: usize = 161;

/// Share of the limit by which the label moves at least with the logarithm of the friction: on the flat part of a label rule a label
/// says little, and not nothing.
const FLATTEST: f64 = 0.02;

/// An effect that leaves less than this share of the friction of a pull is not one of these pulls: they had labels.
const LEAST_SHARE: f64 = 1e-2;

/// Expected labels of all pulls of a model as functions of the friction.
pub(super) struct LabelCurves {
    /// The model, with the friction of the parts, without effects and without scatter.
    pub(super) model: PullModel,
    /// Limits of the model.
    limits_n: Vec<f64>,
    /// Of each pull the expected label at each node, rising.
    labels_n: Vec<Vec<f64>>,
}

fn node(k: usize) -> f64 {
    WIDEST * (2.0 * k as f64 / (NODES - 1) as f64 - 1.0)
}

impl LabelCurves {
    /// Of a model; its scatter, factors and effects are taken out.
    pub(super) fn new(predictor: &dyn PredictPulls, model: &PullModel, pulls: usize) -> Self {
        let rows: Vec<usize> = (0..pulls).collect();
        let model = PullModel { scatter: 0.0, effects: vec![], factor: vec![1.0; pulls], ..model.clone() };
        let mut labels_n = vec![Vec::with_capacity(NODES); pulls];
        for k in 0..NODES {
            let at = PullModel { factor: vec![libm::exp(node(k)); pulls], ..model.clone() };
            for (own, predicted) in labels_n.iter_mut().zip(predictor.pulls(&at, &rows)) {
                let before = own.last().copied().unwrap_or(0.0);
                own.push(predicted.label_n.max(before));
            }
        }
        Self { limits_n: predictor.limits_n(&model), model, labels_n }
    }

    /// Logarithm of the factor that explains a label of a pull, and the slope of the label there.
    fn explained(&self, row: usize, label_n: f64) -> (f64, f64) {
        let labels = &self.labels_n[row];
        let above = labels.partition_point(|l| *l < label_n).clamp(1, NODES - 1);
        let (low, high) = (labels[above - 1], labels[above]);
        let share = if high > low { ((label_n - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
        let z = node(above - 1) + share * (node(above) - node(above - 1));
        let (a, b) = (above.saturating_sub(2), (above + 1).min(NODES - 1));
        let slope = (labels[b] - labels[a]) / (node(b) - node(a));
        (z, slope.max(FLATTEST * self.limits_n[row] * libm::exp(z)))
    }

    /// Slope of the expected label with the logarithm of the friction.
    fn slope(&self, row: usize, z: f64) -> f64 {
        let step = 2.0 * WIDEST / (NODES - 1) as f64;
        let slope = (self.label_n(row, z + step) - self.label_n(row, z - step)) / (2.0 * step);
        slope.max(FLATTEST * self.limits_n[row] * libm::exp(z))
    }

    /// The labels as logarithms of friction, linear about those of `z`, which are near: the noise of a reading then has mean 0, where
    /// the logarithm of a noisy label has not.
    pub(super) fn measured_near(&self, label_n: &[f64], z: &[f64]) -> Measured {
        let slopes: Vec<f64> = z.iter().enumerate().map(|(i, z)| self.slope(i, *z)).collect();
        let n = z.len();
        Measured {
            z: DVector::from_fn(n, |i, _| z[i] + (label_n[i] - self.label_n(i, z[i])) / slopes[i]),
            of_reading: DVector::from_fn(n, |i, _| 1.0 / (slopes[i] * slopes[i])),
            wider: DVector::from_element(n, 1.0),
            log_jacobian: -slopes.iter().map(|slope| libm::log(*slope)).sum::<f64>(),
        }
    }

    /// The labels as logarithms of friction over that of the model.
    pub(super) fn measured(&self, label_n: &[f64]) -> Measured {
        let each: Vec<(f64, f64)> = label_n.iter().enumerate().map(|(i, y)| self.explained(i, *y)).collect();
        let n = each.len();
        Measured {
            z: DVector::from_fn(n, |i, _| each[i].0),
            of_reading: DVector::from_fn(n, |i, _| 1.0 / (each[i].1 * each[i].1)),
            wider: DVector::from_element(n, 1.0),
            log_jacobian: -each.iter().map(|(_, slope)| libm::log(*slope)).sum::<f64>(),
        }
    }

    /// Expected label of a pull whose friction has this logarithm over that of the model.
    pub(super) fn label_n(&self, row: usize, z: f64) -> f64 {
        let at = ((z / WIDEST + 1.0) * 0.5 * (NODES - 1) as f64).clamp(0.0, (NODES - 1) as f64);
        let below = (at as usize).min(NODES - 2);
        let labels = &self.labels_n[row];
        labels[below] + (at - below as f64) * (labels[below + 1] - labels[below])
    }

    /// What an effect does to the logarithm of the friction that each label seems to show, where the friction itself has logarithms `z`.
    pub(super) fn column(&self, predictor: &dyn PredictPulls, effect: &ModelEffect, z: &[f64]) -> Vec<f64> {
        let with = PullModel { effects: vec![effect.clone()], ..self.model.clone() };
        if !effect.acts_on_signals() {
            let ratio = |(with, plain): (&f64, &f64)| match with / plain {
                share if share > LEAST_SHARE => libm::log(share),
                _ => f64::NAN,
            };
            return predictor.limits_n(&with).iter().zip(&self.limits_n).map(ratio).collect();
        }
        let rows: Vec<usize> = (0..z.len()).collect();
        let factor = z.iter().map(|z| libm::exp(*z)).collect();
        let read = predictor.pulls(&PullModel { factor, ..with }, &rows);
        read.iter().zip(z).enumerate().map(|(i, (p, z))| self.explained(i, p.label_n).0 - z).collect()
    }
}
