//! Fitting a model to a campaign: friction from labels and slips, readings from traces, all parameters together.

use super::context::Context;
use super::likelihood::{Likelihood, likelihood};
use super::terms::Terms;
use super::trace_residuals::Widening;
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::predict::PullModel;
use nalgebra::{DMatrix, DVector};

/// Rounds of weights.
const ROUNDS: usize = 3;

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The terms with their fitted values.
    pub terms: Terms,
    /// The model.
    pub model: PullModel,
    /// Names of the fitted parameters.
    pub names: Vec<String>,
    /// Their values.
    pub values: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// What pulls, traces and what is known beside them say of the values: the inverse of a covariance, for normal residuals.
    pub information: DMatrix<f64>,
    /// The values as if they had no bounds, from the slopes at the fit.
    pub beyond: Vec<f64>,
    /// Of the pulls, in units of their predicted standard deviations.
    pub residuals: Vec<f64>,
    /// How likely they are.
    pub likelihood: Likelihood,
    /// Half the sum of squares that the traces add.
    pub trace_cost: f64,
}

impl Fitted {
    /// Logarithm of the likelihood of everything, less half the logarithm of the number of pulls for each parameter that
    /// the baseline lacks (Schwarz 1978).
    pub fn score(&self, pulls: usize) -> f64 {
        self.likelihood.log
            - self.trace_cost
            - 0.5 * self.terms.cost() as f64 * libm::log(pulls.max(2) as f64)
    }
}

impl Fitted {
    /// The model with other values of the fitted parameters, for pulls that need not be those of the fit: without the
    /// factors of unnamed curves.
    pub fn with_values(&self, values: &[f64]) -> PullModel {
        let mut model = self.model.clone();
        model.factor.clear();
        let parts = model.mu.len();
        model.mu.copy_from_slice(&values[..parts]);
        (model.kinetic_ratio, model.misread_n) = (values[parts], values[parts + 1]);
        let held = self.terms.hold_signals;
        let mut at = parts + 2;
        if self.names.get(at).is_some_and(|name| name == "robot.lag_s") {
            (model.lag_s, model.dead_time_s) = (values[at].max(0.0), values[at + 1].max(0.0));
            at += 2;
        }
        for ((candidate, _), effect) in self.terms.effects.iter().zip(&mut model.effects) {
            if held && candidate.acts_on_signals() {
                continue;
            }
            for &(i, _) in &candidate.free {
                effect.values[i] = values[at];
                at += 1;
            }
        }
        model
    }
}

/// Which parameters a fit has, in order.
struct Layout {
    parts: usize,
    dynamics: bool,
    parameters: Vec<FreeParameter>,
}

impl Context<'_> {
    fn layout(&self, start: &PullModel, terms: &Terms) -> Layout {
        let mut parameters = Vec::new();
        for (name, mu) in self.data.parts.iter().zip(&start.mu) {
            parameters.push(FreeParameter {
                name: format!("parts.{name}.mu"),
                start: *mu,
                bounds: (1e-3, 3.0),
                scale: 0.1 * mu.max(0.02),
            });
        }
        let ratio = start.kinetic_ratio;
        parameters.push(FreeParameter {
            name: "kinetic_ratio".into(),
            start: ratio,
            bounds: if terms.hold_signals { (ratio, ratio) } else { (0.3, 1.0) },
            scale: 0.05,
        });
        parameters.push(FreeParameter {
            name: "misread_n".into(),
            start: if terms.stated { 0.0 } else { start.misread_n },
            bounds: if terms.stated { (0.0, 0.0) } else { (-0.5, 0.5) },
            scale: 0.05,
        });
        let dynamics = (terms.act_on_signals() || self.free_lag) && !terms.hold_signals;
        if dynamics {
            let (lag_s, dead_time_s) = self.lag_from(start, terms);
            for (name, value, most, scale) in
                [("robot.lag_s", lag_s, 1.0, 0.02), ("robot.dead_time_s", dead_time_s, 0.5, 0.4)]
            {
                parameters.push(FreeParameter {
                    name: name.into(),
                    start: value,
                    bounds: (0.0, most),
                    scale,
                });
            }
        }
        for (candidate, from) in terms.effects.iter().filter(|(c, _)| !terms.holds(c)) {
            parameters.extend(candidate.parameters(from));
        }
        for (curve, from) in &terms.curves {
            for (k, start) in from.iter().enumerate() {
                parameters.push(FreeParameter {
                    name: format!("curve.{}.{k}", curve.name),
                    start: *start,
                    bounds: (-curve.most, curve.most),
                    scale: 0.1 * curve.most.min(1.0),
                });
            }
        }
        Layout { parts: self.data.parts.len(), dynamics, parameters }
    }

    /// Lag and dead time that a fit from `start` begins with: its own, or those of the traces if one of both creeps and the other does not.
    fn lag_from(&self, start: &PullModel, terms: &Terms) -> (f64, f64) {
        let creeps = start.effects.iter().any(|e| e.spec.creep.is_some());
        match self.creeping {
            Some(creeping) if terms.creep() && !creeps => creeping,
            Some(_) if !terms.creep() && creeps => (self.base.lag_s, self.base.dead_time_s),
            _ => (start.lag_s, start.dead_time_s),
        }
    }

    fn model_at(&self, start: &PullModel, terms: &Terms, layout: &Layout, values: &[f64]) -> PullModel {
        let mut model = start.clone();
        model.mu.copy_from_slice(&values[..layout.parts]);
        let mut at = layout.parts;
        (model.kinetic_ratio, model.misread_n) = (values[at], values[at + 1]);
        at += 2;
        if layout.dynamics {
            (model.lag_s, model.dead_time_s) = (values[at], values[at + 1]);
            at += 2;
        } else {
            (model.lag_s, model.dead_time_s) = self.lag_from(start, terms);
        }
        model.effects.clear();
        for (candidate, from) in &terms.effects {
            let mut own = from.clone();
            let free: &[(usize, f64)] = if terms.holds(candidate) { &[] } else { &candidate.free };
            for &(i, _) in free {
                own[i] = values[at];
                at += 1;
            }
            model.effects.push(candidate.with(&own));
        }
        model.factor.clear();
        if !terms.curves.is_empty() || !terms.learnt.is_empty() {
            let mut factor = vec![1.0; self.data.len()];
            terms.learnt.iter().for_each(|(curve, values)| curve.apply(values, &[], &mut factor));
            let limits = if terms.curves.iter().any(|(c, _)| c.additive) {
                self.predictor.limits_n(&model)
            } else {
                vec![]
            };
            for (curve, from) in &terms.curves {
                curve.apply(&values[at..at + from.len()], &limits, &mut factor);
                at += from.len();
            }
            model.factor = factor;
        }
        model
    }

    /// Fits `terms` and the baseline to the pulls of `rows`, from `start`. `None` if the start cannot be predicted.
    pub fn fit(&self, start: &PullModel, terms: &Terms, rows: &[usize]) -> Option<Fitted> {
        self.fit_in(0..ROUNDS, start, terms, rows)
    }

    /// The same from a start that is near: bad pulls are known.
    pub fn fit_near(&self, start: &PullModel, terms: &Terms, rows: &[usize]) -> Option<Fitted> {
        self.fit_in(1..ROUNDS, start, terms, rows)
    }

    /// The same from a start that is nearly right: one round, and bad pulls are known.
    pub fn fit_again(&self, start: &PullModel, terms: &Terms, rows: &[usize]) -> Option<Fitted> {
        self.fit_in(ROUNDS - 1..ROUNDS, start, terms, rows)
    }

    fn fit_in(
        &self,
        rounds: std::ops::Range<usize>,
        start: &PullModel,
        terms: &Terms,
        rows: &[usize],
    ) -> Option<Fitted> {
        let layout = self.layout(start, terms);
        let mut parameters = layout.parameters.clone();
        let acts = terms.act_on_signals() || (self.free_lag && !self.observations.is_empty());
        // What is held predicts the same readings whatever friction does.
        let signals = acts && !terms.hold_signals;
        let mut outcome = None;
        for round in rounds {
            let values: Vec<f64> = parameters.iter().map(|p| p.start).collect();
            let model = self.model_at(start, terms, &layout, &values);
            let sd = self.deviations(&model, rows);
            let friction = self.friction_residuals(&model, rows, &sd);
            let (traces, widening) = if signals {
                let traces = self.trace_residuals(&model, rows);
                let widening = traces.widening();
                (traces.widened(widening), widening)
            } else {
                (vec![], Widening::NONE)
            };
            let s = self.tails.scale(&friction).max(0.2);
            // The first round does not know yet which pulls are bad.
            let weights: Vec<f64> = friction
                .iter()
                .map(|r| if round == 0 { 1.0 } else { self.tails.weight_of(r / s).sqrt() })
                .collect();
            let trace_weights: Vec<f64> = traces.iter().map(|r| (2.5 / r.abs().max(2.5)).sqrt()).collect();
            let options = match (signals, round) {
                (false, 0) => FitOptions { max_steps: 12, min_gain: 1e-4 },
                (false, _) => FitOptions { max_steps: 8, min_gain: 1e-4 },
                (true, 0) => FitOptions { max_steps: 8, min_gain: 1e-3 },
                (true, _) => FitOptions { max_steps: 3, min_gain: 1e-3 },
            };
            let found = fit(&parameters, options, |values| {
                let model = self.model_at(start, terms, &layout, values);
                let mut r = self.friction_residuals(&model, rows, &sd);
                r.iter_mut().zip(&weights).for_each(|(r, w)| *r *= w / s);
                if signals {
                    let mut t = self.trace_residuals(&model, rows).widened(widening);
                    t.iter_mut().zip(&trace_weights).for_each(|(r, w)| *r *= w);
                    r.extend(t);
                }
                r.extend(self.priors(&model, signals));
                r
            })
            .ok()?;
            for (p, v) in parameters.iter_mut().zip(&found.values) {
                p.start = *v;
            }
            outcome = Some((found, weights.iter().map(|w| w / s).collect::<Vec<f64>>()));
        }
        let (found, weights) = outcome?;
        let model = self.model_at(start, terms, &layout, &found.values);
        let sd = self.deviations(&model, rows);
        let residuals = self.friction_residuals(&model, rows, &sd);
        let log_sd: Vec<f64> = sd.iter().map(|s| libm::log(*s)).collect();
        let sessions: Vec<usize> = rows.iter().map(|&i| self.data.session_of[i]).collect();
        let judged = likelihood(&residuals, &log_sd, &sessions, self.tails);
        let traces = if acts { self.trace_residuals(&model, rows).cost() } else { 0.0 };
        let own = traces + 0.5 * self.priors(&model, acts).iter().map(|r| r * r).sum::<f64>();
        let trace_cost = if acts { own } else { own + self.baseline_trace_cost };
        let mut fitted_terms = terms.clone();
        for ((_, values), effect) in fitted_terms.effects.iter_mut().zip(&model.effects) {
            values.clone_from(&effect.values);
        }
        let mut at = found.values.len() - terms.curves.iter().map(|(_, v)| v.len()).sum::<usize>();
        for (_, values) in &mut fitted_terms.curves {
            let n = values.len();
            values.copy_from_slice(&found.values[at..at + n]);
            at += n;
        }
        // Neighbours that remember each other say less than their number.
        let stretch = (1.0 + judged.memory) / (1.0 - judged.memory);
        let informed = found.jacobian.tr_mul(&found.jacobian);
        let gradient = found.jacobian.tr_mul(&DVector::from_column_slice(&found.residuals));
        let step = informed.cholesky().map(|c| c.solve(&gradient));
        let beyond = match step {
            Some(step) => found.values.iter().zip(step.iter()).map(|(v, s)| v - s).collect(),
            None => found.values.clone(),
        };
        let information = information(
            &found.jacobian,
            &weights,
            self.tails.location_variance(&residuals),
            stretch,
            layout.parts,
        );
        Some(Fitted {
            information,
            beyond,
            terms: fitted_terms,
            model,
            names: parameters.iter().map(|p| p.name.clone()).collect(),
            values: found.values,
            covariance: found.covariance * stretch,
            residuals,
            likelihood: judged,
            trace_cost,
        })
    }
}

/// What a fit says of its parameters, from its weighted slopes: those of the pulls first, with their weights taken out
/// again, then everything else. `variance` is that of a location.
fn information(
    slopes: &DMatrix<f64>,
    weights: &[f64],
    variance: f64,
    stretch: f64,
    parts: usize,
) -> DMatrix<f64> {
    let n = weights.len();
    let few = n as f64 / n.saturating_sub(parts).max(1) as f64;
    let variance = variance * few * stretch;
    let mut plain = slopes.clone();
    for (i, w) in weights.iter().enumerate() {
        plain.row_mut(i).scale_mut(1.0 / (w * variance.sqrt()));
    }
    plain.tr_mul(&plain)
}
