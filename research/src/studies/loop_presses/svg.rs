//! A small plot as SVG.

use gripgen_report::Plot;
use std::fmt::Write;

const COLOURS: [&str; 2] = ["#c0504d", "#4f81bd"];

/// Dots of each series over a frame with ticks at the ends.
pub fn plot(plot: &Plot) -> String {
    let (w, h, left, bottom) = (460.0, 260.0, 60.0, 45.0);
    let points = || plot.series.iter().flat_map(|s| &s.points);
    let x = points().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    let top = points().fold(0.0f64, |m, p| m.max(p.1)) * 1.05;
    let px = |v: f64| left + 15.0 + (v - x.0) / (x.1 - x.0).max(1e-9) * (w - left - 40.0);
    let py = |v: f64| h - bottom - v / top.max(1e-9) * (h - bottom - 30.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>"
    );
    let _ = write!(
        svg,
        "<path d=\"M{left} 25V{b}H{r}\" fill=\"none\" stroke=\"#444\"/><text x=\"{left}\" y=\"15\">{}</text><text x=\"{m}\" y=\"{e}\" text-anchor=\"middle\">{}</text>",
        plot.y_label,
        plot.x_label,
        b = h - bottom,
        r = w - 10.0,
        m = w / 2.0,
        e = h - 8.0
    );
    for k in 0..=4 {
        let v = top * f64::from(k) / 4.0;
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{v:.0}</text>",
            left - 5.0,
            py(v) + 4.0
        );
    }
    let words: Vec<(f64, String)> = if plot.x_words.is_empty() {
        [x.0, (x.0 + x.1) / 2.0, x.1].iter().map(|v| (*v, format!("{v:.0}"))).collect()
    } else {
        plot.x_words.iter().enumerate().map(|(i, w)| (i as f64, w.clone())).collect()
    };
    for (v, word) in words {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{word}</text>",
            px(v),
            h - bottom + 15.0
        );
    }
    for (k, (series, colour)) in plot.series.iter().zip(COLOURS).enumerate() {
        for p in &series.points {
            let _ = write!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{colour}\"/>",
                px(p.0),
                py(p.1)
            );
        }
        // Above the frame, where no dot can be.
        let at = w - 100.0 + 50.0 * k as f64;
        let _ = write!(svg, "<text x=\"{at}\" y=\"15\" fill=\"{colour}\">{}</text>", series.name);
    }
    svg + "</svg>\n"
}
