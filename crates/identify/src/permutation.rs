//! Does a residual depend on a covariate? Tests by permutation of what is really exchangeable.
//!
//! Measurements that were taken together are alike: the rows of one event, the pulls between two pauses, the samples of
//! a slow signal. A test that shuffles rows takes each of them for new evidence and finds dependences everywhere
//! (pseudo-replication). Here whole *blocks* change places, the order inside a block stays, so that the shuffled data
//! are as smooth as the measured ones. A block is what the caller says: a contiguous stretch of several
//! correlation times, a session, an event. With one observation a block this is the ordinary permutation test.

use crate::draws::Draws;
use gripgen_twin::Values;
use nalgebra::{DMatrix, DVector};

/// Values on which a residual may depend, one for each observation.
#[derive(Debug, Clone, PartialEq)]
pub enum Covariate {
    /// Numbers; NaN where nothing was written down.
    Number(Vec<f64>),
    /// Words, as numbers from 0 on that stand for them; `u32::MAX` where nothing was written down.
    Word(Vec<u32>),
}

impl From<&Values> for Covariate {
    fn from(values: &Values) -> Self {
        match values {
            Values::Numbers(numbers) => Covariate::Number(numbers.clone()),
            Values::Words(words) => Covariate::words(words.iter().map(String::as_str)),
        }
    }
}

impl Covariate {
    /// How many values there are.
    pub fn len(&self) -> usize {
        match self {
            Covariate::Number(values) => values.len(),
            Covariate::Word(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Words from texts: equal texts get equal numbers in order of appearance, an empty text is a missing value.
    pub fn words<'a>(texts: impl IntoIterator<Item = &'a str>) -> Self {
        let mut seen: Vec<&str> = Vec::new();
        let number = |text: &'a str| {
            if text.is_empty() {
                return u32::MAX;
            }
            let at = seen.iter().position(|s| *s == text).unwrap_or_else(|| {
                seen.push(text);
                seen.len() - 1
            });
            at as u32
        };
        Covariate::Word(texts.into_iter().map(number).collect())
    }

    /// Whether a value was written down.
    pub fn is_known(&self, at: usize) -> bool {
        match self {
            Covariate::Number(values) => values.get(at).is_some_and(|x| x.is_finite()),
            Covariate::Word(values) => values.get(at).is_some_and(|&x| x != u32::MAX),
        }
    }

    /// Whether two values at least occur.
    pub fn varies(&self) -> bool {
        let mut known = (0..self.len()).filter(|&i| self.is_known(i));
        let Some(first) = known.next() else { return false };
        known.any(|i| match self {
            Covariate::Number(values) => values[i] != values[first],
            Covariate::Word(values) => values[i] != values[first],
        })
    }

    fn at(&self, rows: &[usize]) -> Self {
        match self {
            Covariate::Number(values) => Covariate::Number(rows.iter().map(|&i| values[i]).collect()),
            Covariate::Word(values) => Covariate::Word(rows.iter().map(|&i| values[i]).collect()),
        }
    }
}

/// How far a residual depends on a covariate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dependence {
    /// Share of the variance of the residual that the covariate explains, beyond what chance explains: 0..1.
    pub strength: f64,
    /// Chance of as strong a dependence if there were none, at least 1 / (permutations + 1).
    pub p_value: f64,
}

impl Dependence {
    /// What cannot be tested.
    const NONE: Self = Self { strength: 0.0, p_value: 1.0 };
}

/// Largest number of distinct numbers that get a mean each.
const MAX_LEVELS: usize = 6;
/// Inner knots of the curve of a number.
const INNER_KNOTS: usize = 3;
/// Smallest part of the observations on one side of a step.
const MIN_SIDE: f64 = 0.05;

/// Dependence of `residual` on a covariate: word means, level means, a piecewise linear curve over the ranks, or one
/// step anywhere, whichever explains most, against the same maximum after permutation of the blocks.
///
/// `weight` are inverse variances (or empty: all alike). Observations with one number in `blocks` move together; a
/// block that moves to the place of one of another length is stretched or thinned. Observations without a value of the
/// covariate are left out. Without variation, with one block, or with slices of different lengths: strength 0, p 1.
pub fn dependence(
    residual: &[f64],
    weight: &[f64],
    covariate: &Covariate,
    blocks: &[usize],
    permutations: usize,
    seed: u64,
) -> Dependence {
    let Some(data) = Rows::new(residual, weight, &[covariate], blocks) else { return Dependence::NONE };
    let covariate = covariate.at(&data.rows);
    if !covariate.varies() {
        return Dependence::NONE;
    }
    let shape = Shape {
        removed: orthonormal(std::slice::from_ref(&data.root_weight), &[]),
        columns: main_columns(&covariate),
        steps: step_order(&covariate),
    };
    test(&data, &shape, permutations, seed)
}

/// Dependence of `residual` on the product `a*b` of two covariates beyond what each does alone (Freedman and Lane
/// 1983: the main effects are removed, what is left is permuted, and they are removed again). Otherwise as
/// [`dependence`].
pub fn interaction(
    residual: &[f64],
    weight: &[f64],
    pair: (&Covariate, &Covariate),
    blocks: &[usize],
    permutations: usize,
    seed: u64,
) -> Dependence {
    let Some(data) = Rows::new(residual, weight, &[pair.0, pair.1], blocks) else { return Dependence::NONE };
    let (a, b) = (pair.0.at(&data.rows), pair.1.at(&data.rows));
    if !a.varies() || !b.varies() {
        return Dependence::NONE;
    }
    let mut main = vec![data.root_weight.clone()];
    for covariate in [&a, &b] {
        // Curve and polynomial, so that no bend of a main effect is taken for an interaction.
        let simple = simple_columns(covariate);
        let squares = simple.iter().map(|c| c.iter().map(|x| x * x).collect());
        for column in main_columns(covariate).into_iter().chain(squares).chain(simple.clone()) {
            main.push(data.weighted(&column));
        }
    }
    let mut columns = Vec::new();
    for left in simple_columns(&a) {
        for right in simple_columns(&b) {
            columns.push(left.iter().zip(&right).map(|(x, y)| x * y).collect());
        }
    }
    let shape = Shape { removed: orthonormal(&main, &[]), columns, steps: Vec::new() };
    test(&data, &shape, permutations, seed)
}

/// Which of several tests are significant if at most this share of them may be false discoveries on average
/// (Benjamini and Hochberg 1995).
pub fn benjamini_hochberg(p_values: &[f64], rate: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&i, &j| p_values[i].total_cmp(&p_values[j]));
    let n = p_values.len() as f64;
    let last = order.iter().enumerate().rposition(|(k, &i)| p_values[i] <= rate * (k + 1) as f64 / n);
    let mut significant = vec![false; p_values.len()];
    for &i in order.iter().take(last.map_or(0, |k| k + 1)) {
        significant[i] = true;
    }
    significant
}

/// Observations that can be used.
struct Rows {
    rows: Vec<usize>,
    /// Residual in standard deviations.
    standardised: DVector<f64>,
    root_weight: Vec<f64>,
    /// Rows of each block, in their order.
    blocks: Vec<Vec<usize>>,
}

impl Rows {
    fn new(residual: &[f64], weight: &[f64], covariates: &[&Covariate], blocks: &[usize]) -> Option<Self> {
        let n = residual.len();
        let weight_of = |i: usize| if weight.is_empty() { 1.0 } else { weight[i] };
        if (!weight.is_empty() && weight.len() != n)
            || blocks.len() != n
            || covariates.iter().any(|c| c.len() != n)
        {
            return None;
        }
        let usable = |&i: &usize| {
            residual[i].is_finite() && weight_of(i) > 0.0 && covariates.iter().all(|c| c.is_known(i))
        };
        let rows: Vec<usize> = (0..n).filter(usable).collect();
        let root_weight: Vec<f64> = rows.iter().map(|&i| libm::sqrt(weight_of(i))).collect();
        let standardised =
            DVector::from_iterator(rows.len(), rows.iter().zip(&root_weight).map(|(&i, w)| residual[i] * w));
        let mut places = std::collections::BTreeMap::<usize, Vec<usize>>::new();
        for (k, &i) in rows.iter().enumerate() {
            places.entry(blocks[i]).or_default().push(k);
        }
        // In order of appearance, so that the names of the blocks do not matter.
        let mut blocks: Vec<Vec<usize>> = places.into_values().collect();
        blocks.sort_by_key(|rows| rows[0]);
        (blocks.len() > 1).then_some(Self { rows, standardised, root_weight, blocks })
    }

    fn weighted(&self, column: &[f64]) -> Vec<f64> {
        column.iter().zip(&self.root_weight).map(|(x, w)| x * w).collect()
    }

    /// Residuals after the blocks have changed places.
    fn permuted(&self, values: &DVector<f64>, order: &[usize]) -> DVector<f64> {
        let mut moved = DVector::zeros(values.len());
        for (to, &from) in self.blocks.iter().zip(order) {
            let from = &self.blocks[from];
            for (k, &row) in to.iter().enumerate() {
                moved[row] = values[from[(2 * k + 1) * from.len() / (2 * to.len())]];
            }
        }
        moved
    }
}

/// What is tested.
struct Shape {
    /// Orthonormal columns that are removed first.
    removed: DMatrix<f64>,
    /// Columns of the curve, not yet weighted.
    columns: Vec<Vec<f64>>,
    /// Rows in rising order of a number, with the places where a step may lie.
    steps: Vec<(usize, bool)>,
}

fn test(data: &Rows, shape: &Shape, permutations: usize, seed: u64) -> Dependence {
    let weighted: Vec<Vec<f64>> = shape.columns.iter().map(|c| data.weighted(c)).collect();
    let removed: Vec<Vec<f64>> = shape.removed.column_iter().map(|c| c.iter().copied().collect()).collect();
    let basis = orthonormal(&weighted, &removed);
    let without = |values: &DVector<f64>| values - &shape.removed * shape.removed.tr_mul(values);
    let share = |values: &DVector<f64>| {
        let left = without(values);
        let all = left.norm_squared();
        if all <= 1e-24 * values.norm_squared().max(f64::MIN_POSITIVE) {
            return 0.0;
        }
        let curve = basis.tr_mul(&left).norm_squared();
        curve.max(best_step(&left, &data.root_weight, &shape.steps)) / all
    };
    let start = without(&data.standardised);
    let measured = share(&start);
    let mut order: Vec<usize> = (0..data.blocks.len()).collect();
    let mut draws = Draws::new(seed, 1);
    let (mut as_strong, mut sum) = (0_usize, 0.0);
    for _ in 0..permutations {
        draws.shuffle(&mut order);
        let by_chance = share(&data.permuted(&start, &order));
        sum += by_chance;
        as_strong += usize::from(by_chance >= measured - 1e-9);
    }
    let chance = if permutations > 0 { (sum / permutations as f64).min(1.0 - 1e-9) } else { 0.0 };
    Dependence {
        strength: ((measured - chance) / (1.0 - chance)).clamp(0.0, 1.0),
        p_value: (1 + as_strong) as f64 / (1 + permutations) as f64,
    }
}

/// Sum of squares that the best single step explains; `left` has no weighted mean.
fn best_step(left: &DVector<f64>, root_weight: &[f64], steps: &[(usize, bool)]) -> f64 {
    let all: f64 = steps.iter().map(|&(row, _)| root_weight[row] * root_weight[row]).sum();
    let (mut below, mut weight, mut best) = (0.0, 0.0, 0.0_f64);
    for &(row, may_end) in steps {
        below += root_weight[row] * left[row];
        weight += root_weight[row] * root_weight[row];
        let above = all - weight;
        if may_end && above > 0.0 {
            best = best.max(below * below * all / (weight * above));
        }
    }
    best
}

/// Rows by rising value, and whether a step may lie behind each.
fn step_order(covariate: &Covariate) -> Vec<(usize, bool)> {
    let Covariate::Number(values) = covariate else { return Vec::new() };
    let mut rows: Vec<usize> = (0..values.len()).collect();
    rows.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let n = rows.len();
    let least = ((n as f64 * MIN_SIDE) as usize).max(2);
    let may_end = |k: usize| {
        k + 1 >= least && k + 1 + least <= n && rows.get(k + 1).is_some_and(|&j| values[j] != values[rows[k]])
    };
    (0..n).map(|k| (rows[k], may_end(k))).collect()
}

/// Columns of the curve in one covariate, without the constant.
fn main_columns(covariate: &Covariate) -> Vec<Vec<f64>> {
    match covariate {
        Covariate::Word(values) => indicators(values),
        Covariate::Number(values) => {
            let mut levels = values.clone();
            levels.sort_by(f64::total_cmp);
            levels.dedup();
            if levels.len() <= MAX_LEVELS {
                let number = |x: &f64| levels.iter().position(|l| l == x).unwrap_or(0) as u32;
                return indicators(&values.iter().map(number).collect::<Vec<u32>>());
            }
            let ranks = ranks(values);
            let mut columns = vec![ranks.clone()];
            for knot in 1..=INNER_KNOTS {
                let at = knot as f64 / (INNER_KNOTS + 1) as f64;
                columns.push(ranks.iter().map(|r| (r - at).max(0.0)).collect());
            }
            columns
        }
    }
}

/// Few columns of one covariate, for products.
fn simple_columns(covariate: &Covariate) -> Vec<Vec<f64>> {
    match covariate {
        Covariate::Word(values) => indicators(values),
        Covariate::Number(values) => {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let spread = values.iter().fold(0.0_f64, |m, x| m.max((x - mean).abs())).max(f64::MIN_POSITIVE);
            let linear: Vec<f64> = values.iter().map(|x| (x - mean) / spread).collect();
            let ranked = ranks(values).iter().map(|r| 2.0 * r - 1.0).collect();
            vec![linear, ranked]
        }
    }
}

/// One column for each word but the first.
fn indicators(words: &[u32]) -> Vec<Vec<f64>> {
    let mut distinct = words.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    distinct
        .iter()
        .skip(1)
        .map(|word| words.iter().map(|w| f64::from(u8::from(w == word))).collect())
        .collect()
}

/// Ranks over the number of values, 0..1; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut from = 0;
    while from < order.len() {
        let mut to = from;
        while to + 1 < order.len() && values[order[to + 1]] == values[order[from]] {
            to += 1;
        }
        let mean = (from + to) as f64 / 2.0 + 0.5;
        for &row in &order[from..=to] {
            ranks[row] = mean / values.len() as f64;
        }
        from = to + 1;
    }
    ranks
}

/// Orthonormal columns that span `columns` beside those of `before` (modified Gram-Schmidt, twice). Columns that add
/// nothing are left out.
fn orthonormal(columns: &[Vec<f64>], before: &[Vec<f64>]) -> DMatrix<f64> {
    let rows = columns.first().or(before.first()).map_or(0, Vec::len);
    let mut earlier: Vec<DVector<f64>> = before.iter().map(|c| DVector::from_column_slice(c)).collect();
    let skip = earlier.len();
    for column in columns {
        let mut v = DVector::from_column_slice(column);
        let length = v.norm();
        for _ in 0..2 {
            for e in &earlier {
                let along = e.dot(&v);
                v.axpy(-along, e, 1.0);
            }
        }
        let left = v.norm();
        if left > 1e-9 * length {
            earlier.push(v / left);
        }
    }
    match &earlier[skip..] {
        [] => DMatrix::zeros(rows, 0),
        new => DMatrix::from_columns(new),
    }
}

#[cfg(test)]
mod tests;
