//! Tables of labels over what the jaws hold, by everything else that they depend on.

use super::table::{ExactLabels, LabelTable, Scattered, Tables, bent_by, enough_for};
use super::{CONTACTS, PullPredictor, acts_on_signals};
use crate::{RimTable, StuckPull};
use gripgen_twin::Backbone;
use gripgen_twin::label::moments::LabelRule;
use gripgen_twin::predict::{PullModel, PullPrediction};
use std::sync::Arc;

/// Distance of the kinetic ratios for which there are tables; those between are interpolated.
const RATIO_STEP: f64 = 0.025;

/// What labels of a model whose effects act on signals depend on, beside the signals.
fn shape_of(model: &PullModel) -> [f64; 8] {
    let ((bent_lag_s, bent_dead_s), [rate, rim]) = (model.bent_at_s, creep_of(model));
    [
        model.kinetic_ratio,
        model.scatter,
        model.noise_n,
        model.shear_by_area,
        bent_lag_s,
        bent_dead_s,
        rate,
        rim,
    ]
}

/// Rate and rim exponent of a model whose tools all creep alike.
fn creep_of(model: &PullModel) -> [f64; 2] {
    let creep = model.creep.unwrap_or_default();
    [creep.rate_m_per_n_s, creep.rim_exponent]
}

/// The model with a contact that lets go at once.
fn straightened(model: &PullModel) -> PullModel {
    PullModel { shear_by_area: 0.0, ..model.clone() }
}

/// What both tables say, by their weights; the second is asked only where it counts.
fn mixed((low, high, weight): &Tables, of: impl Fn(&LabelTable) -> PullPrediction) -> PullPrediction {
    if *weight > 0.0 { of(low).mixed(&of(high), *weight) } else { of(low) }
}

impl PullPredictor<'_> {
    /// The prediction for jaws that hold `limit_n`.
    pub(super) fn at(&self, tables: &Tables, limit_n: f64) -> PullPrediction {
        mixed(tables, |table| table.at(limit_n, |i| self.row_of(table, i)))
    }

    fn row_of(&self, table: &LabelTable, i: usize) -> PullPrediction {
        let row = |tables: &Tables| mixed(tables, |table| self.row_of(table, i));
        table.row(i, || {
            let (stuck, backbone) = (self.stuck(&table.model, table.row), self.backbone(&table.model));
            let own = table.of_row(i, &self.scattered(&table.model, table.row, &stuck, &backbone));
            match &table.bend {
                Some([bent, straight]) => bent_by(&own, &row(bent), &row(straight)),
                None => own,
            }
        })
    }

    /// The tables of two kinetic ratios around the model's, and the weight of the second.
    pub(super) fn tables_of(&self, model: &PullModel, row: usize) -> Tables {
        if acts_on_signals(model) {
            let key = self.key(model, row, &shape_of(model));
            let table = self.signal_tables.made(key, || self.signal_table(model, row));
            return (table.clone(), table, 0.0);
        }
        let [rate, rim] = creep_of(model);
        let steps = (model.kinetic_ratio / RATIO_STEP).min(1.0 / RATIO_STEP);
        let at = |ratio: f64| {
            let own = [ratio, model.scatter, model.noise_n, model.shear_by_area, rate, rim];
            let key = self.key(model, row, &own);
            let model = PullModel { kinetic_ratio: ratio, ..model.clone() };
            self.tables.made(key, || self.label_table(&model, row))
        };
        let low = steps.floor();
        let weight = steps - low;
        let first = at(low * RATIO_STEP);
        let second = if weight > 0.0 { at((low + 1.0) * RATIO_STEP) } else { first.clone() };
        (first, second, weight)
    }

    /// The table of one pull with signals of its own.
    pub(super) fn own_table(&self, model: &PullModel, row: usize) -> Tables {
        let key = self.key(model, row, &shape_of(model));
        let table = self.own_tables[row].made(key, || self.signal_table(model, row));
        (table.clone(), table, 0.0)
    }

    fn label_table(&self, model: &PullModel, row: usize) -> LabelTable {
        let exact = if acts_on_signals(model) {
            Arc::new(ExactLabels::new(self.max_n, model.scatter))
        } else {
            let most = enough_for(model.scatter);
            let [rate, rim] = creep_of(model);
            let own = [model.kinetic_ratio, most, model.noise_n, model.shear_by_area, rate, rim];
            self.exact.made(self.key(model, row, &own), || ExactLabels::new(self.max_n, most))
        };
        LabelTable::new(model, row, exact, self.max_n)
    }

    /// Labels of a model whose effects act on signals: those of a contact that lets go at once, and what a bend adds to labels
    /// without these effects, at the lag and dead time of `bent_at_s`. Fits try thousands of such models, and a contact that
    /// bends takes five times as long.
    fn signal_table(&self, model: &PullModel, row: usize) -> LabelTable {
        if !self.backbone(model).bends() {
            return self.label_table(model, row);
        }
        let (lag_s, dead_time_s) = model.bent_at_s;
        let plain = PullModel { effects: vec![], factor: vec![], lag_s, dead_time_s, ..model.clone() };
        let bend = [&plain, &straightened(&plain)].map(|model| self.tables_of(model, row));
        let mut table = self.label_table(&straightened(model), row);
        table.bend = Some(bend);
        table
    }

    fn scattered<'s>(
        &'s self,
        model: &'s PullModel,
        row: usize,
        stuck: &'s StuckPull,
        backbone: &'s Backbone,
    ) -> Scattered<'s> {
        let creep = model.creep.unwrap_or_default();
        let rim = (creep.rate_m_per_n_s > 0.0).then_some(creep.rim_exponent);
        Scattered {
            rig: self.rig(model),
            stuck,
            staircase: &self.staircases[self.profile_of[row]],
            kinetic_ratio: model.kinetic_ratio,
            backbone,
            scatter: model.scatter,
            rule: self.rules.made(model.noise_n.to_bits(), || {
                LabelRule::new(self.measured.label_tolerance_n, model.noise_n)
            }),
            sensor: self.sensor(model, row),
            command: self.command(model, row),
            creep,
            rim: self.rims.made(rim.map(f64::to_bits), || RimTable::new(creep)),
        }
    }

    /// The mean contact of the campaign.
    fn backbone(&self, model: &PullModel) -> Arc<Backbone> {
        let cells = || {
            self.contacts.get_or_init(|| {
                let n = self.measured.pulls.len();
                let rows = (0..n).step_by(n.div_ceil(CONTACTS).max(1));
                rows.flat_map(|row| self.simulator.contact(&self.twin, row)).collect()
            })
        };
        let by_area = model.shear_by_area;
        self.backbones.made(by_area.to_bits(), || Backbone::new(cells(), by_area))
    }
}
