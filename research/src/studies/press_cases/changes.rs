//! Changes of images, by formulas of their own.

use gripgen::twin::TactileImage;

/// A change of the optics.
#[derive(Debug, Clone, Copy)]
pub enum Change {
    /// Light of each channel that settles at this share more, as a stretched exponential of the order.
    Drift([f64; 3]),
    /// A slanting wave over the frame, from a share of the presses on.
    Background { from: f64, levels: f64 },
    /// Exposure.
    Gain(f64),
    /// Gains of red, green and blue that all presses share.
    Balance([f64; 3]),
    /// Gains of red and blue of each press, by sines of the order that no smooth curve follows.
    Wandering(f64),
    /// A tone curve.
    Gamma(f64),
    /// Boxes of this half width, twice.
    Blur(i32),
    /// Pixels to the right and down, bilinear.
    Shift(f64, f64),
    /// Levels, with contact.
    Offset([f64; 3]),
    /// A turn of the colours about grey, rad.
    Hue(f64),
    /// Corners that darken with the order.
    Vignette(f64),
    /// Light that follows the lamp's voltage.
    Flicker(f64),
}

/// The image with a change; `share`: how far through the presses.
pub fn changed(image: &TactileImage, change: Change, share: f64, lamp: f64, contact: bool) -> TactileImage {
    let (w, h) = (image.width_px as usize, image.height_px as usize);
    let at = |x: i64, y: i64, c: usize| {
        let (x, y) = (x.clamp(0, w as i64 - 1) as usize, y.clamp(0, h as i64 - 1) as usize);
        f64::from(image.rgb[3 * (y * w + x) + c])
    };
    match change {
        Change::Drift(rgb) => {
            let settled = 1.0 - (-(share / 0.7_f64).powf(1.2)).exp();
            per_pixel(image, |_, _, p| [0, 1, 2].map(|c| p[c] * (1.0 + 1.3 * rgb[c] * settled)))
        }
        Change::Background { from, levels } => {
            if share < from {
                return image.clone();
            }
            per_pixel(image, |u, v, p| {
                let wave = (1.3 * u + 0.8 * v).sin();
                let hill = (-(u * u + 1.5 * v * v)).exp() - 0.55;
                [p[0] + levels * wave, p[1] + levels * (0.5 * hill - 0.6 * wave), p[2] - levels * 1.2 * hill]
            })
        }
        Change::Balance(gains) => per_pixel(image, |_, _, p| [0, 1, 2].map(|c| p[c] * gains[c])),
        Change::Wandering(size) => {
            let gains = [size * (917.0 * share).sin(), 0.0, size * (1403.0 * share + 1.0).sin()];
            per_pixel(image, |_, _, p| [0, 1, 2].map(|c| p[c] * (1.0 + 1.4 * gains[c])))
        }
        Change::Gain(gain) => per_pixel(image, |_, _, p| p.map(|v| v * gain)),
        Change::Gamma(gamma) => {
            let curve: Vec<f64> = (0..=255).map(|i| 255.0 * (f64::from(i) / 255.0).powf(gamma)).collect();
            per_pixel(image, |_, _, p| p.map(|v| curve[v as usize]))
        }
        Change::Blur(half) => boxes(&boxes(image, half), half),
        Change::Shift(dx, dy) => {
            let mut rgb = Vec::with_capacity(image.rgb.len());
            for y in 0..h {
                for x in 0..w {
                    let (fx, fy) = (x as f64 - dx, y as f64 - dy);
                    let (x0, y0) = (fx.floor(), fy.floor());
                    let (tx, ty) = (fx - x0, fy - y0);
                    let (x0, y0) = (x0 as i64, y0 as i64);
                    for c in 0..3 {
                        let top = at(x0, y0, c) * (1.0 - tx) + at(x0 + 1, y0, c) * tx;
                        let bottom = at(x0, y0 + 1, c) * (1.0 - tx) + at(x0 + 1, y0 + 1, c) * tx;
                        rgb.push((top * (1.0 - ty) + bottom * ty).round() as u8);
                    }
                }
            }
            if contact { TactileImage { rgb, ..*image } } else { image.clone() }
        }
        Change::Offset(rgb) if contact => per_pixel(image, |_, _, p| [0, 1, 2].map(|c| p[c] + rgb[c])),
        Change::Offset(_) => image.clone(),
        Change::Hue(angle) => {
            let (cos, sin) = (angle.cos(), angle.sin());
            let k = (1.0 - cos) / 3.0;
            let s = sin / 3f64.sqrt();
            per_pixel(image, |_, _, [r, g, b]| {
                [
                    r * (cos + k) + g * (k - s) + b * (k + s),
                    r * (k + s) + g * (cos + k) + b * (k - s),
                    r * (k - s) + g * (k + s) + b * (cos + k),
                ]
            })
        }
        Change::Vignette(depth) => {
            per_pixel(image, |u, v, p| p.map(|x| x * (1.0 - depth * share * (u * u + v * v).powf(1.2))))
        }
        Change::Flicker(size) => per_pixel(image, |_, _, p| p.map(|v| v * (1.0 + size * (2.0 * lamp - 1.0)))),
    }
}

fn per_pixel(image: &TactileImage, of: impl Fn(f64, f64, [f64; 3]) -> [f64; 3]) -> TactileImage {
    let (w, h) = (image.width_px as usize, image.height_px as usize);
    let mut rgb = Vec::with_capacity(image.rgb.len());
    for (i, p) in image.rgb.chunks_exact(3).enumerate() {
        let (u, v) = ((i % w) as f64 / w as f64 * 2.0 - 1.0, (i / w) as f64 / h as f64 * 2.0 - 1.0);
        rgb.extend(of(u, v, [p[0], p[1], p[2]].map(f64::from)).map(|v| v.round().clamp(0.0, 255.0) as u8));
    }
    TactileImage { rgb, ..*image }
}

/// Mean over boxes of `2 half + 1` pixels, along the rows and then down the columns.
fn boxes(image: &TactileImage, half: i32) -> TactileImage {
    let (w, h) = (image.width_px as i32, image.height_px as i32);
    let pass = |rgb: &[f64], dx: i32, dy: i32| -> Vec<f64> {
        let mut out = Vec::with_capacity(rgb.len());
        for y in 0..h {
            for x in 0..w {
                for c in 0..3 {
                    let sum: f64 = (-half..=half)
                        .map(|k| {
                            let (x, y) = ((x + k * dx).clamp(0, w - 1), (y + k * dy).clamp(0, h - 1));
                            rgb[(3 * (y * w + x) + c) as usize]
                        })
                        .sum();
                    out.push(sum / f64::from(2 * half + 1));
                }
            }
        }
        out
    };
    let rgb: Vec<f64> = image.rgb.iter().map(|&v| f64::from(v)).collect();
    let rgb = pass(&pass(&rgb, 1, 0), 0, 1);
    TactileImage { rgb: rgb.iter().map(|v| v.round().clamp(0.0, 255.0) as u8).collect(), ..*image }
}
