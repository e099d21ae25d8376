//! Curves that are chosen among many by what they explain: a sine of one frequency, a curve at one word.

use super::curves::{Curve, MIN_STEP, PART, SESSION, hinges};
use super::data::{Column, PullData};
use nalgebra::{DMatrix, DVector};

/// Sines of many frequencies over a clock (Lomb 1976): at least one and a half cycles, at most one in four pulls.
pub struct Waves {
    /// For each frequency an orthonormal pair, one number per pull.
    pairs: Vec<[Vec<f64>; 2]>,
}

impl Waves {
    /// Over a clock; `None` for few pulls.
    pub fn new(x: &[f64]) -> Option<Self> {
        let n = x.len();
        let (low, high) =
            x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        if n < 40 || low >= high {
            return None;
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let unit = |mut v: Vec<f64>| {
            let mean = v.iter().sum::<f64>() / n as f64;
            v.iter_mut().for_each(|a| *a -= mean);
            let length = dot(&v, &v).sqrt().max(1e-9);
            v.iter_mut().for_each(|a| *a /= length);
            v
        };
        // Four frequencies for each that the length of the campaign tells apart, up to a slow clock of 250 cycles.
        let pairs = (6..=n.min(1000))
            .map(|k| {
                let angle = |v: &f64| std::f64::consts::TAU * 0.25 * k as f64 * (v - low) / (high - low);
                let sine = unit(x.iter().map(|v| libm::sin(angle(v))).collect());
                let cosine = unit(x.iter().map(|v| libm::cos(angle(v))).collect());
                let along = dot(&sine, &cosine);
                let rest = unit(cosine.iter().zip(&sine).map(|(c, s)| c - along * s).collect());
                [sine, rest]
            })
            .collect();
        Some(Self { pairs })
    }

    /// The best frequency by position, and the sum of squares that it explains.
    pub fn best(&self, residuals: &[f64]) -> (usize, f64) {
        let dot = |a: &[f64]| a.iter().zip(residuals).map(|(a, r)| a * r).sum::<f64>();
        let each = self.pairs.iter().map(|[a, b]| dot(a).powi(2) + dot(b).powi(2)).enumerate();
        each.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
    }

    /// The sine of the frequency at `k` as a curve.
    fn curve(&self, name: &str, k: usize) -> Curve {
        let [a, b] = &self.pairs[k];
        // Root mean squares of 1, like other curves.
        let scale = (a.len() as f64).sqrt();
        let basis = a.iter().zip(b).map(|(a, b)| vec![scale * a, scale * b]).collect();
        Curve { name: name.into(), basis, additive: false, most: 1.0, cost: 4, wave: true, only: None }
    }
}

/// The sine over `x` that explains most of `residuals`. The choice of the frequency is paid for like two parameters.
pub fn periodic(name: &str, x: &[f64], residuals: &[f64]) -> Option<Curve> {
    let waves = Waves::new(x)?;
    Some(waves.curve(name, waves.best(residuals).0))
}

/// Fewest pulls with a word, and with any other, that show a curve of their own.
const MIN_OF_WORD: usize = 8;

/// Fewest pulls of a session that show one: a session of a handful of pulls has no slope of its own.
const MIN_OF_SESSION: usize = 16;

/// Curves in a column at one word of another column each: something that acts in one session, on one part; of words the steps between them. The
/// choice of the pair and that of the word cost a parameter each.
fn at_each_word(data: &PullData<'_>, name: &str, other: &str) -> Vec<Curve> {
    let (Some(Column::Word(at, words)), Some(column)) = (data.columns.get(other), data.columns.get(name))
    else {
        return vec![];
    };
    let n = at.len();
    let least = if other == SESSION { MIN_OF_SESSION } else { MIN_OF_WORD };
    let of = |word: usize| {
        let rows: Vec<usize> = (0..n).filter(|&i| at[i] == word).collect();
        if rows.len() < least || n - rows.len() < least {
            return None;
        }
        // Friction has a level for each part already.
        let level = other != PART;
        let basis = match column {
            Column::Number(x) => {
                let own: Vec<f64> = rows.iter().map(|&i| x[i]).collect();
                let varies = own.iter().any(|v| *v != own[0]);
                varies.then(|| basis_at(&rows, &own, n, level))?
            }
            Column::Word(own, names) => steps_at(&rows, own, names.len(), n, level)?,
        };
        Some(Curve {
            name: format!("{name}*{other}"),
            additive: false,
            most: 3.0,
            cost: basis[0].len() + 2,
            wave: false,
            only: Some((other.into(), words[word].clone())),
            basis,
        })
    };
    (0..words.len()).filter_map(of).collect()
}

/// That of them which explains most of `residuals`.
pub fn at_one_word(data: &PullData<'_>, name: &str, other: &str, residuals: &[f64]) -> Option<Curve> {
    let residuals = DVector::from_column_slice(residuals);
    let explained = |curve: &Curve| {
        let columns = DMatrix::from_fn(curve.basis.len(), curve.len(), |i, k| curve.basis[i][k]);
        let solved = columns.clone().svd(true, true).solve(&residuals, 1e-9).ok()?;
        Some((columns * solved).norm_squared())
    };
    let all = at_each_word(data, name, other).into_iter().filter_map(|c| Some((explained(&c)?, c)));
    all.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, curve)| curve)
}

/// The curves among which one was chosen for what it explains: itself, for most.
pub fn chosen_from(curve: &Curve, data: &PullData<'_>) -> Vec<Curve> {
    let (number, other) = curve.name.split_once('*').unwrap_or((&curve.name, ""));
    match (&curve.only, data.numbers(number)) {
        (Some(_), _) => at_each_word(data, number, other),
        (None, Some(x)) if curve.wave => Waves::new(&x)
            .map_or(vec![], |waves| (0..waves.pairs.len()).map(|k| waves.curve(number, k)).collect()),
        _ => vec![curve.clone()],
    }
}

/// Steps between words at some rows, and nothing elsewhere; with `level` a step to these rows as well.
fn steps_at(rows: &[usize], at: &[usize], words: usize, n: usize, level: bool) -> Option<Vec<Vec<f64>>> {
    let count = |word: usize| rows.iter().filter(|&&i| at[i] == word).count();
    let known = (0..words).filter(|&word| count(word) >= MIN_STEP);
    let steps: Vec<usize> = known.skip(usize::from(!level)).collect();
    let row = |i: usize| steps.iter().map(|word| f64::from(u8::from(at[i] == *word))).collect();
    let mut basis = vec![vec![0.0; steps.len()]; n];
    rows.iter().for_each(|&i| basis[i] = row(i));
    (steps.len() > usize::from(level)).then_some(basis)
}

/// A line with a bend at the rows of a word whose values are `own`, and nothing elsewhere; with `level` a step to it as well.
fn basis_at(rows: &[usize], own: &[f64], n: usize, level: bool) -> Vec<Vec<f64>> {
    let step = level.then_some(1.0);
    let mut basis = vec![vec![]; n];
    for (&i, row) in rows.iter().zip(hinges(own, 1)) {
        basis[i] = step.into_iter().chain(row).collect();
    }
    let width = rows.first().map_or(0, |&i| basis[i].len());
    basis.iter_mut().for_each(|row| row.resize(width, 0.0));
    basis
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a part no column is a step: with one, any coefficient of friction would do.
    #[test]
    fn a_curve_of_one_part_has_no_level_of_its_own() {
        let (rows, own) = ([1, 3, 4, 6], [2.0, 5.0, 7.0, 9.0]);
        let columns = |level: bool| {
            let basis = basis_at(&rows, &own, 7, level);
            assert!(basis.iter().all(|row| row.len() == basis[1].len()));
            assert!(basis[0].iter().all(|x| *x == 0.0));
            (0..basis[1].len()).map(|k| rows.map(|i| basis[i][k])).collect::<Vec<_>>()
        };
        let even = |column: &&[f64; 4]| column.iter().all(|x| *x == column[0]);
        assert_eq!(columns(true).iter().filter(even).count(), 1);
        assert_eq!(columns(false).iter().filter(even).count(), 0);
    }

    /// A wave of 7.3 cycles, sampled unevenly, is found with its frequency and explains nearly everything.
    #[test]
    fn a_wave_is_found_with_its_frequency() {
        let x: Vec<f64> = (0..90).map(|i| f64::from(i) + 0.4 * f64::from(i % 7)).collect();
        let range = x[89] - x[0];
        let of = |v: f64| 0.3 * (std::f64::consts::TAU * 7.3 * (v - x[0]) / range + 0.9).sin();
        let residuals: Vec<f64> = x.iter().map(|v| of(*v)).collect();
        let curve = periodic("time_s", &x, &residuals).unwrap();
        // Amplitude and phase by least squares.
        let dot = |a: usize, b: usize| curve.basis.iter().map(|r| r[a] * r[b]).sum::<f64>();
        let right = |a: usize| curve.basis.iter().zip(&residuals).map(|(row, r)| row[a] * r).sum::<f64>();
        let det = dot(0, 0) * dot(1, 1) - dot(0, 1) * dot(0, 1);
        let c = [
            (right(0) * dot(1, 1) - right(1) * dot(0, 1)) / det,
            (right(1) * dot(0, 0) - right(0) * dot(0, 1)) / det,
        ];
        let left: f64 =
            curve.basis.iter().zip(&residuals).map(|(b, r)| (r - b[0] * c[0] - b[1] * c[1]).powi(2)).sum();
        let all: f64 = residuals.iter().map(|r| r * r).sum();
        assert!(left < 0.05 * all, "{left} of {all}");
        assert!(periodic("time_s", &x[..30], &residuals[..30]).is_none());
    }
}
