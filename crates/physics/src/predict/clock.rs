//! Pulls whose signals depend on the clock of the campaign, or on the part.

use super::PullPredictor;
use super::creep::creeps;
use gripgen_twin::predict::{PullModel, PullPrediction};

/// Pulls of one profile and direction from which on a parabola in time stands for them.
const MANY: usize = 12;

impl PullPredictor<'_> {
    /// Labels with signals that depend on the clock: tables at the first, the middle and the last pull of each profile
    /// and direction, and a parabola in time between them. Few pulls, and signals of one part, are taken pull by pull.
    pub(super) fn pulls_by_clock(&self, model: &PullModel, rows: &[usize]) -> Vec<PullPrediction> {
        let time = |row: usize| self.measured.pulls[row].covariates.time_s;
        let of_part = model.effects.iter().any(|e| e.acts_on_signals() && e.part.is_some());
        let mut places: Vec<Vec<usize>> = vec![vec![]; self.slots()];
        for (k, &row) in rows.iter().enumerate() {
            places[self.slot(row)].push(k);
        }
        let mut found = vec![PullPrediction::default(); rows.len()];
        for place in places.iter_mut().filter(|p| !p.is_empty()) {
            place.sort_by(|&a, &b| time(rows[a]).total_cmp(&time(rows[b])));
            let nodes = [place[0], place[place.len() / 2], place[place.len() - 1]].map(|k| rows[k]);
            let t = nodes.map(time);
            if of_part || place.len() < MANY || t[0] >= t[1] || t[1] >= t[2] {
                for &k in place.iter() {
                    let limit_n = self.limit_n(model, rows[k]);
                    found[k] = if creeps(model) {
                        self.crept(model, rows[k], rows[k])
                    } else {
                        self.at(&self.own_table(model, rows[k]), limit_n)
                    };
                }
                continue;
            }
            let tables = if creeps(model) { None } else { Some(nodes.map(|row| self.tables_of(model, row))) };
            for &k in place.iter() {
                let (at, limit_n) = (time(rows[k]), self.limit_n(model, rows[k]));
                let p = [0, 1, 2].map(|i| match &tables {
                    Some(tables) => self.at(&tables[i], limit_n),
                    None => self.crept(model, nodes[i], rows[k]),
                });
                let weight = |i: usize, j: usize, k: usize| {
                    (at - t[j]) * (at - t[k]) / ((t[i] - t[j]) * (t[i] - t[k]))
                };
                let w = [weight(0, 1, 2), weight(1, 0, 2), weight(2, 0, 1)];
                let sum = |f: &dyn Fn(&PullPrediction) -> f64| (0..3).map(|i| w[i] * f(&p[i])).sum::<f64>();
                found[k] = PullPrediction {
                    limit_n,
                    limit_reading_n: sum(&|p| p.limit_reading_n),
                    label_n: sum(&|p| p.label_n),
                    label_sd_n: sum(&|p| p.label_sd_n).max(0.5 * p[1].label_sd_n),
                };
            }
        }
        found
    }
}
