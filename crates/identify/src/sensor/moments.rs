//! Linear fits and held-out errors from sums of products, unit by unit.
//!
//! Columns are: 0 the constant, 1 the reference force, then those of candidate effects, and last the measured force. A
//! fit frees constant and reference of every session and one coefficient for each column that was added.

use nalgebra::{DMatrix, DVector};

/// A sum of columns with factors.
pub(crate) type Combination = Vec<(usize, f64)>;

/// What is fitted beside the offset of each session.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Model {
    /// What the gain of a session multiplies.
    pub force: Combination,
    /// What has one coefficient for all sessions.
    pub added: Vec<Combination>,
}

impl Model {
    /// Gain and offset alone.
    pub fn baseline() -> Self {
        Self { force: vec![(1, 1.0)], added: Vec::new() }
    }

    /// With more columns.
    pub fn with(&self, columns: &[usize]) -> Self {
        let mut model = self.clone();
        model.added.extend(columns.iter().map(|&c| vec![(c, 1.0)]));
        model
    }

    /// With a column added to the force itself, with factor 1.
    pub fn changed(&self, column: usize) -> Self {
        let mut model = self.clone();
        model.force.push((column, 1.0));
        model
    }

    fn vectors(&self, response: usize) -> Vec<Combination> {
        let mut all = vec![vec![(0, 1.0)], self.force.clone()];
        all.extend(self.added.iter().cloned());
        all.push(vec![(response, 1.0)]);
        all
    }
}

/// Stretch of rows that is held out or kept as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unit {
    /// Session, from 0 on.
    pub session: usize,
    /// Fold that holds it out.
    pub fold: usize,
    /// First row.
    pub from: usize,
    /// Row behind the last.
    pub to: usize,
}

/// Sums of products of all columns in every unit.
#[derive(Debug, Clone)]
pub(crate) struct Moments {
    pub units: Vec<Unit>,
    pub sums: Vec<DMatrix<f64>>,
    /// Sums over the units of each session.
    totals: Vec<DMatrix<f64>>,
    pub sessions: usize,
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solution {
    /// Offset and gain of each session.
    pub sessions: Vec<[f64; 2]>,
    /// Coefficients of what was added.
    pub added: Vec<f64>,
    /// Sum of squares of what is left.
    pub left: f64,
    /// Inverse of the normal matrix of the coefficients after offsets and gains are taken out.
    pub spread: DMatrix<f64>,
    /// Logarithm of the determinant of the normal matrix of everything, for restricted likelihoods.
    pub log_determinant: f64,
}

impl Moments {
    /// Of columns of equal length.
    pub fn new(units: &[Unit], columns: &[Vec<f64>]) -> Self {
        let sum = |unit: &Unit| {
            let rows = DMatrix::from_fn(unit.to - unit.from, columns.len(), |i, j| columns[j][unit.from + i]);
            rows.tr_mul(&rows)
        };
        let sessions = units.iter().map(|u| u.session + 1).max().unwrap_or(0);
        let sums: Vec<DMatrix<f64>> = units.iter().map(sum).collect();
        let mut this = Self { units: units.to_vec(), sums, totals: Vec::new(), sessions };
        this.sum_up(columns.len());
        this
    }

    fn sum_up(&mut self, columns: usize) {
        self.totals = vec![DMatrix::zeros(columns, columns); self.sessions];
        for (unit, sums) in self.units.iter().zip(&self.sums) {
            self.totals[unit.session] += sums;
        }
    }

    /// With another measured force; `columns` are those of [`Moments::new`].
    pub fn replace_response(&mut self, columns: &[Vec<f64>], response: &[f64]) {
        for (unit, sums) in self.units.iter().zip(&mut self.sums) {
            let last = sums.nrows() - 1;
            let y = &response[unit.from..unit.to];
            for (j, column) in columns.iter().take(last).enumerate() {
                let x = &column[unit.from..unit.to];
                let product: f64 = x.iter().zip(y).map(|(a, b)| a * b).sum();
                sums[(j, last)] = product;
                sums[(last, j)] = product;
            }
            sums[(last, last)] = y.iter().map(|v| v * v).sum();
        }
        self.sum_up(columns.len());
    }

    fn response(&self) -> usize {
        self.sums.first().map_or(0, |s| s.nrows() - 1)
    }

    fn small(sums: &DMatrix<f64>, vectors: &[Combination]) -> DMatrix<f64> {
        let n = vectors.len();
        let mut small = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in i..n {
                let mut value = 0.0;
                for &(a, fa) in &vectors[i] {
                    for &(b, fb) in &vectors[j] {
                        value += fa * fb * sums[(a, b)];
                    }
                }
                small[(i, j)] = value;
                small[(j, i)] = value;
            }
        }
        small
    }

    /// Least squares on the units that `keep` names.
    pub fn solve(&self, model: &Model, keep: impl Fn(&Unit) -> bool) -> Solution {
        let vectors = model.vectors(self.response());
        let (all, p) = (vectors.len(), model.added.len());
        let mut by_session: Vec<DMatrix<f64>> =
            self.totals.iter().map(|sums| Self::small(sums, &vectors)).collect();
        for (unit, sums) in self.units.iter().zip(&self.sums).filter(|(u, _)| !keep(u)) {
            by_session[unit.session] -= Self::small(sums, &vectors);
        }
        let mut reduced = DMatrix::zeros(p + 1, p + 1);
        let mut whole = vec![0.0; p];
        let inverses: Vec<[[f64; 2]; 2]> = by_session.iter().map(inverse2).collect();
        for (sums, inverse) in by_session.iter().zip(&inverses) {
            let rest = sums.view((2, 2), (p + 1, p + 1));
            let cross = sums.view((0, 2), (2, p + 1));
            let inverse = DMatrix::from_fn(2, 2, |i, j| inverse[i][j]);
            reduced += rest - cross.tr_mul(&(inverse * cross));
            whole.iter_mut().enumerate().for_each(|(k, w)| *w += sums[(2 + k, 2 + k)]);
        }
        let (added, spread, mut log_determinant) = coefficients(&reduced, &whole);
        for sums in &by_session {
            let (a, b, d) = (sums[(0, 0)], sums[(0, 1)], sums[(1, 1)]);
            let determinant = a * d - b * b;
            log_determinant +=
                libm::log(if determinant > 1e-12 * a * d { determinant } else { a.max(1e-300) });
        }
        let vector = DVector::from_column_slice(&added);
        let left = (reduced[(p, p)] - reduced.view((0, p), (p, 1)).dot(&vector)).max(0.0);
        let sessions = by_session
            .iter()
            .zip(&inverses)
            .map(|(sums, inverse)| {
                let right: [f64; 2] = std::array::from_fn(|i| {
                    sums[(i, all - 1)] - (0..p).map(|k| sums[(i, 2 + k)] * added[k]).sum::<f64>()
                });
                std::array::from_fn(|i| inverse[i][0] * right[0] + inverse[i][1] * right[1])
            })
            .collect();
        Solution { sessions, added, left, spread, log_determinant }
    }

    /// Sum of squares that a fit leaves in a unit.
    pub fn error(&self, model: &Model, solution: &Solution, unit: usize) -> f64 {
        let vectors = model.vectors(self.response());
        let small = Self::small(&self.sums[unit], &vectors);
        let [offset, gain] = solution.sessions[self.units[unit].session];
        let mut v = DVector::zeros(vectors.len());
        (v[0], v[1]) = (-offset, -gain);
        for (k, c) in solution.added.iter().enumerate() {
            v[2 + k] = -c;
        }
        v[vectors.len() - 1] = 1.0;
        (v.tr_mul(&(small * &v)))[(0, 0)].max(0.0)
    }

    /// Sum of squares in every unit, predicted from the folds that do not hold it; in the units of `scored`, which may
    /// be other columns than those of the fit.
    pub fn held_out(&self, model: &Model, scored: &Moments) -> Vec<f64> {
        let folds = self.units.iter().map(|u| u.fold + 1).max().unwrap_or(0);
        let fits: Vec<Solution> = (0..folds).map(|fold| self.solve(model, |u| u.fold != fold)).collect();
        (0..self.units.len()).map(|u| scored.error(model, &fits[self.units[u].fold], u)).collect()
    }

    /// Sum of squares in every unit of a session whose coefficients come from the other sessions; its offset and gain
    /// are its own.
    pub fn held_out_sessions(&self, model: &Model, scored: &Moments) -> Vec<f64> {
        let fits: Vec<Solution> = (0..self.sessions)
            .map(|session| {
                let mut fit = self.solve(model, |u| u.session != session);
                let own = self.solve_with(model, &fit.added, session);
                fit.sessions[session] = own;
                fit
            })
            .collect();
        (0..self.units.len()).map(|u| scored.error(model, &fits[self.units[u].session], u)).collect()
    }

    /// Offset and gain of a session with given coefficients.
    fn solve_with(&self, model: &Model, added: &[f64], session: usize) -> [f64; 2] {
        let vectors = model.vectors(self.response());
        let sums = Self::small(&self.totals[session], &vectors);
        let inverse = inverse2(&sums);
        let last = vectors.len() - 1;
        let right: [f64; 2] = std::array::from_fn(|i| {
            sums[(i, last)] - added.iter().enumerate().map(|(k, c)| sums[(i, 2 + k)] * c).sum::<f64>()
        });
        std::array::from_fn(|i| inverse[i][0] * right[0] + inverse[i][1] * right[1])
    }
}

/// Inverse of the upper left 2 x 2 matrix; where the reference does not vary, the gain is 0.
fn inverse2(m: &DMatrix<f64>) -> [[f64; 2]; 2] {
    let (a, b, d) = (m[(0, 0)], m[(0, 1)], m[(1, 1)]);
    let determinant = a * d - b * b;
    if determinant > 1e-12 * a * d {
        [[d / determinant, -b / determinant], [-b / determinant, a / determinant]]
    } else if a > 0.0 {
        [[1.0 / a, 0.0], [0.0, 0.0]]
    } else {
        [[0.0; 2]; 2]
    }
}

/// Solves the normal equations of all columns but the last for the last. `whole` are the squares of the columns before
/// gain and offset were taken out; columns of which nothing was left get 0.
fn coefficients(reduced: &DMatrix<f64>, whole: &[f64]) -> (Vec<f64>, DMatrix<f64>, f64) {
    let p = whole.len();
    let used: Vec<usize> =
        (0..p).filter(|&i| reduced[(i, i)] > 1e-9 * whole[i] && reduced[(i, i)] > 0.0).collect();
    let mut values = vec![0.0; p];
    let mut spread = DMatrix::from_diagonal_element(p, p, f64::INFINITY);
    if used.is_empty() {
        return (values, spread, 0.0);
    }
    let mut log_determinant = 0.0;
    let m = used.len();
    let scale: Vec<f64> = used.iter().map(|&i| libm::sqrt(reduced[(i, i)])).collect();
    let normal = DMatrix::from_fn(m, m, |i, j| {
        reduced[(used[i], used[j])] / (scale[i] * scale[j]) + if i == j { 1e-9 } else { 0.0 }
    });
    let right = DVector::from_fn(m, |i, _| reduced[(used[i], p)] / scale[i]);
    if let Some(factor) = normal.cholesky() {
        let solved = factor.solve(&right);
        let root = factor.l_dirty();
        log_determinant = (0..m).map(|i| 2.0 * libm::log(root[(i, i)] * scale[i])).sum();
        let inverse = factor.inverse();
        for (i, &to) in used.iter().enumerate() {
            values[to] = solved[i] / scale[i];
            for (j, &other) in used.iter().enumerate() {
                spread[(to, other)] = inverse[(i, j)] / (scale[i] * scale[j]);
            }
        }
    }
    (values, spread, log_determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sessions with their own gain and offset and a column that they share: exact data are fitted exactly, held
    /// out too, and a changed force is found where it acts.
    #[test]
    fn exact_data_leave_nothing() {
        let n = 40;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i % 10)).collect();
        let c: Vec<f64> = (0..n).map(|i| f64::from(i * i % 7)).collect();
        let gain = |i: usize| if i < 20 { 2.0 } else { -0.5 };
        let y: Vec<f64> = (0..40).map(|i| 3.0 + gain(i) * x[i] + 0.25 * c[i]).collect();
        let units: Vec<Unit> =
            (0..8).map(|k| Unit { session: k / 4, fold: k % 4, from: 5 * k, to: 5 * k + 5 }).collect();
        let columns = vec![vec![1.0; 40], x, c, y];
        let moments = Moments::new(&units, &columns);
        let model = Model::baseline().with(&[2]);
        let fit = moments.solve(&model, |_| true);
        assert!((fit.added[0] - 0.25).abs() < 1e-8 && fit.left < 1e-6, "{fit:?}");
        assert!((fit.sessions[1][1] + 0.5).abs() < 1e-8 && (fit.sessions[0][0] - 3.0).abs() < 1e-8);
        assert!(moments.held_out(&model, &moments).iter().all(|&e| e < 1e-6));
        assert!(moments.held_out_sessions(&model, &moments).iter().all(|&e| e < 1e-6));
        assert!(moments.held_out(&Model::baseline(), &moments).iter().sum::<f64>() > 1.0);
        assert!(moments.solve(&Model::baseline().changed(2), |_| true).left > 1.0);
    }
}
