//! A page is a list of blocks: headings, facts, plots, pictures, tables. The template draws them in their order.

use crate::svg::{SERIES, class, draw};
use crate::text::{NAME, SENTENCE, clean, data_url, is_forbidden};
use crate::{Plot, PlotGroup};
use serde_json::{Value, json};

/// Points of all plots of a page together; one takes about 12 bytes.
const ALL_POINTS: usize = 16_000;
/// Points of a series.
const SERIES_POINTS: usize = 800;
/// Plots of a page.
pub(crate) const PLOTS: usize = 60;
/// Rows of a table.
const ROWS: usize = 200;
/// Letters of a paragraph: a list of names may be longer than a sentence.
const PARAGRAPH: usize = 5 * SENTENCE;
/// Letters of a command: one that is cut off cannot be copied.
const COMMAND: usize = 8000;
/// Letters of a cell that stay in one line.
const ONE_LINE: usize = 40;

const TEMPLATES: [(&str, &str); 4] = [
    ("page.css", include_str!("../templates/page.css")),
    ("page.html", include_str!("../templates/page.html")),
    ("view.html", include_str!("../templates/view.html")),
    ("live.html", include_str!("../templates/live.html")),
];

/// A table.
#[derive(Debug, Clone, Default)]
pub(crate) struct Table {
    /// Names of the columns.
    pub(crate) head: Vec<String>,
    /// Columns of words besides the first, which is always one.
    pub(crate) words: Vec<usize>,
    /// Cells.
    pub(crate) rows: Vec<Vec<String>>,
    /// Rows that stand out.
    pub(crate) strong: Vec<usize>,
    /// Lengths of bars behind the rows, 0 to 1; or empty.
    pub(crate) bars: Vec<f64>,
}

impl Table {
    /// A table of numbers, whose first column holds words.
    pub(crate) fn new(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let head = head.iter().map(|name| name.to_string()).collect();
        Self { head, rows: rows.into_iter().collect(), ..Self::default() }
    }

    fn block(&self) -> Value {
        let left = |column: usize| column == 0 || self.words.contains(&column);
        let cell = |(column, text): (usize, &String)| {
            let class = match left(column) {
                _ if text.chars().count() > ONE_LINE => "l words",
                true => "l",
                false => "",
            };
            json!({"text": clean(text, SENTENCE), "class": class})
        };
        let row = |(i, cells): (usize, &Vec<String>)| {
            json!({
                "cells": cells.iter().enumerate().map(cell).collect::<Vec<_>>(),
                "strong": self.strong.contains(&i),
                "bar": self.bars.get(i).map(|share| format!("{:.2}", 12.0 * share)),
            })
        };
        json!({
            "kind": "table",
            "head": self.head.iter().enumerate().map(cell).collect::<Vec<_>>(),
            "rows": self.rows.iter().take(ROWS).enumerate().map(row).collect::<Vec<_>>(),
            "left_out": self.rows.len().saturating_sub(ROWS),
        })
    }
}

/// A page in the making.
pub(crate) struct Page {
    title: String,
    blocks: Vec<Value>,
}

impl Page {
    pub(crate) fn new(title: &str) -> Self {
        Self { title: clean(title, 2 * NAME), blocks: Vec::new() }
    }

    /// A paragraph; nothing of an empty text.
    pub(crate) fn text(&mut self, text: &str) {
        self.words("text", text);
    }

    /// A paragraph in small grey letters.
    pub(crate) fn note(&mut self, text: &str) {
        self.words("note", text);
    }

    fn words(&mut self, kind: &str, text: &str) {
        if !text.is_empty() {
            self.blocks.push(json!({"kind": kind, "text": clean(text, PARAGRAPH)}));
        }
    }

    /// A sentence that stands out, with a word above it.
    pub(crate) fn verdict(&mut self, class: &str, word: &str, text: &str) {
        let text = clean(text, SENTENCE);
        self.blocks.push(json!({"kind": "verdict", "class": class, "word": word, "text": text}));
    }

    /// A command to copy.
    pub(crate) fn command(&mut self, command: &str) {
        self.blocks.push(json!({"kind": "command", "text": clean(command, COMMAND)}));
    }

    /// Names with their values.
    pub(crate) fn facts<N: AsRef<str>>(&mut self, facts: &[(N, String)]) {
        let fact = |(name, value): &(N, String)| [clean(name.as_ref(), NAME), clean(value, SENTENCE)];
        self.blocks.push(json!({"kind": "facts", "facts": facts.iter().map(fact).collect::<Vec<_>>()}));
    }

    /// A heading with a sentence below it.
    pub(crate) fn section(&mut self, title: &str, about: &str) {
        self.blocks.push(json!({"kind": "section", "title": clean(title, NAME)}));
        self.note(about);
    }

    /// A heading inside a section.
    pub(crate) fn part(&mut self, title: &str, about: &str) {
        self.blocks.push(json!({"kind": "part", "title": clean(title, 2 * NAME)}));
        self.note(about);
    }

    pub(crate) fn table(&mut self, table: &Table) {
        self.blocks.push(table.block());
    }

    pub(crate) fn list(&mut self, items: &[String]) {
        let items: Vec<String> = items.iter().map(|item| clean(item, SENTENCE)).collect();
        self.blocks.push(json!({"kind": "list", "items": items}));
    }

    /// A drawing of ours.
    pub(crate) fn drawing(&mut self, svg: &str) {
        self.blocks.push(json!({"kind": "drawing", "svg": svg}));
    }

    /// Cards side by side, as the template wants them.
    pub(crate) fn cards(&mut self, cards: &[Value]) {
        self.blocks.push(json!({"kind": "cards", "cards": cards}));
    }

    /// Pictures (caption and PNG) and plots side by side; of a series at most `most` points.
    pub(crate) fn figures(&mut self, pictures: &[(String, Vec<u8>)], plots: &[Plot], most: usize) {
        let pictures = pictures
            .iter()
            .map(|(caption, png)| json!({"title": clean(caption, SENTENCE), "url": data_url("png", png)}));
        let figures: Vec<Value> = pictures.chain(plots.iter().map(|plot| figure(plot, most))).collect();
        self.blocks.push(json!({"kind": "figures", "figures": figures}));
    }

    /// A section for each group of plots that has any. With more plots than a page holds the last ones are left out.
    pub(crate) fn groups(&mut self, groups: &[PlotGroup], budget: &mut PlotBudget) {
        for group in groups {
            let shown = group.plots.len().min(budget.plots);
            budget.plots -= shown;
            if shown > 0 {
                self.section(&group.title, &group.about);
                self.figures(&[], &group.plots[..shown], budget.points);
            }
        }
    }

    /// The page as HTML.
    pub(crate) fn html(&self) -> String {
        self.html_with("page.html", json!({}))
    }

    /// The same through a template that adds to it.
    pub(crate) fn html_with(&self, template: &str, mut more: Value) -> String {
        more["title"] = json!(self.title);
        more["blocks"] = json!(self.blocks);
        let mut environment = minijinja::Environment::new();
        for (name, text) in TEMPLATES {
            environment.add_template(name, text).expect("a template of ours parses");
        }
        let template = environment.get_template(template).expect("it was just added");
        let mut page = template.render(&more).expect("the template asks for nothing that the page lacks");
        // Names and words of the data may hold characters that no page may.
        page.retain(|c| matches!(c, '\n' | '\t') || !is_forbidden(c));
        page
    }
}

/// The room for plots that a page still has: its size is bounded.
pub(crate) struct PlotBudget {
    plots: usize,
    points: usize,
}

impl PlotBudget {
    /// Shares the points of a page among all series of these groups.
    pub(crate) fn of(groups: &[PlotGroup]) -> Self {
        let plots = groups.iter().flat_map(|group| &group.plots);
        let series: usize = plots.map(|plot| plot.series.len().min(SERIES)).sum();
        Self { plots: PLOTS, points: (ALL_POINTS / series.max(1)).clamp(8, SERIES_POINTS) }
    }
}

fn figure(plot: &Plot, most: usize) -> Value {
    let series = &plot.series[..plot.series.len().min(SERIES)];
    let entry = |i: usize| json!({"name": clean(&series[i].name, 30), "class": class(series, i)});
    let legend: Vec<Value> = if series.len() > 1 { (0..series.len()).map(entry).collect() } else { vec![] };
    json!({"title": clean(&plot.title, NAME), "svg": draw(plot, most), "legend": legend})
}

/// The page of `--live`. It asks the address that it came from for `/state` (`gripgen.live/1`), `/left.png` and
/// `/right.png`, and nothing else; the command line serves it.
pub fn live_page() -> String {
    Page::new("gripgen").html_with("live.html", json!({}))
}
