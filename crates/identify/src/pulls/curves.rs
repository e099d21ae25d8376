//! Unnamed dependences: a smooth curve in a column, steps between its words, the product of two columns.

use super::data::{Column, PullData};

/// The column whose words do not come back.
pub(crate) const SESSION: &str = "session";

/// The column of parts, each of which has a friction of its own.
pub(super) const PART: &str = "part";

/// The columns that tell when a pull was made, the finer one first.
pub(crate) const CLOCKS: [&str; 2] = ["time_s", "pull_index"];

/// Fewest pulls with a word that show a step of it: two pulls that lie far off are two bad pulls.
pub(super) const MIN_STEP: usize = 3;

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

    /// Takes out what it says of pulls without a value in its column, or in one of two.
    pub(super) fn silence(&mut self, data: &PullData<'_>) {
        for row in self.name.split('*').filter_map(|name| data.missing.get(name)).flatten() {
            self.basis[*row].fill(0.0);
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
pub(super) fn hinges(x: &[f64], inner: usize) -> Vec<Vec<f64>> {
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
