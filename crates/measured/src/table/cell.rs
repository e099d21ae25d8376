//! What a cell says, in the ways in which people, spreadsheets and programs write it.

use std::borrow::Cow;

/// What stands where a value is missing: by hand, of spreadsheets, pandas, R, JSON and data bases. Letters of any case.
const MISSING: [&str; 8] = ["", "-", "--", "n/a", "#n/a", "na", "nan", "null"];

/// Whether a cell says that there is no value.
pub(crate) fn is_missing(cell: &str) -> bool {
    MISSING.iter().any(|word| cell.eq_ignore_ascii_case(word)) || cell == "\u{2013}" || cell == "\u{2014}"
}

/// A finite number as programs write it.
pub(crate) fn number(cell: &str) -> Option<f64> {
    cell.parse().ok().filter(|x: &f64| x.is_finite())
}

/// What commas and points in the numbers of a table are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Marks {
    /// Points are decimal, and there are no commas.
    #[default]
    Points,
    /// Points are decimal, commas stand between thousands: `1,234.5`.
    CommasOfThousands,
    /// Commas are decimal: `12,5`. Points may be anything.
    DecimalCommas,
    /// Commas are decimal, points stand between thousands: `1.234,5`.
    PointsOfThousands,
    /// Both are decimal: `12,5` and `0.104`.
    Both,
    /// Nothing tells what commas are: every one of them is like that of `1,234`, or some are of one kind and some of the other.
    Unclear,
}

impl Marks {
    /// What the cells of a table show together.
    pub(super) fn of<'c>(cells: impl Iterator<Item = &'c str>) -> Self {
        let (mut any, mut decimal, mut thousands) = (false, false, false);
        let (mut points, mut points_of_thousands) = (false, false);
        for cell in cells.map(plain) {
            if !cell.contains(',') || !is_number_with_commas(cell) {
                points |= cell.contains('.') && number(cell).is_some() && !is_grouped(cell, '.');
                continue;
            }
            any = true;
            let (before, after) = cell.split_once(',').unwrap_or((cell, ""));
            let grouped = is_grouped(cell.split('.').next().unwrap_or_default(), ',');
            if !grouped && !after.contains([',', '.']) {
                // 12,5 and 0,125 and 1.234,5
                decimal = true;
                points_of_thousands |= before.contains('.');
            } else if grouped && after.contains([',', '.']) {
                // 1,234,567 and 1,234.5
                thousands = true;
            }
        }
        match (any, decimal, thousands) {
            (false, ..) => Self::Points,
            (_, false, true) => Self::CommasOfThousands,
            (_, true, false) if points_of_thousands && !points => Self::PointsOfThousands,
            (_, true, false) if points => Self::Both,
            (_, true, false) => Self::DecimalCommas,
            _ => Self::Unclear,
        }
    }

    /// A number as programs write it: without a per cent sign, without what stands between thousands, with a decimal point.
    /// Whatever is no number stays as it is; `None` for what may be two numbers.
    pub(super) fn canonical(self, cell: &str) -> Option<Cow<'_, str>> {
        let is_plain = number(cell).is_some();
        if is_plain
            && !(matches!(self, Self::DecimalCommas | Self::PointsOfThousands) && is_grouped(cell, '.'))
        {
            return Some(cell.into());
        }
        let bare = plain(cell).replace('\u{2212}', "-");
        let commas = bare.contains(',') && is_number_with_commas(&bare);
        let written = match self {
            Self::Unclear if commas => return None,
            Self::DecimalCommas if is_grouped(&bare, '.') => return None,
            Self::PointsOfThousands | Self::DecimalCommas | Self::Both if commas => {
                let whole = bare.split(',').next().unwrap_or_default();
                let whole = if is_grouped(whole, '.') { whole.replace('.', "") } else { whole.into() };
                let decimals = bare.split_once(',').map_or("", |(_, decimals)| decimals);
                format!("{}.{decimals}", without_groups(&whole))
            }
            Self::PointsOfThousands => bare.replace('.', ""),
            Self::CommasOfThousands if commas => {
                let (whole, decimals) = bare.split_once('.').unwrap_or((&bare, "0"));
                match is_grouped(whole, ',') {
                    true => format!("{}.{decimals}", whole.replace(',', "")),
                    false => return Some(cell.into()),
                }
            }
            _ => without_groups(&bare),
        };
        Some(if number(&written).is_some() { written.into() } else { cell.into() })
    }
}

/// Without a per cent sign and the blanks before it.
fn plain(cell: &str) -> &str {
    cell.strip_suffix('%').map_or(cell, str::trim_end)
}

fn is_number_with_commas(cell: &str) -> bool {
    let digits = cell.trim_start_matches(['+', '-', '\u{2212}']);
    digits.starts_with(|c: char| c.is_ascii_digit() || c == ',')
        && digits.ends_with(|c: char| c.is_ascii_digit())
        && digits.chars().all(|c| c.is_ascii_digit() || ",. '\u{a0}\u{202f}\u{2019}".contains(c))
}

/// Whether digits stand in groups of three, with `mark` between them once at least: `1,234,567`. A zero begins no such number.
fn is_grouped(cell: &str, mark: char) -> bool {
    let mut groups = cell.trim_start_matches(['+', '-', '\u{2212}']).split(mark);
    let first = groups.next().unwrap_or_default();
    let digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let rest: Vec<&str> = groups.collect();
    (1..=3).contains(&first.len())
        && digits(first)
        && !first.starts_with('0')
        && !rest.is_empty()
        && rest.iter().all(|group| group.len() == 3 && digits(group))
}

/// Without blanks and apostrophes between thousands: `1 234.5`, `1'234.5`.
fn without_groups(cell: &str) -> String {
    let (whole, decimals) = cell.split_once('.').unwrap_or((cell, "0"));
    let mark =
        [' ', '\'', '\u{a0}', '\u{202f}', '\u{2019}'].into_iter().find(|mark| is_grouped(whole, *mark));
    match mark {
        Some(mark) => format!("{}.{decimals}", whole.replace(mark, "")),
        None => cell.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_says_that_a_value_is_missing() {
        for cell in ["", "n/a", "N/A", "NA", "-", "NaN", "null", "NULL", "#N/A", "\u{2013}"] {
            assert!(is_missing(cell), "{cell}");
        }
        for cell in ["0", "none", "nano", "-1", "anna", "naN1"] {
            assert!(!is_missing(cell), "{cell}");
        }
    }

    #[test]
    fn numbers_of_a_table_are_read_by_what_its_commas_are() {
        for (cells, marks, read) in [
            (&["12,5", "3", "1234"][..], Marks::DecimalCommas, &["12.5", "3", "1234"][..]),
            (&["12,5", "1.234,5", "1.234"], Marks::PointsOfThousands, &["12.5", "1234.5", "1234"]),
            (&["0,125", "1,234", "0.104"], Marks::Both, &["0.125", "1.234", "0.104"]),
            (&["1,234.5", "2,000"], Marks::CommasOfThousands, &["1234.5", "2000.0"]),
            (&["1,234,567"], Marks::CommasOfThousands, &["1234567.0"]),
            (&["45 %", "46%", "-47.5 %"], Marks::Points, &["45", "46", "-47.5"]),
            (&["1 234.5", "1'234", "\u{2212}5", "1e-3"], Marks::Points, &["1234.5", "1234.0", "-5", "1e-3"]),
            (&["ann, b", "a,b", "7.0"], Marks::Points, &["ann, b", "a,b", "7.0"]),
        ] {
            let found = Marks::of(cells.iter().copied());
            assert_eq!(found, marks, "{cells:?}");
            let found: Vec<_> = cells.iter().map(|cell| found.canonical(cell).unwrap()).collect();
            assert_eq!(found, read, "{cells:?}");
        }
    }

    /// One thousand, or one and a bit: nobody is told a number that may be the other one.
    #[test]
    fn what_may_be_two_numbers_is_none() {
        for (cells, unclear) in
            [(&["1,234", "2,500"][..], 0), (&["12,5", "1,234,567"], 1), (&["12,5", "1.234"], 1)]
        {
            let marks = Marks::of(cells.iter().copied());
            assert_eq!(marks.canonical(cells[unclear]), None, "{cells:?}");
        }
    }
}
