//! What `gripgen compare` says of the images of pulls.

use crate::ImageComparison;
use gripgen::tactile::metrics::Score;
use serde_json::{Map, Value, json};

/// The scores as they stand in `--json`; `None` where no pull has images.
pub fn images_json(found: &ImageComparison) -> Option<Value> {
    let mut images = score_json(&found.mean()?);
    images["n"] = json!(found.each.len());
    let part = |(name, (n, score)): (String, (usize, Score))| {
        let mut own = score_json(&score);
        own["n"] = json!(n);
        (name, own)
    };
    images["by_part"] = found.by_part().into_iter().map(part).collect::<Map<_, _>>().into();
    let each = found.each.iter().map(|image| {
        let mut own = score_json(&image.score);
        own["pull"] = json!(image.pull);
        own["jaw"] = json!(image.jaw.to_string());
        own
    });
    images["each"] = each.collect::<Vec<_>>().into();
    Some(images)
}

fn score_json(score: &Score) -> Value {
    // Equal images have an infinite ratio, which JSON cannot hold: null.
    json!({"mse": score.mse, "psnr": score.psnr_db, "ssim": score.ssim, "l1": score.l1})
}

/// The mean scores for people, and the image that is least like the twin's; nothing where no pull has images.
pub fn images_table(found: &ImageComparison) -> String {
    let Some(mean) = found.mean() else { return String::new() };
    let mut text =
        format!("{:<16} {:>6} {:>9} {:>7} {:>8} {:>7}\n", "part", "images", "MSE", "PSNR dB", "SSIM", "L1");
    let mut row = |name: &str, n: usize, s: &Score| {
        text +=
            &format!("{name:<16} {n:>6} {:>9.2} {:>7.2} {:>8.4} {:>7.2}\n", s.mse, s.psnr_db, s.ssim, s.l1);
    };
    found.by_part().iter().for_each(|(name, (n, score))| row(name, *n, score));
    row("all", found.each.len(), &mean);
    if let Some(worst) = found.each.iter().max_by(|a, b| a.score.mse.total_cmp(&b.score.mse)) {
        text += &format!("least alike: pull {}, {} jaw, MSE {:.2}\n", worst.pull, worst.jaw, worst.score.mse);
    }
    text
}
