//! A page of sections, each with pictures, plots and tables.

use super::page::{NAME, SENTENCE, clean, figure, rendered};
use super::{PageTable, Plot};
use base64::Engine;
use serde_json::{Value, json};

/// Points of a line.
const POINTS: usize = 400;

/// A picture of the page.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PageFigure {
    /// What it shows.
    pub(crate) caption: String,
    /// The picture, PNG.
    pub(crate) png: Vec<u8>,
}

/// What belongs together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PageSection {
    /// Heading.
    pub(crate) title: String,
    /// A sentence below it.
    pub(crate) about: String,
    /// Pictures.
    pub(crate) figures: Vec<PageFigure>,
    /// Plots beside them.
    pub(crate) plots: Vec<Plot>,
    /// Tables below.
    pub(crate) tables: Vec<PageTable>,
}

/// One HTML page with its pictures inside, which needs neither a network nor a script.
pub(crate) fn sections_page(
    title: &str,
    sentence: &str,
    facts: &[(&str, String)],
    sections: &[PageSection],
) -> String {
    let fact =
        |(name, value): &(&str, String)| json!({"name": clean(name, NAME), "value": clean(value, SENTENCE)});
    let cells = |row: &Vec<String>| row.iter().map(|cell| clean(cell, SENTENCE)).collect::<Vec<_>>();
    let table = |table: &PageTable| {
        json!({
            "title": clean(&table.title, NAME), "about": clean(&table.about, SENTENCE), "head": cells(&table.head),
            "rows": table.rows.iter().map(cells).collect::<Vec<_>>(),
        })
    };
    let section = |section: &PageSection| {
        json!({
            "title": clean(&section.title, NAME),
            "about": clean(&section.about, SENTENCE),
            "figures": section.figures.iter().map(|f| json!({
                "caption": clean(&f.caption, SENTENCE), "url": png_url(&f.png),
            })).collect::<Vec<Value>>(),
            "plots": section.plots.iter().map(|plot| figure(plot, POINTS)).collect::<Vec<Value>>(),
            "tables": section.tables.iter().map(table).collect::<Vec<Value>>(),
        })
    };
    rendered(&json!({
        "title": clean(title, 2 * NAME),
        "sentence": clean(sentence, SENTENCE),
        "facts": facts.iter().map(fact).collect::<Vec<Value>>(),
        "sections": sections.iter().map(section).collect::<Vec<Value>>(),
    }))
}

/// A picture as it stands in a page.
pub(crate) fn png_url(png: &[u8]) -> String {
    data_url("png", png)
}

/// The same of a JPEG.
pub(crate) fn jpeg_url(jpeg: &[u8]) -> String {
    data_url("jpeg", jpeg)
}

fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}
