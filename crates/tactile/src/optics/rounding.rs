//! Edges with a radius.

use crate::grid::Plane;

/// Heights of a body whose convex edges are rounded: their opening by a ball, which is what a ball of `radius_px` covers that
/// rolls along the inside of the surface (Serra 1982). `-inf` where there is no body.
pub(crate) fn rounded(heights: &Plane, radius_px: f64) -> Plane {
    let Some(window) = Window::around(heights, radius_px.ceil() as usize) else { return heights.clone() };
    let ball = ball(radius_px);
    let inside = window.cut(heights);
    // How high the ball's centre may be, and how far up it reaches from there.
    let eroded = fold(&inside, &ball, |height, sunk| -(height + sunk));
    let opened = fold(&eroded, &ball, |centre, sunk| -centre - sunk);
    let mut out = heights.clone();
    window.paste(&opened, &mut out);
    out
}

/// Places under a ball with how far its surface lies below its top there: `r - sqrt(r^2 - x^2 - y^2)`.
fn ball(radius_px: f64) -> Vec<(i64, i64, f32)> {
    let reach = radius_px.floor() as i64;
    let places = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y)));
    places
        .filter_map(|(x, y)| {
            let left = radius_px * radius_px - (x * x + y * y) as f64;
            (left >= 0.0).then(|| (x, y, (radius_px - left.sqrt()) as f32))
        })
        .collect()
}

/// The largest of `of` over the ball at each pixel. What lies beyond the border has no say: a body that the border cuts goes on.
fn fold(plane: &Plane, ball: &[(i64, i64, f32)], of: impl Fn(f32, f32) -> f32) -> Plane {
    let (w, h) = (plane.width as i64, plane.height as i64);
    let mut values = vec![f32::NEG_INFINITY; plane.values.len()];
    for &(dx, dy, sunk) in ball {
        for y in (-dy).max(0)..(h - dy).min(h) {
            let row = (y + dy) * w + dx;
            for x in (-dx).max(0)..(w - dx).min(w) {
                let best = &mut values[(y * w + x) as usize];
                *best = best.max(of(plane.values[(row + x) as usize], sunk));
            }
        }
    }
    Plane { width: plane.width, height: plane.height, values }
}

/// The part of a plane in which there is a body, with a border around it.
struct Window {
    x0: usize,
    y0: usize,
    width: usize,
    height: usize,
}

impl Window {
    /// `None` where there is nothing.
    fn around(plane: &Plane, border: usize) -> Option<Self> {
        let solid = || (0..plane.values.len()).filter(|&i| plane.values[i] > f32::NEG_INFINITY);
        let columns = || solid().map(|i| i % plane.width);
        let rows = || solid().map(|i| i / plane.width);
        let (x0, y0) = (columns().min()?.saturating_sub(border), rows().min()?.saturating_sub(border));
        let x1 = (columns().max()? + border).min(plane.width - 1);
        let y1 = (rows().max()? + border).min(plane.height - 1);
        Some(Self { x0, y0, width: x1 + 1 - x0, height: y1 + 1 - y0 })
    }

    fn cut(&self, plane: &Plane) -> Plane {
        let row = |y: usize| &plane.values[(self.y0 + y) * plane.width + self.x0..][..self.width];
        let values = (0..self.height).flat_map(row).copied().collect();
        Plane { width: self.width, height: self.height, values }
    }

    fn paste(&self, part: &Plane, onto: &mut Plane) {
        for (y, row) in part.values.chunks_exact(self.width).enumerate() {
            let from = (self.y0 + y) * onto.width + self.x0;
            onto.values[from..from + self.width].copy_from_slice(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(of: impl Fn(f64, f64) -> f64) -> Plane {
        Plane::from_fn(80, 60, |x, y| of(x as f64 - 39.5, y as f64 - 29.5) as f32)
    }

    /// A block whose walls fall for ever: the top next to an edge lies on the circle, the middle stays.
    #[test]
    fn an_edge_becomes_an_arc() {
        let radius = 8.0;
        let block = plane(|x, y| if x.abs() < 20.0 && y.abs() < 25.0 { -1.0 } else { f64::NEG_INFINITY });
        let found = rounded(&block, radius);
        for y in 25..35 {
            for x in 20..60 {
                // The body of pixels ends in the middle of its last one.
                let inside = 19.5 - (x as f64 - 39.5).abs();
                let beyond = (radius - inside).max(0.0);
                let exact = -1.0 - (radius - (radius * radius - beyond * beyond).sqrt());
                let error = f64::from(found.at(x, y)) - exact;
                assert!(error.abs() < 1e-5, "{inside} px inside: {error}");
            }
            assert_eq!(found.at(10, y), f32::NEG_INFINITY);
        }
    }

    /// A ball that is larger than that of the opening, and a hollow, have no convex edges that are sharper.
    #[test]
    fn what_is_round_already_stays() {
        let ball = plane(|x, y| {
            let left: f64 = 30.0 * 30.0 - x * x - y * y;
            if left > 500.0 { left.sqrt() - 30.0 } else { f64::NEG_INFINITY }
        });
        let found = rounded(&ball, 6.0);
        for (y, x) in (20..40).flat_map(|y| (30..50).map(move |x| (y, x))) {
            // Rolling from pixel to pixel inside a ball of 30 one of 6 misses the points between: half of 1/6 - 1/30, times a
            // quarter in x and y, times (1 + slope^2)^1.5 at the side.
            assert!((found.at(x, y) - ball.at(x, y)).abs() < 0.05, "{x} {y}");
        }
        let hollow = plane(|x, y| (x * x + y * y) / 60.0);
        for (y, x) in (20..40).flat_map(|y| (30..50).map(move |x| (y, x))) {
            assert!((rounded(&hollow, 6.0).at(x, y) - hollow.at(x, y)).abs() < 0.02);
        }
    }

    #[test]
    fn nothing_stays_nothing() {
        let nothing = Plane::filled(80, 60, f32::NEG_INFINITY);
        assert_eq!(rounded(&nothing, 5.0), nothing);
        let block = plane(|x, _| if x.abs() < 20.0 { 0.0 } else { f64::NEG_INFINITY });
        assert_eq!(rounded(&block, 0.5), block, "less than a pixel");
    }
}
