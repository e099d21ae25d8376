//! Curves without a name as tables of a twin: the factor on friction over a column, where it was seen.

use super::features::PairSum;
use super::terms::{Kind, Shape, Term};
use crate::pulls::data::{Column, PullData};
use gripgen_twin::Values;

/// A factor on friction over one column.
#[derive(Debug, Clone, PartialEq)]
pub struct LearntTable {
    /// The column, or two of them as `a*b`.
    pub covariate: String,
    /// What is taken off both factors of a product.
    pub centre: Option<[f64; 2]>,
    /// The only part it acts on.
    pub part: Option<String>,
    /// A column of words and the only word of it at which it acts.
    pub only: Option<(String, String)>,
    /// Where its values are.
    pub places: Values,
    /// The factor at each place.
    pub factor: Vec<f64>,
}

/// Logarithms of factors are cut here: a table holds factors between a thousandth and a thousand.
const MOST: f64 = 6.0;

/// A table over a column of what the rows at `own` show.
fn over(data: &PullData<'_>, name: &str, own: &[usize], log_factor: &[f64]) -> Option<(Values, Vec<f64>)> {
    let factor = |i: usize| libm::exp(log_factor[i].clamp(-MOST, MOST));
    let gaps = data.missing.get(name);
    let own = || own.iter().copied().filter(|i| gaps.is_none_or(|rows| !rows.contains(i)));
    match data.columns.get(name)? {
        Column::Number(x) => {
            let points: Vec<(f64, f64)> = own().map(|i| (x[i], factor(i))).collect();
            (!points.is_empty()).then(|| axis(points))
        }
        Column::Word(at, words) => {
            let each = words.iter().enumerate();
            let seen =
                each.filter_map(|(w, word)| Some((word.clone(), factor(own().find(|&i| at[i] == w)?))));
            let (words, factor): (Vec<String>, Vec<f64>) = seen.unzip();
            (!words.is_empty()).then_some((Values::Words(words), factor))
        }
    }
}

/// Points as the axis of a table and its values.
fn axis(mut points: Vec<(f64, f64)>) -> (Values, Vec<f64>) {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.dedup_by(|a, b| a.0 == b.0);
    let (x, y) = points.into_iter().unzip();
    (Values::Numbers(x), y)
}

/// The tables of a term; `log_factor` is what it says of each pull.
pub(super) fn tables(
    data: &PullData<'_>,
    term: &Term,
    shape: &Shape,
    log_factor: &[f64],
) -> Vec<LearntTable> {
    let all: Vec<usize> = (0..data.len()).collect();
    let table = |covariate: &str, own: &[usize], log_factor: &[f64]| {
        let (places, factor) = over(data, covariate, own, log_factor)?;
        Some(LearntTable {
            covariate: covariate.into(),
            centre: None,
            part: None,
            only: None,
            places,
            factor,
        })
    };
    match &term.kind {
        Kind::Effect(_) | Kind::EffectOfParts(_) => vec![],
        Kind::Column(name) => table(name, &all, log_factor).into_iter().collect(),
        Kind::ColumnOfParts(name) => {
            let of = |(k, part): (usize, &String)| {
                let own: Vec<usize> = all.iter().copied().filter(|&i| data.part_of[i] == k).collect();
                Some(LearntTable { part: Some(part.clone()), ..table(name, &own, log_factor)? })
            };
            data.parts.iter().enumerate().filter_map(of).collect()
        }
        Kind::Pair(a, b) => {
            let (name, other, at, words) = match (&data.columns[a], &data.columns[b]) {
                (_, Column::Word(at, words)) => (a, b, at, words),
                (Column::Word(at, words), _) => (b, a, at, words),
                _ => {
                    return shape
                        .sum
                        .as_ref()
                        .map_or(vec![], |sum| of_numbers(data, (a, b), sum, log_factor));
                }
            };
            let of = |(w, word): (usize, &String)| {
                let own: Vec<usize> = all.iter().copied().filter(|&i| at[i] == w).collect();
                let only = Some((other.clone(), word.clone()));
                Some(LearntTable { only, ..table(name, &own, log_factor)? })
            };
            words.iter().enumerate().filter_map(of).collect()
        }
    }
}

/// The tables of two columns of numbers: over their product, and over each.
fn of_numbers(
    data: &PullData<'_>,
    (a, b): (&str, &str),
    sum: &PairSum,
    log_factor: &[f64],
) -> Vec<LearntTable> {
    let all: Vec<usize> = (0..data.len()).collect();
    let feature = |i: usize| sum.adds.iter().map(|part| part[i]).sum::<f64>();
    // The coefficient, from the pull that shows it best.
    let Some(i) = all.iter().copied().max_by(|&i, &k| feature(i).abs().total_cmp(&feature(k).abs())) else {
        return vec![];
    };
    let coefficient = log_factor[i] / feature(i);
    let logs = |part: &[f64]| part.iter().map(|x| coefficient * x).collect::<Vec<f64>>();
    let [product, first, second] = sum.adds.each_ref().map(|part| logs(part));
    let known =
        |i: &usize| [a, b].iter().all(|name| data.missing.get(*name).is_none_or(|rows| !rows.contains(i)));
    let points = all.iter().filter(|i| known(i));
    let points = points.map(|&i| (sum.product[i], libm::exp(product[i].clamp(-MOST, MOST)))).collect();
    let (places, factor) = axis(points);
    let own = LearntTable {
        covariate: format!("{a}*{b}"),
        centre: Some(sum.centre),
        part: None,
        only: None,
        places,
        factor,
    };
    let alone = [(a, first), (b, second)].into_iter().filter_map(|(name, logs)| {
        let (places, factor) = over(data, name, &all, &logs)?;
        Some(LearntTable { covariate: name.into(), centre: None, part: None, only: None, places, factor })
    });
    std::iter::once(own).chain(alone).collect()
}
