//! Unnamed dependences: a smooth curve in a column, steps between its words, the product of two columns.

use super::data::{Column, PullData};
use nalgebra::{DMatrix, DVector};

/// The column whose words do not come back.
pub(super) const SESSION: &str = "session";

/// Column of the parts, each of which has a friction of its own.
const PART: &str = "part";

/// Fewest pulls with a word that show a step of it: two pulls that lie far off are two bad pulls.
const MIN_STEP: usize = 3;

/// A dependence of friction on a column that no effect explains.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The column, or `a*b`.
    pub name: String,
    /// One row of basis functions per pull; each has mean 0, but at one word alone, where they are 0 elsewhere.
    pub basis: Vec<Vec<f64>>,
    /// Whether it adds a force to what the jaws hold; otherwise it multiplies it.
    pub additive: bool,
    /// Bound of a coefficient: share of the friction, or newtons.
    pub most: f64,
    /// Parameters that the data have to pay for.
    pub cost: usize,
    /// Whether it is a sine of one frequency.
    pub wave: bool,
    /// A column of words and the only word of it at which the curve is not 0; `name` is then `a*b` with that column behind.
    pub only: Option<(String, String)>,
}

/// What a curve has to do with sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Session {
    /// Nothing.
    Elsewhere,
    /// It is steps between sessions.
    Steps,
    /// It is a curve of one session.
    Slope,
}

impl Curve {
    /// What it has to do with sessions.
    pub fn session(&self) -> Session {
        match &self.only {
            Some((column, _)) if column == SESSION => Session::Slope,
            None if self.name == SESSION => Session::Steps,
            _ => Session::Elsewhere,
        }
    }

    /// Number of coefficients.
    pub fn len(&self) -> usize {
        self.basis.first().map_or(0, Vec::len)
    }

    /// Whether it has no coefficient.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Multiplies the factor of each pull.
    pub fn apply(&self, coefficients: &[f64], limits_n: &[f64], factor: &mut [f64]) {
        for (i, f) in factor.iter_mut().enumerate() {
            let sum: f64 = self.basis[i].iter().zip(coefficients).map(|(b, c)| b * c).sum();
            *f *= if self.additive {
                (1.0 + sum / limits_n[i].max(0.1)).max(0.05)
            } else {
                libm::exp(sum.clamp(-3.0, 3.0))
            };
        }
    }

    /// The same curve as a force that is added.
    pub fn added(&self) -> Self {
        Self { additive: true, most: 15.0, ..self.clone() }
    }
}

fn centred(mut basis: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = basis.len() as f64;
    for k in 0..basis.first().map_or(0, Vec::len) {
        let mean = basis.iter().map(|row| row[k]).sum::<f64>() / n;
        basis.iter_mut().for_each(|row| row[k] -= mean);
    }
    basis
}

/// Piecewise linear between knots, as a line and hinges, in units of the column's range.
fn hinges(x: &[f64], inner: usize) -> Vec<Vec<f64>> {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let range = (high - low).max(1e-300);
    let mut distinct = sorted.clone();
    distinct.dedup();
    let inner = inner.min(distinct.len().saturating_sub(2));
    let mut knots: Vec<f64> = (1..=inner).map(|k| distinct[k * (distinct.len() - 1) / (inner + 1)]).collect();
    knots.dedup();
    knots.retain(|k| *k > low && *k < high);
    x.iter()
        .map(|v| {
            let mut row = vec![(v - low) / range];
            row.extend(knots.iter().map(|k| ((v - k) / range).max(0.0)));
            row
        })
        .collect()
}

/// The curves in a column: of few knots, and for a clock also of many.
pub fn curves_in(name: &str, column: &Column) -> Vec<Curve> {
    let curve = |basis: Vec<Vec<f64>>, cost: usize| Curve {
        name: name.into(),
        basis: centred(basis),
        additive: false,
        most: 3.0,
        cost,
        wave: false,
        only: None,
    };
    match column {
        Column::Word(at, names) => {
            let count = |word: usize| at.iter().filter(|w| **w == word).count();
            let steps: Vec<usize> =
                (0..names.len()).filter(|&word| count(word) >= MIN_STEP).skip(1).collect();
            if steps.is_empty() {
                return vec![];
            }
            let row = |w: &usize| steps.iter().map(|word| f64::from(u8::from(w == word))).collect();
            vec![curve(at.iter().map(row).collect(), steps.len())]
        }
        Column::Number(x) => {
            let distinct = column.distinct();
            let mut all = vec![curve(hinges(x, 0), 1)];
            if distinct > 2 {
                all.push(curve(hinges(x, 2.min(distinct - 2)), 1 + 2.min(distinct - 2)));
            }
            if (5..=9).contains(&distinct) {
                all.push(curve(hinges(x, distinct - 2), distinct - 1));
            }
            if distinct > 12 {
                all.push(curve(hinges(x, 8), 9));
            }
            if distinct > 40 && x.len() > 60 {
                all.push(curve(hinges(x, 16), 17));
            }
            all
        }
    }
}

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
}

/// The sine over `x` that explains most of `residuals`. The choice of the frequency is paid for like two parameters.
pub fn periodic(name: &str, x: &[f64], residuals: &[f64]) -> Option<Curve> {
    let waves = Waves::new(x)?;
    let [a, b] = &waves.pairs[waves.best(residuals).0];
    // Root mean squares of 1, like other curves.
    let scale = (x.len() as f64).sqrt();
    let basis = a.iter().zip(b).map(|(a, b)| vec![scale * a, scale * b]).collect();
    Some(Curve { name: name.into(), basis, additive: false, most: 1.0, cost: 4, wave: true, only: None })
}

/// The product of two columns of numbers, each about its mean. One more parameter is paid for the choice of the pair.
pub fn product(data: &PullData<'_>, a: &str, b: &str) -> Option<Curve> {
    let standard = |name: &str| {
        let x = data.numbers(name)?;
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let sd = (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
        (sd > 0.0).then(|| x.iter().map(|v| (v - mean) / sd).collect::<Vec<_>>())
    };
    let (x, y) = (standard(a)?, standard(b)?);
    Some(Curve {
        name: format!("{a}*{b}"),
        basis: centred(x.iter().zip(&y).map(|(x, y)| vec![x * y]).collect()),
        additive: false,
        most: 2.0,
        cost: 2,
        wave: false,
        only: None,
    })
}

/// Fewest pulls with a word, and with any other, that show a curve of their own.
const MIN_OF_WORD: usize = 8;

/// Fewest pulls of a session that show one: a session of a handful of pulls has no slope of its own.
const MIN_OF_SESSION: usize = 16;

/// A curve in a column of numbers at one word of another column: something that acts in one session, on one part. The word is the one at which
/// it explains most of `residuals`; the choice of the pair and that of the word are paid for like a parameter each.
pub fn at_one_word(data: &PullData<'_>, name: &str, other: &str, residuals: &[f64]) -> Option<Curve> {
    let Some(Column::Word(at, words)) = data.columns.get(other) else { return None };
    let x = data.numbers(name)?;
    let least = if other == SESSION { MIN_OF_SESSION } else { MIN_OF_WORD };
    let of = |word: usize| {
        let rows: Vec<usize> = (0..x.len()).filter(|&i| at[i] == word).collect();
        let own: Vec<f64> = rows.iter().map(|&i| x[i]).collect();
        let enough = rows.len() >= least && x.len() - rows.len() >= least;
        if !enough || own.iter().all(|v| *v == own[0]) {
            return None;
        }
        // Friction has a level for each part already.
        let basis = basis_at(&rows, &own, x.len(), other != PART);
        let width = basis[rows[0]].len();
        let columns = DMatrix::from_fn(x.len(), width, |i, k| basis[i][k]);
        let solved =
            columns.clone().svd(true, true).solve(&DVector::from_column_slice(residuals), 1e-9).ok()?;
        Some(((&columns * solved).norm_squared(), word, basis))
    };
    let found = (0..words.len()).filter_map(of).max_by(|a, b| a.0.total_cmp(&b.0));
    let (_, word, basis) = found?;
    Some(Curve {
        name: format!("{name}*{other}"),
        additive: false,
        most: 3.0,
        cost: basis[0].len() + 2,
        wave: false,
        only: Some((other.into(), words[word].clone())),
        basis,
    })
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

    /// A curve at one word says whether that word is a session, steps say whether they are between sessions.
    #[test]
    fn sessions_are_known_from_other_words() {
        let words = Column::Word(vec![0, 0, 0, 1, 1, 1], ["a", "b"].map(String::from).to_vec());
        let steps = |name: &str| curves_in(name, &words).remove(0);
        assert_eq!(steps("session").session(), Session::Steps);
        assert_eq!(steps("operator").session(), Session::Elsewhere);
        let at = |other: &str| Curve { only: Some((other.into(), "a".into())), ..steps("dwell_s") };
        assert_eq!(at("session").session(), Session::Slope);
        assert_eq!(at("operator").session(), Session::Elsewhere);
    }

    /// A word with two pulls has no step: they are drawn like the pulls of the first word, and alone make no curve.
    #[test]
    fn two_pulls_are_no_step() {
        let words = ["a", "b", "c"].map(String::from).to_vec();
        let curve =
            curves_in("session", &Column::Word(vec![0, 0, 1, 1, 1, 2, 2, 2], words.clone())).remove(0);
        assert_eq!((curve.len(), curve.cost), (1, 1));
        assert_eq!(curve.basis[0], curve.basis[3]);
        assert_ne!(curve.basis[3], curve.basis[6]);
        assert!(curves_in("session", &Column::Word(vec![0, 0, 1, 1, 1, 2, 2], words)).is_empty());
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
