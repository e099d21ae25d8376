//! Where something touches in a press: the circle of a ball, checked against image and ball, or a body at its place. From it
//! follow the imprint, and the zones around it.

use super::indenter::Indenter;
use super::{Circle, Press};
use crate::deform::Edges;
use crate::grid::{Grid, Plane};
use crate::indent::Imprint;
use crate::sensor::GelShape;
use gripgen_twin::OpticsState;
use std::sync::Arc;

/// The checked contact of a press.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contact {
    /// The rim of the contact of a ball; of another body a circle of the same place.
    pub(crate) circle: Circle,
    /// How far a ball travelled after first contact, where that was measured.
    pub(crate) travel_m: Option<f64>,
    /// A body that is no ball.
    pub(crate) indenter: Option<Arc<Indenter>>,
}

impl Contact {
    /// A ball that is known by its circle alone.
    pub(crate) fn of_circle(circle: Circle) -> Self {
        Self { circle, travel_m: None, indenter: None }
    }

    /// What a press shows, with a circle that was checked.
    pub(crate) fn of_press(press: &Press, circle: Circle) -> Self {
        Self { circle, travel_m: press.travel_m, indenter: press.indenter.clone() }
    }

    /// Distance of a pixel from the rim of the contact; negative inside a circle, 0 inside another contact.
    pub(crate) fn beyond_rim_px(&self, pixel: usize, width_px: usize) -> f64 {
        match &self.indenter {
            Some(indenter) => indenter.distance_px(pixel),
            None => {
                let x = (pixel % width_px) as f64 - self.circle.x_px;
                let y = (pixel / width_px) as f64 - self.circle.y_px;
                (x * x + y * y).sqrt() - self.circle.radius_px
            }
        }
    }

    /// The imprint of the undeformed body, relative to the gel at rest.
    ///
    /// `sink_in_fraction`: see [`crate::Pyramid`]. The press of a ball known by the circle that is seen follows from it: the
    /// cap below the circle is the rest of the press.
    pub(crate) fn imprint(
        &self,
        ball_m: f64,
        grid: &Grid,
        shape: &GelShape,
        sink_in_fraction: f64,
    ) -> Imprint {
        self.imprint_seen(ball_m, grid, shape, sink_in_fraction, &OpticsState::default())
    }

    /// The same where optics effects change the depth of the press and the edges of the body. A depth that follows from a circle
    /// stays: the circle was seen.
    pub(crate) fn imprint_seen(
        &self,
        ball_m: f64,
        grid: &Grid,
        shape: &GelShape,
        sink_in_fraction: f64,
        optics: &OpticsState,
    ) -> Imprint {
        match &self.indenter {
            Some(indenter) => {
                let travel_m = optics.press_depth_m(indenter.travel_m);
                let rounded = (optics.edge_rounding_m > 0.0)
                    .then(|| indenter.rounded(optics.edge_rounding_m / grid.metres_per_px));
                let indenter = rounded.as_ref().unwrap_or(indenter);
                let rest = shape.rest_px(grid);
                let (depth_px, edges) = indenter.depth_px(travel_m / grid.metres_per_px, rest.as_ref());
                Imprint { edges, ..imprint(depth_px, travel_m) }
            }
            None => {
                let deeper = match self.travel_m {
                    Some(travel_m) => Deeper::To(optics.press_depth_m(travel_m) / grid.metres_per_px),
                    None => Deeper::By(sink_in_fraction),
                };
                ball_imprint(&self.circle, deeper, ball_m, grid, shape)
            }
        }
    }

    /// The same with a circle no wider than a ball.
    pub(super) fn within(&self, ball_m: f64, grid: &Grid) -> Self {
        let most = 0.999 * ball_m / 2.0 / grid.metres_per_px;
        Self { circle: Circle { radius_px: self.circle.radius_px.min(most), ..self.circle }, ..self.clone() }
    }

    /// The contact in an image whose pixels are `factor` times as wide.
    pub(crate) fn in_wider_pixels(&self, factor: usize) -> Self {
        let f = factor as f64;
        let circle = Circle {
            x_px: (self.circle.x_px + 0.5) / f - 0.5,
            y_px: (self.circle.y_px + 0.5) / f - 0.5,
            radius_px: self.circle.radius_px / f,
        };
        let indenter = self.indenter.as_ref().map(|indenter| match factor {
            1 => Arc::clone(indenter),
            _ => Arc::new(indenter.in_wider_pixels(factor)),
        });
        Self { circle, travel_m: self.travel_m, indenter }
    }
}

pub(super) fn imprint(depth_px: Plane, press_depth_m: f64) -> Imprint {
    let (patch, places) = Default::default();
    Imprint { depth_px, edges: Edges::default(), press_depth_m, lift_m: 0.0, patch, places, elastic: None }
}

/// Hand-drawn circles are unsure by a few per cent: one up to so much wider than the ball is taken for its equator.
pub(super) const WIDEST: f64 = 1.05;

/// Why a mark cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MarkError {
    /// Nobody marked the contact, and none is to be seen.
    #[error("press `{press}` has no centre and radius, and no contact is to be seen in it")]
    Missing {
        /// The press.
        press: String,
    },
    /// A contact whose centre lies beside the image.
    #[error("press `{press}`: the centre ({x_px}, {y_px}) lies outside the {width_px}x{height_px} image")]
    Outside {
        /// The press.
        press: String,
        /// Centre, along the columns.
        x_px: f64,
        /// Centre, down the rows.
        y_px: f64,
        /// Width of the image.
        width_px: u32,
        /// Height of the image.
        height_px: u32,
    },
    /// A contact wider than the ball, or without width.
    #[error("press `{press}`: the radius is {radius_mm:.3} mm, the ball's {ball_mm:.3} mm")]
    Radius {
        /// The press.
        press: String,
        /// Radius of the contact.
        radius_mm: f64,
        /// Radius of the ball.
        ball_mm: f64,
    },
}

/// A press with its checked contact.
pub(super) type Marked<'a> = (&'a Press, Contact);

/// The contact of a press; the circle of a ball is at most as wide as the ball.
pub(super) fn checked(press: &Press, ball_m: f64, metres_per_px: f64) -> Result<Contact, MarkError> {
    if let (Some(_), Some(circle)) = (&press.indenter, press.circle) {
        return Ok(Contact::of_press(press, circle));
    }
    let name = || press.name.clone();
    let circle = press.circle.ok_or_else(|| MarkError::Missing { press: name() })?;
    let (width_px, height_px) = (press.image.width_px, press.image.height_px);
    let inside = |v: f64, n: u32| (-0.5..=f64::from(n) - 0.5).contains(&v);
    if !inside(circle.x_px, width_px) || !inside(circle.y_px, height_px) {
        let (x_px, y_px) = (circle.x_px, circle.y_px);
        return Err(MarkError::Outside { press: name(), x_px, y_px, width_px, height_px });
    }
    let ball_px = ball_m / 2.0 / metres_per_px;
    if !(circle.radius_px > 0.0 && circle.radius_px <= WIDEST * ball_px) {
        let radius_mm = circle.radius_px * metres_per_px * 1e3;
        return Err(MarkError::Radius { press: name(), radius_mm, ball_mm: ball_m / 2.0 * 1e3 });
    }
    let circle = Circle { radius_px: circle.radius_px.min(0.999 * ball_px), ..circle };
    Ok(Contact::of_press(press, circle))
}

/// Where a pixel lies beside the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Zone {
    /// Inside the rim of the contact.
    Contact,
    /// Up to 0.4 radii outside.
    Rim,
    /// From there to 2.2 radii outside: where shadows fall.
    Shadow,
    /// Further away.
    Far,
}

/// All zones, from the contact outwards.
pub const ZONES: [Zone; 4] = [Zone::Contact, Zone::Rim, Zone::Shadow, Zone::Far];

impl Zone {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Zone::Contact => "contact",
            Zone::Rim => "rim",
            Zone::Shadow => "shadow zone",
            Zone::Far => "far field",
        }
    }

    /// The zone at a distance from the rim of the contact, in its radii; 0 and less is inside.
    pub(super) fn at(radii_from_rim: f64) -> Zone {
        match radii_from_rim {
            d if d <= 0.0 => Zone::Contact,
            d if d < 0.4 => Zone::Rim,
            d if d < 2.2 => Zone::Shadow,
            _ => Zone::Far,
        }
    }
}

/// How deep a ball is pressed in.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Deeper {
    /// The cap below its circle is all of the press but this share, by which the gel gives way.
    By(f64),
    /// As far as this many pixels after first contact.
    To(f64),
}

/// The imprint of a ball whose rim of contact is `circle`, relative to the gel at rest.
///
/// On a flat gel without sink-in that is the cap of the ball below the plane of the circle. On a curved one the circle lies on
/// the slope of the gel under it: the ball's centre stands off the circle's by `sqrt(R^2 - a^2)` along the gel's normal.
pub(crate) fn ball_imprint(
    circle: &Circle,
    deeper: Deeper,
    ball_m: f64,
    grid: &Grid,
    shape: &GelShape,
) -> Imprint {
    let cap_px = circle.depth_m(ball_m, grid.metres_per_px) / grid.metres_per_px;
    let radius_px = ball_m / 2.0 / grid.metres_per_px;
    let sunk_px = radius_px - cap_px;
    let (w, h) = (grid.width_px, grid.height_px);
    let rest = shape.rest_px(grid);
    let rest_at = |x: f64, y: f64| {
        let inside = |v: f64, n: usize| v.round().clamp(0.0, (n - 1) as f64) as usize;
        rest.as_ref().map_or(0.0, |rest| f64::from(rest.at(inside(x, w), inside(y, h))))
    };
    let (cx, cy, a) = (circle.x_px, circle.y_px, circle.radius_px);
    let slope = [
        (rest_at(cx + a, cy) - rest_at(cx - a, cy)) / (2.0 * a),
        (rest_at(cx, cy + a) - rest_at(cx, cy - a)) / (2.0 * a),
    ];
    let ball = [cx - sunk_px * slope[0], cy - sunk_px * slope[1]];
    let rim = [(a, 0.0), (-a, 0.0), (0.0, a), (0.0, -a)];
    let squared = |x: f64, y: f64| {
        let (dx, dy) = (x - ball[0], y - ball[1]);
        dx * dx + dy * dy
    };
    let above_rest = |x: f64, y: f64| (radius_px * radius_px - squared(x, y)).max(0.0).sqrt() + rest_at(x, y);
    let level = match &rest {
        None => sunk_px,
        Some(_) => rim.iter().map(|(dx, dy)| above_rest(cx + dx, cy + dy)).sum::<f64>() / 4.0,
    };
    // Far from the ball the gel itself falls away; only the ball's own cap counts.
    let over_ball = |x: f64, y: f64| squared(x, y) < radius_px * radius_px;
    let deepest_px = match &rest {
        None => cap_px,
        Some(_) => (0..w * h)
            .map(|i| ((i % w) as f64, (i / w) as f64))
            .filter(|&(x, y)| over_ball(x, y))
            .fold(0.0, |m: f64, (x, y)| m.max(above_rest(x, y) - level)),
    };
    let press_px = match deeper {
        Deeper::By(share) => deepest_px / (1.0 - share),
        Deeper::To(press_px) => press_px,
    };
    // A ball sinks in up to its equator; the rest of a deeper press is the gel closing around it.
    let more = press_px.min(radius_px).max(deepest_px) - deepest_px;
    let depth_px = Plane::from_fn(w, h, |x, y| {
        let (x, y) = (x as f64, y as f64);
        if over_ball(x, y) { (above_rest(x, y) - level + more).max(0.0) as f32 } else { 0.0 }
    });
    imprint(depth_px, press_px * grid.metres_per_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presses::IndenterPose;
    use gripgen_twin::TriMesh;
    use nalgebra::Point3;

    const GRID: Grid = Grid { width_px: 101, height_px: 81, metres_per_px: 1e-4 };

    #[test]
    fn a_ball_is_as_deep_as_its_circle_says() {
        let circle = Circle { x_px: 50.0, y_px: 40.0, radius_px: 17.320_508 };
        let imprint = ball_imprint(&circle, Deeper::By(0.0), 4e-3, &GRID, &GelShape::Flat);
        // A circle of sqrt(3) mm is a cap of 1 mm.
        assert!((imprint.press_depth_m - 1e-3).abs() < 1e-9);
        assert!((imprint.depth_px.at(50, 40) - 10.0).abs() < 1e-4);
        assert_eq!(imprint.depth_px.at(50, 40 + 18), 0.0);
        assert!(imprint.depth_px.at(50 + 17, 40) > 0.0);
    }

    /// Hertz: on an elastic half-space the contact of a ball at depth d has a^2 = R d, half of what a gel that does not give
    /// way shows.
    #[test]
    fn a_gel_that_gives_way_is_pressed_deeper_for_the_same_circle() {
        let (radius_m, depth_m) = (20e-3, 0.2e-3_f64);
        let circle = Circle { x_px: 50.0, y_px: 40.0, radius_px: (radius_m * depth_m).sqrt() / 1e-4 };
        for shape in [GelShape::Flat, GelShape::Dome { sag_m: 1e-6 }] {
            let imprint = ball_imprint(&circle, Deeper::By(0.5), 2.0 * radius_m, &GRID, &shape);
            assert!((imprint.press_depth_m / depth_m - 1.0).abs() < 0.01, "{}", imprint.press_depth_m);
            let at_rim = f64::from(imprint.depth_px.at(50 + 20, 40)) * 1e-4;
            assert!((at_rim / depth_m - 0.5).abs() < 0.02, "{at_rim}");
            let travel = ball_imprint(&circle, Deeper::To(2.0), 2.0 * radius_m, &GRID, &shape);
            assert!((f64::from(travel.depth_px.at(50, 40)) - 2.0).abs() < 0.01);
        }
    }

    /// On a slope the rim lies on the gel all around: the ball stands beside the middle of its circle.
    #[test]
    fn on_a_dome_the_rim_lies_on_the_gel() {
        let shape = GelShape::Dome { sag_m: 1.2e-3 };
        let circle = Circle { x_px: 76.0, y_px: 40.0, radius_px: 12.0 };
        let depth = ball_imprint(&circle, Deeper::By(0.0), 4e-3, &GRID, &shape).depth_px;
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let at = |r: i64| depth.at((76 + dx * r) as usize, (40 + dy * r) as usize);
            // Inside it is as steep as the ball, 12 px beside its middle of 20: 0.75 px a pixel.
            let inside = at(10);
            assert!((0.8..2.2).contains(&inside) && at(14) == 0.0, "{dx} {dy}: {inside} {}", at(14));
        }
        let middle = depth.at(76, 40);
        assert!((3.5..6.0).contains(&middle), "{middle}");
    }

    #[test]
    fn a_ball_sinks_in_to_its_equator_at_most() {
        let circle = Circle { x_px: 50.0, y_px: 40.0, radius_px: 17.0 };
        let deep = ball_imprint(&circle, Deeper::To(35.0), 4e-3, &GRID, &GelShape::Flat);
        assert!((deep.depth_px.at(50, 40) - 20.0).abs() < 1e-4, "{}", deep.depth_px.at(50, 40));
        assert!((deep.press_depth_m - 3.5e-3).abs() < 1e-12);
    }

    #[test]
    fn wider_pixels_have_the_same_circle() {
        let fine = Contact::of_circle(Circle { x_px: 50.0, y_px: 41.0, radius_px: 12.0 });
        let wide = fine.in_wider_pixels(3).circle;
        let middle = |px: f64| (px + 0.5) / 3.0 - 0.5;
        assert_eq!((wide.x_px, wide.y_px, wide.radius_px), (middle(50.0), middle(41.0), 4.0));
        // From the rim outwards, and negative inside.
        assert_eq!(fine.beyond_rim_px(41 * GRID.width_px + 70, GRID.width_px), 8.0);
        assert_eq!(fine.beyond_rim_px(41 * GRID.width_px + 50, GRID.width_px), -12.0);
    }

    /// Effects on the depth act on depths that were measured, not on circles that were seen; those on edges on bodies.
    #[test]
    fn effects_change_what_was_measured_and_not_what_was_seen() {
        let deeper = OpticsState { press_factor: 1.5, press_offset_m: 0.1e-3, ..OpticsState::default() };
        let rounder = OpticsState { edge_rounding_m: 0.6e-3, ..OpticsState::default() };
        let depth_m = |contact: &Contact, optics: &OpticsState| {
            let imprint = contact.imprint_seen(4e-3, &GRID, &GelShape::Flat, 0.4, optics);
            (imprint.press_depth_m, imprint.depth_px.values.iter().fold(0.0f32, |m, &d| m.max(d)))
        };
        let circle = Circle { x_px: 50.0, y_px: 40.0, radius_px: 8.0 };
        let seen = Contact::of_circle(circle);
        assert_eq!(depth_m(&seen, &deeper), depth_m(&seen, &OpticsState::default()));
        let measured = Contact { travel_m: Some(0.8e-3), ..seen };
        assert!((depth_m(&measured, &deeper).0 - 1.3e-3).abs() < 1e-12);
        let at = |x: f64, y: f64, z: f64| Point3::new(x * 1e-3, y * 1e-3, z * 1e-3);
        let corners = vec![at(0.0, 0.0, 3.0), at(-2.0, -2.0, 1.0), at(2.0, -2.0, 1.0), at(0.0, 2.5, 1.0)];
        let tip = TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]).unwrap();
        let place = IndenterPose { x_px: 50.0, y_px: 40.0, rotation_rad: 0.0 };
        let body = Arc::new(Indenter::of_mesh("tip", &tip, place, 0.8e-3, &GRID).unwrap());
        let body = Contact { circle, travel_m: None, indenter: Some(body) };
        let (plain, pressed) = (depth_m(&body, &OpticsState::default()), depth_m(&body, &deeper));
        assert!(
            (pressed.0 - 1.3e-3).abs() < 1e-12 && (pressed.1 - plain.1 - 5.0).abs() < 1e-3,
            "{pressed:?}"
        );
        let rounded = depth_m(&body, &rounder);
        assert!(rounded.0 == plain.0 && rounded.1 < plain.1 - 1.0, "{rounded:?} {plain:?}");
    }
}
