//! Readings of tools that hold, shared by the pulls that have the same.

use super::creep::creeps;
use super::{Kept, PullPredictor, acts_on_signals, table};
use gripgen_twin::config::Feedback;
use gripgen_twin::predict::PullModel;
use std::sync::Arc;

/// The signals of a model.
pub(super) struct Signals<'a> {
    predictor: &'a PullPredictor<'a>,
    model: &'a PullModel,
    /// The model without its effects: the force on the contact, where the loop does not see the sensor.
    plain: PullModel,
    /// Whether a reading is a function of the force at that time alone, and the force does not depend on readings.
    pointwise: bool,
    shared: bool,
    known: Vec<Option<Arc<Kept>>>,
}

impl<'a> Signals<'a> {
    pub(super) fn new(predictor: &'a PullPredictor<'a>, model: &'a PullModel) -> Self {
        let sensors_only = model.effects.iter().all(|e| e.spec.command.is_none() && !e.spec.remembers);
        let plain = PullModel { effects: vec![], factor: vec![], ..model.clone() };
        Self {
            pointwise: !acts_on_signals(model)
                || (sensors_only && predictor.feedback() == Feedback::Independent),
            shared: predictor.shares_signals(model),
            known: vec![None; predictor.slots()],
            predictor,
            model,
            plain,
        }
    }

    fn stuck(&mut self, row: usize) -> Arc<Kept> {
        let (predictor, model) = (self.predictor, if self.pointwise { &self.plain } else { self.model });
        if creeps(self.model) {
            // Each grip at a rate of its own.
            let creep = Some(predictor.creep(self.model, row));
            return predictor.stuck(&PullModel { creep, ..model.clone() }, row);
        }
        if !(self.pointwise || self.shared) {
            return predictor.stuck(model, row);
        }
        self.known[predictor.slot(row)].get_or_insert_with(|| predictor.stuck(model, row)).clone()
    }

    /// The reading when the jaws let go at `limit_n`.
    pub(super) fn limit_reading_n(&mut self, row: usize, limit_n: f64) -> f64 {
        if !acts_on_signals(self.model) {
            return limit_n;
        }
        let stuck = self.stuck(row);
        if !self.pointwise {
            return table::reading_n(&stuck, limit_n);
        }
        let tick = stuck.contact_n.partition_point(|&f| f < limit_n);
        let step_s = 1.0 / self.predictor.rate_hz;
        self.predictor.sensor(self.model, row).read(limit_n, tick as f64 * step_s, step_s)
    }

    /// Readings at some times.
    pub(super) fn stuck_n(&mut self, row: usize, times_s: &[f64]) -> Vec<f64> {
        let stuck = self.stuck(row);
        let (step_s, last) = (1.0 / self.predictor.rate_hz, stuck.reading_n.len() - 1);
        let mut sensor = self.predictor.sensor(self.model, row);
        times_s
            .iter()
            .map(|t| {
                let x = (t * self.predictor.rate_hz).clamp(0.0, last as f64);
                let (i, w) = (x as usize, x.fract());
                let n = stuck.reading_n[i] * (1.0 - w) + stuck.reading_n[(i + 1).min(last)] * w;
                if self.pointwise { sensor.read(n, *t, step_s) } else { n }
            })
            .collect()
    }
}
