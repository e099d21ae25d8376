//! A report of predicted against real presses, as one HTML file.

use crate::report::{png_url, rendered_with};
use gripgen_record::encode_png;
use gripgen_tactile::metrics::Score;
use gripgen_tactile::presses::{PressComparison, PressSet};
use gripgen_twin::TactileImage;
use serde_json::{Value, json};

/// How much larger than life differences are drawn.
const ENLARGED: i32 = 8;

/// Longest bar of the table, in rem.
const LONGEST_BAR: f64 = 12.0;

/// What a report says besides scores and pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PressReportText {
    /// Title of the page.
    pub title: String,
    /// What was done, in a sentence or two.
    pub summary: String,
    /// What the error is an error of: held-out presses, say.
    pub meaning: String,
    /// Names and values of what was found.
    pub facts: Vec<(String, String)>,
    /// Where in the frame something was pressed.
    pub map: Option<PressMap>,
}

/// A picture of the frame that shows where something was pressed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PressMap {
    /// The picture.
    pub image: TactileImage,
    /// What it shows, in words.
    pub text: String,
}

/// The page: scores of all presses, pictures of three of them. `predict` draws the prediction that was scored.
pub fn press_report(
    text: &PressReportText,
    set: &PressSet,
    comparison: &PressComparison,
    predict: impl Fn(usize) -> Option<TactileImage>,
) -> String {
    let mut order: Vec<usize> = (0..comparison.each.len()).collect();
    let error = |i: usize| comparison.each[i].scores.crop400.mse;
    order.sort_by(|&a, &b| error(b).total_cmp(&error(a)));
    // A crop ends where the frame does.
    let (width, height) = set.presses.first().map_or((0, 0), |p| (p.image.width_px, p.image.height_px));
    let around = |side: u32| format!("{} x {} px around the contact", side.min(width), side.min(height));
    let page = json!({
        "title": text.title,
        "summary": text.summary,
        "meaning": text.meaning,
        "facts": text.facts.iter().map(|(name, value)| json!({"name": name, "value": value})).collect::<Vec<_>>(),
        "map": text.map.as_ref().map(|map| json!({"image": data_url(&map.image), "text": map.text})),
        "means": [
            mean_row("whole frame", &comparison.mean.full),
            mean_row(&around(400), &comparison.mean.crop400),
            mean_row(&around(200), &comparison.mean.crop200),
            mean_row(&around(160), &comparison.mean.window),
        ],
        "pictures": pictures(set, comparison, &order, predict),
        "presses": press_rows(set, comparison, &order),
    });
    rendered_with("presses.html", &page)
}

fn mean_row(name: &str, score: &Score) -> Value {
    json!({
        "name": name,
        "mse": format!("{:.2}", score.mse),
        "psnr": format!("{:.2}", score.psnr_db),
        "ssim": format!("{:.4}", score.ssim),
        "l1": format!("{:.2}", score.l1),
    })
}

fn press_rows(set: &PressSet, comparison: &PressComparison, order: &[usize]) -> Vec<Value> {
    let worst = order.first().map_or(1.0, |&i| comparison.each[i].scores.crop400.mse).max(1e-9);
    comparison
        .each
        .iter()
        .enumerate()
        .map(|(i, press)| {
            let circle = set.presses[i]
                .circle
                .map_or("-".into(), |c| format!("({:.0}, {:.0}) r {:.0}", c.x_px, c.y_px, c.radius_px));
            let s = &press.scores;
            json!({
                "name": press.name,
                "circle": circle,
                "worst": order.first() == Some(&i),
                "full": format!("{:.1}", s.full.mse),
                "crop400": format!("{:.1}", s.crop400.mse),
                "psnr": format!("{:.2}", s.crop400.psnr_db),
                "ssim": format!("{:.4}", s.crop400.ssim),
                "crop200": format!("{:.1}", s.crop200.mse),
                "bar": format!("{:.2}", LONGEST_BAR * s.crop400.mse / worst),
            })
        })
        .collect()
}

/// The worst three, the middle one and the best.
fn pictures(
    set: &PressSet,
    comparison: &PressComparison,
    order: &[usize],
    predict: impl Fn(usize) -> Option<TactileImage>,
) -> Vec<Value> {
    let n = order.len();
    let last = n.saturating_sub(1);
    let wanted = [
        (0, "the worst"),
        (1, "second worst"),
        (2, "third worst"),
        (n / 2, "the median"),
        (last, "the best"),
    ];
    let mut ranks: Vec<(usize, &str)> = Vec::new();
    for (rank, name) in wanted {
        if rank < n && ranks.iter().all(|&(r, _)| r != rank) {
            ranks.push((rank, name));
        }
    }
    ranks
        .into_iter()
        .filter_map(|(rank, name)| {
            let i = order[rank];
            let (real, predicted) = (&set.presses[i].image, predict(i)?);
            Some(json!({
                "name": set.presses[i].name,
                "rank": name,
                "mse": format!("{:.1}", comparison.each[i].scores.crop400.mse),
                "real": data_url(real),
                "predicted": data_url(&predicted),
                "difference": data_url(&difference(real, &predicted)),
            }))
        })
        .collect()
}

/// `128 + 8 (a - b)` per channel.
fn difference(a: &TactileImage, b: &TactileImage) -> TactileImage {
    let grey = |(&x, &y): (&u8, &u8)| (128 + ENLARGED * (i32::from(x) - i32::from(y))).clamp(0, 255) as u8;
    TactileImage { rgb: a.rgb.iter().zip(&b.rgb).map(grey).collect(), ..*a }
}

fn data_url(image: &TactileImage) -> String {
    png_url(&encode_png(image).expect("an RGB image can be encoded"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_tactile::presses::{Press, PressScore, Scores};

    #[test]
    fn a_page_names_every_press_and_draws_the_worst() {
        let image = TactileImage { width_px: 16, height_px: 16, rgb: vec![100; 16 * 16 * 3] };
        let press = |name: &str| Press::of_ball(name, image.clone(), None);
        let names = ["one", "two <b>", "three", "four", "five"];
        let presses = names.map(press).to_vec();
        let set = PressSet { metres_per_px: 1e-4, ball_m: 4e-3, rest: None, presses };
        let score = |mse: f64| Score { mse, psnr_db: 40.0, ssim: 0.9, l1: 1.0 };
        let each = names
            .iter()
            .zip([3.0, 9.0, 1.0, 2.0, 5.0])
            .map(|(name, mse)| PressScore {
                name: (*name).into(),
                shape: "ball".into(),
                scores: Scores {
                    full: score(mse),
                    crop400: score(mse),
                    crop200: score(mse),
                    window: score(mse),
                },
                zones: vec![],
            })
            .collect();
        let comparison = PressComparison::from_each(each).unwrap();
        let text = PressReportText {
            title: "Calibration".into(),
            summary: "36 presses".into(),
            meaning: "Held-out presses.".into(),
            facts: vec![("ball".into(), "4 mm".into())],
            map: None,
        };
        let mapped = PressReportText {
            map: Some(PressMap { image: image.clone(), text: "60 % of the frame".into() }),
            ..text.clone()
        };
        let page = press_report(&mapped, &set, &comparison, |_| None);
        assert!(page.contains("60 % of the frame") && page.matches("<img ").count() == 1, "the map");
        let page = press_report(&text, &set, &comparison, |_| Some(image.clone()));
        assert!(page.contains("two &lt;b&gt;: MSE 9.0 in the 400 px crop (the worst)"), "names are escaped");
        assert_eq!(page.matches("<img ").count(), 12, "worst three and best; the median is among them");
        assert!(page.contains("<td>whole frame</td><td>4.00</td>"));
    }
}
