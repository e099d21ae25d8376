//! What a column, or two of them, may do to friction without a name: features whose coefficients are alike.

use crate::pulls::data::{Column, PullData};
use gripgen_twin::values::distinct;
use nalgebra::DMatrix;

/// A column that spans more than this factor counts by its logarithm.
const BY_LOGARITHM: f64 = 5.0;
/// Centres of a smooth curve at most.
const CENTRES: usize = 9;
/// Values from which on a curve may be this short, in standard deviations of its column.
const SHORT: (usize, f64) = (8, 0.35);
/// Length of a curve in a clock.
const OF_CLOCK: f64 = 0.15;
/// Harmonics of an angle.
const HARMONICS: usize = 6;
/// Variance that keeps the centres of a curve apart.
const JITTER: f64 = 1e-6;
/// Share of a product that has to be left when its two columns are known.
const LEFT: f64 = 0.05;
/// Singular values below this depend on others.
const DEPENDENT: f64 = 1e-8;

/// Whether a column of numbers spans so much that it counts by its logarithm.
pub(super) fn by_logarithm(x: &[f64]) -> bool {
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    low > 0.0 && high > BY_LOGARITHM * low
}

/// A column of numbers as curves see it: standardised, its logarithm where it spans a wide range.
pub(super) fn standard(x: &[f64]) -> Option<Vec<f64>> {
    let x: Vec<f64> = if by_logarithm(x) { x.iter().map(|v| libm::log(*v)).collect() } else { x.to_vec() };
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let sd = (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    (sd > 0.0).then(|| x.iter().map(|v| (v - mean) / sd).collect())
}

/// Features of a smooth curve of this length over standardised numbers: Nystroem's of a squared exponential.
fn smooth(x: &[f64], length: f64) -> DMatrix<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let count = CENTRES.min(sorted.len());
    let centres: Vec<f64> = (0..count).map(|k| sorted[k * (sorted.len() - 1) / (count - 1).max(1)]).collect();
    let kernel = |a: f64, b: f64| libm::exp(-0.5 * ((a - b) / length) * ((a - b) / length));
    let within = DMatrix::from_fn(count, count, |i, k| {
        kernel(centres[i], centres[k]) + if i == k { JITTER } else { 0.0 }
    });
    let across = DMatrix::from_fn(count, x.len(), |k, i| kernel(centres[k], x[i]));
    match within.cholesky() {
        Some(factor) => factor.l().solve_lower_triangular(&across).unwrap_or(across).transpose(),
        None => across.transpose(),
    }
}

fn line(x: &[f64]) -> DMatrix<f64> {
    DMatrix::from_column_slice(x.len(), 1, x)
}

/// Waves of an angle in degrees: amplitudes fall with the order.
fn waves(degrees: &[f64]) -> DMatrix<f64> {
    let all: f64 = (1..=HARMONICS).map(|h| 1.0 / (h * h) as f64).sum();
    DMatrix::from_fn(degrees.len(), 2 * HARMONICS, |i, k| {
        let h = (k / 2 + 1) as f64;
        let angle = h * degrees[i].to_radians();
        let wave = if k % 2 == 0 { libm::cos(angle) } else { libm::sin(angle) };
        wave / (h * all.sqrt())
    })
}

/// A level for each word; rows without a word have none.
fn levels(at: &[usize], words: usize) -> DMatrix<f64> {
    DMatrix::from_fn(at.len(), words, |i, k| f64::from(u8::from(at[i] == k)))
}

/// Takes the mean off each feature over the rows of a mask, and everything off the other rows.
fn centred(mut features: DMatrix<f64>, of: &[bool]) -> DMatrix<f64> {
    let n = of.iter().filter(|own| **own).count().max(1) as f64;
    for mut column in features.column_iter_mut() {
        let mean = column.iter().zip(of).filter(|(_, own)| **own).map(|(x, _)| x).sum::<f64>() / n;
        for (x, own) in column.iter_mut().zip(of) {
            *x = if *own { *x - mean } else { 0.0 };
        }
    }
    features
}

/// Rows in which a column has a value.
fn filled(data: &PullData<'_>, name: &str) -> Vec<bool> {
    let gaps = data.missing.get(name);
    (0..data.len()).map(|i| gaps.is_none_or(|rows| !rows.contains(&i))).collect()
}

/// The curves of one column, the simplest first; one of them at most acts.
pub(super) fn of_column(data: &PullData<'_>, name: &str, clock: bool) -> Vec<DMatrix<f64>> {
    let own = filled(data, name);
    let all = match &data.columns[name] {
        Column::Word(at, words) => vec![levels(at, words.len())],
        Column::Number(x) if name == "grip_angle_deg" && distinct(x) > 2 => {
            standard(x).map(|s| vec![line(&s), waves(x)]).unwrap_or_default()
        }
        Column::Number(x) => {
            let Some(s) = standard(x) else { return vec![] };
            let mut all = vec![line(&s)];
            if distinct(x) > 2 {
                all.push(smooth(&s, 1.0));
            }
            if distinct(x) > SHORT.0 {
                all.push(smooth(&s, SHORT.1));
            }
            if clock && distinct(x) > SHORT.0 {
                all.push(smooth(&s, OF_CLOCK));
            }
            all
        }
    };
    all.into_iter().map(|features| centred(features, &own)).collect()
}

/// Curves of a column of numbers, one for each part.
pub(super) fn of_parts(data: &PullData<'_>, name: &str) -> Vec<DMatrix<f64>> {
    let own = filled(data, name);
    let all = of_column(data, name, false);
    let each = |features: &DMatrix<f64>| {
        let mut wide = DMatrix::zeros(data.len(), features.ncols() * data.parts.len());
        for part in 0..data.parts.len() {
            let here: Vec<bool> = (0..data.len()).map(|i| own[i] && data.part_of[i] == part).collect();
            let block = centred(features.clone(), &here);
            wide.columns_mut(part * features.ncols(), features.ncols()).copy_from(&block);
        }
        wide
    };
    all.iter().map(each).collect()
}

/// What two columns do together in addition to what each does alone.
pub(super) struct Pair {
    pub(super) features: DMatrix<f64>,
    /// Of two columns of numbers, where the feature comes from.
    pub(super) sum: Option<PairSum>,
}

/// A feature of two columns of numbers as a sum: of their product about its centre, and of a curve in each.
#[derive(Debug, Clone)]
pub(super) struct PairSum {
    pub(super) centre: [f64; 2],
    /// The product of each pull.
    pub(super) product: Vec<f64>,
    /// What the product adds to the feature, and the curve in each column.
    pub(super) adds: [Vec<f64>; 3],
}

/// Lines of numbers, levels of words, multiplied, less what curves in each of the columns explain.
pub(super) fn of_pair(data: &PullData<'_>, a: &str, b: &str) -> Option<Pair> {
    let simple = |name: &str| match &data.columns[name] {
        Column::Word(at, words) => levels(at, words.len()),
        Column::Number(x) => {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            DMatrix::from_fn(x.len(), 1, |i, _| x[i] - mean)
        }
    };
    let (first, second) = (simple(a), simple(b));
    let (left, right) = (filled(data, a), filled(data, b));
    let own: Vec<bool> = left.iter().zip(&right).map(|(a, b)| *a && *b).collect();
    let (n, width) = (data.len(), first.ncols() * second.ncols());
    let mut product = DMatrix::zeros(n, width);
    for (k, l) in (0..first.ncols()).flat_map(|k| (0..second.ncols()).map(move |l| (k, l))) {
        product.set_column(k * second.ncols() + l, &first.column(k).component_mul(&second.column(l)));
    }
    let product = centred(product, &own);
    let alone = [a, b].map(|name| {
        let mut all = of_column(data, name, false);
        if all.is_empty() { DMatrix::zeros(n, 0) } else { all.swap_remove((all.len() - 1).min(1)) }
    });
    let of_b = 1 + alone[0].ncols();
    let mut known = DMatrix::from_element(n, of_b + alone[1].ncols(), 1.0);
    known.columns_mut(1, alone[0].ncols()).copy_from(&alone[0]);
    known.columns_mut(of_b, alone[1].ncols()).copy_from(&alone[1]);
    let explained = known.clone().svd(true, true).solve(&product, DEPENDENT).ok()?;
    let left = &product - &known * &explained;
    let kept = left.norm_squared() / product.norm_squared().max(1e-300);
    let scale = libm::sqrt(n as f64 / left.norm_squared().max(1e-300));
    let sum = (width == 1
        && matches!((&data.columns[a], &data.columns[b]), (Column::Number(_), Column::Number(_))))
    .then(|| {
        let numbers = |name: &str| data.numbers(name).unwrap_or_default();
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let (x, y) = (numbers(a), numbers(b));
        let curve = |from: usize, of: &DMatrix<f64>| -> Vec<f64> {
            (of * explained.rows(from, of.ncols()) * -scale).iter().copied().collect()
        };
        let line = |i: usize| scale * (product[(i, 0)] - explained[(0, 0)]);
        PairSum {
            centre: [mean(&x), mean(&y)],
            product: (0..n).map(|i| (x[i] - mean(&x)) * (y[i] - mean(&y))).collect(),
            adds: [(0..n).map(line).collect(), curve(1, &alone[0]), curve(of_b, &alone[1])],
        }
    });
    (kept > LEFT).then(|| Pair { features: left * scale, sum })
}

/// Memory of pulls of a session: a process that forgets over `length` pulls, by values at every second pull.
pub(super) fn memory(session_of: &[usize], length: f64) -> DMatrix<f64> {
    let n = session_of.len();
    let mut place = vec![0.0; n];
    for i in 1..n {
        place[i] = if session_of[i] == session_of[i - 1] { place[i - 1] + 1.0 } else { place[i - 1] + 1e3 };
    }
    let every = (n / 150).max(2);
    let nodes: Vec<f64> = place.iter().step_by(every).copied().collect();
    let kernel = |a: f64, b: f64| libm::exp(-(a - b).abs() / length);
    let within = DMatrix::from_fn(nodes.len(), nodes.len(), |i, k| {
        kernel(nodes[i], nodes[k]) + if i == k { JITTER } else { 0.0 }
    });
    let across = DMatrix::from_fn(nodes.len(), n, |k, i| kernel(nodes[k], place[i]));
    match within.cholesky() {
        Some(factor) => factor.l().solve_lower_triangular(&across).unwrap_or(across).transpose(),
        None => across.transpose(),
    }
}
