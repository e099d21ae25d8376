//! What may be the matter with a table that cannot be read, for its message.

use super::lines::Lines;
use super::number;

/// What may be the matter with a header.
pub(super) fn one_cell(found: &str) -> &'static str {
    if found.contains(", ") {
        ""
    } else if found.contains(';') {
        " (the header is one cell with `;` in it: save it with commas)"
    } else if found.contains('\t') {
        " (the header is one cell with tabs in it: save it with commas)"
    } else {
        ""
    }
}

/// What may be the matter with a cell.
pub(super) fn of_cell(cell: &str) -> String {
    let with_point = cell.replacen(',', ".", 1);
    if cell.contains(',') && number(&with_point).is_some() {
        return format!(" (`{cell}` has a decimal comma, write {with_point})");
    }
    if is_clock(cell) {
        return format!(" (`{cell}` is a clock time, write seconds from the start as a number: 0, 45.5, 91)");
    }
    String::new()
}

/// Whether a cell is a time of day, a date, or both.
fn is_clock(cell: &str) -> bool {
    let count = |of: &[char]| cell.chars().filter(|c| of.contains(c)).count();
    let written = |c: char| c.is_ascii_digit() || ":-/.+ TZAPMapm".contains(c);
    let digits = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let parts = count(&[':']) >= 1 || count(&['-', '/']) == 2;
    parts && digits(cell.chars().next()) && cell.chars().all(written)
}

/// What is the matter with a file whose text cannot be read: with the place, and the way out in brackets.
pub(super) fn encoding(bytes: &[u8]) -> Option<(String, &'static str)> {
    const SAVE: &str = " (save the table as UTF-8; spreadsheets call it \"CSV UTF-8\")";
    if matches!(bytes, [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [0, _, ..] | [_, 0, ..]) {
        return Some(("the file is UTF-16".into(), SAVE));
    }
    let at = std::str::from_utf8(bytes).err()?.valid_up_to();
    let line = Lines::new(bytes).at(at);
    Some((format!("line {line} holds the byte 0x{:02x}, which is no UTF-8", bytes[at]), SAVE))
}
