//! Numbers or words: the values of a column, one for each row.

use crate::draw::Drawn;
use std::borrow::Cow;

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; NaN where nobody wrote one down.
    Numbers(Vec<f64>),
    /// Words; empty where nobody wrote one down.
    Words(Vec<String>),
}

/// A number of a cell, NaN where nobody wrote one down; `None` if the cell is a word. What is not finite says nothing.
fn number(cell: &str) -> Option<f64> {
    match cell.parse::<f64>() {
        _ if cell.is_empty() => Some(f64::NAN),
        Ok(x) if x.is_finite() => Some(x),
        Ok(_) => Some(f64::NAN),
        Err(_) => None,
    }
}

/// The number in the middle, the upper one of two; `None` without any.
pub fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

/// 95 % quantile of Student's t (Hill 1970, leading terms; within 1 % from 3 degrees of freedom on, of its table).
pub fn t_quantile_95(freedom: f64) -> f64 {
    let z: f64 = 1.644_853_6;
    let v = freedom.max(1.0);
    if v < 1.5 {
        return 6.313_752;
    }
    if v < 2.5 {
        return 2.919_986;
    }
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * v)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * v * v)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * v * v * v)
}

/// How many different numbers there are; those that are none are one.
pub fn distinct(numbers: &[f64]) -> usize {
    // Zeros are equal, whatever their sign.
    let bits = |x: &f64| if x.is_nan() { u64::MAX } else { (x + 0.0).to_bits() };
    let mut bits: Vec<u64> = numbers.iter().map(bits).collect();
    bits.sort_unstable();
    bits.dedup();
    bits.len()
}

fn kept<T: Clone>(all: &[T], keep: impl Fn(usize) -> bool) -> Vec<T> {
    all.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, x)| x.clone()).collect()
}

impl Values {
    /// The values of cells: numbers if every cell is one or empty, else words; `None` if all of them are empty, which is a column
    /// that nobody recorded.
    pub fn of_cells<'a>(cells: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        if cells.clone().all(str::is_empty) {
            return None;
        }
        let numbers: Option<Vec<f64>> = cells.clone().map(number).collect();
        Some(numbers.map_or_else(|| Self::Words(cells.map(String::from).collect()), Self::Numbers))
    }

    /// Values that are there or not: numbers if all that are there are, else words.
    pub fn of_drawn<'a>(drawn: impl Iterator<Item = Option<&'a Drawn>> + Clone) -> Self {
        if drawn.clone().any(|value| matches!(value, Some(Drawn::Text(_)))) {
            return Self::Words(drawn.map(|value| value.map_or(String::new(), Drawn::to_string)).collect());
        }
        let number = |value: Option<&Drawn>| match value {
            Some(Drawn::Number(x)) => *x,
            _ => f64::NAN,
        };
        Self::Numbers(drawn.map(number).collect())
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(x) => x.len(),
            Self::Words(words) => words.len(),
        }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value of a row; `None` where nobody wrote one down, or there is no such row.
    pub fn at(&self, row: usize) -> Option<Drawn> {
        match self {
            Self::Numbers(x) => x.get(row).filter(|x| x.is_finite()).map(|x| Drawn::Number(*x)),
            Self::Words(words) => words.get(row).filter(|w| !w.is_empty()).map(|w| Drawn::Text(w.clone())),
        }
    }

    /// The value of a row as it stands in a file; empty where there is none.
    pub fn cell(&self, row: usize) -> Cow<'_, str> {
        match self {
            Self::Numbers(_) => self.at(row).map_or("".into(), |x| x.to_string().into()),
            Self::Words(words) => words.get(row).map_or("", String::as_str).into(),
        }
    }

    /// Number of different values; those that nobody wrote down are one.
    pub fn distinct(&self) -> usize {
        match self {
            Self::Words(words) => sorted(words).len(),
            Self::Numbers(x) => distinct(x),
        }
    }

    /// Words as places in the sorted list of them.
    pub fn coded(words: &[String]) -> (Vec<usize>, Vec<String>) {
        let names = sorted(words);
        let at = words.iter().map(|word| names.partition_point(|name| name < word)).collect();
        (at, names)
    }

    /// The rows for which `keep` is true, in order.
    #[must_use]
    pub fn kept(&self, keep: impl Fn(usize) -> bool) -> Self {
        match self {
            Self::Numbers(x) => Self::Numbers(kept(x, keep)),
            Self::Words(words) => Self::Words(kept(words, keep)),
        }
    }

    /// Puts rows of the same kind behind those that are there; rows of the other kind are left out.
    pub fn append(&mut self, more: &Self) {
        match (self, more) {
            (Self::Numbers(x), Self::Numbers(more)) => x.extend(more),
            (Self::Words(words), Self::Words(more)) => words.extend(more.iter().cloned()),
            _ => {}
        }
    }

    /// Whether both hold numbers or both words.
    pub fn same_kind(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }

    /// The same with the median, which says nothing, where nobody wrote a number down; 0 where nobody wrote down any.
    #[must_use]
    pub fn without_gaps(mut self) -> Self {
        if let Self::Numbers(x) = &mut self {
            let known = x.iter().copied().filter(|x| x.is_finite()).collect();
            let middle = median(known).unwrap_or(0.0);
            x.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = middle);
        }
        self
    }
}

fn sorted(words: &[String]) -> Vec<String> {
    let mut names = words.to_vec();
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(cells: &[&str]) -> Option<Values> {
        Values::of_cells(cells.iter().copied())
    }

    #[test]
    fn an_empty_cell_is_no_word_and_nothing_but_empty_cells_is_no_column() {
        let Some(Values::Numbers(x)) = of(&["1.5", "", "inf", "-2"]) else { panic!("numbers") };
        assert!(x[0] == 1.5 && x[1].is_nan() && x[2].is_nan() && x[3] == -2.0, "{x:?}");
        let words = of(&["7.0", "", "b"]).unwrap();
        assert_eq!(words, Values::Words(vec!["7.0".into(), String::new(), "b".into()]), "as they stand");
        assert_eq!((of(&["", ""]), of(&[])), (None, None));
        assert_eq!((words.at(0), words.at(1), words.at(9)), (Some(Drawn::Text("7.0".into())), None, None));
        let numbers = of(&["0.10", ""]).unwrap();
        assert_eq!((numbers.at(0), numbers.at(1)), (Some(Drawn::Number(0.1)), None));
        assert_eq!((numbers.cell(0), numbers.cell(1), numbers.cell(5)), ("0.1".into(), "".into(), "".into()));
    }

    #[test]
    fn values_are_counted_kept_joined_and_filled() {
        let mut numbers = of(&["1", "", "-0", "0", "", "3"]).unwrap();
        assert_eq!(numbers.distinct(), 4, "zero is one value, and so is none");
        assert_eq!(numbers.kept(|i| i % 2 == 1).len(), 3);
        assert_eq!(numbers.clone().without_gaps(), of(&["1", "1", "0", "0", "1", "3"]).unwrap());
        let words = of(&["b", "a", "b"]).unwrap();
        assert_eq!((words.distinct(), words.same_kind(&numbers)), (2, false));
        let Values::Words(list) = &words else { panic!("words") };
        assert_eq!(Values::coded(list), (vec![1, 0, 1], vec!["a".to_string(), "b".into()]));
        numbers.append(&words);
        numbers.append(&of(&["9"]).unwrap());
        assert_eq!((numbers.len(), numbers.at(6)), (7, Some(Drawn::Number(9.0))));
    }

    #[test]
    fn drawn_values_are_words_if_one_of_them_is() {
        let (x, word) = (Drawn::Number(1.5), Drawn::Text("wet".into()));
        let of = |list: &[Option<&Drawn>]| Values::of_drawn(list.iter().copied());
        assert_eq!(
            of(&[Some(&x), None, Some(&word)]),
            Values::Words(vec!["1.5".into(), String::new(), "wet".into()])
        );
        let Values::Numbers(found) = of(&[Some(&x), None]) else { panic!("numbers") };
        assert!(found[0] == 1.5 && found[1].is_nan());
    }
}
