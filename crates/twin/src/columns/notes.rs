//! What a lab notes of a pull: columns of its own, and the temperature.

use crate::columns::{COLUMNS, covariate, find, is_of_sample};
use crate::config::one_slip_apart;
use crate::draw::Drawn;
use crate::label::check::ZERO_SHIFT;
use crate::scenario::keys::is_own_column;

/// The one known column that a rig does not measure, and a person can.
pub const TEMPERATURE: &str = "temperature_c";

/// Names of an entry that are no columns.
const KEYS: [&str; 2] = ["kind", "pause_s"];
/// Columns that no entry has: a rig counts the pulls and the time.
const COUNTED: [&str; 3] = ["grip_pose", "pull_index", "time_s"];
/// Columns that a rig measures and writes by itself, in addition to those of every sample.
const MEASURED: [&str; 5] = [ZERO_SHIFT, "grip_force_off_n", "lateral_n", "pull_id", "status_reason"];
/// Ends of names that stand for a known column without its unit or its end.
const ENDINGS: [&str; 6] = ["_id", "_s", "_c", "_mm", "_deg", "_n"];
/// Words for a value that was not measured.
const MISSING: [&str; 6] = ["", "-", "na", "n/a", "nan", "null"];
/// Letters of the longest unit in a name: `deg`, `min`.
const UNIT_LETTERS: usize = 3;

/// A value that a person wrote: a number, or else a word; `None` where it says that there is none.
pub fn note_of(text: &str) -> Option<Drawn> {
    let text = text.trim();
    if MISSING.contains(&text.to_lowercase().as_str()) {
        return None;
    }
    Some(text.parse().map_or_else(|_| Drawn::Text(text.into()), Drawn::Number))
}

/// Checks the name of a column that a lab notes, and its value.
///
/// # Errors
///
/// A name that is that of something else, or nearly that of a known column; a value that cannot have been measured.
pub fn check_note(name: &str, value: &Drawn) -> Result<(), String> {
    check_name(name)?;
    match value {
        Drawn::Number(x) if name == TEMPERATURE => {
            let column = covariate(name).map_or(Ok(*x), |column| column.check_measured(*x));
            column.map(|_| ()).map_err(|wanted| format!("`{name}` is {x}, it must be {wanted}"))
        }
        Drawn::Number(x) if x.is_finite() => Ok(()),
        Drawn::Number(x) => Err(format!("`{name}` is {x}, leave it out where it was not measured")),
        Drawn::Text(word) if name == TEMPERATURE => Err(format!("`{name}` is `{word}`, it must be a number")),
        Drawn::Text(word) if note_of(word).is_none() => {
            Err(format!("`{name}` is `{word}`, leave it out where it was not measured"))
        }
        Drawn::Text(word) if word.replacen(',', ".", 1).parse::<f64>().is_ok() && word.contains(',') => {
            Err(format!("`{name}` is `{word}`: write the number with a point"))
        }
        Drawn::Text(word) if word.contains(char::is_control) => {
            Err(format!("`{name}` is {word:?}, it must be one line"))
        }
        Drawn::Text(_) => Ok(()),
    }
}

fn check_name(name: &str) -> Result<(), String> {
    if name == TEMPERATURE {
        return Ok(());
    }
    if is_of_sample(name) || MEASURED.contains(&name) {
        return Err(format!(
            "`{name}` is written by the rig itself: a column of your own needs another name"
        ));
    }
    if find(name).is_some() || KEYS.contains(&name) {
        return Err(format!("`{name}` is no column that is noted: the campaign or the rig says it"));
    }
    if let Some(known) = meant(name) {
        return Err(format!(
            "unknown field `{name}`: did you mean `{known}`? A column of your own needs another name"
        ));
    }
    let plain = name.chars().all(|c| c.is_alphanumeric() || "_-".contains(c)) && !name.is_empty();
    match plain && is_own_column(name) {
        true => Ok(()),
        false => Err(format!("`{name}` cannot be the name of a column: letters, digits and `_` can")),
    }
}

/// The known name that a name nearly is: in other letters, without its end, with another unit, or one slip apart.
fn meant(name: &str) -> Option<&'static str> {
    let plain = name.to_lowercase();
    let stem = |name: &str| {
        name.rsplit_once('_').filter(|(_, unit)| unit.len() <= UNIT_LETTERS).map(|(stem, _)| stem.to_string())
    };
    let known = COLUMNS.iter().filter(|column| !COUNTED.contains(&column.name));
    let known = known.map(|column| (column.name, !["", "1"].contains(&column.unit)));
    let known = known.chain(KEYS.map(|key| (key, key == "pause_s")));
    let is_meant = |(known, has_unit): &(&'static str, bool)| {
        let begins = known.strip_prefix(plain.as_str()).is_some_and(|end| ENDINGS.contains(&end));
        let slip = plain.len() >= 6 && one_slip_apart(&plain, known);
        let unit = *has_unit && stem(&plain).is_some() && stem(&plain) == stem(known);
        *known == plain || begins || slip || unit
    };
    known.into_iter().find(is_meant).map(|(known, _)| known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_columns_of_ones_own_and_the_temperature() {
        for (name, text) in [
            ("temperature_c", "21.5"),
            ("operator", "anna"),
            ("humidity_pct", "43"),
            ("lot", "2b"),
            ("temperature_room", "19"),
            ("date", "2026-03-01"),
            ("time", "10:32"),
            ("gripper_serial", "0017-3"),
        ] {
            assert_eq!(check_note(name, &note_of(text).unwrap()), Ok(()), "{name}");
        }
        for (name, text, words) in [
            ("dwel_s", "3", "did you mean `dwell_s`?"),
            ("dwell_ms", "300", "did you mean `dwell_s`?"),
            ("pause_min", "3", "did you mean `pause_s`?"),
            ("Temperature", "21", "did you mean `temperature_c`?"),
            ("temperature_k", "294", "did you mean `temperature_c`?"),
            ("gel", "2", "did you mean `gel_id`?"),
            ("time_s", "2", "the campaign or the rig says it"),
            ("max_pull_force_n", "2", "written by the rig itself"),
            ("lateral_n", "2", "written by the rig itself"),
            ("two words", "2", "cannot be the name of a column"),
            ("temperature_c", "warm", "it must be a number"),
            ("humidity_pct", "43,5", "write the number with a point"),
        ] {
            let e = check_note(name, &note_of(text).unwrap()).unwrap_err();
            assert!(e.contains(words), "{name}: {e}");
        }
        assert!(check_note("humidity_pct", &Drawn::Number(f64::NAN)).unwrap_err().contains("leave it out"));
        assert!(["", " ", "n/a", "NA", "-", "NaN", "null"].iter().all(|word| note_of(word).is_none()));
        assert_eq!(note_of(" 2e1 "), Some(Drawn::Number(20.0)));
        assert_eq!(note_of("inf").map(|note| check_note("x", &note).is_err()), Some(true));
    }
}
