//! A drawing surface: lines and areas by tiny-skia, text by a bitmap font.

use gripgen_record::encode_png;
use gripgen_twin::TactileImage;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform};

/// Space around and between what a picture shows, and height of a caption, in pixels.
pub(crate) const MARGIN: u32 = 16;
pub(crate) const CAPTION: u32 = 24;

/// A colour: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

/// Which end of a text its x coordinate names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Left,
    /// Its middle.
    Middle,
    /// Its end.
    Right,
}

/// A drawing surface of whole pixels, origin at the top left.
pub struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(width: u32, height: u32, background: Rgb) -> Self {
        let mut pixmap = Pixmap::new(width.max(1), height.max(1)).expect("a picture has a sensible size");
        pixmap.fill(colour(background));
        Self { pixmap }
    }

    /// The picture as PNG.
    pub fn into_png(self) -> Vec<u8> {
        let (width_px, height_px) = (self.pixmap.width(), self.pixmap.height());
        let rgb = self.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        encode_png(&TactileImage { width_px, height_px, rgb }).expect("an RGB picture can be encoded")
    }

    /// A filled rectangle.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, fill: Rgb) {
        let Some(rect) = Rect::from_xywh(x as f32, y as f32, width as f32, height as f32) else { return };
        self.pixmap.fill_rect(rect, &paint(fill), Transform::identity(), None);
    }

    /// A connected line. Points that are not finite interrupt it.
    pub fn line(&mut self, points: &[(f64, f64)], width: f64, ink: Rgb) {
        self.stroke(points, width, ink, None);
    }

    /// A dashed line.
    pub fn dashed(&mut self, points: &[(f64, f64)], width: f64, ink: Rgb) {
        self.stroke(points, width, ink, StrokeDash::new(vec![5.0, 4.0], 0.0));
    }

    fn stroke(&mut self, points: &[(f64, f64)], width: f64, ink: Rgb, dash: Option<StrokeDash>) {
        let mut path = PathBuilder::new();
        let mut down = false;
        for &(x, y) in points {
            if !(x.is_finite() && y.is_finite()) {
                down = false;
            } else if down {
                path.line_to(x as f32, y as f32);
            } else {
                path.move_to(x as f32, y as f32);
                down = true;
            }
        }
        let Some(path) = path.finish() else { return };
        let stroke = Stroke { width: width as f32, dash, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint(ink), &stroke, Transform::identity(), None);
    }

    /// A filled disc with a white rim.
    pub fn disc(&mut self, x: f64, y: f64, radius: f64, fill: Rgb) {
        for (r, ink) in [(radius + 1.5, Rgb(255, 255, 255)), (radius, fill)] {
            let Some(path) = PathBuilder::from_circle(x as f32, y as f32, r as f32) else { continue };
            self.pixmap.fill_path(&path, &paint(ink), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// One pixel; outside the canvas nothing happens.
    pub fn put(&mut self, x: u32, y: u32, ink: Rgb) {
        if x < self.pixmap.width() && y < self.pixmap.height() {
            let at = (y * self.pixmap.width() + x) as usize;
            self.pixmap.pixels_mut()[at] = colour(ink).premultiply().to_color_u8();
        }
    }

    /// Text whose top is at `y`. Characters that the font lacks become `?`.
    pub fn text(&mut self, text: &str, x: f64, y: f64, anchor: Anchor, style: TextStyle) {
        let (weight, height) = style.font();
        let advance = get_raster_width(weight, height) as f64;
        let width = advance * text.chars().count() as f64;
        let left = match anchor {
            Anchor::Left => x,
            Anchor::Middle => x - width / 2.0,
            Anchor::Right => x - width,
        };
        for (i, c) in text.chars().enumerate() {
            let glyph = get_raster(c, weight, height).or_else(|| get_raster('?', weight, height));
            let Some(glyph) = glyph else { continue };
            let (gx, gy) = ((left + i as f64 * advance).round() as i64, y.round() as i64);
            for (row, line) in glyph.rows().enumerate() {
                for (column, &cover) in line.iter().enumerate() {
                    self.blend(gx + column as i64, gy + row as i64, style.ink, cover);
                }
            }
        }
    }

    fn blend(&mut self, x: i64, y: i64, ink: Rgb, cover: u8) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if cover == 0 || x >= self.pixmap.width() || y >= self.pixmap.height() {
            return;
        }
        let at = (y * self.pixmap.width() + x) as usize;
        let below = self.pixmap.pixels()[at];
        let mix = |over: u8, under: u8| {
            let c = u32::from(cover);
            ((u32::from(over) * c + u32::from(under) * (255 - c) + 127) / 255) as u8
        };
        let mixed = Rgb(mix(ink.0, below.red()), mix(ink.1, below.green()), mix(ink.2, below.blue()));
        self.put(x, y, mixed);
    }
}

/// How a text looks.
#[derive(Debug, Clone, Copy)]
pub struct TextStyle {
    /// Its colour.
    pub ink: Rgb,
    /// 20 pixels high, not 16.
    pub large: bool,
    /// In bold letters.
    pub bold: bool,
}

impl TextStyle {
    /// 16 pixels high.
    pub fn small(ink: Rgb) -> Self {
        Self { ink, large: false, bold: false }
    }

    /// 20 pixels high and bold.
    pub fn title(ink: Rgb) -> Self {
        Self { ink, large: true, bold: true }
    }

    fn font(self) -> (FontWeight, RasterHeight) {
        let weight = if self.bold { FontWeight::Bold } else { FontWeight::Regular };
        (weight, if self.large { RasterHeight::Size20 } else { RasterHeight::Size16 })
    }
}

fn colour(c: Rgb) -> Color {
    Color::from_rgba8(c.0, c.1, c.2, 255)
}

fn paint(c: Rgb) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour(c));
    paint.anti_alias = true;
    paint
}

/// An image of another size: each pixel is the mean of those that it covers.
pub(crate) fn averaged(image: &TactileImage, (width_px, height_px): (u32, u32)) -> TactileImage {
    let span = |i: u32, n: u32, of: u32| {
        let step = f64::from(of) / f64::from(n);
        let from = (f64::from(i) * step) as u32;
        from.min(of - 1)..((f64::from(i + 1) * step).ceil() as u32).clamp(from + 1, of)
    };
    let mut rgb = Vec::with_capacity((3 * width_px * height_px) as usize);
    for row in 0..height_px {
        for column in 0..width_px {
            let (mut sum, mut count) = ([0_u32; 3], 0);
            for v in span(row, height_px, image.height_px) {
                for u in span(column, width_px, image.width_px) {
                    let pixel = image.pixel(u, v);
                    (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
                    count += 1;
                }
            }
            rgb.extend(sum.map(|s| (s / count) as u8));
        }
    }
    TactileImage { width_px, height_px, rgb }
}
