//! The page of a comparison of pulls.

use super::PlotGroup;
use super::page::{NAME, ROWS, SENTENCE, clean, groups, rendered};
use serde_json::{Value, json};

/// Rows of a table, all parts and grip forces together.
const LONG: usize = 5 * ROWS;

/// A table of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct PageTable {
    /// Heading.
    pub title: String,
    /// A sentence below it.
    pub about: String,
    /// Names of the columns, the first for words.
    pub head: Vec<String>,
    /// Cells.
    pub rows: Vec<Vec<String>>,
}

/// One HTML page with its plots inside, which needs neither a network nor a script.
pub fn comparison_page(
    title: &str,
    sentence: &str,
    facts: &[(&str, String)],
    plots: &[PlotGroup],
    tables: &[PageTable],
) -> String {
    let fact =
        |(name, value): &(&str, String)| json!({"name": clean(name, NAME), "value": clean(value, NAME)});
    let cells = |row: &Vec<String>| row.iter().map(|cell| clean(cell, NAME)).collect::<Vec<_>>();
    let table = |table: &PageTable| {
        json!({
            "title": clean(&table.title, NAME), "about": clean(&table.about, SENTENCE), "head": cells(&table.head),
            "rows": table.rows.iter().take(LONG).map(cells).collect::<Vec<_>>(),
            "left_out": table.rows.len().saturating_sub(LONG),
        })
    };
    rendered(&json!({
        "title": clean(title, 2 * NAME),
        "sentence": clean(sentence, SENTENCE),
        "facts": facts.iter().map(fact).collect::<Vec<Value>>(),
        "groups": groups(plots),
        "tables": tables.iter().map(table).collect::<Vec<Value>>(),
    }))
}
