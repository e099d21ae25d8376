//! What may be the matter with a table that cannot be read, for its message.

use super::cell::Marks;
use super::lines::Lines;
use super::text::plain_name;
use gripgen_twin::config::suggestion;

/// What may be the matter with a header: a column whose name is nearly that of the one that is missing.
pub(super) fn near(column: &str, found: &str) -> String {
    let typed: Vec<&str> = found.split(", ").filter(|name| !name.is_empty()).collect();
    let stem = column.strip_suffix("_n");
    // `grip_force` for `grip_force_n`, and `grip_force_kgf`.
    let begins = |name: &&&str| {
        let plain = plain_name(name);
        stem.is_some_and(|stem| plain.starts_with(stem))
    };
    let near = typed.iter().find(begins).copied().or_else(|| suggestion(column, typed.iter().copied()));
    near.map_or(String::new(), |name| {
        let unit = if stem.is_some() { ", in newtons" } else { "" };
        format!(" (did you mean `{name}`? name it `{column}`{unit})")
    })
}

/// What may be the matter with a cell.
pub(super) fn of_cell(cell: &str) -> String {
    if Marks::Unclear.canonical(cell).is_none() {
        let [decimal, thousands] = [cell.replacen(',', ".", 1), cell.replace(',', "")];
        return format!(" (`{cell}` may be {thousands} or {decimal}: write one of them)");
    }
    if Marks::DecimalCommas.canonical(cell).is_none() {
        let thousands = cell.replace('.', "");
        return format!(
            " (in a table with decimal commas `{cell}` may be {thousands} or {cell}: write {thousands}, or {})",
            cell.replace('.', ",")
        );
    }
    if is_clock(cell) {
        return format!(
            " (`{cell}` is a clock time, write seconds from the start as a number, 0, 45.5, 91, or all of them as 2026-05-01 09:15:30)"
        );
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
    let line = Lines::new(bytes, 0).at(at);
    Some((format!("line {line} holds the byte 0x{:02x}, which is no UTF-8", bytes[at]), SAVE))
}
