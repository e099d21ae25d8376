//! What lies in a folder of measured pulls and is not read, or not as it was meant: people are told.

use super::TRACES_FOLDER;
use gripgen_twin::columns::{COLUMNS, Column, InTable};
use gripgen_twin::config::{one_slip_apart, suggestion};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{MeasuredPull, MeasuredPulls};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Keys of a campaign file.
const KEYS: [&str; 7] = [
    "force_convention",
    "label_tolerance_n",
    "stop_mm",
    "feedback",
    "label_evidence",
    "every_reading",
    "pulls",
];

/// Units that people write behind numbers.
const UNITS: [&str; 18] =
    ["%", "°", "°C", "°F", "C", "K", "N", "mN", "kN", "mm", "cm", "m", "s", "ms", "min", "h", "Hz", "deg"];

/// Ends of the names of columns that people leave out.
const ENDINGS: [&str; 6] = ["_id", "_s", "_c", "_mm", "_deg", "_n"];

/// Files named at most.
const NAMED: usize = 3;

/// Traces that belong to no pull; `stored` are the files in their folder.
pub(super) fn traces_of_nobody(
    folder: &Path,
    stored: &HashSet<String>,
    pulls: &[MeasuredPull],
) -> Option<String> {
    let files: HashMap<String, &str> =
        pulls.iter().map(|pull| (format!("{}.csv", pull.id), pull.id.as_str())).collect();
    let table = |name: &&String| name.to_lowercase().ends_with(".csv") && !name.starts_with('.');
    let mut strays: Vec<&str> =
        stored.iter().filter(table).map(String::as_str).filter(|name| !files.contains_key(*name)).collect();
    strays.sort_unstable();
    let first = strays.first()?;
    let own = |name: &&str| !stored.contains(&format!("{name}.csv"));
    let without: Vec<&str> = pulls.iter().map(|pull| pull.id.as_str()).filter(own).collect();
    let typed = &first[..first.len() - ".csv".len()];
    let like = match suggestion(typed, without).or_else(|| suggestion(typed, files.values().copied())) {
        Some(id) => format!("the nearest pull to `{first}` is `{id}`"),
        None => {
            format!("a trace has the name of its pull, as `{}.csv`", pulls.first().map_or("", |p| &p.id))
        }
    };
    let more = if strays.len() > NAMED { ", ..." } else { "" };
    let named = strays[..strays.len().min(NAMED)].join(", ");
    let said = match strays.len() {
        1 => format!("{named} belongs to no pull and is not read"),
        n => format!("{n} files belong to no pull and are not read ({named}{more})"),
    };
    Some(format!("{}: {said}: {like}", folder.join(TRACES_FOLDER).display()))
}

/// Traces of pulls in files that are no table of text: compressed, or of another program. `stored` are the files in their folder.
pub(super) fn traces_of_other_kinds(
    folder: &Path,
    stored: &HashSet<String>,
    pulls: &[MeasuredPull],
) -> Option<String> {
    let own = |pull: &MeasuredPull| {
        let begins = |name: &&String| name.strip_prefix(&pull.id).is_some_and(|end| end.starts_with('.'));
        if stored.contains(&format!("{}.csv", pull.id)) { None } else { stored.iter().filter(begins).min() }
    };
    let of: Vec<(&MeasuredPull, &String)> =
        pulls.iter().filter_map(|pull| Some((pull, own(pull)?))).collect();
    let (first, name) = of.first()?;
    let (wanted, n) = (format!("{}.csv", first.id), of.len());
    let what = if name.starts_with(&wanted) { "unpack it to" } else { "a trace is a table of text named" };
    let are = if n == 1 { "trace is" } else { "traces are" };
    Some(format!("{}: {n} {are} not read ({name}): {what} `{wanted}`", folder.join(TRACES_FOLDER).display()))
}

/// Columns of unknown meaning that are words because of a few cells, where most cells are numbers.
pub(super) fn words_among_numbers(path: &Path, pulls: &MeasuredPulls) -> Vec<String> {
    let said = |name: &String| {
        let words = pulls.pulls.iter().filter_map(|pull| match pull.covariates.extra.get(name) {
            Some(Drawn::Text(word)) => Some((&pull.id, word)),
            _ => None,
        });
        let (numbers, others): (Vec<_>, Vec<_>) =
            words.partition(|(_, word)| word.trim().parse::<f64>().is_ok());
        let (id, word) = others.first().filter(|_| numbers.len() > others.len())?;
        Some(format!(
            "{}: the column {name} is one of words, because `{word}` (pull {id}) is no number and {} others are: leave a cell empty where a \
             value is missing",
            path.display(),
            numbers.len()
        ))
    };
    pulls.extra.iter().filter_map(|column| said(&column.name)).collect()
}

/// Columns of unknown meaning whose cells are numbers with a unit behind them.
pub(super) fn numbers_with_units(path: &Path, pulls: &MeasuredPulls) -> Vec<String> {
    let said = |name: &String| {
        let mut units = pulls.pulls.iter().filter_map(|pull| match pull.covariates.extra.get(name) {
            Some(Drawn::Text(word)) => Some(unit_of(word)),
            _ => None,
        });
        let unit = units.next().flatten()?;
        units.all(|other| other == Some(unit)).then(|| {
            format!(
                "{}: all cells of the column {name} end in `{unit}`, so that they are words and have no order: write the number alone",
                path.display()
            )
        })
    };
    pulls.extra.iter().filter_map(|column| said(&column.name)).collect()
}

/// What stands behind the number of a cell, if it begins with one.
fn unit_of(word: &str) -> Option<&str> {
    let word = word.trim();
    let unit = word.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let number = &word[..word.len() - unit.len()];
    let unit = unit.trim();
    // `2b` and `3-left` are names.
    let is_unit =
        unit.chars().all(|c| c.is_alphabetic() || "%°/".contains(c)) && number.parse::<f64>().is_ok();
    (is_unit && UNITS.contains(&unit)).then_some(unit)
}

/// Columns of unknown meaning whose names are nearly those of columns that effects know.
pub(super) fn nearly_known(path: &Path, pulls: &MeasuredPulls) -> Vec<String> {
    let open = |column: &&Column| {
        column.in_table == InTable::Covariate && pulls.recorded.iter().all(|name| name != column.name)
    };
    let said = |typed: &String| {
        let plain: String =
            typed.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        // `gel` for `gel_id`, `dwell` for `dwell_s`; `force` is no `force_increment_n`.
        let begins = |name: &str| name.strip_prefix(&plain).is_some_and(|end| ENDINGS.contains(&end));
        let slip = |name: &str| plain.len() >= 6 && one_slip_apart(&plain, name);
        let meant = |name: &&str| *name == plain || begins(name) || slip(name);
        let mut names = COLUMNS.iter().filter(open).map(|column| column.name).filter(meant);
        let name = names.next().filter(|_| names.next().is_none())?;
        Some(format!(
            "{}: no effect knows the column {typed}, it is one of your own: did you mean {name}?",
            path.display()
        ))
    };
    pulls.extra.iter().filter_map(|column| said(&column.name)).collect()
}

/// Keys of a campaign file that mean nothing.
pub(super) fn unknown_keys(path: &Path, text: &str) -> Vec<String> {
    let table: toml::Table = text.trim_start_matches('\u{feff}').parse().unwrap_or_default();
    let unknown = table.keys().filter(|key| !KEYS.contains(&key.as_str()));
    let said = |key: &String| {
        let like = match suggestion(key, KEYS) {
            Some(name) => format!("did you mean `{name}`?"),
            None => format!("known are {}", KEYS.join(", ")),
        };
        format!("{}: the key `{key}` means nothing here and was left alone: {like}", path.display())
    };
    unknown.map(said).collect()
}
