//! A report of predicted against real presses, as one HTML file.

use crate::page::{Page, Table};
use gripgen_record::encode_png;
use gripgen_twin::TactileImage;

/// How much larger than life differences are drawn.
const ENLARGED: i32 = 8;

/// How like two images are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Mean squared error.
    pub mse: f64,
    /// Peak signal-to-noise ratio.
    pub psnr_db: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// Mean absolute error.
    pub l1: f64,
}

/// Scores of a press, or their means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressScores {
    /// Of the whole frame.
    pub full: Score,
    /// Of 400 x 400 px around the contact.
    pub crop400: Score,
    /// Of 200 x 200 px.
    pub crop200: Score,
    /// Of 160 x 160 px.
    pub window: Score,
}

/// A press of the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressShown<'a> {
    /// Its name.
    pub name: &'a str,
    /// The real image.
    pub image: &'a TactileImage,
    /// Centre and radius of the contact in pixels, where it is known.
    pub circle_px: Option<[f64; 3]>,
    /// How like the predicted image is.
    pub scores: PressScores,
}

/// A picture of the frame: where something was pressed, or what is left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PressMap {
    /// The picture.
    pub image: TactileImage,
    /// Heading of its section.
    pub title: String,
    /// What it shows, in words.
    pub text: String,
    /// What stands under it.
    pub caption: String,
}

/// What a report of presses shows.
#[derive(Debug, Clone, PartialEq)]
pub struct PressPage<'a> {
    /// Title of the page.
    pub title: String,
    /// What was done, in a sentence or two.
    pub summary: String,
    /// What the error is an error of: held-out presses, say.
    pub meaning: String,
    /// Names and values of what was found.
    pub facts: Vec<(String, String)>,
    /// A map of the frame.
    pub map: Option<PressMap>,
    /// Means over all presses.
    pub mean: PressScores,
    /// The presses.
    pub presses: Vec<PressShown<'a>>,
}

/// The page: scores of all presses, pictures of five of them at most. `predict` draws the prediction that was scored.
pub fn press_page(shown: &PressPage<'_>, predict: impl Fn(usize) -> Option<TactileImage>) -> String {
    let presses = &shown.presses;
    let error = |i: usize| presses[i].scores.crop400.mse;
    let mut order: Vec<usize> = (0..presses.len()).collect();
    order.sort_by(|&a, &b| error(b).total_cmp(&error(a)));
    let mut page = Page::new(&shown.title);
    page.text(&shown.summary);
    page.facts(&shown.facts);
    page.section(
        "Error of the predicted images",
        &format!(
            "{} Means over {} presses; MSE and L1 in grey levels of 0 to 255. The whole frame is mostly gel at rest: look at the \
             crops around the contact first.",
            shown.meaning,
            presses.len()
        ),
    );
    page.table(&means(shown));
    if let Some(map) = &shown.map {
        page.section(&map.title, &map.text);
        page.figures(&[picture(&map.caption, &map.image)], &[], 0);
    }
    page.section("The worst, the middle and the best press", "");
    for (rank, i) in ranks(&order) {
        let Some(predicted) = predict(i) else { continue };
        let (press, mse) = (&presses[i], error(i));
        page.part(&format!("{}: MSE {mse:.1} in the 400 px crop ({rank})", press.name), "");
        let left = difference(press.image, &predicted);
        let figures = [
            picture("real", press.image),
            picture("predicted", &predicted),
            picture(&format!("real minus predicted, {ENLARGED} times enlarged, grey is none"), &left),
        ];
        page.figures(&figures, &[], 0);
    }
    page.section("Each press", "");
    page.table(&each(presses, order.first().copied()));
    page.html()
}

fn means(shown: &PressPage<'_>) -> Table {
    // A crop ends where the frame does.
    let (width, height) = shown.presses.first().map_or((0, 0), |p| (p.image.width_px, p.image.height_px));
    let around = |side: u32| format!("{} x {} px around the contact", side.min(width), side.min(height));
    let PressScores { full, crop400, crop200, window } = shown.mean;
    let rows =
        [("whole frame".into(), full), (around(400), crop400), (around(200), crop200), (around(160), window)];
    let row = |(name, s): (String, Score)| {
        let Score { mse, psnr_db, ssim, l1 } = s;
        vec![name, format!("{mse:.2}"), format!("{psnr_db:.2}"), format!("{ssim:.4}"), format!("{l1:.2}")]
    };
    Table::new(&["", "MSE", "PSNR, dB", "SSIM", "L1"], rows.map(row))
}

/// The scores of all presses; the worst one stands out.
fn each(presses: &[PressShown<'_>], worst: Option<usize>) -> Table {
    let most = worst.map_or(1.0, |i| presses[i].scores.crop400.mse).max(1e-9);
    let row = |press: &PressShown<'_>| {
        let PressScores { full, crop400, crop200, .. } = press.scores;
        vec![
            press.name.into(),
            press.circle_px.map_or("-".into(), |[x, y, r]| format!("({x:.0}, {y:.0}) r {r:.0}")),
            format!("{:.1}", full.mse),
            format!("{:.1}", crop400.mse),
            format!("{:.2}", crop400.psnr_db),
            format!("{:.4}", crop400.ssim),
            format!("{:.1}", crop200.mse),
        ]
    };
    let head = ["press", "contact, px", "MSE full", "MSE 400", "PSNR 400", "SSIM 400", "MSE 200"];
    Table {
        strong: worst.into_iter().collect(),
        bars: presses.iter().map(|press| press.scores.crop400.mse / most).collect(),
        ..Table::new(&head, presses.iter().map(row))
    }
}

/// The worst three, the middle one and the best, of presses from the worst to the best.
fn ranks(order: &[usize]) -> Vec<(&'static str, usize)> {
    let n = order.len();
    let wanted = [
        (0, "the worst"),
        (1, "second worst"),
        (2, "third worst"),
        (n / 2, "the median"),
        (n.saturating_sub(1), "the best"),
    ];
    let mut found: Vec<(&str, usize)> = Vec::new();
    for (place, rank) in wanted {
        let press = order.get(place).copied();
        if let Some(press) = press.filter(|press| found.iter().all(|(_, other)| other != press)) {
            found.push((rank, press));
        }
    }
    found
}

fn picture(caption: &str, image: &TactileImage) -> (String, Vec<u8>) {
    (caption.into(), encode_png(image).expect("an RGB image can be encoded"))
}

/// `128 + 8 (a - b)` per channel.
fn difference(a: &TactileImage, b: &TactileImage) -> TactileImage {
    let grey = |(&x, &y): (&u8, &u8)| (128 + ENLARGED * (i32::from(x) - i32::from(y))).clamp(0, 255) as u8;
    TactileImage { rgb: a.rgb.iter().zip(&b.rgb).map(grey).collect(), ..*a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_names_every_press_and_draws_the_worst() {
        let image = TactileImage { width_px: 16, height_px: 16, rgb: vec![100; 16 * 16 * 3] };
        let scores = |mse: f64| {
            let s = Score { mse, psnr_db: 40.0, ssim: 0.9, l1: 1.0 };
            PressScores { full: s, crop400: s, crop200: s, window: s }
        };
        let names = ["one", "two <b>", "three", "four", "five"].into_iter();
        let press = |(name, mse)| PressShown { name, image: &image, circle_px: None, scores: scores(mse) };
        let mut shown = PressPage {
            title: "Calibration".into(),
            summary: "36 presses".into(),
            meaning: "Held-out presses.".into(),
            facts: vec![("ball".into(), "4 mm".into())],
            map: None,
            mean: scores(4.0),
            presses: names.zip([3.0, 9.0, 1.0, 2.0, 5.0]).map(press).collect(),
        };
        let page = press_page(&shown, |_| Some(image.clone()));
        assert!(page.contains("two &lt;b&gt;: MSE 9.0 in the 400 px crop (the worst)"), "names are escaped");
        assert_eq!(page.matches("<img ").count(), 12, "worst three and best; the median is among them");
        assert!(page.contains("whole frame</td><td class=\"\">4.00</td>"));
        shown.map = Some(PressMap {
            image: image.clone(),
            title: "Where something was pressed".into(),
            text: "60 % of the frame".into(),
            caption: "at rest".into(),
        });
        let page = press_page(&shown, |_| None);
        assert!(page.contains("60 % of the frame") && page.matches("<img ").count() == 1, "the map");
    }
}
