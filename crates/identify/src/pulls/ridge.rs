//! A rival that knows nothing of friction: a quadratic ridge on the table. Where it predicts held-out pulls better, there is structure left.

use super::data::{Column, PullData};
use super::smooth::standard;
use nalgebra::{DMatrix, DVector};

/// Share of the error on held-out pulls by which the ridge has to be ahead, in how many standard errors of the difference.
const AHEAD: f64 = 0.10;
const SURE: f64 = 2.5;

/// How often chance lets it be ahead by as many standard errors.
pub(super) const AHEAD_BY_CHANCE: f64 = 0.006;

/// Fewest pulls that are held against it.
const MIN_PULLS: usize = 24;

/// Words at most of a column.
const MAX_WORDS: usize = 12;

/// Share of what the ridge says that a column has to carry to be named, and columns at most.
const CARRIES: f64 = 0.15;
const NAMED: usize = 2;

/// Where the ridge is ahead.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ahead {
    /// By which share of the error on held-out pulls.
    pub share: f64,
    /// The columns that it says most about beside the grip force, with their share of what it says.
    pub columns: Vec<(String, f64)>,
}

/// Ratios of label to grip force from the columns of the table: linear, squares, products, words.
struct Table {
    features: DMatrix<f64>,
    /// Columns that each feature is made of.
    names: Vec<Vec<String>>,
    parts: usize,
}

impl Table {
    fn of(data: &PullData<'_>) -> Self {
        let n = data.len();
        let mut numbers: Vec<(&String, Vec<f64>)> = Vec::new();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut names: Vec<Vec<String>> = Vec::new();
        for part in 0..data.parts.len() {
            columns.push(data.part_of.iter().map(|p| f64::from(u8::from(*p == part))).collect());
            names.push(vec![]);
        }
        for (name, column) in &data.columns {
            match column {
                Column::Number(x) if column.distinct() > 1 => numbers.push((name, standard(x))),
                Column::Word(at, words)
                    if name != "part" && (2..=MAX_WORDS.min(n / 4)).contains(&words.len()) =>
                {
                    for word in 0..words.len() {
                        columns.push(at.iter().map(|w| f64::from(u8::from(*w == word))).collect());
                        names.push(vec![name.clone()]);
                    }
                }
                _ => {}
            }
        }
        for (i, (a, x)) in numbers.iter().enumerate() {
            columns.push(x.clone());
            names.push(vec![(*a).clone()]);
            for (b, y) in &numbers[i..] {
                columns.push(x.iter().zip(y).map(|(x, y)| x * y).collect());
                names.push(if a == b { vec![(*a).clone()] } else { vec![(*a).clone(), (*b).clone()] });
            }
        }
        let features = DMatrix::from_fn(n, columns.len(), |i, k| columns[k][i]);
        Self { features, names, parts: data.parts.len() }
    }

    /// Coefficients from the pulls at `rows`: the penalty is the one of the least generalised cross-validation error (Golub, Heath and
    /// Wahba 1979). Parts are not penalised.
    fn fit(&self, ratio: &[f64], weight: &[f64], rows: &[usize]) -> Option<DVector<f64>> {
        let x = DMatrix::from_fn(rows.len(), self.features.ncols(), |i, k| {
            weight[rows[i]] * self.features[(rows[i], k)]
        });
        let y = DVector::from_iterator(rows.len(), rows.iter().map(|&i| weight[i] * ratio[i]));
        let (gram, along) = (x.tr_mul(&x), x.tr_mul(&y));
        let size = rows.iter().map(|&i| weight[i] * weight[i]).sum::<f64>();
        let mut best: Option<(f64, DVector<f64>)> = None;
        for penalty in [1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0] {
            let mut penalised = gram.clone();
            for k in 0..gram.ncols() {
                penalised[(k, k)] += size * if k < self.parts { 1e-9 } else { penalty };
            }
            let Some(factor) = penalised.cholesky() else { continue };
            let found = factor.solve(&along);
            let used = factor.solve(&gram).trace();
            let left = (&y - &x * &found).norm_squared();
            let free = (rows.len() as f64 - used).max(0.5);
            let error = left / (free * free);
            if best.as_ref().is_none_or(|b| error < b.0) {
                best = Some((error, found));
            }
        }
        best.map(|b| b.1)
    }
}

/// Whether the ridge predicts the pulls of `near` better than `held_n` does, which no fit has seen either.
pub(super) fn ahead(
    data: &PullData<'_>,
    held_n: &[f64],
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Ahead> {
    if near.len() < MIN_PULLS {
        return None;
    }
    let force: Vec<f64> = data.measured.pulls.iter().map(|p| p.grip_force_n.max(0.1)).collect();
    let ratio: Vec<f64> = data.label_n.iter().zip(&force).map(|(l, f)| l / f).collect();
    // Errors of 4 % and 0.3 N.
    let weight: Vec<f64> =
        data.label_n.iter().zip(&force).map(|(l, f)| f / libm::hypot(0.04 * l, 0.3)).collect();
    let table = Table::of(data);
    let mut squares = Vec::new();
    for out in repetitions {
        let rows: Vec<usize> = near.iter().copied().filter(|i| !out.contains(i)).collect();
        let coefficients = table.fit(&ratio, &weight, &rows)?;
        for &i in out.iter().filter(|i| near.contains(i) && held_n[**i].is_finite()) {
            let own = (table.features.row(i) * &coefficients)[0] * force[i] - data.label_n[i];
            squares.push((own * own, (held_n[i] - data.label_n[i]).powi(2)));
        }
    }
    let n = squares.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| squares.iter().map(of).sum::<f64>() / n;
    let (ridge, ours) = (mean(&|s| s.0), mean(&|s| s.1));
    let difference = ours - ridge;
    let error = (mean(&|s| (s.1 - s.0 - difference).powi(2)) / n).sqrt();
    let share = 1.0 - (ridge / ours.max(1e-300)).sqrt();
    if share < AHEAD || difference < SURE * error {
        return None;
    }
    let coefficients = table.fit(&ratio, &weight, near)?;
    let mut columns: Vec<(String, f64)> = Vec::new();
    let mut all = 0.0;
    for (k, names) in table.names.iter().enumerate() {
        let values = table.features.column(k);
        let square = values.variance() * coefficients[k] * coefficients[k];
        let others: Vec<&String> = names.iter().filter(|name| *name != "grip_force_n").collect();
        for name in &others {
            let own = square / others.len() as f64;
            all += own;
            match columns.iter_mut().find(|c| c.0 == **name) {
                Some(known) => known.1 += own,
                None => columns.push(((*name).clone(), own)),
            }
        }
    }
    columns.iter_mut().for_each(|c| c.1 /= all.max(1e-300));
    columns.sort_by(|a, b| b.1.total_cmp(&a.1));
    columns.retain(|c| c.1 >= CARRIES);
    columns.truncate(NAMED);
    Some(Ahead { share, columns })
}
