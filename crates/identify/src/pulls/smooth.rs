//! The groups of columns that a residual without a name may be made of: a smooth curve in every column of numbers, the product
//! of two, steps between words, a slope at one word. Each can be written into a twin as a table.

use super::curves::{Curve, SESSION};
use super::data::{Column, PullData};

/// Knots of a curve, and pulls for each.
const KNOTS: usize = 4;
const PULLS_PER_KNOT: usize = 12;

/// Standard deviation of a bend over that of the straight part: smooth is likelier than bent.
const BEND: f64 = 0.5;

/// Pulls from which on pairs of columns are looked at, and words that a column of a pair may have.
const MIN_OF_PAIR: usize = 24;
const MAX_WORDS: usize = 12;
const MAX_WORDS_OF_PAIR: usize = 4;

/// Fewest pulls with a word that show a slope.
const MIN_OF_WORD: usize = 8;

/// All groups that a campaign can show, each as a curve with its basis at every pull.
pub(super) fn smooths(data: &PullData<'_>) -> Vec<Curve> {
    let mut found = of_columns(data);
    found.iter_mut().for_each(|curve| curve.silence(data));
    found
}

fn of_columns(data: &PullData<'_>) -> Vec<Curve> {
    let n = data.len();
    let mut found = Vec::new();
    let mut numbers: Vec<(&str, Vec<f64>)> = Vec::new();
    for (name, column) in &data.columns {
        let distinct = column.distinct();
        match column {
            _ if distinct < 2 => {}
            Column::Number(x) => {
                found.push(curve(name.clone(), bent(x, distinct), None));
                numbers.push((name, standard(x)));
            }
            Column::Word(at, words) if name != "part" && distinct <= MAX_WORDS && distinct * 4 <= n => {
                let row = |w: &usize| (0..words.len()).map(|k| f64::from(u8::from(*w == k))).collect();
                found.push(curve(name.clone(), at.iter().map(row).collect(), None));
            }
            Column::Word(..) => {}
        }
    }
    if n < MIN_OF_PAIR {
        return found;
    }
    for (i, (a, x)) in numbers.iter().enumerate() {
        for (b, y) in &numbers[i + 1..] {
            let basis = x.iter().zip(y).map(|(x, y)| vec![x * y]).collect();
            found.push(curve(format!("{a}*{b}"), centred(basis), None));
        }
    }
    for (other, column) in &data.columns {
        let Column::Word(at, words) = column else { continue };
        // A session does not come back: what it teaches of a slope is of no use to pulls of another one.
        if other == SESSION || !(2..=MAX_WORDS_OF_PAIR).contains(&words.len()) {
            continue;
        }
        for (word, text) in words.iter().enumerate() {
            if at.iter().filter(|w| **w == word).count() < MIN_OF_WORD {
                continue;
            }
            for (a, x) in &numbers {
                let basis = x.iter().zip(at).map(|(x, w)| vec![if *w == word { *x } else { 0.0 }]).collect();
                found.push(curve(format!("{a}*{other}"), basis, Some((other.clone(), text.clone()))));
            }
        }
    }
    found
}

fn curve(name: String, basis: Vec<Vec<f64>>, only: Option<(String, String)>) -> Curve {
    let cost = basis.first().map_or(0, Vec::len);
    Curve { name, basis, additive: false, most: 3.0, cost, wave: false, only }
}

/// With mean 0 and standard deviation 1.
pub(super) fn standard(x: &[f64]) -> Vec<f64> {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let sd = (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt().max(1e-300);
    x.iter().map(|v| (v - mean) / sd).collect()
}

fn centred(mut basis: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = basis.len() as f64;
    for k in 0..basis.first().map_or(0, Vec::len) {
        let mean = basis.iter().map(|row| row[k]).sum::<f64>() / n;
        basis.iter_mut().for_each(|row| row[k] -= mean);
    }
    basis
}

/// A straight line, and hinges of which the line is taken out.
fn bent(x: &[f64], distinct: usize) -> Vec<Vec<f64>> {
    let line = standard(x);
    let n = x.len();
    let mut basis: Vec<Vec<f64>> = line.iter().map(|v| vec![*v]).collect();
    let mut sorted = line.clone();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let knots = KNOTS.min(distinct.saturating_sub(2)).min(n / PULLS_PER_KNOT);
    for k in 1..=knots {
        let knot = sorted[k * (sorted.len() - 1) / (knots + 1)];
        if knot <= sorted[0] {
            continue;
        }
        let mut hinge: Vec<f64> = line.iter().map(|v| (v - knot).max(0.0)).collect();
        let mean = hinge.iter().sum::<f64>() / n as f64;
        let slope = hinge.iter().zip(&line).map(|(h, l)| h * l).sum::<f64>() / n as f64;
        hinge.iter_mut().zip(&line).for_each(|(h, l)| *h -= mean + slope * l);
        let size = (hinge.iter().map(|h| h * h).sum::<f64>() / n as f64).sqrt();
        if size > 1e-6 {
            basis.iter_mut().zip(&hinge).for_each(|(row, h)| row.push(BEND * h / size));
        }
    }
    basis
}
