//! What a plot shows; `svg.rs` draws it.

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A dot each, with a bar where an error is given.
    Points,
    /// Joined by a line.
    Line,
    /// The outline of an area, which is filled.
    Band,
}

/// Points of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// (x, y) of each point.
    pub points: Vec<(f64, f64)>,
    /// Half lengths of error bars, or empty.
    pub errors: Vec<f64>,
}

impl Series {
    /// A series without error bars.
    pub fn new(name: impl Into<String>, mark: Mark, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), mark, points: points.into_iter().collect(), errors: Vec::new() }
    }

    /// Dots.
    pub fn points(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(name, Mark::Points, points)
    }

    /// A line.
    pub fn line(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(name, Mark::Line, points)
    }
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// Label of the x axis, with its unit.
    pub x_label: String,
    /// Label of the y axis, with its unit.
    pub y_label: String,
    /// Words in place of the numbers 0, 1, 2... of the x axis, for covariates that are words.
    pub x_words: Vec<String>,
    /// What is drawn.
    pub series: Vec<Series>,
}

impl Plot {
    /// A plot over numbers.
    pub fn new(
        title: impl Into<String>,
        x_label: impl Into<String>,
        y_label: impl Into<String>,
        series: Vec<Series>,
    ) -> Self {
        let (title, x_label, y_label) = (title.into(), x_label.into(), y_label.into());
        Self { title, x_label, y_label, x_words: Vec::new(), series }
    }
}

/// Plots that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotGroup {
    /// Heading.
    pub title: String,
    /// A sentence below it.
    pub about: String,
    /// The plots.
    pub plots: Vec<Plot>,
}
