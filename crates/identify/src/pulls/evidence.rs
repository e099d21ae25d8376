//! Which of many groups of columns explain residuals, and how much of each: random effects whose variances are those of the
//! largest evidence (restricted likelihood: Patterson and Thompson 1971; as a Gaussian process with an additive kernel whose
//! parts are switched on one at a time). A group of no evidence has the variance 0, so that nothing is learnt from nothing.

use crate::draws::Draws;
use nalgebra::{DMatrix, DVector};

/// Standard deviations that a group may have, in the units of its columns.
const DEVIATIONS: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32];

/// Evidence that the first group has to add, and every further one.
const FIRST: f64 = 2.5;
const FURTHER: f64 = 3.0;

/// Groups at most.
pub(super) const MOST: usize = 6;

/// Orders of the residuals that are tried.
const SHUFFLES: usize = 399;

/// Residuals and groups of columns, in units of the noise, with what the parameters of a model explain taken out.
pub(super) struct Grouped {
    y: DVector<f64>,
    columns: DMatrix<f64>,
    /// First column and number of columns of each group.
    groups: Vec<(usize, usize)>,
    gram: DMatrix<f64>,
    along: DVector<f64>,
    square: f64,
    free: f64,
    /// Logarithm of the determinant by which rows were whitened, less that of what the model explains of them.
    beside: f64,
    /// Orthonormal directions that the model explains.
    known: DMatrix<f64>,
}

/// What was learnt: groups with the coefficients of their columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Learnt {
    /// Positions of groups, in the order in which they were taken, with their coefficients.
    pub groups: Vec<(usize, Vec<f64>)>,
    /// Evidence beyond that of nothing.
    pub gain: f64,
}

impl Grouped {
    /// From residuals, derivatives by the parameters of a model, and groups of columns, all in units of the noise; whitened by a
    /// matrix with a determinant whose logarithm is `whitened_by`. `None` if there are too few rows.
    pub fn new(
        y: &DVector<f64>,
        slopes: &DMatrix<f64>,
        groups: &[DMatrix<f64>],
        whitened_by: f64,
    ) -> Option<Self> {
        let n = y.len();
        let svd = slopes.clone().svd(true, false);
        let u = svd.u?;
        let most = svd.singular_values.iter().copied().fold(0.0, f64::max);
        let kept: Vec<usize> =
            (0..svd.singular_values.len()).filter(|&k| svd.singular_values[k] > 1e-9 * most).collect();
        let widths: f64 = kept.iter().map(|&k| libm::log(svd.singular_values[k])).sum();
        let known = DMatrix::from_fn(n, kept.len(), |i, k| u[(i, kept[k])]);
        let free = n.checked_sub(kept.len()).filter(|f| *f >= 8)? as f64;
        let width: usize = groups.iter().map(DMatrix::ncols).sum();
        let mut columns = DMatrix::zeros(n, width);
        let mut places = Vec::new();
        let mut at = 0;
        for group in groups {
            columns.columns_mut(at, group.ncols()).copy_from(group);
            places.push((at, group.ncols()));
            at += group.ncols();
        }
        let taken = known.tr_mul(&columns);
        columns -= &known * taken;
        let y = y - &known * known.tr_mul(y);
        Some(Self {
            gram: columns.tr_mul(&columns),
            along: columns.tr_mul(&y),
            square: y.norm_squared(),
            free,
            beside: whitened_by - widths,
            y,
            columns,
            groups: places,
            known,
        })
    }

    /// Logarithm of the restricted likelihood with these groups, each with its standard deviation, less that of none; and the
    /// coefficients that are most likely.
    fn evidence(
        &self,
        along: &DVector<f64>,
        square: f64,
        chosen: &[(usize, f64)],
    ) -> Option<(f64, Vec<Vec<f64>>)> {
        let places: Vec<(usize, f64)> = chosen
            .iter()
            .flat_map(|&(g, sd)| {
                let (first, count) = self.groups[g];
                (first..first + count).map(move |k| (k, sd))
            })
            .collect();
        let q = places.len();
        let scaled = DMatrix::from_fn(q, q, |i, j| {
            let ((a, s), (b, t)) = (places[i], places[j]);
            s * t * self.gram[(a, b)] + f64::from(u8::from(i == j))
        });
        let right = DVector::from_iterator(q, places.iter().map(|&(k, sd)| sd * along[k]));
        let factor = scaled.cholesky()?;
        let solved = factor.solve(&right);
        let left = (square - right.dot(&solved)).max(1e-9 * square);
        let diagonal: f64 = factor.l_dirty().diagonal().iter().map(|d| libm::log(*d)).sum();
        let gain = -0.5 * self.free * libm::log(left / square) - diagonal;
        let mut at = 0;
        let coefficients = chosen.iter().map(|&(g, sd)| {
            let count = self.groups[g].1;
            let own = (at..at + count).map(|k| sd * solved[k]).collect();
            at += count;
            own
        });
        Some((gain, coefficients.collect()))
    }

    /// Logarithm of the likelihood with no group, but for what is the same however rows are whitened.
    pub fn evidence_of_nothing(&self) -> f64 {
        self.beside - 0.5 * self.free * libm::log(self.square.max(1e-300))
    }

    fn gain(&self, chosen: &[(usize, f64)]) -> f64 {
        self.evidence(&self.along, self.square, chosen).map_or(f64::NEG_INFINITY, |e| e.0)
    }

    /// The best group beside those that were chosen, with its deviation and the evidence of all together.
    fn next(&self, chosen: &[(usize, f64)]) -> Option<(usize, f64, f64)> {
        let left = (0..self.groups.len()).filter(|g| chosen.iter().all(|c| c.0 != *g));
        let each = left.flat_map(|g| DEVIATIONS.map(|sd| (g, sd)));
        let gains = each.map(|(g, sd)| {
            let with: Vec<(usize, f64)> = chosen.iter().copied().chain([(g, sd)]).collect();
            (g, sd, self.gain(&with))
        });
        gains.max_by(|a, b| a.2.total_cmp(&b.2))
    }

    /// Groups are taken one at a time, as long as each adds evidence; their deviations are fitted again with each.
    pub fn learn(&self, most: usize) -> Learnt {
        let mut chosen: Vec<(usize, f64)> = Vec::new();
        let mut gain = 0.0;
        while chosen.len() < most {
            let least = if chosen.is_empty() { FIRST } else { FURTHER };
            let Some((group, sd, with)) = self.next(&chosen) else { break };
            if with < gain + least {
                break;
            }
            chosen.push((group, sd));
            gain = with;
            for k in 0..chosen.len() {
                for sd in DEVIATIONS {
                    let old = std::mem::replace(&mut chosen[k].1, sd);
                    let now = self.gain(&chosen);
                    if now > gain {
                        gain = now;
                    } else {
                        chosen[k].1 = old;
                    }
                }
            }
        }
        if chosen.is_empty() {
            return Learnt::default();
        }
        let Some((gain, coefficients)) = self.evidence(&self.along, self.square, &chosen) else {
            return Learnt::default();
        };
        Learnt { groups: chosen.iter().map(|c| c.0).zip(coefficients).collect(), gain }
    }

    /// How often the best group has as much evidence where the order of the residuals is that of chance.
    pub fn p_value(&self) -> f64 {
        let own = self.next(&[]).map_or(0.0, |n| n.2);
        let mut draws = Draws::new(31, 8);
        let mut order: Vec<usize> = (0..self.y.len()).collect();
        let above = (0..SHUFFLES).filter(|_| {
            draws.shuffle(&mut order);
            let mut shuffled = DVector::from_iterator(order.len(), order.iter().map(|&i| self.y[i]));
            shuffled -= &self.known * self.known.tr_mul(&shuffled);
            let (along, square) = (self.columns.tr_mul(&shuffled), shuffled.norm_squared());
            let each = (0..self.groups.len()).flat_map(|g| DEVIATIONS.map(|sd| (g, sd)));
            let gains = each.filter_map(|one| self.evidence(&along, square, &[one]).map(|e| e.0));
            gains.fold(0.0, f64::max) >= own
        });
        (above.count() + 1) as f64 / (SHUFFLES + 1) as f64
    }

    /// Share of the squares of the residuals that groups explain, one after the other.
    pub fn strength(&self, group: usize, coefficients: &[f64]) -> f64 {
        let (first, count) = self.groups[group];
        let part = self.columns.columns(first, count) * DVector::from_column_slice(coefficients);
        (part.norm_squared() / self.square.max(1e-300)).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 60;

    /// Eight columns of normal numbers, alone and times each other, as groups of one column.
    fn made(seed: u64, effect: f64) -> Grouped {
        let mut draws = Draws::new(seed, 1);
        let x: Vec<DVector<f64>> =
            (0..8).map(|_| DVector::from_iterator(ROWS, (0..ROWS).map(|_| draws.normal()))).collect();
        // In units of a noise of 4 %.
        let noise = DVector::from_iterator(ROWS, (0..ROWS).map(|_| draws.normal()));
        let y = (&x[1] + x[3].component_mul(&x[4])) * (effect / 0.04) + noise;
        let mut groups: Vec<DMatrix<f64>> = x.iter().map(|c| DMatrix::from_columns(&[c / 0.04])).collect();
        for i in 0..8 {
            for j in i + 1..8 {
                groups.push(DMatrix::from_columns(&[x[i].component_mul(&x[j]) / 0.04]));
            }
        }
        Grouped::new(&y, &DMatrix::from_element(ROWS, 1, 25.0), &groups, 0.0).unwrap()
    }

    /// Of noise alone nothing is learnt, but for as many campaigns as the test allows.
    #[test]
    fn nothing_is_learnt_from_noise() {
        let false_alarms = (0..60).filter(|&k| {
            let grouped = made(k, 0.0);
            !grouped.learn(MOST).groups.is_empty() && grouped.p_value() <= 0.02
        });
        let count = false_alarms.count();
        assert!(count <= 4, "{count} of 60");
    }

    /// A column and a product of two others are found with their coefficients, and nothing else.
    #[test]
    fn two_groups_come_back() {
        let found = made(7, 0.04).learn(MOST);
        let mut groups: Vec<usize> = found.groups.iter().map(|g| g.0).collect();
        groups.sort_unstable();
        // The product of the fourth and fifth column: 7 + 6 + 5 pairs stand before it.
        assert_eq!(groups, vec![1, 8 + 7 + 6 + 5], "{found:?}");
        for (group, coefficients) in &found.groups {
            assert!((coefficients[0] - 0.04).abs() < 0.012, "{group} {coefficients:?}");
        }
        assert!(made(7, 0.04).p_value() < 0.01);
    }

    /// A true size is shrunk, the more the less the data say of it: least squares would say more.
    #[test]
    fn what_is_weak_is_shrunk() {
        let grouped = made(11, 0.02);
        let (_, coefficients) = grouped.evidence(&grouped.along, grouped.square, &[(1, 0.01)]).unwrap();
        let plain = grouped.along[1] / grouped.gram[(1, 1)];
        assert!(coefficients[0][0].abs() < 0.9 * plain.abs(), "{coefficients:?} {plain}");
    }

    /// Noise, and what a slow column does, seen with neighbours that remember `memory` of each other: the evidence that both have together.
    fn evidence_with(memory: f64, column: &[f64], y: &[f64]) -> f64 {
        let new = 1.0 - memory * memory;
        let whitened = |x: &[f64]| {
            let one = |k: usize| if k == 0 { x[0] } else { (x[k] - memory * x[k - 1]) / new.sqrt() };
            DVector::from_iterator(ROWS, (0..ROWS).map(one))
        };
        let scaled: Vec<f64> = column.iter().map(|x| x / 0.04).collect();
        let (level, group) = (whitened(&[25.0; ROWS]), whitened(&scaled));
        let by = -0.5 * (ROWS - 1) as f64 * libm::log(new);
        let columns = [DMatrix::from_columns(&[group])];
        let seen = Grouped::new(&whitened(y), &DMatrix::from_columns(&[level]), &columns, by).unwrap();
        seen.evidence_of_nothing() + seen.learn(MOST).gain
    }

    /// What goes with a slow column is memory to a model without it; with the column more speaks for none. Noise that does remember is told
    /// from that by the same column.
    #[test]
    fn a_slow_column_is_no_memory() {
        let ahead = |seed: u64, moved: bool| {
            let mut draws = Draws::new(seed, 2);
            let mut walk = |keeps: f64| -> Vec<f64> {
                let mut at = draws.normal();
                let next = |_| {
                    let was = at;
                    at = keeps * at + (1.0 - keeps * keeps).sqrt() * draws.normal();
                    was
                };
                (0..ROWS).map(next).collect()
            };
            let (slow, white, remembers) = (walk(0.9), walk(0.0), walk(0.7));
            let by_column = slow.iter().zip(&white).map(|(x, e)| 1.2 * x + e).collect();
            let y: Vec<f64> = if moved { by_column } else { remembers };
            evidence_with(0.0, &slow, &y) - evidence_with(0.7, &slow, &y)
        };
        let mean = |moved: bool| (0..20).map(|seed| ahead(seed, moved)).sum::<f64>() / 20.0;
        assert!(mean(true) > 3.0 && mean(false) < -3.0, "{} and {}", mean(true), mean(false));
    }
}
