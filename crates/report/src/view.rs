//! A run, measured pulls or a shard on one page: pictures, distributions, curves, and what is strange.

mod card;
mod chosen;
mod expected;
mod page;
mod rows;

use gripgen_record::{Dataset, DatasetError};

/// What the page shows.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewOptions {
    /// Its title.
    pub title: String,
    /// Pulls that are shown with their images and curves, at most.
    pub pulls: usize,
}

/// The page, and how much of the data it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewPage {
    /// HTML with everything inside; it needs no network.
    pub html: String,
    /// Pulls that are shown with their images and curves.
    pub shown: usize,
    /// Pulls that there are.
    pub pulls: usize,
}

/// Draws the page. Its size depends on the number of pulls that are shown, not on that of the data: distributions count
/// all pulls, a selection is counted among 10 000 of them.
///
/// # Errors
///
/// A pull that cannot be read.
pub fn view_page(dataset: &Dataset, options: &ViewOptions) -> Result<ViewPage, DatasetError> {
    let rows = rows::Rows::of(dataset.table());
    let expected = expected::expected(&rows);
    let chosen = chosen::chosen(&rows, &expected, options.pulls);
    let cards = chosen
        .iter()
        .map(|&row| card::card(dataset, &rows, expected.of_row(row), row))
        .collect::<Result<Vec<_>, _>>()?;
    let shown = cards.len();
    let html = page::page(dataset, &rows, &expected, &cards, options);
    Ok(ViewPage { html, shown, pulls: rows.len() })
}
