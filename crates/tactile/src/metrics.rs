//! Differences between 8-bit images.

use gripgen_twin::TactileImage;

/// Two images that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// They differ in size.
    #[error("images differ in size: {}x{} against {}x{} pixels", .first.0, .first.1, .second.0, .second.1)]
    Size {
        /// Width and height of the first image.
        first: (u32, u32),
        /// Width and height of the second image.
        second: (u32, u32),
    },
    /// They are smaller than the window of the structural similarity.
    #[error("an image of {}x{} pixels is smaller than the window of {window_px} pixels", .size.0, .size.1)]
    Window {
        /// Width and height of the images.
        size: (u32, u32),
        /// Side of the window.
        window_px: u32,
    },
}

/// How two images differ. All over all pixels and channels, in grey levels from 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Mean squared difference.
    pub mse: f64,
    /// Peak signal-to-noise ratio, decibels; infinite for equal images.
    pub psnr_db: f64,
    /// Structural similarity (Wang et al. 2004, eq. 13), mean over channels and over all windows that lie inside; 1 for equal
    /// images. Windows of 7 x 7 pixels of equal weight, sample covariance, `K1 = 0.01`, `K2 = 0.03`, range 255: the defaults of
    /// scikit-image, with which it agrees (`channel_axis = 2`). Sums are whole numbers, so they are exact.
    pub ssim: f64,
    /// Mean absolute difference.
    pub l1: f64,
}

/// The mean of each number over the scores of several pairs of images; zeros without any.
pub fn mean_score(scores: &[Score]) -> Score {
    let n = scores.len().max(1) as f64;
    let mean = |value: fn(&Score) -> f64| scores.iter().map(value).sum::<f64>() / n;
    Score { mse: mean(|s| s.mse), psnr_db: mean(|s| s.psnr_db), ssim: mean(|s| s.ssim), l1: mean(|s| s.l1) }
}

/// All differences between two images.
///
/// # Errors
///
/// Images of two sizes, or smaller than the window of the structural similarity.
pub fn score(a: &TactileImage, b: &TactileImage) -> Result<Score, MetricError> {
    let everywhere = score_where(a, b, |_| true)?;
    Ok(everywhere.map_or_else(|| mean_score(&[]), |(_, score)| score))
}

/// Mean squared difference over all channels, in squared grey levels.
///
/// # Errors
///
/// Images of two sizes.
pub fn mean_squared_error(a: &TactileImage, b: &TactileImage) -> Result<f64, MetricError> {
    same_size(a, b)?;
    let sum: u64 = a.rgb.iter().zip(&b.rgb).map(|(&x, &y)| u64::from(x.abs_diff(y)).pow(2)).sum();
    Ok(sum as f64 / a.rgb.len() as f64)
}

/// Peak signal-to-noise ratio in decibels for 8-bit images: `10 log10(255^2 / MSE)`, infinite for MSE 0.
///
/// ```
/// // Wucherer et al. 2023 print both numbers for one pair of images.
/// assert!((gripgen_tactile::metrics::psnr_db(262.95) - 23.93).abs() < 0.006);
/// ```
pub fn psnr_db(mean_squared_error: f64) -> f64 {
    10.0 * libm::log10(255.0 * 255.0 / mean_squared_error)
}

/// Side of the window of the structural similarity.
const WINDOW_PX: usize = 7;

/// All differences between two images at the pixels that are `inside` (of their number, row by row), with how many there are;
/// `None` without any. The similarity is that of the windows around them, those at the border of the frame have none.
///
/// # Errors
///
/// Images of two sizes, or smaller than the window of the structural similarity.
pub fn score_where(
    a: &TactileImage,
    b: &TactileImage,
    inside: impl Fn(usize) -> bool,
) -> Result<Option<(usize, Score)>, MetricError> {
    let (mut similarity, mut windows) = (0.0, 0usize);
    each_window(a, b, |pixel, value| {
        if inside(pixel) {
            similarity += value;
            windows += 1;
        }
    })?;
    let (mut squares, mut sizes, mut count) = (0u64, 0u64, 0usize);
    for (pixel, (x, y)) in a.rgb.chunks_exact(3).zip(b.rgb.chunks_exact(3)).enumerate() {
        if inside(pixel) {
            count += 1;
            for (x, y) in x.iter().zip(y) {
                let difference = u64::from(x.abs_diff(*y));
                squares += difference * difference;
                sizes += difference;
            }
        }
    }
    if count == 0 {
        return Ok(None);
    }
    let mean = |sum: u64| sum as f64 / (3 * count) as f64;
    let mse = mean(squares);
    let ssim = similarity / windows.max(1) as f64;
    Ok(Some((count, Score { mse, psnr_db: psnr_db(mse), ssim, l1: mean(sizes) })))
}

/// Visits every window of every channel: the pixel in its middle, and the similarity.
fn each_window(
    a: &TactileImage,
    b: &TactileImage,
    mut visit: impl FnMut(usize, f64),
) -> Result<(), MetricError> {
    same_size(a, b)?;
    let (w, h) = (a.width_px as usize, a.height_px as usize);
    if w < WINDOW_PX || h < WINDOW_PX {
        return Err(MetricError::Window { size: (a.width_px, a.height_px), window_px: WINDOW_PX as u32 });
    }
    for c in 0..3 {
        // Column sums over the rows of the window, moved down row by row.
        let mut columns = vec![Sums::default(); w];
        for y in 0..h {
            for x in 0..w {
                let at = |row: usize| 3 * (row * w + x) + c;
                columns[x].add(a.rgb[at(y)], b.rgb[at(y)]);
                if y >= WINDOW_PX {
                    columns[x].remove(a.rgb[at(y - WINDOW_PX)], b.rgb[at(y - WINDOW_PX)]);
                }
            }
            if y + 1 >= WINDOW_PX {
                let middle = (y - WINDOW_PX / 2) * w;
                row_of_windows(&columns, |x, similarity| visit(middle + x, similarity));
            }
        }
    }
    Ok(())
}

/// The windows of one row: the column of the middle, and the similarity.
fn row_of_windows(columns: &[Sums], mut visit: impl FnMut(usize, f64)) {
    let mut window = Sums::default();
    for (x, column) in columns.iter().enumerate() {
        window.join(column);
        if x >= WINDOW_PX {
            window.part(&columns[x - WINDOW_PX]);
        }
        if x + 1 >= WINDOW_PX {
            visit(x - WINDOW_PX / 2, window.similarity());
        }
    }
}

/// Sums over a window: `a, b, a^2, b^2, a b`.
#[derive(Debug, Clone, Copy, Default)]
struct Sums([i64; 5]);

impl Sums {
    fn products(a: u8, b: u8) -> [i64; 5] {
        let (a, b) = (i64::from(a), i64::from(b));
        [a, b, a * a, b * b, a * b]
    }

    fn add(&mut self, a: u8, b: u8) {
        self.join(&Sums(Self::products(a, b)));
    }

    fn remove(&mut self, a: u8, b: u8) {
        self.part(&Sums(Self::products(a, b)));
    }

    fn join(&mut self, other: &Sums) {
        self.0.iter_mut().zip(other.0).for_each(|(s, o)| *s += o);
    }

    fn part(&mut self, other: &Sums) {
        self.0.iter_mut().zip(other.0).for_each(|(s, o)| *s -= o);
    }

    fn similarity(&self) -> f64 {
        let n = (WINDOW_PX * WINDOW_PX) as f64;
        let [a, b, aa, bb, ab] = self.0.map(|s| s as f64 / n);
        let sample = n / (n - 1.0);
        let (variance_a, variance_b) = (sample * (aa - a * a), sample * (bb - b * b));
        let covariance = sample * (ab - a * b);
        let square = |x: f64| x * x;
        let (c1, c2) = (square(0.01 * 255.0), square(0.03 * 255.0));
        (2.0 * a * b + c1) * (2.0 * covariance + c2) / ((a * a + b * b + c1) * (variance_a + variance_b + c2))
    }
}

fn same_size(a: &TactileImage, b: &TactileImage) -> Result<(), MetricError> {
    let (first, second) = ((a.width_px, a.height_px), (b.width_px, b.height_px));
    if first == second { Ok(()) } else { Err(MetricError::Size { first, second }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width_px: u32, height_px: u32, value: impl Fn(u32) -> u32) -> TactileImage {
        let rgb = (0..3 * width_px * height_px).map(|i| value(i) as u8).collect();
        TactileImage { width_px, height_px, rgb }
    }

    /// Numbers of scikit-image 0.26: `structural_similarity(a, b, channel_axis=2, data_range=255)`.
    #[test]
    fn similarity_is_that_of_scikit_image() {
        let a = image(40, 30, |i| i * 37 % 251);
        let b = image(40, 30, |i| (i * 37 % 251 + i * i % 23) % 256);
        let c = image(40, 30, |i| i / 15);
        let d = image(40, 30, |i| i / 15 + i % 5);
        for (x, y, theirs) in [(&a, &b, SKIMAGE[0]), (&c, &d, SKIMAGE[1]), (&a, &c, SKIMAGE[2])] {
            let ours = score(x, y).unwrap().ssim;
            assert!((ours - theirs).abs() < 1e-9, "{ours} against {theirs}");
        }
        assert!((score(&a, &a).unwrap().ssim - 1.0).abs() < 1e-12);
    }

    const SKIMAGE: [f64; 3] = [0.902_051_888_566_135_6, 0.996_189_390_124_528_8, 0.009_197_420_914_253_228];

    #[test]
    fn differences_of_known_images() {
        let (a, b) = (image(8, 7, |_| 100), image(8, 7, |i| if i % 2 == 0 { 103 } else { 99 }));
        let score = score(&a, &b).unwrap();
        assert_eq!((score.mse, score.l1), (5.0, 2.0));
        assert!((score.psnr_db - 41.1411).abs() < 1e-3);
        let error = mean_squared_error(&a, &image(7, 8, |_| 0)).unwrap_err().to_string();
        assert_eq!(error, "images differ in size: 8x7 against 7x8 pixels");
        assert!(super::score(&image(6, 9, |_| 0), &image(6, 9, |_| 0)).is_err());
    }
}
